//! A character goes in the direction of the world that an app names, whatever it faces and wherever its track lies.

use crate::common;
use bevy::prelude::*;
use bevy_marathon::prelude::*;
use std::f32::consts::{PI, TAU};
use std::time::Duration;

/// Angles between direction and velocity, degrees, in order, and the mean speed, m/s.
struct Found {
    angles: Vec<f32>,
    speed: f32,
}

impl Found {
    /// The angle below which a share of the angles is.
    fn quantile(&self, share: f32) -> f32 {
        self.angles[((self.angles.len() - 1) as f32 * share).round() as usize]
    }
}

/// Sends a character in random directions for three seconds each, and measures its velocity in the last of them.
fn send(agent: &str, pace: f32, directions: usize) -> Found {
    const SECONDS: f32 = 3.0;
    let frame = Duration::from_millis(if agent.starts_with("Ant") { 10 } else { 25 });
    let mut app = common::app(frame);
    let policy = app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(common::policy(agent));
    // its track lies askew in the world
    let track = Transform::from_xyz(3.0, 0.0, -2.0).with_rotation(Quat::from_rotation_y(2.0));
    let restart = Restart { on_time_up: false, ..default() };
    let parts = (Ragdoll::agent(agent), CharacterPolicy(policy), track, restart, MoveDirection::default());
    let character = app.world_mut().spawn(parts).id();
    let place = |app: &App| {
        let world = app.world();
        let state = world.resource::<Marathon>().state(world.get::<RagdollState>(character)?)?;
        Some(track.transform_point(bevy_marathon::axes::to_game([state.qpos[0], state.qpos[1], 0.0])))
    };
    (0..3).for_each(|_| app.update());

    let frames = (SECONDS / frame.as_secs_f32()).round() as usize;
    let second = (1.0 / frame.as_secs_f32()).round() as usize;
    let (mut angles, mut speeds, mut random) = (Vec::new(), 0.0, 12345_u32);
    for _ in 0..directions {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let angle = (random >> 8) as f32 / (1 << 24) as f32 * TAU - PI;
        let direction = Vec3::new(angle.cos(), 0.0, angle.sin());
        app.world_mut().get_mut::<MoveDirection>(character).expect("it is there").direction = pace * direction;
        (0..frames - second).for_each(|_| app.update());
        let from = place(&app).expect("it is simulated");
        (0..second).for_each(|_| app.update());
        let way = place(&app).expect("it is simulated") - from;
        angles.push(way.angle_between(direction).to_degrees());
        speeds += way.length();
    }
    angles.sort_by(f32::total_cmp);
    Found { angles, speed: speeds / directions as f32 }
}

#[test]
fn marathon_man_turns_to_where_he_is_sent() {
    for (pace, speeds) in [(0.5, 1.2..1.6), (1.0, 2.0..3.0)] {
        let found = send("MarathonManController", pace, 100);
        let [median, most] = [0.5, 0.95].map(|share| found.quantile(share));
        println!("MarathonManController at {pace}: {median:.1} and {most:.1} degrees, {:.2} m/s", found.speed);
        assert!(median <= 10.0 && most <= 25.0, "pace {pace}: median {median} degrees, 95 % {most}");
        assert!(speeds.contains(&found.speed), "pace {pace}: {} m/s", found.speed);
    }
}

#[test]
fn the_ant_goes_there_without_turning() {
    let found = send("AntController", 0.5, 100);
    let [median, most] = [0.5, 0.95].map(|share| found.quantile(share));
    println!("AntController at 0.5: {median:.1} and {most:.1} degrees, {:.2} m/s", found.speed);
    assert!(median <= 5.0 && most <= 15.0, "median {median} degrees, 95 % {most}");
    assert!((1.0..1.8).contains(&found.speed), "{} m/s", found.speed);
}

#[test]
fn a_character_without_a_direction_stands_and_keeps_its_other_commands() -> Result<(), CommandError> {
    let mut app = common::app(Duration::from_millis(25));
    let character = app.world_mut().spawn((Ragdoll::agent("MarathonManController"), MoveDirection::default())).id();
    (0..3).for_each(|_| app.update());
    app.world_mut().get_mut::<AgentCommand>(character).expect("it takes commands").set("jump", 1.0)?;
    (0..3).for_each(|_| app.update());
    let values = |app: &App| {
        app.world().get::<AgentCommand>(character).and_then(|command| command.values().map(<[f64]>::to_vec))
    };
    assert_eq!(values(&app), Some(vec![0.0, 0.0, 0.0, 1.0, 0.0]));
    app.world_mut().get_mut::<MoveDirection>(character).expect("it is there").direction = Vec3::NEG_X;
    (0..3).for_each(|_| app.update());
    let moved = values(&app).expect("it has a command");
    assert!(moved[2].abs() > 1.0 && moved[3] == 1.0, "{moved:?}");
    // without the component the command stays as it is
    app.world_mut().entity_mut(character).remove::<MoveDirection>();
    (0..3).for_each(|_| app.update());
    assert_eq!(values(&app), Some(moved));
    Ok(())
}
