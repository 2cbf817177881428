//! `[[output.twin]]`: the same frame by a better camera, written beside it.

use serde::{Deserialize, Serialize};

use super::{
    Channel, FlowInstant,
    keys::{Table, Words},
};

/// Largest number of pictures of a burst.
pub const MAX_INSTANTS: u32 = 1000;

/// A better camera, by what it lacks. Keys that are not given are as in the frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct TwinSpec {
    /// Name of the twin's folder, below that of the frames.
    #[key(required, example = "\"sharp\"")]
    pub name: String,
    /// Whether it has the exposure. `false`: an instant, hence no motion blur. Omitted: as the frame.
    #[key(example = "false")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure: Option<bool>,
    /// Shutter. `global`: all pixels at one instant.
    #[key(example = "\"global\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shutter: Option<TwinShutter>,
    /// Instant of a global shutter. Omitted: mid-exposure of the image's centre.
    #[key(example = "\"centre\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instant: Option<FlowInstant>,
    /// Whether it has the lens. `false`: a pinhole with the same focal length, principal point and size. Left
    /// out: as the frame.
    #[key(example = "false")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens: Option<bool>,
    /// Whether it has the noise. Omitted: as the frame.
    #[key(example = "false")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<bool>,
    /// Whether it has the vignette. Omitted: as the frame.
    #[key(example = "false")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vignette: Option<bool>,
    /// Neither exposure, rolling shutter, lens, noise, vignette nor point spread.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub ideal: bool,
    /// Pictures in a burst for each frame, each without exposure. Omitted: one picture of each frame.
    #[key(
        step = 0.1,
        min = 1,
        max = MAX_INSTANTS,
        hint = "leave it out for one picture of each frame",
        example = "9"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instants: Option<u32>,
    /// What the instants of a burst are spread over. Omitted: the exposure.
    #[key(example = "\"exposure\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over: Option<BurstOver>,
    /// Channels of the twin. Omitted: those of the frame.
    #[key(example = "[\"color\"]")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channels: Option<Vec<Channel>>,
    /// Whether it has the point spread and the glare. Omitted: as the frame.
    #[key(example = "false")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_spread: Option<bool>,
}

/// Shutters of a twin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum TwinShutter {
    /// All pixels at one instant: no readout, no interlacing.
    Global,
}

/// What the instants of a burst are spread over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum BurstOver {
    /// The exposure of each row: instant k of N is `((k + 0.5)/N - 0.5) t_e` after the mid-exposure. The mean
    /// of the pictures is the midpoint rule of the blurred frame.
    #[default]
    Exposure,
    /// From the mid-exposure of the first row to that of the last one, both included; each picture has a
    /// global shutter.
    Readout,
}

impl TwinSpec {
    /// Numbers of its pictures of each frame: `None` alone, or 0, 1, ... of a burst.
    pub fn instants(&self) -> impl Iterator<Item = Option<u32>> + use<> {
        let count = self.instants;
        (0..count.unwrap_or(1)).map(move |k| count.map(|_| k))
    }

    /// Whether its pictures are without exposure.
    #[must_use]
    pub fn is_sharp(&self) -> bool {
        self.ideal || self.instants.is_some() || self.exposure == Some(false)
    }

    /// Whether all pixels of a picture have one instant.
    #[must_use]
    pub fn is_global(&self) -> bool {
        self.ideal || self.shutter == Some(TwinShutter::Global) || self.over == Some(BurstOver::Readout)
    }

    /// Whether a flag, such as `lens`, leaves its part out.
    #[must_use]
    pub fn leaves_out(&self, flag: Option<bool>) -> bool {
        self.ideal || flag == Some(false)
    }

    /// Whether the twin could differ from the frame.
    #[must_use]
    pub fn differs(&self) -> bool {
        let flags = [self.exposure, self.lens, self.noise, self.vignette, self.point_spread];
        self.is_sharp() || self.is_global() || flags.contains(&Some(false))
    }

    /// In a few words, for messages.
    #[must_use]
    pub fn describe(&self) -> String {
        let parts = [
            (self.is_global(), "global shutter"),
            (self.is_sharp(), "no exposure"),
            (self.leaves_out(self.lens), "no lens"),
            (self.leaves_out(self.noise), "no noise"),
            (self.leaves_out(self.vignette), "no vignette"),
            (self.leaves_out(self.point_spread), "no point spread"),
        ];
        let words: Vec<&str> = parts.iter().filter(|(has, _)| *has).map(|(_, word)| *word).collect();
        let over = match self.over.unwrap_or_default() {
            BurstOver::Exposure => "exposure",
            BurstOver::Readout => "readout",
        };
        let burst = self.instants.map(|count| format!("{count} instants over the {over}, "));
        burst.unwrap_or_default() + &words.join(", ")
    }
}
