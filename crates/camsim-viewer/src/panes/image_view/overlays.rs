//! What is drawn over a picture.

use camsim_core::camera::CameraModel;
use camsim_plan::ErrorMap;
use eframe::egui::{self, Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, pos2, vec2};
use glam::DVec2;

use super::canvas::Placement;
use crate::{
    engine::{DECADES, Stage},
    heard::PixelTruth,
    motion,
    panes::ramp_color,
    state::State,
};

/// Times that ways are enlarged: most are of a pixel.
const MOTION_SCALE: f64 = 8.0;
/// Points of the scale of colours, and its steps.
const SCALE: [f32; 2] = [120.0, 8.0];
const SCALE_STEPS: u8 = 24;
/// Lines of the distortion grid over the picture's width, and points of each.
const GRID_LINES: i32 = 16;
const GRID_POINTS: i32 = 96;

/// All that the view asks for.
pub fn draw(painter: &Painter, placement: &Placement, state: &State, sight: &PixelTruth<'_>) {
    let overlays = state.view.overlays;
    let Some(sequence) = state.heard.sequence() else { return };
    if overlays.grid
        && let Ok(camera) = lens_of(state, sight.stage)
    {
        grid(painter, placement, &camera);
    }
    if overlays.motion && sight.stage >= Stage::Time {
        motion_paths(painter, placement, state);
    }
    if overlays.rows && sight.stage >= Stage::Time {
        row_times(painter, placement, &sequence.scenario.camera);
    }
    if overlays.depth
        && let Some((truth, _)) = sight.depth
    {
        depth_scale(painter, truth.range_m);
    } else if overlays.error
        && let (Some(plan), Some((errors, _))) = (sight.plan, sight.errors)
    {
        error_scale(painter, &errors.map, plan.predicted.total_px);
    }
}

fn lens_of(state: &State, stage: Stage) -> Result<CameraModel, camsim_core::camera::CameraError> {
    let camera = match &state.document {
        Some(document) => crate::engine::staged(&document.scenario, stage).camera,
        None => camsim_core::scenario::CameraSpec::default(),
    };
    let zoom = state.heard.picture().and_then(|picture| picture.plan.zoom);
    zoom.map_or_else(|| CameraModel::from_spec(&camera), |zoom| CameraModel::at_zoom(&camera, zoom))
}

/// Lines of equal u and v, as far as the lens has an answer there.
fn grid(painter: &Painter, placement: &Placement, camera: &CameraModel) {
    let [width, height] = camera.size_px.map(f64::from);
    let step = width / camera.focal_px.x / f64::from(GRID_LINES);
    // Barrel lenses show rays far beyond the frame of a pinhole.
    let reach = GRID_LINES;
    let ratio = f64::from(2 * reach) / f64::from(GRID_POINTS);
    let stroke = Stroke::new(1.0, Color32::from_rgba_unmultiplied(255, 220, 60, 150));
    for line in -reach..=reach {
        for upright in [true, false] {
            let fixed = f64::from(line) * step;
            let mut run: Vec<Pos2> = Vec::new();
            for point in 0..=GRID_POINTS {
                let along = (f64::from(point) * ratio - f64::from(reach)) * step;
                let uv = if upright { DVec2::new(fixed, along) } else { DVec2::new(along, fixed) };
                let pixel = camera.project(uv);
                let near =
                    pixel.x > -width && pixel.x < 2.0 * width && pixel.y > -height && pixel.y < 2.0 * height;
                if near && camera.lens.contains(uv) {
                    run.push(placement.screen(pixel.x, pixel.y));
                } else {
                    painter.add(Shape::line(std::mem::take(&mut run), stroke));
                }
            }
            painter.add(Shape::line(run, stroke));
        }
    }
}

/// Arrows from where things would be at the stamp to where they are, and their ways over the exposure.
fn motion_paths(painter: &Painter, placement: &Placement, state: &State) {
    let (Some(looks), Some(shown)) = (state.heard.current_looks(), &state.heard.shown) else { return };
    let paths = motion::paths(looks, shown.reply.frame);
    let (of_shift, of_blur) = (
        Stroke::new(1.0, Color32::from_rgb(80, 200, 255)),
        Stroke::new(2.0, Color32::from_rgb(255, 120, 60)),
    );
    for path in paths.iter() {
        let screen = |place: DVec2| {
            let place = path.pixel + MOTION_SCALE * (place - path.pixel);
            placement.screen(place.x, place.y)
        };
        if let Some(at_stamp) = path.at_stamp_px {
            painter.line_segment([screen(at_stamp), screen(path.pixel)], of_shift);
        }
        painter.circle_filled(screen(path.pixel), 1.5, of_shift.color);
        painter.add(Shape::line(path.exposure_px.iter().map(|place| screen(*place)).collect(), of_blur));
    }
}

/// A strip at the left border, with its scale.
fn row_times(painter: &Painter, placement: &Placement, camera: &camsim_core::scenario::CameraSpec) {
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
        let share = if last_s > first_s { (t_s - first_s) / (last_s - first_s) } else { 0.5 };
        let (top, bottom) =
            (placement.screen(0.0, f64::from(y) - 0.5).y, placement.screen(0.0, f64::from(y + step) - 0.5).y);
        painter.rect_filled(Rect::from_x_y_ranges(left..=left + 10.0, top..=bottom), 0.0, ramp_color(share));
    }
    for y in [0, height / 4, height / 2, 3 * height / 4, height.saturating_sub(1)] {
        let seen = painter.clip_rect().shrink(7.0);
        let at = pos2(
            left + 13.0,
            placement.screen(0.0, f64::from(y)).y.clamp(seen.top(), seen.bottom().max(seen.top())),
        );
        let text = format!("{:+.2} ms", 1e3 * mids.get(y as usize).copied().unwrap_or_default());
        painter.text(at, Align2::LEFT_CENTER, text, FontId::proportional(11.0), Color32::WHITE);
    }
}

/// What the colours mean, and the bound for the frame as a whole.
fn error_scale(painter: &Painter, map: &ErrorMap, total_px: f64) {
    let largest_px = map.known().map(|(_, px)| px).fold(0.0, f64::max);
    let least = format!("{:.1e}", largest_px * 10.0_f64.powf(-DECADES));
    let most = format!("{largest_px:.1e} px predicted; grey: counted apart");
    scale(painter, [least, most], &format!("99 % of the frame's pixels within {total_px:.4} px"), |share| {
        share
    });
}

fn depth_scale(painter: &Painter, range_m: Option<[f32; 2]>) {
    let ends = range_m
        .map_or_else(|| ["nothing".into(), "there".into()], |range_m| range_m.map(|m| format!("{m:.3} m")));
    scale(painter, ends, "planar depth, by its logarithm", |share| 1.0 - share);
}

/// Colours from left to right with what they stand for at the ends, and a line below, in the lower left
/// corner of what is seen.
fn scale(painter: &Painter, ends: [String; 2], below: &str, color: impl Fn(f64) -> f64) {
    // Of two pictures by a wipe each has its own, on its side of the line.
    let seen = painter.clip_rect();
    let low = pos2(seen.left() + 6.0, seen.bottom() - 38.0);
    let galley =
        |text: &str| painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), Color32::WHITE);
    let ([least, most], below) = (ends.map(|text| galley(&text)), galley(below));
    let left = least.size().x + 6.0;
    let right = left + SCALE[0] + 6.0;
    let width = (right + most.size().x).max(below.size().x);
    painter.rect_filled(
        Rect::from_min_size(low - vec2(4.0, 4.0), vec2(width + 8.0, 40.0)).intersect(seen),
        3.0,
        Color32::from_black_alpha(170),
    );
    let step = SCALE[0] / f32::from(SCALE_STEPS);
    for i in 0..SCALE_STEPS {
        let share = (f64::from(i) + 0.5) / f64::from(SCALE_STEPS);
        let rect =
            Rect::from_min_size(low + vec2(left + f32::from(i) * step, 0.0), vec2(step + 0.5, SCALE[1]));
        painter.rect_filled(rect, 0.0, ramp_color(color(share)));
    }
    let middle = |galley: &egui::Galley| 0.5 * (SCALE[1] - galley.size().y);
    for (at, text) in
        [(vec2(0.0, middle(&least)), least), (vec2(right, middle(&most)), most), (vec2(0.0, 14.0), below)]
    {
        painter.galley(low + at, text, Color32::WHITE);
    }
}
