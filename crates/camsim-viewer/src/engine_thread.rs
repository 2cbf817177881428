//! Loading and rendering away from the window.

use std::{
    convert::Infallible,
    path::PathBuf,
    sync::mpsc::{Receiver, channel},
};

use camsim_core::{frame::RenderedFrame, scenario::Channel, scene::srgb_from_linear};
use camsim_gpu::{AdapterChoice, Engine};
use eframe::egui;

/// What the engine has to say.
pub enum Message {
    /// What it is busy with.
    Progress(String),
    /// A frame to show, and a line about it.
    Frame(Box<egui::ColorImage>, String),
    /// What went wrong.
    Failed(String),
}

/// Starts the engine on the first frame of a scenario.
pub fn start(context: egui::Context, path: PathBuf) -> Receiver<Message> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        // A closed window ends the conversation: nothing to do about a failed send.
        let say = |message| {
            let _ = sender.send(message);
            context.request_repaint();
        };
        say(Message::Progress(format!("loading {}", path.display())));
        match first_frame(&path, &say) {
            Ok(()) => {}
            Err(error) => say(Message::Failed(format!("{error:#}"))),
        }
    });
    receiver
}

fn first_frame(path: &std::path::Path, say: &dyn Fn(Message)) -> anyhow::Result<()> {
    let scenario = camsim_io::scenario_file::read_scenario(path, &[], None)?;
    let loaded = camsim_io::load::load_sequence(&scenario)?;
    say(Message::Progress("rendering the first frame".into()));
    let engine = Engine::new(AdapterChoice::Best)?;
    let mut session = engine.session::<Infallible>(loaded.sequence.clone(), &[Channel::Color])?;
    session.render::<Infallible>([0], &mut |finished| {
        let frame = &finished.frame;
        let caption = format!(
            "{}: frame 0 of {}, {}x{} px, on {}",
            path.display(),
            loaded.sequence.frames,
            frame.size_px[0],
            frame.size_px[1],
            engine.gpu().adapter
        );
        say(Message::Frame(Box::new(picture(frame)), caption));
        Ok(())
    })?;
    Ok(())
}

/// The frame as a screen shows it: sRGB, invalid pixels transparent.
fn picture(frame: &RenderedFrame) -> egui::ColorImage {
    let byte = |value: f32| (255.0 * srgb_from_linear(value.clamp(0.0, 1.0))).round() as u8;
    let rgba: Vec<u8> = frame
        .color_rgba
        .chunks_exact(4)
        .flat_map(|pixel| [byte(pixel[0]), byte(pixel[1]), byte(pixel[2]), (255.0 * pixel[3]) as u8])
        .collect();
    egui::ColorImage::from_rgba_unmultiplied(frame.size_px.map(|side| side as usize), &rgba)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_srgb_and_invalid_pixels_transparent() {
        let frame = RenderedFrame { size_px: [2, 1], color_rgba: vec![0.215_861, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0], ..Default::default() };
        let image = picture(&frame);
        assert_eq!(image.pixels[0].to_array(), [128, 0, 255, 255]);
        assert_eq!(image.pixels[1].a(), 0);
    }
}
