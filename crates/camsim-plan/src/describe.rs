//! The plan as text and as JSON, for `camsim explain`.

use std::fmt;

use serde::Serialize;

use super::{
    BlurStage, EdgeStage, FramePlan, Holes, Layers, Motion, NodeDepths, PathStage, Predicted, RayStage, Skip,
    SurfaceReads, TemporalStage,
};
use camsim_core::{
    scenario::Preset,
    temporal::{TapStage, displacement::RK2_STEP_DEG},
};

/// The plan's figures, ready to serialise.
#[derive(Clone, Debug, Serialize)]
pub struct PlanSummary<'a> {
    /// Frame number.
    pub frame: u64,
    /// Stamp, path time, seconds.
    pub stamp_s: f64,
    /// First and last instant seen, path time, seconds.
    pub window_s: [f64; 2],
    /// Whether that reaches outside the log.
    pub extrapolated: bool,
    /// Zoom value, for a zoom lens.
    pub zoom: Option<f64>,
    /// Output size.
    pub size_px: [u32; 2],
    /// Ideal frame size.
    pub ideal_size_px: [u32; 2],
    /// Ideal focal lengths.
    pub ideal_focal_px: [f64; 2],
    /// Ideal principal point.
    pub ideal_principal_px: [f64; 2],
    /// Middle of the window: source coordinates are those of the camera then, path time, seconds.
    pub key_s: f64,
    /// Instants of the ideal frames, path time, seconds.
    pub key_times_s: Vec<f64>,
    /// First and last of the frames that are made from the same ideal frame; `None` where this frame has its
    /// own.
    pub shared_by: Option<[u64; 2]>,
    /// Why that is so.
    pub alone: Option<&'static str>,
    /// Passes in order.
    pub passes: Vec<String>,
    /// Lens inverse.
    pub ray: RayStage,
    /// Temporal inverse.
    pub temporal: TemporalStage,
    /// Gather.
    pub blur: Option<BlurStage>,
    /// Pixels that see a silhouette.
    pub edges: EdgeStage,
    /// What reads the surfaces' pictures for the ideal frame.
    pub surface_reads: SurfaceReads,
    /// Samples of each pixel of the ideal frame.
    pub samples_a_pixel: u32,
    /// What reads the ideal frame for each sample.
    pub taps: TapStage,
    /// Ideal pixels for each of the camera's.
    pub ideal_scale: f64,
    /// Bounds behind the choices.
    pub motion: Motion,
    /// Bound on the displacement of the drawn terrain, pixels of the camera's focal length.
    pub terrain_error_px: f64,
    /// How far the pixels' sources will be off, by cause.
    pub predicted: &'a Predicted,
    /// What is not done.
    pub skipped: &'a [Skip],
}

impl FramePlan {
    /// Names of the passes, in order.
    #[must_use]
    pub fn passes(&self) -> Vec<String> {
        let [width, height] = self.ideal.size_px;
        let frames = match self.keys.len() {
            1 => String::new(),
            count => {
                let spacing_ms = 1e3 * (self.window_s[1] - self.window_s[0]) / count as f64;
                format!("{count} frames, {spacing_ms:.1} ms apart, of ")
            }
        };
        let reads = match self.surface_reads {
            SurfaceReads::One => "1 texture read a pixel",
            SurfaceReads::Two => "2 texture reads a pixel",
            SurfaceReads::Four => "4 texture reads a pixel",
            SurfaceReads::Grid => "up to 2x32 texture reads a pixel",
        };
        let samples = match self.samples_a_pixel {
            1 => String::new(),
            several => format!(" of {several} samples"),
        };
        let shared = match (self.shared_by, self.alone) {
            (Some([first, last]), _) => format!(", one for frames {first} to {last}"),
            (None, Some(why)) => format!(", for this frame alone ({why})"),
            (None, None) => String::new(),
        };
        let mut passes = Vec::new();
        if self.ray == RayStage::LensMap {
            passes.push("lens_inverse: lens map, kept while the lens holds".to_owned());
        }
        let color = if self.preset == Preset::Paper { "rgba8unorm (sRGB as stored)" } else { "rgba16float" };
        let mixed = if self.predicted.layers.is_some() {
            ", blended surfaces last and from behind to the front"
        } else {
            ""
        };
        passes.push(format!("ideal: {frames}{width}x{height} px {color} + depth32float (reversed){samples}, {reads}{mixed}{shared}"));
        if let EdgeStage::Supersampled { scale, thin, .. } = self.edges {
            let marks = format!("{width}x{height} px, marked where several surfaces are seen");
            let color = if scale > 1 { "rgba16float + " } else { "" };
            let fine = format!(
                "{frames}{}x{} px {color}depth32float, 4 samples each",
                width * scale,
                height * scale
            );
            if thin {
                passes.push(format!("ideal_fine: {fine}"));
                passes.push(format!("marks: {marks}, by their samples too"));
            } else {
                passes.push(format!("marks: {marks}"));
                passes.push("near_marks: triangles near marks".to_owned());
                passes.push(format!("ideal_fine: {fine}, of those triangles"));
            }
            passes.push("stamp: marks into the alpha of the colour".to_owned());
            passes.push("borders: lines within marked pixels; what lies within reach".to_owned());
        }
        let ray = match self.ray {
            RayStage::Pinhole => "pinhole ray",
            RayStage::LensMap => "lens map",
            RayStage::GaussNewton => "Gauss-Newton lens inverse",
        };
        let temporal = match self.temporal {
            TemporalStage::Identity => "no motion".to_owned(),
            TemporalStage::Rotation => "rotation per line".to_owned(),
            TemporalStage::Reproject { iterations } => {
                format!("reproject per line, {iterations} depth look-ups")
            }
            TemporalStage::Linear => "linear displacement (eq. 16) at the key instant's twist".to_owned(),
            TemporalStage::Rk2 => {
                format!("RK2 displacement (eq. 18), steps of {RK2_STEP_DEG} deg, at the key instant's twist")
            }
        };
        let gather = match self.blur {
            None => "sharp".to_owned(),
            Some(blur) if self.preset == Preset::Paper => {
                format!("straight blur of {} samples, ends included", blur.max_samples)
            }
            Some(blur) => {
                let depth = match (self.temporal, blur.depths) {
                    (TemporalStage::Reproject { .. }, NodeDepths::Mid) => " of one depth",
                    (TemporalStage::Reproject { .. }, NodeDepths::Ends) => " with depth of both ends",
                    (TemporalStage::Reproject { .. }, NodeDepths::Three) => {
                        " with depth of both ends and the middle"
                    }
                    _ => "",
                };
                let curve = match blur.path {
                    PathStage::Straight => "straight lines",
                    PathStage::Parabola => "parabolas",
                    PathStage::Quartic => "quartics",
                };
                format!(
                    "blur along {curve} through {} nodes{depth}, {:.2} samples a px",
                    blur.solved(),
                    blur.samples_per_px
                )
            }
        };
        let taps = match self.taps {
            TapStage::Bilinear => "bilinear".to_owned(),
            TapStage::Spline => "spline".to_owned(),
            TapStage::Area => "spline, or mean over the pixel's area".to_owned(),
            TapStage::Grid { most } => format!("up to {most}x{most} taps a pixel"),
            TapStage::SplineOrGrid { most } => format!("spline, or up to {most}x{most} taps a pixel"),
        };
        let truth = if self.truth { ", depth and coordinates" } else { "" };
        passes.push(format!("reverse: {ray} -> {temporal} -> {gather} ({taps}) -> photometric{truth}"));
        if let EdgeStage::Supersampled { samples, .. } = self.edges {
            passes.push(format!("rays: {samples} a pixel, where it may see a silhouette"));
        }
        passes.push("readback".to_owned());
        if self.tells_exact_truth() {
            passes.push("host: rays in f64 for depth and coordinates at edges and creases".to_owned());
        }
        passes
    }

    /// The plan's figures.
    #[must_use]
    pub fn summary(&self) -> PlanSummary<'_> {
        PlanSummary {
            frame: self.frame,
            stamp_s: self.stamp_s,
            window_s: self.window_s,
            extrapolated: self.extrapolated,
            zoom: self.zoom,
            size_px: self.camera.size_px,
            ideal_size_px: self.ideal.size_px,
            ideal_focal_px: self.ideal.focal_px.to_array(),
            ideal_principal_px: self.ideal.principal_px.to_array(),
            key_s: self.key_s,
            shared_by: self.shared_by,
            alone: self.alone,
            key_times_s: self.keys.iter().map(|key| key.t_s).collect(),
            passes: self.passes(),
            ray: self.ray,
            temporal: self.temporal,
            blur: self.blur,
            edges: self.edges,
            surface_reads: self.surface_reads,
            samples_a_pixel: self.samples_a_pixel,
            taps: self.taps,
            ideal_scale: self.ideal.scale(&self.camera),
            motion: self.motion,
            terrain_error_px: self.terrain_error_px / self.ideal.scale(&self.camera),
            predicted: &self.predicted,
            skipped: &self.skipped,
        }
    }
}

impl Predicted {
    /// By cause, the largest first.
    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            total_px,
            probes,
            silhouette_share,
            level_of_detail_px,
            blur_dn,
            resampling_dn,
            displaced_dn,
            ground,
            ..
        } = *self;
        writeln!(
            f,
            "predicted error of the source coordinates, ideal px (99th percentile, pixels at silhouettes apart)"
        )?;
        if probes == 0 {
            return writeln!(
                f,
                "  nothing predicted: no pixel tried has a source in the ideal frame; the picture will be empty"
            );
        }
        let verdict = if self.kept { "within the tolerance" } else { "the tolerance is NOT KEPT" };
        writeln!(f, "  at most {total_px:.2e} in all, from dry runs of {probes} pixels: {verdict}")?;
        if let Some(cause) = &self.in_the_way {
            writeln!(f, "  in the way: {cause}")?;
        }
        let detail = if level_of_detail_px > 0.0 {
            format!(" (level of detail {level_of_detail_px:.2e})")
        } else {
            String::new()
        };
        let mut causes = [
            (self.lens_px, "lens inverse", ""),
            (self.temporal_px, "temporal inverse", ""),
            (self.depth_px, "depth between pixels", detail.as_str()),
            (self.nodes_px, "path between exposure nodes", ""),
            (self.format_px, "single precision", ""),
        ];
        causes.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (px, cause, more) in causes.into_iter().filter(|cause| cause.0 > 0.0) {
            writeln!(f, "  {px:.2e} {cause}{more}")?;
        }
        if silhouette_share > 0.0 {
            writeln!(
                f,
                "  apart: at least {:.0} % of the pixels, at a step or fold of depth",
                100.0 * silhouette_share
            )?;
        }
        if let Some(Holes { share, width_px, .. }) = self.holes {
            let of_one = self.holes_of_one.filter(|_| self.holes != self.holes_of_one);
            let beside = of_one.map_or_else(String::new, |one| {
                format!(" (of a single one {:.4} %, {:.2} px)", 100.0 * one.share, one.width_px)
            });
            let share = 100.0 * share;
            writeln!(
                f,
                "  holes: {share:.4} % of the picture is hidden from the ideal frames, in strips of {width_px:.2} px{beside}"
            )?;
        }
        let ground = ground.map_or_else(String::new, |ground| {
            format!(", {:.2} by the terrain's level of detail", ground.error_dn())
        });
        let silhouettes = self
            .silhouettes
            .map_or_else(String::new, |silhouettes| format!(", {:.2} at silhouettes", silhouettes.error_dn));
        let layers = self.layers.map_or_else(String::new, |Layers { share, error_dn }| {
            format!(
                ", {error_dn:.2} as light mixed of several surfaces ({:.0} % of the picture) moves with the depth of one",
                100.0 * share
            )
        });
        writeln!(
            f,
            "predicted error of the picture, 1/255 of the linear range (RMS): {resampling_dn:.2} by resampling, {blur_dn:.2} by blur samples, {displaced_dn:.2} by sources beside their place{ground}{silhouettes}{layers}: {}",
            if self.levels_kept { "within the tolerance" } else { "the tolerance is NOT KEPT" }
        )?;
        match &self.levels_in_the_way {
            Some(cause) => writeln!(f, "  in the way: {cause}"),
            None => Ok(()),
        }
    }
}

impl FramePlan {
    /// What makes the picture wrong and is no part of its predicted error, for people to read; nothing where
    /// nothing is predicted.
    #[must_use]
    pub fn not_in_the_picture(&self) -> Vec<String> {
        let Predicted { probes, silhouette_share, silhouettes, ground, .. } = self.predicted;
        if probes == 0 {
            return Vec::new();
        }
        let paper = (self.preset == Preset::Paper)
            .then(|| "vignette, fog and stored colours as the paper has them".to_owned());
        let ignored = (silhouettes.is_none() && silhouette_share > 0.0).then(|| {
            let of_ground = if ground.is_some() { ", and how coarse the terrain's borders are" } else { "" };
            format!(
                "silhouettes, which at least {:.0} % of the pixels are at{of_ground}: nobody asks what they cost",
                100.0 * silhouette_share
            )
        });
        [ignored, paper].into_iter().flatten().collect()
    }
}

impl fmt::Display for FramePlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Motion {
            nearest_m,
            travel_m,
            rotation_rad,
            parallax_px,
            rotation_px,
            blur_px,
            blur_sagitta_px,
            ..
        } = self.motion;
        let [width, height] = self.camera.size_px;
        writeln!(f, "frame {} at {:.6} s of the flight, {width}x{height} px", self.frame, self.stamp_s)?;
        let outside = if self.extrapolated {
            " (reaches outside the log: extrapolated at constant velocity)"
        } else {
            ""
        };
        writeln!(f, "  sees {:.6} .. {:.6} s{outside}", self.window_s[0], self.window_s[1])?;
        if let Some(zoom) = self.zoom {
            writeln!(f, "  zoom {zoom}")?;
        }
        writeln!(f, "motion within the frame")?;
        writeln!(
            f,
            "  travel {travel_m:.4} m, rotation {:.4} deg, nearest surface at least {nearest_m:.1} m away",
            rotation_rad.to_degrees()
        )?;
        writeln!(
            f,
            "  moves a pixel by at most {rotation_px:.3} px (rotation) + {parallax_px:.3} px (parallax)"
        )?;
        writeln!(
            f,
            "  longest blur path {blur_px:.3} px, its chord misses it by at most {blur_sagitta_px:.2e} px"
        )?;
        self.predicted.write(f)?;
        for cause in self.not_in_the_picture() {
            writeln!(f, "  not in it: {cause}")?;
        }
        writeln!(f, "passes")?;
        for pass in self.passes() {
            writeln!(f, "  {pass}")?;
        }
        writeln!(f, "skipped")?;
        for skip in &self.skipped {
            writeln!(f, "  {}: {}", skip.what, skip.reason)?;
        }
        Ok(())
    }
}
