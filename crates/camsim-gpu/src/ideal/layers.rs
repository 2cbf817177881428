//! What is mixed with what is behind it: its triangles from behind to the front, as a key's camera sees them.

use std::ops::Range;

use camsim_core::{
    pose::CameraPose,
    scene::{
        Shape,
        depth_sort::{DepthOrder, back_to_front},
    },
};
use glam::{DMat3, DVec2, DVec3};

use super::{IdealSlot, pipelines::SurfacePipelines, surfaces::index_buffer};
use crate::{
    context::{GpuContext, GpuError},
    recorder::Recorder,
    upload::SceneBuffers,
};

const FEWER_TRIANGLES: &str =
    "have fewer triangles with alphaMode BLEND, or make those MASK whose alpha is 0 or 1";

/// The triangles that one ideal frame mixes. Buffers are replaced by larger ones when a frame has more than
/// any before.
#[derive(Debug)]
pub(super) struct Ordered {
    indices: wgpu::Buffer,
    draws: Vec<Draw>,
    /// Triangles in rings that are drawn before something behind them.
    pub out_of_order: u32,
}

/// Triangles of one mesh that follow each other.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Draw {
    batch: usize,
    /// Place of the mesh among the placements.
    placement: u32,
    indices: Range<u32>,
}

/// A triangle that may be in view.
struct Triangle {
    batch: usize,
    placement: u32,
    corners: [u32; 3],
    in_camera_m: [DVec3; 3],
}

impl Ordered {
    pub fn new(gpu: &GpuContext) -> Self {
        Self { indices: index_buffer(gpu, 0), draws: Vec::new(), out_of_order: 0 }
    }

    /// Finds and writes the order. `drawn` says which placements are drawn of each batch, `seen` whose those
    /// are.
    pub fn order(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        buffers: &SceneBuffers,
        drawn: &[Vec<Range<u32>>],
        seen: &[u32],
        pose: &CameraPose,
        tangents: [f64; 4],
    ) -> Result<(), GpuError> {
        let mut triangles = Vec::new();
        for (number, (_, placements)) in
            buffers.batches.iter().zip(drawn).enumerate().filter(|(_, (batch, _))| batch.kind.blends)
        {
            for placement in placements.iter().cloned().flatten() {
                let place =
                    seen.get(placement as usize).and_then(|&mesh| buffers.meshes.placed.get(mesh as usize));
                let Some(place) = place else { continue };
                let camera_from_ned = DMat3::from_quat(pose.ned_from_camera.inverse());
                let camera_from_shape = camera_from_ned * place.ned_from_shape;
                let origin_m = camera_from_ned * (place.origin_ned_m - pose.position_ned_m);
                let of_shape =
                    in_sight(&buffers.meshes.batches[number].shape, camera_from_shape, origin_m, tangents);
                triangles.extend(of_shape.map(|(corners, in_camera_m)| Triangle {
                    batch: number,
                    placement,
                    corners,
                    in_camera_m,
                }));
            }
        }
        let places: Vec<[DVec3; 3]> = triangles.iter().map(|triangle| triangle.in_camera_m).collect();
        let order = back_to_front(&places)
            .unwrap_or_else(|| DepthOrder { indices: mesh_by_mesh(&triangles), out_of_order: 0 });
        self.out_of_order = order.out_of_order;
        self.draws = runs(&triangles, &order.indices);
        let indices: Vec<u32> = order.indices.iter().flat_map(|&k| triangles[k as usize].corners).collect();
        let bytes: &[u8] = bytemuck::cast_slice(&indices);
        gpu.check_storage(
            "the triangles that one frame mixes with what is behind them",
            bytes.len() as u64,
            FEWER_TRIANGLES,
        )?;
        if self.indices.size() < bytes.len() as u64 {
            self.indices = index_buffer(gpu, bytes.len() as u64);
        }
        if !bytes.is_empty() {
            recorder.write(&self.indices, 0, bytes);
        }
        Ok(())
    }

    pub fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipelines: &SurfacePipelines,
        slot: &IdealSlot,
        buffers: &SceneBuffers,
    ) {
        let mut last = None;
        for Draw { batch: number, placement, indices } in &self.draws {
            let (Some(batch), Some(group)) = (buffers.batches.get(*number), slot.mesh_groups.get(*number))
            else {
                continue;
            };
            let Some(pipeline) = pipelines.layers.get(&batch.kind) else { continue };
            if last != Some(*number) {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(1, group, &[]);
                pass.set_bind_group(2, &slot.placement_group, &[]);
                pass.set_vertex_buffer(0, batch.vertices.slice(..));
                if let Some(normals) = &batch.normals {
                    pass.set_vertex_buffer(1, normals.slice(..));
                }
                pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
                last = Some(*number);
            }
            pass.draw_indexed(indices.clone(), 0, *placement..placement + 1);
        }
    }
}

/// Triangles of a batch's shape that may be in view, by their corners.
fn in_sight(
    shape: &Shape,
    camera_from_shape: DMat3,
    origin_m: DVec3,
    [u_min, u_max, v_min, v_max]: [f64; 4],
) -> impl Iterator<Item = ([u32; 3], [DVec3; 3])> {
    let vertices = &shape.vertices;
    let corners = shape.indices.chunks_exact(3).map(|of| [of[0], of[1], of[2]]);
    corners.filter_map(move |corners| {
        let [a, b, c] = corners.map(|corner| {
            let at = vertices.get(corner as usize)?.position_m;
            Some(origin_m + camera_from_shape * DVec3::from_array(at.map(f64::from)))
        });
        let points = [a?, b?, c?];
        // Beyond one side of the view; by planes through the camera, so that what is beside it counts too.
        let beyond = |side: &dyn Fn(&DVec3) -> f64| points.iter().all(|point| side(point) < 0.0);
        let outside = beyond(&|p| p.z)
            || beyond(&|p| p.x - u_min * p.z)
            || beyond(&|p| u_max * p.z - p.x)
            || beyond(&|p| p.y - v_min * p.z)
            || beyond(&|p| v_max * p.z - p.y);
        (!outside).then_some((corners, points))
    })
}

/// Meshes from the farthest on by the middle of their triangles, and the triangles of each likewise: of more
/// than an order is found for.
fn mesh_by_mesh(triangles: &[Triangle]) -> Vec<u32> {
    let middle = |triangle: &Triangle| triangle.in_camera_m.iter().sum::<DVec3>() / 3.0;
    let mut of_mesh = std::collections::HashMap::new();
    for triangle in triangles {
        let (sum, count) = of_mesh.entry(triangle.placement).or_insert((DVec3::ZERO, 0.0));
        *sum += middle(triangle);
        *count += 1.0;
    }
    let distances = |k: &u32| {
        let triangle = &triangles[*k as usize];
        let of_mesh = of_mesh.get(&triangle.placement).map_or(0.0, |(sum, count)| (*sum / *count).length());
        DVec2::new(of_mesh, middle(triangle).length())
    };
    let mut order: Vec<(DVec2, u32)> = (0..triangles.len() as u32).map(|k| (distances(&k), k)).collect();
    let key = |(far, k): &(DVec2, u32)| (far.x, triangles[*k as usize].placement, far.y, *k);
    order.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(b.2.total_cmp(&a.2)).then(a.3.cmp(&b.3))
    });
    order.into_iter().map(|(_, k)| k).collect()
}

/// Those that follow each other and are of one mesh are drawn at once.
fn runs(triangles: &[Triangle], order: &[u32]) -> Vec<Draw> {
    let mut draws: Vec<Draw> = Vec::new();
    for (&k, first) in order.iter().zip((0_u32..).step_by(3)) {
        let &Triangle { batch, placement, .. } = &triangles[k as usize];
        match draws.last_mut() {
            Some(last) if last.placement == placement && last.batch == batch => last.indices.end = first + 3,
            _ => draws.push(Draw { batch, placement, indices: first..first + 3 }),
        }
    }
    draws
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Far away along the axis, of a placement of a batch.
    fn triangle(batch: usize, placement: u32, far_m: f64) -> Triangle {
        let at = |x: f64, y: f64| DVec3::new(x, y, far_m);
        Triangle {
            batch,
            placement,
            corners: [0, 1, 2],
            in_camera_m: [at(-0.01, -0.01), at(0.01, -0.01), at(0.0, 0.02)],
        }
    }

    #[test]
    fn meshes_within_each_other_are_drawn_one_after_the_other() {
        // The middles of the two meshes are 10.5 and 11 m away.
        let triangles =
            [triangle(0, 3, 10.0), triangle(1, 4, 10.5), triangle(0, 3, 11.0), triangle(1, 4, 11.5)];
        let order = mesh_by_mesh(&triangles);
        assert_eq!(order, [3, 1, 2, 0]);
        let draws = runs(&triangles, &order);
        assert_eq!(
            draws,
            [Draw { batch: 1, placement: 4, indices: 0..6 }, Draw { batch: 0, placement: 3, indices: 6..12 }]
        );
        // With an order of their own they take turns.
        let places: Vec<_> = triangles.iter().map(|triangle| triangle.in_camera_m).collect();
        let order = back_to_front(&places).expect("few").indices;
        assert_eq!(order, [3, 2, 1, 0]);
        assert_eq!(runs(&triangles, &order).len(), 4);
    }
}
