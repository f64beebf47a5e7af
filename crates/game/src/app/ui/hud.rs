//! Messages over the picture.

use crate::app::input::actions::{Action, ActionPressed};
use crate::app::mode::AppSet;
use crate::app::notifications::{Notification, Notifications};
use crate::app::pacing::IsVideo;
use crate::app::ui::theme::{BAD, Hud, TEXT, UiSet, card, text};
use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, Area, Id, Ui};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};

pub(super) fn plugin(app: &mut App) {
    app.add_systems(Update, switch.in_set(AppSet::Input))
        .add_systems(EguiPrimaryContextPass, draw.in_set(UiSet::Windows));
}

fn switch(mut actions: MessageReader<ActionPressed>, mut hud: ResMut<Hud>) {
    for ActionPressed(action) in actions.read() {
        match action {
            Action::Hud => hud.on = !hud.on,
            Action::Help => hud.help = !hud.help,
            _ => {}
        }
    }
}

/// Draws the messages. Without text and bars, only errors are shown; the console shows those of a video.
pub fn draw(
    mut contexts: EguiContexts,
    hud: Res<Hud>,
    notes: Res<Notifications>,
    recorded: Option<Res<IsVideo>>,
) -> Result {
    if hud.on || recorded.is_none() {
        show(contexts.ctx_mut()?, &notes, hud.on);
    }
    Ok(())
}

fn show(ctx: &egui::Context, notes: &Notifications, all: bool) {
    let shown = |note: &&Notification| all || note.error;
    if !notes.0.iter().any(|note| shown(&note)) {
        return;
    }
    Area::new(Id::new("notes")).anchor(Align2::CENTER_TOP, [0.0, 18.0]).interactable(false).show(ctx, |ui: &mut Ui| {
        for note in notes.0.iter().filter(shown) {
            card().show(ui, |ui| {
                ui.set_max_width(560.0);
                ui.label(text(14.0, if note.error { BAD } else { TEXT }, &note.text));
            });
            ui.add_space(4.0);
        }
    });
}
