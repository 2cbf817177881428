//! `[output.tracks]`: points whose pixel is written for every frame that sees them.

use std::path::PathBuf;

use serde::{Deserialize, Deserializer, Serialize};

use super::keys::Table;

/// Points whose pixel is written for every frame that sees them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct TracksSpec {
    /// Sources of the points. `terrain`, `vertices` (of models), `board`, a CSV table, or a list of these.
    #[key(required, example = "\"terrain\"")]
    #[serde(deserialize_with = "one_or_several")]
    pub points: Vec<PointSource>,
    /// Most points of each of `terrain`, `vertices` and `board`. All points of a table are tracked.
    #[key(
        default = 1000,
        step = 10.0,
        min = 1,
        max = TracksSpec::MOST_POINTS,
        hint = "it counts the points of each source; 1000 is the default"
    )]
    pub count: u32,
}

impl TracksSpec {
    /// Largest value of `count`.
    pub const MOST_POINTS: u32 = 1_000_000;
}

/// A source of points.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum PointSource {
    /// Corners of a regular grid on the part of the terrain that the flight's frames see.
    Terrain,
    /// Corners of the glTF models that the flight's frames see.
    Vertices,
    /// Corners, or centres of circles, of the calibration board.
    Board,
    /// A table of points.
    Table(PathBuf),
}

impl PointSource {
    /// The words of the sources that are no table.
    pub const WORDS: [&str; 3] = ["terrain", "vertices", "board"];

    /// Name in `points.csv`: the word, or the name of the file.
    #[must_use]
    pub fn label(&self) -> String {
        match self {
            Self::Table(path) => path
                .file_name()
                .map_or_else(|| path.to_string_lossy(), |name| name.to_string_lossy())
                .into_owned(),
            word => word.clone().into(),
        }
    }
}

impl From<String> for PointSource {
    fn from(text: String) -> Self {
        match text.as_str() {
            "terrain" => Self::Terrain,
            "vertices" => Self::Vertices,
            "board" => Self::Board,
            _ => Self::Table(text.into()),
        }
    }
}

impl From<PointSource> for String {
    fn from(source: PointSource) -> Self {
        match source {
            PointSource::Terrain => "terrain".into(),
            PointSource::Vertices => "vertices".into(),
            PointSource::Board => "board".into(),
            PointSource::Table(path) => path.to_string_lossy().into_owned(),
        }
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrSeveral {
    One(PointSource),
    Several(Vec<PointSource>),
}

fn one_or_several<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<PointSource>, D::Error> {
    Ok(match OneOrSeveral::deserialize(deserializer)? {
        OneOrSeveral::One(source) => vec![source],
        OneOrSeveral::Several(sources) => sources,
    })
}
