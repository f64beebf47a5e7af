//! Where a character is in the world, and how it moves.

use crate::marathon::{Marathon, RagdollState};
use crate::pose;
use crate::ragdoll::Anatomy;
use crate::track::{Track, Tracks};
use bevy::prelude::*;

/// Place and motion of a [`Ragdoll`](crate::Ragdoll) in the world's axes, at the time of the frame. The plugin writes it.
///
/// The [`Transform`] of the ragdoll has the same heading, and is below this position, on the plane of its [`Track`].
///
/// ```no_run
/// # use bevy::prelude::*;
/// # use bevy_marathon::prelude::*;
/// fn look_at(character: Single<&CharacterPose>, mut camera: Single<&mut Transform, With<Camera3d>>) {
///     let behind = character.position - 4.0 * character.forward() + Vec3::Y;
///     **camera = Transform::from_translation(behind).looking_at(character.position, Vec3::Y);
/// }
/// ```
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct CharacterPose {
    /// Position of the root body, m.
    pub position: Vec3,
    /// Turn about the vertical from +x to the forward axis of the root body. It keeps its value while the body is far from upright, as
    /// in a flip or on the ground.
    pub heading: Quat,
    /// Velocity of the root body, m/s.
    pub linear_velocity: Vec3,
    /// Angular velocity of the root body, rad/s.
    pub angular_velocity: Vec3,
}

impl CharacterPose {
    /// The forward direction along the ground.
    pub fn forward(&self) -> Vec3 {
        self.heading * Vec3::X
    }

    /// Position and heading as a transform, for entities that go along with the character.
    pub fn transform(&self) -> Transform {
        Transform::from_translation(self.position).with_rotation(self.heading)
    }
}

/// Height of the vertical of a root body, turned with it, from which it has a heading.
const UPRIGHT: f32 = 0.3;
/// Length along the ground of a forward axis that counts as vertical.
const VERTICAL: f32 = 1e-2;

/// Writes where all characters are at the time that a frame shows: their poses, and the transforms of the ragdolls.
pub(crate) fn show(
    marathon: Res<Marathon>,
    time: Res<Time<Fixed>>,
    mut poses: Query<(Entity, &RagdollState, &Anatomy, &mut CharacterPose)>,
    mut places: ParamSet<(Tracks, Query<(&mut Track, &mut Transform)>)>,
    mut found: Local<Vec<(Entity, Vec3, Option<Quat>)>>,
) {
    let now = time.elapsed() + time.overstep();
    let tracks = places.p0();
    for (ragdoll, key, anatomy, mut pose) in &mut poses {
        let model = &anatomy.model;
        let Some((a, b, share)) = marathon.slot(*key).and_then(|slot| slot.between(now)) else { continue };
        let Some(track) = tracks.get(ragdoll) else { continue };
        let qpos = pose::mix(model, &a.qpos, &b.qpos, share);
        let qvel: Vec<f64> = a.qvel.iter().zip(&b.qvel).map(|(a, b)| a + share * (b - a)).collect();
        let Some(root) = pose::root_motion(model, &qpos, &qvel) else { continue };
        let (_, turn, position) = (track * root.place).to_scale_rotation_translation();
        let [linear, angular] = [root.linear, root.angular].map(|v| track.affine().transform_vector3(v));
        let upright = pose::uprightness(model, root.place.rotation) > UPRIGHT;
        let ahead = heading(turn).filter(|_| upright).unwrap_or(pose.heading);
        *pose = CharacterPose { position, heading: ahead, linear_velocity: linear, angular_velocity: angular };
        let own = heading(root.place.rotation).filter(|_| upright);
        found.push((ragdoll, root.place.translation, own));
    }
    let mut ragdolls = places.p1();
    for (ragdoll, position, heading) in found.drain(..) {
        if let Ok((mut track, mut transform)) = ragdolls.get_mut(ragdoll) {
            transform.set_if_neq(track.go(position, heading));
        }
    }
}

/// Turn about the vertical of the forward axis, +x. `None` while it is vertical.
fn heading(turn: Quat) -> Option<Quat> {
    let ahead = (turn * Vec3::X).with_y(0.0);
    (ahead.length() > VERTICAL).then(|| Quat::from_rotation_y((-ahead.z).atan2(ahead.x)))
}
