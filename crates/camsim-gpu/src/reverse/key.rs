//! What a kernel is composed of.

use camsim_core::{scenario::Preset, temporal::TapStage};
use camsim_plan::{EdgeStage, FramePlan, NodeDepths, PathStage, RayStage, TemporalStage};

use crate::shaders::Slot;

/// Temporal inverse without its numbers: numbers go into uniforms, never into a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "as camsim_plan::TemporalStage")]
pub enum TemporalKind {
    Identity,
    Rotation,
    Reproject,
    Linear,
    Rk2,
}

/// What reads the ideal frame, without its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "as camsim_core::temporal::TapStage")]
pub enum TapKind {
    Bilinear,
    Spline,
    Area,
    Grid,
    SplineOrGrid,
}

impl TapKind {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Bilinear, Self::Spline, Self::Area, Self::Grid, Self::SplineOrGrid];
}

impl From<TapStage> for TapKind {
    fn from(stage: TapStage) -> Self {
        match stage {
            TapStage::Bilinear => Self::Bilinear,
            TapStage::Spline => Self::Spline,
            TapStage::Area => Self::Area,
            TapStage::Grid { .. } => Self::Grid,
            TapStage::SplineOrGrid { .. } => Self::SplineOrGrid,
        }
    }
}

/// What the ideal frames are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum KeyKind {
    /// One: the mid-window camera, or any where nobody asks for coordinates.
    Single,
    /// One at another instant.
    Elsewhere,
    /// Several.
    Several,
}

/// Rays of their own at silhouettes, without their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EdgeKind {
    /// None.
    None,
    /// Samples of depth, colours of pixels.
    Centres,
    /// Samples of depth and colour.
    Samples,
}

impl From<EdgeStage> for EdgeKind {
    fn from(stage: EdgeStage) -> Self {
        match stage {
            EdgeStage::None => Self::None,
            EdgeStage::Supersampled { scale: 1, .. } => Self::Centres,
            EdgeStage::Supersampled { .. } => Self::Samples,
        }
    }
}

/// Depth look-ups of the temporal inverse: few are written out, since loops are dear on software adapters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Looks {
    /// One.
    One,
    /// Two.
    Two,
    /// As many as a uniform says.
    Several,
}

impl Looks {
    const ALL: [Self; 3] = [Self::One, Self::Two, Self::Several];

    fn of(temporal: TemporalStage) -> Self {
        match temporal {
            TemporalStage::Reproject { iterations: 1 } => Self::One,
            TemporalStage::Reproject { iterations: 2 } => Self::Two,
            _ => Self::Several,
        }
    }
}

/// Polynomials of an exposure's path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stretches {
    /// One.
    One,
    /// Two.
    Two,
    /// As many as the plan says.
    Several,
}

impl Stretches {
    const ALL: [Self; 3] = [Self::One, Self::Two, Self::Several];

    fn of(count: u32) -> Self {
        match count {
            1 => Self::One,
            2 => Self::Two,
            _ => Self::Several,
        }
    }
}

/// Which stages a kernel is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PipelineKey {
    /// Lens inverse.
    pub ray: RayStage,
    /// Temporal inverse.
    pub temporal: TemporalKind,
    /// Depth look-ups, if there are any.
    pub looks: Looks,
    /// Exposure.
    pub blur: bool,
    /// Where depth is looked up for the nodes of the exposure, if there are any and it is.
    pub depths: NodeDepths,
    /// What joins them.
    pub path: PathStage,
    /// How many polynomials join all of them.
    pub stretches: Stretches,
    /// What reads the ideal frame.
    pub tap: TapKind,
    /// What the ideal frames are of.
    pub keys: KeyKind,
    /// Rays of their own at silhouettes.
    pub edges: EdgeKind,
    /// Depth and coordinates beside the picture.
    pub truth: bool,
    /// The paper preset: stored values, straight blur, nearest depth.
    pub paper: bool,
}

impl PipelineKey {
    /// The key of a plan.
    #[must_use]
    pub fn of(plan: &FramePlan) -> Self {
        let temporal = match plan.temporal {
            TemporalStage::Identity => TemporalKind::Identity,
            TemporalStage::Rotation => TemporalKind::Rotation,
            TemporalStage::Reproject { .. } => TemporalKind::Reproject,
            TemporalStage::Linear => TemporalKind::Linear,
            TemporalStage::Rk2 => TemporalKind::Rk2,
        };
        Self {
            ray: plan.ray,
            temporal,
            looks: Looks::of(plan.temporal),
            blur: plan.blur.is_some(),
            depths: plan.blur.map_or(NodeDepths::Each, |blur| blur.depths),
            path: plan.blur.map_or(PathStage::Straight, |blur| blur.path),
            stretches: plan
                .blur
                .filter(|_| plan.preset != Preset::Paper)
                .map_or(Stretches::Several, |blur| Stretches::of(blur.stretches())),
            tap: plan.taps.into(),
            keys: match temporal {
                _ if plan.keys.len() > 1 => KeyKind::Several,
                TemporalKind::Rotation | TemporalKind::Reproject
                    if plan.truth && plan.has_displaced_key() =>
                {
                    KeyKind::Elsewhere
                }
                _ => KeyKind::Single,
            },
            edges: plan.edges.into(),
            truth: plan.truth,
            paper: plan.preset == Preset::Paper,
        }
    }

    /// Every key that a plan can have.
    #[must_use]
    pub fn all() -> Vec<Self> {
        use TemporalKind::{Identity, Linear, Reproject, Rk2, Rotation};
        let mut keys = Vec::new();
        for ray in [RayStage::Pinhole, RayStage::LensMap] {
            for temporal in [Identity, Rotation, Linear, Rk2, Reproject] {
                for blur in [false, true] {
                    // Without motion there is no blur.
                    if blur && temporal == Identity {
                        continue;
                    }
                    // Without parallax all key cameras see the same.
                    let parallax = temporal == TemporalKind::Reproject;
                    for (key_kind, edges) in
                        [KeyKind::Single, KeyKind::Elsewhere, KeyKind::Several].into_iter().flat_map(|kind| {
                            [EdgeKind::None, EdgeKind::Centres, EdgeKind::Samples].map(|edges| (kind, edges))
                        })
                    {
                        let has_poses = parallax || temporal == Rotation;
                        if key_kind == KeyKind::Several && !parallax
                            || key_kind == KeyKind::Elsewhere && !has_poses
                        {
                            continue;
                        }
                        let looks_up = blur && temporal == Reproject;
                        let exposures = NodeDepths::ALL
                            .into_iter()
                            .flat_map(|depths| PathStage::ALL.map(|path| (depths, path)))
                            .filter(|&(depths, path)| {
                                looks_up
                                    || depths == NodeDepths::Each && (blur || path == PathStage::Straight)
                            });
                        for (depths, path) in exposures {
                            for tap in TapKind::ALL {
                                let truths: &[bool] =
                                    if key_kind == KeyKind::Elsewhere { &[true] } else { &[false, true] };
                                let looks: &[Looks] = if parallax { &Looks::ALL } else { &[Looks::Several] };
                                let stretches: &[Stretches] =
                                    if blur { &Stretches::ALL } else { &[Stretches::Several] };
                                let loops = looks.iter().flat_map(|&looks| {
                                    stretches.iter().map(move |&stretches| (looks, stretches))
                                });
                                keys.extend(loops.flat_map(|(looks, stretches)| {
                                    truths.iter().map(move |&truth| Self {
                                        ray,
                                        temporal,
                                        looks,
                                        blur,
                                        depths,
                                        path,
                                        stretches,
                                        tap,
                                        keys: key_kind,
                                        edges,
                                        truth,
                                        paper: false,
                                    })
                                }));
                            }
                        }
                    }
                }
            }
        }
        for ray in [RayStage::Pinhole, RayStage::GaussNewton] {
            for blur in [false, true] {
                keys.extend([false, true].map(|truth| Self {
                    ray,
                    temporal: Rk2,
                    looks: Looks::Several,
                    blur,
                    depths: NodeDepths::Each,
                    path: PathStage::Straight,
                    stretches: Stretches::Several,
                    tap: TapKind::Bilinear,
                    keys: KeyKind::Single,
                    edges: EdgeKind::None,
                    truth,
                    paper: true,
                }));
            }
        }
        keys
    }

    /// Whether the poses of a line are few enough to be held while a thread goes along it.
    #[must_use]
    pub fn holds_line(&self) -> bool {
        self.keys != KeyKind::Several && !self.paper && (self.stretches != Stretches::Several || !self.blur)
    }

    /// Fillings of the kernel's slots.
    #[must_use]
    pub fn slots(&self) -> [Slot; 16] {
        let ray = match self.ray {
            RayStage::Pinhole => "reverse/ray/pinhole.wgsl",
            RayStage::LensMap => "reverse/ray/map.wgsl",
            RayStage::GaussNewton => "reverse/ray/gauss_newton.wgsl",
        };
        let temporal = match self.temporal {
            TemporalKind::Identity => "reverse/temporal_inverse/identity.wgsl",
            TemporalKind::Rotation => "reverse/temporal_inverse/rotation.wgsl",
            TemporalKind::Reproject => "reverse/temporal_inverse/reproject.wgsl",
            TemporalKind::Linear => "reverse/temporal_inverse/linear.wgsl",
            TemporalKind::Rk2 => "reverse/temporal_inverse/rk2.wgsl",
        };
        let looks = match self.looks {
            Looks::One => "reverse/temporal_inverse/looks/one.wgsl",
            Looks::Two => "reverse/temporal_inverse/looks/two.wgsl",
            Looks::Several => "reverse/temporal_inverse/looks/several.wgsl",
        };
        let keys = match self.keys {
            KeyKind::Single => "reverse/keys/single.wgsl",
            KeyKind::Elsewhere => "reverse/keys/elsewhere.wgsl",
            KeyKind::Several => "reverse/keys/several.wgsl",
        };
        let gather = match (self.blur, self.paper) {
            (false, _) => "reverse/gather/sharp.wgsl",
            (true, false) => "reverse/gather/blur.wgsl",
            (true, true) => "reverse/gather/straight.wgsl",
        };
        let tap = match self.tap {
            TapKind::Bilinear => "reverse/gather/tap/bilinear.wgsl",
            TapKind::Spline => "reverse/gather/tap/spline.wgsl",
            TapKind::Area => "reverse/gather/tap/area.wgsl",
            TapKind::Grid => "reverse/gather/tap/grid.wgsl",
            TapKind::SplineOrGrid => "reverse/gather/tap/spline_or_grid.wgsl",
        };
        let (depth, color) = match self.paper {
            false => ("reverse/depth/bilinear.wgsl", "reverse/color/linear.wgsl"),
            true => ("reverse/depth/nearest.wgsl", "reverse/color/stored.wgsl"),
        };
        let edges = if self.edges == EdgeKind::None {
            "reverse/edges/none.wgsl"
        } else {
            "reverse/edges/listed.wgsl"
        };
        let surface_color = match self.edges {
            EdgeKind::Samples => "reverse/edges/color/samples.wgsl",
            EdgeKind::None | EdgeKind::Centres => "reverse/edges/color/centres.wgsl",
        };
        let nodes = match (self.temporal, self.depths) {
            (TemporalKind::Reproject, NodeDepths::Mid) => "reverse/gather/nodes/mid.wgsl",
            (TemporalKind::Reproject, NodeDepths::Ends) => "reverse/gather/nodes/ends.wgsl",
            (TemporalKind::Reproject, NodeDepths::Three) => "reverse/gather/nodes/three.wgsl",
            (TemporalKind::Reproject, NodeDepths::Each) => "reverse/gather/nodes/each.wgsl",
            _ => "reverse/gather/nodes/solved.wgsl",
        };
        let path = match self.path {
            PathStage::Straight => "reverse/gather/path/straight.wgsl",
            PathStage::Parabola => "reverse/gather/path/parabola.wgsl",
            PathStage::Quartic => "reverse/gather/path/quartic.wgsl",
        };
        let stretches = match self.stretches {
            Stretches::One => "reverse/gather/stretches/one.wgsl",
            Stretches::Two => "reverse/gather/stretches/two.wgsl",
            Stretches::Several => "reverse/gather/stretches/several.wgsl",
        };
        let (line, pixels) = match self.holds_line() {
            true => ("reverse/line/held.wgsl", "reverse/pixels/several.wgsl"),
            false => ("reverse/line/read.wgsl", "reverse/pixels/one.wgsl"),
        };
        let emit = if self.truth { "reverse/emit/truth.wgsl" } else { "reverse/emit/color.wgsl" };
        [
            ("keys", keys),
            ("ray", ray),
            ("depth", depth),
            ("temporal_inverse", temporal),
            ("looks", looks),
            ("gather", gather),
            ("nodes", nodes),
            ("path", path),
            ("stretches", stretches),
            ("line", line),
            ("pixels", pixels),
            ("tap", tap),
            ("edges", edges),
            ("surface_color", surface_color),
            ("color", color),
            ("emit", emit),
        ]
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use camsim_plan::PrefilterTaps;

    use super::*;
    use crate::{
        reverse::{CANDIDATES_SHADER, RAYS_SHADER, SHADER},
        shaders,
    };

    #[test]
    fn every_variant_is_valid_without_any_capability() {
        // What fills `looks` and `stretches` knows nothing of lens map and taps: written out, one of each
        // will do.
        let is_told_apart = |key: &PipelineKey| {
            let loops = key.looks == Looks::Several && key.stretches == Stretches::Several;
            loops || key.ray == RayStage::LensMap && key.tap == TapKind::Spline
        };
        let texts = PipelineKey::all().into_iter().filter(is_told_apart).flat_map(|key| {
            let files = if key.edges == EdgeKind::None {
                vec![SHADER]
            } else {
                vec![SHADER, CANDIDATES_SHADER, RAYS_SHADER]
            };
            files
                .into_iter()
                .map(move |file| (format!("{file} {key:?}"), shaders::compose(file, &key.slots()).unwrap()))
        });
        let surfaces = [
            ("ideal/terrain.wgsl", false),
            ("ideal/terrain.wgsl", true),
            ("ideal/mesh.wgsl", false),
            ("ideal/mesh_lit.wgsl", false),
            ("ideal/mesh_holes.wgsl", false),
            ("ideal/mesh_holes_lit.wgsl", false),
        ];
        let mixed = [("ideal/mesh.wgsl", true), ("ideal/mesh_lit.wgsl", true)];
        let surfaces = surfaces.into_iter().chain(mixed).flat_map(|(file, other)| {
            PrefilterTaps::ALL.into_iter().flat_map(move |reads| {
                [1, 4].map(|samples| {
                    // Of the ground in tiles and on a clear day, of meshes mixed and in fog.
                    let on_ground = crate::ideal::ground_slots(reads, other, !other);
                    let on_mesh = crate::ideal::mesh_slots(reads, samples, other, other);
                    let slots = if file == "ideal/terrain.wgsl" { &on_ground[..] } else { &on_mesh };
                    (format!("{file} {reads:?} {samples} {other}"), shaders::compose(file, slots).unwrap())
                })
            })
        });
        let marks = [false, true].map(|thin| {
            let slot = crate::ideal::spread_slot(thin);
            (format!("ideal/marks.wgsl {thin}"), shaders::compose("ideal/marks.wgsl", &[slot]).unwrap())
        });
        let others = ["ideal/near_marks.wgsl", "ideal/stamp.wgsl", "ideal/borders.wgsl", "ideal/reach.wgsl"];
        let others = others.map(|file| (file.to_owned(), shaders::compose(file, &[]).unwrap()));
        for (name, text) in texts.chain(surfaces).chain(marks).chain(others) {
            let module = naga::front::wgsl::parse_str(&text)
                .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
            // Holes are looked for sample by sample: all but the oldest adapters can.
            let holes = name.starts_with("ideal/mesh_holes");
            let capabilities = if holes {
                naga::valid::Capabilities::MULTISAMPLED_SHADING
            } else {
                naga::valid::Capabilities::empty()
            };
            let mut validator =
                naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities);
            validator.validate(&module).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        }
        assert_eq!(PipelineKey::all().len(), 18_818);
    }
}
