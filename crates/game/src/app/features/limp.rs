//! Limp characters: a key takes the strength of all motors away, and the same key gives it back, so that they get up.

use crate::app::input::actions::{Action, ActionPressed};
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::{Actor, Focus};
use crate::app::ui::status::StatusLines;
use crate::app::ui::theme::ACCENT;
use bevy::prelude::*;
use bevy_marathon::RagdollMode;

pub(super) fn plugin(app: &mut App) {
    app.add_systems(Update, (toggle, report).chain().in_set(AppSet::Present));
}

/// Makes the character in focus limp, or strong again.
fn toggle(
    mut actions: MessageReader<ActionPressed>,
    (mode, focus): (Res<State<Mode>>, Res<Focus>),
    mut actors: Query<(&Actor, &mut RagdollMode)>,
    mut notes: ResMut<Notifications>,
) {
    for _ in actions.read().filter(|action| action.0 == Action::Limp) {
        let Some((_, mut strength)) = actors.iter_mut().find(|(actor, _)| actor.0 == focus.0) else { continue };
        // runs on a course are compared, and other programs move the rest
        if !mode.is_simulated() || *mode == Mode::Course {
            notes.say("limp: not in this mode");
            continue;
        }
        *strength = if *strength == RagdollMode::Limp { RagdollMode::Powered } else { RagdollMode::Limp };
    }
}

/// Shows that the character in focus is limp, or gets up.
fn report(focus: Res<Focus>, actors: Query<(&Actor, &RagdollMode)>, mut lines: ResMut<StatusLines>) {
    let words = actors.iter().filter(|(actor, _)| actor.0 == focus.0).filter_map(|(_, mode)| match mode {
        RagdollMode::Limp => Some("limp"),
        RagdollMode::GettingUp => Some("gets up"),
        _ => None,
    });
    lines.0.extend(words.map(|word| (ACCENT, word.into())));
}
