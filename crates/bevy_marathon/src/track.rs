//! Tracks of ragdolls: the frames in which their physics computes.

use bevy::ecs::system::SystemParam;
use bevy::prelude::*;

/// The frame in which the physics of a [`Ragdoll`](crate::Ragdoll) computes: where its episodes start, and which way they run (along +x).
/// It is relative to the parent of the ragdoll.
///
/// It begins as the [`Transform`] that the ragdoll is spawned with. Later, that is where the character has come to. To move the character,
/// set the `Transform`: the track moves along.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
pub struct Track {
    place: Transform,
    /// Where the character is along the track.
    own: Transform,
    /// The transform that the plugin has written.
    shown: Transform,
}

impl Track {
    /// A track that begins at a transform, with the character at its start.
    pub fn at(place: Transform) -> Self {
        Track { place, own: Transform::IDENTITY, shown: place }
    }

    /// Start and direction, relative to the parent of the ragdoll.
    pub fn place(&self) -> Transform {
        self.place
    }

    /// The direction in which it runs, of length 1.
    pub fn direction(&self) -> Vec3 {
        self.place.rotation * Vec3::X
    }

    /// The transform of the ragdoll in the axes of the track.
    #[cfg(feature = "render")]
    pub(crate) fn own(&self) -> Transform {
        self.own
    }

    /// The track in the axes of the ragdoll: `transform * track.inverse()` is the track in the axes of `transform`. It changes with
    /// every frame.
    pub fn inverse(&self) -> Transform {
        let turn = self.own.rotation.inverse();
        Transform::from_translation(turn * -self.own.translation).with_rotation(turn)
    }

    /// Turns the direction about the start.
    pub(crate) fn face(&mut self, rotation: Quat) {
        self.place.rotation = rotation;
    }

    /// Takes in a transform that the app has set since the plugin wrote it.
    pub(crate) fn take_in(&mut self, transform: &Transform) {
        if *transform != self.shown {
            (self.place, self.shown) = (*transform * self.inverse(), *transform);
        }
    }

    /// The transform of a ragdoll whose root body is at a place of the track: below it, on the plane of the track. Without a heading,
    /// it keeps the last one.
    pub(crate) fn go(&mut self, position: Vec3, heading: Option<Quat>) -> Transform {
        let heading = heading.unwrap_or(self.own.rotation);
        self.own = Transform::from_translation(position.with_y(0.0)).with_rotation(heading);
        self.shown = self.place * self.own;
        self.shown
    }
}

/// The tracks of ragdolls in the axes of the world, exactly: they depend on the frames of the app only where it moves characters.
#[derive(SystemParam)]
pub struct Tracks<'w, 's> {
    tracks: Query<'w, 's, &'static Track>,
    parents: Query<'w, 's, &'static ChildOf>,
    transforms: TransformHelper<'w, 's>,
}

impl Tracks<'_, '_> {
    /// The track of a ragdoll in the axes of the world. `None` for an entity that is no ragdoll or that the plugin has not taken in.
    pub fn get(&self, ragdoll: Entity) -> Option<GlobalTransform> {
        let place = self.tracks.get(ragdoll).ok()?.place;
        match self.parents.get(ragdoll) {
            Ok(parent) => Some(self.transforms.compute_global_transform(parent.parent()).ok()? * place),
            Err(_) => Some(place.into()),
        }
    }
}

/// Moves the tracks of ragdolls whose transform the app has set.
pub(crate) fn take_in(mut ragdolls: Query<(&mut Track, &Transform), Changed<Transform>>) {
    for (mut track, transform) in &mut ragdolls {
        track.take_in(transform);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_character_that_is_moved_takes_its_track_along() {
        let start = Transform::from_xyz(5.0, 1.0, -2.0).with_rotation(Quat::from_rotation_y(0.5));
        let mut track = Track::at(start);
        let shown = track.go(Vec3::new(3.0, 0.9, 0.4), Some(Quat::from_rotation_y(1.0)));
        assert!((shown.translation - start.transform_point(Vec3::new(3.0, 0.0, 0.4))).length() < 1e-6);
        let back = shown * track.inverse();
        assert!((back.translation - start.translation).length() < 1e-5, "{back:?}");
        assert!(back.rotation.angle_between(start.rotation) < 1e-3);
        // what the plugin wrote is no move
        track.take_in(&shown);
        assert_eq!(track.place(), start);
        let goal = Transform::from_xyz(-7.0, 0.0, 1.0);
        track.take_in(&goal);
        let now = track.go(Vec3::new(3.0, 0.9, 0.4), Some(Quat::from_rotation_y(1.0)));
        assert!(
            (now.translation - goal.translation).length() < 1e-5 && now.rotation.angle_between(goal.rotation) < 1e-3
        );
    }
}
