//! Settings of the picture pane, stored between runs.

use serde::{Deserialize, Serialize};

use crate::{engine::Stage, orbit::Orbit};

/// How two pictures are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Compare {
    /// One picture alone.
    #[default]
    Single,
    /// The second picture to the right of a movable line.
    Wipe,
    /// Both pictures side by side, with common zoom and pan.
    SideBySide,
    /// The first picture less the second, times a gain.
    Difference,
}

impl Compare {
    /// All, in the order of their buttons.
    pub const ALL: [Self; 4] = [Self::Single, Self::Wipe, Self::SideBySide, Self::Difference];

    /// Text of its button.
    pub fn label(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Wipe => "wipe",
            Self::SideBySide => "side by side",
            Self::Difference => "difference",
        }
    }
}

/// Overlays of pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Overlays {
    /// Invalid pixels in red, as in the paper.
    pub invalid: bool,
    /// Distortion grid: lines of equal u or v of the ideal ray.
    pub grid: bool,
    /// Displacement from the stamp to the row's time, and path over the exposure.
    pub motion: bool,
    /// Mid-exposure times of rows.
    pub rows: bool,
    /// Predicted source error in colours.
    pub error: bool,
    /// Depth instead of colour.
    pub depth: bool,
    /// The raw picture of the sensor instead of colour.
    pub raw: bool,
    /// Histogram.
    pub histogram: bool,
}

/// Pages of the right panel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tab {
    /// The pixel under the cursor.
    #[default]
    Pixel,
    /// The frame's plan.
    Plan,
    /// The flight over time.
    Plots,
    /// The flight on a map.
    Map,
    /// The flight in 3D. `Space` is its name in stored settings.
    #[serde(rename = "Space")]
    View3d,
    /// Rendering to files.
    Export,
}

impl Tab {
    /// All, in the order of their tabs.
    pub const ALL: [Self; 6] = [Self::Pixel, Self::Plan, Self::Plots, Self::Map, Self::View3d, Self::Export];

    /// Text of its tab.
    pub fn label(self) -> &'static str {
        match self {
            Self::Pixel => "Pixel",
            Self::Plan => "Plan",
            Self::Plots => "Plots",
            Self::Map => "Map",
            Self::View3d => "3D",
            Self::Export => "Export",
        }
    }
}

/// Settings of the picture pane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct View {
    /// Stage of the first picture.
    pub a: Stage,
    /// Stage of the second picture.
    pub b: Stage,
    /// How they are compared.
    pub compare: Compare,
    /// Gain of their difference.
    pub gain: f32,
    /// Position of the wipe line, 0 to 1 over the picture's width.
    pub wipe: f32,
    /// Screen pixels (not points) per camera pixel; `None` fits the picture into the pane.
    pub zoom: Option<f32>,
    /// Camera position in the centre of the pane, as a fraction of the picture's size; ignored for a fitted
    /// picture.
    pub centre: [f32; 2],
    /// Overlays.
    pub overlays: Overlays,
    /// Page of the right panel.
    pub tab: Tab,
    /// Whether plots show tracking errors instead of log and tracker.
    pub plot_errors: bool,
    /// Viewpoint of the 3D page.
    pub orbit: Orbit,
}

impl Default for View {
    fn default() -> Self {
        Self {
            a: Stage::Photometric,
            b: Stage::Ideal,
            compare: Compare::Single,
            gain: 4.0,
            wipe: 0.5,
            zoom: None,
            centre: [0.5, 0.5],
            overlays: Overlays::default(),
            tab: Tab::Pixel,
            plot_errors: false,
            orbit: Orbit::default(),
        }
    }
}

impl View {
    /// The stages shown.
    pub fn stages(&self) -> Vec<Stage> {
        if self.compare == Compare::Single || self.a == self.b { vec![self.a] } else { vec![self.a, self.b] }
    }

    /// Whether the reference's picture is shown.
    pub fn wants_reference(&self) -> bool {
        self.stages().contains(&Stage::Reference)
    }

    /// The stages to render: those shown without the reference, or the photometric one, which is shown until the
    /// reference's picture is ready.
    pub fn rendered_stages(&self) -> Vec<Stage> {
        let mut stages = self.stages();
        stages.retain(|stage| *stage != Stage::Reference);
        if stages.is_empty() {
            stages.push(Stage::Photometric);
        }
        stages
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_always_a_stage_to_render() {
        for a in Stage::ALL {
            for b in Stage::ALL {
                for compare in Compare::ALL {
                    let view = View { a, b, compare, ..View::default() };
                    let stages = view.rendered_stages();
                    assert!(!stages.is_empty() && !stages.contains(&Stage::Reference), "{view:?}");
                    assert_eq!(
                        view.wants_reference(),
                        a == Stage::Reference || (compare != Compare::Single && b == Stage::Reference),
                        "{view:?}"
                    );
                }
            }
        }
    }
}
