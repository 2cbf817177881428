//! Faces and lines in three dimensions by egui's painter: one mesh, whose triangles are drawn from the
//! farthest to the nearest.

use eframe::egui::{Color32, Mesh, Pos2, Shape, Vec2, vec2};
use glam::DVec3;

use crate::orbit::Eye;

/// Points over which borders of lines fade.
const FADE: f32 = 0.8;
/// Pieces of an edge of a pyramid: where it goes through the ground, part of it is hidden.
const PIECES: u32 = 24;
/// Light on the faces of a box, by the axis that they are across: from the north-west and above.
const LIGHT: [[f32; 2]; 3] = [[0.5, 0.75], [0.65, 0.55], [0.9, 0.4]];

/// A surface as a grid of corners, row after row, each with its colour; `None` where there is none.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// Corners in a row.
    pub columns: usize,
    /// NED metres.
    pub corners: Vec<Option<(DVec3, Color32)>>,
}

/// What is drawn so far.
pub struct Canvas {
    eye: Eye,
    centre: Pos2,
    mesh: Mesh,
    /// Distance, and the corners in the mesh.
    triangles: Vec<(f32, [u32; 3])>,
}

impl Canvas {
    /// Nothing yet, around a place of the screen.
    pub fn new(eye: Eye, centre: Pos2) -> Self {
        Self { eye, centre, mesh: Mesh::default(), triangles: Vec::new() }
    }

    /// All of it.
    pub fn mesh(mut self) -> Shape {
        // Those at one distance stay in order.
        self.triangles.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.mesh.indices = self.triangles.into_iter().flat_map(|(_, corners)| corners).collect();
        Shape::mesh(self.mesh)
    }

    fn corner(&mut self, at: Pos2, color: Color32) -> u32 {
        let index = self.mesh.vertices.len() as u32;
        self.mesh.colored_vertex(at, color);
        index
    }

    fn on_screen(&self, seen: DVec3) -> Pos2 {
        let place = self.eye.place(seen);
        self.centre + vec2(place.x as f32, place.y as f32)
    }

    /// Two triangles a cell, each corner in its colour.
    pub fn surface(&mut self, surface: &Surface) {
        let near_m = self.eye.near_m();
        let placed: Vec<Option<(DVec3, Color32, u32)>> = surface
            .corners
            .iter()
            .map(|corner| {
                let (ned_m, color) = (*corner)?;
                let seen = self.eye.seen(ned_m);
                let index =
                    if seen.z >= near_m { self.corner(self.on_screen(seen), color) } else { u32::MAX };
                Some((seen, color, index))
            })
            .collect();
        let columns = surface.columns.max(1);
        let rows = placed.len() / columns;
        for row in 1..rows {
            for column in 1..columns {
                let at = row * columns + column;
                let [nw, ne, sw, se] = [at - columns - 1, at - columns, at - 1, at].map(|at| placed[at]);
                // The diagonal runs from north-west to south-east, as in the terrain.
                for corners in [[nw, sw, se], [nw, se, ne]] {
                    if let [Some(a), Some(b), Some(c)] = corners {
                        self.triangle([a, b, c]);
                    }
                }
            }
        }
    }

    /// One triangle, cut off where it comes too near.
    fn triangle(&mut self, corners: [(DVec3, Color32, u32); 3]) {
        let seen = corners.map(|corner| corner.0);
        if corners.iter().all(|corner| corner.2 != u32::MAX) {
            let depth = (seen[0].z + seen[1].z + seen[2].z) / 3.0;
            self.triangles.push((depth as f32, corners.map(|corner| corner.2)));
        } else {
            self.face_seen(&seen, corners[0].1);
        }
    }

    /// A convex face of one colour.
    fn face(&mut self, corners_ned_m: &[DVec3], color: Color32) {
        let seen: Vec<DVec3> = corners_ned_m.iter().map(|corner| self.eye.seen(*corner)).collect();
        self.face_seen(&seen, color);
    }

    fn face_seen(&mut self, seen: &[DVec3], color: Color32) {
        let kept = self.eye.clipped(seen);
        if kept.len() < 3 {
            return;
        }
        let depth = kept.iter().map(|corner| corner.z).sum::<f64>() / kept.len() as f64;
        let indices: Vec<u32> =
            kept.iter().map(|corner| self.corner(self.on_screen(*corner), color)).collect();
        for pair in indices[1..].windows(2) {
            self.triangles.push((depth as f32, [indices[0], pair[0], pair[1]]));
        }
    }

    /// A line that counts as nearer by so many metres, to lie on what it is drawn on.
    pub fn line(&mut self, points_ned_m: &[DVec3], width: f32, color: Color32, lift_m: f64) {
        for pair in points_ned_m.windows(2) {
            let seen = self.eye.clipped(&[self.eye.seen(pair[0]), self.eye.seen(pair[1])]);
            if let [from, to] = seen.as_slice() {
                let depth = 0.5 * (from.z + to.z) - lift_m;
                self.stroke([self.on_screen(*from), self.on_screen(*to)], width, color, depth as f32);
            }
        }
    }

    /// A straight stroke whose borders fade.
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
        let ends = steps.map(|(by, color)| [from, to].map(|end| self.corner(end + by * aside, color)));
        for pair in ends.windows(2) {
            let [[a, b], [c, d]] = [pair[0], pair[1]];
            self.triangles.extend([(depth, [a, b, c]), (depth, [c, b, d])]);
        }
    }

    /// A spot of so many points across, whatever the distance.
    pub fn dot(&mut self, ned_m: DVec3, radius: f32, color: Color32, lift_m: f64) {
        let seen = self.eye.seen(ned_m);
        if seen.z < self.eye.near_m() {
            return;
        }
        let (at, depth) = (self.on_screen(seen), (seen.z - lift_m) as f32);
        let middle = self.corner(at, color);
        let rim: Vec<u32> = (0..8)
            .map(|k| self.corner(at + radius * Vec2::angled(std::f32::consts::TAU * k as f32 / 8.0), color))
            .collect();
        for k in 0..8 {
            self.triangles.push((depth, [middle, rim[k], rim[(k + 1) % 8]]));
        }
    }

    /// A box along the axes, of which the faces that are seen are drawn.
    pub fn cuboid(&mut self, [low, high]: [DVec3; 2], color: Color32, outlined: bool) {
        let corner = |at: usize| {
            let pick = |axis: usize| if at >> axis & 1 == 0 { low[axis] } else { high[axis] };
            DVec3::new(pick(0), pick(1), pick(2))
        };
        for (axis, light) in LIGHT.into_iter().enumerate() {
            let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            for (side, light) in light.into_iter().enumerate() {
                let start = side << axis;
                let face = [start, start | u, start | u | v, start | v].map(corner);
                let outward = if side == 0 { -1.0 } else { 1.0 };
                // Only those that look towards the eye.
                if self.eye.faces(axis, outward, face[0]) {
                    self.face(&face, darker(color, light));
                    if outlined {
                        self.outline(&face);
                    }
                }
            }
        }
    }

    /// The edges of a face, which are drawn with it and not where the parts of them are.
    fn outline(&mut self, corners_ned_m: &[DVec3; 4]) {
        let seen = corners_ned_m.map(|corner| self.eye.seen(corner));
        let depth = seen.iter().map(|corner| corner.z).sum::<f64>() / 4.0;
        for k in 0..4 {
            if let [from, to] = self.eye.clipped(&[seen[k], seen[(k + 1) % 4]]).as_slice() {
                self.stroke(
                    [self.on_screen(*from), self.on_screen(*to)],
                    1.0,
                    Color32::from_black_alpha(140),
                    depth as f32,
                );
            }
        }
    }

    /// What a camera sees from its place as far as a rim: sides that can be looked through, and their edges
    /// at the corners.
    pub fn pyramid(&mut self, apex_ned_m: DVec3, rim: &[DVec3], color: Color32) {
        let count = rim.len();
        if count < 3 {
            return;
        }
        let pieces = |from: DVec3, to: DVec3| -> Vec<DVec3> {
            (0..=PIECES).map(|k| from.lerp(to, f64::from(k) / f64::from(PIECES))).collect()
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

/// A colour that less light falls on.
fn darker(color: Color32, light: f32) -> Color32 {
    let [r, g, b] = [color.r(), color.g(), color.b()].map(|value| (f32::from(value) * light) as u8);
    Color32::from_rgb(r, g, b)
}

#[cfg(test)]
mod tests {
    use eframe::egui::pos2;
    use glam::DVec2;

    use super::*;
    use crate::orbit::{Ball, Orbit};

    fn canvas() -> Canvas {
        let ball = Ball { middle_ned_m: DVec3::ZERO, radius_m: 10.0 };
        Canvas::new(Eye::new(&Orbit::from_above(), ball, DVec2::splat(200.0)), pos2(100.0, 100.0))
    }

    fn triangles(canvas: Canvas) -> Vec<[(Pos2, Color32); 3]> {
        let Shape::Mesh(mesh) = canvas.mesh() else { panic!("a mesh") };
        let corner = |index: u32| (mesh.vertices[index as usize].pos, mesh.vertices[index as usize].color);
        mesh.indices.chunks_exact(3).map(|t| [corner(t[0]), corner(t[1]), corner(t[2])]).collect()
    }

    #[test]
    fn what_is_nearer_is_drawn_later_whatever_came_first() {
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
        assert_eq!(
            colors,
            expected.collect::<Vec<_>>(),
            "from above: the green one lies below, with a line on it"
        );
    }

    #[test]
    fn of_a_box_from_above_only_its_top_is_drawn() {
        let mut canvas = canvas();
        // Exactly below the eye, so that no side is seen.
        canvas.cuboid([DVec3::splat(-1.0), DVec3::splat(1.0)], Color32::WHITE, false);
        let drawn = triangles(canvas);
        assert_eq!(drawn.len(), 2);
        // The top is 10 / sin 22.5 deg - 1 = 25.13 m away, and 100 / tan 22.5 deg = 241.4 points are a
        // tangent of 1.
        for (at, _) in drawn.iter().flatten() {
            let away = *at - pos2(100.0, 100.0);
            assert!((away.x.abs() - 9.606).abs() < 1e-2 && (away.y.abs() - 9.606).abs() < 1e-2, "{away}");
        }
    }

    #[test]
    fn holes_of_a_surface_stay_open_and_what_is_behind_the_eye_is_not_drawn() {
        let mut canvas = canvas();
        let mut corners: Vec<_> = (0..9)
            .map(|k| Some((DVec3::new(-f64::from(k / 3), f64::from(k % 3), 0.0), Color32::WHITE)))
            .collect();
        corners[8] = None;
        canvas.surface(&Surface { columns: 3, corners });
        canvas.dot(DVec3::new(0.0, 0.0, -1e3), 3.0, Color32::RED, 0.0);
        canvas.line(&[DVec3::new(0.0, 0.0, -1e3), DVec3::new(0.0, 1.0, -2e3)], 3.0, Color32::RED, 0.0);
        assert_eq!(triangles(canvas).len(), 6, "of 8, two have the corner that is missing");
    }
}
