//! EuRoC/ASL: `mav0/cam0/{data.csv, sensor.yaml, exposure.csv, data/NS.png}`, `imu0`, ground truth.

use std::io::Write;

use camsim_core::pose::ENU_FROM_NED;
use glam::DVec3;

use super::settings;
use super::write::sensor_yaml;
use crate::formats::axes::{Rigid, enu};
use crate::formats::exporting::imu::{ImuSensor, body_from_b, imus};
use crate::formats::exporting::page::{MASK, OPTICAL, PIXEL_CENTRE_0, Page, WORLD, timing};
use crate::formats::exporting::pictures::Samples;
use crate::formats::exporting::run_folder::RunCamera;
use crate::formats::exporting::stamps::name_ns;
use crate::formats::exporting::{DatasetError, ExportJob, Layout, pictures, receivers};
use crate::formats::writing::lens_names::{self, Family};
use crate::text::numbers::{matrix_list, real, wxyz};
use crate::write::Number;

pub(crate) const LAYOUT: Layout = Layout {
    judge: Some(|camera| lens_names::lens(Family::Euroc, camera).map(drop)),
    begins_at_zero: true,
    ..Layout::new(write)
};

/// Writes the export; returns notes.
fn write(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    let imus = imus(job.run)?;
    let body_from_b = body_from_b(imus.first());
    let mut notes = Vec::new();
    for (i, camera) in job.run.cameras.iter().enumerate() {
        camera.require(job.name(), &["color_png"])?;
        write_camera(job, i, camera, &body_from_b)?;
        notes.extend(lens_names::euroc_note(&camera.calibration()?, &format!("cam{i}")));
    }
    for (i, imu) in imus.iter().enumerate() {
        write_imu(job, i, imu, &body_from_b)?;
    }
    let receivers = receivers::write(job, &body_from_b)?;
    write_truth(job, &body_from_b, imus.first())?;
    notes.extend(settings::write(job, &imus, &body_from_b)?);
    job.target.text("README.md", &page(job, imus.first(), &receivers, &notes))?;
    Ok(notes)
}

fn write_camera(
    job: &ExportJob<'_>,
    i: usize,
    camera: &RunCamera,
    body_from_b: &Rigid,
) -> Result<(), DatasetError> {
    let calibration = camera.calibration()?;
    let b_from_camera = body_from_b.inverse().of(&camera.body_from_camera());
    let name = |file: &str| format!("mav0/cam{i}/{file}");
    let samples = Samples::of_estimators(job);
    job.each_frame(camera, |frame| {
        pictures::put(job, camera, frame, samples, &name(&format!("data/{}.png", name_ns(frame.stamp_ns))))
    })?;
    if let Some(mask) = pictures::mask(camera)? {
        mask.write(job, &name("mask.png"), 255)?;
    }
    job.target.text(&name("sensor.yaml"), &sensor_yaml(&calibration, &b_from_camera)?)?;
    job.target.stream(&name("data.csv"), &mut |out| {
        writeln!(out, "#timestamp [ns],filename")?;
        camera.frames.iter().try_for_each(|frame| {
            // Some readers make names of pictures from the first column.
            let stamp = name_ns(frame.stamp_ns);
            Ok(writeln!(out, "{stamp},{stamp}.png")?)
        })
    })?;
    job.target.stream(&name("exposure.csv"), &mut |out| {
        writeln!(out, "#timestamp [ns],exposure time[ns]")?;
        camera.frames.iter().try_for_each(|frame| {
            Ok(writeln!(out, "{},{}", name_ns(frame.stamp_ns), (frame.exposure_ms * 1e6).round())?)
        })
    })?;
    job.target.stream(&format!("settings/times_cam{i}.txt"), &mut |out| {
        camera.frames.iter().try_for_each(|frame| Ok(writeln!(out, "{}", name_ns(frame.stamp_ns))?))
    })
}

/// Measurements of an inertial sensor, and its noise.
fn write_imu(
    job: &ExportJob<'_>,
    i: usize,
    imu: &ImuSensor,
    body_from_b: &Rigid,
) -> Result<(), DatasetError> {
    let mut rows = imu.rows()?;
    job.target.stream(&format!("mav0/imu{i}/data.csv"), &mut |out| {
        writeln!(
            out,
            "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y \
             [m s^-2],a_RS_S_z [m s^-2]"
        )?;
        while let Some(row) = rows.next_row()? {
            write!(out, "{}", row.t_ns)?;
            write_cells(out, &[row.gyro_rad_s, row.acc_m_s2].map(|v| v.to_array()).concat())?;
        }
        Ok(())
    })?;
    let b_from_imu = body_from_b.inverse().of(&imu.body_from_imu);
    let yaml = format!(
        "sensor_type: imu\ncomment: camsim\nT_BS:\n  cols: 4\n  rows: 4\n  data: {}\n\nrate_hz: {}\n\
         gyroscope_noise_density: {}\ngyroscope_random_walk: {}\naccelerometer_noise_density: {}\n\
         accelerometer_random_walk: {}\n",
        matrix_list(&b_from_imu.matrix()),
        real(imu.rate_hz),
        real(imu.noise.gyroscope_noise_density),
        real(imu.noise.gyroscope_random_walk),
        real(imu.noise.accelerometer_noise_density),
        real(imu.noise.accelerometer_random_walk)
    );
    job.target.text(&format!("mav0/imu{i}/sensor.yaml"), &yaml)
}

/// Ends a line with numbers, each with a comma before it.
fn write_cells(out: &mut impl Write, values: &[f64]) -> Result<(), DatasetError> {
    values.iter().try_for_each(|value| write!(out, ",{}", Number(*value)))?;
    Ok(writeln!(out)?)
}

/// The clock of estimates: that of the IMU, or of the first camera where there is none; how much it is ahead of the
/// run's, nanoseconds.
fn truth_clock(job: &ExportJob<'_>, imu: Option<&ImuSensor>) -> (&'static str, i64) {
    match imu {
        Some(imu) => ("imu0", imu.clock_offset_ns()),
        None => ("cam0", job.run.cameras[0].spec.clock_offset_ns()),
    }
}

/// The motion of B: position, attitude, velocity and biases.
fn write_truth(
    job: &ExportJob<'_>,
    body_from_b: &Rigid,
    imu: Option<&ImuSensor>,
) -> Result<(), DatasetError> {
    let (_, ahead_ns) = truth_clock(job, imu);
    let mut biases = imu.map(ImuSensor::biases).transpose()?;
    let (mut rows, body_from_b) = match imu.filter(|imu| imu.shakes) {
        Some(imu) => (imu.states()?, &Rigid::IDENTITY),
        None => (job.run.platform()?, body_from_b),
    };
    job.target.stream("mav0/state_groundtruth_estimate0/data.csv", &mut |out| {
        writeln!(
            out,
            "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], \
             v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], \
             b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]"
        )?;
        while let Some(state) = rows.next_state()? {
            let lever_m = body_from_b.translation_m;
            let position = enu(state.position_ned_m + state.ned_from_body * lever_m);
            let attitude = wxyz(ENU_FROM_NED * state.ned_from_body * body_from_b.rotation);
            let swing = state.ned_from_body * state.rate_body_rad_s.cross(lever_m);
            let velocity = enu(state.velocity_ned_m_s + swing);
            let [gyro, acc] = match &mut biases {
                Some(biases) => biases.at(state.t_ns)?,
                None => [DVec3::ZERO; 2],
            };
            write!(out, "{}", state.t_ns.saturating_add(ahead_ns))?;
            let values = [&position.to_array()[..], &attitude].concat();
            let vectors = [velocity, gyro, acc].map(|v| v.to_array()).concat();
            write_cells(out, &[values, vectors].concat())?;
        }
        Ok(())
    })?;
    let yaml = format!(
        "sensor_type: visual-inertial\ncomment: camsim, exact\nT_BS:\n  cols: 4\n  rows: 4\n  data: {}\n",
        matrix_list(&Rigid::IDENTITY.matrix())
    );
    job.target.text("mav0/state_groundtruth_estimate0/sensor.yaml", &yaml)
}

fn page(job: &ExportJob<'_>, imu: Option<&ImuSensor>, receivers: &[String], notes: &[String]) -> String {
    let mut page = Page::new("EuRoC/ASL folder", job);
    let (clock, ahead_ns) = truth_clock(job, imu);
    let body = match imu {
        Some(_) => {
            "the axes of imu0: `T_BS` of imu0 is the identity, and the ground truth is that of the IMU"
        }
        None => {
            "the platform, x forward, y left, z up (camsim's own is forward, right, down); there is no IMU, and the \
             biases are 0"
        }
    };
    page.line("world R", WORLD)
        .line("body B", body)
        .line("camera S", OPTICAL)
        .line("`T_BS`", "takes coordinates of the sensor to those of B; without the mount's vibration")
        .line("quaternions", "w x y z, world from B, w not negative")
        .line("pixels", PIXEL_CENTRE_0)
        .line("pictures", Samples::of_estimators(job).words())
        .line("`mask.png`", MASK)
        .line(
            "stamps",
            "nanoseconds, of each sensor by its own clock; a camera's delay is in them. Names of pictures have 19 digits",
        )
        .line(
            "time of the ground truth",
            &format!(
                "by the clock of {clock}, which estimates are on: {} ms ahead of the run's. Biases are those of the true \
                 time",
                ahead_ns as f64 / 1e6
            ),
        )
        .line("`imuN/data.csv`", "angular rates, then accelerations");
    for receiver in receivers {
        page.line(&format!("`{receiver}`"), "columns as in docs/guide/SENSORS.md, measured values alone");
    }
    for (i, camera) in job.run.cameras.iter().enumerate() {
        page.line(&format!("time of cam{i}"), &timing(camera));
    }
    page.note(
        "`settings` holds `times_camN.txt` (ORB-SLAM3's list of stamps) and settings of other programs.",
    );
    page.ending(notes)
}
