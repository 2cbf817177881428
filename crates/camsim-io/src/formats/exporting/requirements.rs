//! What a scenario has to write for a layout.

use camsim_core::scenario::{
    CameraSpec, Channel, DatasetFormat, ImageFormat, LensModel, OutputSpec, PointSource, Scenario, TracksSpec,
};

use super::DatasetError;
use super::twins::TwinNeed;
use crate::formats::layout;
use crate::formats::writing::Calibration;

/// Adds to a scenario what a layout needs: channels, formats, twins, tracks. What is there stays. Returns what
/// was added, in words.
///
/// # Errors
/// A twin has the name of one that is needed, and is another.
pub fn require(scenario: &mut Scenario, format: DatasetFormat) -> Result<Vec<String>, DatasetError> {
    let shutter = &scenario.camera.shutter;
    let is_prompt = shutter.delay_ms == 0.0;
    let lens = &scenario.camera.lens;
    let has_lens = match lens.model {
        LensModel::Pinhole => false,
        LensModel::BrownConrady => lens.coefficients.iter().any(|k| *k != 0.0),
        _ => true,
    };
    let mut added = Vec::new();
    let layout = layout(format);
    if layout.has_tracks && scenario.output.tracks.is_none() {
        add_tracks(scenario, &mut added);
    }
    let output = &mut scenario.output;
    let mut channels = vec![Channel::Color];
    // Poses of pictures are those of the image's centre.
    if layout.has_poses && !is_prompt {
        channels.push(Channel::Rows);
    }
    if layout.is_pinhole && has_lens {
        add_twin(output, TwinNeed::Pinhole, &[&channels[..], layout.channels].concat(), &mut added)?;
    } else {
        channels.extend(layout.channels);
    }
    add_channels(output, &channels, &mut added);
    let has_pictures = output.format.iter().any(|format| !format.is_video());
    if !layout.has_any_pictures || !has_pictures {
        add_format(output, ImageFormat::Png, &mut added);
    }
    layout.twins.iter().try_for_each(|need| add_twin(output, *need, &[Channel::Color], &mut added))?;
    Ok(added)
}

/// Judges the lens of a camera before anything is rendered.
///
/// # Errors
/// The layout cannot hold it.
pub fn judge_lens(camera: &CameraSpec, format: DatasetFormat) -> Result<(), DatasetError> {
    layout(format).judge.map_or(Ok(()), |judge| Ok(judge(&Calibration::new(camera)?)?))
}

fn add_channels(output: &mut OutputSpec, channels: &[Channel], added: &mut Vec<String>) {
    for &channel in channels {
        if !output.channels.contains(&channel) {
            output.channels.push(channel);
            added.push(format!("channel {}", channel.name()));
        }
    }
}

fn add_format(output: &mut OutputSpec, format: ImageFormat, added: &mut Vec<String>) {
    if !output.format.contains(&format) {
        output.format.push(format);
        added.push("format png".to_owned());
    }
}

fn add_twin(
    output: &mut OutputSpec,
    need: TwinNeed,
    channels: &[Channel],
    added: &mut Vec<String>,
) -> Result<(), DatasetError> {
    if let Some(twin) = output.twin.iter_mut().find(|twin| need.fits(twin)) {
        // A twin without channels of its own has those of the frame.
        if let Some(own) = &mut twin.channels {
            let missing: Vec<Channel> =
                channels.iter().copied().filter(|channel| !own.contains(channel)).collect();
            own.extend(missing);
        } else {
            add_channels(output, channels, added);
        }
        return Ok(());
    }
    if output.twin.iter().any(|twin| twin.name.eq_ignore_ascii_case(need.name())) {
        return Err(DatasetError::Refused(format!(
            "output.twin has a twin \"{}\" that is not what this layout needs by that name: rename it",
            need.name()
        )));
    }
    output.twin.push(need.spec(channels));
    added.push(format!("twin {}", need.name()));
    Ok(())
}

/// Tracks of what the scene has.
fn add_tracks(scenario: &mut Scenario, added: &mut Vec<String>) {
    let scene = &scenario.scene;
    let sources = [
        (scene.board.is_some(), PointSource::Board),
        (scene.terrain.is_some(), PointSource::Terrain),
        (!scene.gltf.is_empty(), PointSource::Vertices),
    ];
    let points: Vec<PointSource> =
        sources.into_iter().filter_map(|(has, source)| has.then_some(source)).collect();
    if !points.is_empty() {
        scenario.output.tracks = Some(TracksSpec { points, count: 1000 });
        added.push("tracks".to_owned());
    }
}
