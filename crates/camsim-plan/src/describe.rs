//! The plan as text and as JSON, for `camsim explain`.

mod level_of_detail;
mod passes;
mod prediction;

use std::fmt;

use camsim_core::{exposure::FrameExposure, scenario::Preset, temporal::TapStage};
use serde::Serialize;

use crate::ir::{
    frame_plan::FramePlan,
    motion::Motion,
    predicted::Predicted,
    skip::Skip,
    stages::{BlurStage, EdgeStage, PrefilterTaps, RayStage, ShadowStage, TemporalStage},
};
pub use level_of_detail::LevelOfDetail;
use passes::passes;
use prediction::write_prediction;

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
    pub shared_frames: Option<[u64; 2]>,
    /// Why the frame has an ideal frame of its own.
    pub unshared_reason: Option<&'static str>,
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
    /// Shadows of the sun.
    pub shadows: Option<ShadowStage>,
    /// What reads the surfaces' pictures for the ideal frame.
    pub surface_reads: PrefilterTaps,
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
        passes(self)
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
            shared_frames: self.shared_frames,
            unshared_reason: self.unshared_reason,
            key_times_s: self.keys.iter().map(|key| key.t_s).collect(),
            passes: self.passes(),
            ray: self.ray,
            temporal: self.temporal,
            blur: self.blur,
            edges: self.edges,
            shadows: self.shadows,
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

impl FramePlan {
    /// What makes the picture wrong and is no part of its predicted error, for people to read; nothing where
    /// nothing is predicted.
    #[must_use]
    pub fn not_in_the_picture(&self) -> Vec<String> {
        let Predicted { probes, silhouette_fraction, silhouettes, terrain, .. } = self.predicted;
        if probes == 0 {
            return Vec::new();
        }
        let paper = (self.preset == Preset::Paper)
            .then(|| "vignette, fog and stored colours as the paper has them".to_owned());
        let ignored = (silhouettes.is_none() && silhouette_fraction > 0.0).then(|| {
            let of_terrain = if terrain.is_some() { ", and how coarse the terrain's silhouettes are" } else { "" };
            format!(
                "silhouettes, which at least {:.0} % of the pixels are at{of_terrain}: their error is not predicted",
                100.0 * silhouette_fraction
            )
        });
        let shadows = self.shadows.map(|_| {
            "borders of shadows, which no probe looks for: where light turns into shadow, reading between the \
             pixels of the ideal frame misses some of its contrast"
                .to_owned()
        });
        [ignored, shadows, paper].into_iter().flatten().collect()
    }
}

impl FramePlan {
    /// The path from the pose of the ideal frame, which is another than that within the frame where several frames
    /// share one.
    fn write_departure(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Motion { travel_m, rotation_rad, parallax_px, rotation_px, .. } = self.motion;
        writeln!(f, "motion from the pose of the ideal frame, which frames may share")?;
        writeln!(f, "  travel {travel_m:.4} m, rotation {:.4} deg", rotation_rad.to_degrees())?;
        writeln!(
            f,
            "  moves a pixel of the ideal frame by at most {rotation_px:.3} px (rotation) + {parallax_px:.3} px (parallax)"
        )
    }
}

impl fmt::Display for FramePlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Motion { nearest_m, blur_px, blur_sagitta_px, own, .. } = self.motion;
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
        if let Some(FrameExposure { time_s, gain, .. }) = self.exposure {
            let time_ms = 1e3 * time_s;
            writeln!(f, "  exposed for {time_ms:.4} ms with gain {gain:.4}, by the pictures before it")?;
        }
        writeln!(f, "motion within the frame")?;
        writeln!(
            f,
            "  travel {:.4} m, rotation {:.4} deg, nearest surface at least {nearest_m:.1} m away",
            own.travel_m,
            own.rotation_rad.to_degrees()
        )?;
        writeln!(
            f,
            "  moves a pixel of the ideal frame by at most {:.3} px (rotation) + {:.3} px (parallax)",
            own.rotation_px, own.parallax_px
        )?;
        writeln!(
            f,
            "  longest blur path {blur_px:.3} px of it; a straight line differs from it by at most {blur_sagitta_px:.2e} px"
        )?;
        self.write_departure(f)?;
        write_prediction(&self.predicted, f)?;
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
