//! Keys, and the window that lists them.

use eframe::egui::{self, Context, Event, Key, KeyboardShortcut, Modifiers};

use super::menu;
use crate::{
    message::{Message, Outbox},
    state::State,
    view::{Compare, View},
};

/// What a key does.
struct Shortcut {
    keys: KeyboardShortcut,
    what: &'static str,
    wish: fn(&State) -> Option<Message>,
    /// Whether a key that is held down goes on and on.
    repeats: bool,
}

const fn plain(key: Key, what: &'static str, wish: fn(&State) -> Option<Message>) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::NONE, key), what, wish, repeats: false }
}

const fn command(
    modifiers: Modifiers,
    key: Key,
    what: &'static str,
    wish: fn(&State) -> Option<Message>,
) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(modifiers, key), what, wish, repeats: false }
}

/// Goes on as long as its key is held.
const fn held(shortcut: Shortcut) -> Shortcut {
    Shortcut { repeats: true, ..shortcut }
}

/// Combinations stand before the keys that they contain.
const SHORTCUTS: &[Shortcut] = &[
    command(Modifiers::COMMAND, Key::O, "open a scenario", |state| {
        Some(Message::Ask(Some(menu::open_question(state))))
    }),
    command(Modifiers::COMMAND, Key::S, "save the scenario", |state| {
        state.document.as_ref().map(|document| Message::Ask(Some(menu::save_question(document))))
    }),
    held(command(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z, "redo", |_| Some(Message::Redo))),
    held(command(Modifiers::COMMAND, Key::Z, "undo", |_| Some(Message::Undo))),
    held(command(Modifiers::COMMAND, Key::Y, "redo", |_| Some(Message::Redo))),
    held(command(Modifiers::SHIFT, Key::ArrowLeft, "back by ten frames", |_| Some(Message::Step(-10)))),
    held(command(Modifiers::SHIFT, Key::ArrowRight, "on by ten frames", |_| Some(Message::Step(10)))),
    plain(Key::Space, "play or stop", |_| Some(Message::TogglePlay)),
    held(plain(Key::ArrowLeft, "back by one frame", |_| Some(Message::Step(-1)))),
    held(plain(Key::ArrowRight, "on by one frame", |_| Some(Message::Step(1)))),
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
    plain(Key::X, "exchange A and B", |state| view(state, |view| std::mem::swap(&mut view.a, &mut view.b))),
    plain(Key::I, "mark invalid pixels", |state| {
        view(state, |view| view.overlays.invalid = !view.overlays.invalid)
    }),
    plain(Key::G, "distortion grid", |state| view(state, |view| view.overlays.grid = !view.overlays.grid)),
    plain(Key::M, "motion", |state| view(state, |view| view.overlays.motion = !view.overlays.motion)),
    plain(Key::Questionmark, "this list", |state| Some(Message::Help(!state.help))),
    plain(Key::Escape, "close what is open; let the pixel go", |state| {
        Some(if state.help { Message::Help(false) } else { Message::Pin(None) })
    }),
];

fn view(state: &State, change: impl FnOnce(&mut View)) -> Option<Message> {
    let mut view = state.view.clone();
    change(&mut view);
    Some(Message::View(view))
}

/// Does what keys say, each press on its own and in order: many may arrive in one pass, and the second of two
/// presses goes on from what the first one did. Keys go to text that is being typed, or to windows that are
/// open, first.
pub fn listen(context: &Context, state: &mut State) {
    let mut from = 0;
    while !is_typed_elsewhere(context, state)
        && let Some((at, shortcut, is_repeat)) = next(context, from)
    {
        // What was taken is gone: the next one is in its place.
        from = at;
        if (shortcut.repeats || !is_repeat)
            && let Some(message) = (shortcut.wish)(state)
        {
            state.apply(message, context);
        }
    }
}

fn is_typed_elsewhere(context: &Context, state: &State) -> bool {
    context.egui_wants_keyboard_input()
        || state.question.is_some()
        || state.dropped_picture.is_some()
        || state.leaving.is_some()
}

/// Takes the first press of a shortcut's keys at or behind `from` out of what came in; where it was, and
/// whether it is the repeat of a key that is held.
fn next(context: &Context, from: usize) -> Option<(usize, &'static Shortcut, bool)> {
    context.input_mut(|input| {
        let found = input.events.iter().enumerate().skip(from).find_map(|(at, event)| match event {
            Event::Key { key, modifiers, pressed: true, repeat, .. } => {
                let is_meant = |keys: &KeyboardShortcut| {
                    keys.logical_key == *key && modifiers.matches_logically(keys.modifiers)
                };
                SHORTCUTS
                    .iter()
                    .find(|shortcut| is_meant(&shortcut.keys))
                    .map(|shortcut| (at, shortcut, *repeat))
            }
            _ => None,
        })?;
        input.events.remove(found.0);
        Some(found)
    })
}

/// The list.
pub fn window(context: &Context, state: &State, out: &mut Outbox) {
    let mut open = state.help;
    let window = egui::Window::new("Keyboard shortcuts").open(&mut open).collapsible(false).resizable(false);
    window.anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO).show(context, |ui| {
        egui::Grid::new("shortcuts").num_columns(2).striped(true).show(ui, |ui| {
            for shortcut in SHORTCUTS {
                let question_mark = shortcut.keys.logical_key == Key::Questionmark;
                ui.monospace(if question_mark { "?".to_owned() } else { context.format_shortcut(&shortcut.keys) });
                ui.label(shortcut.what);
                ui.end_row();
            }
        });
        ui.label("Wheel: zoom at the cursor. Drag: pan. Click: keep the pixel in the inspector. Double click: fit.");
    });
    if open != state.help {
        out.push(Message::Help(open));
    }
}
