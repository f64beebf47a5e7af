//! Actions that change time, the focus, the characters and the marks.

use crate::app::input::actions::{Action, ActionPressed};
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::{Actor, Focus, ShownMarks};
use crate::app::stage::clips::next_clip;
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::{LoadScenario, Scenario};
use crate::app::stage::selection::next_agent;
use bevy::prelude::*;
use bevy_marathon::RestartNow;

/// Speeds of time that the keys go through.
const SPEEDS: [f32; 8] = [0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];

/// Applies actions to time and scenario. Features that change the scenario come after it.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ControlSet;

pub(super) fn plugin(app: &mut App) {
    app.configure_sets(Update, ControlSet.in_set(AppSet::Input))
        .add_systems(Update, (control_time, change_scenario, change_view, quit).chain().in_set(ControlSet));
}

/// Pauses time, steps it by a frame, or changes its speed.
fn control_time(
    mut actions: MessageReader<ActionPressed>,
    mut time: ResMut<Time<Virtual>>,
    mut notes: ResMut<Notifications>,
    mut stepping: Local<bool>,
) {
    // a single step ends with the frame after it
    if *stepping {
        time.pause();
        *stepping = false;
    }
    for ActionPressed(action) in actions.read() {
        let now = SPEEDS.iter().position(|s| *s == time.relative_speed()).unwrap_or(3);
        match action {
            Action::Pause if time.is_paused() => time.unpause(),
            Action::Pause => time.pause(),
            Action::Step if time.is_paused() => {
                time.unpause();
                *stepping = true;
            }
            Action::Faster | Action::Slower => {
                let next =
                    if *action == Action::Faster { (now + 1).min(SPEEDS.len() - 1) } else { now.saturating_sub(1) };
                time.set_relative_speed(SPEEDS[next]);
                notes.say(format!("time x{}", SPEEDS[next]));
            }
            _ => {}
        }
    }
}

/// Restarts the characters, or switches to the next agent or clip.
fn change_scenario(
    mut actions: MessageReader<ActionPressed>,
    mut scenario: ResMut<Scenario>,
    shipped: Res<ShippedPolicies>,
    mut loads: MessageWriter<LoadScenario>,
    actors: Query<Entity, With<Actor>>,
    mut restarts: MessageWriter<RestartNow>,
    mut notes: ResMut<Notifications>,
) {
    for ActionPressed(action) in actions.read() {
        match action {
            Action::Restart if scenario.mode != Mode::Learn => {
                restarts.write_batch(actors.iter().map(|ragdoll| RestartNow { ragdoll }));
            }
            Action::NextAgent if scenario.mode.is_simulated() => {
                let changed = match scenario.mode {
                    Mode::Imitate => next_clip(&mut scenario, &shipped, &mut notes),
                    _ => next_agent(&mut scenario, &shipped),
                };
                if changed {
                    loads.write(LoadScenario);
                }
            }
            _ => {}
        }
    }
}

/// Focuses on the next character, and switches marks.
fn change_view(
    mut actions: MessageReader<ActionPressed>,
    mut focus: ResMut<Focus>,
    mut shown: ResMut<ShownMarks>,
    actors: Query<(), With<Actor>>,
) {
    for ActionPressed(action) in actions.read() {
        match action {
            Action::NextFocus => focus.0 = (focus.0 + 1) % actors.iter().count().max(1),
            Action::Contacts => shown.contacts = !shown.contacts,
            Action::Joints => shown.joints = !shown.joints,
            _ => {}
        }
    }
}

fn quit(mut actions: MessageReader<ActionPressed>, mut exit: MessageWriter<AppExit>) {
    if actions.read().filter(|action| action.0 == Action::Quit).count() > 0 {
        info!("bye");
        exit.write(AppExit::Success);
    }
}
