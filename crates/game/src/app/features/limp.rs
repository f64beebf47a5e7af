//! Limp characters: a key takes the strength of all motors away, and the same key gives it back, so that they get up.

use crate::app::input::actions::{Action, ActionPressed};
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::{Actor, Focus};
use crate::app::ui::status::StatusLines;
use crate::app::ui::theme::ACCENT;
use bevy::prelude::*;
use bevy_marathon::{Anatomy, Physique};
use marathon_physics::Variation;

/// On a limp character: the physics that it gets back.
#[derive(Component, Clone, Debug)]
pub struct Limp(Variation);

pub(super) fn plugin(app: &mut App) {
    app.add_systems(Update, (toggle, stay_limp, report).chain().in_set(AppSet::Present));
}

/// Makes the character in focus limp, or strong again.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn toggle(
    mut commands: Commands,
    mut actions: MessageReader<ActionPressed>,
    (mode, focus): (Res<State<Mode>>, Res<Focus>),
    actors: Query<(Entity, &Actor, &Anatomy, Option<&Physique>, Option<&Limp>)>,
    mut notes: ResMut<Notifications>,
) {
    for _ in actions.read().filter(|action| action.0 == Action::Limp) {
        let Some((ragdoll, _, anatomy, physique, limp)) = actors.iter().find(|(_, a, ..)| a.0 == focus.0) else {
            continue;
        };
        // runs on a course are compared, and other programs move the rest
        if !mode.is_simulated() || *mode == Mode::Course {
            notes.say("limp: not in this mode");
            continue;
        }
        let mut ragdoll = commands.entity(ragdoll);
        match limp {
            Some(Limp(before)) => {
                ragdoll.insert(Physique(before.clone())).remove::<Limp>();
            }
            None => {
                let before = physique.map_or_else(|| Variation::none(&anatomy.model), |physique| physique.0.clone());
                ragdoll.insert((Physique(slack(&before)), Limp(before)));
            }
        }
    }
}

/// The same physics without strength.
fn slack(variation: &Variation) -> Variation {
    let mut slack = variation.clone();
    slack.strength.fill(0.0);
    slack
}

/// Other gravity or friction may come while a character is limp.
fn stay_limp(mut limp: Query<(&mut Limp, &mut Physique), Changed<Physique>>) {
    for (mut limp, mut physique) in &mut limp {
        if physique.0.strength.iter().any(|strength| *strength != 0.0) {
            limp.0 = physique.0.clone();
            physique.0 = slack(&limp.0);
        }
    }
}

/// Shows that the character in focus is limp.
fn report(focus: Res<Focus>, limp: Query<&Actor, With<Limp>>, mut lines: ResMut<StatusLines>) {
    if limp.iter().any(|actor| actor.0 == focus.0) {
        lines.0.push((ACCENT, "limp".into()));
    }
}
