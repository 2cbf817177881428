//! Colours of texts, by contrast.

use eframe::egui::{Color32, Context, Theme, Visuals};

/// Grey of texts and of dim ones, by theme. egui's own dim texts have a contrast of 2.7.
const GREYS: [(Theme, [u8; 2]); 2] = [(Theme::Dark, [190, 150]), (Theme::Light, [50, 95])];

/// Sets the colours of a context.
pub fn install(context: &Context) {
    for (theme, greys) in GREYS {
        context.style_mut_of(theme, |style| set(&mut style.visuals, greys.map(Color32::from_gray)));
    }
}

fn set(visuals: &mut Visuals, [text, dim]: [Color32; 2]) {
    visuals.widgets.noninteractive.fg_stroke.color = text;
    visuals.weak_text_color = Some(dim);
    if visuals.dark_mode {
        visuals.error_fg_color = Color32::from_rgb(255, 90, 90);
    } else {
        visuals.warn_fg_color = Color32::from_rgb(150, 80, 0);
        visuals.error_fg_color = Color32::from_rgb(190, 0, 0);
        visuals.hyperlink_color = Color32::from_rgb(0, 100, 190);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance (WCAG 2).
    fn luminance(color: Color32) -> f64 {
        let linear = [color.r(), color.g(), color.b()].map(|code| {
            let value = f64::from(code) / 255.0;
            if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    }

    #[test]
    fn all_texts_have_a_contrast_of_four_and_a_half() {
        let context = Context::default();
        install(&context);
        for theme in [Theme::Dark, Theme::Light] {
            let visuals = context.style_of(theme).visuals.clone();
            let texts = [
                ("text", visuals.text_color()),
                ("dim text", visuals.weak_text_color()),
                ("warning", visuals.warn_fg_color),
                ("error", visuals.error_fg_color),
                ("changed key", visuals.hyperlink_color),
            ];
            let background = luminance(visuals.panel_fill);
            for (name, color) in texts {
                let (low, high) = (background.min(luminance(color)), background.max(luminance(color)));
                let contrast = (high + 0.05) / (low + 0.05);
                assert!(contrast >= 4.5, "{theme:?}, {name}: {contrast:.2}");
            }
        }
    }
}
