//! `[scene]`: the contents of the scene.

use std::{collections::BTreeMap, path::PathBuf};

use serde::{Deserialize, Serialize};

use super::{
    FileList, MotionSpec,
    keys::{Table, Words},
};

/// Largest factor of the sky: half floats hold 65 504.
const MOST_BRIGHTNESS: f64 = 10_000.0;

/// The scene: one of its parts, or several together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct SceneSpec {
    /// Terrain from a DEM and an orthophoto.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terrain: Option<TerrainSpec>,
    /// A level image on the ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern: Option<PatternSpec>,
    /// A calibration board.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub board: Option<BoardSpec>,
    /// Models (glTF), each at one position or at those of a placement table.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gltf: Vec<GltfSpec>,
    /// Colour of the sky.
    #[key(
        default = [0.65, 0.85, 1.0],
        unit = "sRGB",
        step = 0.005,
        min = 0.0,
        max = 1.0,
        hint = "divide 8-bit values by 255",
        names = "R G B"
    )]
    pub sky: [f64; 3],
    /// Factor of the sky's linear light. Above white it shows with `[camera.sensor]` or less exposure. Left
    /// out: 1.
    #[key(
        unit = "x",
        step = 0.01,
        min = 0.0,
        max = MOST_BRIGHTNESS,
        hint = "1 leaves scene.sky as it is",
        example = "1.0"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sky_brightness: Option<f64>,
    /// Visibility V in fog. Colour is mixed with the sky by 1 - exp(-3.912 d / V), with the slant range d.
    /// Omitted: clear air.
    #[key(unit = "m", step = 50.0, above = 0.0, hint = "leave it out for clear air", example = "5000.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fog_visibility_m: Option<f64>,
    /// Light of sun and sky on terrain and models. Omitted: colours as they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light: Option<LightSpec>,
}

/// Light of sun and sky, a factor on the colours of terrain and models.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct LightSpec {
    /// Azimuth of the sun, east of north.
    #[key(default = 180.0, unit = "deg", step = 0.5, within = 360.0, hint = "it counts from north to east")]
    pub sun_azimuth_deg: f64,
    /// Elevation of the sun above the horizon.
    #[key(
        default = 45.0,
        unit = "deg",
        step = 0.2,
        min = 0.0,
        max = 90.0,
        hint = "0 is on the horizon, 90 overhead; for a night set scene.light.sun = 0"
    )]
    pub sun_elevation_deg: f64,
    /// Direct light: factor on a surface that faces the sun.
    #[key(default = 0.8, unit = "x", step = 0.005, min = 0.0, max = 1.0)]
    pub sun: f64,
    /// Diffuse light: factor on a surface that faces upwards, half of it on walls. `sun` + `sky` is at most
    /// 1.
    #[key(default = 0.2, unit = "x", step = 0.005, min = 0.0, max = 1.0)]
    pub sky: f64,
    /// Whether terrain and models keep the sun from what is behind them.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub shadows: bool,
}

/// The ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct TerrainSpec {
    /// Heights: a GeoTIFF, ESRI ASCII grid or SRTM tile, or several tiles of one grid. Several are a list, a
    /// folder, or a path with `*` and `?`.
    #[key(required, example = "\"dem.tif\"")]
    pub dem: FileList,
    /// Orthophoto: a GeoTIFF, PNG, JPEG or WebP, or several tiles of one grid as in `dem`. Without a
    /// georeference it covers the extent of the DEM.
    #[key(example = "\"ortho.tif\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ortho: Option<FileList>,
    /// Vertical reference of the DEM's heights.
    pub height: HeightReference,
    /// EPSG code of the coordinate system, if the DEM states none.
    #[key(max = u16::MAX, example = "32632")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub epsg: Option<u16>,
    /// Unit of the heights, if the DEM states none, or two.
    #[key(example = "\"m\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_unit: Option<HeightUnit>,
    /// Stored value of white in the orthophoto, if it does not use all bits. Omitted: the largest value of
    /// its bits.
    #[key(above = 0.0, hint = "give the stored value of white, 2047 for 11 bits", example = "2047.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ortho_white: Option<f64>,
    /// Appearance of ground beyond the orthophoto.
    pub beyond: Beyond,
    /// Name of the object in `objects.csv`. Omitted: `terrain`.
    #[key(example = "\"valley\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Class of the object. Omitted: 0, none.
    #[key(step = 0.2, min = 1, max = u16::MAX, hint = "leave it out for no class", example = "1")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
}

/// Unit of heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Words)]
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

/// Ground without orthophoto.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Beyond {
    /// Neutral grey.
    #[default]
    Grey,
    /// The colours of the orthophoto's border.
    Edge,
    /// No ground.
    Void,
}

/// A level image at the height of the origin, with its top to the north.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct PatternSpec {
    /// The image.
    #[key(required, example = "\"grid.png\"")]
    pub image: PathBuf,
    /// Width on the ground. The height follows from square pixels.
    #[key(
        required,
        unit = "m",
        above = 0.0,
        hint = "give the width on the ground in metres",
        example = "100.0"
    )]
    pub width_m: f64,
    /// Centre: `"origin"` or north, east, down.
    #[key(unit = "m", names = "N E D")]
    pub at: PatternCentre,
    /// Name of the object in `objects.csv`. Omitted: `pattern`.
    #[key(example = "\"grid\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Class of the object. Omitted: 0, none.
    #[key(step = 0.2, min = 1, max = u16::MAX, hint = "leave it out for no class", example = "1")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
    /// Whether the image repeats over the plane, without seams, to the horizon.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub repeat: bool,
}

/// A calibration board, by its parameters or by a target file of Kalibr.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct BoardSpec {
    /// Target file (YAML) of Kalibr, instead of `kind`, `columns`, `rows` and `size_m`.
    #[key(example = "\"target.yaml\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<PathBuf>,
    /// Kind of board.
    #[key(example = "\"chessboard\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<BoardKind>,
    /// Inner corners (chessboard), squares (ChArUco), circles or tags from left to right.
    #[key(step = 0.1, min = 1, max = 80, example = "9")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
    /// Inner corners (chessboard), squares (ChArUco), circles or tags from top to bottom.
    #[key(step = 0.1, min = 1, max = 80, example = "6")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<u32>,
    /// Side of a square or tag, or the spacing of circles as OpenCV defines it.
    #[key(unit = "m", step = 0.001, above = 0.0, hint = "give metres above 0", example = "0.05")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_m: Option<f64>,
    /// Height of a chessboard's squares. Omitted: their width.
    #[key(unit = "m", step = 0.001, above = 0.0, hint = "give metres above 0", example = "0.04")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row_size_m: Option<f64>,
    /// Diameter of a circle. Omitted: half the spacing.
    #[key(unit = "m", step = 0.001, above = 0.0, hint = "give metres above 0", example = "0.025")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diameter_m: Option<f64>,
    /// Gap between tags of an AprilGrid, as a fraction of their side. Omitted: 0.3.
    #[key(
        step = 0.005,
        above = 0.0,
        max = 1.0,
        hint = "give the gap between tags as a fraction of size_m",
        example = "0.3"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<f64>,
    /// Side of a ChArUco board's markers. Omitted: three quarters of a square.
    #[key(unit = "m", step = 0.001, above = 0.0, hint = "give metres above 0", example = "0.0375")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub marker_m: Option<f64>,
    /// Dictionary of a ChArUco board's markers. Omitted: `4x4`.
    #[key(example = "\"4x4\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dictionary: Option<Dictionary>,
    /// Number of the first tag or marker. Omitted: 0.
    #[key(step = 0.2, max = 586, example = "0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_id: Option<u32>,
    /// Least width of the white margin. Omitted: that usual for the kind of board.
    #[key(unit = "m", step = 0.001, min = 0.0, hint = "give metres, 0 or more", example = "0.05")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub margin_m: Option<f64>,
    /// Position of the centre: `"origin"` or north, east, down.
    #[key(unit = "m", step = 0.1, names = "N E D")]
    pub at: PatternCentre,
    /// Geodetic position of the centre, instead of `at`: latitude, longitude and height. The height is in
    /// the datum of `flight.height`.
    #[key(unit = "deg, deg, m", step = 0.1, example = "[46.75, 9.83, 1860.0]", names = "lat lon h")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub geodetic: Option<[f64; 3]>,
    /// Roll, pitch, yaw. At 0 0 0 the board lies face up with its top to the north; at pitch 90 it stands
    /// upright and faces a viewer who looks north.
    #[key(unit = "deg", step = 0.1, names = "roll pitch yaw")]
    pub angles_deg: [f64; 3],
    /// Name of the object in `objects.csv`. Omitted: `board`.
    #[key(example = "\"target\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Class of the object. Omitted: 0, none.
    #[key(step = 0.2, min = 1, max = u16::MAX, hint = "leave it out for no class", example = "1")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
}

/// A model, placed once or by a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct GltfSpec {
    /// The model, a `.gltf` or `.glb` file.
    #[key(required, example = "\"house.glb\"")]
    pub file: PathBuf,
    /// Position of the model's origin: `"origin"` or north, east, down.
    #[key(unit = "m", step = 0.1, names = "N E D")]
    pub at: PatternCentre,
    /// Geodetic position of the model's origin, instead of `at`: latitude, longitude and height. The height
    /// is in the datum of `flight.height`.
    #[key(unit = "deg, deg, m", step = 0.1, example = "[46.75, 9.83, 1860.0]", names = "lat lon h")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub geodetic: Option<[f64; 3]>,
    /// CSV table of placements, instead of `at`. Its columns are `n_m,e_m,d_m` or
    /// `lat_deg,lon_deg,height_m`, and optionally `heading_deg` and `scale`.
    #[key(example = "\"placements.csv\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placements: Option<PathBuf>,
    /// Heading of the model's front (+z), east of north. With 180, its x axis is east, as in maps.
    #[key(unit = "deg", step = 0.1)]
    pub heading_deg: f64,
    /// Scale: metres per unit of the model.
    #[key(default = 1.0, unit = "x", step = 0.01, above = 0.0, hint = "1 is as the file has it")]
    pub scale: f64,
    /// Whether the model's origin is placed on the terrain, whatever its height.
    pub on_ground: bool,
    /// Index of the scene in the file. Omitted: the file's own choice.
    #[key(step = 0.1, example = "0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<u32>,
    /// Time in the model's animations; with `motion.animate`, that at path time 0. Omitted: nodes keep their
    /// static pose.
    #[key(unit = "s", step = 0.01, example = "0.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Index of the animation in the file. Omitted: all animations together.
    #[key(step = 0.1, example = "0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub animation: Option<u32>,
    /// Name of its objects in `objects.csv`. Omitted: the file's name without ending. The k-th row of a
    /// placement table (from 1) gives `name#k`, and each node or material `name/node`.
    #[key(example = "\"house\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Class of its objects. Omitted: 0, none.
    #[key(step = 0.2, min = 1, max = u16::MAX, hint = "leave it out for no class", example = "3")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
    /// What an object is: each copy, or its nodes or materials.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub objects: ObjectsOf,
    /// Classes by name of node (with all below it) or of material, instead of `class`.
    #[key(min = 1, max = u16::MAX, hint = "leave it out for no class", example = "{ roof = 4 }")]
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub classes: BTreeMap<String, u16>,
    /// How it moves. Omitted: it stands still.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionSpec>,
}

/// What an object of a model is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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

/// Kinds of calibration boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Words)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum HeightReference {
    /// Above the WGS-84 ellipsoid.
    #[default]
    Ellipsoid,
    /// Above mean sea level (EGM96 geoid).
    Msl,
}
