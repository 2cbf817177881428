//! Model as text.

use std::io::Write;

use super::model::Model;
use crate::formats::axes::Rigid;
use crate::formats::colmap::write::camera_line;
use crate::formats::exporting::{DatasetError, ExportJob};
use crate::text::numbers::wxyz;
use crate::write::Number;

/// Writes the five files.
pub(super) fn write(job: &ExportJob<'_>, model: &Model<'_>, folder: &str) -> Result<(), DatasetError> {
    let name = |file: &str| format!("{folder}/{file}.txt");
    job.target.stream(&name("cameras"), &mut |out| {
        writeln!(
            out,
            "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: {}",
            model.cameras().len()
        )?;
        model.cameras().iter().try_for_each(|camera| {
            Ok(writeln!(out, "{}", camera_line(camera.id, camera.name, camera.size_px, &camera.parameters))?)
        })
    })?;
    job.target.stream(&name("rigs"), &mut |out| {
        writeln!(
            out,
            "# RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[] as (SENSOR_TYPE, SENSOR_ID, HAS_POSE, \
             [QW, QX, QY, QZ, TX, TY, TZ])\n# Number of rigs: {}",
            model.rigs().len()
        )?;
        model.rigs().iter().try_for_each(|rig| {
            write!(out, "{} {}", rig.id, rig.sensors.len())?;
            for (index, sensor) in rig.sensors.iter().enumerate() {
                write!(out, " CAMERA {}", model.cameras()[sensor.camera].id)?;
                if index > 0 {
                    write!(out, " 1 {}", pose(&sensor.sensor_from_rig))?;
                }
            }
            Ok(writeln!(out)?)
        })
    })?;
    job.target.stream(&name("images"), &mut |out| {
        writeln!(
            out,
            "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n# Number of \
             images: {}, mean observations per image: {}",
            model.images(),
            model.mean_observations()
        )?;
        model.each_image(&mut |image| {
            writeln!(out, "{} {} {} {}", image.id, pose(&image.camera_from_world), image.camera, image.name)?;
            for (i, (x, y, point)) in image.points.iter().enumerate() {
                write!(out, "{}{} {} {point}", if i > 0 { " " } else { "" }, Number(*x), Number(*y))?;
            }
            Ok(writeln!(out)?)
        })
    })?;
    job.target.stream(&name("frames"), &mut |out| {
        writeln!(
            out,
            "# FRAME_ID, RIG_ID, RIG_FROM_WORLD[QW, QX, QY, QZ, TX, TY, TZ], NUM_DATA_IDS, DATA_IDS[] as (SENSOR_TYPE, \
             SENSOR_ID, DATA_ID)\n# Number of frames: {}",
            model.frames()
        )?;
        model.each_frame(&mut |frame| {
            let (id, rig, pose) = (frame.id, frame.rig, pose(&frame.rig_from_world));
            write!(out, "{id} {rig} {pose} {}", frame.images.len())?;
            frame.images.iter().try_for_each(|(camera, image)| write!(out, " CAMERA {camera} {image}"))?;
            Ok(writeln!(out)?)
        })
    })?;
    job.target.stream(&name("points3D"), &mut |out| {
        writeln!(
            out,
            "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n# Number of points: {}",
            model.points()
        )?;
        model.each_point(&mut |point| {
            let [r, g, b] = point.rgb;
            let position = joined(&point.position_m.to_array());
            write!(out, "{} {position} {r} {g} {b} {}", point.id, Number(model.error_px()))?;
            point.track.iter().try_for_each(|(image, index)| write!(out, " {image} {index}"))?;
            Ok(writeln!(out)?)
        })
    })
}

fn joined(values: &[f64]) -> String {
    values.iter().map(|value| Number(*value).to_string()).collect::<Vec<_>>().join(" ")
}

fn pose(pose: &Rigid) -> String {
    joined(&[&wxyz(pose.rotation)[..], &pose.translation_m.to_array()].concat())
}
