//! `repr(C)` mirrors of the shader structs; a test compares their offsets with naga's reflection.

use bytemuck::{Pod, Zeroable};
use camsim_core::scene::MeshVertex;
pub use camsim_plan::uniforms::{FrameUniforms, IdealCamera, Truth};

/// Mirror of `KeyLayout` in shaders/ideal/triangles_near_edges.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader, field by field")]
pub struct KeyLayout {
    pub ideal_size_px: [u32; 2],
    pub first_row: u32,
    pub tiles_across: u32,
    pub index_count: u32,
    pub pad0: u32,
    pub pad1: u32,
    pub pad2: u32,
}

/// A vertex of a mesh: `shaders/ideal/mesh.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct MeshVertexData {
    /// Position in the axes of the shape, metres.
    pub position_m: [f32; 3],
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Factor of the texture's colour and alpha, times 65535.
    pub tint: [u16; 4],
}

impl From<&MeshVertex> for MeshVertexData {
    fn from(vertex: &MeshVertex) -> Self {
        let tint = vertex.tint.map(|part| (part.clamp(0.0, 1.0) * 65_535.0 + 0.5) as u16);
        Self { position_m: vertex.position_m, uv: vertex.uv, tint }
    }
}

/// Material of a mesh besides its texture. Mirror of `MeshMaterial` in `shaders/ideal/mesh_surface.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct MeshMaterial {
    /// Emitted linear R G B, and the alpha cut-off.
    pub emissive_cutoff: [f32; 4],
    /// Direction towards the sun (NED) times its strength, and the strength of the sky.
    pub sun_sky: [f32; 4],
}

/// Rows of the affine map from the axes of a shape to NED relative to the base of a key frame, metres. Mirror
/// of `MeshPlacement` in `shaders/ideal/mesh_surface.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct MeshPlacement {
    /// Row of the north component.
    pub x: [f32; 4],
    /// Row of the east component.
    pub y: [f32; 4],
    /// Row of the down component.
    pub z: [f32; 4],
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::mem::{offset_of, size_of};

    use super::*;
    use crate::{reverse, shaders};

    fn members(module: &naga::Module, name: &str) -> (Vec<(String, usize)>, usize) {
        let (_, ty) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).unwrap();
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is not a struct") };
        (members.iter().map(|m| (m.name.clone().unwrap(), m.offset as usize)).collect(), *span as usize)
    }

    macro_rules! assert_mirror {
        ($module:expr, $name:literal, $mirror:ty, [$($field:ident),* $(,)?]) => {
            let (found, span) = members($module, $name);
            let expected = vec![$((stringify!($field).to_owned(), offset_of!($mirror, $field))),*];
            assert_eq!(found, expected);
            assert_eq!(span, size_of::<$mirror>(), $name);
        };
    }

    #[test]
    fn struct_layouts_equal_those_of_the_shaders() {
        // Long because: one line per field.
        let parse = |text: String| {
            naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)))
        };
        let key = *reverse::PipelineKey::all().last().unwrap();
        let module = parse(shaders::compose(reverse::SHADER, &key.slots()).unwrap());
        assert_mirror!(
            &module,
            "Frame",
            FrameUniforms,
            [
                size_px,
                ideal_size_px,
                ideal_focal_px,
                ideal_principal_px,
                focal_px,
                principal_px,
                near_m,
                nodes,
                line_axis,
                lines,
                fields,
                iterations,
                samples_per_px,
                max_samples,
                max_taps,
                coords_phase,
                light,
                noise_sigma,
                vignette_thresholds,
                seed,
                frame_number,
                mono,
                node_stride,
                edge_scale,
                edge_samples,
                rk2_step_rad,
                lens_tangential,
                key_position_ned_m,
                ned_from_key_x,
                ned_from_key_y,
                ned_from_key_z,
                key_velocity_m_s,
                key_rate_rad_s,
                lens_radial,
                most,
                linear_fog,
                keys,
                key_rows,
                pad1,
                sky_reach_px,
                planes,
            ]
        );
        assert_mirror!(&module, "Truth", Truth, [uv, source_px, point_ned_m, depth_m]);
        let module = parse(
            shaders::compose(
                "ideal/terrain.wgsl",
                &crate::ideal::terrain_slots(camsim_plan::PrefilterTaps::Grid, true, true),
            )
            .unwrap(),
        );
        assert_mirror!(
            &module,
            "IdealCamera",
            IdealCamera,
            [
                clip_scale,
                clip_shift,
                camera_from_ned_x,
                camera_from_ned_y,
                camera_from_ned_z,
                camera_from_base_m,
                sky,
                near_m,
                pad0,
                pad1,
                pad2,
            ]
        );
        let slots = crate::ideal::mesh_slots(camsim_plan::PrefilterTaps::Grid, 1, false, true);
        let module = parse(shaders::compose("ideal/mesh.wgsl", &slots).unwrap());
        assert_mirror!(&module, "MeshPlacement", MeshPlacement, [x, y, z]);
        assert_mirror!(&module, "MeshMaterial", MeshMaterial, [emissive_cutoff, sun_sky]);
        let module = parse(shaders::compose("ideal/triangles_near_edges.wgsl", &[]).unwrap());
        assert_mirror!(
            &module,
            "KeyLayout",
            KeyLayout,
            [ideal_size_px, first_row, tiles_across, index_count, pad0, pad1, pad2]
        );
    }
}
