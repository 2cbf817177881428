//! Faces and lines in 3D as one egui mesh, by the painter's algorithm: triangles sorted from far to near.

use eframe::egui::{Color32, Mesh, Pos2, Shape, Vec2, vec2};
use glam::DVec3;

use crate::orbit::Eye;

/// Width of the antialiased border of lines, points.
const FADE: f32 = 0.8;
/// Pieces of an edge of a frustum, sorted separately: part of an edge may be below the ground.
const EDGE_PIECES: u32 = 24;
/// Light on the faces of a box by axis and side: from the north-west and above.
const LIGHT: [[f32; 2]; 3] = [[0.5, 0.75], [0.65, 0.55], [0.9, 0.4]];

/// A surface as a row-major grid of coloured corners.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// Corners in a row.
    pub columns: usize,
    /// NED metres and colour; `None` for holes.
    pub corners: Vec<Option<(DVec3, Color32)>>,
}

/// Triangles collected so far.
pub struct Canvas {
    eye: Eye,
    centre: Pos2,
    mesh: Mesh,
    /// Depth, and the indices of the corners.
    triangles: Vec<(f32, [u32; 3])>,
}

impl Canvas {
    /// An empty canvas with the eye's axis at `centre`.
    pub fn new(eye: Eye, centre: Pos2) -> Self {
        Self { eye, centre, mesh: Mesh::default(), triangles: Vec::new() }
    }

    /// The mesh, with triangles from far to near.
    pub fn mesh(mut self) -> Shape {
        // The sort is stable: equal depths stay in drawing order.
        self.triangles.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.mesh.indices = self.triangles.into_iter().flat_map(|(_, corners)| corners).collect();
        Shape::mesh(self.mesh)
    }

    fn vertex(&mut self, position: Pos2, color: Color32) -> u32 {
        let index = self.mesh.vertices.len() as u32;
        self.mesh.colored_vertex(position, color);
        index
    }

    fn on_screen(&self, eye_m: DVec3) -> Pos2 {
        let points = self.eye.project(eye_m);
        self.centre + vec2(points.x as f32, points.y as f32)
    }

    /// Draws two triangles per cell, with interpolated colours.
    pub fn surface(&mut self, surface: &Surface) {
        let near_m = self.eye.near_m();
        let placed: Vec<Option<(DVec3, Color32, u32)>> = surface
            .corners
            .iter()
            .map(|corner| {
                let (ned_m, color) = (*corner)?;
                let eye_m = self.eye.eye_from_ned(ned_m);
                let index =
                    if eye_m.z >= near_m { self.vertex(self.on_screen(eye_m), color) } else { u32::MAX };
                Some((eye_m, color, index))
            })
            .collect();
        let columns = surface.columns.max(1);
        let rows = placed.len() / columns;
        for row in 1..rows {
            for column in 1..columns {
                let index = row * columns + column;
                let [nw, ne, sw, se] =
                    [index - columns - 1, index - columns, index - 1, index].map(|index| placed[index]);
                // The diagonal runs from north-west to south-east, as in the terrain.
                for corners in [[nw, sw, se], [nw, se, ne]] {
                    if let [Some(a), Some(b), Some(c)] = corners {
                        self.triangle([a, b, c]);
                    }
                }
            }
        }
    }

    /// Draws a triangle, clipped at the near plane.
    fn triangle(&mut self, corners: [(DVec3, Color32, u32); 3]) {
        let eye_m = corners.map(|corner| corner.0);
        if corners.iter().all(|corner| corner.2 != u32::MAX) {
            let depth = (eye_m[0].z + eye_m[1].z + eye_m[2].z) / 3.0;
            self.triangles.push((depth as f32, corners.map(|corner| corner.2)));
        } else {
            self.face_in_eye_axes(&eye_m, corners[0].1);
        }
    }

    /// Draws a convex face of one colour.
    fn face(&mut self, corners_ned_m: &[DVec3], color: Color32) {
        let eye_m: Vec<DVec3> = corners_ned_m.iter().map(|corner| self.eye.eye_from_ned(*corner)).collect();
        self.face_in_eye_axes(&eye_m, color);
    }

    /// Draws a convex face in eye axes, clipped at the near plane.
    fn face_in_eye_axes(&mut self, eye_m: &[DVec3], color: Color32) {
        let clipped = self.eye.clip_near(eye_m);
        if clipped.len() < 3 {
            return;
        }
        let depth = clipped.iter().map(|corner| corner.z).sum::<f64>() / clipped.len() as f64;
        let indices: Vec<u32> =
            clipped.iter().map(|corner| self.vertex(self.on_screen(*corner), color)).collect();
        for pair in indices[1..].windows(2) {
            self.triangles.push((depth as f32, [indices[0], pair[0], pair[1]]));
        }
    }

    /// Draws a line. `lift_m` is subtracted from its depth, so that it lies on the surface below.
    pub fn line(&mut self, points_ned_m: &[DVec3], width: f32, color: Color32, lift_m: f64) {
        for pair in points_ned_m.windows(2) {
            let eye_m = self.eye.clip_near(&[self.eye.eye_from_ned(pair[0]), self.eye.eye_from_ned(pair[1])]);
            if let [from, to] = eye_m.as_slice() {
                let depth = 0.5 * (from.z + to.z) - lift_m;
                self.stroke([self.on_screen(*from), self.on_screen(*to)], width, color, depth as f32);
            }
        }
    }

    /// Draws an antialiased straight stroke.
    fn stroke(&mut self, [from, to]: [Pos2; 2], width: f32, color: Color32, depth: f32) {
        let along = to - from;
        if !along.length().is_finite() || along.length() < 1e-3 {
            return;
        }
        let aside = along.normalized().rot90();
        let inner = 0.5 * (width - FADE).max(0.1);
        let steps: [(f32, Color32); 4] = [
            (-inner - FADE, Color32::TRANSPARENT),
            (-inner, color),
            (inner, color),
            (inner + FADE, Color32::TRANSPARENT),
        ];
        let ends =
            steps.map(|(offset, color)| [from, to].map(|end| self.vertex(end + offset * aside, color)));
        for pair in ends.windows(2) {
            let [[a, b], [c, d]] = [pair[0], pair[1]];
            self.triangles.extend([(depth, [a, b, c]), (depth, [c, b, d])]);
        }
    }

    /// Draws a dot of constant radius in points.
    pub fn dot(&mut self, ned_m: DVec3, radius: f32, color: Color32, lift_m: f64) {
        let eye_m = self.eye.eye_from_ned(ned_m);
        if eye_m.z < self.eye.near_m() {
            return;
        }
        let (centre, depth) = (self.on_screen(eye_m), (eye_m.z - lift_m) as f32);
        let middle = self.vertex(centre, color);
        let rim: Vec<u32> = (0..8)
            .map(|k| {
                self.vertex(centre + radius * Vec2::angled(std::f32::consts::TAU * k as f32 / 8.0), color)
            })
            .collect();
        for k in 0..8 {
            self.triangles.push((depth, [middle, rim[k], rim[(k + 1) % 8]]));
        }
    }

    /// Draws the visible faces of an axis-aligned box.
    pub fn cuboid(&mut self, [low, high]: [DVec3; 2], color: Color32, outlined: bool) {
        let corner = |index: usize| {
            let pick = |axis: usize| if index >> axis & 1 == 0 { low[axis] } else { high[axis] };
            DVec3::new(pick(0), pick(1), pick(2))
        };
        for (axis, light) in LIGHT.into_iter().enumerate() {
            let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            for (side, light) in light.into_iter().enumerate() {
                let start = side << axis;
                let face = [start, start | u, start | u | v, start | v].map(corner);
                let outward = if side == 0 { -1.0 } else { 1.0 };
                if self.eye.sees_face(axis, outward, face[0]) {
                    self.face(&face, darker(color, light));
                    if outlined {
                        self.outline(&face);
                    }
                }
            }
        }
    }

    /// Draws the edges of a face, sorted by the depth of the face.
    fn outline(&mut self, corners_ned_m: &[DVec3; 4]) {
        let eye_m = corners_ned_m.map(|corner| self.eye.eye_from_ned(corner));
        let depth = eye_m.iter().map(|corner| corner.z).sum::<f64>() / 4.0;
        for k in 0..4 {
            if let [from, to] = self.eye.clip_near(&[eye_m[k], eye_m[(k + 1) % 4]]).as_slice() {
                self.stroke(
                    [self.on_screen(*from), self.on_screen(*to)],
                    1.0,
                    Color32::from_black_alpha(140),
                    depth as f32,
                );
            }
        }
    }

    /// Draws a frustum from its apex to a rim: translucent sides, and edges at the corners.
    pub fn frustum(&mut self, apex_ned_m: DVec3, rim: &[DVec3], color: Color32) {
        let count = rim.len();
        if count < 3 {
            return;
        }
        let pieces = |from: DVec3, to: DVec3| -> Vec<DVec3> {
            (0..=EDGE_PIECES).map(|k| from.lerp(to, f64::from(k) / f64::from(EDGE_PIECES))).collect()
        };
        for k in 0..count {
            self.face(&[apex_ned_m, rim[k], rim[(k + 1) % count]], color.gamma_multiply(0.10));
        }
        for k in 0..count {
            self.line(&[rim[k], rim[(k + 1) % count]], 1.5, color, 0.0);
        }
        for corner in (0..4).map(|k| rim[k * count / 4]) {
            self.line(&pieces(apex_ned_m, corner), 1.5, color, 0.0);
        }
    }
}

/// Scales the brightness of a colour.
fn darker(color: Color32, light: f32) -> Color32 {
    let [r, g, b] = [color.r(), color.g(), color.b()].map(|value| (f32::from(value) * light) as u8);
    Color32::from_rgb(r, g, b)
}

#[cfg(test)]
mod tests {
    use eframe::egui::pos2;
    use glam::DVec2;

    use super::*;
    use crate::orbit::{BoundingSphere, Orbit};

    fn canvas() -> Canvas {
        let sphere = BoundingSphere { centre_ned_m: DVec3::ZERO, radius_m: 10.0 };
        Canvas::new(Eye::new(&Orbit::from_above(), sphere, DVec2::splat(200.0)), pos2(100.0, 100.0))
    }

    fn triangles(canvas: Canvas) -> Vec<[(Pos2, Color32); 3]> {
        let Shape::Mesh(mesh) = canvas.mesh() else { panic!("a mesh") };
        let corner = |index: u32| (mesh.vertices[index as usize].pos, mesh.vertices[index as usize].color);
        mesh.indices.chunks_exact(3).map(|t| [corner(t[0]), corner(t[1]), corner(t[2])]).collect()
    }

    #[test]
    fn triangles_are_sorted_from_far_to_near() {
        let level = |down_m: f64, color| Surface {
            columns: 2,
            corners: [(1.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (-1.0, 1.0)]
                .map(|(north_m, east_m)| Some((DVec3::new(north_m, east_m, down_m), color)))
                .into(),
        };
        let mut canvas = canvas();
        canvas.surface(&level(-5.0, Color32::RED));
        canvas.surface(&level(5.0, Color32::GREEN));
        canvas.line(&[DVec3::new(0.0, -1.0, 5.0), DVec3::new(0.0, 1.0, 5.0)], 2.0, Color32::BLUE, 0.5);
        let colors: Vec<Color32> = triangles(canvas)
            .iter()
            .map(|corners| corners.iter().find(|c| c.1.a() > 0).expect("seen").1)
            .collect();
        let expected = [Color32::GREEN; 2].into_iter().chain([Color32::BLUE; 6]).chain([Color32::RED; 2]);
        assert_eq!(colors, expected.collect::<Vec<_>>(), "from above: green is below, with the line on it");
    }

    #[test]
    fn only_the_top_of_a_box_is_visible_from_above() {
        let mut canvas = canvas();
        // Exactly below the eye, so that no side is visible.
        canvas.cuboid([DVec3::splat(-1.0), DVec3::splat(1.0)], Color32::WHITE, false);
        let drawn = triangles(canvas);
        assert_eq!(drawn.len(), 2);
        // The top is 10 / sin 22.5 deg - 1 = 25.13 m away, and 100 / tan 22.5 deg = 241.4 points are a
        // tangent of 1.
        for (position, _) in drawn.iter().flatten() {
            let offset = *position - pos2(100.0, 100.0);
            assert!(
                (offset.x.abs() - 9.606).abs() < 1e-2 && (offset.y.abs() - 9.606).abs() < 1e-2,
                "{offset}"
            );
        }
    }

    #[test]
    fn holes_and_points_behind_the_eye_are_not_drawn() {
        let mut canvas = canvas();
        let mut corners: Vec<_> = (0..9)
            .map(|k| Some((DVec3::new(-f64::from(k / 3), f64::from(k % 3), 0.0), Color32::WHITE)))
            .collect();
        corners[8] = None;
        canvas.surface(&Surface { columns: 3, corners });
        canvas.dot(DVec3::new(0.0, 0.0, -1e3), 3.0, Color32::RED, 0.0);
        canvas.line(&[DVec3::new(0.0, 0.0, -1e3), DVec3::new(0.0, 1.0, -2e3)], 3.0, Color32::RED, 0.0);
        assert_eq!(triangles(canvas).len(), 6, "2 of 8 triangles have the missing corner");
    }
}
