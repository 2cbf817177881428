//! What the picture pane shows, and how. Plain settings: they are remembered from run to run.

use serde::{Deserialize, Serialize};

use crate::{engine::Stage, orbit::Orbit};

/// How two pictures are held against each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Compare {
    /// One picture alone.
    #[default]
    Single,
    /// The second is to the right of a line that can be dragged.
    Wipe,
    /// One beside the other, in step.
    SideBySide,
    /// The first less the second, enlarged.
    Difference,
}

impl Compare {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Single, Self::Wipe, Self::SideBySide, Self::Difference];

    /// For buttons.
    pub fn label(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Wipe => "wipe",
            Self::SideBySide => "side by side",
            Self::Difference => "difference",
        }
    }
}

/// What is drawn over pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Overlays {
    /// Pixels without a ray, in the paper's red.
    pub invalid: bool,
    /// Lines of equal ideal ray.
    pub grid: bool,
    /// What each place moves by from the stamp's instant to its row's, and its way over the exposure.
    pub motion: bool,
    /// Colours and times of the rows.
    pub rows: bool,
    /// Predicted error, enlarged.
    pub error: bool,
    /// Depth in place of colour.
    pub depth: bool,
}

/// Pages of the panel on the right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tab {
    /// The pixel under the cursor.
    #[default]
    Pixel,
    /// The frame's plan.
    Plan,
    /// The flight over time.
    Plots,
    /// The flight from above.
    Map,
    /// The flight in three dimensions.
    Space,
    /// Rendering to files.
    Export,
}

impl Tab {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Pixel, Self::Plan, Self::Plots, Self::Map, Self::Space, Self::Export];

    /// For buttons.
    pub fn label(self) -> &'static str {
        match self {
            Self::Pixel => "Pixel",
            Self::Plan => "Plan",
            Self::Plots => "Plots",
            Self::Map => "Map",
            Self::Space => "3D",
            Self::Export => "Export",
        }
    }
}

/// Settings of the picture pane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct View {
    /// First picture.
    pub a: Stage,
    /// Second picture.
    pub b: Stage,
    /// How they are shown.
    pub compare: Compare,
    /// Enlargement of their difference.
    pub gain: f32,
    /// Place of the wipe's line, 0 to 1 over the picture's width.
    pub wipe: f32,
    /// Pixels of the screen (not points, of which one may have several) for each pixel of the camera; `None`
    /// fits the picture into the pane.
    pub zoom: Option<f32>,
    /// Pixel of the camera in the middle of the pane, as a share of its size; of no meaning for a fitted
    /// picture.
    pub centre: [f32; 2],
    /// What is drawn over it.
    pub overlays: Overlays,
    /// Page on the right.
    pub tab: Tab,
    /// Whether plots show the tracker's errors, not log and tracker.
    pub plot_errors: bool,
    /// Where the 3D page is seen from.
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
    /// The stages on show.
    pub fn stages(&self) -> Vec<Stage> {
        if self.compare == Compare::Single || self.a == self.b { vec![self.a] } else { vec![self.a, self.b] }
    }

    /// Whether the oracle's picture is on show.
    pub fn wants_oracle(&self) -> bool {
        self.stages().contains(&Stage::Oracle)
    }

    /// The stages that the renderer draws: beside the oracle alone there is always one, to look at until it
    /// is done.
    pub fn rendered_stages(&self) -> Vec<Stage> {
        let mut stages = self.stages();
        stages.retain(|stage| *stage != Stage::Oracle);
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
    fn the_renderer_always_has_something_to_draw() {
        for a in Stage::ALL {
            for b in Stage::ALL {
                for compare in Compare::ALL {
                    let view = View { a, b, compare, ..View::default() };
                    let stages = view.rendered_stages();
                    assert!(!stages.is_empty() && !stages.contains(&Stage::Oracle), "{view:?}");
                    assert_eq!(
                        view.wants_oracle(),
                        a == Stage::Oracle || (compare != Compare::Single && b == Stage::Oracle),
                        "{view:?}"
                    );
                }
            }
        }
    }
}
