//! A pile of boxes that a key puts in front of the character in focus. Characters and boxes feel each other.

use crate::app::input::actions::{Action, ActionPressed};
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::{Actor, Focus};
use crate::app::stage::scenario::LoadScenario;
use bevy::prelude::*;
use bevy_marathon::axes::yaw_of;
use bevy_marathon::look::FollowCamera;
use bevy_marathon::{CharacterPose, Collides, Ragdoll, RagdollPrefab};
use marathon_physics::Model;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::spec::ModelSpec;

/// Distance of the pile from the character, m.
const AHEAD: f32 = 2.0;

/// The pile, of which there is one at a time.
#[derive(Component)]
pub struct Pile;

pub(super) fn plugin(app: &mut App) {
    app.add_systems(Update, (clear.run_if(on_message::<LoadScenario>), put).chain().in_set(AppSet::Present));
}

/// Another scenario begins without boxes.
fn clear(mut commands: Commands, piles: Query<Entity, With<Pile>>) {
    piles.iter().for_each(|pile| commands.entity(pile).despawn());
}

/// Puts the pile where the camera looks past the character.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
fn put(
    mut commands: Commands,
    mut actions: MessageReader<ActionPressed>,
    (mode, focus): (Res<State<Mode>>, Res<Focus>),
    actors: Query<(&Actor, &CharacterPose, &Collides)>,
    cameras: Query<&Transform, With<FollowCamera>>,
    piles: Query<Entity, With<Pile>>,
    mut notes: ResMut<Notifications>,
    (mut prefabs, mut model): (ResMut<Assets<RagdollPrefab>>, Local<Option<Handle<RagdollPrefab>>>),
) {
    for _ in actions.read().filter(|action| action.0 == Action::Boxes) {
        let Some((_, pose, collides)) = actors.iter().find(|(actor, ..)| actor.0 == focus.0) else { continue };
        if !mode.is_simulated() || !collides.characters {
            notes.say("boxes: not in this mode");
            continue;
        }
        let handle = match &*model {
            Some(handle) => handle.clone(),
            None => match compiled() {
                Ok(boxes) => model.insert(prefabs.add(RagdollPrefab::from(boxes))).clone(),
                Err(error) => {
                    notes.error(error.to_string());
                    continue;
                }
            },
        };
        piles.iter().for_each(|pile| commands.entity(pile).despawn());
        let ahead = cameras.iter().next().map_or(pose.forward(), |camera| *camera.forward());
        let ahead = ahead.with_y(0.0).try_normalize().unwrap_or(Vec3::X);
        // +x onto the way, about the vertical
        let turn = Quat::from_rotation_y(yaw_of(ahead));
        let place = Transform::from_translation(pose.position.with_y(0.0) + AHEAD * ahead).with_rotation(turn);
        commands.spawn((Name::new("boxes"), Pile, Ragdoll::prefab(handle), Collides::ALL, place));
    }
}

/// The model of the pile.
fn compiled() -> Result<Model, MjcfError> {
    let mut spec = ModelSpec::from_xml_str(marathon_assets::text("props/boxes.xml"), "boxes.xml")?;
    spec.add_obstacles()?;
    spec.compile()
}
