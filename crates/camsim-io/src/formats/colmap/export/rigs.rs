//! Which cameras are one rig of the model, and which images one frame.

use crate::formats::axes::{Rigid, enu_from_camera};
use crate::formats::exporting::DatasetError;
use crate::formats::exporting::run_folder::RunCamera;

/// Instants that differ by no more are one: stamps are rounded to nanoseconds.
const SAME_NS: i64 = 1;

/// Cameras that move as one.
pub(super) struct ModelRig {
    pub(super) id: u32,
    /// The first is the rig's frame of reference.
    pub(super) sensors: Vec<RigSensor>,
}

/// A camera of a rig.
pub(super) struct RigSensor {
    /// Its index among the cameras of the model.
    pub(super) camera: usize,
    pub(super) sensor_from_rig: Rigid,
}

/// Pictures of a rig at one instant.
#[derive(Debug, PartialEq)]
pub(super) struct Moment {
    /// Instant of the centres.
    t_ns: i64,
    /// Indices in the rig's list of sensors, and of frames in the camera's list.
    pub(super) pictures: Vec<(usize, usize)>,
}

/// The rigs. Cameras are in the rig of an earlier one if neither shakes against the body and they share an
/// instant; a camera without such a partner is a rig of its own.
pub(super) fn rigs(cameras: &[&RunCamera]) -> Vec<ModelRig> {
    let mut rigs: Vec<ModelRig> = Vec::new();
    for (camera, run) in cameras.iter().enumerate() {
        let is_partner = |rig: &&mut ModelRig| {
            let first = cameras[rig.sensors[0].camera];
            !run.vibrates() && !first.vibrates() && shares_instant(first, run)
        };
        match rigs.iter_mut().find(is_partner) {
            Some(rig) => {
                let first = cameras[rig.sensors[0].camera].body_from_camera();
                let sensor_from_rig = run.body_from_camera().inverse().of(&first);
                rig.sensors.push(RigSensor { camera, sensor_from_rig });
            }
            None => rigs.push(ModelRig {
                id: rigs.len() as u32 + 1,
                sensors: vec![RigSensor { camera, sensor_from_rig: Rigid::IDENTITY }],
            }),
        }
    }
    rigs
}

/// Whether two cameras expose their centres at one instant somewhere.
fn shares_instant(a: &RunCamera, b: &RunCamera) -> bool {
    let instants =
        |camera: &RunCamera| camera.frames.iter().map(|frame| camera.true_centre_ns(frame)).collect();
    let (a, b): (Vec<i64>, Vec<i64>) = (instants(a), instants(b));
    let mut later = b.iter().peekable();
    a.iter().any(|t_ns| {
        while later.next_if(|other| **other < t_ns - SAME_NS).is_some() {}
        later.peek().is_some_and(|other| **other <= t_ns + SAME_NS)
    })
}

/// Moments of a rig by ascending time.
pub(super) fn moments(rig: &ModelRig, cameras: &[&RunCamera]) -> Vec<Moment> {
    let mut all: Vec<(i64, usize, usize)> = Vec::new();
    for (sensor, RigSensor { camera, .. }) in rig.sensors.iter().enumerate() {
        let camera = cameras[*camera];
        all.extend(
            camera
                .frames
                .iter()
                .enumerate()
                .map(|(index, frame)| (camera.true_centre_ns(frame), sensor, index)),
        );
    }
    // Of one instant in the order of sensors, whatever the last nanosecond says.
    all.sort_unstable();
    let mut moments: Vec<Moment> = Vec::new();
    for (t_ns, sensor, index) in all {
        match moments.last_mut() {
            Some(last)
                if t_ns - last.t_ns <= SAME_NS && last.pictures.iter().all(|(other, _)| *other != sensor) =>
            {
                last.pictures.push((sensor, index));
            }
            _ => moments.push(Moment { t_ns, pictures: vec![(sensor, index)] }),
        }
    }
    moments.iter_mut().for_each(|moment| moment.pictures.sort_unstable());
    moments
}

/// Pose of the rig at a moment, by its first picture.
pub(super) fn rig_from_world(
    rig: &ModelRig,
    moment: &Moment,
    cameras: &[&RunCamera],
    format: &str,
) -> Result<Rigid, DatasetError> {
    let (sensor, index) = moment.pictures[0];
    let RigSensor { camera, sensor_from_rig } = &rig.sensors[sensor];
    let camera = cameras[*camera];
    let world_from_sensor = enu_from_camera(&camera.centre_pose(format, &camera.frames[index])?);
    if sensor == 0 {
        return Ok(world_from_sensor.inverse());
    }
    Ok(sensor_from_rig.inverse().of(&world_from_sensor.inverse()))
}
