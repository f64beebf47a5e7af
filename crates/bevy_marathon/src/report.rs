//! Results of the decisions, as components and messages.

use crate::axes::to_game;
use crate::characters::Event;
use crate::marathon::{Marathon, RagdollState};
use crate::messages::{
    EpisodeBegan, EpisodeEnded, Fell, FootContact, GotUp, HitReceived, Landed, SkillEnded, SkillStarted,
};
use crate::mode::RagdollMode;
use crate::ragdoll::{Anatomy, Episode, OwnGround};
use crate::track::Tracks;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use std::sync::Arc;

/// Writers of all messages about ragdolls.
#[derive(SystemParam)]
pub(crate) struct Writers<'w> {
    steps: MessageWriter<'w, FootContact>,
    landed: MessageWriter<'w, Landed>,
    fell: MessageWriter<'w, Fell>,
    got_up: MessageWriter<'w, GotUp>,
    started: MessageWriter<'w, SkillStarted>,
    ended: MessageWriter<'w, SkillEnded>,
    hits: MessageWriter<'w, HitReceived>,
    episodes_ended: MessageWriter<'w, EpisodeEnded>,
    episodes_began: MessageWriter<'w, EpisodeBegan>,
}

impl Writers<'_> {
    /// Writes the message of an event of a ragdoll, whose track is at a place.
    fn write(&mut self, ragdoll: Entity, event: Event, anatomy: &Anatomy, track: &GlobalTransform) {
        match event {
            Event::Foot { foot, down, point, speed } => {
                let point = track.transform_point(to_game(point));
                self.steps.write(FootContact { ragdoll, foot, down, point, speed: speed as f32 });
            }
            Event::Landed { speed, seconds } => {
                self.landed.write(Landed { ragdoll, speed: speed as f32, seconds });
            }
            Event::Skill { button, on } => {
                let range = anatomy.spec.as_ref().and_then(|spec| spec.command.get(button));
                let skill = range.map_or_else(String::new, |range| range.name.clone());
                if on {
                    self.started.write(SkillStarted { ragdoll, skill });
                } else {
                    self.ended.write(SkillEnded { ragdoll, skill });
                }
            }
            Event::Fell { prone } => {
                self.fell.write(Fell { ragdoll, prone });
            }
            Event::GotUp => {
                self.got_up.write(GotUp { ragdoll });
            }
            Event::Hit { body, impulse } => {
                let impulse = track.affine().transform_vector3(to_game(impulse));
                self.hits.write(HitReceived { ragdoll, body, impulse });
            }
            Event::Ended(end, episode) => {
                self.episodes_ended.write(EpisodeEnded { ragdoll, end, episode });
            }
            Event::Began(number) => {
                self.episodes_began.write(EpisodeBegan { ragdoll, number });
            }
        }
    }
}

/// Writes components and messages.
#[expect(clippy::type_complexity, reason = "a query names what it writes")]
pub(crate) fn report(
    mut marathon: ResMut<Marathon>,
    mut ragdolls: Query<(Entity, &RagdollState, &Anatomy, (&mut Episode, &mut OwnGround, &mut RagdollMode))>,
    tracks: Tracks,
    mut writers: Writers,
) {
    for (ragdoll, key, anatomy, (mut episode, mut ground, mut mode)) in &mut ragdolls {
        let Some(slot) = marathon.slot_mut(*key) else { continue };
        if !slot.events.is_empty() {
            let track = tracks.get(ragdoll).unwrap_or_default();
            slot.events.drain(..).for_each(|event| writers.write(ragdoll, event, anatomy, &track));
        }
        if *episode != slot.episode {
            episode.clone_from(&slot.episode);
        }
        if !Arc::ptr_eq(&ground.0, &slot.grounds) {
            ground.0 = slot.grounds.clone();
        }
        // a mode that the app has set since the plugin looked stays until the next look
        if *mode == slot.shown_mode {
            slot.shown_mode = slot.mode();
            mode.set_if_neq(slot.shown_mode);
        }
    }
}
