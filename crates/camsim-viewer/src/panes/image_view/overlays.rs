//! Overlays of a picture: distortion grid, motion, row times, colour scales.

use camsim_core::{camera::CameraModel, scenario::Face};
use camsim_plan::ErrorMap;
use eframe::egui::{self, Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, pos2, vec2};
use glam::{DVec2, DVec3};

use super::viewport::ImageViewport;
use crate::{
    engine::{ABOVE_BOUND, BARS, DECADES, Histogram, Stage},
    engine_state::StagePicture,
    motion,
    panes::ramp_color,
    state::State,
};

/// Magnification of image motion, most of which is about a pixel.
const MOTION_SCALE: f64 = 8.0;
/// Height of a histogram, points.
const HISTOGRAM_HEIGHT: f32 = 80.0;
/// Red, green, blue and white pixels of a histogram.
const HISTOGRAM_COLORS: [Color32; 4] = [
    Color32::from_rgb(255, 110, 110),
    Color32::from_rgb(110, 230, 110),
    Color32::from_rgb(120, 160, 255),
    Color32::from_rgb(230, 230, 230),
];
/// Width and height of a colour scale, points.
const SCALE_SIZE: [f32; 2] = [120.0, 8.0];
/// Steps of a colour scale.
const SCALE_STEPS: u8 = 24;
/// Lines of the distortion grid over the picture's width.
const GRID_LINES: i32 = 16;
/// Lines of it from the middle of a cube's face to its border.
const FACE_LINES: i32 = 6;
/// Points of each line of the grid.
const GRID_POINTS: i32 = 96;

/// Draws the overlays that the view has switched on.
pub fn draw(painter: &Painter, viewport: &ImageViewport, state: &State, picture: &StagePicture<'_>) {
    let overlays = state.view.overlays;
    let Some(sequence) = state.engine.sequence() else { return };
    if overlays.grid
        && let Ok(camera) = stage_camera(state, picture.stage)
    {
        let is_wide = match picture.rendered {
            Some(rendered) => !rendered.faces.is_empty(),
            None => state.engine.current_reference().is_some_and(|reference| reference.has_faces()),
        };
        grid(painter, viewport, &camera, if is_wide { &Face::ALL } else { &[] });
    }
    if overlays.motion && picture.stage >= Stage::Time {
        motion_paths(painter, viewport, state);
    }
    if overlays.rows && picture.stage >= Stage::Time {
        row_times(painter, viewport, &sequence.scenario.camera);
    }
    if overlays.depth
        && let Some((depth, _)) = picture.depth
    {
        depth_scale(painter, depth.range_m);
    } else if overlays.error
        && !(overlays.raw && picture.raw.is_some())
        && let (Some(rendered), Some((errors, _))) = (picture.rendered, picture.errors)
    {
        error_scale(painter, &errors.map, rendered.predicted_px());
    }
    if let Some(histogram) = picture.histogram.filter(|_| overlays.histogram) {
        draw_histogram(painter, histogram);
    }
}

/// The camera model of a stage, at the zoom of the shown frame.
fn stage_camera(state: &State, stage: Stage) -> Result<CameraModel, camsim_core::camera::CameraError> {
    let camera = match &state.document {
        Some(document) => crate::engine::stage_scenario(&document.scenario, stage).camera,
        None => camsim_core::scenario::CameraSpec::default(),
    };
    let zoom = state.engine.picture().and_then(|picture| picture.plan.zoom);
    zoom.map_or_else(|| CameraModel::from_spec(&camera), |zoom| CameraModel::at_zoom(&camera, zoom))
}

/// Lines of equal u and of equal v within the lens's domain; of a wide field, on each of the faces of a cube.
fn grid(painter: &Painter, viewport: &ImageViewport, camera: &CameraModel, faces: &[Face]) {
    let [width, height] = camera.size_px.map(f64::from);
    let stroke = Stroke::new(1.0, Color32::from_rgba_unmultiplied(255, 220, 60, 150));
    let line = |rays: &mut dyn Iterator<Item = DVec3>| {
        let mut run: Vec<Pos2> = Vec::new();
        for ray in rays {
            let pixel = camera.project_ray(ray);
            let near =
                pixel.x > -width && pixel.x < 2.0 * width && pixel.y > -height && pixel.y < 2.0 * height;
            if near && camera.lens.contains_ray(ray) {
                run.push(viewport.screen(pixel.x, pixel.y));
            } else {
                painter.add(Shape::line(std::mem::take(&mut run), stroke));
            }
        }
        painter.add(Shape::line(run, stroke));
    };
    // Barrel distortion shows rays far beyond a pinhole's frame.
    let (axes, step) = match faces {
        [] => (vec![glam::DQuat::IDENTITY], width / camera.focal_px.x / f64::from(GRID_LINES)),
        faces => (faces.iter().map(|face| face.camera_from_face()).collect(), 1.0 / f64::from(FACE_LINES)),
    };
    let reach = if faces.is_empty() { GRID_LINES } else { FACE_LINES };
    let ratio = f64::from(2 * reach) / f64::from(GRID_POINTS);
    for camera_from_axes in axes {
        for fixed in -reach..=reach {
            for upright in [true, false] {
                let fixed = f64::from(fixed) * step;
                let ray = |point: i32| {
                    let along = (f64::from(point) * ratio - f64::from(reach)) * step;
                    let [u, v] = if upright { [fixed, along] } else { [along, fixed] };
                    camera_from_axes * DVec3::new(u, v, 1.0)
                };
                line(&mut (0..=GRID_POINTS).map(ray));
            }
        }
    }
}

/// Draws displacements from the stamp to the row's time, and paths over the exposure.
fn motion_paths(painter: &Painter, viewport: &ImageViewport, state: &State) {
    let (Some(reference), Some(shown)) = (state.engine.current_reference(), &state.engine.shown) else {
        return;
    };
    let paths = motion::grid_paths(reference, shown.reply.frame);
    let (displacement_stroke, exposure_stroke) = (
        Stroke::new(1.0, Color32::from_rgb(80, 200, 255)),
        Stroke::new(2.0, Color32::from_rgb(255, 120, 60)),
    );
    for path in paths.iter() {
        let screen = |image_px: DVec2| {
            let magnified_px = path.pixel + MOTION_SCALE * (image_px - path.pixel);
            viewport.screen(magnified_px.x, magnified_px.y)
        };
        if let Some(at_stamp) = path.at_stamp_px {
            painter.line_segment([screen(at_stamp), screen(path.pixel)], displacement_stroke);
        }
        painter.circle_filled(screen(path.pixel), 1.5, displacement_stroke.color);
        painter.add(Shape::line(
            path.exposure_px.iter().map(|image_px| screen(*image_px)).collect(),
            exposure_stroke,
        ));
    }
}

/// A colour strip with the mid-exposure times of rows, at the left border.
fn row_times(painter: &Painter, viewport: &ImageViewport, camera: &camsim_core::scenario::CameraSpec) {
    let Ok(shutter) = camsim_core::shutter::Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px)
    else {
        return;
    };
    let [width, height] = camera.size_px;
    let mids: Vec<f64> = (0..height).map(|y| shutter.dt_pixel_s(width / 2, y)).collect();
    let (first_s, last_s) =
        mids.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)));
    let left = painter.clip_rect().left();
    let step = (height / 240).max(1);
    for y in (0..height).step_by(step as usize) {
        let t_s = mids.get(y as usize).copied().unwrap_or_default();
        let fraction = if last_s > first_s { (t_s - first_s) / (last_s - first_s) } else { 0.5 };
        let (top, bottom) =
            (viewport.screen(0.0, f64::from(y) - 0.5).y, viewport.screen(0.0, f64::from(y + step) - 0.5).y);
        painter.rect_filled(
            Rect::from_x_y_ranges(left..=left + 10.0, top..=bottom),
            0.0,
            ramp_color(fraction),
        );
    }
    for y in [0, height / 4, height / 2, 3 * height / 4, height.saturating_sub(1)] {
        let visible = painter.clip_rect().shrink(7.0);
        let position = pos2(
            left + 13.0,
            viewport.screen(0.0, f64::from(y)).y.clamp(visible.top(), visible.bottom().max(visible.top())),
        );
        let text = format!("{:+.2} ms", 1e3 * mids.get(y as usize).copied().unwrap_or_default());
        painter.text(position, Align2::LEFT_CENTER, text, FontId::proportional(11.0), Color32::WHITE);
    }
}

/// Colour scale of predicted errors, which ends at the bound for 99 % of the frame's pixels.
fn error_scale(painter: &Painter, map: &ErrorMap, bound_px: f64) {
    let largest_px = map.known().map(|(_, px)| px).fold(0.0, f64::max);
    let least = format!("{:.1e}", bound_px * 10.0_f64.powf(-DECADES));
    let most = format!("{bound_px:.1e} px: 99 % of the pixels are within it");
    let [r, g, b] = ABOVE_BOUND;
    let (caption, color) = if largest_px > bound_px {
        (format!("red: above it, up to {largest_px:.1e} px; grey: silhouettes"), Color32::from_rgb(r, g, b))
    } else {
        (format!("largest here {largest_px:.1e} px; grey: silhouettes"), Color32::WHITE)
    };
    color_scale(painter, [least, most], (&caption, color), |fraction| fraction);
}

/// Colour scale of depth.
fn depth_scale(painter: &Painter, range_m: Option<[f32; 2]>) {
    let ends = range_m
        .map_or_else(|| ["no".into(), "surface".into()], |range_m| range_m.map(|m| format!("{m:.3} m")));
    color_scale(painter, ends, ("planar depth, logarithmic", Color32::WHITE), |fraction| 1.0 - fraction);
}

/// Draws a colour scale with labels at its ends and a caption, in the lower left corner of the clip
/// rectangle.
fn color_scale(
    painter: &Painter,
    ends: [String; 2],
    (caption, caption_color): (&str, Color32),
    color: impl Fn(f64) -> f64,
) {
    // In a wipe each picture has its own scale, on its side of the line.
    let visible = painter.clip_rect();
    let corner = pos2(visible.left() + 6.0, visible.bottom() - 38.0);
    let colored = |text: &str, color: Color32| {
        painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), color)
    };
    let galley = |text: &str| colored(text, Color32::WHITE);
    let ([low_label, high_label], caption) =
        (ends.map(|text| galley(&text)), colored(caption, caption_color));
    let left = low_label.size().x + 6.0;
    let right = left + SCALE_SIZE[0] + 6.0;
    let width = (right + high_label.size().x).max(caption.size().x);
    painter.rect_filled(
        Rect::from_min_size(corner - vec2(4.0, 4.0), vec2(width + 8.0, 40.0)).intersect(visible),
        3.0,
        Color32::from_black_alpha(170),
    );
    let step = SCALE_SIZE[0] / f32::from(SCALE_STEPS);
    for i in 0..SCALE_STEPS {
        let fraction = (f64::from(i) + 0.5) / f64::from(SCALE_STEPS);
        let rect = Rect::from_min_size(
            corner + vec2(left + f32::from(i) * step, 0.0),
            vec2(step + 0.5, SCALE_SIZE[1]),
        );
        painter.rect_filled(rect, 0.0, ramp_color(color(fraction)));
    }
    let middle = |galley: &egui::Galley| 0.5 * (SCALE_SIZE[1] - galley.size().y);
    for (offset, text) in [
        (vec2(0.0, middle(&low_label)), low_label),
        (vec2(right, middle(&high_label)), high_label),
        (vec2(0.0, 14.0), caption),
    ] {
        painter.galley(corner + offset, text, Color32::WHITE);
    }
}

/// Draws a histogram with logarithmic counts in the lower right corner of the clip rectangle.
fn draw_histogram(painter: &Painter, histogram: &Histogram) {
    let visible = painter.clip_rect();
    let size = vec2(BARS as f32, HISTOGRAM_HEIGHT);
    let kind = if histogram.is_raw { "raw, DN" } else { "sRGB codes" };
    let caption =
        format!("0 to {} ({kind}), {:.2} % at the largest", histogram.end - 1, 100.0 * histogram.full);
    let galley = painter.layout_no_wrap(caption, FontId::proportional(12.0), Color32::WHITE);
    let box_size = vec2(size.x.max(galley.size().x) + 12.0, size.y + galley.size().y + 14.0);
    let frame = Rect::from_min_size(visible.right_bottom() - box_size - vec2(6.0, 6.0), box_size);
    painter.rect_filled(frame, 3.0, Color32::from_black_alpha(190));
    let most = histogram.counts.iter().flatten().copied().max().unwrap_or(0) as f32;
    let bottom = frame.top() + 6.0 + size.y;
    for (counts, color) in histogram.counts.iter().zip(HISTOGRAM_COLORS) {
        if counts.iter().all(|count| *count == 0) {
            continue;
        }
        let height = |count: u64| size.y * (count as f32).ln_1p() / most.ln_1p().max(1e-6);
        let points = (0_u16..)
            .zip(counts)
            .map(|(bar, count)| pos2(frame.left() + 6.0 + f32::from(bar), bottom - height(*count)));
        painter.add(Shape::line(points.collect(), Stroke::new(1.0, color)));
    }
    painter.galley(pos2(frame.left() + 6.0, bottom + 4.0), galley, Color32::WHITE);
}
