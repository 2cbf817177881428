//! The lens map: ideal ray of every pixel, computed once per lens and zoom value.
//!
//! Inputs are intrinsics, coefficients, and the f64 fold curve and table of initial values of [`Lens`].
//! Output is one `rg32float` texel per pixel: ideal `(u, v)` of the pixel's centre, or [`INVALID_UV`] twice.
//! f64 twin: [`CameraModel::lens_inverse`].

use bytemuck::{Pod, Zeroable};
use camsim_core::camera::CameraModel;
pub use camsim_core::camera::INVALID_UV;
use camsim_core::lens::{FOLD_RAYS, Lens, LensModel, RADIAL_TABLE_LEN};
use glam::DVec2;

use crate::{ideal::full_view, recorder::Recorder};

/// Texel format of a lens map. Half precision would cost 0.3 px.
pub const LENS_MAP_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Float;

/// Side of the square workgroups, pixels.
const WORKGROUP_PX: u32 = 8;

/// Initial value of the inverse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Start {
    /// The lens's own table.
    Cold,
    /// The lens map of a nearby zoom value.
    Warm,
}

/// All variants of the stage, in the order of the pipelines of [`LensInversePass`]. A pinhole needs no
/// initial value. The maps of models that are not here are solved in f64 and uploaded.
pub const VARIANTS: [(LensModel, Start); 5] = [
    (LensModel::Pinhole, Start::Cold),
    (LensModel::BrownConrady, Start::Cold),
    (LensModel::BrownConrady, Start::Warm),
    (LensModel::KannalaBrandt, Start::Cold),
    (LensModel::KannalaBrandt, Start::Warm),
];

/// Mirror of `LensUniform` in shaders/reverse/lens_inverse/lens.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct LensUniform {
    size_px: [u32; 2],
    focal_px: [f32; 2],
    principal_point_whole_px: [i32; 2],
    principal_point_fraction_px: [f32; 2],
    radial: [f32; 4],
    rational: [f32; 4],
    tangential: [f32; 2],
    distorted_max: f32,
    table_distorted_max: f32,
    theta_max: f32,
    fold_min: f32,
    padding: [f32; 2],
}

impl LensUniform {
    fn new(camera: &CameraModel) -> Self {
        // Clamped so that the integer difference to a pixel cannot overflow; so far out every pixel is
        // invalid or meaningless anyway.
        let full_view = camera.principal_point_px.round().clamp(DVec2::splat(-1e9), DVec2::splat(1e9));
        let mut uniform = Self {
            size_px: camera.size_px,
            focal_px: camera.focal_px.as_vec2().to_array(),
            principal_point_whole_px: full_view.as_ivec2().to_array(),
            principal_point_fraction_px: (camera.principal_point_px - full_view).as_vec2().to_array(),
            radial: [0.0; 4],
            rational: [0.0; 4],
            tangential: [0.0; 2],
            distorted_max: finite_f32(camera.lens.distorted_max()),
            table_distorted_max: camera
                .lens
                .radial_table()
                .map_or(1.0, |table| finite_f32(table.distorted_max())),
            theta_max: 0.0,
            fold_min: camera.lens.fold_curve().map_or(0.0, |fold| finite_f32(fold.range().0)),
            padding: [0.0; 2],
        };
        match &camera.lens {
            Lens::Pinhole(_) | Lens::Direction(_) => {}
            // Their maps are solved in f64.
            Lens::Face(_) | Lens::Scaled(_) | Lens::Circle(_) => {}
            Lens::BrownConrady(_) => {
                if let [k1, k2, p1, p2, k3, k4, k5, k6] = *camera.lens.coefficients() {
                    uniform.radial = [k1, k2, k3, 0.0].map(finite_f32);
                    uniform.rational = [k4, k5, k6, 0.0].map(finite_f32);
                    uniform.tangential = [p1, p2].map(finite_f32);
                }
            }
            Lens::Radial(lens) => {
                if let [k1, k2, k3, k4] = *camera.lens.coefficients() {
                    uniform.radial = [k1, k2, k3, k4].map(finite_f32);
                }
                uniform.theta_max = lens.theta_max_rad() as f32;
            }
        }
        uniform
    }
}

/// Nearest finite f32.
fn finite_f32(value: f64) -> f32 {
    value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

/// Fold radii, then ratios for initial values; empty for a pinhole.
fn lens_table(lens: &Lens) -> Vec<f32> {
    let fold = lens.fold_curve().map_or(&[][..], |fold| fold.radii());
    let ratios = lens.radial_table().map_or(&[][..], |table| table.ratios());
    fold.iter().chain(ratios).map(|value| finite_f32(*value)).collect()
}

/// WGSL of one variant.
pub fn shader_source(model: LensModel, start: Start) -> String {
    let [table, formula] = match model {
        LensModel::BrownConrady => [
            include_str!("../../shaders/reverse/lens_inverse/table.wgsl"),
            include_str!("../../shaders/reverse/lens_inverse/brown_conrady.wgsl"),
        ],
        LensModel::KannalaBrandt => [
            include_str!("../../shaders/reverse/lens_inverse/table.wgsl"),
            include_str!("../../shaders/reverse/lens_inverse/kannala_brandt.wgsl"),
        ],
        _ => ["", include_str!("../../shaders/reverse/lens_inverse/pinhole.wgsl")],
    };
    let start = match start {
        Start::Cold => include_str!("../../shaders/reverse/lens_inverse/start_cold.wgsl"),
        Start::Warm => include_str!("../../shaders/reverse/lens_inverse/start_warm.wgsl"),
    };
    let common = include_str!("../../shaders/reverse/lens_inverse/lens.wgsl");
    let main = include_str!("../../shaders/reverse/lens_inverse/main.wgsl");
    [common, table, formula, start, main].concat()
}

/// A lens map and its bind groups.
#[derive(Debug)]
pub struct LensMap {
    /// Texture in [`LENS_MAP_FORMAT`], of the camera's size: written by this stage, then sampled, copied, or
    /// used as `warm`.
    pub texture: wgpu::Texture,
    /// View of the texture.
    pub view: wgpu::TextureView,
    /// Bind groups by index of the variant and view of the initial map.
    groups: Vec<(usize, Option<wgpu::TextureView>, wgpu::BindGroup)>,
}

impl LensMap {
    /// Creates an empty map.
    #[must_use]
    pub fn new(device: &wgpu::Device, size_px: [u32; 2]) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("camsim.lens_inverse.map"),
            size: wgpu::Extent3d { width: size_px[0], height: size_px[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: LENS_MAP_FORMAT,
            usage: wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        Self { view: full_view(&texture), texture, groups: Vec::new() }
    }

    /// Records the upload of a camera's map, solved in f64 here: for models without a shader.
    pub fn upload(&self, device: &wgpu::Device, recorder: &mut Recorder<'_>, camera: &CameraModel) {
        let [width, height] = camera.size_px;
        let row_bytes = (width * 8).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let mut bytes = Vec::with_capacity(row_bytes as usize * height as usize);
        for row in camera.lens_inverse().chunks_exact(width as usize) {
            bytes.extend_from_slice(bytemuck::cast_slice(row));
            bytes.resize(bytes.len().next_multiple_of(row_bytes as usize), 0);
        }
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("camsim.lens_inverse.upload"),
            size: bytes.len() as u64,
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        recorder.write(&buffer, 0, &bytes);
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes), rows_per_image: None };
        recorder.encoder().copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            self.texture.as_image_copy(),
            self.texture.size(),
        );
    }
}

/// Whether a shader makes the map of a lens.
#[must_use]
pub fn has_shader(lens: &Lens) -> bool {
    !lens.is_altered() && VARIANTS.iter().any(|(model, _)| *model == lens.model())
}

/// Pipelines of all variants, and the buffers of a lens.
#[derive(Debug)]
pub struct LensInversePass {
    pipelines: [wgpu::ComputePipeline; VARIANTS.len()],
    uniform: wgpu::Buffer,
    table: wgpu::Buffer,
}

impl LensInversePass {
    /// Compiles every variant.
    pub fn new(device: &wgpu::Device) -> Self {
        let pipelines = VARIANTS.map(|(model, start)| {
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("camsim.lens_inverse"),
                source: wgpu::ShaderSource::Wgsl(shader_source(model, start).into()),
            });
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("camsim.lens_inverse"),
                layout: Some(&pipeline_layout(device, model, start)),
                module: &module,
                entry_point: Some("lens_inverse"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        });
        let buffer = |label, size: usize, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let table_bytes = (FOLD_RAYS + RADIAL_TABLE_LEN) * size_of::<f32>();
        Self {
            pipelines,
            uniform: buffer(
                "camsim.lens_inverse.lens",
                size_of::<LensUniform>(),
                wgpu::BufferUsages::UNIFORM,
            ),
            table: buffer("camsim.lens_inverse.table", table_bytes, wgpu::BufferUsages::STORAGE),
        }
    }

    /// Records the pass that writes the lens map of `camera`, of a model with a shader, to `target`, a map of
    /// the camera's size. `warm`, the map of a camera of the same size and nearby zoom, only shortens the
    /// iteration to the same solution: it must be a pure function of scenario and frame (the map of a zoom
    /// table entry, never that of the previous frame).
    pub fn encode(
        &self,
        device: &wgpu::Device,
        recorder: &mut Recorder<'_>,
        camera: &CameraModel,
        target: &mut LensMap,
        warm: Option<&LensMap>,
    ) {
        let model = camera.lens.model();
        let warm = warm.map(|map| &map.view).filter(|_| model != LensModel::Pinhole);
        let start = if warm.is_some() { Start::Warm } else { Start::Cold };
        let Some(variant) = VARIANTS.iter().position(|variant| *variant == (model, start)) else {
            return target.upload(device, recorder, camera);
        };
        let pipeline = &self.pipelines[variant];
        recorder.write(&self.uniform, 0, bytemuck::bytes_of(&LensUniform::new(camera)));
        recorder.write(&self.table, 0, bytemuck::cast_slice(&lens_table(&camera.lens)));
        let cached = target.groups.iter().position(|(of, from, _)| *of == variant && from.as_ref() == warm);
        let group = cached.unwrap_or_else(|| {
            let group = self.bind(device, pipeline, model, &target.view, warm);
            target.groups.push((variant, warm.cloned(), group));
            target.groups.len() - 1
        });
        let mut pass = recorder.compute_pass("lens_inverse");
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &target.groups[group].2, &[]);
        let [width, height] = camera.size_px;
        pass.dispatch_workgroups(width.div_ceil(WORKGROUP_PX), height.div_ceil(WORKGROUP_PX), 1);
    }

    fn bind(
        &self,
        device: &wgpu::Device,
        pipeline: &wgpu::ComputePipeline,
        model: LensModel,
        target: &wgpu::TextureView,
        warm: Option<&wgpu::TextureView>,
    ) -> wgpu::BindGroup {
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let mut entries = vec![
            entry(0, self.uniform.as_entire_binding()),
            entry(2, wgpu::BindingResource::TextureView(target)),
        ];
        if model != LensModel::Pinhole {
            entries.push(entry(1, self.table.as_entire_binding()));
        }
        entries.extend(warm.map(|warm| entry(3, wgpu::BindingResource::TextureView(warm))));
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("camsim.lens_inverse"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        })
    }
}

/// Explicit layout, because float32 textures are not filterable and a derived layout would require a
/// filterable one.
fn pipeline_layout(device: &wgpu::Device, model: LensModel, start: Start) -> wgpu::PipelineLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let mut entries = vec![
        entry(0, buffer(wgpu::BufferBindingType::Uniform)),
        entry(
            2,
            wgpu::BindingType::StorageTexture {
                access: wgpu::StorageTextureAccess::WriteOnly,
                format: LENS_MAP_FORMAT,
                view_dimension: wgpu::TextureViewDimension::D2,
            },
        ),
    ];
    if model != LensModel::Pinhole {
        entries.push(entry(1, buffer(wgpu::BufferBindingType::Storage { read_only: true })));
    }
    if start == Start::Warm {
        entries.push(entry(
            3,
            wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
        ));
    }
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("camsim.lens_inverse"),
        entries: &entries,
    });
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("camsim.lens_inverse"),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    })
}

#[cfg(test)]
mod tests;
