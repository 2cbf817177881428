//! Binary model: little-endian, numbers of elements first.

use std::io::Write;

use super::model::Model;
use super::rigs::ModelRig;
use crate::formats::axes::Rigid;
use crate::formats::exporting::{DatasetError, ExportJob};
use crate::text::numbers::wxyz;

/// Number of the sensors that are cameras.
const CAMERA: i32 = 0;

/// Writes the five files.
pub(super) fn write(job: &ExportJob<'_>, model: &Model<'_>, folder: &str) -> Result<(), DatasetError> {
    let name = |file: &str| format!("{folder}/{file}.bin");
    job.target.stream(&name("cameras"), &mut |out| {
        put_u64(out, model.cameras().len() as u64)?;
        for camera in model.cameras() {
            put_u32(out, camera.id)?;
            out.write_all(&camera.number.to_le_bytes())?;
            camera.size_px.iter().try_for_each(|side| put_u64(out, u64::from(*side)))?;
            put_f64(out, &camera.parameters)?;
        }
        Ok(())
    })?;
    job.target.stream(&name("rigs"), &mut |out| {
        put_u64(out, model.rigs().len() as u64)?;
        model.rigs().iter().try_for_each(|rig| put_rig(out, model, rig))
    })?;
    job.target.stream(&name("images"), &mut |out| {
        put_u64(out, model.images())?;
        model.each_image(&mut |image| {
            put_u32(out, image.id)?;
            put_pose(out, &image.camera_from_world)?;
            put_u32(out, image.camera)?;
            out.write_all(image.name.as_bytes())?;
            out.write_all(&[0])?;
            put_u64(out, image.points.len() as u64)?;
            for (x, y, point) in image.points {
                put_f64(out, &[*x, *y])?;
                put_u64(out, *point)?;
            }
            Ok(())
        })
    })?;
    job.target.stream(&name("frames"), &mut |out| {
        put_u64(out, model.frames())?;
        model.each_frame(&mut |frame| {
            put_u32(out, frame.id)?;
            put_u32(out, frame.rig)?;
            put_pose(out, &frame.rig_from_world)?;
            put_u32(out, frame.images.len() as u32)?;
            frame.images.iter().try_for_each(|(camera, image)| {
                put_sensor(out, *camera)?;
                put_u64(out, u64::from(*image))
            })
        })
    })?;
    job.target.stream(&name("points3D"), &mut |out| {
        put_u64(out, model.points())?;
        model.each_point(&mut |point| {
            put_u64(out, point.id)?;
            put_f64(out, &point.position_m.to_array())?;
            out.write_all(&point.rgb)?;
            put_f64(out, &[model.error_px()])?;
            put_u64(out, point.track.len() as u64)?;
            point.track.iter().try_for_each(|(image, index)| {
                put_u32(out, *image)?;
                put_u32(out, *index)
            })
        })
    })
}

/// The sensor of reference, then the others with their poses.
fn put_rig(out: &mut dyn Write, model: &Model<'_>, rig: &ModelRig) -> Result<(), DatasetError> {
    put_u32(out, rig.id)?;
    put_u32(out, rig.sensors.len() as u32)?;
    for (index, sensor) in rig.sensors.iter().enumerate() {
        put_sensor(out, model.cameras()[sensor.camera].id)?;
        if index > 0 {
            out.write_all(&[1])?;
            put_pose(out, &sensor.sensor_from_rig)?;
        }
    }
    Ok(())
}

fn put_sensor(out: &mut dyn Write, camera: u32) -> Result<(), DatasetError> {
    out.write_all(&CAMERA.to_le_bytes())?;
    put_u32(out, camera)
}

fn put_u64(out: &mut dyn Write, value: u64) -> Result<(), DatasetError> {
    Ok(out.write_all(&value.to_le_bytes())?)
}

fn put_u32(out: &mut dyn Write, value: u32) -> Result<(), DatasetError> {
    Ok(out.write_all(&value.to_le_bytes())?)
}

fn put_f64(out: &mut dyn Write, values: &[f64]) -> Result<(), DatasetError> {
    values.iter().try_for_each(|value| Ok(out.write_all(&value.to_le_bytes())?))
}

/// Quaternion and translation.
fn put_pose(out: &mut dyn Write, pose: &Rigid) -> Result<(), DatasetError> {
    put_f64(out, &wxyz(pose.rotation))?;
    put_f64(out, &pose.translation_m.to_array())
}
