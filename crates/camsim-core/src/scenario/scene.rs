//! `[scene]`: what there is to see.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// One of, or several together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// Terrain from a DEM and an ortho-image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terrain: Option<TerrainSpec>,
    /// A planar picture on the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pattern: Option<PatternSpec>,
    /// Sky colour, sRGB.
    #[serde(default = "sky")]
    pub sky: [f64; 3],
    /// Visibility V: colour is mixed with the sky by 1 - exp(-3.912 d / V), d = slant range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fog_visibility_m: Option<f64>,
}

/// `scene.terrain`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TerrainSpec {
    /// GeoTIFF of heights.
    pub dem: PathBuf,
    /// GeoTIFF, PNG or JPEG of colour; without georeference it covers the DEM's extent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ortho: Option<PathBuf>,
    /// Vertical reference of the DEM.
    #[serde(default)]
    pub height: HeightReference,
    /// EPSG code, when the DEM does not state one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub epsg: Option<u16>,
}

/// `scene.pattern`: level at the origin's height, image top to the north.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatternSpec {
    /// The picture.
    pub image: PathBuf,
    /// Width on the ground; the height follows from the picture's shape.
    pub width_m: f64,
    /// Centre: `"origin"` or `[north_m, east_m, down_m]`.
    #[serde(default)]
    pub at: PatternCentre,
}

/// Centre of the pattern in local NED.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PatternCentre {
    /// (0, 0, 0), written `"origin"`.
    #[default]
    #[serde(with = "super::auto::origin")]
    Origin,
    /// North, east, down in metres.
    Ned([f64; 3]),
}

/// Vertical references.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HeightReference {
    /// Above the WGS-84 ellipsoid.
    #[default]
    Ellipsoid,
    /// Above mean sea level (EGM96 geoid).
    Msl,
}

fn sky() -> [f64; 3] {
    [0.65, 0.85, 1.0]
}
