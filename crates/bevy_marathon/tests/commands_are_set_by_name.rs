//! An app commands a character by the names of its task's numbers. A wrong name or value is refused and changes nothing. The rover of
//! `examples/rover.rs` takes a velocity.

#[allow(dead_code, reason = "a part of it is enough")]
mod common;
#[path = "../../../examples/rover.rs"]
mod rover;

use bevy::prelude::*;
use bevy_marathon::prelude::*;
use std::sync::{Arc, LazyLock};
use std::time::Duration;

/// Twenty milliseconds, the rover's decision.
const FRAME: Duration = Duration::from_millis(20);

/// Registers the rover once.
static REGISTERED: LazyLock<()> =
    LazyLock::new(|| marathon_envs::register(Arc::new(rover::Rover)).expect("its facts fit its model"));

/// An app, and some of the characters of an agent in it, after their first decisions.
fn app_with(agent: &str, count: usize) -> (App, Vec<Entity>) {
    LazyLock::force(&REGISTERED);
    let mut app = common::app(FRAME);
    let characters = (0..count).map(|_| app.world_mut().spawn(Ragdoll::agent(agent)).id()).collect();
    frames(&mut app, 3);
    (app, characters)
}

fn frames(app: &mut App, n: usize) {
    (0..n).for_each(|_| app.update());
}

/// The velocity that a character observes.
fn observed(app: &App, character: Entity) -> f64 {
    app.world().get::<Episode>(character).expect("it is simulated").command[0]
}

fn command(app: &mut App, character: Entity) -> Mut<'_, AgentCommand> {
    app.world_mut().get_mut::<AgentCommand>(character).expect("it takes commands")
}

#[test]
fn a_number_that_is_set_is_observed_until_its_release() -> Result<(), CommandError> {
    let (mut app, characters) = app_with("rover", 2);
    let [steered, twin] = characters[..] else { panic!("there are two") };
    // characters of one seed and number have one schedule
    assert_eq!(observed(&app, steered), observed(&app, twin));
    assert_eq!(command(&mut app, steered).values(), None);
    for velocity in [1.5, -2.0] {
        command(&mut app, steered).set("velocity", velocity)?;
        frames(&mut app, 3);
        assert_eq!((observed(&app, steered), command(&mut app, steered).get("velocity")), (velocity, Some(velocity)));
        assert_ne!(observed(&app, twin), velocity);
    }
    command(&mut app, steered).release();
    frames(&mut app, 3);
    assert_eq!(observed(&app, steered), observed(&app, twin));
    command(&mut app, steered).set("velocity", 1.0)?;
    frames(&mut app, 3);
    app.world_mut().entity_mut(steered).remove::<AgentCommand>();
    frames(&mut app, 3);
    assert_eq!(observed(&app, steered), observed(&app, twin));
    Ok(())
}

#[test]
fn wrong_names_and_values_are_refused_and_change_nothing() -> Result<(), CommandError> {
    let (mut app, characters) = app_with("rover", 1);
    command(&mut app, characters[0]).set("velocity", 1.5)?;
    for (name, value, expected) in [
        ("speed", 1.0, "no command 'speed'; known: velocity"),
        ("velocty", 1.0, "no command 'velocty'; did you mean 'velocity'? known: velocity"),
        ("velocity", 2.5, "command 'velocity' is 2.5, expected -2 to 2 m/s"),
        ("velocity", f64::NAN, "command 'velocity' is NaN, expected -2 to 2 m/s"),
    ] {
        let error = command(&mut app, characters[0]).set(name, value).expect_err("it is wrong");
        assert_eq!(error.to_string(), expected);
        frames(&mut app, 3);
        assert_eq!(observed(&app, characters[0]), 1.5);
    }
    Ok(())
}

#[test]
fn only_agents_that_take_commands_have_one() {
    let (app, characters) = app_with("hopper", 1);
    assert!(app.world().get::<Episode>(characters[0]).is_some_and(|episode| episode.decisions > 0));
    assert!(app.world().get::<AgentCommand>(characters[0]).is_none());
}

/// It is that of the first decision, without a frame by the schedule.
#[test]
fn a_command_can_be_spawned_with_its_character() -> Result<(), Box<dyn std::error::Error>> {
    let (mut app, _) = app_with("rover", 0);
    let ranges = marathon_envs::registry::agent("rover")?.facts().command;
    let mut command = AgentCommand::new(&ranges);
    command.set("velocity", 0.5)?;
    let rover = app.world_mut().spawn((Ragdoll::agent("rover"), command)).id();
    common::run_until(&mut app, 10, "its first decision", |world| {
        world.get::<Episode>(rover).is_some_and(|episode| episode.decisions > 0)
    });
    assert_eq!(observed(&app, rover), 0.5);
    // a command of another task is not taken over
    let other = AgentCommand::new(&[marathon_envs::CommandRange::new("speed", 0.0..=1.0, "m/s")]);
    let rover = app.world_mut().spawn((Ragdoll::agent("rover"), other)).id();
    frames(&mut app, 3);
    assert_eq!(self::command(&mut app, rover).ranges(), ranges);
    Ok(())
}

#[test]
fn a_character_that_takes_a_free_lane_is_not_commanded() -> Result<(), CommandError> {
    let (mut app, characters) = app_with("rover", 1);
    command(&mut app, characters[0]).set("velocity", -2.0)?;
    frames(&mut app, 3);
    assert!(app.world_mut().despawn(characters[0]));
    frames(&mut app, 3);
    let next = app.world_mut().spawn(Ragdoll::agent("rover")).id();
    frames(&mut app, 3);
    assert_ne!(observed(&app, next), -2.0);
    Ok(())
}
