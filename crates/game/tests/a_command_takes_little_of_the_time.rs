//! Time from a device's event to the command, compared with the character's response time. With only a dead zone and a
//! curve, it is a frame and a decision. Smoothing adds 2.3 times its time until 90 % of the command. This test prints
//! the table in `docs/reference/game.md`.

#[path = "../../bevy_marathon/tests/common/devices.rs"]
mod devices;
#[path = "common/windowless.rs"]
mod windowless;

use bevy::input::ButtonState;
use bevy::input::gamepad::GamepadAxis;
use bevy::prelude::*;
use bevy_marathon::prelude::*;
use devices::{key, pad, push};
use std::time::Duration;
use windowless::frames;

/// Sixty frames per second, and seconds of one.
const FRAME: Duration = Duration::from_nanos(16_666_667);
const DT: f64 = 1.0 / 60.0;
/// Seconds of the Ant's decision.
const DECISION: f64 = 0.01;
/// Commanded speed, m/s, and the most frames until it is reached.
const FULL: f64 = 3.0;
const PATIENCE: usize = 180;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Device {
    Pad,
    Keys,
}

/// Seconds from the event until 90 % of the command, and of the speed, are there.
fn latency(device: Device, words: &[&str]) -> [f64; 2] {
    let mut app = windowless::game(
        &[&["AntController", "--agents", "1", "--steering", "character"], words].concat(),
        FRAME,
        |_| (),
    );
    let pad = pad(&mut app);
    // after its first command the character stays under command, and stands without input
    push(&mut app, pad, GamepadAxis::LeftStickY, 1.0);
    push(&mut app, pad, GamepadAxis::LeftStickY, 0.0);
    frames(&mut app, 240);
    // the event comes with the first frame
    match device {
        Device::Pad => push(&mut app, pad, GamepadAxis::LeftStickY, 1.0),
        Device::Keys => key(&mut app, KeyCode::ArrowUp, ButtonState::Pressed),
    }
    let mut found = [None; 2];
    for frame in 1..=PATIENCE {
        let mut query = app.world_mut().query::<(&RagdollState, &Episode)>();
        let (state, episode) = query.single(app.world()).expect("one Ant");
        let state = app.world().resource::<Marathon>().state(state).expect("it is simulated");
        let [vx, vy] = [state.qvel[0], state.qvel[1]];
        for (found, x) in found.iter_mut().zip([episode.command[0], vx.hypot(vy)]) {
            if x >= 0.9 * FULL && found.is_none() {
                *found = Some(frame as f64 * DT);
            }
        }
        app.update();
    }
    found.map(|time| time.unwrap_or_else(|| panic!("{device:?} {words:?}: {found:?}")))
}

#[test]
fn a_mapping_without_smoothing_costs_a_frame_and_a_decision() {
    println!("| device | settings | command, s | speed, s | share of the mapping |");
    for (device, words, smoothing) in [
        (Device::Pad, &[][..], 0.0),
        (Device::Pad, &["--dead-zone", "0.3", "--curve", "3"][..], 0.0),
        (Device::Pad, &["--smoothing", "0.1"][..], 0.1),
        (Device::Keys, &[][..], 0.0),
        (Device::Keys, &["--key-smoothing", "0.1"][..], 0.1),
    ] {
        let [command, speed] = latency(device, words);
        let share = 100.0 * command / speed;
        println!("| {device:?} | `{}` | {command:.3} | {speed:.2} | {share:.0} % |", words.join(" "));
        // 90 % of a word that comes exponentially
        let expected = smoothing * std::f64::consts::LN_10;
        let late = command - expected;
        assert!(late > -DT && late <= 2.0 * DT + DECISION, "{device:?} {words:?}: {command} s, expected {expected}");
        assert!(speed > command, "{device:?} {words:?}: {speed} s");
        assert!(smoothing > 0.0 || share < 10.0, "{device:?} {words:?}: {share} %");
    }
}
