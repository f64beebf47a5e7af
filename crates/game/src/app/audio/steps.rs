//! Sounds of the characters: steps, landings, falls, and the crowd at the end of a course.

use crate::app::audio::PlaySound;
use crate::app::audio::synth::Sound;
use crate::app::mode::Mode;
use crate::app::stage::actors::Actor;
use bevy::prelude::*;
use bevy_marathon::{Anatomy, End, Episode, EpisodeEnded, FootContact, MarathonSystems};
use marathon_envs::agents::marathon::terrain::course::TO;
use std::time::Duration;

/// Shortest time between two steps of a character that are heard, s.
const APART: f64 = 0.08;
/// Time without ground from which on a step is a landing, s.
const FLIGHT: f64 = 0.3;
/// Speed at which steps have their full loudness, m/s, and the loudness of a step on the spot.
const FULL: f32 = 4.0;
const QUIET: f32 = 0.25;
/// Distance before the end of a course from which on it counts as run, m.
const FINISH: f64 = 2.0;

/// The latest sounds of a character.
#[derive(Component, Clone, Copy, Debug, Default)]
struct Heard {
    /// Time of the last step.
    step: Duration,
    /// Since when it has had no foot on the ground.
    flying: Option<Duration>,
    /// It has been heard to fall.
    down: bool,
}

pub(super) fn plugin(app: &mut App) {
    app.add_systems(Update, listen)
        .add_systems(FixedUpdate, (hear_feet, hear_falls, hear_finish).chain().after(MarathonSystems::Report));
}

/// Listens to new characters.
fn listen(mut commands: Commands, new: Query<Entity, (With<Actor>, Without<Heard>)>) {
    for actor in &new {
        commands.entity(actor).insert(Heard::default());
    }
}

/// Where a character is.
fn place(anatomy: &Anatomy, parts: &Query<&GlobalTransform>) -> Option<Vec3> {
    let root = anatomy.model.joints.first().map_or(1, |joint| joint.body);
    parts.get(*anatomy.parts.get(root)?).ok().map(GlobalTransform::translation)
}

/// Steps and landings, from the contacts of the feet.
fn hear_feet(
    time: Res<Time<Fixed>>,
    mut contacts: MessageReader<FootContact>,
    mut actors: Query<(Entity, &Anatomy, &Episode, &mut Heard)>,
    parts: Query<&GlobalTransform>,
    mut sounds: MessageWriter<PlaySound>,
) {
    let now = time.elapsed();
    for contact in contacts.read().filter(|contact| contact.down) {
        let Ok((_, anatomy, episode, mut heard)) = actors.get_mut(contact.ragdoll) else { continue };
        let flight = heard.flying.take().map_or(0.0, |since| now.saturating_sub(since).as_secs_f64());
        if episode.down || (now.saturating_sub(heard.step).as_secs_f64() < APART && heard.step > Duration::ZERO) {
            continue;
        }
        heard.step = now;
        let [ahead, left] = episode.own_velocity;
        let speed = ahead.hypot(left).max(episode.speed.abs());
        let (sound, loudness) = match flight >= FLIGHT {
            true => (Sound::Landing, 0.5 + flight as f32),
            false => (Sound::Step, QUIET + (1.0 - QUIET) * (speed / FULL).sqrt()),
        };
        sounds.write(PlaySound { sound, at: place(anatomy, &parts), loudness: loudness.min(1.0) });
    }
    for (_, anatomy, episode, mut heard) in &mut actors {
        let in_air = !anatomy.feet.is_empty() && episode.feet == 0 && !episode.down;
        if in_air != heard.flying.is_some() {
            heard.flying = in_air.then_some(now);
        }
    }
}

/// Falls: a character is down, whether its episode goes on or not.
fn hear_falls(
    mut ended: MessageReader<EpisodeEnded>,
    mut actors: Query<(Entity, &Anatomy, &Episode, &mut Heard)>,
    parts: Query<&GlobalTransform>,
    mut sounds: MessageWriter<PlaySound>,
) {
    let fallen: Vec<Entity> = ended.read().filter(|e| e.end == End::Fell).map(|e| e.ragdoll).collect();
    for (ragdoll, anatomy, episode, mut heard) in &mut actors {
        let down = episode.down || fallen.contains(&ragdoll);
        if down && !heard.down {
            sounds.write(PlaySound { sound: Sound::Landing, at: place(anatomy, &parts), loudness: 0.9 });
        }
        if down != heard.down {
            heard.down = down;
        }
    }
}

/// The crowd cheers when a character reaches the end of a course.
fn hear_finish(mode: Res<State<Mode>>, mut ended: MessageReader<EpisodeEnded>, mut sounds: MessageWriter<PlaySound>) {
    let through = ended.read().filter(|e| *mode == Mode::Course && e.episode.farthest > TO - FINISH).count();
    if through > 0 {
        sounds.write(PlaySound { sound: Sound::Crowd, at: None, loudness: 0.8 });
    }
}
