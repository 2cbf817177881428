//! The reverse pipeline: output pixel -> lens inverse (map) -> temporal inverse -> gather -> photometric
//! stage -> output buffer.
//!
//! One fused compute kernel, composed of one file per stage; what a frame does not need is not in its text.
//! [`PipelineKey::all`] lists every legal composition.

use std::collections::{HashMap, hash_map::Entry};

use camsim_core::shutter::RowAxis;
use camsim_plan::{FramePlan, RayStage};

use crate::{
    context::GpuContext,
    ideal::{SupersampledTarget, full_view},
    recorder::Recorder,
    shaders::{self, ComposeError},
};

pub mod lens_inverse;
mod pipeline_key;

pub use pipeline_key::{EdgeKind, KeyKind, PipelineKey, TapKind, TemporalKind};

/// Main file of the image kernel.
pub const SHADER: &str = "reverse/reverse.wgsl";
/// Main file of the kernel that filters the listed pixels, where silhouettes can be in view.
pub const CANDIDATES_SHADER: &str = "reverse/edges/candidates.wgsl";
/// Main file of the kernel that casts silhouette rays for the remaining pixels.
pub const RAYS_SHADER: &str = "reverse/edges/rays.wgsl";
/// Side of the square workgroups, pixels.
const WORKGROUP_PX: u32 = 8;

/// Resources that the kernels read and write.
#[derive(Debug)]
pub struct ReverseBindings<'a> {
    /// `FrameUniforms`.
    pub frame: &'a wgpu::Buffer,
    /// Normal quantiles, one row per octave.
    pub noise_table: &'a wgpu::TextureView,
    /// Colour of the ideal frames.
    pub color: &'a wgpu::TextureView,
    /// Depth of the ideal frames.
    pub depth: &'a wgpu::TextureView,
    /// Samples of the ideal frames, if the key reads them.
    pub fine: Option<&'a SupersampledTarget>,
    /// Relative poses of the lines, or their times for the constant-twist solvers.
    pub poses: &'a wgpu::Buffer,
    /// Vignette weights.
    pub vignette: &'a wgpu::TextureView,
    /// Lens map, if the key reads one.
    pub lens_map: Option<&'a wgpu::TextureView>,
    /// Output colour: linear R G B A.
    pub out_color: &'a wgpu::Buffer,
    /// Output truth, if the key writes it.
    pub out_truth: Option<&'a wgpu::Buffer>,
    /// Pixel lists, if the key has silhouettes: of the image kernel, and filtered. Each has [`list_size`]
    /// bytes and begins with [`EMPTY_LIST`].
    pub lists: Option<&'a [wgpu::Buffer; 2]>,
}

/// Head of an empty pixel list: arguments of an empty dispatch, and the number of pixels.
pub const EMPTY_LIST: [u32; 4] = [0, 1, 1, 0];

/// Size of a list for all pixels of a frame, bytes. The size of a shader struct is a multiple of its
/// alignment: the head and one pixel take 32.
#[must_use]
pub fn list_size(size_px: [u32; 2]) -> u64 {
    let words = EMPTY_LIST.len() as u64 + u64::from(size_px[0]) * u64::from(size_px[1]);
    (4 * words).next_multiple_of(LIST_ALIGNMENT)
}

/// Alignment of the `vec3<u32>` in the head of a list.
const LIST_ALIGNMENT: u64 = 16;

/// Bind groups of one frame in flight with one ideal target, by key: of the image kernel and of the two
/// silhouette kernels. Created when a key is first used, and invalid once the target or a buffer of the frame
/// is replaced.
#[derive(Debug, Default)]
pub struct ReverseBindGroups(HashMap<PipelineKey, [Groups; 3]>);

type Groups = [Option<wgpu::BindGroup>; 4];

impl ReverseBindGroups {
    /// Drops the bind groups, after a buffer has been replaced.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}

#[derive(Debug)]
struct KernelVariant {
    pipeline: wgpu::ComputePipeline,
    lists: ListAccess,
    groups: [Option<wgpu::BindGroupLayout>; 4],
}

/// Kernels of a key: the image kernel, and where there may be silhouettes the filter of its list and the
/// kernel of the rays.
#[derive(Debug)]
struct Kernels {
    image: KernelVariant,
    silhouettes: Option<[KernelVariant; 2]>,
}

/// Access of a kernel to the pixel lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ListAccess {
    /// Writes the first list.
    Write,
    /// Reads the first list and writes the second.
    Filter,
    /// Reads the second list.
    Read,
}

/// Kernels, compiled when first needed.
#[derive(Debug)]
pub struct ReversePass {
    variants: HashMap<PipelineKey, Kernels>,
    /// Bilinear and nearest-texel sampler.
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

    /// Records the kernels of a plan. `groups` belong to these `bindings`.
    ///
    /// # Errors
    /// Faults of the shader files.
    pub fn encode(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        plan: &FramePlan,
        bindings: &ReverseBindings<'_>,
        groups: &mut ReverseBindGroups,
    ) -> Result<(), ComposeError> {
        let key = PipelineKey::of(plan);
        let kernels = match self.variants.entry(key) {
            Entry::Occupied(occupied) => occupied.into_mut(),
            Entry::Vacant(vacant) => vacant.insert(Kernels {
                image: KernelVariant::new(gpu, key, SHADER, "reverse", ListAccess::Write)?,
                silhouettes: match key.edges {
                    EdgeKind::None => None,
                    _ => Some([
                        KernelVariant::new(
                            gpu,
                            key,
                            CANDIDATES_SHADER,
                            "filter_candidates",
                            ListAccess::Filter,
                        )?,
                        KernelVariant::new(gpu, key, RAYS_SHADER, "trace_silhouette_rays", ListAccess::Read)?,
                    ]),
                },
            }),
        };
        let [image_groups, silhouette_groups @ ..] = groups.0.entry(key).or_insert_with(|| {
            let bind = |variant: &KernelVariant| variant.bind(gpu, &self.samplers, bindings);
            let [candidates, rays] =
                kernels.silhouettes.as_ref().map(|of| of.each_ref().map(bind)).unwrap_or_default();
            [bind(&kernels.image), candidates, rays]
        });
        let mut pass = recorder.compute_pass("reverse");
        kernels.image.set(&mut pass, image_groups);
        let [across, down] = workgroups(plan, pixels_per_thread(gpu, key));
        pass.dispatch_workgroups(across, down, 1);
        drop(pass);
        if let (Some(variants), Some(lists)) = (&kernels.silhouettes, bindings.lists) {
            for (((variant, groups), list), name) in
                variants.iter().zip(silhouette_groups).zip(lists).zip(["candidates", "rays"])
            {
                let mut pass = recorder.compute_pass(name);
                variant.set(&mut pass, groups);
                pass.dispatch_workgroups_indirect(list, 0);
            }
        }
        Ok(())
    }
}

/// Without cached poses the pixels of a thread would share nothing.
fn pixels_per_thread(gpu: &GpuContext, key: PipelineKey) -> u32 {
    if key.caches_line_poses() { gpu.pixels_per_thread } else { 1 }
}

/// Number of workgroups along x and y. A workgroup is as long along the lines as the pixels of its threads.
fn workgroups(plan: &FramePlan, pixels_per_thread: u32) -> [u32; 2] {
    let long = WORKGROUP_PX * pixels_per_thread;
    let sides_px = match plan.shutter.row_axis() {
        RowAxis::Rows => [long, WORKGROUP_PX],
        RowAxis::Columns => [WORKGROUP_PX, long],
    };
    std::array::from_fn(|axis| plan.camera.size_px[axis].div_ceil(sides_px[axis]))
}

impl KernelVariant {
    fn new(
        gpu: &GpuContext,
        key: PipelineKey,
        file: &str,
        entry_point: &str,
        lists: ListAccess,
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
        let pixels = [("PIXELS", f64::from(pixels_per_thread(gpu, key)))];
        let constants = if lists == ListAccess::Write && key.caches_line_poses() { &pixels[..] } else { &[] };
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
        bindings: &ReverseBindings<'_>,
    ) -> Groups {
        let view = |view| wgpu::BindingResource::TextureView(view);
        let mut resources: [Vec<(u32, wgpu::BindingResource<'_>)>; 4] = [
            vec![(0, bindings.frame.as_entire_binding()), (1, view(bindings.noise_table))],
            vec![
                (0, view(bindings.color)),
                (1, wgpu::BindingResource::Sampler(sampler)),
                (2, view(bindings.depth)),
                (3, bindings.poses.as_entire_binding()),
                (4, view(bindings.vignette)),
                (9, wgpu::BindingResource::Sampler(nearest)),
            ],
            Vec::new(),
            vec![(0, bindings.out_color.as_entire_binding())],
        ];
        let fine = bindings.fine.map(|fine| {
            (fine.color_view.as_ref(), &fine.depth_view, full_view(&fine.lines), &fine.dilated_tiles)
        });
        if let Some((color, depth, lines, dilated_tiles)) = &fine {
            resources[1].extend(color.map(|color| (5, view(color))));
            resources[1].extend([(6, view(depth)), (7, view(lines)), (8, dilated_tiles.as_entire_binding())]);
        }
        resources[2].extend(bindings.lens_map.map(|map| (0, view(map))));
        resources[3].extend(bindings.out_truth.map(|truth| (1, truth.as_entire_binding())));
        if let Some([candidates, filtered]) =
            bindings.lists.map(|lists| lists.each_ref().map(wgpu::Buffer::as_entire_binding))
        {
            match self.lists {
                ListAccess::Write => resources[3].push((2, candidates)),
                ListAccess::Filter => resources[3].extend([(2, filtered), (3, candidates)]),
                ListAccess::Read => resources[3].push((2, filtered)),
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

fn layouts(key: PipelineKey, lists: ListAccess) -> [Vec<wgpu::BindGroupLayoutEntry>; 4] {
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
    let unfiltered = || texture(wgpu::TextureSampleType::Float { filterable: false });
    let frame = vec![entry(0, buffer(wgpu::BufferBindingType::Uniform)), entry(1, unfiltered())];
    let mut ideal = vec![
        entry(0, texture(wgpu::TextureSampleType::Float { filterable: true })),
        entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
        entry(2, unfiltered()),
        entry(3, storage(true)),
        entry(4, unfiltered()),
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
        RayStage::LensMap => vec![entry(0, unfiltered())],
    };
    let mut out = vec![entry(0, storage(false))];
    if key.truth {
        out.push(entry(1, storage(false)));
    }
    if key.edges != EdgeKind::None {
        out.push(entry(2, storage(lists == ListAccess::Read)));
        out.extend((lists == ListAccess::Filter).then(|| entry(3, storage(true))));
    }
    [frame, ideal, lens, out]
}

pub use camsim_plan::uniforms::frame_uniforms;
