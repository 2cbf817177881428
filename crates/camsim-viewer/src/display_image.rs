//! Images drawn on the screen.
//!
//! egui draws all rectangles with one shader, which filters in two ways per pixel and blends by vertex
//! colours. On a software adapter that dominates the time of a pass with a large image. Images therefore have
//! a pipeline of their own, which reads one texel. egui draws them where the window's format is sRGB, so that
//! codes would be converted, and where no window is registered, as in most tests.

mod blit;

use std::sync::Arc;

use eframe::{
    egui::{
        Color32, ColorImage, Context, Id, Painter, Rect, TextureFilter, TextureHandle, TextureOptions, pos2,
    },
    egui_wgpu,
};

pub use blit::register;

/// Texture slot of a drawn image: two images in one pass need two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageSlot {
    /// The first image, or the only one.
    A,
    /// The second image of a pair.
    B,
}

/// An image that can be drawn.
#[derive(Clone)]
pub struct DisplayImage {
    image: Arc<ColorImage>,
    /// egui's texture; `None` if the image is drawn by [`blit`].
    texture: Option<TextureHandle>,
}

impl DisplayImage {
    /// Reuses the texture of `old`.
    pub fn new(context: &Context, name: &str, image: Arc<ColorImage>, old: Option<Self>) -> Self {
        if has_pipeline(context) {
            return Self { image, texture: None };
        }
        let options = TextureOptions {
            magnification: TextureFilter::Nearest,
            minification: TextureFilter::Linear,
            ..TextureOptions::LINEAR
        };
        let texture = match old.and_then(|old| old.texture) {
            Some(mut texture) => {
                texture.set(image.clone(), options);
                texture
            }
            None => context.load_texture(name, image.clone(), options),
        };
        Self { image, texture: Some(texture) }
    }

    /// Draws the whole image into `rect`: nearest texel when enlarged, linear filter when reduced.
    pub fn draw(&self, painter: &Painter, slot: ImageSlot, rect: Rect) {
        if let Some(texture) = &self.texture {
            let all = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            painter.image(texture.id(), rect, all, Color32::WHITE);
            return;
        }
        let (part, uv) = visible_part(rect, painter.clip_rect(), painter.pixels_per_point());
        if part.is_positive() {
            let [width, height] = self.image.size.map(|side| side as f32);
            // Texels smaller than a screen pixel are filtered.
            let is_linear = rect.width() * painter.pixels_per_point() < width
                || rect.height() * painter.pixels_per_point() < height;
            let blit = blit::Blit { slot, image: self.image.clone(), uv, is_linear };
            painter.add(egui_wgpu::Callback::new_paint_callback(part, blit));
        }
    }
}

/// The part of `rect` within `clip`, snapped to screen pixels as paint callbacks need it, and the texture
/// coordinates of that part.
fn visible_part(rect: Rect, clip: Rect, pixels_per_point: f32) -> (Rect, Rect) {
    let snap = |points: f32| (points * pixels_per_point).round() / pixels_per_point;
    let part = rect.intersect(clip);
    let part = Rect::from_min_max(
        pos2(snap(part.left()), snap(part.top())),
        pos2(snap(part.right()), snap(part.bottom())),
    );
    let uv = |point: eframe::egui::Pos2| {
        pos2((point.x - rect.left()) / rect.width(), (point.y - rect.top()) / rect.height())
    };
    (part, Rect::from_min_max(uv(part.min), uv(part.max)))
}

/// egui's data has `true` under this id once [`register`] has made the pipeline.
fn pipeline_registered() -> Id {
    Id::unique("pipeline of images")
}

fn has_pipeline(context: &Context) -> bool {
    context.data(|data| data.get_temp::<bool>(pipeline_registered())).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use eframe::egui::vec2;

    use super::*;

    #[test]
    fn visible_part_has_matching_texture_coordinates() {
        let rect = Rect::from_min_size(pos2(-100.0, 20.0), vec2(400.0, 200.0));
        let clip = Rect::from_min_max(pos2(0.0, 0.0), pos2(200.0, 120.0));
        let (part, uv) = visible_part(rect, clip, 1.0);
        assert_eq!(part, Rect::from_min_max(pos2(0.0, 20.0), pos2(200.0, 120.0)));
        assert_eq!(uv, Rect::from_min_max(pos2(0.25, 0.0), pos2(0.75, 0.5)));
        // Off the pixel grid: texture coordinates are those of the snapped border.
        let (part, uv) = visible_part(rect.translate(vec2(0.3, 0.0)), rect.expand(1e3), 1.0);
        assert_eq!(part.left(), -100.0);
        assert!((uv.left() + 0.3 / 400.0).abs() < 1e-6, "{uv:?}");
        assert!(
            !visible_part(rect, clip.translate(vec2(1e3, 0.0)), 1.0).0.is_positive(),
            "outside the clip rectangle"
        );
    }
}
