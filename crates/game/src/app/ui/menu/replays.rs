//! The screen of the recordings in the current folder.

use crate::app::input::actions::Action;
use crate::app::ui::menu::choice::Choice;
use crate::app::ui::menu::window::Items;
use crate::app::ui::theme::{FAINT, text};
use bevy_egui::egui::{Button, RichText, Ui};
use std::path::PathBuf;
use std::time::SystemTime;

/// Most recordings that the screen lists.
const MOST: usize = 50;

/// The recordings in the current folder, the newest first.
pub fn list() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(".").into_iter().flatten().flatten();
    let replays = entries.filter(|entry| entry.path().extension().is_some_and(|end| end == "replay"));
    let written = |entry: &std::fs::DirEntry| entry.metadata().and_then(|about| about.modified());
    let mut replays: Vec<(SystemTime, PathBuf)> = replays
        .map(|entry| (written(&entry).unwrap_or(SystemTime::UNIX_EPOCH), PathBuf::from(entry.file_name())))
        .collect();
    replays.sort();
    replays.into_iter().rev().take(MOST).map(|(_, path)| path).collect()
}

/// Draws the screen.
pub fn draw(ui: &mut Ui, items: &mut Items, replays: &[PathBuf]) -> Choice {
    let mut choice = Choice::Stay;
    if replays.is_empty() {
        ui.label(text(14.0, FAINT, "There is no recording in this folder yet. The key for recording makes one."));
    }
    for path in replays {
        if items.add(ui, Button::new(RichText::new(path.display().to_string()).size(15.0))).clicked() {
            choice = Choice::Replay(path.clone());
        }
    }
    ui.add_space(6.0);
    if items.button(ui, "Longest runs on courses").clicked() {
        choice = Choice::Do(Action::Runs);
    }
    choice
}
