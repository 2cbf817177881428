//! Kalibr: folders of its bag creator, `camchain.yaml`, `imu.yaml`, `target.yaml`.

use std::io::Write;

use camsim_core::scenario::BoardKind;

use super::write::{PoseKey, chain_yaml};
use crate::formats::exporting::imu::{ImuSensor, imus};
use crate::formats::exporting::page::{MASK, OPTICAL, PIXEL_CENTRE_0, Page};
use crate::formats::exporting::pictures::Samples;
use crate::formats::exporting::run_folder::RunCamera;
use crate::formats::exporting::stamps::name_ns;
use crate::formats::exporting::{DatasetError, ExportJob, Layout, pictures};
use crate::text::numbers::real;
use crate::write::{Number, imu_yaml};

pub(crate) const LAYOUT: Layout = Layout {
    judge: Some(|camera| chain_yaml(std::slice::from_ref(camera), None, PoseKey::CamImu).map(drop)),
    begins_at_zero: true,
    ..Layout::new(write)
};

/// Writes the export; returns notes.
fn write(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    let imus = imus(job.run)?;
    let cameras = job.run.cameras.iter().map(RunCamera::calibration).collect::<Result<Vec<_>, _>>()?;
    let reference = imus.first().map(ImuSensor::reference);
    let chain = chain_yaml(&cameras, reference.as_ref(), PoseKey::CamImu)?;
    let samples = Samples::of_estimators(job);
    for (i, camera) in job.run.cameras.iter().enumerate() {
        camera.require(job.name(), &["color_png"])?;
        job.each_frame(camera, |frame| {
            // Its reader takes the last nine digits as nanoseconds, and sorts names.
            let name = format!("cam{i}/{}.png", name_ns(frame.stamp_ns));
            pictures::put(job, camera, frame, samples, &name)
        })?;
        if let Some(mask) = pictures::mask(camera)? {
            // Not in its folder, of which the bag creator takes all pictures.
            mask.write(job, &format!("mask_cam{i}.png"), 255)?;
        }
    }
    for (i, imu) in imus.iter().enumerate() {
        write_imu(job, i, imu)?;
    }
    job.target.text("camchain.yaml", &chain)?;
    if let Some(target) = target_yaml(job)? {
        job.target.text("target.yaml", &target)?;
    }
    let notes = imus.first().and_then(|imu| imu.begins_late(job.run)).into_iter().collect::<Vec<_>>();
    job.target.text("README.md", &page(job, &imus, &notes))?;
    Ok(notes)
}

/// Measurements and noise of an inertial sensor.
fn write_imu(job: &ExportJob<'_>, i: usize, imu: &ImuSensor) -> Result<(), DatasetError> {
    let mut rows = imu.rows()?;
    job.target.stream(&format!("imu{i}.csv"), &mut |out| {
        writeln!(out, "timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z")?;
        while let Some(row) = rows.next_row()? {
            let [w, a] = [row.gyro_rad_s, row.acc_m_s2].map(|v| v.to_array().map(Number));
            writeln!(out, "{},{},{},{},{},{},{}", name_ns(row.t_ns), w[0], w[1], w[2], a[0], a[1], a[2])?;
        }
        Ok(())
    })?;
    job.target.text(&format!("imu{i}.yaml"), &imu_yaml(&imu.noise, &format!("imu{i}"), imu.rate_hz))
}

/// Kalibr's target file for the board of the scene, if it knows boards of this kind.
fn target_yaml(job: &ExportJob<'_>) -> Result<Option<String>, DatasetError> {
    let Some(board) = &job.run.manifest().scenario.scene.board else { return Ok(None) };
    // A board of the user's own target file has none of these.
    let (Some(columns), Some(rows), Some(size_m)) = (board.columns, board.rows, board.size_m) else {
        return Ok(None);
    };
    let row_size_m = real(board.row_size_m.unwrap_or(size_m));
    let size_m = real(size_m);
    Ok(match board.kind {
        Some(BoardKind::Aprilgrid) => Some(format!(
            "target_type: 'aprilgrid'\ntagCols: {columns}\ntagRows: {rows}\ntagSize: {size_m}\ntagSpacing: {}\n",
            real(board.spacing.unwrap_or(0.3))
        )),
        Some(BoardKind::Chessboard) => Some(format!(
            "target_type: 'checkerboard'\ntargetCols: {columns}\ntargetRows: {rows}\nrowSpacingMeters: \
             {row_size_m}\ncolSpacingMeters: {size_m}\n"
        )),
        Some(kind @ (BoardKind::Circles | BoardKind::AsymmetricCircles)) => Some(format!(
            "target_type: 'circlegrid'\ntargetCols: {columns}\ntargetRows: {rows}\nspacingMeters: {size_m}\n\
             asymmetricGrid: {}\n",
            kind == BoardKind::AsymmetricCircles
        )),
        Some(BoardKind::Charuco) | None => None,
    })
}

fn page(job: &ExportJob<'_>, imus: &[ImuSensor], notes: &[String]) -> String {
    let mut page = Page::new("Kalibr, for its bag creator", job);
    let samples = Samples::of_estimators(job);
    page.line("names", "`camN/NS.png`, the stamp in nanoseconds with 19 digits")
        .line("pictures", samples.words())
        .line("`mask_camN.png`", MASK)
        .line("camera", OPTICAL)
        .line("pixels", PIXEL_CENTRE_0)
        .line(
            "`camchain.yaml`",
            "the true chain: `T_cam_imu`, `T_cn_cnm1` without the mount's vibration; `timeshift_cam_imu` takes \
             stamps of the camera to the IMU's time of the image's centre (minus the camera's delay); `line_delay` in seconds",
        )
        .line("`imuN.yaml`", "continuous-time noise densities and bias random walks");
    if imus.is_empty() {
        page.line("IMU", "none in this run, so there is no `T_cam_imu`");
    }
    page.shutters(job);
    page.note("`kalibr_bagcreater --folder . --output-bag run.bag` makes a bag of it.");
    page.ending(notes)
}
