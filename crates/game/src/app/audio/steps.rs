//! Sounds of the characters: steps, landings, falls, and the crowd at the end of a course.

use crate::app::audio::PlaySound;
use crate::app::audio::synth::Sound;
use crate::app::mode::Mode;
use crate::app::stage::actors::Actor;
use bevy::prelude::*;
use bevy_marathon::{CharacterPose, EpisodeEnded, Fell, FootContact, Landed, MarathonSystems, RagdollMode};
use marathon_envs::agents::marathon::terrain::course::TO;
use std::time::Duration;

/// Shortest time between two steps of a character that are heard, s.
const APART: f64 = 0.08;
/// Time in the air from which on a landing is heard, s. Shorter flights are those of a run.
const FLIGHT: f64 = 0.3;
/// Speed of a foot at which its step has full loudness, m/s, and the least loudness.
const FULL: f32 = 4.0;
const QUIET: f32 = 0.25;
/// Distance before the end of a course from which on it counts as run, m.
const FINISH: f64 = 2.0;

/// Time of a character's last step.
#[derive(Component, Clone, Copy, Debug, Default)]
struct LastStep(Duration);

pub(super) fn plugin(app: &mut App) {
    app.add_systems(Update, listen)
        .add_systems(FixedUpdate, (hear_feet, hear_landings, hear_falls, hear_finish).after(MarathonSystems::Report));
}

/// Listens to new characters.
fn listen(mut commands: Commands, new: Query<Entity, (With<Actor>, Without<LastStep>)>) {
    for actor in &new {
        commands.entity(actor).insert(LastStep::default());
    }
}

fn hear_feet(
    time: Res<Time<Fixed>>,
    mut contacts: MessageReader<FootContact>,
    mut actors: Query<(&RagdollMode, &mut LastStep)>,
    mut sounds: MessageWriter<PlaySound>,
) {
    let now = time.elapsed();
    for contact in contacts.read().filter(|contact| contact.down) {
        let Ok((mode, mut last)) = actors.get_mut(contact.ragdoll) else { continue };
        let early = now.saturating_sub(last.0).as_secs_f64() < APART && last.0 > Duration::ZERO;
        if early || *mode != RagdollMode::Powered {
            continue;
        }
        last.0 = now;
        let loudness = QUIET + (1.0 - QUIET) * (contact.speed / FULL).sqrt();
        sounds.write(PlaySound { sound: Sound::Step, at: Some(contact.point), loudness: loudness.min(1.0) });
    }
}

fn hear_landings(
    mut landings: MessageReader<Landed>,
    poses: Query<&CharacterPose>,
    mut sounds: MessageWriter<PlaySound>,
) {
    for landed in landings.read().filter(|landed| landed.seconds >= FLIGHT) {
        let at = poses.get(landed.ragdoll).ok().map(|pose| pose.position);
        sounds.write(PlaySound { sound: Sound::Landing, at, loudness: (0.5 + landed.seconds as f32).min(1.0) });
    }
}

fn hear_falls(mut falls: MessageReader<Fell>, poses: Query<&CharacterPose>, mut sounds: MessageWriter<PlaySound>) {
    for fell in falls.read() {
        let at = poses.get(fell.ragdoll).ok().map(|pose| pose.position);
        sounds.write(PlaySound { sound: Sound::Landing, at, loudness: 0.9 });
    }
}

/// The crowd cheers when a character reaches the end of a course.
fn hear_finish(mode: Res<State<Mode>>, mut ended: MessageReader<EpisodeEnded>, mut sounds: MessageWriter<PlaySound>) {
    let through = ended.read().filter(|e| *mode == Mode::Course && e.episode.farthest > TO - FINISH).count();
    if through > 0 {
        sounds.write(PlaySound { sound: Sound::Crowd, at: None, loudness: 0.8 });
    }
}
