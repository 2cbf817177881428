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
    /// A calibration board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub board: Option<BoardSpec>,
    /// Models.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gltf: Vec<GltfSpec>,
    /// Sky colour, sRGB.
    #[serde(default = "sky")]
    pub sky: [f64; 3],
    /// Visibility V: colour is mixed with the sky by 1 - exp(-3.912 d / V), d = slant range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fog_visibility_m: Option<f64>,
    /// Sun and sky; left out, colours are as they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<LightSpec>,
}

/// `scene.light`: factor of the colours of terrain and models, without shadows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LightSpec {
    /// Where the sun is, degrees east of north.
    pub sun_azimuth_deg: f64,
    /// How high it is above the horizon, degrees.
    pub sun_elevation_deg: f64,
    /// Of a colour that the sun meets at right angles.
    pub sun: f64,
    /// Of a colour that looks up; half of it for walls.
    pub sky: f64,
}

impl Default for LightSpec {
    fn default() -> Self {
        Self { sun_azimuth_deg: 180.0, sun_elevation_deg: 45.0, sun: 0.8, sky: 0.2 }
    }
}

/// `scene.terrain`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TerrainSpec {
    /// GeoTIFF, ESRI ASCII grid or SRTM tile of heights.
    pub dem: PathBuf,
    /// GeoTIFF, PNG, JPEG or WebP of colour; without georeference it covers the DEM's extent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ortho: Option<PathBuf>,
    /// Vertical reference of the DEM.
    #[serde(default)]
    pub height: HeightReference,
    /// EPSG code, when the DEM does not state one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub epsg: Option<u16>,
    /// Unit of the heights, when the DEM does not state one, or two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_unit: Option<HeightUnit>,
    /// The stored number of the ortho-image that is white; the largest that its bits can hold if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ortho_white: Option<f64>,
    /// What is seen where the ortho-image has nothing.
    #[serde(default)]
    pub beyond: Beyond,
}

/// Of heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HeightUnit {
    /// Metres.
    M,
    /// International feet.
    Ft,
    /// US survey feet.
    UsFt,
}

impl HeightUnit {
    /// Metres in one.
    #[must_use]
    pub fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Ft => 0.3048,
            Self::UsFt => 1200.0 / 3937.0,
        }
    }
}

/// Ground without a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Beyond {
    /// A neutral grey.
    #[default]
    Grey,
    /// The colours of the picture's border, as far as there is ground.
    Edge,
    /// No ground.
    Void,
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

/// `scene.board`: its parameters, or Kalibr's file of them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardSpec {
    /// Kalibr's target YAML, in place of the parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<PathBuf>,
    /// What is on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<BoardKind>,
    /// Chessboard: inner corners; ChArUco: squares; else circles or tags, from left to right.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
    /// The same from top to bottom.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<u32>,
    /// Side of a square or of a tag, or spacing of circles as OpenCV means it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_m: Option<f64>,
    /// Height of a chessboard's squares, if it is another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub row_size_m: Option<f64>,
    /// Of a circle; half the spacing if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diameter_m: Option<f64>,
    /// Gap between tags of an AprilGrid, as a share of their side; 0.3 if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing: Option<f64>,
    /// Side of a ChArUco board's markers; three quarters of a square if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker_m: Option<f64>,
    /// Of a ChArUco board's markers; 4x4 if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dictionary: Option<Dictionary>,
    /// Number of the first tag or marker; 0 if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_id: Option<u32>,
    /// White around it, at least; left out, what its kind usually has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin_m: Option<f64>,
    /// Its middle: `"origin"` or `[north_m, east_m, down_m]`.
    #[serde(default)]
    pub at: PatternCentre,
    /// Its middle on Earth, in place of `at`: latitude and longitude in degrees, height in metres as
    /// `flight.height` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub geodetic: Option<[f64; 3]>,
    /// Roll, pitch, yaw: 0 0 0 lies face up, its top in the north; pitch 90 stands, and is looked at
    /// northwards.
    #[serde(default)]
    pub angles_deg: [f64; 3],
}

/// `[[scene.gltf]]`: a model, once or wherever a table says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GltfSpec {
    /// The model: `.gltf` or `.glb`.
    pub file: PathBuf,
    /// Where its origin is: `"origin"` or `[north_m, east_m, down_m]`.
    #[serde(default)]
    pub at: PatternCentre,
    /// The same on Earth, in place of `at`: latitude and longitude in degrees, height in metres as
    /// `flight.height` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub geodetic: Option<[f64; 3]>,
    /// A table of places in place of `at`: `n_m,e_m,d_m` or `lat_deg,lon_deg,height_m`, and if wanted
    /// `heading_deg` and `scale`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placements: Option<PathBuf>,
    /// Where its front (+z) looks, degrees east of north. With 180 its x is east, as maps have it.
    #[serde(default)]
    pub heading_deg: f64,
    /// Metres for each of its metres.
    #[serde(default = "one")]
    pub scale: f64,
    /// Whether its origin is put on the terrain, whatever height its place has.
    #[serde(default)]
    pub on_ground: bool,
    /// Which of the file's scenes; the file's own choice if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<u32>,
    /// Time within its animations, seconds; as its nodes stand if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Which animation; all of them together if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub animation: Option<u32>,
}

fn one() -> f64 {
    1.0
}

/// Calibration boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BoardKind {
    /// Squares, black and white in turn.
    Chessboard,
    /// Circles in rows and columns.
    Circles,
    /// Circles of which every other row is shifted by half their distance.
    AsymmetricCircles,
    /// Kalibr's grid of AprilTags 36h11.
    Aprilgrid,
    /// OpenCV's chessboard with ArUco markers.
    Charuco,
}

/// ArUco markers, by the squares of their inside: the first 250 of OpenCV's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Dictionary {
    /// `DICT_4X4_50`, `_100`, `_250`.
    #[default]
    #[serde(rename = "4x4")]
    FourByFour,
    /// `DICT_5X5_50`, `_100`, `_250`.
    #[serde(rename = "5x5")]
    FiveByFive,
    /// `DICT_6X6_50`, `_100`, `_250`.
    #[serde(rename = "6x6")]
    SixBySix,
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
