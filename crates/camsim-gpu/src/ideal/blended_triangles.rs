//! Blended triangles in the order from back to front, as seen by the camera of a key frame.

use std::ops::Range;

use camsim_core::{
    pose::CameraPose,
    scene::{
        Shape,
        depth_sort::{DepthOrder, back_to_front},
    },
};
use glam::{DMat3, DVec2, DVec3};

use super::{DrawSlot, draw_surfaces::index_buffer, surface_pipelines::SurfacePipelines};
use crate::{adapter::GpuError, context::GpuContext, recorder::Recorder, upload::SceneBuffers};

const FEWER_TRIANGLES: &str =
    "have fewer triangles with alphaMode BLEND, or make those MASK whose alpha is 0 or 1";

/// Blended triangles of one ideal frame. The buffer grows when a frame has more than any before.
#[derive(Debug)]
pub(super) struct BlendedTriangles {
    indices: wgpu::Buffer,
    draws: Vec<DrawRange>,
    /// Triangles in cyclic overlap, which are drawn before something behind them.
    pub out_of_order: u32,
}

/// Range of consecutive triangles of one mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
struct DrawRange {
    batch: usize,
    /// Index of the mesh among the placements.
    placement: u32,
    indices: Range<u32>,
}

/// A triangle that may be in view.
struct ViewTriangle {
    batch: usize,
    placement: u32,
    corners: [u32; 3],
    in_camera_m: [DVec3; 3],
}

impl BlendedTriangles {
    pub fn new(gpu: &GpuContext) -> Self {
        Self { indices: index_buffer(gpu, 0), draws: Vec::new(), out_of_order: 0 }
    }

    /// Sorts the triangles and uploads their order. `instances` are the placements drawn of each level of
    /// detail of each batch; `meshes_in_view` are the meshes of the placements.
    pub fn sort(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        buffers: &SceneBuffers,
        level_instances: &[Vec<Range<u32>>],
        meshes_in_view: &[u32],
        pose: &CameraPose,
        tangents: [f64; 4],
    ) -> Result<(), GpuError> {
        let mut triangles = Vec::new();
        for (number, (_, placements)) in buffers
            .batches
            .iter()
            .zip(level_instances)
            .enumerate()
            .filter(|(_, (batch, _))| batch.kind.blends)
        {
            for placement in placements.iter().cloned().flatten() {
                let placed = meshes_in_view
                    .get(placement as usize)
                    .and_then(|&mesh| buffers.meshes.placed.get(mesh as usize));
                let Some(placed) = placed else { continue };
                let camera_from_ned = DMat3::from_quat(pose.ned_from_camera.inverse());
                let camera_from_shape = camera_from_ned * placed.ned_from_shape;
                let origin_m = camera_from_ned * (placed.origin_ned_m - pose.position_ned_m);
                let in_view = triangles_in_view(
                    &buffers.meshes.batches[number].shape,
                    camera_from_shape,
                    origin_m,
                    tangents,
                );
                triangles.extend(in_view.map(|(corners, in_camera_m)| ViewTriangle {
                    batch: number,
                    placement,
                    corners,
                    in_camera_m,
                }));
            }
        }
        let triangles_in_camera: Vec<[DVec3; 3]> =
            triangles.iter().map(|triangle| triangle.in_camera_m).collect();
        let order = back_to_front(&triangles_in_camera)
            .unwrap_or_else(|| DepthOrder { indices: order_by_mesh(&triangles), out_of_order: 0 });
        self.out_of_order = order.out_of_order;
        self.draws = merge_draws(&triangles, &order.indices);
        let indices: Vec<u32> = order.indices.iter().flat_map(|&k| triangles[k as usize].corners).collect();
        self.upload(gpu, recorder, &indices)
    }

    fn upload(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        indices: &[u32],
    ) -> Result<(), GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(indices);
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
        slot: &DrawSlot,
        buffers: &SceneBuffers,
    ) {
        let mut last = None;
        for DrawRange { batch: number, placement, indices } in &self.draws {
            let (Some(batch), Some(group)) =
                (buffers.batches.get(*number), slot.material_groups.get(*number))
            else {
                continue;
            };
            let Some(pipeline) = pipelines.blended.get(&batch.kind) else { continue };
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

/// Triangles of a batch's shape that may be in view, with their corners in the camera.
fn triangles_in_view(
    shape: &Shape,
    camera_from_shape: DMat3,
    origin_m: DVec3,
    [u_min, u_max, v_min, v_max]: [f64; 4],
) -> impl Iterator<Item = ([u32; 3], [DVec3; 3])> {
    let vertices = &shape.vertices;
    let corners = shape.indices.chunks_exact(3).map(|of| [of[0], of[1], of[2]]);
    corners.filter_map(move |corners| {
        let [a, b, c] = corners.map(|corner| {
            let position = vertices.get(corner as usize)?.position_m;
            Some(origin_m + camera_from_shape * DVec3::from_array(position.map(f64::from)))
        });
        let points = [a?, b?, c?];
        // Outside one side of the view frustum, by planes through the camera, so that positions behind the
        // camera count too.
        let is_outside = |side: &dyn Fn(&DVec3) -> f64| points.iter().all(|point| side(point) < 0.0);
        let is_culled = is_outside(&|p| p.z)
            || is_outside(&|p| p.x - u_min * p.z)
            || is_outside(&|p| u_max * p.z - p.x)
            || is_outside(&|p| p.y - v_min * p.z)
            || is_outside(&|p| v_max * p.z - p.y);
        (!is_culled).then_some((corners, points))
    })
}

/// Fallback order if there are too many triangles to sort by occlusion: meshes from the farthest by the mean
/// of their triangles' centres, and the triangles of each mesh likewise.
fn order_by_mesh(triangles: &[ViewTriangle]) -> Vec<u32> {
    let middle = |triangle: &ViewTriangle| triangle.in_camera_m.iter().sum::<DVec3>() / 3.0;
    let mut mesh_sums = std::collections::HashMap::new();
    for triangle in triangles {
        let (sum, count) = mesh_sums.entry(triangle.placement).or_insert((DVec3::ZERO, 0.0));
        *sum += middle(triangle);
        *count += 1.0;
    }
    let distances = |k: &u32| {
        let triangle = &triangles[*k as usize];
        let mesh_sums =
            mesh_sums.get(&triangle.placement).map_or(0.0, |(sum, count)| (*sum / *count).length());
        DVec2::new(mesh_sums, middle(triangle).length())
    };
    let mut order: Vec<(DVec2, u32)> = (0..triangles.len() as u32).map(|k| (distances(&k), k)).collect();
    let key = |(far, k): &(DVec2, u32)| (far.x, triangles[*k as usize].placement, far.y, *k);
    order.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(b.2.total_cmp(&a.2)).then(a.3.cmp(&b.3))
    });
    order.into_iter().map(|(_, k)| k).collect()
}

/// Merges consecutive triangles of one mesh into one draw.
fn merge_draws(triangles: &[ViewTriangle], order: &[u32]) -> Vec<DrawRange> {
    let mut draws: Vec<DrawRange> = Vec::new();
    for (&k, first) in order.iter().zip((0_u32..).step_by(3)) {
        let &ViewTriangle { batch, placement, .. } = &triangles[k as usize];
        match draws.last_mut() {
            Some(last) if last.placement == placement && last.batch == batch => last.indices.end = first + 3,
            _ => draws.push(DrawRange { batch, placement, indices: first..first + 3 }),
        }
    }
    draws
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle of a placement at a distance along the axis.
    fn triangle(batch: usize, placement: u32, far_m: f64) -> ViewTriangle {
        let position = |x: f64, y: f64| DVec3::new(x, y, far_m);
        ViewTriangle {
            batch,
            placement,
            corners: [0, 1, 2],
            in_camera_m: [position(-0.01, -0.01), position(0.01, -0.01), position(0.0, 0.02)],
        }
    }

    #[test]
    fn fallback_order_draws_interleaved_meshes_one_by_one() {
        // The centres of the two meshes are 10.5 and 11 m away.
        let triangles =
            [triangle(0, 3, 10.0), triangle(1, 4, 10.5), triangle(0, 3, 11.0), triangle(1, 4, 11.5)];
        let order = order_by_mesh(&triangles);
        assert_eq!(order, [3, 1, 2, 0]);
        let draws = merge_draws(&triangles, &order);
        assert_eq!(
            draws,
            [
                DrawRange { batch: 1, placement: 4, indices: 0..6 },
                DrawRange { batch: 0, placement: 3, indices: 6..12 }
            ]
        );
        // The occlusion order alternates between them.
        let triangles_in_camera: Vec<_> = triangles.iter().map(|triangle| triangle.in_camera_m).collect();
        let order = back_to_front(&triangles_in_camera).expect("few").indices;
        assert_eq!(order, [3, 2, 1, 0]);
        assert_eq!(merge_draws(&triangles, &order).len(), 4);
    }
}
