//! The pixel under the cursor, or the pinned one: values, row time, ray, surface, predicted errors.

use camsim_core::{
    camera::CameraModel, geodesy::LocalFrame, reference::RaySample, scenario::SceneSpec,
    temporal::samples_for,
};
use camsim_io::write::srgb8;
use camsim_plan::FramePlan;
use eframe::egui::{self, Ui};
use glam::DVec2;

use super::{
    tooltips::WithTooltip,
    widgets::{fact, facts, fixed, signed},
};
use crate::{
    engine_state::StagePicture,
    message::{Message, Outbox},
    motion,
    state::State,
};

/// Chords that measure the length of each stretch of an exposure path.
const CHORDS: u32 = 4;

/// Draws the page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(pixel) = state.pinned.or(state.hovered) else {
        ui.label("Move over the picture; click to pin a pixel.");
        return;
    };
    ui.horizontal(|ui| {
        ui.heading(format!("pixel ({}, {})", pixel[0], pixel[1]));
        if state.pinned.is_some()
            && ui.button("unpin").with_tooltip("follow the cursor again (Esc)").clicked()
        {
            out.push(Message::Pin(None));
        }
    });
    for stage in state.view.stages() {
        if let Some(picture) = state.engine.stage_picture(stage) {
            values(ui, state, &picture, pixel);
        }
    }
    let plan = state.engine.picture().map(|picture| &picture.plan);
    geometry(ui, state, pixel, plan);
}

/// Values of a pixel in one picture.
fn values(ui: &mut Ui, state: &State, picture: &StagePicture<'_>, [x, y]: [u32; 2]) {
    let full = state
        .engine
        .shown
        .as_ref()
        .map_or(picture.size_px, |shown| shown.reply.request.scenario.camera.size_px);
    let factor = if full == picture.size_px { 1 } else { crate::engine::preview_factor(full) };
    let index = 4 * ((y / factor) as usize * picture.size_px[0] as usize + (x / factor) as usize);
    let Some(&[r, g, b, a]) =
        picture.color_rgba.get(index..index + 4).and_then(|pixel| pixel.first_chunk::<4>())
    else {
        return;
    };
    ui.separator();
    ui.strong(picture.stage.label());
    if picture.stage == crate::engine::Stage::Reference
        && state.engine.current_reference_picture().is_some_and(|reference| y >= reference.picture.rows)
    {
        ui.label("not rendered yet: rows are rendered from the top");
        return;
    }
    facts(ui, picture.stage.label(), |ui| {
        fact(ui, "linear", format!("{r:.5} {g:.5} {b:.5}"), "scene-linear R G B, as in the EXR");
        fact(ui, "sRGB", format!("{} {} {}", srgb8(r), srgb8(g), srgb8(b)), "8-bit codes, as in the PNG");
        fact(ui, "alpha", format!("{a:.0}"), "1 where there is a ray and a source, else 0");
        if let Some(depth_m) = picture.depth.and_then(|(depth, _)| depth.depth_m.get(index / 4)) {
            fact(
                ui,
                "depth, rendered",
                format!("{depth_m:.3} m"),
                "value of the depth channel; 0 for the sky",
            );
        }
    });
}

/// Exact geometry of a pixel, from the reference.
fn geometry(ui: &mut Ui, state: &State, pixel: [u32; 2], plan: Option<&FramePlan>) {
    let Some(shown) = &state.engine.shown else { return };
    ui.separator();
    ui.strong("by exact rays");
    let Some(reference) = state.engine.current_reference() else {
        ui.label("after a pause of the input");
        return;
    };
    let frame = shown.reply.frame;
    let view = reference.view(frame);
    let stamp_s = reference.stamp_s(frame);
    let mid_s = view.mid_s(pixel);
    let sample = view.sample(pixel, DVec2::ZERO, 0.0);
    facts(ui, "geometry", |ui| {
        fact(
            ui,
            "row time",
            format!("{} ms", signed(1e3 * (mid_s - stamp_s), 4)),
            "mid-exposure after the frame's stamp, Delta t = t_d + ((r + 0.5)/N - 0.5) t_r",
        );
        fact(ui, "flight time", format!("{} s", fixed(mid_s, 6)), "seconds from the log's first good row");
        match &sample {
            None => fact(ui, "invalid", no_ray(state, pixel), "alpha 0"),
            Some(sample) => {
                ray_facts(ui, sample);
                hit_facts(ui, state, sample);
                let path = motion::pixel_path(reference, frame, pixel);
                motion_facts(ui, pixel, path.as_ref());
            }
        }
        let full = shown.reply.request.size == crate::engine::Size::Full;
        if let (Some(plan), Some(sample)) = (plan.filter(|_| full), &sample) {
            source_facts(ui, plan, sample);
            sample_facts(ui, plan, |phase| view.sample(pixel, DVec2::ZERO, phase));
        }
    });
    if let Some(plan) = plan {
        predicted_errors(ui, plan, predicted_here(state, pixel));
    }
}

/// Why a pixel has no ray.
fn no_ray(state: &State, [x, y]: [u32; 2]) -> String {
    let camera = state.document.as_ref().map(|document| CameraModel::from_spec(&document.scenario.camera));
    match camera {
        Some(Ok(camera)) if camera.unproject(DVec2::new(f64::from(x), f64::from(y))).is_some() => {
            "the reference has no ray here".into()
        }
        _ => "the lens has no ideal ray here: the pixel lies beyond the fold of its distortion".into(),
    }
}

/// The ray of a pixel.
fn ray_facts(ui: &mut Ui, sample: &RaySample) {
    fact(
        ui,
        "ray u, v",
        format!("{}, {}", fixed(sample.uv.x, 6), fixed(sample.uv.y, 6)),
        "ideal normalised coordinates (x/z, y/z), the lens's inverse",
    );
    let off_axis = sample.uv.length().atan().to_degrees();
    fact(ui, "off axis", format!("{off_axis:.3} deg"), "angle to the optical axis");
}

/// The surface that a ray hits.
fn hit_facts(ui: &mut Ui, state: &State, sample: &RaySample) {
    let Some(hit) = &sample.hit else {
        return fact(ui, "sees", "sky", "no surface along the ray");
    };
    let scene = state.engine.sequence().map(|sequence| &sequence.scenario.scene);
    fact(
        ui,
        "sees",
        scene.map_or_else(String::new, |scene| surface_name(scene, hit.surface)),
        "the first surface along the ray",
    );
    fact(
        ui,
        "depth",
        format!("{:.3} m", hit.depth_m),
        "planar, along the optical axis at the row's mid-exposure",
    );
    let point = hit.point_ned_m;
    let range_m = point.distance(sample.pose.position_ned_m);
    fact(ui, "range", format!("{range_m:.3} m"), "from the optical centre");
    fact(
        ui,
        "north, east, down",
        format!("{}, {}, {} m", fixed(point.x, 3), fixed(point.y, 3), fixed(point.z, 3)),
        "in the local frame",
    );
    if let Some(frame) = state.engine.loaded.as_ref().and_then(|loaded| loaded.log.frame) {
        geodetic_facts(ui, &frame, point);
    }
}

/// Name of a surface by its number: terrain, pattern, board, then models.
fn surface_name(scene: &SceneSpec, number: u32) -> String {
    let flat = [("pattern", scene.pattern.is_some()), ("board", scene.board.is_some())];
    let named = std::iter::once("terrain")
        .chain(flat.into_iter().filter_map(|(name, is_there)| is_there.then_some(name)));
    let known = named.clone().nth(number as usize).map(str::to_owned);
    known.unwrap_or_else(|| match scene.gltf.as_slice() {
        [only] => {
            format!("model {}", only.file.file_name().unwrap_or(only.file.as_os_str()).to_string_lossy())
        }
        _ => format!("model, mesh {}", number as usize + 1 - named.count()),
    })
}

/// Geodetic coordinates of a point.
fn geodetic_facts(ui: &mut Ui, frame: &LocalFrame, point: glam::DVec3) {
    let geodetic = frame.geodetic_from_ned(point);
    fact(ui, "lat, lon", format!("{:.7}, {:.7} deg", geodetic.lat_deg(), geodetic.lon_deg()), "WGS-84");
    fact(ui, "height", format!("{:.3} m", geodetic.height_m), "in the scenario's vertical datum");
}

/// Displacement and blur of a pixel.
fn motion_facts(ui: &mut Ui, pixel: [u32; 2], path: Option<&motion::PixelPath>) {
    let Some(path) = path else { return };
    let here = DVec2::new(f64::from(pixel[0]), f64::from(pixel[1]));
    let shift = path.at_stamp_px.map(|stamp_px| here - stamp_px);
    let text = shift.map_or_else(
        || "not visible at the stamp".to_owned(),
        |shift| format!("{}, {} px", signed(shift.x, 3), signed(shift.y, 3)),
    );
    fact(
        ui,
        "displacement",
        text,
        "from its position in a global-shutter frame at the stamp (the paper's Delta x)",
    );
    let length_px: f64 = path.exposure_px.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    fact(ui, "blur", format!("{} px", fixed(length_px, 3)), "length of its path over the exposure t_e");
}

/// Source of a pixel in the ideal frame.
fn source_facts(ui: &mut Ui, plan: &FramePlan, sample: &RaySample) {
    let key = plan.ideal_view();
    let source = key.source_px(sample);
    let [width, height] = plan.ideal.size_px.map(f64::from);
    let inside = source.x > -0.5 && source.y > -0.5 && source.x < width - 0.5 && source.y < height - 0.5;
    let note = if inside || plan.has_displaced_key() { "" } else { " (outside: the pixel is invalid)" };
    fact(
        ui,
        "source",
        format!("{:.3}, {:.3} px{note}", source.x, source.y),
        "in the ideal frame at the middle of the frame's window",
    );
}

/// Number of exposure samples of this pixel by the length of its exposure path, stretch by stretch as the
/// renderer counts them. For taps it may have more.
fn sample_facts(ui: &mut Ui, plan: &FramePlan, sample: impl Fn(f64) -> Option<RaySample>) {
    let Some(blur) = plan.blur else { return };
    let key = plan.ideal_view();
    let chords = CHORDS * blur.stretches();
    let source_px =
        |chord: u32| sample(f64::from(chord) / f64::from(chords) - 0.5).map(|sample| key.source_px(&sample));
    let Some(path) = (0..=chords).map(source_px).collect::<Option<Vec<DVec2>>>() else { return };
    let steps: Vec<f64> = path.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
    let stretch_samples =
        |steps: &[f64]| samples_for(steps.iter().sum(), blur.samples_per_px, 1, blur.max_samples);
    let count: u32 = steps.chunks(CHORDS as usize).map(stretch_samples).sum();
    let length_px: f64 = steps.iter().sum();
    fact(
        ui,
        "samples here",
        format!("at least {count}, over {} px", fixed(length_px, 2)),
        "exposure samples, by the length of its exposure path in the ideal frame; more if the footprint has \
         more taps",
    );
}

/// The predicted error near a pixel, if it was requested.
fn predicted_here(state: &State, [x, y]: [u32; 2]) -> Option<String> {
    let shown = state.engine.shown.as_ref()?;
    let Some(errors) = shown.reply.errors.first() else {
        return state.shows_errors().then(|| "after a pause of the input".to_owned());
    };
    let near_px = errors.map.near_px([x, y]);
    Some(near_px.map_or_else(|| "none: near silhouettes".to_owned(), |px| format!("{px:.5} px")))
}

/// Marks an exceeded tolerance; the plan's page names the cause.
fn exceeded_mark(is_kept: bool) -> &'static str {
    if is_kept { "" } else { ", exceeded" }
}

/// Predicted errors as the frame is rendered.
fn predicted_errors(ui: &mut Ui, plan: &FramePlan, here: Option<String>) {
    ui.separator();
    ui.strong("as rendered");
    facts(ui, "certainty", |ui| {
        let predicted = &plan.predicted;
        if let Some(here) = here {
            fact(
                ui,
                "predicted here",
                here,
                "largest source error of the planner's dry runs near this pixel, with a safety factor; \
                 about 99 % of pixels at mid-exposure are below it",
            );
        }
        fact(
            ui,
            "predicted error",
            format!("{:.4} px{}", predicted.total_px, exceeded_mark(predicted.source_error_kept)),
            "bound on the source error of 99 % of the frame's pixels",
        );
        fact(
            ui,
            "of grey levels",
            format!("{:.3} of 255{}", predicted.picture_dn(), exceeded_mark(predicted.picture_error_kept)),
            "expected RMS picture error, from resampling, blur samples and silhouettes",
        );
        let samples = plan.blur.map_or_else(
            || "1".to_owned(),
            |blur| {
                format!(
                    "{} nodes, {:.2} a px of path, {} at most",
                    blur.solved(),
                    blur.samples_per_px,
                    blur.max_samples
                )
            },
        );
        fact(ui, "samples", samples, "of the exposure");
    });
    if plan.predicted.void_fraction > 0.0 {
        ui.label(
            egui::RichText::new(format!(
                "{:.1} % of the pixels have no source",
                100.0 * plan.predicted.void_fraction
            ))
            .weak(),
        );
    }
}
