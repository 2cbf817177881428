//! Where pixels lie on the screen, and the hand that moves them.

use eframe::egui::{Painter, Pos2, Rect, Response, Ui, Vec2, pos2, vec2};

use crate::{
    engine::preview_factor,
    message::{Message, Outbox},
    sheet::{Place, Sheet},
    state::State,
    view::View,
};

/// Pixels of the screen a pixel, at least and at most.
const ZOOM: [f32; 2] = [0.02, 64.0];

/// A camera's picture in a pane.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// The pane.
    pub pane: Rect,
    /// Pixels of the camera.
    pub size_px: [u32; 2],
    /// Points a pixel.
    pub scale: f32,
    /// Of the screen.
    pixels_per_point: f32,
    origin: Pos2,
}

impl Placement {
    /// As the view says; `pixels_per_point` of the screen.
    pub fn new(pane: Rect, size_px: [u32; 2], view: &View, pixels_per_point: f32) -> Self {
        let size = vec2(size_px[0].max(1) as f32, size_px[1].max(1) as f32);
        let fit = (pane.width() / size.x).min(pane.height() / size.y).max(1e-4);
        let (scale, centre) = match view.zoom {
            Some(zoom) => (zoom.clamp(ZOOM[0], ZOOM[1]) / pixels_per_point, view.centre),
            None => (fit, [0.5, 0.5]),
        };
        let origin = pane.center() - vec2(centre[0] * size.x, centre[1] * size.y) * scale;
        // On a border of the screen's own pixels: at one of them a pixel, each then shows just one.
        let snap = |at: f32| (at * pixels_per_point).round() / pixels_per_point;
        let origin = pos2(snap(origin.x), snap(origin.y));
        Self { pane, size_px, scale, pixels_per_point, origin }
    }

    /// Pixels of the screen for each pixel of the camera.
    pub fn zoom(&self) -> f32 {
        self.scale * self.pixels_per_point
    }

    /// Where the whole picture lies.
    pub fn rect(&self) -> Rect {
        Rect::from_min_size(self.origin, vec2(self.size_px[0] as f32, self.size_px[1] as f32) * self.scale)
    }

    /// Where a picture of `size_px` lies, which may be a preview: its pixels are larger, and the last ones
    /// may reach beyond the border.
    pub fn picture_rect(&self, size_px: [u32; 2]) -> Rect {
        let factor = if size_px == self.size_px { 1 } else { preview_factor(self.size_px) };
        Rect::from_min_size(
            self.origin,
            vec2((size_px[0] * factor) as f32, (size_px[1] * factor) as f32) * self.scale,
        )
    }

    /// Draws a picture there.
    pub fn image(&self, painter: &Painter, place: Place, sheet: &Sheet, size_px: [u32; 2]) {
        sheet.draw(painter, place, self.picture_rect(size_px));
    }

    /// Where a place of the picture lies; integers are pixel centres.
    pub fn screen(&self, x_px: f64, y_px: f64) -> Pos2 {
        self.origin + vec2(x_px as f32 + 0.5, y_px as f32 + 0.5) * self.scale
    }

    /// The pixel under a point, if there is one.
    pub fn pixel(&self, at: Pos2) -> Option<[u32; 2]> {
        let place = (at - self.origin) / self.scale;
        let inside = |v: f32, side: u32| (v >= 0.0 && v < side as f32).then_some(v as u32);
        Some([inside(place.x, self.size_px[0])?, inside(place.y, self.size_px[1])?])
    }

    /// The share of the picture's size at a point.
    fn share(&self, at: Pos2) -> [f32; 2] {
        let place = (at - self.origin) / self.scale;
        [place.x / self.size_px[0].max(1) as f32, place.y / self.size_px[1].max(1) as f32]
    }
}

/// Zoom at the cursor, pan, pixel under the cursor.
pub fn interact(
    ui: &Ui,
    response: &Response,
    placements: &[Placement],
    state: &State,
    elsewhere: bool,
    out: &mut Outbox,
) {
    let pointer = response.hover_pos().filter(|_| !elsewhere);
    let under = pointer.and_then(|at| {
        placements.iter().find(|placement| placement.pane.contains(at)).map(|placement| (at, placement))
    });
    let pixel = under.and_then(|(at, placement)| placement.pixel(at));
    if pixel != state.hovered {
        out.push(Message::Hover(pixel));
    }
    if response.clicked() && !elsewhere {
        out.push(Message::Pin(pixel.filter(|_| state.pinned != pixel)));
    }
    let mut view = state.view.clone();
    if response.double_clicked() {
        view.zoom = None;
    }
    let Some((at, placement)) =
        under.or_else(|| placements.first().map(|first| (first.pane.center(), first)))
    else {
        return;
    };
    if response.dragged() && !elsewhere && response.drag_delta() != Vec2::ZERO {
        let centre = placement.share(placement.pane.center() - response.drag_delta());
        (view.zoom, view.centre) = (Some(placement.zoom()), centre.map(|share| share.clamp(-0.5, 1.5)));
    }
    let factor = ui.input(|input| input.zoom_delta() * (input.smooth_scroll_delta().y / 200.0).exp());
    if response.contains_pointer() && (factor - 1.0).abs() > 1e-4 {
        view = zoomed(&view, placement, at, factor);
    }
    if view != state.view {
        out.push(Message::View(view));
    }
}

/// Enlarged by `factor`, with what is at `at` staying there.
pub fn zoomed(view: &View, placement: &Placement, at: Pos2, factor: f32) -> View {
    let zoom = (placement.zoom() * factor).clamp(ZOOM[0], ZOOM[1]);
    let fixed = placement.share(at);
    let from_middle = (at - placement.pane.center()) * (placement.pixels_per_point / zoom);
    let size = [placement.size_px[0].max(1) as f32, placement.size_px[1].max(1) as f32];
    let centre = [fixed[0] - from_middle.x / size[0], fixed[1] - from_middle.y / size[1]];
    View { zoom: Some(zoom), centre, ..view.clone() }
}

/// Enlarged by `factor` about the middle of a pane that need not be known: `current` is the zoom now.
pub fn zoomed_in_place(view: &View, current: f32, factor: f32) -> View {
    let centre = if view.zoom.is_some() { view.centre } else { [0.5, 0.5] };
    View { zoom: Some((current * factor).clamp(ZOOM[0], ZOOM[1])), centre, ..view.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pane() -> Rect {
        Rect::from_min_size(pos2(100.0, 50.0), vec2(640.0, 480.0))
    }

    #[test]
    fn pixels_and_points_agree() {
        let placement = Placement::new(pane(), [64, 48], &View::default(), 1.0);
        assert_eq!(placement.scale, 10.0);
        assert_eq!(placement.pixel(pos2(100.0, 50.0)), Some([0, 0]));
        assert_eq!(placement.pixel(pos2(739.9, 529.9)), Some([63, 47]));
        assert_eq!(placement.pixel(pos2(99.0, 60.0)), None);
        assert_eq!(placement.screen(0.0, 0.0), pos2(105.0, 55.0), "centre of the first pixel");
    }

    #[test]
    fn zoom_is_in_pixels_of_the_screen() {
        let middle = |zoom, pixels_per_point| {
            let view = View { zoom: Some(zoom), ..View::default() };
            Placement::new(pane(), [64, 48], &view, pixels_per_point)
        };
        for pixels_per_point in [1.0, 1.5, 2.0] {
            let placement = middle(1.0, pixels_per_point);
            let on_screen_px = placement.rect().size() * pixels_per_point;
            assert!(
                (on_screen_px - vec2(64.0, 48.0)).length() < 1e-3,
                "{on_screen_px} at {pixels_per_point}"
            );
            let larger = zoomed(&View::default(), &placement, pane().center(), 2.0);
            assert!(
                (larger.zoom.expect("zoomed") - 2.0).abs() < 1e-6
                    && (middle(2.0, pixels_per_point).zoom() - 2.0).abs() < 1e-6
            );
            let fitted = Placement::new(pane(), [64, 48], &View::default(), pixels_per_point);
            assert_eq!((fitted.scale, fitted.zoom()), (10.0, 10.0 * pixels_per_point));
        }
        // However dense the screen is, the ends are the same.
        assert_eq!(middle(1e9, 2.0).zoom(), ZOOM[1]);
    }

    #[test]
    fn what_is_under_the_cursor_stays_there() {
        let mut view = View::default();
        let at = pos2(300.0, 200.0);
        for factor in [1.5, 3.0, 0.4] {
            let before = Placement::new(pane(), [64, 48], &view, 1e3);
            let share = before.share(at);
            view = zoomed(&view, &before, at, factor);
            let after = Placement::new(pane(), [64, 48], &view, 1e3).share(at);
            assert!(
                (share[0] - after[0]).abs() < 1e-4 && (share[1] - after[1]).abs() < 1e-4,
                "{share:?} {after:?}"
            );
        }
    }

    #[test]
    fn a_preview_lies_on_the_picture() {
        let placement = Placement::new(pane(), [640, 480], &View::default(), 1.0);
        assert_eq!(placement.picture_rect([320, 240]), placement.rect());
        // 639 pixels are 320 of two: half a pixel of the preview lies outside.
        let odd = Placement::new(pane(), [639, 480], &View::default(), 1.0);
        assert!((odd.picture_rect([320, 240]).width() - 640.0 * odd.scale).abs() < 1e-3);
    }
}
