use super::{instants::even, *};
use crate::tests::harness::{demo, long_flight};

fn loaded() -> Arc<Loaded> {
    let scenario = camsim_io::scenario_file::read_scenario(&demo(), &[], None).expect("legal");
    Arc::new(camsim_io::load::load_sequence(&scenario).expect("loaded"))
}

#[test]
fn image_speed_is_that_of_the_point_in_the_middle() {
    let loaded = loaded();
    let path = &loaded.sequence.path;
    let terrain = loaded.sequence.scene.terrain.as_ref().expect("a terrain");
    for t_s in [25.3, 27.0, 28.5] {
        let pose = path.pose(t_s);
        let axis = pose.ned_from_camera * DVec3::Z;
        let point = pose.position_ned_m
            + axis * terrain.intersect(pose.position_ned_m, axis, f64::INFINITY).expect("ground").t;
        // Central difference of the fixed point's ideal coordinates.
        let uv = |t_s: f64| {
            let pose = path.pose(t_s);
            let seen = pose.ned_from_camera.conjugate() * (point - pose.position_ned_m);
            seen.truncate() / seen.z
        };
        let h = 1e-5;
        let exact = 400.0 * (uv(t_s + h) - uv(t_s - h)).length() / (2.0 * h);
        let found = image_speed_px_s(&loaded, 400.0, t_s);
        assert!((found - exact).abs() < 1e-4 * exact, "{found} {exact} px/s at {t_s} s");
    }
}

#[test]
fn errors_are_those_of_the_tracker_at_its_instants() {
    let loaded = loaded();
    let whole = Series::new(&loaded);
    errors_are_those_of_the_tracker(&loaded, &whole);
    errors_are_those_of_the_tracker(&loaded, &whole.closer(&loaded, [26.0, 26.1]));
}

fn errors_are_those_of_the_tracker(loaded: &Loaded, series: &Series) {
    for (axis, channel) in series.channels.iter().take(6).enumerate() {
        let error = channel.error.as_ref().expect("there is a log");
        for [t_s, error] in error.iter().step_by(97) {
            let found = of_tracker(loaded, *t_s)[axis] - of_log(loaded, *t_s)[axis];
            assert!((shorter_deg(found - error)).abs() < 1e-9, "{} at {t_s}: {found} {error}", channel.name);
        }
    }
}

#[test]
fn angles_have_no_jumps() {
    let wrapped =
        [170.0, 179.0, -172.0, -160.0, 175.0].iter().enumerate().map(|(k, v)| [k as f64, *v]).collect();
    let values: Vec<f64> = continuous(wrapped).iter().map(|point| point[1]).collect();
    assert_eq!(values, [170.0, 179.0, 188.0, 200.0, 175.0]);
}

#[test]
fn a_closer_look_is_that_of_the_trajectory_and_has_each_row() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenario =
        camsim_io::scenario_file::read_scenario(&long_flight(folder.path()), &[], None).expect("legal");
    let loaded = Arc::new(camsim_io::load::load_sequence(&scenario).expect("loaded"));
    let whole = Series::new(&loaded);
    let part_s = [20_000.3, 20_002.3];
    let closer = whole.closer(&loaded, part_s);
    assert_eq!((closer.span_s, closer.closer_s), (whole.span_s, Some(part_s)));
    let rows_s: Vec<f64> =
        loaded.log.rows.iter().map(|row| row.t_s).filter(|t_s| is_within(*t_s, part_s)).collect();
    assert!(rows_s.len() >= 2 && closer.rows_s == rows_s, "{:?}", closer.rows_s);
    let trajectory = &loaded.sequence.path.trajectory;
    for (axis, channel) in closer.channels.iter().enumerate() {
        assert_eq!(channel.note, whole.channels[axis].note, "of the whole flight");
        let (name, points) = channel.lines.last().expect("a line");
        assert!(points.is_sorted_by(|a, b| a[0] < b[0]), "{name}: in order, no instant twice");
        let within: Vec<[f64; 2]> =
            points.iter().copied().filter(|point| is_within(point[0], part_s)).collect();
        assert!(
            within.len() > 800 && rows_s.iter().all(|row| within.iter().any(|point| point[0] == *row)),
            "{name}: {}",
            within.len()
        );
        assert!(within.windows(2).all(|pair| pair[1][0] - pair[0][0] < 2.01 / 800.0));
        for [t_s, value] in within {
            let state = trajectory.state(t_s);
            let (yaw, pitch, roll) = state.ned_from_body.to_euler(EulerRot::ZYX);
            let place = state.position_ned_m;
            let expected = match axis {
                0..=2 => place[axis],
                3..=5 => [roll, pitch, yaw][axis - 3].to_degrees(),
                6 => loaded.log.interpolate(t_s).1.angle_between(state.ned_from_body).to_degrees(),
                7 => state.velocity_ned_m_s.length(),
                8 => state.acceleration_ned_m_s2.length(),
                9 => state.rate_body_rad_s.length().to_degrees(),
                _ => continue,
            };
            let difference =
                if (3..=5).contains(&axis) { shorter_deg(value - expected) } else { value - expected };
            // Of a small angle acos keeps half the digits.
            let digits = if axis == 6 { 3e-6 } else { 1e-9 };
            assert!(difference.abs() < digits, "{name} at {t_s}: {value} {expected}");
            assert!(axis != 5 || value.abs() < 400.0, "no turns of hours before: {value}");
        }
        // Beyond it as before, but for angles' turns.
        if !(3..=5).contains(&axis) {
            let outside = |series: &Series| {
                let points = series.channels[axis].lines[0].1.iter().copied();
                points.filter(|point| !is_within(point[0], part_s)).collect::<Vec<_>>()
            };
            assert_eq!(outside(&closer), outside(&whole), "{name}");
        }
    }
    // At rows the log's line is the log.
    for (axis, of_row) in
        (0..3).map(|axis| (axis, move |row: &camsim_core::flight_log::LogRow| row.position_ned_m[axis]))
    {
        for row in loaded.log.rows.iter().filter(|row| is_within(row.t_s, part_s)) {
            let found = closer.channels[axis].lines[0]
                .1
                .iter()
                .find(|point| point[0] == row.t_s)
                .expect("a point of its own");
            assert!((found[1] - of_row(row)).abs() < 1e-9);
        }
    }
}

#[test]
fn what_is_said_to_be_the_largest_is_not_exceeded_between_points() {
    let loaded = loaded();
    let series = Series::new(&loaded);
    let trajectory = &loaded.sequence.path.trajectory;
    let said =
        |at: usize| series.channels[at].note.trim_start_matches("up to ").parse::<f64>().expect("a number");
    let [speed, acceleration, rate] = [7, 8, 9].map(said);
    let mut largest = [0.0_f64; 3];
    for t_s in even(series.span_s, 100_000) {
        let state = trajectory.state(t_s);
        let found =
            [state.velocity_ned_m_s, state.acceleration_ned_m_s2, state.rate_body_rad_s].map(DVec3::length);
        largest = std::array::from_fn(|k| largest[k].max(found[k]));
    }
    for (said, found) in [(speed, largest[0]), (acceleration, largest[1]), (rate, largest[2].to_degrees())] {
        assert!(found <= said + 5.1e-4 && found > 0.99 * said, "{found} found, {said} said");
    }
}

#[test]
fn the_tracker_lies_beside_the_log_and_not_a_turn_away() {
    let mut lines = vec![
        ("log", vec![[0.0, 10.0], [1.0, 725.0], [2.0, 735.0]]),
        ("tracker", vec![[0.0, 9.0], [1.0, 724.0], [2.0, 736.0]]),
    ];
    less_turns(&mut lines, 1.0);
    assert_eq!(lines[0].1, [[0.0, -710.0], [1.0, 5.0], [2.0, 15.0]]);
    assert_eq!(lines[1].1, [[0.0, -711.0], [1.0, 4.0], [2.0, 16.0]]);
    let series = Series::new(&loaded());
    for channel in &series.channels[3..6] {
        for (log, tracker) in channel.lines[0].1.iter().zip(&channel.lines[1].1) {
            assert!((log[1] - tracker[1]).abs() < 90.0, "{}: {log:?} {tracker:?}", channel.name);
        }
    }
}
