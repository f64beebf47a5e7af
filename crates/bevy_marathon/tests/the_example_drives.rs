//! The rover of the example `steer` drives at the velocity that a gamepad sets.
#![cfg(feature = "window")]

#[allow(dead_code, reason = "its window stays closed")]
#[path = "../examples/steer.rs"]
mod steer;

use crate::common;
use crate::devices::{pad, press, push};
use bevy::input::InputPlugin;
use bevy::input::gamepad::{GamepadAxis, GamepadButton};
use bevy::prelude::*;
use bevy_marathon::prelude::*;
use std::time::Duration;

#[test]
fn the_rover_drives_as_the_stick_says() -> Result<(), Box<dyn std::error::Error>> {
    let policy = steer::learn()?;
    let mut app = common::app(Duration::from_millis(20));
    app.add_plugins((InputPlugin, steer::Driving(policy)));
    (0..3).for_each(|_| app.update());
    let pad = pad(&mut app);
    let mut rover = app.world_mut().query::<(&RagdollState, &Episode)>();
    let mut velocity = |app: &mut App| {
        (0..150).for_each(|_| app.update());
        let (state, episode) = rover.single(app.world()).expect("one rover");
        let qvel = app.world().resource::<Marathon>().state(state).expect("it is simulated").qvel;
        (episode.command[0], qvel[0])
    };
    for (stick, expected) in [(1.0, 2.0), (-1.0, -2.0), (0.0, 0.0)] {
        push(&mut app, pad, GamepadAxis::LeftStickY, stick);
        let (command, velocity) = velocity(&mut app);
        assert_eq!(command, expected);
        assert!((velocity - expected).abs() < 0.4, "told {expected} m/s, it drives at {velocity} m/s");
    }
    press(&mut app, pad, GamepadButton::South);
    assert_ne!(velocity(&mut app).0, 0.0, "its own schedule");
    Ok(())
}
