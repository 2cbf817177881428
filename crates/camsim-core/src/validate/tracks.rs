//! Checks of `[output.tracks]`.

use super::Check;
use crate::scenario::{PointSource, Scenario, TracksSpec};

pub(super) fn check_tracks(check: &mut Check, scenario: &Scenario) {
    let Some(TracksSpec { points, .. }) = &scenario.output.tracks else { return };
    let key = "output.tracks.points";
    check.require(!points.is_empty(), key, || {
        "is empty; name \"terrain\", \"vertices\", \"board\" or a table, or leave [output.tracks] out".into()
    });
    for (i, source) in points.iter().enumerate() {
        let label = String::from(source.clone());
        check.require(!points[..i].contains(source), key, || {
            format!("names \"{label}\" twice; leave one out")
        });
        let (is_there, missing) = match source {
            PointSource::Terrain => (scenario.scene.terrain.is_some(), "scene.terrain"),
            PointSource::Vertices => (!scenario.scene.gltf.is_empty(), "scene.gltf"),
            PointSource::Board => (scenario.scene.board.is_some(), "scene.board"),
            PointSource::Table(_) => (true, ""),
        };
        check.require(is_there, key, || {
            format!("names \"{label}\", but there is no {missing}; add it, or leave \"{label}\" out")
        });
    }
}
