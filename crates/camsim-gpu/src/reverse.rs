//! The reverse pipeline: output pixel -> lens inverse (map) -> temporal inverse -> gather -> photometric ->
//! output buffer.
//!
//! One fused compute kernel, composed of one file a stage; what a frame does not need is not in its text.
//! [`PipelineKey::all`] lists every legal composition.

use std::collections::{HashMap, hash_map::Entry};

use camsim_core::shutter::RowAxis;
use camsim_plan::{FramePlan, RayStage};

use crate::{
    context::GpuContext,
    ideal::{FineTarget, whole},
    recorder::Recorder,
    shaders::{self, ComposeError},
};

mod key;
pub mod lens_inverse;

pub use key::{EdgeKind, KeyKind, PipelineKey, TapKind, TemporalKind};

/// The kernel's main file.
pub const SHADER: &str = "reverse/reverse.wgsl";
/// The kernel that goes through the pixels that it lists, where silhouettes can be in view.
pub const CANDIDATES_SHADER: &str = "reverse/edges/candidates.wgsl";
/// The kernel of those that stay.
pub const RAYS_SHADER: &str = "reverse/rays.wgsl";
/// Edge of the square workgroups.
const WORKGROUP_PX: u32 = 8;

/// What a dispatch reads and writes.
#[derive(Debug)]
pub struct ReverseBindings<'a> {
    /// `FrameUniforms`.
    pub frame: &'a wgpu::Buffer,
    /// Normal quantiles, a row an octave.
    pub noise_table: &'a wgpu::TextureView,
    /// Ideal colour.
    pub color: &'a wgpu::TextureView,
    /// Ideal depth.
    pub depth: &'a wgpu::TextureView,
    /// The ideal frame's samples, when the key reads them.
    pub fine: Option<&'a FineTarget>,
    /// Relative poses of the lines, or their times for the constant-twist solvers.
    pub poses: &'a wgpu::Buffer,
    /// Vignette weights.
    pub vignette: &'a wgpu::TextureView,
    /// Lens map, when the key reads one.
    pub lens_map: Option<&'a wgpu::TextureView>,
    /// Linear R G B A.
    pub out_color: &'a wgpu::Buffer,
    /// Depth and coordinates, when the key writes them.
    pub out_truth: Option<&'a wgpu::Buffer>,
    /// Lists of pixels, when the key lists any: of the picture's kernel, and what stays of it. Each has
    /// [`list_size`] bytes, the first four words of them [`EMPTY_LIST`].
    pub lists: Option<&'a [wgpu::Buffer; 2]>,
}

/// Head of the list of pixels before a frame: arguments of an empty dispatch, and no pixel.
pub const EMPTY_LIST: [u32; 4] = [0, 1, 1, 0];

/// Bytes for a list of all pixels of a picture. A shader's structure is a multiple of its alignment long: the
/// head and one pixel take 32.
#[must_use]
pub fn list_size(size_px: [u32; 2]) -> u64 {
    let words = EMPTY_LIST.len() as u64 + u64::from(size_px[0]) * u64::from(size_px[1]);
    (4 * words).next_multiple_of(LIST_ALIGNMENT)
}

/// That of the `vec3<u32>` in a list's head.
const LIST_ALIGNMENT: u64 = 16;

/// Bind groups of one frame in flight with one ideal target: of the picture's kernel and those of its
/// silhouettes, made when a key is first used. They go with the target, and when a buffer of the frame's is
/// replaced.
#[derive(Debug, Default)]
pub struct ReverseGroups(HashMap<PipelineKey, [Groups; 3]>);

type Groups = [Option<wgpu::BindGroup>; 4];

impl ReverseGroups {
    /// A buffer was replaced.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}

#[derive(Debug)]
struct Variant {
    pipeline: wgpu::ComputePipeline,
    lists: Lists,
    groups: [Option<wgpu::BindGroupLayout>; 4],
}

/// The kernels of a frame: the picture's, and where there may be silhouettes that of its list and that of
/// their rays.
#[derive(Debug)]
struct Kernels {
    picture: Variant,
    silhouettes: Option<[Variant; 2]>,
}

/// What a kernel does with the lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lists {
    /// Fills the first.
    Fills,
    /// Takes what stays from the first into the second.
    Thins,
    /// Reads the second.
    Reads,
}

/// Kernels, compiled when first needed.
#[derive(Debug)]
pub struct ReversePass {
    variants: HashMap<PipelineKey, Kernels>,
    /// Between texels, and of none of them.
    samplers: [wgpu::Sampler; 2],
}

impl ReversePass {
    /// Compiles nothing yet.
    #[must_use]
    pub fn new(gpu: &GpuContext) -> Self {
        let samplers = [wgpu::FilterMode::Linear, wgpu::FilterMode::Nearest].map(|filter| {
            gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("camsim.reverse.sampler"),
                mag_filter: filter,
                min_filter: filter,
                ..Default::default()
            })
        });
        Self { variants: HashMap::new(), samplers }
    }

    /// Records the kernel of a plan; `groups` are those of these `bindings`.
    ///
    /// # Errors
    /// Faults of the shader files.
    pub fn encode(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        plan: &FramePlan,
        bindings: &ReverseBindings<'_>,
        groups: &mut ReverseGroups,
    ) -> Result<(), ComposeError> {
        let key = PipelineKey::of(plan);
        let kernels = match self.variants.entry(key) {
            Entry::Occupied(compiled) => compiled.into_mut(),
            Entry::Vacant(first_use) => first_use.insert(Kernels {
                picture: Variant::new(gpu, key, SHADER, "reverse", Lists::Fills)?,
                silhouettes: match key.edges {
                    EdgeKind::None => None,
                    _ => Some([
                        Variant::new(gpu, key, CANDIDATES_SHADER, "ask", Lists::Thins)?,
                        Variant::new(gpu, key, RAYS_SHADER, "rays", Lists::Reads)?,
                    ]),
                },
            }),
        };
        let [of_picture, of_silhouettes @ ..] = groups.0.entry(key).or_insert_with(|| {
            let bind = |variant: &Variant| variant.bind(gpu, &self.samplers, bindings);
            let [candidates, rays] =
                kernels.silhouettes.as_ref().map(|of| of.each_ref().map(bind)).unwrap_or_default();
            [bind(&kernels.picture), candidates, rays]
        });
        let mut pass = recorder.compute_pass("reverse");
        kernels.picture.set(&mut pass, of_picture);
        let [across, down] = workgroups(plan, pixels_a_thread(gpu, key));
        pass.dispatch_workgroups(across, down, 1);
        drop(pass);
        if let (Some(variants), Some(lists)) = (&kernels.silhouettes, bindings.lists) {
            for (((variant, groups), list), name) in
                variants.iter().zip(of_silhouettes).zip(lists).zip(["candidates", "rays"])
            {
                let mut pass = recorder.compute_pass(name);
                variant.set(&mut pass, groups);
                pass.dispatch_workgroups_indirect(list, 0);
            }
        }
        Ok(())
    }
}

/// Where poses are not held the pixels of a thread would share nothing.
fn pixels_a_thread(gpu: &GpuContext, key: PipelineKey) -> u32 {
    if key.holds_line() { gpu.pixels_a_thread } else { 1 }
}

/// Along x and y, each as long as a thread's pixels along the lines and as wide as a workgroup across them.
fn workgroups(plan: &FramePlan, pixels_a_thread: u32) -> [u32; 2] {
    let long = WORKGROUP_PX * pixels_a_thread;
    let sides_px = match plan.shutter.row_axis() {
        RowAxis::Rows => [long, WORKGROUP_PX],
        RowAxis::Columns => [WORKGROUP_PX, long],
    };
    std::array::from_fn(|axis| plan.camera.size_px[axis].div_ceil(sides_px[axis]))
}

impl Variant {
    fn new(
        gpu: &GpuContext,
        key: PipelineKey,
        file: &str,
        entry_point: &str,
        lists: Lists,
    ) -> Result<Self, ComposeError> {
        let module = shaders::module(&gpu.device, "camsim.reverse", file, &key.slots())?;
        let groups = layouts(key, lists).map(|entries| {
            (!entries.is_empty()).then(|| {
                gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                    label: Some("camsim.reverse"),
                    entries: &entries,
                })
            })
        });
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("camsim.reverse"),
            bind_group_layouts: &groups.each_ref().map(Option::as_ref),
            immediate_size: 0,
        });
        let pixels = [("PIXELS", f64::from(pixels_a_thread(gpu, key)))];
        let constants = if lists == Lists::Fills && key.holds_line() { &pixels[..] } else { &[] };
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("camsim.reverse"),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
            cache: None,
        });
        Ok(Self { pipeline, groups, lists })
    }

    fn set(&self, pass: &mut wgpu::ComputePass<'_>, groups: &Groups) {
        pass.set_pipeline(&self.pipeline);
        for (group, i) in groups.iter().zip(0..) {
            if let Some(group) = group {
                pass.set_bind_group(i, group, &[]);
            }
        }
    }

    fn bind(
        &self,
        gpu: &GpuContext,
        [sampler, nearest]: &[wgpu::Sampler; 2],
        b: &ReverseBindings<'_>,
    ) -> Groups {
        let view = |view| wgpu::BindingResource::TextureView(view);
        let mut resources: [Vec<(u32, wgpu::BindingResource<'_>)>; 4] = [
            vec![(0, b.frame.as_entire_binding()), (1, view(b.noise_table))],
            vec![
                (0, view(b.color)),
                (1, wgpu::BindingResource::Sampler(sampler)),
                (2, view(b.depth)),
                (3, b.poses.as_entire_binding()),
                (4, view(b.vignette)),
                (9, wgpu::BindingResource::Sampler(nearest)),
            ],
            Vec::new(),
            vec![(0, b.out_color.as_entire_binding())],
        ];
        let fine = b
            .fine
            .map(|fine| (fine.color_view.as_ref(), &fine.depth_view, whole(&fine.lines), &fine.within_reach));
        if let Some((color, depth, lines, within_reach)) = &fine {
            resources[1].extend(color.map(|color| (5, view(color))));
            resources[1].extend([(6, view(depth)), (7, view(lines)), (8, within_reach.as_entire_binding())]);
        }
        resources[2].extend(b.lens_map.map(|map| (0, view(map))));
        resources[3].extend(b.out_truth.map(|truth| (1, truth.as_entire_binding())));
        if let Some([candidates, listed]) =
            b.lists.map(|lists| lists.each_ref().map(wgpu::Buffer::as_entire_binding))
        {
            match self.lists {
                Lists::Fills => resources[3].push((2, candidates)),
                Lists::Thins => resources[3].extend([(2, listed), (3, candidates)]),
                Lists::Reads => resources[3].push((2, listed)),
            }
        }
        let mut groups = [const { None }; 4];
        for (i, resources) in resources.into_iter().enumerate() {
            groups[i] = self.groups[i].as_ref().map(|layout| {
                let entries: Vec<_> = resources
                    .into_iter()
                    .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
                    .collect();
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("camsim.reverse"),
                    layout,
                    entries: &entries,
                })
            });
        }
        groups
    }
}

fn layouts(key: PipelineKey, lists: Lists) -> [Vec<wgpu::BindGroupLayoutEntry>; 4] {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let storage = |read_only| buffer(wgpu::BufferBindingType::Storage { read_only });
    let texture = |sample_type| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let numbers = || texture(wgpu::TextureSampleType::Float { filterable: false });
    let frame = vec![entry(0, buffer(wgpu::BufferBindingType::Uniform)), entry(1, numbers())];
    let mut ideal = vec![
        entry(0, texture(wgpu::TextureSampleType::Float { filterable: true })),
        entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
        entry(2, numbers()),
        entry(3, storage(true)),
        entry(4, numbers()),
        entry(9, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering)),
    ];
    if key.edges != EdgeKind::None {
        let samples = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: true,
        };
        ideal.extend(
            (key.edges == EdgeKind::Samples)
                .then(|| entry(5, samples(wgpu::TextureSampleType::Float { filterable: false }))),
        );
        ideal.extend([
            entry(6, samples(wgpu::TextureSampleType::Depth)),
            entry(7, texture(wgpu::TextureSampleType::Uint)),
            entry(8, storage(true)),
        ]);
    }
    let lens = match key.ray {
        RayStage::Pinhole | RayStage::GaussNewton => Vec::new(),
        RayStage::LensMap => vec![entry(0, numbers())],
    };
    let mut out = vec![entry(0, storage(false))];
    if key.truth {
        out.push(entry(1, storage(false)));
    }
    if key.edges != EdgeKind::None {
        out.push(entry(2, storage(lists == Lists::Reads)));
        out.extend((lists == Lists::Thins).then(|| entry(3, storage(true))));
    }
    [frame, ideal, lens, out]
}

pub use camsim_plan::uniforms::frame_uniforms;
