//! The systems of the levels of detail.

use crate::axes::to_game;
use crate::lod::{Lod, LodByDistance};
use crate::marathon::{Marathon, RagdollState};
use crate::ragdoll::Anatomy;
use crate::track::Tracks;
use bevy::prelude::*;
use marathon_physics::model::JointType;

/// Sets the level of each ragdoll by its distance to the nearest [`LodByDistance`].
pub(crate) fn by_distance(
    marathon: Res<Marathon>,
    eyes: Query<(&LodByDistance, &GlobalTransform)>,
    mut ragdolls: Query<(Entity, &mut Lod, &RagdollState, &Anatomy)>,
    tracks: Tracks,
) {
    if eyes.is_empty() {
        return;
    }
    for (ragdoll, mut lod, key, anatomy) in &mut ragdolls {
        let Some(sample) = marathon.history(key).and_then(|history| history.back()) else { continue };
        // one without a free body stays near its track's start, or runs along it
        let root = anatomy.model.joints.iter().find(|joint| joint.kind == JointType::Free).map_or_else(
            || sample.qpos.first().map(|x| [*x, 0.0, 0.0]),
            |free| sample.qpos.get(free.qpos_adr..)?.first_chunk().copied(),
        );
        let Some(track) = tracks.get(ragdoll) else { continue };
        let place = track.transform_point(to_game(root.unwrap_or_default()));
        let nearest = eyes.iter().map(|(by, eye)| (eye.translation().distance(place), by));
        if let Some((distance, by)) = nearest.min_by(|(a, _), (b, _)| a.total_cmp(b)) {
            let level = by.level(*lod, distance);
            lod.set_if_neq(level);
        }
    }
}

/// Moves ragdolls to other lanes, so that those that sleep share batches, which are then not stepped.
pub(crate) fn pack(mut marathon: ResMut<Marathon>, mut ragdolls: Query<&mut RagdollState>) {
    let marathon = &mut *marathon;
    for (number, kind) in marathon.kinds.iter_mut().enumerate() {
        if !std::mem::take(&mut kind.unpacked) {
            continue;
        }
        let moves = kind.pack();
        if moves.is_empty() {
            continue;
        }
        for mut key in ragdolls.iter_mut().filter(|key| key.kind == number) {
            if let Some((_, to)) = moves.iter().find(|(from, _)| *from == (key.batch, key.lane)) {
                (key.batch, key.lane) = *to;
            }
        }
    }
}
