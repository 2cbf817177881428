//! Pictures on the screen.
//!
//! egui draws all rectangles by one shader, which computes two ways of filtering for each pixel and blends by
//! the vertices' colours. On a software adapter that is the larger part of a pass with a picture in it. A
//! picture needs none of it: here it has a pipeline of its own that reads a texel and is done. Where the
//! window's format is not the one that codes can be written to as they are, or there is no such window (a
//! test's), egui draws it after all.

mod blit;

use std::sync::Arc;

use eframe::{
    egui::{
        Color32, ColorImage, Context, Id, Painter, Rect, TextureFilter, TextureHandle, TextureOptions, pos2,
    },
    egui_wgpu,
};

pub use blit::register;

/// Where on the screen a picture is drawn: two places in one pass need two textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Place {
    /// The first picture, or the only one.
    A,
    /// The second one of a pair.
    B,
}

/// A picture that can be drawn.
#[derive(Clone)]
pub struct Sheet {
    image: Arc<ColorImage>,
    /// On egui's own device, where egui draws it.
    texture: Option<TextureHandle>,
}

impl Sheet {
    /// In place of `old`, which is no longer needed.
    pub fn new(context: &Context, name: &str, image: Arc<ColorImage>, old: Option<Self>) -> Self {
        if blits(context) {
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

    /// Draws all of it into `rect`. Pixels stay pixels when enlarged.
    pub fn draw(&self, painter: &Painter, place: Place, rect: Rect) {
        if let Some(texture) = &self.texture {
            let all = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            painter.image(texture.id(), rect, all, Color32::WHITE);
            return;
        }
        let (seen, uv) = visible(rect, painter.clip_rect(), painter.pixels_per_point());
        if seen.is_positive() {
            let [width, height] = self.image.size.map(|side| side as f32);
            // Texels smaller than a pixel of the screen are averaged.
            let smooth = rect.width() * painter.pixels_per_point() < width
                || rect.height() * painter.pixels_per_point() < height;
            let blit = blit::Blit { place, image: self.image.clone(), uv, smooth };
            painter.add(egui_wgpu::Callback::new_paint_callback(seen, blit));
        }
    }
}

/// The part of `rect` within `clip`, on borders of the screen's pixels (callbacks have no others), and the
/// part of the picture that lies there.
fn visible(rect: Rect, clip: Rect, pixels_per_point: f32) -> (Rect, Rect) {
    let snap = |at: f32| (at * pixels_per_point).round() / pixels_per_point;
    let seen = rect.intersect(clip);
    let seen = Rect::from_min_max(
        pos2(snap(seen.left()), snap(seen.top())),
        pos2(snap(seen.right()), snap(seen.bottom())),
    );
    let share = |at: eframe::egui::Pos2| {
        pos2((at.x - rect.left()) / rect.width(), (at.y - rect.top()) / rect.height())
    };
    (seen, Rect::from_min_max(share(seen.min), share(seen.max)))
}

fn flag() -> Id {
    Id::unique("pictures have a pipeline of their own")
}

fn blits(context: &Context) -> bool {
    context.data(|data| data.get_temp::<bool>(flag())).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use eframe::egui::vec2;

    use super::*;

    #[test]
    fn what_is_seen_of_a_picture_is_where_it_was() {
        let rect = Rect::from_min_size(pos2(-100.0, 20.0), vec2(400.0, 200.0));
        let clip = Rect::from_min_max(pos2(0.0, 0.0), pos2(200.0, 120.0));
        let (seen, uv) = visible(rect, clip, 1.0);
        assert_eq!(seen, Rect::from_min_max(pos2(0.0, 20.0), pos2(200.0, 120.0)));
        assert_eq!(uv, Rect::from_min_max(pos2(0.25, 0.0), pos2(0.75, 0.5)));
        // Between two pixels of the screen: what lies on the snapped border is told, not what would lie on
        // the other.
        let (seen, uv) = visible(rect.translate(vec2(0.3, 0.0)), rect.expand(1e3), 1.0);
        assert_eq!(seen.left(), -100.0);
        assert!((uv.left() + 0.3 / 400.0).abs() < 1e-6, "{uv:?}");
        assert!(!visible(rect, clip.translate(vec2(1e3, 0.0)), 1.0).0.is_positive(), "out of sight");
    }
}
