//! Whether silhouettes can be in view: only then is the ideal frame supersampled and are pixels at
//! silhouettes solved sample by sample.
//!
//! A surface has a silhouette where it turns edge-on to the view, or where it ends. Both are bounded from
//! boxes and slopes that are found once a scene; the bounds err on the side of work.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::{Contours, FramePlan, SIZE_QUANTUM_PX, Skip};
use camsim_core::{
    pose::CameraPose,
    scenario::{QualitySpec, Silhouettes},
    scene::{Aabb, CHUNK_CELLS, Mesh, Scene, Shape, Terrain, terrain::Frustum},
};

/// Cells along the side of a block that shares one slope bound.
const BLOCK_CELLS: u32 = 8;
/// A slope this close to the view's own already counts as edge-on.
const FACING_MARGIN: f64 = 0.95;
/// From this tolerance (1/255 RMS) on silhouettes are left as one sample a pixel shows them.
pub(super) const IGNORED_DN: f64 = 16.0;
/// Most fine pixels along a side of an ideal pixel.
pub(super) const MOST_FINE: u32 = 3;
/// Depth of 4 samples and the border between them, and with more than one fine pixel a pixel the colours of
/// the samples.
pub(super) const FINE_PIXEL_BYTES: u64 = 4 * 4 + 8 + 4 * 8;
/// Memory that one supersampled ideal frame may take; with more pixels it has 4 fine pixels a pixel instead
/// of 9.
const MAX_FINE_BYTES: u64 = 512 << 20;
/// A flat mesh with more corners than this is not looked at any closer.
const MAX_FLAT_VERTICES: usize = 64;

/// How pixels at silhouettes are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EdgeStage {
    /// No silhouette in view: one sample a pixel of the ideal frame.
    None,
    /// The ideal frame keeps `4 scale^2` samples of depth a pixel (with `scale` above 1 of colour too), and
    /// an output pixel that sees a silhouette takes `samples` rays of its own.
    Supersampled {
        /// Fine pixels along a side of an ideal pixel, each with 4 samples.
        scale: u32,
        /// Rays over the area and exposure of an output pixel.
        samples: u32,
        /// Whether something thinner than a pixel may be in view: silhouettes are then looked for among all
        /// samples, otherwise between the middles of pixels, and only what is near them is drawn with
        /// samples.
        thin: bool,
    },
}

/// Margin of [`FramePlan::mark_reach_px`], ideal pixels: for the reads around a place, and for what rounds.
const REACH_MARGIN_PX: f64 = 3.0;
/// Rays are looked at from this many times the inverse depth of the nearest surface on, and a line's camera
/// that moves towards it gives it at most [`MOST_STRETCH`] times that: as in
/// `shaders/reverse/edges/near.wgsl`.
const LOOK_NEARER: f64 = 1.02;
const MOST_STRETCH: f64 = 4.0;

impl FramePlan {
    /// How far from a pixel's source the rays of that pixel may look, ideal pixels. Their parallax: `w' = w /
    /// (1 - t_z w)` is at most the inverse depth that a line's camera gives to the nearest surface `w`, and
    /// `shaders/reverse/edges/near.wgsl`, which bounds it likewise, begins 2 % nearer than that.
    #[must_use]
    pub fn mark_reach_px(&self) -> u32 {
        let approach =
            (LOOK_NEARER * self.motion.travel_m / self.motion.nearest_m).min(1.0 - 1.0 / MOST_STRETCH);
        // Saturates: then every mark reaches everything.
        (LOOK_NEARER * self.motion.parallax_px / (1.0 - approach) + REACH_MARGIN_PX).ceil() as u32
    }
}

/// Fine pixels along a side of an ideal pixel.
pub(super) fn scale_of(edges: EdgeStage) -> u32 {
    match edges {
        EdgeStage::None => 1,
        EdgeStage::Supersampled { scale, .. } => scale,
    }
}

/// Slopes and borders of a scene, found once.
#[derive(Debug, Default)]
pub(super) struct SceneOutline {
    terrain: PatchTree,
    meshes: Vec<MeshOutline>,
}

/// A piece of terrain.
#[derive(Clone, Copy, Debug)]
struct Patch {
    bounds: Aabb,
    /// Largest tangent of the angle between a triangle's normal and the vertical.
    slope: f64,
    /// Whether the terrain ends here.
    rim: bool,
}

#[derive(Clone, Copy, Debug)]
struct MeshOutline {
    bounds: Aabb,
    /// In one plane, and convex: it covers the view if it covers the view's corners.
    flat_convex: bool,
}

impl SceneOutline {
    pub(super) fn new(scene: &Scene) -> Self {
        let terrain = scene.terrain.as_ref().map_or_else(PatchTree::default, PatchTree::new);
        let meshes = scene
            .meshes
            .iter()
            .map(|mesh| MeshOutline { bounds: mesh.bounds(), flat_convex: is_flat_convex(mesh) })
            .collect();
        Self { terrain, meshes }
    }

    /// Whether any mesh can be seen from within `travel_m` of `pose`.
    fn meshes_in_view(&self, pose: &CameraPose, tangents: [f64; 4], travel_m: f64) -> bool {
        let frustum = Frustum::new(pose, tangents);
        let grown = |bounds: &Aabb| Aabb { min: bounds.min - travel_m, max: bounds.max + travel_m };
        self.meshes.iter().any(|mesh| frustum.may_see(&grown(&mesh.bounds)))
    }

    /// `None` and the reason if no silhouette can be seen from within `travel_m` of `pose` through `tangents`
    /// (u_min, u_max, v_min, v_max).
    pub(super) fn reason_for_none(
        &self,
        scene: &Scene,
        pose: &CameraPose,
        tangents: [f64; 4],
        travel_m: f64,
    ) -> Option<String> {
        let frustum = Frustum::new(pose, tangents);
        let terrain = self.terrain.any(CHUNK_LEVEL, &|patch| frustum.may_see(&patch.bounds));
        let mut meshes =
            self.meshes.iter().zip(&scene.meshes).filter(|(outline, _)| frustum.may_see(&outline.bounds));
        match (terrain, meshes.next(), meshes.next()) {
            (false, None, _) => Some("nothing but sky is in view".into()),
            (true, None, _) => {
                let edge = self.terrain.any(0, &|patch| may_end_or_turn(&frustum, patch, pose, travel_m));
                (!edge).then(|| "the terrain fills the view and no slope in it can be seen edge-on".into())
            }
            (false, Some((outline, mesh)), None) => (outline.flat_convex && covers(mesh, pose, tangents))
                .then(|| "one flat surface fills the view".into()),
            _ => None,
        }
    }
}

impl EdgeStage {
    /// Whether the colours of pixels at silhouettes come from rays of their own.
    #[must_use]
    pub fn has_rays(self) -> bool {
        matches!(self, Self::Supersampled { samples: 1.., .. })
    }
}

/// What of a frame the edge stage depends on.
pub(super) struct EdgeCase<'a> {
    pub outline: &'a SceneOutline,
    pub pose: &'a CameraPose,
    pub ideal: &'a camsim_core::temporal::IdealGeometry,
    pub travel_m: f64,
    pub quality: &'a QualitySpec,
    pub max_side_px: u32,
    /// Why no silhouette can be in view, if none can.
    pub reason_for_none: Option<&'a str>,
    /// What silhouettes cost that are left as they are, if they are to be.
    pub plain: Option<&'a Contours>,
    /// Fine pixels along a side of an ideal pixel, and rays of an output pixel.
    pub fine: u32,
    pub rays: u32,
}

/// The edge stage of a frame.
pub(super) fn edge_stage(case: &EdgeCase<'_>, skipped: &mut Vec<Skip>) -> EdgeStage {
    let EdgeCase { outline, pose, ideal, quality, max_side_px, plain, .. } = *case;
    let mut skip = |what, reason: String| skipped.push(Skip { what, reason });
    if let Some(reason) = case.reason_for_none {
        skip("silhouette supersampling", reason.to_owned());
        return EdgeStage::None;
    }
    if quality.silhouettes == Silhouettes::Auto && quality.max_error_dn >= IGNORED_DN {
        skip("silhouette supersampling", format!("quality.max_error_dn is {IGNORED_DN} or more"));
        return EdgeStage::None;
    }
    if let Some(Contours { at_dn, error_dn, .. }) = plain {
        skip(
            "silhouette supersampling",
            format!("without it {error_dn:.2}/255 over the picture, {at_dn:.1}/255 at silhouettes"),
        );
        return EdgeStage::None;
    }
    let scale = most_fine(ideal.size_px, max_side_px).min(case.fine);
    // Ground is not thin. What is drawn in colour keeps its order of drawing.
    let thin = scale > 1 || outline.meshes_in_view(pose, ideal.tangents(), case.travel_m);
    EdgeStage::Supersampled { scale, samples: case.rays, thin }
}

/// Fine pixels along a side of an ideal pixel that there is memory for.
pub(super) fn most_fine(ideal_px: [u32; 2], max_side_px: u32) -> u32 {
    let [width, height] = ideal_px.map(|side| u64::from(side.next_multiple_of(SIZE_QUANTUM_PX)));
    let fits = |scale: u64| {
        width.max(height) * scale <= u64::from(max_side_px)
            && width * height * scale * scale * FINE_PIXEL_BYTES <= MAX_FINE_BYTES
    };
    (2..=MOST_FINE).rev().find(|&scale| fits(u64::from(scale))).unwrap_or(1)
}

impl Patch {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, slope: 0.0, rim: false };

    fn join(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(&other.bounds),
            slope: self.slope.max(other.slope),
            rim: self.rim || other.rim,
        }
    }
}

/// Patches of 8x8 cells, and above them patches of 2x2 of the level below, up to one: a question that no
/// patch answers with yes unless all those around it do is asked where it may be answered so.
#[derive(Debug, Default)]
struct PatchTree {
    levels: Vec<PatchLevel>,
}

#[derive(Debug)]
struct PatchLevel {
    /// Patches from west to east and from north to south.
    size: [u32; 2],
    patches: Vec<Patch>,
}

/// Level of the patches that are chunks.
const CHUNK_LEVEL: usize = (CHUNK_CELLS / BLOCK_CELLS).trailing_zeros() as usize;

impl PatchTree {
    fn new(terrain: &Terrain) -> Self {
        let size = terrain.cells.map(|cells| cells.div_ceil(BLOCK_CELLS));
        let patches = (0..size[0] * size[1])
            .into_par_iter()
            .map(|i| block(terrain, [i % size[0], i / size[0]]))
            .collect();
        let mut levels = vec![PatchLevel { size, patches }];
        while let Some(below) = levels.last().filter(|level| level.size != [1, 1]) {
            let size = below.size.map(|n| n.div_ceil(2));
            let joined = |i: u32| {
                below
                    .children([i % size[0], i / size[0]])
                    .map(|at| below.get(at))
                    .fold(Patch::EMPTY, Patch::join)
            };
            let patches = (0..size[0] * size[1]).map(joined).collect();
            levels.push(PatchLevel { size, patches });
        }
        Self { levels }
    }

    /// Whether `holds` for a patch of the level (or the last one) and for all those around it.
    fn any(&self, level: usize, holds: &dyn Fn(&Patch) -> bool) -> bool {
        let Some(last) = self.levels.len().checked_sub(1) else { return false };
        let mut stack = vec![(last, [0, 0])];
        while let Some((at_level, at)) = stack.pop() {
            if holds(&self.levels[at_level].get(at)) {
                match at_level.checked_sub(1) {
                    Some(below) if at_level > level => {
                        stack.extend(self.levels[below].children(at).map(|at| (below, at)))
                    }
                    _ => return true,
                }
            }
        }
        false
    }
}

impl PatchLevel {
    fn get(&self, [column, row]: [u32; 2]) -> Patch {
        self.patches[(row * self.size[0] + column) as usize]
    }

    /// Patches of this level within one of the next.
    fn children(&self, [column, row]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
        let [columns, rows] = self.size;
        let four = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| [2 * column + i, 2 * row + j]);
        four.into_iter().filter(move |at| at[0] < columns && at[1] < rows)
    }
}

/// The patch of 8x8 cells in a column and row of such.
fn block(terrain: &Terrain, at: [u32; 2]) -> Patch {
    let [west, north] = at.map(|n| n * BLOCK_CELLS);
    let [columns, rows] = terrain.cells;
    let mut block = Patch::EMPTY;
    for row in north..(north + BLOCK_CELLS).min(rows) {
        for column in west..(west + BLOCK_CELLS).min(columns) {
            let (chunk, [i, j]) = terrain.chunk_of_cell([column, row]);
            let corners =
                [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| terrain.position_ned_m(chunk, i + a, j + b));
            let at_rim = column == 0 || row == 0 || column + 1 == columns || row + 1 == rows;
            block = block.join(cell(corners, at_rim));
        }
    }
    block
}

/// Both ways of cutting the cell into triangles: the terrain's own is one of them.
fn cell(corners: [DVec3; 4], at_rim: bool) -> Patch {
    let mut patch = Patch { rim: at_rim, ..Patch::EMPTY };
    for point in corners {
        if point.is_finite() {
            patch.bounds.include(point);
        } else {
            patch.rim = true;
        }
    }
    for k in 0..4 {
        let [a, b, c] = [k, k + 1, k + 2].map(|n| corners[n % 4]);
        let normal = (b - a).cross(c - a);
        if normal.is_finite() {
            patch.slope = patch.slope.max(normal.truncate().length() / normal.z.abs());
        }
    }
    patch
}

/// All triangles in one plane and turned the same way, and no corner outside of a border edge (one that a
/// single triangle has).
fn is_flat_convex(mesh: &Mesh) -> bool {
    let Shape { vertices, indices, .. } = &*mesh.shape;
    // What has holes, or is not there from behind, covers nothing for certain.
    let whole = mesh.material.cutoff.is_none() && !mesh.material.one_sided;
    if vertices.len() > MAX_FLAT_VERTICES || indices.len() < 3 || !whole {
        return false;
    }
    let at = |vertex: u32| mesh.position_ned_m(vertex);
    let mut normals =
        indices.chunks_exact(3).map(|t| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).normalize_or_zero());
    let Some(normal) = normals.next() else { return false };
    let reach = indices.iter().map(|&v| at(v).distance(at(indices[0]))).fold(0.0, f64::max);
    let flat = indices.iter().all(|&v| normal.dot(at(v) - at(indices[0])).abs() <= 1e-6 * reach);
    let turned_alike = normal != DVec3::ZERO && normals.all(|n| n.dot(normal) > 0.999);
    let edges: Vec<[u32; 2]> =
        indices.chunks_exact(3).flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]).collect();
    let border = edges.iter().filter(|[a, b]| !edges.contains(&[*b, *a]));
    let convex = |&[a, b]: &[u32; 2]| {
        let inward = normal.cross(at(b) - at(a)).normalize_or_zero();
        indices.iter().all(|&v| inward.dot(at(v) - at(a)) >= -1e-6 * reach)
    };
    flat && turned_alike && border.clone().count() >= 3 && { border }.all(convex)
}

/// Whether the rays of the view's four corners all meet the mesh.
fn covers(mesh: &Mesh, pose: &CameraPose, [u_min, u_max, v_min, v_max]: [f64; 4]) -> bool {
    [DVec2::new(u_min, v_min), DVec2::new(u_max, v_min), DVec2::new(u_min, v_max), DVec2::new(u_max, v_max)]
        .into_iter()
        .all(|uv| {
            mesh.intersect(pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0), f64::INFINITY)
                .is_some()
        })
}

/// False only if the patch is out of sight, or continues beyond its borders and faces the camera everywhere:
/// a surface of slope s faces a ray that goes down by more than s for each metre ahead.
fn may_end_or_turn(frustum: &Frustum, patch: &Patch, pose: &CameraPose, travel_m: f64) -> bool {
    if !frustum.may_see(&patch.bounds) {
        return false;
    }
    let camera = pose.position_ned_m;
    let down_m = patch.bounds.min.z - camera.z - travel_m;
    let ahead = (patch.bounds.max - camera).abs().max((patch.bounds.min - camera).abs());
    let ahead_m = ahead.truncate().length() + travel_m;
    // False for a NaN, which so counts as a silhouette.
    let faces_camera = patch.slope * ahead_m < FACING_MARGIN * down_m;
    patch.rim || !faces_camera
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use glam::{DQuat, EulerRot};

    use super::*;
    use camsim_core::scene::{Encoding, Texture};

    const VIEW: [f64; 4] = [-0.6, 0.6, -0.5, 0.5];

    fn hills(height_m: f64) -> Scene {
        let heights: Vec<f64> = (0..129 * 129)
            .map(|i| height_m * (f64::from(i % 129) * 0.3).sin() * (f64::from(i / 129) * 0.2).cos())
            .collect();
        Scene {
            terrain: Some(Terrain::from_heights(129, 129, 20.0, &heights, None).unwrap()),
            ..Scene::default()
        }
    }

    /// Camera at a height, its axis `pitch_deg` above the horizon (-90 = straight down), towards north.
    fn pose(height_m: f64, pitch_deg: f64) -> CameraPose {
        let body = DQuat::from_euler(EulerRot::ZYX, 0.0, pitch_deg.to_radians(), 0.0);
        let body_from_camera = DQuat::from_mat3(&glam::DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X));
        CameraPose {
            position_ned_m: DVec3::new(0.0, 0.0, -height_m),
            ned_from_camera: body * body_from_camera,
        }
    }

    fn none(scene: &Scene, pose: &CameraPose) -> bool {
        SceneOutline::new(scene).reason_for_none(scene, pose, VIEW, 1.0).is_some()
    }

    #[test]
    fn terrain_needs_supersampling_only_where_it_can_turn_away_or_end() {
        // Slopes up to 0.3 (of 20 m) under a view that goes down by 1 in 0.8 at least.
        assert!(none(&hills(20.0), &pose(400.0, -90.0)));
        // Slopes above 1.
        assert!(!none(&hills(150.0), &pose(600.0, -90.0)));
        // The horizon.
        assert!(!none(&hills(20.0), &pose(400.0, -20.0)));
        // So high that the border is in view.
        assert!(!none(&hills(20.0), &pose(4000.0, -90.0)));
        // Up.
        assert!(none(&hills(20.0), &pose(400.0, 80.0)));
        // Below the surface's top: nothing is known.
        assert!(!none(&hills(20.0), &pose(5.0, -90.0)));
    }

    #[test]
    fn the_tree_answers_as_all_its_blocks_do() {
        let heights: Vec<f64> = (0..300 * 200)
            .map(|i| 60.0 * (f64::from(i % 300) * 0.09).sin() * (f64::from(i / 300) * 0.05).cos())
            .collect();
        let scene = Scene {
            terrain: Some(Terrain::from_heights(300, 200, 20.0, &heights, None).unwrap()),
            ..Scene::default()
        };
        let outline = SceneOutline::new(&scene);
        let blocks = &outline.terrain.levels[0];
        assert_eq!((blocks.size, outline.terrain.levels.len()), ([38, 25], 7));
        let (mut edges, mut none) = (0, 0);
        for i in 0..400_u32 {
            let [x, y, height, pitch] =
                camsim_core::noise::pcg4d([i, 7, 0, 0]).map(|bits| f64::from(bits >> 8) / f64::from(1 << 24));
            let mut pose = pose(100.0 + 1500.0 * height, -90.0 + 60.0 * pitch);
            pose.position_ned_m += DVec3::new(3000.0 * (x - 0.5), 4000.0 * (y - 0.5), 0.0);
            let frustum = Frustum::new(&pose, VIEW);
            let expected = blocks.patches.iter().any(|block| may_end_or_turn(&frustum, block, &pose, 1.0));
            assert_eq!(
                outline.terrain.any(0, &|patch| may_end_or_turn(&frustum, patch, &pose, 1.0)),
                expected
            );
            (edges, none) = if expected { (edges + 1, none) } else { (edges, none + 1) };
        }
        assert!(edges > 50 && none > 50, "{edges} {none}");
    }

    #[test]
    fn voids_end_a_surface() {
        let mut heights = vec![0.0; 65 * 65];
        heights[32 * 65 + 32] = f64::NAN;
        let scene = Scene {
            terrain: Some(Terrain::from_heights(65, 65, 20.0, &heights, None).unwrap()),
            ..Scene::default()
        };
        assert!(!none(&scene, &pose(200.0, -90.0)));
    }

    #[test]
    fn one_flat_picture_needs_it_only_with_its_border_in_view() {
        let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
        let picture = Mesh::level_picture(texture, DVec3::ZERO, 1000.0);
        let scene = Scene { meshes: vec![picture.clone()], ..Scene::default() };
        assert!(none(&scene, &pose(200.0, -90.0)));
        assert!(!none(&scene, &pose(2000.0, -90.0)));
        assert!(!none(&scene, &pose(200.0, -10.0)));
        let mut two = scene.clone();
        two.meshes.push(Mesh { origin_ned_m: DVec3::new(0.0, 0.0, -50.0), ..picture.clone() });
        assert!(!none(&two, &pose(200.0, -90.0)));
        // An arrow-shaped piece is flat, but may leave a gap between the corners.
        let mut arrow = picture;
        Arc::make_mut(&mut arrow.shape).vertices[0].position_m = [-100.0, 100.0, 0.0];
        assert!(!is_flat_convex(&arrow));
    }

    #[test]
    fn poses_that_are_not_numbers_are_planned_as_silhouettes() {
        let mut wrong = pose(400.0, -90.0);
        wrong.position_ned_m.z = f64::NAN;
        // Out of sight or not facing: both are answers, a panic is none.
        let _ = none(&hills(20.0), &wrong);
    }
}
