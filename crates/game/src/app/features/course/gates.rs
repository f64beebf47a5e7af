//! The start, the checkpoints and the finish of a course: arches over the track of the character in focus.

use crate::app::features::course::runs::{GATES, Runs};
use crate::app::mode::{AppSet, Mode};
use crate::app::stage::actors::{Actor, Focus};
use crate::app::stage::scenario::Scenario;
use bevy::prelude::*;
use bevy_marathon::{Ragdoll, Track};

/// Height of an arch over the start of the track, how far its posts reach into the ground, and half of its width, m.
const SIZE: [f32; 3] = [3.2, 3.0, 2.0];
/// Thickness of posts and beam, m.
const THICK: f32 = 0.09;

/// An arch.
#[derive(Component, Clone, Copy, Debug)]
pub struct Gate {
    /// 0 for the start, then the checkpoints; the last one is the finish.
    number: usize,
    /// Whether it has the color of one that has been passed.
    passed: bool,
}

/// The materials of arches that come, of the finish, and of arches that have been passed.
#[derive(Resource)]
struct Paints([Handle<StandardMaterial>; 3]);

pub(super) fn plugin(app: &mut App) {
    app.add_systems(OnEnter(Mode::Course), build)
        .add_systems(Update, (follow, paint).chain().run_if(in_state(Mode::Course)).in_set(AppSet::Present));
}

/// Builds the arches. They disappear with the mode.
fn build(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    let mut paint = |color: Color| materials.add(StandardMaterial { base_color: color, ..default() });
    let paints =
        [Color::srgb(0.93, 0.94, 0.96), Color::srgb(0.12, 0.42, 0.9), Color::srgb(1.0, 0.55, 0.15)].map(&mut paint);
    let [height, depth, half] = SIZE;
    let post = meshes.add(Cuboid::new(THICK, height + depth, THICK));
    let beam = meshes.add(Cuboid::new(THICK, 3.0 * THICK, 2.0 * half + THICK));
    for number in 0..=GATES.len() {
        let material = MeshMaterial3d(paints[usize::from(number == GATES.len())].clone());
        let gate = (Gate { number, passed: false }, Transform::default(), Visibility::Hidden);
        let mut gate = commands.spawn((Name::new("gate"), DespawnOnExit(Mode::Course), gate));
        gate.with_children(|gate| {
            for side in [-half, half] {
                let at = Transform::from_xyz(0.0, 0.5 * (height - depth), side);
                gate.spawn((Mesh3d(post.clone()), material.clone(), at));
            }
            gate.spawn((Mesh3d(beam.clone()), material.clone(), Transform::from_xyz(0.0, height, 0.0)));
        });
    }
    commands.insert_resource(Paints(paints));
}

/// Puts the arches over the track of the character in focus. A course that the player builds has none.
#[allow(clippy::type_complexity, reason = "a query names what it reads")]
fn follow(
    (focus, scenario): (Res<Focus>, Res<Scenario>),
    actors: Query<(&Actor, &Track), With<Ragdoll>>,
    mut gates: Query<(&Gate, &mut Transform, &mut Visibility)>,
) {
    let track = actors.iter().find(|(actor, _)| actor.0 == focus.0).filter(|_| !scenario.is_built());
    for (gate, mut place, mut visibility) in &mut gates {
        let wanted = if track.is_some() { Visibility::Inherited } else { Visibility::Hidden };
        visibility.set_if_neq(wanted);
        if let Some((_, track)) = track {
            let distance = gate.number.checked_sub(1).map_or(0.0, |i| GATES[i]);
            place.set_if_neq(track.place() * Transform::from_xyz(distance as f32, 0.0, 0.0));
        }
    }
}

/// Colors the arches that the character has passed.
fn paint(
    mut commands: Commands,
    (focus, runs, paints): (Res<Focus>, Res<Runs>, Res<Paints>),
    actors: Query<(Entity, &Actor)>,
    mut gates: Query<(&mut Gate, &Children)>,
) {
    let ragdoll = actors.iter().find(|(_, actor)| actor.0 == focus.0).map(|(entity, _)| entity);
    let count = ragdoll.map_or(0, |ragdoll| runs.gates(ragdoll).len());
    for (mut gate, children) in &mut gates {
        let passed = gate.number > 0 && gate.number <= count;
        if gate.passed != passed {
            gate.passed = passed;
            let paint = &paints.0[if passed { 2 } else { usize::from(gate.number == GATES.len()) }];
            for child in children {
                commands.entity(*child).insert(MeshMaterial3d(paint.clone()));
            }
        }
    }
}
