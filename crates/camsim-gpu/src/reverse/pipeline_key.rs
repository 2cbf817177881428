//! Key of a composed kernel.

use camsim_core::{scenario::Preset, temporal::TapStage};
use camsim_plan::{EdgeStage, FramePlan, NodeDepths, PathStage, RayStage, TemporalStage};

use crate::shaders::ShaderSlot;

/// Temporal inverse without its numbers: numbers are uniforms, never part of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "as camsim_plan::TemporalStage")]
pub enum TemporalKind {
    Identity,
    Rotation,
    Reproject,
    Linear,
    Rk2,
}

/// Taps of the ideal frame, without their number.
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
    /// All variants.
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

/// Key instants of the ideal frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum KeyKind {
    /// One ideal frame: of the mid-window camera, or at any instant if no coordinates are output.
    MidWindow,
    /// One ideal frame at another instant, with coordinates.
    OtherInstant,
    /// Several ideal frames.
    Several,
}

/// Silhouette rays, without their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EdgeKind {
    /// No silhouette rays.
    None,
    /// Depth per sample, colour per pixel.
    Centres,
    /// Depth and colour per sample.
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

/// Depth look-ups of the temporal inverse. Small numbers are unrolled, since loops are slow on software
/// adapters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LookUps {
    /// One.
    One,
    /// Two.
    Two,
    /// As many as a uniform says.
    Several,
}

impl LookUps {
    const ALL: [Self; 3] = [Self::One, Self::Two, Self::Several];

    fn of(temporal: TemporalStage) -> Self {
        match temporal {
            TemporalStage::Reproject { iterations: 1 } => Self::One,
            TemporalStage::Reproject { iterations: 2 } => Self::Two,
            _ => Self::Several,
        }
    }
}

/// Polynomials of the exposure path. Small numbers are unrolled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Segments {
    /// One.
    One,
    /// Two.
    Two,
    /// As many as a uniform says.
    Several,
}

impl Segments {
    const ALL: [Self; 3] = [Self::One, Self::Two, Self::Several];

    fn of(count: u32) -> Self {
        match count {
            1 => Self::One,
            2 => Self::Two,
            _ => Self::Several,
        }
    }
}

/// Stages of a kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PipelineKey {
    /// Lens inverse: how rays are obtained.
    pub ray: RayStage,
    /// Temporal inverse.
    pub temporal: TemporalKind,
    /// Depth look-ups; `Several` if there are none.
    pub look_ups: LookUps,
    /// Whether there is motion blur.
    pub blur: bool,
    /// Exposure nodes at which depth is looked up; `Each` if there are none.
    pub depths: NodeDepths,
    /// Polynomials that join the nodes.
    pub path: PathStage,
    /// Number of polynomials that join all nodes.
    pub segments: Segments,
    /// Taps of the ideal frame.
    pub tap: TapKind,
    /// Key instants of the ideal frames.
    pub keys: KeyKind,
    /// Silhouette rays.
    pub edges: EdgeKind,
    /// Whether the truth is output.
    pub truth: bool,
    /// The paper preset: sRGB-encoded values, straight blur, nearest depth.
    pub paper: bool,
}

impl PipelineKey {
    /// Key of a plan.
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
            look_ups: LookUps::of(plan.temporal),
            blur: plan.blur.is_some(),
            depths: plan.blur.map_or(NodeDepths::Each, |blur| blur.depths),
            path: plan.blur.map_or(PathStage::Straight, |blur| blur.path),
            segments: plan
                .blur
                .filter(|_| plan.preset != Preset::Paper)
                .map_or(Segments::Several, |blur| Segments::of(blur.stretches())),
            tap: plan.taps.into(),
            keys: match temporal {
                _ if plan.keys.len() > 1 => KeyKind::Several,
                TemporalKind::Rotation | TemporalKind::Reproject
                    if plan.truth && plan.has_displaced_key() =>
                {
                    KeyKind::OtherInstant
                }
                _ => KeyKind::MidWindow,
            },
            edges: plan.edges.into(),
            truth: plan.truth,
            paper: plan.preset == Preset::Paper,
        }
    }

    /// All keys that a plan can have.
    #[must_use]
    pub fn all() -> Vec<Self> {
        // Long because: one loop per stage.
        use TemporalKind::{Identity, Linear, Reproject, Rk2, Rotation};
        let mut keys = Vec::new();
        for ray in [RayStage::Pinhole, RayStage::LensMap] {
            for temporal in [Identity, Rotation, Linear, Rk2, Reproject] {
                for blur in [false, true] {
                    // Without motion there is no blur.
                    if blur && temporal == Identity {
                        continue;
                    }
                    // Without parallax several key frames show the same.
                    let parallax = temporal == TemporalKind::Reproject;
                    for (key_kind, edges) in [KeyKind::MidWindow, KeyKind::OtherInstant, KeyKind::Several]
                        .into_iter()
                        .flat_map(|kind| {
                            [EdgeKind::None, EdgeKind::Centres, EdgeKind::Samples].map(|edges| (kind, edges))
                        })
                    {
                        let has_poses = parallax || temporal == Rotation;
                        if key_kind == KeyKind::Several && !parallax
                            || key_kind == KeyKind::OtherInstant && !has_poses
                        {
                            continue;
                        }
                        let has_look_ups = blur && temporal == Reproject;
                        let exposures = NodeDepths::ALL
                            .into_iter()
                            .flat_map(|depths| PathStage::ALL.map(|path| (depths, path)))
                            .filter(|&(depths, path)| {
                                has_look_ups
                                    || depths == NodeDepths::Each && (blur || path == PathStage::Straight)
                            });
                        for (depths, path) in exposures {
                            for tap in TapKind::ALL {
                                let truths: &[bool] =
                                    if key_kind == KeyKind::OtherInstant { &[true] } else { &[false, true] };
                                let look_ups: &[LookUps] =
                                    if parallax { &LookUps::ALL } else { &[LookUps::Several] };
                                let segments: &[Segments] =
                                    if blur { &Segments::ALL } else { &[Segments::Several] };
                                let unrolled = look_ups.iter().flat_map(|&look_ups| {
                                    segments.iter().map(move |&segments| (look_ups, segments))
                                });
                                keys.extend(unrolled.flat_map(|(look_ups, segments)| {
                                    truths.iter().map(move |&truth| Self {
                                        ray,
                                        temporal,
                                        look_ups,
                                        blur,
                                        depths,
                                        path,
                                        segments,
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
                    look_ups: LookUps::Several,
                    blur,
                    depths: NodeDepths::Each,
                    path: PathStage::Straight,
                    segments: Segments::Several,
                    tap: TapKind::Bilinear,
                    keys: KeyKind::MidWindow,
                    edges: EdgeKind::None,
                    truth,
                    paper: true,
                }));
            }
        }
        keys
    }

    /// Whether the poses of a line are few enough for a thread to cache them.
    #[must_use]
    pub fn caches_line_poses(&self) -> bool {
        self.keys != KeyKind::Several && !self.paper && (self.segments != Segments::Several || !self.blur)
    }

    /// Files that fill the slots of the kernel.
    #[must_use]
    pub fn slots(&self) -> [ShaderSlot; 16] {
        // Long because: one match per slot.
        let ray = match self.ray {
            RayStage::Pinhole => "reverse/ray/pinhole.wgsl",
            RayStage::LensMap => "reverse/ray/lens_map.wgsl",
            RayStage::GaussNewton => "reverse/ray/gauss_newton.wgsl",
        };
        let temporal = match self.temporal {
            TemporalKind::Identity => "reverse/temporal_inverse/identity.wgsl",
            TemporalKind::Rotation => "reverse/temporal_inverse/rotation.wgsl",
            TemporalKind::Reproject => "reverse/temporal_inverse/reproject.wgsl",
            TemporalKind::Linear => "reverse/temporal_inverse/linear.wgsl",
            TemporalKind::Rk2 => "reverse/temporal_inverse/rk2.wgsl",
        };
        let look_ups = match self.look_ups {
            LookUps::One => "reverse/temporal_inverse/look_ups/one.wgsl",
            LookUps::Two => "reverse/temporal_inverse/look_ups/two.wgsl",
            LookUps::Several => "reverse/temporal_inverse/look_ups/several.wgsl",
        };
        let keys = match self.keys {
            KeyKind::MidWindow => "reverse/keys/mid_window.wgsl",
            KeyKind::OtherInstant => "reverse/keys/other_instant.wgsl",
            KeyKind::Several => "reverse/keys/several.wgsl",
        };
        let gather = match (self.blur, self.paper) {
            (false, _) => "reverse/gather/no_blur.wgsl",
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
            true => ("reverse/depth/nearest.wgsl", "reverse/color/srgb.wgsl"),
        };
        let edges = if self.edges == EdgeKind::None {
            "reverse/edges/none.wgsl"
        } else {
            "reverse/edges/list_candidates.wgsl"
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
            _ => "reverse/gather/nodes/independent.wgsl",
        };
        let path = match self.path {
            PathStage::Straight => "reverse/gather/path/straight.wgsl",
            PathStage::Parabola => "reverse/gather/path/parabola.wgsl",
            PathStage::Quartic => "reverse/gather/path/quartic.wgsl",
        };
        let segments = match self.segments {
            Segments::One => "reverse/gather/segments/one.wgsl",
            Segments::Two => "reverse/gather/segments/two.wgsl",
            Segments::Several => "reverse/gather/segments/several.wgsl",
        };
        let (line, pixels) = match self.caches_line_poses() {
            true => ("reverse/line_poses/cached.wgsl", "reverse/pixels/several.wgsl"),
            false => ("reverse/line_poses/uncached.wgsl", "reverse/pixels/one.wgsl"),
        };
        let emit = if self.truth { "reverse/emit/truth.wgsl" } else { "reverse/emit/color.wgsl" };
        [
            ("keys", keys),
            ("ray", ray),
            ("depth", depth),
            ("temporal_inverse", temporal),
            ("look_ups", look_ups),
            ("gather", gather),
            ("nodes", nodes),
            ("path", path),
            ("segments", segments),
            ("line_poses", line),
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
    fn all_variants_are_valid_without_optional_capabilities() {
        // Long because: one list per kind of shader.
        // The files of `look_ups` and `segments` do not depend on lens map and taps: one of each is enough
        // for the unrolled variants.
        let is_representative = |key: &PipelineKey| {
            let has_loops = key.look_ups == LookUps::Several && key.segments == Segments::Several;
            has_loops || key.ray == RayStage::LensMap && key.tap == TapKind::Spline
        };
        let texts = PipelineKey::all().into_iter().filter(is_representative).flat_map(|key| {
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
            ("ideal/mesh_masked.wgsl", false),
            ("ideal/mesh_masked_lit.wgsl", false),
        ];
        let blended = [("ideal/mesh.wgsl", true), ("ideal/mesh_lit.wgsl", true)];
        let surfaces = surfaces.into_iter().chain(blended).flat_map(|(file, is_other)| {
            PrefilterTaps::ALL.into_iter().flat_map(move |reads| {
                [1, 4].map(|samples| {
                    // Terrain: tiles without fog; meshes: blended with fog.
                    let on_ground = crate::ideal::terrain_slots(reads, is_other, !is_other);
                    let on_mesh = crate::ideal::mesh_slots(reads, samples, is_other, is_other);
                    let slots = if file == "ideal/terrain.wgsl" { &on_ground[..] } else { &on_mesh };
                    (format!("{file} {reads:?} {samples} {is_other}"), shaders::compose(file, slots).unwrap())
                })
            })
        });
        let marks = [false, true].map(|thin| {
            let slot = crate::ideal::thin_surfaces_slot(thin);
            (
                format!("ideal/edge_mask.wgsl {thin}"),
                shaders::compose("ideal/edge_mask.wgsl", &[slot]).unwrap(),
            )
        });
        let other_files = [
            "ideal/triangles_near_edges.wgsl",
            "ideal/edge_mask_to_alpha.wgsl",
            "ideal/find_edge_lines.wgsl",
            "ideal/dilate_tiles.wgsl",
        ];
        let other_files = other_files.map(|file| (file.to_owned(), shaders::compose(file, &[]).unwrap()));
        for (name, text) in texts.chain(surfaces).chain(marks).chain(other_files) {
            let module = naga::front::wgsl::parse_str(&text)
                .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
            // Alpha masks are evaluated per sample: all but the oldest adapters support it.
            let is_masked = name.starts_with("ideal/mesh_masked");
            let capabilities = if is_masked {
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
