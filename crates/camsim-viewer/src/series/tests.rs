use super::{sample_times::linspace, *};
use crate::tests::harness::{demo, long_flight};

fn loaded() -> Arc<Loaded> {
    let scenario = camsim_io::scenario_file::read_scenario(&demo(), &[], None).expect("legal");
    Arc::new(camsim_io::load::load_sequence(&scenario).expect("loaded"))
}

#[test]
fn image_speed_equals_the_finite_difference_of_the_point_on_the_axis() {
    let loaded = loaded();
    let path = &loaded.sequence.path;
    let terrain = loaded.sequence.scene.terrain.as_ref().expect("a terrain");
    for t_s in [25.3, 27.0, 28.5] {
        let pose = path.pose(t_s);
        let axis = pose.ned_from_camera * DVec3::Z;
        let point = pose.position_ned_m
            + axis * terrain.intersect(pose.position_ned_m, axis, f64::INFINITY).expect("ground").t;
        // Central difference of the ideal coordinates of the fixed point.
        let uv = |t_s: f64| {
            let pose = path.pose(t_s);
            let point_camera_m = pose.ned_from_camera.conjugate() * (point - pose.position_ned_m);
            point_camera_m.truncate() / point_camera_m.z
        };
        let h = 1e-5;
        let exact = 400.0 * (uv(t_s + h) - uv(t_s - h)).length() / (2.0 * h);
        let speed_px_s = image_speed_px_s(&loaded, 400.0, t_s);
        assert!((speed_px_s - exact).abs() < 1e-4 * exact, "{speed_px_s} {exact} px/s at {t_s} s");
    }
}

#[test]
fn plotted_errors_equal_tracker_less_log() {
    let loaded = loaded();
    let whole = Series::new(&loaded);
    check_tracking_errors(&loaded, &whole);
    check_tracking_errors(&loaded, &whole.refined(&loaded, [26.0, 26.1]));
}

fn check_tracking_errors(loaded: &Loaded, series: &Series) {
    for (axis, channel) in series.channels.iter().take(6).enumerate() {
        let error = channel.error.as_ref().expect("there is a log");
        for [t_s, error] in error.iter().step_by(97) {
            let expected = tracker_values(loaded, *t_s)[axis] - log_values(loaded, *t_s)[axis];
            assert!(
                (wrapped_deg(expected - error)).abs() < 1e-9,
                "{} at {t_s}: {expected} {error}",
                channel.name
            );
        }
    }
}

#[test]
fn unwrapped_angles_have_no_jumps() {
    let wrapped =
        [170.0, 179.0, -172.0, -160.0, 175.0].iter().enumerate().map(|(k, v)| [k as f64, *v]).collect();
    let values: Vec<f64> = unwrapped(wrapped).iter().map(|point| point[1]).collect();
    assert_eq!(values, [170.0, 179.0, 188.0, 200.0, 175.0]);
}

#[test]
fn a_refined_series_samples_the_trajectory_at_each_row_of_the_log() {
    // Long because: all checks use one long flight, which takes seconds to load.
    let folder = tempfile::tempdir().expect("a folder");
    let scenario =
        camsim_io::scenario_file::read_scenario(&long_flight(folder.path()), &[], None).expect("legal");
    let loaded = Arc::new(camsim_io::load::load_sequence(&scenario).expect("loaded"));
    let whole = Series::new(&loaded);
    let detail_s = [20_000.3, 20_002.3];
    let refined = whole.refined(&loaded, detail_s);
    assert_eq!((refined.span_s, refined.refined_s), (whole.span_s, Some(detail_s)));
    let rows_s: Vec<f64> =
        loaded.log.rows.iter().map(|row| row.t_s).filter(|t_s| is_within(*t_s, detail_s)).collect();
    assert!(rows_s.len() >= 2 && refined.rows_s == rows_s, "{:?}", refined.rows_s);
    let trajectory = &loaded.sequence.path.trajectory;
    for (axis, channel) in refined.channels.iter().enumerate() {
        assert_eq!(channel.note, whole.channels[axis].note, "summary of the whole flight");
        let (name, points) = channel.lines.last().expect("a line");
        assert!(points.is_sorted_by(|a, b| a[0] < b[0]), "{name}: strictly increasing times");
        let within: Vec<[f64; 2]> =
            points.iter().copied().filter(|point| is_within(point[0], detail_s)).collect();
        assert!(
            within.len() > 800 && rows_s.iter().all(|row| within.iter().any(|point| point[0] == *row)),
            "{name}: {}",
            within.len()
        );
        assert!(within.windows(2).all(|pair| pair[1][0] - pair[0][0] < 2.01 / 800.0));
        for [t_s, value] in within {
            let state = trajectory.state(t_s);
            let (yaw, pitch, roll) = state.ned_from_body.to_euler(EulerRot::ZYX);
            let position_ned_m = state.position_ned_m;
            let expected = match axis {
                0..=2 => position_ned_m[axis],
                3..=5 => [roll, pitch, yaw][axis - 3].to_degrees(),
                6 => loaded.log.interpolate(t_s).1.angle_between(state.ned_from_body).to_degrees(),
                7 => state.velocity_ned_m_s.length(),
                8 => state.acceleration_ned_m_s2.length(),
                9 => state.rate_body_rad_s.length().to_degrees(),
                _ => continue,
            };
            let difference =
                if (3..=5).contains(&axis) { wrapped_deg(value - expected) } else { value - expected };
            // acos of nearly 1 keeps half the digits.
            let format_error = if axis == 6 { 3e-6 } else { 1e-9 };
            assert!(difference.abs() < format_error, "{name} at {t_s}: {value} {expected}");
            assert!(axis != 5 || value.abs() < 400.0, "turns made before the span are removed: {value}");
        }
        // Unchanged outside the refined span, but for turns of angles.
        if !(3..=5).contains(&axis) {
            let outside = |series: &Series| {
                let points = series.channels[axis].lines[0].1.iter().copied();
                points.filter(|point| !is_within(point[0], detail_s)).collect::<Vec<_>>()
            };
            assert_eq!(outside(&refined), outside(&whole), "{name}");
        }
    }
    // The log's line passes through the rows.
    for (axis, row_value) in
        (0..3).map(|axis| (axis, move |row: &camsim_core::flight_log::LogRow| row.position_ned_m[axis]))
    {
        for row in loaded.log.rows.iter().filter(|row| is_within(row.t_s, detail_s)) {
            let point = refined.channels[axis].lines[0]
                .1
                .iter()
                .find(|point| point[0] == row.t_s)
                .expect("a point of its own");
            assert!((point[1] - row_value(row)).abs() < 1e-9);
        }
    }
}

#[test]
fn stated_maxima_are_not_exceeded_between_points() {
    let loaded = loaded();
    let series = Series::new(&loaded);
    let trajectory = &loaded.sequence.path.trajectory;
    let stated = |index: usize| {
        series.channels[index].note.trim_start_matches("up to ").parse::<f64>().expect("a number")
    };
    let [speed, acceleration, rate] = [7, 8, 9].map(stated);
    let mut largest = [0.0_f64; 3];
    for t_s in linspace(series.span_s, 100_000) {
        let state = trajectory.state(t_s);
        let values =
            [state.velocity_ned_m_s, state.acceleration_ned_m_s2, state.rate_body_rad_s].map(DVec3::length);
        largest = std::array::from_fn(|k| largest[k].max(values[k]));
    }
    for (stated, sampled) in
        [(speed, largest[0]), (acceleration, largest[1]), (rate, largest[2].to_degrees())]
    {
        assert!(sampled <= stated + 5.1e-4 && sampled > 0.99 * stated, "{sampled} sampled, {stated} stated");
    }
}

#[test]
fn tracker_angles_are_plotted_on_the_turn_of_the_log() {
    let mut lines = vec![
        ("log", vec![[0.0, 10.0], [1.0, 725.0], [2.0, 735.0]]),
        ("tracker", vec![[0.0, 9.0], [1.0, 724.0], [2.0, 736.0]]),
    ];
    remove_turns(&mut lines, 1.0);
    assert_eq!(lines[0].1, [[0.0, -710.0], [1.0, 5.0], [2.0, 15.0]]);
    assert_eq!(lines[1].1, [[0.0, -711.0], [1.0, 4.0], [2.0, 16.0]]);
    let series = Series::new(&loaded());
    for channel in &series.channels[3..6] {
        for (log, tracker) in channel.lines[0].1.iter().zip(&channel.lines[1].1) {
            assert!((log[1] - tracker[1]).abs() < 90.0, "{}: {log:?} {tracker:?}", channel.name);
        }
    }
}
