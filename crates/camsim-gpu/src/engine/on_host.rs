//! Frames whose reverse pipeline runs on the host: what they read of the device, and what stays from frame to
//! frame.

use camsim_core::{sequence::Sequence, temporal::IdealGeometry};
use camsim_plan::{FramePlan, RayStage};

use super::readback::Rows;
use crate::{
    context::{GpuContext, GpuError},
    ideal::{
        IdealTarget,
        host::{DrawnFrame, HostScene, View},
    },
    layout::{FrameUniforms, Truth},
    recorder::Recorder,
    reverse::{
        host::{self, HostInputs, HostKernel, IdealOnHost, LensMapOnHost, ReverseOn},
        lens_inverse::LensMap,
    },
    upload::SceneBuffers,
};

/// Copies of ideal frames: one for a frame at work, one for the frame in flight after it.
const COPIES: usize = 2;
/// Of a texel: four half floats, a float.
const COLOR_BYTES: usize = 8;
const DEPTH_BYTES: usize = 4;

/// A frame's own numbers.
#[derive(Debug)]
pub(super) struct HostFrame {
    /// Which copy of an ideal frame it reads.
    pub copy: usize,
    pub uniforms: FrameUniforms,
}

/// An ideal frame in memory that the host reads, mapped from its submission until it is used again.
#[derive(Debug)]
struct Copy {
    color: Rows,
    depth: Rows,
    /// In place of these, one that the host has drawn itself.
    drawn: DrawnFrame,
    is_drawn: bool,
}

/// What stays from frame to frame.
#[derive(Debug)]
pub(super) struct OnHost {
    kernel: HostKernel,
    /// What draws ideal frames, where the host does that.
    scene: Option<HostScene>,
    vignette: Vec<f32>,
    map: Option<LensMapOnHost>,
    /// The lens map on its way.
    map_copy: Option<Rows>,
    copies: [Copy; COPIES],
    last: usize,
    recorded: Recorded,
}

/// What the commands at work copy, to be asked for once they have been submitted.
#[derive(Debug, Default)]
struct Recorded {
    map: Option<Rows>,
    copy: Option<usize>,
}

impl OnHost {
    pub fn new(gpu: &GpuContext, sequence: &Sequence, buffers: &SceneBuffers) -> Self {
        Self {
            kernel: HostKernel::new(),
            scene: gpu
                .ideal_on_host
                .then(|| HostScene::new(&sequence.scene, buffers, gpu.max_picture_px))
                .flatten(),
            vignette: super::renew::vignette_weights_of(sequence).1,
            map: None,
            map_copy: None,
            copies: [(); COPIES].map(|()| Copy {
                color: Rows::empty(gpu, "camsim.ideal_color"),
                depth: Rows::empty(gpu, "camsim.ideal_depth"),
                drawn: DrawnFrame::default(),
                is_drawn: false,
            }),
            last: 0,
            recorded: Recorded::default(),
        }
    }

    /// Forgets what was recorded and never submitted.
    pub fn forget(&mut self) {
        self.recorded = Recorded::default();
    }

    /// Another camera, over the same scene.
    pub fn renew(&mut self, sequence: &Sequence) {
        self.forget();
        (self.map, self.map_copy) = (None, None);
        self.vignette = super::renew::vignette_weights_of(sequence).1;
    }

    /// Records the lens map's way to the host, once.
    pub fn copy_map(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        plan: &FramePlan,
        map: Option<&LensMap>,
    ) {
        let is_known = self.map.is_some() || self.map_copy.is_some();
        let Some(map) = map.filter(|_| plan.ray == RayStage::LensMap && !is_known) else { return };
        let rows = Rows::new(
            gpu,
            "camsim.lens_map",
            [map.texture.width(), map.texture.height()],
            size_of::<[f32; 2]>(),
        );
        rows.copy(recorder.encoder(), &map.texture);
        self.recorded.map = Some(rows);
    }

    /// Whether it makes frames of a plan: if it draws their ideal frames itself there is no copy that they
    /// must be worth.
    pub fn makes(&self, plan: &FramePlan, place: ReverseOn) -> bool {
        if self.draws() { host::serves(plan) } else { place.is_host(plan) }
    }

    /// Whether it draws ideal frames itself.
    pub fn draws(&self) -> bool {
        self.scene.is_some()
    }

    /// Draws an ideal frame; which copy it is.
    pub fn draw(&mut self, view: View<'_>) -> usize {
        // The frame in flight may still read the other one.
        self.last = (self.last + 1) % COPIES;
        let copy = &mut self.copies[self.last];
        copy.is_drawn = true;
        self.scene.iter_mut().for_each(|scene| scene.draw(view, &mut copy.drawn));
        self.last
    }

    /// An ideal frame that it has drawn.
    pub fn drawn(&self, copy: usize) -> &DrawnFrame {
        &self.copies[copy].drawn
    }

    /// Records an ideal frame's way to the host; which copy it is.
    pub fn copy_ideal(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        target: &IdealTarget,
        ideal: &IdealGeometry,
    ) -> usize {
        // The frame in flight may still read the other one.
        self.last = (self.last + 1) % COPIES;
        let copy = &mut self.copies[self.last];
        copy.is_drawn = false;
        // Depth can only be copied whole.
        let whole = [target.depth.width(), target.depth.height()];
        for (rows, size_px, texture, texel_bytes) in [
            (&mut copy.color, ideal.size_px, &target.color, COLOR_BYTES),
            (&mut copy.depth, whole, &target.depth, DEPTH_BYTES),
        ] {
            rows.fit(gpu, size_px, texel_bytes);
            rows.copy(recorder.encoder(), texture);
        }
        self.recorded.copy = Some(self.last);
        self.last
    }

    /// Once the commands have been submitted: asks for what they copy.
    pub fn recall(&mut self) {
        let Recorded { map, copy } = std::mem::take(&mut self.recorded);
        if let Some(mut map) = map {
            map.recall();
            self.map_copy = Some(map);
        }
        if let Some(copy) = copy.map(|copy| &mut self.copies[copy]) {
            copy.color.recall();
            copy.depth.recall();
        }
    }

    /// The picture of a frame whose commands are done, linear R G B A, and the truth about it where that is
    /// wanted.
    pub fn render(
        &mut self,
        plan: &FramePlan,
        frame: &HostFrame,
        poses: &[[[f32; 4]; 3]],
    ) -> Result<(Vec<f32>, Option<Vec<Truth>>), GpuError> {
        if let Some(rows) = self.map_copy.take() {
            self.map = Some(LensMapOnHost { uv: rows.read()? });
        }
        if plan.ray == RayStage::LensMap && self.map.is_none() {
            return Err(GpuError::Device("there is no lens map on the host".into()));
        }
        let copy = &self.copies[frame.copy];
        if copy.is_drawn {
            let DrawnFrame { color, depth, stride } = &copy.drawn;
            let ideal =
                IdealOnHost { color, color_stride: *stride as u32, depth, depth_stride: *stride as u32 };
            return Ok(self.reverse(plan, frame, poses, ideal));
        }
        let (color, depth) = (copy.color.view()?, copy.depth.view()?);
        let ideal = IdealOnHost {
            color: bytemuck::try_cast_slice(&color).map_err(|error| GpuError::Device(error.to_string()))?,
            color_stride: copy.color.stride_bytes / COLOR_BYTES as u32,
            depth: bytemuck::try_cast_slice(&depth).map_err(|error| GpuError::Device(error.to_string()))?,
            depth_stride: copy.depth.stride_bytes / DEPTH_BYTES as u32,
        };
        Ok(self.reverse(plan, frame, poses, ideal))
    }

    fn reverse(
        &self,
        plan: &FramePlan,
        frame: &HostFrame,
        poses: &[[[f32; 4]; 3]],
        ideal: IdealOnHost<'_>,
    ) -> (Vec<f32>, Option<Vec<Truth>>) {
        self.kernel.render(
            plan,
            &HostInputs {
                frame: &frame.uniforms,
                poses,
                map: self.map.as_ref(),
                vignette: &self.vignette,
                ideal,
            },
        )
    }
}
