//! Loading the scenario: its mode begins, and its characters replace the former ones.

use crate::app::mode::{self, AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::{Actor, Focus, ROW, place};
use crate::app::stage::course;
use crate::app::stage::loaded::{LoadedPolicy, read_opponent, read_policy, reload, written};
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::{LoadScenario, PolicySource, Scenario};
use bevy::prelude::*;
use bevy_marathon::look::{FollowCamera, Marks, Tint};
use bevy_marathon::{
    AgentCommand, CharacterPolicy, Collides, Ground, Held, LaidGround, Opponent, PolicyAsset, Ragdoll, RagdollPrefab,
    Restart,
};
use marathon_envs::registry;
use marathon_physics::Model;
use marathon_render::Scene;
use marathon_runs::{Flags, RunError, TaskConfig};
use std::sync::Arc;

/// Seconds that a fallen character lies before it restarts.
const LIE: f64 = 1.2;

pub(super) fn plugin(app: &mut App) {
    app.add_message::<LoadScenario>().add_systems(Startup, load_first).add_systems(
        Update,
        (reload, (enter_mode, spawn).chain().run_if(on_message::<LoadScenario>)).chain().in_set(AppSet::Simulate),
    );
}

/// Loads the scenario of the command line.
fn load_first(mut loads: MessageWriter<LoadScenario>) {
    loads.write(LoadScenario);
}

/// Enters the mode of the scenario, in the frame in which its characters come.
pub fn enter_mode(world: &mut World) {
    let mode = world.resource::<Scenario>().mode;
    mode::enter(world, mode);
}

/// The parts that the characters of a scenario have in common.
struct Cast {
    model: Arc<Model>,
    ragdoll: Ragdoll,
    opponent: Option<Handle<PolicyAsset>>,
    equipment: Option<course::Equipment>,
}

/// Replaces the characters. Features spawn those of [`Mode::Replay`] and [`Mode::Outside`].
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
pub fn spawn(
    mut commands: Commands,
    (scenario, shipped): (Res<Scenario>, Res<ShippedPolicies>),
    mut focus: ResMut<Focus>,
    mut loaded: ResMut<LoadedPolicy>,
    mut notes: ResMut<Notifications>,
    mut policies: ResMut<Assets<PolicyAsset>>,
    mut prefabs: ResMut<Assets<RagdollPrefab>>,
    actors: Query<Entity, With<Actor>>,
    mut cameras: Query<&mut FollowCamera>,
) {
    actors.iter().for_each(|actor| commands.entity(actor).despawn());
    focus.0 = 0;
    *loaded = LoadedPolicy::default();
    if !scenario.mode.is_simulated() {
        return;
    }
    let cast = match cast(&scenario, &shipped, &mut loaded, &mut notes, &mut policies, &mut prefabs) {
        Ok(cast) => cast,
        Err(error) => return notes.error(error),
    };
    let scene = Scene::new(&cast.model);
    let (spacing, radius) = (scene.spacing() as f32, scene.radius() as f32);
    let level = loaded.ground == Ground::Level && cast.model.hfields.is_empty();
    let after_fall = if scenario.mode == Mode::Learn { 0.0 } else { LIE };
    // runs on courses are compared, and clips are followed, by one character alone
    let collide = matches!(scenario.mode, Mode::Watch | Mode::Push);
    for i in 0..if scenario.mode == Mode::Testbed { 1 } else { scenario.agents } {
        let mut actor = commands.spawn((
            Actor(i),
            cast.ragdoll.clone().with_seed(scenario.seed, i as u64),
            // on a track, a referee ends the runs of tasks without courses
            Restart { after_fall, on_time_up: loaded.ground != Ground::Track },
            Transform::from_translation(place(i, spacing, level)),
            Marks::default(),
        ));
        if collide {
            actor.insert(Collides::ALL);
        }
        if i > 0 {
            actor.insert(Tint::of_row(i));
        }
        if let Some(policy) = &loaded.policy {
            actor.insert(CharacterPolicy(policy.clone()));
        }
        if let Some(opponent) = &cast.opponent {
            actor.insert(Opponent(opponent.clone()));
        }
        let Some(equipment) = &cast.equipment else { continue };
        if let Some(laid) = &equipment.laid {
            actor.insert(LaidGround::clone(laid));
        }
        if let Some(command) = &equipment.command {
            actor.insert(AgentCommand::clone(command));
        }
        if let Some(held) = &equipment.held {
            actor.insert(Held::clone(held));
        }
    }
    for mut camera in &mut cameras {
        let crowd = (scenario.agents.min(ROW) as f32 - 1.0) * spacing * 0.28;
        camera.goal[2] = 3.1 * radius + crowd + 0.6;
        camera.ahead = 0.0;
        if scenario.mode == Mode::Course {
            (camera.ahead, camera.goal[2]) = scenario.course.view(camera.goal[2]);
        }
        camera.goal[1] = if scenario.agents > 1 { 0.32 } else { 0.16 };
        camera.jump();
    }
    let name = if scenario.mode == Mode::Testbed { &cast.model.name } else { &scenario.agent };
    info!("loaded: {} of {name} ({})", scenario.agents, scenario.mode.name());
}

/// Makes what the characters are made of. The task and its policies go to `loaded`. A policy that cannot be read is an error on
/// the screen, and the characters come without it.
fn cast(
    scenario: &Scenario,
    shipped: &ShippedPolicies,
    loaded: &mut LoadedPolicy,
    notes: &mut Notifications,
    policies: &mut Assets<PolicyAsset>,
    prefabs: &mut Assets<RagdollPrefab>,
) -> Result<Cast, String> {
    let spelled = |error: RunError| error.spelled(&Flags("marathon"));
    let testbed = scenario.mode == Mode::Testbed;
    let model = match scenario.model.as_ref().filter(|_| testbed) {
        Some(path) => Model::from_xml_file(path).map_err(|e| e.to_string()),
        None => task_model(scenario, shipped, &mut loaded.task_config).map_err(spelled),
    };
    loaded.ground = scenario.stands_on();
    let model = Arc::new(model?);
    let ragdoll = if testbed {
        Ragdoll::prefab(prefabs.add(RagdollPrefab { model: model.clone() }))
    } else {
        Ragdoll::agent(&scenario.agent).on(loaded.ground).with_task_config(loaded.task_config.clone())
    };
    match read_policy(scenario, &loaded.task_config, shipped) {
        Ok(Some((policy, name))) => {
            loaded.policy = Some(policies.add(policy));
            loaded.names[0] = Some(name);
        }
        Ok(None) if scenario.mode == Mode::Imitate && scenario.source == PolicySource::Shipped => {
            let agent = &scenario.agent;
            notes.say(format!("no policy comes with {agent}: its servos alone follow the clip; learn live (L)"));
        }
        Ok(None) => {}
        Err(text) => notes.error(text),
    }
    let mut opponent = None;
    match read_opponent(scenario, &loaded.task_config) {
        Ok(Some((policy, name))) => {
            opponent = Some(policies.add(policy));
            loaded.names[1] = Some(name);
        }
        Ok(None) => {}
        Err(text) => notes.error(text),
    }
    let mut equipment = None;
    if scenario.mode == Mode::Course {
        let equip = |spec: &_| scenario.course.equipment(scenario.seed, loaded.ground, spec);
        equipment = Some(loaded.task_config.factory().and_then(|factory| equip(factory.spec())).map_err(spelled)?);
    }
    if let PolicySource::File(path) = &scenario.source {
        loaded.written = written(path);
    }
    if scenario.source == PolicySource::Trainer {
        // the trainer puts its policies here
        loaded.policy = Some(policies.reserve_handle());
    }
    Ok(Cast { model, ragdoll, opponent, equipment })
}

/// The model of the scenario's task. Puts the task at `setting`.
fn task_model(scenario: &Scenario, shipped: &ShippedPolicies, task_config: &mut TaskConfig) -> Result<Model, RunError> {
    let task = scenario.task_config(shipped)?;
    if scenario.mode == Mode::Course {
        course::check(&scenario.course, &task)?;
    }
    *task_config = task;
    Ok(registry::agent(&task_config.agent)?.with_options(&task_config.options)?.model()?)
}
