//! The pixel under the cursor: its value, its instant, its ray, what it sees, and how sure that is.

use camsim_core::{
    camera::CameraModel, geodesy::LocalFrame, reference::RaySample, scenario::SceneSpec,
    temporal::samples_for,
};
use camsim_io::write::srgb8;
use camsim_plan::FramePlan;
use eframe::egui::{self, Ui};
use glam::DVec2;

use super::{
    tips::Explained,
    widgets::{fact, facts, fixed, signed},
};
use crate::{
    heard::PixelTruth,
    message::{Message, Outbox},
    motion,
    state::State,
};

/// Pieces of a stretch of a pixel's way, to measure it.
const PIECES: u32 = 4;

/// The page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(pixel) = state.pinned.or(state.hovered) else {
        ui.label("Move over the picture; click to keep a pixel here.");
        return;
    };
    ui.horizontal(|ui| {
        ui.heading(format!("pixel ({}, {})", pixel[0], pixel[1]));
        if state.pinned.is_some() && ui.button("let go").explained("follow the cursor again (Esc)").clicked()
        {
            out.push(Message::Pin(None));
        }
    });
    for stage in state.view.stages() {
        if let Some(sight) = state.heard.sight(stage) {
            value(ui, state, &sight, pixel);
        }
    }
    let plan = state.heard.picture().map(|picture| &picture.plan);
    geometry(ui, state, pixel, plan);
}

/// Values of a picture.
fn value(ui: &mut Ui, state: &State, sight: &PixelTruth<'_>, [x, y]: [u32; 2]) {
    let full =
        state.heard.shown.as_ref().map_or(sight.size_px, |shown| shown.reply.wanted.scenario.camera.size_px);
    let factor = if full == sight.size_px { 1 } else { crate::engine::preview_factor(full) };
    let at = 4 * ((y / factor) as usize * sight.size_px[0] as usize + (x / factor) as usize);
    let Some(&[r, g, b, a]) = sight.color_rgba.get(at..at + 4).and_then(|pixel| pixel.first_chunk::<4>())
    else {
        return;
    };
    ui.separator();
    ui.strong(sight.stage.label());
    if sight.stage == crate::engine::Stage::Oracle
        && state.heard.current_exact().is_some_and(|exact| y >= exact.picture.rows)
    {
        ui.label("on its way: its rows come from the top");
        return;
    }
    facts(ui, sight.stage.label(), |ui| {
        fact(ui, "linear", format!("{r:.5} {g:.5} {b:.5}"), "scene-linear R G B, as in the EXR");
        fact(ui, "sRGB", format!("{} {} {}", srgb8(r), srgb8(g), srgb8(b)), "8-bit codes, as in the PNG");
        fact(ui, "alpha", format!("{a:.0}"), "1 where there is a ray and a source, else 0");
        if let Some(depth_m) = sight.depth.and_then(|(truth, _)| truth.depth_m.get(at / 4)) {
            fact(
                ui,
                "depth, rendered",
                format!("{depth_m:.3} m"),
                "as the depth channel has it; 0 = nothing there",
            );
        }
    });
}

fn geometry(ui: &mut Ui, state: &State, pixel: [u32; 2], plan: Option<&FramePlan>) {
    let Some(shown) = &state.heard.shown else { return };
    ui.separator();
    ui.strong("by exact rays");
    let Some(looks) = state.heard.current_looks() else {
        ui.label("once the hand rests");
        return;
    };
    let frame = shown.reply.frame;
    let view = looks.view(frame);
    let stamp_s = looks.stamp_s(frame);
    let mid_s = view.mid_s(pixel);
    let look = view.sample(pixel, DVec2::ZERO, 0.0);
    facts(ui, "geometry", |ui| {
        fact(
            ui,
            "row time",
            format!("{} ms", signed(1e3 * (mid_s - stamp_s), 4)),
            "mid-exposure after the frame's stamp, Delta t = t_d + ((r + 0.5)/N - 0.5) t_r",
        );
        fact(ui, "flight time", format!("{} s", fixed(mid_s, 6)), "seconds from the log's first good row");
        match &look {
            None => fact(ui, "invalid", no_ray(state, pixel), "alpha 0"),
            Some(look) => {
                ray(ui, look);
                seen(ui, state, look);
                let path = motion::path(looks, frame, pixel);
                moved(ui, pixel, path.as_ref());
            }
        }
        let full = shown.reply.wanted.size == crate::engine::Size::Full;
        if let (Some(plan), Some(look)) = (plan.filter(|_| full), &look) {
            source(ui, plan, look);
            samples(ui, plan, |phase| view.sample(pixel, DVec2::ZERO, phase));
        }
    });
    if let Some(plan) = plan {
        certainty(ui, plan, predicted_here(state, pixel));
    }
}

fn no_ray(state: &State, [x, y]: [u32; 2]) -> String {
    let camera = state.document.as_ref().map(|document| CameraModel::from_spec(&document.scenario.camera));
    match camera {
        Some(Ok(camera)) if camera.unproject(DVec2::new(f64::from(x), f64::from(y))).is_some() => {
            "the exact rays have no lens for it".into()
        }
        _ => "the lens has no ideal ray here: the pixel lies beyond the fold of its distortion".into(),
    }
}

fn ray(ui: &mut Ui, look: &RaySample) {
    fact(
        ui,
        "ray u, v",
        format!("{}, {}", fixed(look.uv.x, 6), fixed(look.uv.y, 6)),
        "ideal normalised coordinates (x/z, y/z), the lens's inverse",
    );
    let off_axis = look.uv.length().atan().to_degrees();
    fact(ui, "off axis", format!("{off_axis:.3} deg"), "angle to the optical axis");
}

fn seen(ui: &mut Ui, state: &State, look: &RaySample) {
    let Some(hit) = &look.hit else {
        return fact(ui, "sees", "sky", "no surface along the ray");
    };
    let scene = state.heard.sequence().map(|sequence| &sequence.scenario.scene);
    fact(
        ui,
        "sees",
        scene.map_or_else(String::new, |scene| surface(scene, hit.surface)),
        "the first surface along the ray",
    );
    fact(
        ui,
        "depth",
        format!("{:.3} m", hit.depth_m),
        "planar, along the optical axis at the row's mid-exposure",
    );
    let point = hit.point_ned_m;
    let range_m = point.distance(look.pose.position_ned_m);
    fact(ui, "range", format!("{range_m:.3} m"), "from the optical centre");
    fact(
        ui,
        "north, east, down",
        format!("{}, {}, {} m", fixed(point.x, 3), fixed(point.y, 3), fixed(point.z, 3)),
        "in the local frame",
    );
    if let Some(frame) = state.heard.loaded.as_ref().and_then(|loaded| loaded.log.frame) {
        world(ui, &frame, point);
    }
}

/// What a surface is called: the terrain, then the pattern, the board and the models as the scene counts
/// them.
fn surface(scene: &SceneSpec, number: u32) -> String {
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

fn world(ui: &mut Ui, frame: &LocalFrame, point: glam::DVec3) {
    let place = frame.geodetic_from_ned(point);
    fact(ui, "lat, lon", format!("{:.7}, {:.7} deg", place.lat_deg(), place.lon_deg()), "WGS-84");
    fact(ui, "height", format!("{:.3} m", place.height_m), "in the scenario's vertical datum");
}

fn moved(ui: &mut Ui, pixel: [u32; 2], path: Option<&motion::PixelPath>) {
    let Some(path) = path else { return };
    let here = DVec2::new(f64::from(pixel[0]), f64::from(pixel[1]));
    let shift = path.at_stamp_px.map(|at| here - at);
    let text = shift.map_or_else(
        || "out of sight at the stamp".to_owned(),
        |shift| format!("{}, {} px", signed(shift.x, 3), signed(shift.y, 3)),
    );
    fact(
        ui,
        "displacement",
        text,
        "from where it would be in a frame taken at the stamp at once (the paper's Delta x)",
    );
    let length_px: f64 = path.exposure_px.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    fact(ui, "blur", format!("{} px", fixed(length_px, 3)), "length of its way over the exposure t_e");
}

fn source(ui: &mut Ui, plan: &FramePlan, look: &RaySample) {
    let key = plan.ideal_view();
    let at = key.source_px(look);
    let [width, height] = plan.ideal.size_px.map(f64::from);
    let inside = at.x > -0.5 && at.y > -0.5 && at.x < width - 0.5 && at.y < height - 0.5;
    let where_ = if inside || plan.has_displaced_key() { "" } else { " (outside: the pixel is invalid)" };
    fact(
        ui,
        "source",
        format!("{:.3}, {:.3} px{where_}", at.x, at.y),
        "where it lies in the ideal frame of the middle of the frame's window",
    );
}

/// Samples that this pixel has for the length of its way through the ideal frame, stretch by stretch, as the
/// kernel counts them. For taps it may have more.
fn samples(ui: &mut Ui, plan: &FramePlan, look: impl Fn(f64) -> Option<RaySample>) {
    let Some(blur) = plan.blur else { return };
    let key = plan.ideal_view();
    let pieces = PIECES * blur.stretches();
    let at = |piece: u32| look(f64::from(piece) / f64::from(pieces) - 0.5).map(|look| key.source_px(&look));
    let Some(way) = (0..=pieces).map(at).collect::<Option<Vec<DVec2>>>() else { return };
    let steps: Vec<f64> = way.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
    let of_stretch =
        |steps: &[f64]| samples_for(steps.iter().sum(), blur.samples_per_px, 1, blur.max_samples);
    let count: u32 = steps.chunks(PIECES as usize).map(of_stretch).sum();
    let length_px: f64 = steps.iter().sum();
    fact(
        ui,
        "samples here",
        format!("at least {count}, over {} px", fixed(length_px, 2)),
        "of the exposure, by the length of its source's way through the ideal frame; as many as the footprint has taps, if that is more",
    );
}

/// The predicted error around a pixel, if it is known.
fn predicted_here(state: &State, [x, y]: [u32; 2]) -> Option<String> {
    let shown = state.heard.shown.as_ref()?;
    let Some(errors) = shown.reply.errors.first() else {
        return state.shows_errors().then(|| "once the hand rests".to_owned());
    };
    let near_px = errors.map.near_px([x, y]);
    Some(near_px.map_or_else(|| "counted apart: silhouettes around".to_owned(), |px| format!("{px:.5} px")))
}

/// That a tolerance is broken, if it is; the plan's page says by what.
fn unless(kept: bool) -> &'static str {
    if kept { "" } else { ", not kept" }
}

fn certainty(ui: &mut Ui, plan: &FramePlan, here: Option<String>) {
    ui.separator();
    ui.strong("as rendered");
    facts(ui, "certainty", |ui| {
        let predicted = &plan.predicted;
        if let Some(here) = here {
            fact(
                ui,
                "predicted here",
                here,
                "largest error of the source coordinate in the plan's dry runs around this pixel, with their safety; pixels at mid-exposure are below it but for about one in a hundred",
            );
        }
        fact(
            ui,
            "predicted error",
            format!("{:.4} px{}", predicted.total_px, unless(predicted.source_error_kept)),
            "of the frame: bound on 99 % of its pixels' source coordinates",
        );
        fact(
            ui,
            "of grey levels",
            format!("{:.3} of 255{}", predicted.picture_dn(), unless(predicted.picture_error_kept)),
            "expected RMS of the picture, from resampling, blur samples and silhouettes",
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
    if plan.predicted.void_share > 0.0 {
        ui.label(
            egui::RichText::new(format!(
                "{:.1} % of the pixels have no source",
                100.0 * plan.predicted.void_share
            ))
            .weak(),
        );
    }
}
