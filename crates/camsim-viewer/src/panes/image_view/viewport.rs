//! Viewport of a picture: mapping between camera pixels and screen points, zoom and pan.

use eframe::egui::{Painter, Pos2, Rect, Response, Ui, Vec2, pos2, vec2};

use crate::{
    display_image::{DisplayImage, ImageSlot},
    engine::preview_factor,
    message::{Message, Outbox},
    state::State,
    view::View,
};

/// Range of zoom, screen pixels per camera pixel.
const ZOOM: [f32; 2] = [0.02, 64.0];

/// Mapping of a camera's picture into a pane.
#[derive(Clone, Copy, Debug)]
pub struct ImageViewport {
    /// The pane, points.
    pub pane: Rect,
    /// Size of the camera's picture.
    pub size_px: [u32; 2],
    /// Points per camera pixel.
    pub scale: f32,
    /// Screen pixels per point.
    pixels_per_point: f32,
    /// Top left corner of the picture, points.
    origin: Pos2,
}

impl ImageViewport {
    /// The viewport of a view's zoom and centre.
    pub fn new(pane: Rect, size_px: [u32; 2], view: &View, pixels_per_point: f32) -> Self {
        let size = vec2(size_px[0].max(1) as f32, size_px[1].max(1) as f32);
        let fit = (pane.width() / size.x).min(pane.height() / size.y).max(1e-4);
        let (scale, centre) = match view.zoom {
            Some(zoom) => (zoom.clamp(ZOOM[0], ZOOM[1]) / pixels_per_point, view.centre),
            None => (fit, [0.5, 0.5]),
        };
        let origin = pane.center() - vec2(centre[0] * size.x, centre[1] * size.y) * scale;
        // Snapped to screen pixels: at 1:1 each then shows one camera pixel.
        let snap = |points: f32| (points * pixels_per_point).round() / pixels_per_point;
        let origin = pos2(snap(origin.x), snap(origin.y));
        Self { pane, size_px, scale, pixels_per_point, origin }
    }

    /// Screen pixels per camera pixel.
    pub fn zoom(&self) -> f32 {
        self.scale * self.pixels_per_point
    }

    /// Rectangle of the whole picture, points.
    pub fn rect(&self) -> Rect {
        Rect::from_min_size(self.origin, vec2(self.size_px[0] as f32, self.size_px[1] as f32) * self.scale)
    }

    /// Rectangle of a picture of `size_px`, which may be a preview. The last pixels of a preview may reach
    /// beyond the camera's picture.
    pub fn picture_rect(&self, size_px: [u32; 2]) -> Rect {
        let factor = if size_px == self.size_px { 1 } else { preview_factor(self.size_px) };
        Rect::from_min_size(
            self.origin,
            vec2((size_px[0] * factor) as f32, (size_px[1] * factor) as f32) * self.scale,
        )
    }

    /// Draws a picture.
    pub fn image(&self, painter: &Painter, slot: ImageSlot, image: &DisplayImage, size_px: [u32; 2]) {
        image.draw(painter, slot, self.picture_rect(size_px));
    }

    /// Screen position of image coordinates; integers are pixel centres.
    pub fn screen(&self, x_px: f64, y_px: f64) -> Pos2 {
        self.origin + vec2(x_px as f32 + 0.5, y_px as f32 + 0.5) * self.scale
    }

    /// The camera pixel at a screen position.
    pub fn pixel(&self, position: Pos2) -> Option<[u32; 2]> {
        let image_px = (position - self.origin) / self.scale;
        let inside = |v: f32, side: u32| (v >= 0.0 && v < side as f32).then_some(v as u32);
        Some([inside(image_px.x, self.size_px[0])?, inside(image_px.y, self.size_px[1])?])
    }

    /// Position as a fraction of the picture's size.
    fn fraction(&self, position: Pos2) -> [f32; 2] {
        let image_px = (position - self.origin) / self.scale;
        [image_px.x / self.size_px[0].max(1) as f32, image_px.y / self.size_px[1].max(1) as f32]
    }
}

/// Handles zoom, pan, hover and click. With `is_captured` another control has the pointer.
pub fn interact(
    ui: &Ui,
    response: &Response,
    viewports: &[ImageViewport],
    state: &State,
    is_captured: bool,
    out: &mut Outbox,
) {
    let pointer = response.hover_pos().filter(|_| !is_captured);
    let hovered = pointer.and_then(|position| {
        let viewport = viewports.iter().find(|viewport| viewport.pane.contains(position))?;
        Some((position, viewport))
    });
    let pixel = hovered.and_then(|(position, viewport)| viewport.pixel(position));
    if pixel != state.hovered {
        out.push(Message::Hover(pixel));
    }
    if response.clicked() && !is_captured {
        out.push(Message::Pin(pixel.filter(|_| state.pinned != pixel)));
    }
    let mut view = state.view.clone();
    if response.double_clicked() {
        view.zoom = None;
    }
    let Some((position, viewport)) =
        hovered.or_else(|| viewports.first().map(|first| (first.pane.center(), first)))
    else {
        return;
    };
    if response.dragged() && !is_captured && response.drag_delta() != Vec2::ZERO {
        let centre = viewport.fraction(viewport.pane.center() - response.drag_delta());
        (view.zoom, view.centre) = (Some(viewport.zoom()), centre.map(|fraction| fraction.clamp(-0.5, 1.5)));
    }
    let factor = ui.input(|input| input.zoom_delta() * (input.smooth_scroll_delta().y / 200.0).exp());
    if response.contains_pointer() && (factor - 1.0).abs() > 1e-4 {
        view = zoomed(&view, viewport, position, factor);
    }
    if view != state.view {
        out.push(Message::View(view));
    }
}

/// The view zoomed by `factor` about a screen position.
pub fn zoomed(view: &View, viewport: &ImageViewport, fixed: Pos2, factor: f32) -> View {
    let zoom = (viewport.zoom() * factor).clamp(ZOOM[0], ZOOM[1]);
    let fraction = viewport.fraction(fixed);
    let from_middle = (fixed - viewport.pane.center()) * (viewport.pixels_per_point / zoom);
    let size = [viewport.size_px[0].max(1) as f32, viewport.size_px[1].max(1) as f32];
    let centre = [fraction[0] - from_middle.x / size[0], fraction[1] - from_middle.y / size[1]];
    View { zoom: Some(zoom), centre, ..view.clone() }
}

/// The view zoomed by `factor` about the middle of the pane; `current` is the present zoom.
pub fn zoomed_about_middle(view: &View, current: f32, factor: f32) -> View {
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
    fn pixel_and_screen_are_inverse() {
        let viewport = ImageViewport::new(pane(), [64, 48], &View::default(), 1.0);
        assert_eq!(viewport.scale, 10.0);
        assert_eq!(viewport.pixel(pos2(100.0, 50.0)), Some([0, 0]));
        assert_eq!(viewport.pixel(pos2(739.9, 529.9)), Some([63, 47]));
        assert_eq!(viewport.pixel(pos2(99.0, 60.0)), None);
        assert_eq!(viewport.screen(0.0, 0.0), pos2(105.0, 55.0), "centre of the first pixel");
    }

    #[test]
    fn zoom_is_in_screen_pixels() {
        let middle = |zoom, pixels_per_point| {
            let view = View { zoom: Some(zoom), ..View::default() };
            ImageViewport::new(pane(), [64, 48], &view, pixels_per_point)
        };
        for pixels_per_point in [1.0, 1.5, 2.0] {
            let viewport = middle(1.0, pixels_per_point);
            let on_screen_px = viewport.rect().size() * pixels_per_point;
            assert!(
                (on_screen_px - vec2(64.0, 48.0)).length() < 1e-3,
                "{on_screen_px} at {pixels_per_point}"
            );
            let larger = zoomed(&View::default(), &viewport, pane().center(), 2.0);
            assert!(
                (larger.zoom.expect("zoomed") - 2.0).abs() < 1e-6
                    && (middle(2.0, pixels_per_point).zoom() - 2.0).abs() < 1e-6
            );
            let fitted = ImageViewport::new(pane(), [64, 48], &View::default(), pixels_per_point);
            assert_eq!((fitted.scale, fitted.zoom()), (10.0, 10.0 * pixels_per_point));
        }
        // The range does not depend on the density of the screen.
        assert_eq!(middle(1e9, 2.0).zoom(), ZOOM[1]);
    }

    #[test]
    fn zoom_keeps_the_position_under_the_cursor() {
        let mut view = View::default();
        let cursor = pos2(300.0, 200.0);
        for factor in [1.5, 3.0, 0.4] {
            let before = ImageViewport::new(pane(), [64, 48], &view, 1e3);
            let fraction = before.fraction(cursor);
            view = zoomed(&view, &before, cursor, factor);
            let after = ImageViewport::new(pane(), [64, 48], &view, 1e3).fraction(cursor);
            assert!(
                (fraction[0] - after[0]).abs() < 1e-4 && (fraction[1] - after[1]).abs() < 1e-4,
                "{fraction:?} {after:?}"
            );
        }
    }

    #[test]
    fn a_preview_covers_the_rectangle_of_the_picture() {
        let viewport = ImageViewport::new(pane(), [640, 480], &View::default(), 1.0);
        assert_eq!(viewport.picture_rect([320, 240]), viewport.rect());
        // 639 pixels need 320 preview pixels of 2: half of the last lies outside.
        let odd = ImageViewport::new(pane(), [639, 480], &View::default(), 1.0);
        assert!((odd.picture_rect([320, 240]).width() - 640.0 * odd.scale).abs() < 1e-3);
    }
}
