//! A player steers characters in `marathon-game` with sticks and arrow keys. The rover of `examples/rover.rs` takes a velocity; the
//! trained one of the plugin's example `steer` drives at it.

#[allow(dead_code, reason = "its window stays closed")]
#[path = "../../bevy_marathon/examples/steer.rs"]
mod steer;

use crate::devices::{key, pad, press, pull, push};
use crate::windowless::{self, frames};
use bevy::input::ButtonState;
use bevy::input::gamepad::{GamepadAxis, GamepadButton};
use bevy::prelude::*;
use bevy_marathon::look::CameraMode;
use bevy_marathon::prelude::*;
use clap::Parser;
use marathon_game::app::{Action, Actor, Args, Bindings, Steering};
use std::sync::LazyLock;
use std::time::Duration;

/// Twenty milliseconds, the rover's decision.
const FRAME: Duration = Duration::from_millis(20);

/// The rover, registered once, and its policy.
static ROVER: LazyLock<marathon_learn::Policy> = LazyLock::new(|| steer::learn().expect("the rover learns"));

/// The game with the rover, without a window.
fn game(words: &[&str]) -> App {
    LazyLock::force(&ROVER);
    game_of("rover", words)
}

/// The game with an agent, without a window.
fn game_of(agent: &str, words: &[&str]) -> App {
    windowless::game(&[&[agent], words].concat(), FRAME, |_| ())
}

/// Commands of the actors, in their order.
fn commands(app: &mut App) -> Vec<(f64, bool)> {
    let mut query = app.world_mut().query::<(&Actor, &Episode, &AgentCommand)>();
    let mut all: Vec<_> =
        query.iter(app.world()).map(|(a, e, mine)| (a.0, (e.command[0], mine.values().is_some()))).collect();
    all.sort_by_key(|(number, _)| *number);
    all.into_iter().map(|(_, told)| told).collect()
}

#[test]
fn stick_and_arrow_keys_steer_the_character_in_focus() {
    let mut app = game(&["--agents", "2"]);
    let pad = pad(&mut app);
    assert_eq!(
        *app.world().resource::<Steering>(),
        Steering { on: true, buttons: false, by_camera: false, flying: false }
    );
    let own = commands(&mut app);
    assert!(own.iter().all(|(x, mine)| x.abs() <= 2.0 && !mine) && own[0] != own[1], "{own:?}");
    // beyond the dead zone of 0.12 it begins at 0, and its end is the range's
    for (stick, expected) in [(0.56, 1.0), (-0.56, -1.0), (1.0, 2.0), (0.1, 0.0)] {
        push(&mut app, pad, GamepadAxis::LeftStickY, stick);
        frames(&mut app, 3);
        let told = commands(&mut app);
        assert!((told[0].0 - expected).abs() < 1e-6 && told[0].1 && !told[1].1, "{stick}: {told:?}");
    }
    push(&mut app, pad, GamepadAxis::LeftStickY, 0.0);
    // the right stick is the camera's
    push(&mut app, pad, GamepadAxis::RightStickY, 1.0);
    frames(&mut app, 3);
    assert_eq!(commands(&mut app)[0], (0.0, true));
    push(&mut app, pad, GamepadAxis::RightStickY, 0.0);
    // the arrow keys do nothing else meanwhile
    key(&mut app, KeyCode::ArrowUp, ButtonState::Pressed);
    frames(&mut app, 3);
    assert_eq!(commands(&mut app)[0], (2.0, true));
    assert_eq!(app.world().resource::<Time<Virtual>>().relative_speed(), 1.0);
    key(&mut app, KeyCode::ArrowUp, ButtonState::Released);
    frames(&mut app, 3);
    assert_eq!(commands(&mut app)[0], (0.0, true));
    // let go
    assert_eq!(app.world().resource::<Bindings>().key(Action::Release), "G");
    press(&mut app, pad, GamepadButton::LeftThumb);
    frames(&mut app, 3);
    let told = commands(&mut app);
    assert!(!told[0].1 && told[0].0 != 0.0, "{told:?}");
    // another in focus: the stick goes with it
    push(&mut app, pad, GamepadAxis::LeftStickY, 1.0);
    key(&mut app, KeyCode::Tab, ButtonState::Pressed);
    frames(&mut app, 4);
    let told = commands(&mut app);
    assert!(!told[0].1 && told[0].0 != 2.0 && told[1] == (2.0, true), "{told:?}");
}

/// Each gamepad has a character: the first one that in focus, as the keys, the second one the next.
#[test]
fn a_second_gamepad_leads_the_next_character() {
    let mut app = game(&["--agents", "3"]);
    let [first, second] = [pad(&mut app), pad(&mut app)];
    push(&mut app, second, GamepadAxis::LeftStickY, -1.0);
    frames(&mut app, 3);
    let told = commands(&mut app);
    assert!(!told[0].1 && told[1] == (-2.0, true) && !told[2].1, "{told:?}");
    push(&mut app, first, GamepadAxis::LeftStickY, 1.0);
    frames(&mut app, 3);
    let told = commands(&mut app);
    assert!(told[0] == (2.0, true) && told[1] == (-2.0, true) && !told[2].1, "{told:?}");
    // the keys are the first player's
    push(&mut app, first, GamepadAxis::LeftStickY, 0.0);
    key(&mut app, KeyCode::ArrowDown, ButtonState::Pressed);
    frames(&mut app, 3);
    let told = commands(&mut app);
    assert!(told[0] == (-2.0, true) && told[1] == (-2.0, true), "{told:?}");
    // with the focus on the last one, the second player has the first one
    key(&mut app, KeyCode::ArrowDown, ButtonState::Released);
    for _ in 0..2 {
        key(&mut app, KeyCode::Tab, ButtonState::Pressed);
        key(&mut app, KeyCode::Tab, ButtonState::Released);
    }
    frames(&mut app, 4);
    let told = commands(&mut app);
    assert!(told[0] == (-2.0, true) && !told[1].1, "{told:?}");
}

/// Inputs from the command line are held for their duration: keys belong to the first player, a second gamepad to the
/// next.
#[test]
fn held_keys_and_sticks_steer() {
    let holds = ["0.4-0.8:key:up", "0.8-1:key:down", "0.6-1.2:pad2:left-y=-0.56", "1.2-1.6:pad2:left-y"];
    let mut app = game(&[&["--agents", "2"], &holds.map(|hold| ["--input", hold]).concat()[..]].concat());
    let mut told: [Vec<f64>; 2] = Default::default();
    for _ in 0..100 {
        frames(&mut app, 1);
        for (told, (x, mine)) in told.iter_mut().zip(commands(&mut app)) {
            told.extend(mine.then_some(x));
        }
    }
    // frames of 20 ms, and a command arrives with a decision, which is as long
    for (told, expected) in told.iter().zip([[(2.0, 20), (-2.0, 10), (0.0, 40)], [(-1.0, 30), (2.0, 20), (0.0, 10)]]) {
        let runs = told.chunk_by(|a, b| a == b).map(|run| (run[0], run.len()));
        for ((x, length), (wanted, frames)) in runs.clone().zip(expected) {
            let long_enough = if wanted == 0.0 { length >= frames } else { length.abs_diff(frames) <= 2 };
            assert!(
                (x - wanted).abs() < 1e-6 && long_enough,
                "{x} for {length} frames, expected {wanted} for {frames}"
            );
        }
        assert_eq!(runs.count(), expected.len(), "{told:?}");
    }
}

/// The Ant goes where the stick, the triggers and the keys A and D say; the mapping is what the command line says.
#[test]
fn who_can_step_aside_does_so_by_triggers_and_keys() {
    let mut app = game_of(
        "AntController",
        &["--steering", "character", "--curve", "2", "--smoothing", "0.1", "--key-smoothing", "0.2"],
    );
    let pad = pad(&mut app);
    let command = |app: &mut App| {
        let mut query = app.world_mut().query::<&Episode>();
        query.iter(app.world()).next().expect("one Ant").command.clone()
    };
    let arrived = |told: &[f64], expected: [f64; 3]| told.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6);
    for (pushed, button, expected) in
        [(1.0, GamepadButton::LeftTrigger2, 2.0), (1.0, GamepadButton::RightTrigger2, -2.0)]
    {
        pull(&mut app, pad, button, pushed);
        // 0.1 s in frames of 20 ms: two thirds of it, and some frames until it is observed
        frames(&mut app, 5);
        let told = command(&mut app)[1] / expected;
        assert!((0.45..0.9).contains(&told), "{told}");
        frames(&mut app, 60);
        let told = command(&mut app);
        assert!(arrived(&told, [0.0, expected, 0.0]), "{told:?}");
        pull(&mut app, pad, button, 0.0);
        frames(&mut app, 60);
    }
    // a square behind the dead zone: half of the way says a quarter
    push(&mut app, pad, GamepadAxis::LeftStickY, 0.56);
    frames(&mut app, 60);
    let told = command(&mut app);
    assert!(arrived(&told, [0.75, 0.0, 0.0]), "{told:?}");
    push(&mut app, pad, GamepadAxis::LeftStickY, 0.0);
    frames(&mut app, 60);
    key(&mut app, KeyCode::KeyD, ButtonState::Pressed);
    frames(&mut app, 100);
    let told = command(&mut app);
    assert!(arrived(&told, [0.0, -2.0, 0.0]), "{told:?}");
}

#[test]
fn a_mapping_that_makes_no_sense_is_refused() {
    for (words, expected) in [
        (["--dead-zone", "1"], "a number from 0 to below 1"),
        (["--curve", "0"], "a number above 0, up to 10"),
        (["--smoothing", "nan"], "seconds from 0 to 10"),
    ] {
        let error = Args::try_parse_from([&["marathon-game", "AntController"][..], &words].concat()).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn an_agent_without_commands_leaves_stick_and_keys_as_they_were() {
    LazyLock::force(&ROVER);
    let mut app = game(&[]);
    windowless::load(&mut app, |scenario| scenario.agent = "Hopper-v0".into());
    frames(&mut app, 5);
    assert_eq!(*app.world().resource::<Steering>(), Steering::default());
    key(&mut app, KeyCode::ArrowUp, ButtonState::Pressed);
    frames(&mut app, 2);
    assert_eq!(app.world().resource::<Time<Virtual>>().relative_speed(), 2.0);
}

/// The policy that comes with him is good enough to be led: he runs when the stick is up, and stands when it is released.
#[test]
fn marathon_man_goes_as_the_stick_says() {
    let mut app = game_of("MarathonManSteer", &["--steering", "character"]);
    let pad = pad(&mut app);
    let errors = |app: &mut App, seconds: usize| {
        let mut sum = 0.0;
        for _ in 0..50 * seconds {
            app.update();
            let mut query = app.world_mut().query_filtered::<&Episode, With<Actor>>();
            let episode = query.single(app.world()).expect("he is alone");
            assert_eq!(episode.number, 1, "he has not fallen: {episode:?}");
            sum += f64::from(episode.info[0]);
        }
        sum / (50 * seconds) as f64
    };
    for (stick, speed) in [(1.0, 3.0), (0.0, 0.0)] {
        push(&mut app, pad, GamepadAxis::LeftStickY, stick);
        errors(&mut app, 3);
        assert_eq!(commands(&mut app), [(speed, true)]);
        let error = errors(&mut app, 2);
        assert!(error < 0.5, "{error} m/s off {speed}");
    }
}

/// Place and velocity along the ground of the only character.
fn motion(app: &mut App) -> (Vec3, Vec3) {
    let mut query = app.world_mut().query_filtered::<(&RagdollState, &Track), With<Actor>>();
    let (key, track) = query.single(app.world()).expect("one character");
    let state = app.world().resource::<Marathon>().state(key).expect("it is simulated");
    let at = |v: &[f64]| bevy_marathon::axes::to_game([v[0], v[1], 0.0]);
    (track.place().transform_point(at(&state.qpos)), track.place().rotation * at(&state.qvel))
}

/// The only camera, and where it is.
fn camera(app: &mut App) -> (Mut<'_, FollowCamera>, Transform) {
    let mut query = app.world_mut().query::<(&mut FollowCamera, &Transform)>();
    let (camera, at) = query.single_mut(app.world_mut()).expect("one camera");
    (camera, *at)
}

#[test]
fn the_stick_points_into_the_picture() {
    let mut app = game_of("MarathonManController", &["--seed", "3"]);
    let pad = pad(&mut app);
    let steering = Steering { on: true, buttons: true, by_camera: true, flying: false };
    assert_eq!((*app.world().resource::<Steering>(), camera(&mut app).0.mode), (steering, CameraMode::Chase));
    // it stands where it is put
    camera(&mut app).0.mode = CameraMode::Held;
    for (x, y) in [(0.0, 0.6), (0.6, 0.0), (0.0, -0.6), (-0.6, 0.0), (0.45, 0.45)] {
        push(&mut app, pad, GamepadAxis::LeftStickX, x);
        push(&mut app, pad, GamepadAxis::LeftStickY, y);
        frames(&mut app, 100);
        let from = motion(&mut app).0;
        frames(&mut app, 50);
        let way = motion(&mut app).0 - from;
        let (_, at) = camera(&mut app);
        let pointed = x * at.right().with_y(0.0).normalize() + y * at.forward().with_y(0.0).normalize();
        let angle = way.angle_between(pointed).to_degrees();
        assert!(angle < 25.0 && way.length() > 0.7, "({x}, {y}): {angle} degrees off, {} m", way.length());
    }
    // he stands without a stick, and jumps meanwhile
    for axis in [GamepadAxis::LeftStickX, GamepadAxis::LeftStickY] {
        push(&mut app, pad, axis, 0.0);
    }
    press(&mut app, pad, GamepadButton::South);
    frames(&mut app, 3);
    let command = |app: &mut App| {
        let mut query = app.world_mut().query::<&AgentCommand>();
        query.single(app.world()).expect("one character").values().map(<[f64]>::to_vec)
    };
    assert_eq!(command(&mut app).map(|values| values[..3].to_vec()), Some(vec![0.0; 3]));
    // released, he follows his schedule
    press(&mut app, pad, GamepadButton::LeftThumb);
    frames(&mut app, 3);
    assert_eq!(command(&mut app), None);
    assert!(app.world_mut().query::<&MoveDirection>().iter(app.world()).next().is_none());
}

#[test]
fn shift_runs_and_letters_walk() {
    let mut app = game_of("MarathonManController", &["--seed", "3"]);
    let speed = |app: &mut App| {
        frames(app, 150);
        let from = motion(app).0;
        frames(app, 50);
        (motion(app).0 - from).length()
    };
    key(&mut app, KeyCode::KeyW, ButtonState::Pressed);
    let walk = speed(&mut app);
    key(&mut app, KeyCode::ShiftLeft, ButtonState::Pressed);
    let run = speed(&mut app);
    assert!((1.1..1.8).contains(&walk) && run > 2.2, "{walk} and {run} m/s");
    assert_eq!(app.world().resource::<Time<Virtual>>().relative_speed(), 1.0);
}

/// Height of the only character's pelvis, m.
fn pelvis(app: &mut App) -> f32 {
    let mut query = app.world_mut().query_filtered::<&RagdollState, With<Actor>>();
    let key = query.single(app.world()).expect("one character");
    app.world().resource::<Marathon>().state(key).expect("it is simulated").qpos[2] as f32
}

/// Half of the camera's vertical field of view, rad.
fn lens(app: &mut App) -> f32 {
    let mut query = app.world_mut().query_filtered::<&Projection, With<FollowCamera>>();
    match query.single(app.world()).expect("one camera") {
        Projection::Perspective(lens) => 0.5 * lens.fov,
        _ => panic!("it has a perspective"),
    }
}

/// On a circle of five meters the character stays in the middle third of the picture, and the camera gets behind it.
#[test]
fn the_camera_stays_behind_who_runs_in_a_circle() {
    let mut app = game_of("MarathonManController", &["--seed", "3", "--steering", "character"]);
    let pad = pad(&mut app);
    // 1.5 m/s and 0.3 rad/s, beyond the dead zone
    push(&mut app, pad, GamepadAxis::LeftStickY, 0.56);
    push(&mut app, pad, GamepadAxis::LeftStickX, -0.288);
    let (mut aside, mut over, mut places) = (0.0_f32, 0.0_f32, Vec::new());
    for frame in 0..50 * 30 {
        app.update();
        let place = motion(&mut app).0;
        places.push(place);
        let (_, at) = camera(&mut app);
        let seen = at.compute_affine().inverse().transform_point3(place.with_y(pelvis(&mut app)));
        // half of the picture's height at a distance of 1 m; the picture is 16 to 9
        let half = lens(&mut app).tan();
        aside = aside.max((seen.x / (-seen.z * half * 16.0 / 9.0)).abs());
        over = over.max((seen.y / (-seen.z * half)).abs());
        assert!(at.translation.y > 0.05, "above the ground");
        // his way in the last second: a step sways
        if frame > 50 * 10 {
            let behind = at.forward().with_y(0.0).angle_between(place - places[frame - 50]).to_degrees();
            assert!(behind < 60.0, "{behind} degrees after {frame} frames");
        }
    }
    assert!(aside < 1.0 / 3.0 && over < 1.0 / 3.0, "{aside} of half the width, {over} of half the height");
}

/// The ends of the episodes so far.
#[derive(Resource, Default)]
struct Ends(Vec<End>);

/// Steers each agent for ten minutes. A steered character has no time limit, its episode says so, and it continues
/// after release.
#[test]
fn a_steered_character_is_never_taken_back() {
    for (agent, stick) in [("MarathonManController", 0.3), ("WalkerController", 0.0), ("AntController", 0.3)] {
        // the longest frames that the game allows
        let mut app = windowless::game(&[agent, "--seed", "5"], Duration::from_millis(200), |app| {
            app.init_resource::<Ends>();
            app.add_systems(Update, |mut ends: ResMut<Ends>, mut ended: MessageReader<EpisodeEnded>| {
                ends.0.extend(ended.read().map(|ended| ended.end));
            });
        });
        let pad = pad(&mut app);
        push(&mut app, pad, GamepadAxis::LeftStickY, 0.2);
        push(&mut app, pad, GamepadAxis::LeftStickY, stick);
        let mut query = app.world_mut().query_filtered::<(&Episode, &RagdollState), With<Actor>>();
        let mut last: Option<(u64, f64)> = None;
        let mut longest = 0.0_f64;
        for _ in 0..600 * 5 {
            app.update();
            let (episode, state) = query.single(app.world()).expect("one character");
            let at = app.world().resource::<Marathon>().state(state).map_or(0.0, |state| state.qpos[0]);
            if let Some((_, before)) = last.filter(|(number, _)| *number == episode.number) {
                let moved = at - before;
                assert!(moved.abs() < 2.0, "{agent} jumps by {moved} m in an episode: {episode:?}");
            }
            (last, longest) = (Some((episode.number, at)), longest.max(episode.seconds));
        }
        let (episode, _) = query.single(app.world()).expect("one character");
        assert!(longest > 60.0 && episode.untimed, "{agent}: {longest} s, {episode:?}");
        let number = episode.number;
        press(&mut app, pad, GamepadButton::LeftThumb);
        frames(&mut app, 3);
        let (episode, _) = query.single(app.world()).expect("one character");
        assert!(episode.number == number && episode.untimed, "{agent}: {episode:?}");
        let ends = &app.world().resource::<Ends>().0;
        assert!(!ends.contains(&End::TimeUp), "{agent}: {ends:?}");
    }
}

/// A character that is not steered keeps the task's time limit.
#[test]
fn who_is_not_steered_begins_anew_when_its_time_is_up() {
    let mut app = windowless::game(&["AntController", "--seed", "5"], Duration::from_millis(200), |_| ());
    let mut query = app.world_mut().query_filtered::<&Episode, With<Actor>>();
    let mut longest = 0.0_f64;
    while query.single(app.world()).expect("one Ant").number < 2 {
        app.update();
        let episode = query.single(app.world()).expect("one Ant");
        assert!(!episode.untimed, "{episode:?}");
        longest = longest.max(episode.seconds);
        assert!(longest < 60.0, "it has a time limit");
    }
}
