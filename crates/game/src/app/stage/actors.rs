//! The characters of the scenario, and the one in focus.

use crate::app::mode::AppSet;
use bevy::prelude::*;
use bevy_marathon::Anatomy;
use bevy_marathon::look::{FollowCamera, Marks};

/// Ragdolls side by side before the next row begins behind.
pub const ROW: usize = 16;
/// Distance between rows, m.
const ROW_SPACING: f32 = 4.0;

/// A character of the scenario, and its number.
#[derive(Component, Clone, Copy, Debug)]
pub struct Actor(pub usize);

/// Number of the character that the camera follows.
#[derive(Resource, Default)]
pub struct Focus(pub usize);

/// The marks that are drawn about the focus.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct ShownMarks {
    /// Contacts and forces.
    pub contacts: bool,
    /// Joints and limits.
    pub joints: bool,
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Focus>()
        .init_resource::<ShownMarks>()
        .add_systems(Update, (follow_focus, show_marks).chain().in_set(AppSet::Present));
}

/// The place of character `i`: in rows, or side by side on tracks that are not level.
pub fn place(i: usize, spacing: f32, level: bool) -> Vec3 {
    if !level {
        return Vec3::new(0.0, 0.0, -spacing * i as f32);
    }
    Vec3::new(-ROW_SPACING * (i / ROW) as f32, 0.0, -spacing * (i % ROW) as f32)
}

/// Points the camera at the focus and marks it.
fn follow_focus(
    focus: Res<Focus>,
    actors: Query<(Entity, &Actor)>,
    mut cameras: Query<&mut FollowCamera>,
    mut marks: Query<(&Actor, &mut Marks)>,
) {
    let target = actors.iter().find(|(_, actor)| actor.0 == focus.0).map(|(entity, _)| entity);
    for mut camera in &mut cameras {
        if camera.target != target {
            camera.target = target;
        }
    }
    let several = actors.iter().count() > 1;
    for (actor, mut marks) in &mut marks {
        let ring = several && actor.0 == focus.0;
        if marks.ring != ring {
            marks.ring = ring;
        }
    }
}

/// Draws the marks about the focus alone: one probe is cheap, and many arrows are hard to read.
fn show_marks(shown: Res<ShownMarks>, focus: Res<Focus>, mut actors: Query<(&Actor, &mut Marks), With<Anatomy>>) {
    for (actor, mut marks) in &mut actors {
        let on = actor.0 == focus.0;
        let ShownMarks { contacts, joints } = *shown;
        let wanted = Marks { contacts: on && contacts, joints: on && joints, ring: marks.ring, command: on };
        if *marks != wanted {
            *marks = wanted;
        }
    }
}
