//! The desktop's own file dialog, beside the window: it is answered some time later, or never.

use std::{
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, TryRecvError, channel},
    time::{Duration, Instant},
};

use eframe::egui::Context;

/// Nobody sees a dialog and dismisses it in less: there was none.
const NOBODY_SO_QUICK: Duration = Duration::from_millis(250);

/// A dialog that was asked for.
#[derive(Debug)]
pub struct Browse {
    saves: bool,
    asked: Instant,
    answer: Receiver<Option<PathBuf>>,
}

/// How it went.
#[derive(Debug, PartialEq, Eq)]
pub enum Answer {
    /// A file to open (`false`) or to save to (`true`).
    Chosen(PathBuf, bool),
    /// It was dismissed.
    Dismissed,
    /// It never came up.
    NoDialog,
}

impl Browse {
    /// Asks for a scenario to open, or where to save one. Some systems want the dialog made where the window
    /// is, and none wants the window to wait.
    pub fn ask(saves: bool, start: &Path, context: &Context) -> Self {
        let (folder, name) =
            if start.is_dir() { (Some(start), None) } else { (start.parent(), start.file_name()) };
        let mut dialog = rfd::AsyncFileDialog::new().add_filter("scenario", &["toml"]);
        if let Some(folder) = folder.filter(|folder| folder.is_dir()) {
            dialog = dialog.set_directory(std::path::absolute(folder).unwrap_or_else(|_| folder.into()));
        }
        if saves {
            dialog = dialog
                .set_file_name(name.map_or_else(|| "scenario.toml".into(), |name| name.to_string_lossy()));
            Self::waiting(saves, dialog.save_file(), context)
        } else {
            Self::waiting(saves, dialog.pick_file(), context)
        }
    }

    fn waiting(
        saves: bool,
        dialog: impl Future<Output = Option<rfd::FileHandle>> + Send + 'static,
        context: &Context,
    ) -> Self {
        let (sender, answer) = channel();
        let context = context.clone();
        let wait = move || {
            // The window may be gone by then.
            let _ = sender.send(pollster::block_on(dialog).map(|file| file.path().to_path_buf()));
            context.request_repaint();
        };
        // Without a thread the sender is gone, which reads as no dialog.
        let _ = std::thread::Builder::new().name("camsim dialog".into()).spawn(wait);
        Self { saves, asked: Instant::now(), answer }
    }

    /// The answer, once there is one.
    pub fn answer(&self) -> Option<Answer> {
        match self.answer.try_recv() {
            Ok(Some(path)) => Some(Answer::Chosen(path, self.saves)),
            Ok(None) if self.asked.elapsed() > NOBODY_SO_QUICK => Some(Answer::Dismissed),
            Ok(None) | Err(TryRecvError::Disconnected) => Some(Answer::NoDialog),
            Err(TryRecvError::Empty) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answered(answer: Option<Option<PathBuf>>, after: Duration) -> Option<Answer> {
        let (sender, receiver) = channel();
        let asked = Instant::now().checked_sub(after).expect("a clock that has run");
        let browse = Browse { saves: true, asked, answer: receiver };
        let found = match answer {
            Some(answer) => {
                sender.send(answer).expect("open");
                browse.answer()
            }
            None => browse.answer(),
        };
        drop(sender);
        found
    }

    #[test]
    fn a_dialog_that_never_came_is_told_from_one_that_was_dismissed() {
        assert_eq!(answered(None, Duration::ZERO), None, "still open");
        assert_eq!(answered(Some(None), Duration::ZERO), Some(Answer::NoDialog));
        assert_eq!(answered(Some(None), Duration::from_secs(3)), Some(Answer::Dismissed));
        let path = PathBuf::from("a.toml");
        assert_eq!(answered(Some(Some(path.clone())), Duration::ZERO), Some(Answer::Chosen(path, true)));
    }
}
