//! Motion clips that move characters in place of the physics, and the way there and back.

use crate::asset::MotionClip;
use crate::characters::Playing;
use crate::marathon::{Marathon, RagdollState};
use bevy::prelude::*;
use std::path::Path;

/// Plays a motion clip on a [`Ragdoll`](crate::Ragdoll) in place of its physics. The mode is then
/// [`RagdollMode::Animated`](crate::RagdollMode::Animated).
///
/// The clip begins where the character is and turns as it does. The pose moves into the clip without a jump of place or
/// velocity. Remove the component, and the physics continues with the pose and the velocity of the clip. The plugin removes it
/// at the end of a clip that does not loop. While it plays, pushes have no effect, but are reported, and the episode stands
/// still. [`RagdollMode::Limp`](crate::RagdollMode::Limp) interrupts it.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_marathon::prelude::*;
/// fn walk(mut commands: Commands, assets: Res<AssetServer>, character: Single<Entity, With<Ragdoll>>) {
///     commands.entity(*character).insert(PlayClip::new(assets.load("motions/marathon_man/walk.motion")));
/// }
///
/// // a blow ends the animation, and the policy takes over
/// fn fall(mut commands: Commands, mut hits: MessageReader<HitReceived>) {
///     for hit in hits.read() {
///         commands.entity(hit.ragdoll).remove::<PlayClip>();
///     }
/// }
/// ```
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
pub struct PlayClip {
    /// A clip of the character's model, from a `.motion` file.
    pub clip: Handle<MotionClip>,
    /// Time of the clip at which it begins, s.
    pub from: f64,
    /// Speed: 1 is that of the clip.
    pub speed: f64,
    /// Time in which half of the difference between the pose and the clip goes away, s.
    pub half_life: f64,
}

impl PlayClip {
    /// A clip from its start, at its own speed.
    pub fn new(clip: Handle<MotionClip>) -> Self {
        PlayClip { clip, from: 0.0, speed: 1.0, half_life: 0.1 }
    }
}

/// Begins, goes on with and ends the clips of the characters.
pub(crate) fn take_in(
    mut marathon: ResMut<Marathon>,
    clips: Res<Assets<MotionClip>>,
    ragdolls: Query<(&RagdollState, Option<Ref<PlayClip>>)>,
) {
    for (key, play) in &ragdolls {
        let Some(batch) = marathon.batch(*key) else { continue };
        let Some(slot) = batch.lanes[key.lane].as_mut().filter(|slot| slot.asleep.is_none()) else { continue };
        let Some(play) = play.filter(|_| !slot.is_limp()) else {
            if slot.playing.is_some() {
                batch.stop(key.lane);
            }
            continue;
        };
        let Some(MotionClip(clip)) = clips.get(&play.clip) else { continue };
        match &mut slot.playing {
            // a snapshot from bytes has no clip
            Some(playing) if !play.is_changed() => playing.clip = Some(clip.clone()),
            _ => {
                let numbers = [play.from, play.speed, play.half_life];
                if !numbers.iter().all(|x| x.is_finite()) || play.half_life < 0.0 {
                    error_once!("a PlayClip has numbers that are not finite, or a negative half-life: {:?}", *play);
                } else if let Err(error) = clip.check_model(Path::new(&clip.about().name), batch.model()) {
                    error_once!("a PlayClip has a clip of another model: {error}");
                } else {
                    batch.play(key.lane, Playing::new(clip.clone(), play.from, play.speed, play.half_life));
                }
            }
        }
    }
}

/// Removes the components of clips that are over.
pub(crate) fn end(
    mut commands: Commands,
    marathon: Res<Marathon>,
    ragdolls: Query<(Entity, &RagdollState), With<PlayClip>>,
) {
    for (entity, key) in &ragdolls {
        if marathon.slot(*key).and_then(|slot| slot.playing.as_ref()).is_some_and(Playing::is_over) {
            commands.entity(entity).remove::<PlayClip>();
        }
    }
}
