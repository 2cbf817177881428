//! Which cameras `camsim render` renders, and which frames of each.

use anyhow::anyhow;
use camsim_core::scenario::Rig;
use camsim_io::load::Loaded;

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::FrameList,
    inputs::camera_position,
};

/// Numbers of the cameras that `--camera` names, in the order of the file; all without it.
pub fn chosen_cameras(rig: &Rig, names: &[String]) -> Result<Vec<usize>, Failure> {
    let mut chosen: Vec<usize> =
        names.iter().map(|name| camera_position(rig, name)).collect::<Result<_, _>>()?;
    if names.is_empty() {
        chosen = (0..rig.scenarios().len()).collect();
    }
    chosen.sort_unstable();
    chosen.dedup();
    Ok(chosen)
}

/// Frames of each of these cameras. Of several, each renders those that it has; frames that none of them has
/// are refused.
pub fn frames_of_cameras(
    list: Option<&FrameList>,
    cameras: &[usize],
    loaded: &[Loaded],
    console: &mut Console<'_>,
) -> Result<Vec<Vec<u64>>, Failure> {
    let counts: Vec<u64> = cameras.iter().map(|&camera| loaded[camera].sequence.frames).collect();
    let Some(list) = list else {
        return Ok(counts.into_iter().map(|frames| (0..frames).collect()).collect());
    };
    let most = counts.iter().copied().max().unwrap_or_default();
    let all = list.resolve(most).or_bad_input()?;
    let mut of_cameras = Vec::new();
    for (&camera, &count) in cameras.iter().zip(&counts) {
        let frames: Vec<u64> = all.iter().copied().filter(|frame| *frame < count).collect();
        if frames.len() < all.len() && count < most {
            let name = &loaded[camera].sequence.scenario.camera.name;
            console.note(format_args!(
                "camera {name} has {count} frames: {} of the {} of --frames",
                frames.len(),
                all.len()
            ));
        }
        of_cameras.push(frames);
    }
    Ok(of_cameras)
}

/// Name that the piped frames have: that of the camera of a rig, of which one is rendered.
pub fn piped_camera<'r>(pipe: bool, rig: &'r Rig, cameras: &[usize]) -> Result<Option<&'r str>, Failure> {
    if pipe && cameras.len() > 1 {
        return Err(Failure::bad_input(anyhow!(
            "--pipe passes on the frames of one camera: choose it by --camera NAME"
        )));
    }
    let name = |camera: &usize| rig.scenarios()[*camera].camera.name.as_str();
    Ok(cameras.first().map(name).filter(|_| rig.is_list()))
}
