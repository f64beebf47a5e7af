//! An app without a window, whose time passes frame by frame.

use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use bevy_marathon::prelude::*;
use std::path::PathBuf;
use std::time::Duration;

/// Everything that has been told.
#[derive(Resource, Default)]
pub struct Log {
    pub feet: Vec<FootContact>,
    pub ended: Vec<EpisodeEnded>,
    pub began: Vec<EpisodeBegan>,
    pub reached: Vec<TargetReached>,
}

/// An app whose frames are this long.
pub fn app(frame: Duration) -> App {
    let mut app = App::new();
    let assets = AssetPlugin { file_path: assets().display().to_string(), ..default() };
    app.add_plugins((MinimalPlugins, TransformPlugin, assets, MarathonPlugin))
        .insert_resource(TimeUpdateStrategy::ManualDuration(frame))
        .init_resource::<Log>()
        .add_systems(Update, listen);
    // the first frame has no length
    app.update();
    app
}

fn listen(
    mut log: ResMut<Log>,
    mut feet: MessageReader<FootContact>,
    mut ended: MessageReader<EpisodeEnded>,
    mut began: MessageReader<EpisodeBegan>,
    mut reached: MessageReader<TargetReached>,
) {
    log.feet.extend(feet.read().cloned());
    log.ended.extend(ended.read().cloned());
    log.began.extend(began.read().copied());
    log.reached.extend(reached.read().copied());
}

/// A frame of as long as a tick.
pub const TICK: Duration = Duration::from_micros(15_625);

/// Runs frames for a while.
pub fn run(app: &mut App, seconds: f32) {
    for _ in 0..(seconds / TICK.as_secs_f32()) as usize {
        app.update();
    }
}

/// Marathon Man with his policy and what else it is given.
pub fn controller(app: &mut App, more: impl Bundle) -> Entity {
    let policy = PolicyAsset::from(policy("MarathonManController"));
    let policy = CharacterPolicy(app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy));
    app.world_mut().spawn((Ragdoll::agent("MarathonManController"), policy, more)).id()
}

/// `qpos` and `qvel` of a ragdoll.
pub fn state(app: &App, entity: Entity) -> (Vec<f64>, Vec<f64>) {
    let key = app.world().get::<RagdollState>(entity).expect("it has entered");
    app.world().resource::<Marathon>().state(key).map(|state| (state.qpos, state.qvel)).expect("it is there")
}

/// The project's assets.
pub fn assets() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../assets")
}

/// The policy that comes with an agent.
pub fn policy(agent: &str) -> marathon_learn::Policy {
    let path = assets().join(format!("policies/{agent}.safetensors"));
    marathon_learn::Policy::load(&path).expect("the shipped policies can be read")
}

/// Runs frames until a condition holds; fails after `most` of them.
pub fn run_until(app: &mut App, most: usize, what: &str, mut done: impl FnMut(&World) -> bool) {
    for _ in 0..most {
        app.update();
        if done(app.world()) {
            return;
        }
    }
    panic!("{most} frames without: {what}");
}
