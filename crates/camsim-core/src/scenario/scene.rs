//! `[scene]`: the contents of the scene.

use std::{collections::BTreeMap, path::PathBuf};

use serde::{Deserialize, Serialize};

use super::{FileList, MotionSpec};

/// The scene: one of its parts, or several together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// Terrain from a DEM and an ortho-image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terrain: Option<TerrainSpec>,
    /// A planar image on the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pattern: Option<PatternSpec>,
    /// A calibration board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub board: Option<BoardSpec>,
    /// glTF models.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gltf: Vec<GltfSpec>,
    /// Sky colour, sRGB.
    #[serde(default = "sky")]
    pub sky: [f64; 3],
    /// Factor of the sky's linear light, which may be brighter than white; else 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sky_brightness: Option<f64>,
    /// Visibility V in metres: colour is mixed with the sky by 1 - exp(-3.912 d / V), with the slant range d.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fog_visibility_m: Option<f64>,
    /// Sun and sky light. Without it, colours are used as they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<LightSpec>,
}

/// `scene.light`: factor on the colours of terrain and models.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LightSpec {
    /// Azimuth of the sun, degrees east of north.
    pub sun_azimuth_deg: f64,
    /// Elevation of the sun above the horizon, degrees.
    pub sun_elevation_deg: f64,
    /// Factor of the sun on a surface that faces it.
    pub sun: f64,
    /// Factor of the sky on a surface that faces upwards; half of it on walls.
    pub sky: f64,
    /// Whether terrain and models keep the sun from what is behind them.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub shadows: bool,
}

impl Default for LightSpec {
    fn default() -> Self {
        Self { sun_azimuth_deg: 180.0, sun_elevation_deg: 45.0, sun: 0.8, sky: 0.2, shadows: false }
    }
}

/// `scene.terrain`: the ground.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TerrainSpec {
    /// Heights: a GeoTIFF, ESRI ASCII grid or SRTM tile, or several tiles of one grid.
    pub dem: FileList,
    /// Colour: a GeoTIFF, PNG, JPEG or WebP, or several tiles of one grid. Without a georeference it covers the
    /// extent of the DEM.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ortho: Option<FileList>,
    /// Vertical reference of the DEM.
    #[serde(default)]
    pub height: HeightReference,
    /// EPSG code, if the DEM does not state one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub epsg: Option<u16>,
    /// Unit of the heights, if the DEM states none, or two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_unit: Option<HeightUnit>,
    /// Stored value of white in the ortho-image; by default the largest value of its bits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ortho_white: Option<f64>,
    /// Ground outside of the ortho-image.
    #[serde(default)]
    pub beyond: Beyond,
    /// Name of the object in `objects.csv`; `terrain` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Class of the object, 1 to 65535; left out: 0, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
}

/// Unit of heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HeightUnit {
    /// Metres.
    M,
    /// International feet.
    Ft,
    /// US survey feet.
    UsFt,
    /// Decimetres.
    Dm,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
}

impl HeightUnit {
    /// Length of the unit in metres.
    #[must_use]
    pub fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Ft => 0.3048,
            Self::UsFt => 1200.0 / 3937.0,
            Self::Dm => 0.1,
            Self::Cm => 0.01,
            Self::Mm => 0.001,
        }
    }
}

/// Ground without ortho-image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Beyond {
    /// Neutral grey.
    #[default]
    Grey,
    /// The colours of the ortho-image's border.
    Edge,
    /// No ground.
    Void,
}

/// `scene.pattern`: a level image at the height of the origin, with its top to the north.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatternSpec {
    /// The image.
    pub image: PathBuf,
    /// Width on the ground; the height follows from square pixels.
    pub width_m: f64,
    /// Centre: `"origin"` or `[north_m, east_m, down_m]`.
    #[serde(default)]
    pub at: PatternCentre,
    /// Name of the object in `objects.csv`; `pattern` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Class of the object, 1 to 65535; left out: 0, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
    /// Whether the image repeats over the plane, without seams, to the horizon.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub repeat: bool,
}

/// `scene.board`: a calibration board, by its parameters or by a target file of Kalibr.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardSpec {
    /// Target file (YAML) of Kalibr, in place of the parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<PathBuf>,
    /// Kind of board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<BoardKind>,
    /// Number along the width: inner corners (chessboard), squares (ChArUco), otherwise circles or tags.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
    /// Number along the height: inner corners (chessboard), squares (ChArUco), otherwise circles or tags.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<u32>,
    /// Side of a square or tag, or the spacing of circles as OpenCV defines it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_m: Option<f64>,
    /// Height of a chessboard's squares, if different from their width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub row_size_m: Option<f64>,
    /// Diameter of a circle; half the spacing by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diameter_m: Option<f64>,
    /// Gap between tags of an AprilGrid, as a share of their side; 0.3 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing: Option<f64>,
    /// Side of a ChArUco board's markers; three quarters of a square by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker_m: Option<f64>,
    /// Dictionary of a ChArUco board's markers; 4x4 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dictionary: Option<Dictionary>,
    /// Number of the first tag or marker; 0 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_id: Option<u32>,
    /// Least width of the white margin; by default that usual for the kind of board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin_m: Option<f64>,
    /// Position of the centre: `"origin"` or `[north_m, east_m, down_m]`.
    #[serde(default)]
    pub at: PatternCentre,
    /// Geodetic position of the centre, in place of `at`: latitude and longitude in degrees, height in metres
    /// in the datum of `flight.height`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub geodetic: Option<[f64; 3]>,
    /// Roll, pitch, yaw. At 0 0 0 the board lies face up with its top to the north; at pitch 90 it stands
    /// upright and faces a viewer who looks north.
    #[serde(default)]
    pub angles_deg: [f64; 3],
    /// Name of the object in `objects.csv`; `board` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Class of the object, 1 to 65535; left out: 0, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
}

/// `[[scene.gltf]]`: a model, placed once or by a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GltfSpec {
    /// The model, a `.gltf` or `.glb` file.
    pub file: PathBuf,
    /// Position of the model's origin: `"origin"` or `[north_m, east_m, down_m]`.
    #[serde(default)]
    pub at: PatternCentre,
    /// Geodetic position of the model's origin, in place of `at`: latitude and longitude in degrees, height
    /// in metres in the datum of `flight.height`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub geodetic: Option<[f64; 3]>,
    /// Table of placements, in place of `at`: `n_m,e_m,d_m` or `lat_deg,lon_deg,height_m`, and optionally
    /// `heading_deg` and `scale`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placements: Option<PathBuf>,
    /// Direction of the model's front (+z), degrees east of north. With 180, its x axis is east, as in maps.
    #[serde(default)]
    pub heading_deg: f64,
    /// Scale: metres per unit of the model.
    #[serde(default = "one")]
    pub scale: f64,
    /// Whether the model's origin is placed on the terrain, whatever its height.
    #[serde(default)]
    pub on_ground: bool,
    /// Index of the scene in the file; by default the file's own choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<u32>,
    /// Time in the model's animations, seconds; by default nodes keep their static pose. With
    /// `motion.animate`, the time at path time 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Index of the animation; by default all animations together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub animation: Option<u32>,
    /// Name of its objects in `objects.csv`; the file's name without ending by default. The k-th row of a
    /// placement table (from 1) gives `name#k`, and each node or material `name/node`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Class of its objects, 1 to 65535; left out: 0, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
    /// What an object is.
    #[serde(default, skip_serializing_if = "ObjectsOf::is_default")]
    pub objects: ObjectsOf,
    /// Classes, 1 to 65535, of nodes (and all below them) or of materials, by name, in place of `class`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub classes: BTreeMap<String, u16>,
    /// How it moves; by default it stands still.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionSpec>,
}

/// What an object of a model is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObjectsOf {
    /// Each placed copy.
    #[default]
    Placement,
    /// Each node with a mesh, of each placed copy.
    Node,
    /// Each material, of each placed copy.
    Material,
}

impl ObjectsOf {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

fn one() -> f64 {
    1.0
}

/// Kinds of calibration boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BoardKind {
    /// Alternating black and white squares.
    Chessboard,
    /// Circles in rows and columns.
    Circles,
    /// Circles in rows, every other one shifted by half the distance.
    AsymmetricCircles,
    /// Kalibr's grid of AprilTags 36h11.
    Aprilgrid,
    /// OpenCV's chessboard with ArUco markers.
    Charuco,
}

/// ArUco dictionaries by squares per side; the first 250 markers of OpenCV's.
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
