//! A rover that you drive: the left stick of a gamepad, or the arrow keys, set its velocity. Released, it stops. G, or the
//! button South, gives it back to its own schedule: `cargo run --release -p bevy_marathon --features window --example steer`
//!
//! Its agent, `examples/rover.rs`, takes a command. It learns for some seconds to follow its own schedule; then
//! [`AgentCommand`] sets the velocity.

#[path = "../../../examples/rover.rs"]
mod rover;

use bevy::input::gamepad::{Gamepad, GamepadAxis, GamepadButton};
use bevy::prelude::*;
use bevy_marathon::prelude::*;
use marathon_learn::{Control, IterationStats, Snapshot, TrainConfig, train};
use marathon_physics::lanes::Isa;
use std::error::Error;
use std::sync::Arc;

fn main() -> Result<(), Box<dyn Error>> {
    let policy = learn()?;
    App::new()
        .add_plugins(DefaultPlugins)
        .add_plugins((MarathonPlugin, LookPlugin, SceneryPlugin(Quality::Medium), FollowCameraPlugin))
        .add_plugins(Driving(policy))
        .add_systems(PostStartup, |mut commands: Commands, rover: Single<Entity, With<Ragdoll>>| {
            commands.spawn(FollowCamera::following(*rover));
        })
        .run();
    Ok(())
}

/// Registers the rover and learns to drive it.
pub fn learn() -> Result<marathon_learn::Policy, Box<dyn Error>> {
    marathon_envs::register(Arc::new(rover::Rover))?;
    let factory = marathon_envs::factory("rover", Isa::best())?;
    let config = TrainConfig::default().with(|config| {
        (config.run.agents, config.run.horizon, config.run.total_steps) = (256, 32, 600_000);
    });
    let mut quiet = |_: &IterationStats, _: &Snapshot<'_>| Control::Continue;
    Ok(train(&*factory, Isa::best(), &config, None, &mut quiet)?.policy)
}

/// A rover, and the system that drives it.
pub struct Driving(pub marathon_learn::Policy);

impl Plugin for Driving {
    fn build(&self, app: &mut App) {
        let policy = app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(self.0.clone());
        app.world_mut().spawn((Ragdoll::agent("rover"), CharacterPolicy(policy)));
        app.add_systems(Update, drive);
    }
}

/// The rover has its command as soon as it is simulated.
fn drive(
    pads: Query<&Gamepad>,
    keys: Res<ButtonInput<KeyCode>>,
    mut command: Single<&mut AgentCommand, With<Ragdoll>>,
) -> Result {
    if keys.just_pressed(KeyCode::KeyG) || pads.iter().any(|pad| pad.just_pressed(GamepadButton::South)) {
        command.release();
        return Ok(());
    }
    // Bevy has taken out the dead zone
    let stick: f32 = pads.iter().filter_map(|pad| pad.get(GamepadAxis::LeftStickY)).sum();
    let arrows = f32::from(keys.pressed(KeyCode::ArrowUp)) - f32::from(keys.pressed(KeyCode::ArrowDown));
    let ahead = f64::from((stick + arrows).clamp(-1.0, 1.0));
    if ahead != 0.0 || command.values().is_some() {
        // from -2 to 2 m/s
        command.set("velocity", 2.0 * ahead)?;
    }
    Ok(())
}
