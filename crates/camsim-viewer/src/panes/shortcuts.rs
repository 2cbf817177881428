//! Keyboard shortcuts, and the window that lists them.

use eframe::egui::{self, Context, Event, Key, KeyboardShortcut, Modifiers};

use super::menu;
use crate::{
    message::{Message, Outbox},
    state::State,
    view::{Compare, View},
};

/// A shortcut.
struct Shortcut {
    keys: KeyboardShortcut,
    /// Text in the list.
    description: &'static str,
    /// The message that it sends; `None` if it does not apply.
    message: fn(&State) -> Option<Message>,
    /// Whether a held key repeats it.
    repeats: bool,
}

const fn plain(key: Key, description: &'static str, message: fn(&State) -> Option<Message>) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::NONE, key), description, message, repeats: false }
}

const fn command(
    modifiers: Modifiers,
    key: Key,
    description: &'static str,
    message: fn(&State) -> Option<Message>,
) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(modifiers, key), description, message, repeats: false }
}

/// A shortcut that repeats while its key is held.
const fn repeating(shortcut: Shortcut) -> Shortcut {
    Shortcut { repeats: true, ..shortcut }
}

/// All shortcuts, with combinations before the keys that they contain.
const SHORTCUTS: &[Shortcut] = &[
    command(Modifiers::COMMAND, Key::O, "open a scenario", |state| {
        Some(Message::Prompt(Some(menu::open_prompt(state))))
    }),
    command(Modifiers::COMMAND, Key::S, "save the scenario", |state| {
        state.document.as_ref().map(|document| Message::Prompt(Some(menu::save_prompt(document))))
    }),
    repeating(command(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z, "redo", |_| Some(Message::Redo))),
    repeating(command(Modifiers::COMMAND, Key::Z, "undo", |_| Some(Message::Undo))),
    repeating(command(Modifiers::COMMAND, Key::Y, "redo", |_| Some(Message::Redo))),
    repeating(command(Modifiers::SHIFT, Key::ArrowLeft, "back by ten frames", |_| Some(Message::Step(-10)))),
    repeating(command(Modifiers::SHIFT, Key::ArrowRight, "on by ten frames", |_| Some(Message::Step(10)))),
    plain(Key::Space, "play or stop", |_| Some(Message::TogglePlay)),
    repeating(plain(Key::ArrowLeft, "back by one frame", |_| Some(Message::Step(-1)))),
    repeating(plain(Key::ArrowRight, "on by one frame", |_| Some(Message::Step(1)))),
    plain(Key::Home, "to the first frame", |_| Some(Message::Seek(0))),
    plain(Key::End, "to the last frame", |state| Some(Message::Seek(state.timeline.last()))),
    plain(Key::F, "fit the picture into the pane", |state| view(state, |view| view.zoom = None)),
    plain(Key::Num1, "a pixel of the screen for each pixel of the picture", |state| {
        view(state, |view| view.zoom = Some(1.0))
    }),
    plain(Key::W, "wipe between A and B, or A alone", |state| {
        view(state, |view| {
            view.compare = if view.compare == Compare::Wipe { Compare::Single } else { Compare::Wipe }
        })
    }),
    plain(Key::D, "difference of A and B, or A alone", |state| {
        view(state, |view| {
            view.compare =
                if view.compare == Compare::Difference { Compare::Single } else { Compare::Difference }
        })
    }),
    plain(Key::X, "swap A and B", |state| view(state, |view| std::mem::swap(&mut view.a, &mut view.b))),
    plain(Key::I, "mark invalid pixels", |state| {
        view(state, |view| view.overlays.invalid = !view.overlays.invalid)
    }),
    plain(Key::G, "distortion grid", |state| view(state, |view| view.overlays.grid = !view.overlays.grid)),
    plain(Key::M, "motion", |state| view(state, |view| view.overlays.motion = !view.overlays.motion)),
    plain(Key::Questionmark, "this list", |state| Some(Message::ShowShortcuts(!state.shows_shortcuts))),
    plain(Key::Escape, "close this list; unpin the pixel", |state| {
        Some(if state.shows_shortcuts { Message::ShowShortcuts(false) } else { Message::Pin(None) })
    }),
];

fn view(state: &State, change: impl FnOnce(&mut View)) -> Option<Message> {
    let mut view = state.view.clone();
    change(&mut view);
    Some(Message::View(view))
}

/// Applies the messages of key presses one by one, in order: several may arrive in one pass, and each starts
/// from the state that the one before left. Text fields and prompts take keys first.
pub fn listen(context: &Context, state: &mut State) {
    let mut from = 0;
    while !keys_are_taken(context, state)
        && let Some((index, shortcut, is_repeat)) = take_next(context, from)
    {
        // The event was removed: the next one has its index.
        from = index;
        if (shortcut.repeats || !is_repeat)
            && let Some(message) = (shortcut.message)(state)
        {
            state.apply(message, context);
        }
    }
}

/// Whether a text field or a prompt takes the keys.
fn keys_are_taken(context: &Context, state: &State) -> bool {
    context.egui_wants_keyboard_input()
        || state.path_prompt.is_some()
        || state.dropped_picture.is_some()
        || state.unsaved_prompt.is_some()
}

/// Removes the first press of a shortcut's keys from the events, at or after index `from`; returns its index,
/// and whether a held key repeated it.
fn take_next(context: &Context, from: usize) -> Option<(usize, &'static Shortcut, bool)> {
    context.input_mut(|input| {
        let press = input.events.iter().enumerate().skip(from).find_map(|(index, event)| match event {
            Event::Key { key, modifiers, pressed: true, repeat, .. } => {
                let matches = |keys: &KeyboardShortcut| {
                    keys.logical_key == *key && modifiers.matches_logically(keys.modifiers)
                };
                SHORTCUTS
                    .iter()
                    .find(|shortcut| matches(&shortcut.keys))
                    .map(|shortcut| (index, shortcut, *repeat))
            }
            _ => None,
        })?;
        input.events.remove(press.0);
        Some(press)
    })
}

/// Draws the list of shortcuts.
pub fn window(context: &Context, state: &State, out: &mut Outbox) {
    let mut open = state.shows_shortcuts;
    let window = egui::Window::new("Keyboard shortcuts").open(&mut open).collapsible(false).resizable(false);
    window.anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO).show(context, |ui| {
        egui::Grid::new("shortcuts").num_columns(2).striped(true).show(ui, |ui| {
            for shortcut in SHORTCUTS {
                let question_mark = shortcut.keys.logical_key == Key::Questionmark;
                ui.monospace(if question_mark {
                    "?".to_owned()
                } else {
                    context.format_shortcut(&shortcut.keys)
                });
                ui.label(shortcut.description);
                ui.end_row();
            }
        });
        ui.label(
            "Wheel: zoom at the cursor. Drag: pan. Click: pin the pixel in the inspector. Double click: fit.",
        );
    });
    if open != state.shows_shortcuts {
        out.push(Message::ShowShortcuts(open));
    }
}
