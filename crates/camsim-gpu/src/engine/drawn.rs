//! Pass 2: ideal frames, drawn on the device, on the host or on both.

use std::time::Instant;

use camsim_core::{
    pose::CameraPose,
    scene::{LevelTolerance, LodSelection},
    temporal::IdealGeometry,
};
use camsim_plan::{EdgeStage, SurfaceReads};

use super::{
    MAX_FINE_TARGETS, MAX_TARGETS, RenderErrorBase, Session, ahead::Prepared, ms_since, slot::Target,
};
use crate::{
    ideal::{IdealTarget, host::View},
    recorder::Recorder,
    reverse::host,
};

/// What was drawn last: the same again need not be drawn.
#[derive(Debug, PartialEq)]
pub(super) struct Drawn {
    pub poses: Vec<CameraPose>,
    pub ideal: IdealGeometry,
    pub edges: EdgeStage,
    pub terrain_error_px: f64,
    pub models: LevelTolerance,
    pub surface_reads: SurfaceReads,
    pub samples_a_pixel: u32,
    /// Where the device has it, if the device has drawn it.
    pub target: Option<usize>,
    /// Whether the host has drawn it.
    pub by_host: bool,
    /// The slot of its frame.
    pub slot: usize,
    pub lod: LodSelection,
    /// Of what is mixed.
    pub out_of_order: u32,
    /// Its copy in the host's memory.
    pub copy: Option<usize>,
    /// How long the host took to draw it, until that has been told.
    pub ideal_ms: Option<f64>,
}

impl Session<'_> {
    /// Pass 2, only when a key pose or the ideal frames' geometry has changed: the ideal frames.
    pub(super) fn ideal(
        &mut self,
        recorder: &mut Recorder<'_>,
        prepared: &Prepared,
        slot: usize,
    ) -> Result<(), RenderErrorBase> {
        let plan = &prepared.plan;
        let poses: Vec<CameraPose> = plan.keys.iter().map(|key| key.pose).collect();
        let models = plan.model_tolerance(&self.planner.sequence().scenario.quality);
        let by_host = self.on_host.as_ref().is_some_and(|on_host| on_host.draws() && host::serves(plan));
        if self.drawn.as_ref().is_some_and(|drawn| {
            drawn.by_host == by_host
                && drawn.poses == poses
                && drawn.ideal == plan.ideal
                && drawn.edges == plan.edges
                && drawn.terrain_error_px == plan.terrain_error_px
                && drawn.models == models
                && drawn.surface_reads == plan.surface_reads
                && drawn.samples_a_pixel == plan.samples_a_pixel
        }) {
            return Ok(());
        }
        let mut drawn = Drawn {
            poses,
            ideal: plan.ideal,
            edges: plan.edges,
            terrain_error_px: plan.terrain_error_px,
            models,
            surface_reads: plan.surface_reads,
            samples_a_pixel: plan.samples_a_pixel,
            target: None,
            by_host,
            slot,
            lod: prepared.meshes.get(plan.keys.len() / 2).map(|mesh| mesh.lod).unwrap_or_default(),
            out_of_order: 0,
            copy: None,
            ideal_ms: None,
        };
        if !by_host {
            let (target, out_of_order) = self.ideal_on_device(recorder, prepared, slot, &models)?;
            (drawn.target, drawn.out_of_order) = (Some(target), out_of_order);
        }
        if let Some(on_host) = self.on_host.as_mut().filter(|_| by_host) {
            let (scene, buffers, terrain) =
                (&self.planner.sequence().scene, &self.buffers, prepared.meshes.first());
            let begun = Instant::now();
            drawn.copy = Some(on_host.draw(View { plan, scene, buffers, terrain, tolerance: &models }));
            drawn.ideal_ms = Some(ms_since(begun));
        }
        self.drawn = Some(drawn);
        Ok(())
    }

    /// Draws ideal frames on the device; gives their target, and how many blended triangles are out of order.
    fn ideal_on_device(
        &mut self,
        recorder: &mut Recorder<'_>,
        prepared: &Prepared,
        slot: usize,
        models: &LevelTolerance,
    ) -> Result<(usize, u32), RenderErrorBase> {
        let plan = &prepared.plan;
        let gpu = &self.engine.gpu;
        let size_px = IdealTarget::size_for(plan, gpu.max_side_px());
        // The one used last stands last; `drawn` may name another's place, but is replaced below before
        // anybody looks.
        let known = self.targets.iter().position(|target| target.ideal.serves(size_px, plan));
        let target = known.map(|place| self.targets.remove(place)).unwrap_or_else(|| {
            let has_samples = plan.edges != EdgeStage::None || plan.samples_a_pixel > 1;
            let limit = if has_samples { MAX_FINE_TARGETS } else { MAX_TARGETS };
            let alike = |target: &Target| target.ideal.has_samples() == has_samples;
            if self.targets.iter().filter(|target| alike(target)).count() >= limit {
                let longest_unused = self.targets.iter().position(alike).unwrap_or_default();
                self.targets.remove(longest_unused);
            }
            Target { ideal: IdealTarget::new(gpu, size_px, plan), groups: Default::default() }
        });
        self.targets.push(target);
        let target = self.targets.len() - 1;
        let sequence = self.planner.sequence();
        self.buffers.bring_pictures(gpu, &sequence.scene);
        let ideal_slots = &mut self.slots[slot].ideal;
        while ideal_slots.len() < plan.keys.len() {
            ideal_slots.push(self.ideal_pass.slot(gpu, &self.buffers));
        }
        if let Some(pool) = self.buffers.tiles_mut() {
            let mut tiles: Vec<u32> =
                prepared.meshes.iter().flat_map(|mesh| mesh.tiles.iter().copied()).collect();
            tiles.sort_unstable();
            tiles.dedup();
            pool.bring(gpu, &tiles)?;
        }
        let out_of_order = self.ideal_pass.encode(
            gpu,
            recorder,
            ideal_slots,
            &sequence.scene,
            &self.buffers,
            plan,
            &prepared.meshes,
            models,
            &self.targets[target].ideal,
        )?;
        Ok((target, out_of_order))
    }
}
