//! The desktop's file dialog, which runs while the window goes on.

use std::{
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, TryRecvError, channel},
    time::{Duration, Instant},
};

use eframe::egui::Context;

/// A dialog that is dismissed sooner was never shown.
const MIN_SHOWN: Duration = Duration::from_millis(250);

/// A dialog that was requested.
#[derive(Debug)]
pub struct FileDialog {
    saves: bool,
    opened: Instant,
    answer: Receiver<Option<PathBuf>>,
}

/// How the dialog ended.
#[derive(Debug, PartialEq, Eq)]
pub enum DialogResult {
    /// The file chosen; `true` for a file to save to.
    Chosen(PathBuf, bool),
    /// The user dismissed it.
    Dismissed,
    /// The desktop has no file dialog.
    NoDialog,
}

impl FileDialog {
    /// Opens a dialog for a scenario to open or to save to, beginning at `start`. It is made on the window's
    /// thread, as some systems require, and awaited on another.
    pub fn open(saves: bool, start: &Path, context: &Context) -> Self {
        let (folder, name) =
            if start.is_dir() { (Some(start), None) } else { (start.parent(), start.file_name()) };
        let mut dialog = rfd::AsyncFileDialog::new().add_filter("scenario", &["toml"]);
        if let Some(folder) = folder.filter(|folder| folder.is_dir()) {
            dialog = dialog.set_directory(std::path::absolute(folder).unwrap_or_else(|_| folder.into()));
        }
        if saves {
            dialog = dialog
                .set_file_name(name.map_or_else(|| "scenario.toml".into(), |name| name.to_string_lossy()));
            Self::wait_for(saves, dialog.save_file(), context)
        } else {
            Self::wait_for(saves, dialog.pick_file(), context)
        }
    }

    fn wait_for(
        saves: bool,
        dialog: impl Future<Output = Option<rfd::FileHandle>> + Send + 'static,
        context: &Context,
    ) -> Self {
        let (sender, answer) = channel();
        let context = context.clone();
        let wait = move || {
            // The window may have been closed.
            let _ = sender.send(pollster::block_on(dialog).map(|file| file.path().to_path_buf()));
            context.request_repaint();
        };
        // If no thread can be started, the sender is dropped, which counts as no dialog.
        let _ = std::thread::Builder::new().name("camsim dialog".into()).spawn(wait);
        Self { saves, opened: Instant::now(), answer }
    }

    /// The result, once there is one.
    pub fn result(&self) -> Option<DialogResult> {
        match self.answer.try_recv() {
            Ok(Some(path)) => Some(DialogResult::Chosen(path, self.saves)),
            Ok(None) if self.opened.elapsed() > MIN_SHOWN => Some(DialogResult::Dismissed),
            Ok(None) | Err(TryRecvError::Disconnected) => Some(DialogResult::NoDialog),
            Err(TryRecvError::Empty) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result_of(answer: Option<Option<PathBuf>>, after: Duration) -> Option<DialogResult> {
        let (sender, receiver) = channel();
        let opened = Instant::now().checked_sub(after).expect("a clock that has run");
        let dialog = FileDialog { saves: true, opened, answer: receiver };
        let result = match answer {
            Some(answer) => {
                sender.send(answer).expect("open");
                dialog.result()
            }
            None => dialog.result(),
        };
        drop(sender);
        result
    }

    #[test]
    fn a_missing_dialog_is_distinguished_from_a_dismissed_one() {
        assert_eq!(result_of(None, Duration::ZERO), None, "still open");
        assert_eq!(result_of(Some(None), Duration::ZERO), Some(DialogResult::NoDialog));
        assert_eq!(result_of(Some(None), Duration::from_secs(3)), Some(DialogResult::Dismissed));
        let path = PathBuf::from("a.toml");
        assert_eq!(
            result_of(Some(Some(path.clone())), Duration::ZERO),
            Some(DialogResult::Chosen(path, true))
        );
    }
}
