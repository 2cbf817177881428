//! The pixel under the cursor, or the pinned one: values, row time, ray, surface, predicted errors.

use std::sync::Arc;

use camsim_core::{
    camera::CameraModel,
    geodesy::LocalFrame,
    pose::CameraPose,
    reference::RaySample,
    scenario::{CameraSpec, SceneSpec},
    sequence::Sequence,
    temporal::samples_for,
};
use camsim_io::write::srgb8;
use camsim_plan::FramePlan;
use eframe::egui::{self, Ui};
use glam::DVec2;

use super::{
    tooltips::WithTooltip,
    widgets::{fact, fixed, signed},
};
use crate::{
    engine::Size,
    engine_state::StagePicture,
    message::{Message, Outbox},
    motion,
    state::State,
};

/// Chords that measure the length of each stretch of an exposure path.
const CHORDS: u32 = 4;
/// Angle off axis up to which a ray is shown as a point of the ideal image plane, degrees.
const LARGEST_FLAT_DEG: f64 = 89.0;

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
    // Previews have larger pixels.
    let factor = preview_factor(state);
    let plan = state.engine.picture().map(|picture| picture.plan_at(pixel.map(|at| at / factor)));
    geometry(ui, state, pixel, plan);
}

/// Camera pixels per pixel of the shown pictures, along each side.
fn preview_factor(state: &State) -> u32 {
    let Some(shown) = &state.engine.shown else { return 1 };
    match shown.reply.request.size {
        Size::Full => 1,
        Size::Preview => crate::engine::preview_factor(shown.reply.request.scenario.camera.size_px),
    }
}

/// Values of a pixel in one picture.
fn values(ui: &mut Ui, state: &State, picture: &StagePicture<'_>, [x, y]: [u32; 2]) {
    let factor = preview_factor(state);
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
    fact(ui, "linear", format!("{r:.5} {g:.5} {b:.5}"), "scene-linear R G B, as in the EXR");
    fact(ui, "sRGB", format!("{} {} {}", srgb8(r), srgb8(g), srgb8(b)), "8-bit codes, as in the PNG");
    fact(ui, "alpha", format!("{a:.0}"), "1 where there is a ray and a source, else 0");
    raw_facts(ui, picture, [x / factor, y / factor]);
    if let Some(depth_m) = picture.depth.and_then(|(depth, _)| depth.depth_m.get(index / 4)) {
        fact(ui, "depth, rendered", format!("{depth_m:.3} m"), "value of the depth channel; 0 for the sky");
    }
}

/// Numbers of the image sensor, and the electrons that they stand for.
fn raw_facts(ui: &mut Ui, picture: &StagePicture<'_>, [x, y]: [u32; 2]) {
    let Some((scale, raw)) = picture.raw_numbers() else { return };
    let channels = raw.channels as usize;
    let first = channels * (y as usize * picture.size_px[0] as usize + x as usize);
    let Some(numbers) = raw.values.get(first..first + channels) else { return };
    for (color, number) in scale.colors([x, y]).iter().zip(numbers) {
        let color = [", red", ", green", ", blue", ", white"].get(*color).copied().unwrap_or_default();
        let color = if scale.is_mono() { "" } else { color };
        let electrons = scale.electrons(*number);
        let electrons = electrons.map_or_else(|| ", companded".to_owned(), |e| format!(", {e:.1} electrons"));
        fact(
            ui,
            &format!("raw{color}"),
            format!("{number} DN{electrons}"),
            "number of the raw picture; electrons are (number - black) times the gain",
        );
    }
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
    let stamp_s = reference.stamp_s(frame);
    let mid_s = reference.mid_s(frame, pixel);
    let sample = state.engine.sample(pixel);
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
            // Of the whole camera: a sample has that of its face.
            let pose = reference.sequence().path.pose(sample.t_s);
            ray_facts(ui, &pose, sample);
            hit_facts(ui, state, &pose, sample);
            let path = motion::pixel_path(reference, frame, pixel);
            motion_facts(ui, pixel, path.as_ref());
        }
    }
    let full = shown.reply.request.size == crate::engine::Size::Full;
    if let (Some(plan), Some(sample)) = (plan.filter(|_| full), &sample) {
        source_facts(ui, plan, sample);
        sample_facts(ui, plan, |phase| reference.sample(frame, pixel, DVec2::ZERO, phase));
    }
    if let Some(plan) = plan {
        predicted_errors(ui, plan, predicted_here(state, pixel));
    }
}

/// Why a pixel has no ray.
fn no_ray(state: &State, [x, y]: [u32; 2]) -> String {
    let Some(spec) = state.document.as_ref().map(|document| &document.scenario.camera) else {
        return String::new();
    };
    let has_ray = |camera: Option<Arc<CameraModel>>| {
        camera.is_some_and(|camera| camera.ray(DVec2::new(f64::from(x), f64::from(y))).is_some())
    };
    if has_ray(motion::camera_model(spec)) {
        return "the reference has no ray here".into();
    }
    let without_circle = CameraSpec { image_circle: None, ..spec.clone() };
    // The last camera alone is cached: this one is made for pixels outside a circle only.
    if spec.image_circle.is_some() && has_ray(CameraModel::from_spec(&without_circle).ok().map(Arc::new)) {
        return "the pixel lies outside the image circle".into();
    }
    "the lens has no ideal ray here: the pixel lies beyond the fold of its distortion".into()
}

/// The ray of a sample in the axes of the whole camera.
fn ray_facts(ui: &mut Ui, pose: &CameraPose, sample: &RaySample) {
    let ray_ned = sample.pose.ned_from_camera * sample.uv.extend(1.0);
    let ray = (pose.ned_from_camera.conjugate() * ray_ned).normalize();
    let off_axis = ray.truncate().length().atan2(ray.z);
    if off_axis < LARGEST_FLAT_DEG.to_radians() {
        fact(
            ui,
            "ray u, v",
            format!("{}, {}", fixed(ray.x / ray.z, 6), fixed(ray.y / ray.z, 6)),
            "ideal normalised coordinates (x/z, y/z), the lens's inverse",
        );
    } else {
        fact(
            ui,
            "ray x, y, z",
            format!("{}, {}, {}", fixed(ray.x, 6), fixed(ray.y, 6), fixed(ray.z, 6)),
            "unit vector in the camera's axes: right, down, along the optical axis",
        );
    }
    fact(ui, "off axis", format!("{:.3} deg", off_axis.to_degrees()), "angle to the optical axis");
}

/// The surface that a ray hits.
fn hit_facts(ui: &mut Ui, state: &State, pose: &CameraPose, sample: &RaySample) {
    let Some(hit) = &sample.hit else {
        return fact(ui, "sees", "sky", "no surface along the ray");
    };
    let sequence = state.engine.sequence();
    fact(
        ui,
        "sees",
        sequence.map_or_else(String::new, |sequence| surface_name(sequence, hit.surface)),
        "the first surface along the ray, by its object",
    );
    if let Some(motion) = sequence.and_then(|sequence| sequence.scene.motion_of_surface(hit.surface)) {
        let speed_m_s = motion.state(sample.t_s).velocity(hit.point_ned_m).length();
        fact(ui, "moves at", format!("{speed_m_s:.3} m/s"), "speed of the point at the instant of the ray");
    }
    let in_camera = pose.ned_from_camera.conjugate() * (hit.point_ned_m - pose.position_ned_m);
    fact(
        ui,
        "depth",
        format!("{:.3} m", in_camera.z),
        "planar, along the optical axis at the row's mid-exposure; negative behind the camera",
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

/// Name of a surface by its number: its object's, with the number that the channel `object` has; without object,
/// terrain, pattern, board or model.
fn surface_name(sequence: &Sequence, number: u32) -> String {
    let scene = &sequence.scene;
    let object = scene.object_of_surface(number);
    let known = object.checked_sub(1).and_then(|index| scene.objects.get(index as usize));
    match known.filter(|object| !object.name.is_empty()) {
        Some(named) => format!("{} (object {object})", named.name),
        None => kind_of_surface(&sequence.scenario.scene, number),
    }
}

fn kind_of_surface(scene: &SceneSpec, number: u32) -> String {
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
