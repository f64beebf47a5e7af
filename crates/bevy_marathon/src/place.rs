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
    /// Turn about the vertical from +x to where the root body faces. A flip forward or backward does not change it. It keeps its value
    /// while the body is upside down.
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

/// Cosine of half the tilt of the root body, squared, from which it has a heading: a tilt of 120 degrees.
const TILTED: f32 = 0.25;

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
        let [at_rest, ahead] = pose::rest(model);
        let toward = |turn: Quat| Some(heading(turn * at_rest.inverse())? * ahead);
        let world = toward(turn).unwrap_or(pose.heading);
        *pose = CharacterPose { position, heading: world, linear_velocity: linear, angular_velocity: angular };
        found.push((ragdoll, root.place.translation, toward(root.place.rotation)));
    }
    let mut ragdolls = places.p1();
    for (ragdoll, position, heading) in found.drain(..) {
        if let Ok((mut track, mut transform)) = ragdolls.get_mut(ragdoll) {
            transform.set_if_neq(track.go(position, heading));
        }
    }
}

/// The part of a turn that is about the vertical. A flip forward or backward does not change it. `None` far beyond a quarter turn, where
/// it is no longer smooth.
fn heading(turn: Quat) -> Option<Quat> {
    let about = Quat::from_xyzw(0.0, turn.y, 0.0, turn.w);
    (about.length_squared() > TILTED).then(|| about.normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flip_keeps_the_heading() {
        let heading_of = |flip: f32| heading(Quat::from_rotation_y(0.6) * Quat::from_rotation_z(flip));
        for flip in [-6.0, -2.0, -1.0, 0.0, 1.5, 2.0, 4.5, 6.25] {
            let turn = heading_of(flip).expect("it has one");
            assert!(turn.angle_between(Quat::from_rotation_y(0.6)) < 1e-3, "{flip}: {turn}");
        }
        assert_eq!(heading_of(std::f32::consts::PI), None);
    }
}
