//! The systems of the app, driven by its keys, without a window and without drawing.
#![cfg(feature = "render")]

use bevy::input::ButtonState;
use bevy::input::keyboard::{Key, KeyboardInput};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::settings::WgpuSettings;
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use clap::Parser;
use marathon_game::app::{
    Actor, Args, Ball, Bindings, Deed, Focus, GamePlugin, Lesson, Mode, Playback, Recorder, Recording, Show,
};
use marathon_game::axes::to_game;
use marathon_game::look::CameraMode;
use marathon_game::prelude::*;
use marathon_render::Scene;
use std::path::Path;
use std::time::{Duration, Instant};

fn app(words: &[&str]) -> App {
    let args = Args::parse_from([&["marathon-game"], words].concat());
    let mut app = App::new();
    let window = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let render = RenderPlugin { render_creation: WgpuSettings { backends: None, ..default() }.into(), ..default() };
    let plugins = DefaultPlugins.set(window).set(render).disable::<WinitPlugin>().disable::<bevy::log::LogPlugin>();
    app.add_plugins(plugins).add_plugins(GamePlugin::new(&args).expect("the command line makes sense"));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
    app.finish();
    app.cleanup();
    app.update();
    app.insert_resource(Bindings::default());
    frames(&mut app, 3);
    app
}

fn frames(app: &mut App, n: usize) {
    (0..n).for_each(|_| app.update());
}

/// Presses the key that does something, as a window would send it.
fn press(app: &mut App, deed: Deed) {
    let name = app.world().resource::<Bindings>().key(deed);
    let key_code = match name {
        "Space" => KeyCode::Space,
        "Tab" => KeyCode::Tab,
        "Up" => KeyCode::ArrowUp,
        "Left" => KeyCode::ArrowLeft,
        "Right" => KeyCode::ArrowRight,
        "N" => KeyCode::KeyN,
        "P" => KeyCode::KeyP,
        "B" => KeyCode::KeyB,
        "L" => KeyCode::KeyL,
        "R" => KeyCode::KeyR,
        "Q" => KeyCode::KeyQ,
        other => panic!("the tests do not press '{other}'"),
    };
    for state in [ButtonState::Pressed, ButtonState::Released] {
        let key = Key::Character(name.into());
        let window = Entity::PLACEHOLDER;
        app.world_mut().write_message(KeyboardInput {
            key_code,
            logical_key: key,
            state,
            text: None,
            repeat: false,
            window,
        });
        app.update();
    }
}

fn actors(app: &mut App) -> Vec<(usize, Episode)> {
    let mut query = app.world_mut().query::<(&Actor, &Episode)>();
    let mut all: Vec<_> = query.iter(app.world()).map(|(a, e)| (a.0, e.clone())).collect();
    all.sort_by_key(|(number, _)| *number);
    all
}

#[test]
fn a_row_runs_and_the_focus_moves() {
    let mut app = app(&["hopper", "--agents", "5"]);
    frames(&mut app, 150);
    let all = actors(&mut app);
    assert_eq!(all.len(), 5);
    assert!(all.iter().all(|(_, e)| e.distance > 2.0), "{all:?}");
    press(&mut app, Deed::NextFocus);
    assert_eq!(app.world().resource::<Focus>().0, 1);
    let mut cameras = app.world_mut().query::<&FollowCamera>();
    let target = cameras.single(app.world()).expect("one camera").target.expect("it follows somebody");
    assert_eq!(app.world().get::<Actor>(target).map(|a| a.0), Some(1));
    // one can look about while the time stands still
    press(&mut app, Deed::Pause);
    frames(&mut app, 5);
    let before = cameras.single(app.world()).expect("one camera").clone();
    let mut turned = app.world_mut().query::<&mut FollowCamera>();
    turned.single_mut(app.world_mut()).expect("one camera").turn(1.0, 0.0);
    frames(&mut app, 50);
    let after = cameras.single(app.world()).expect("one camera");
    assert!((after.yaw - before.yaw - 1.0).abs() < 0.05, "{} and {}", before.yaw, after.yaw);
}

#[test]
fn agents_take_turns_and_time_stops() {
    let mut app = app(&["hopper"]);
    press(&mut app, Deed::NextAgent);
    frames(&mut app, 60);
    assert_eq!(app.world().resource::<Show>().agent, "Walker2d-v0");
    let (_, episode) = actors(&mut app)[0].clone();
    assert!(episode.distance > 0.5, "{episode:?}");
    press(&mut app, Deed::Pause);
    let before = actors(&mut app);
    frames(&mut app, 20);
    assert_eq!(actors(&mut app), before, "paused");
}

#[test]
fn pushes_are_felt() {
    let [mut alone, mut struck] = [app(&["hopper", "--mode", "push"]), app(&["hopper", "--mode", "push"])];
    for app in [&mut alone, &mut struck] {
        frames(app, 50);
    }
    press(&mut struck, Deed::Push);
    frames(&mut alone, 2);
    for app in [&mut alone, &mut struck] {
        frames(app, 50);
    }
    assert_ne!(actors(&mut alone), actors(&mut struck));
}

/// Center of mass of the only character, m, and its mass, kg.
fn center(app: &mut App) -> (Vec3, f32) {
    let mut query = app.world_mut().query_filtered::<(&RagdollState, &Anatomy), With<Actor>>();
    let (key, anatomy) = query.single(app.world()).expect("one character");
    let state = app.world().resource::<Marathon>().state(key).expect("it is simulated");
    let pose = Scene::pose_from_qpos(&anatomy.model, &state.qpos).expect("a sound state");
    (to_game(pose.com), anatomy.model.bodies.iter().map(|body| body.mass as f32).sum())
}

/// Velocity of the only ball.
fn ball(app: &mut App) -> Vec3 {
    app.world_mut().query::<&Ball>().single(app.world()).expect("one ball").velocity()
}

#[test]
fn a_thrown_ball_hits_from_any_distance_and_moves_whom_it_hits() {
    // a hopper lives in a plane: what comes from the side only bounces off it
    let cases = [
        ("hopper", CameraMode::Chase, &[2.5_f32, 6.0, 14.0][..]),
        ("humanoid", CameraMode::Side, &[4.0, 9.0]),
        ("ant", CameraMode::Side, &[3.0, 12.0]),
    ];
    for (agent, camera, distances) in cases {
        for distance in distances {
            let case = format!("{agent} from {distance} m");
            let [mut alone, mut struck] = [(); 2].map(|()| app(&[agent, "--mode", "push"]));
            let mut cameras = struck.world_mut().query::<&mut FollowCamera>();
            let mut follow = cameras.single_mut(struck.world_mut()).expect("one camera");
            follow.set_mode(camera);
            follow.goal[2] = *distance;
            for app in [&mut alone, &mut struck] {
                frames(app, 100);
            }
            press(&mut struck, Deed::Throw);
            frames(&mut alone, 2);
            assert_eq!(center(&mut alone), center(&mut struck), "{case}: nothing has happened yet");
            // until it bounces off: its flight over the ground is straight before
            let thrown = ball(&mut struck);
            let flight = (distance / 11.0 / 0.02) as usize + 25;
            let mut gone = Vec3::ZERO;
            for _ in 0..flight {
                frames(&mut alone, 1);
                frames(&mut struck, 1);
                gone = (ball(&mut struck) - thrown) * Vec3::new(1.0, 0.0, 1.0);
                if gone.length() > 1.0 {
                    break;
                }
            }
            assert!(gone.length() > 1.0, "{case}: it has missed");
            // the momentum that the ball has lost is what the character has got
            let struck_with = -1.5 * gone;
            frames(&mut alone, 10);
            frames(&mut struck, 10);
            let (before, mass) = center(&mut alone);
            let shift = (center(&mut struck).0 - before).dot(struck_with.normalize());
            let free = struck_with.length() / mass * 0.2;
            assert!(shift > 0.2 * free && shift < 2.0 * free, "{case}: moved by {shift} m, {free} m if it were free");
        }
    }
}

#[test]
fn learning_begins_from_random_weights_and_ends() {
    let mut app = app(&["hopper", "--mode", "learn", "--threads", "1"]);
    let begun = Instant::now();
    // a few iterations of the real trainer
    while app.world().get_resource::<Lesson>().is_none_or(|l| l.progress().curve.len() < 3) {
        app.update();
        std::thread::sleep(Duration::from_millis(5));
        assert!(begun.elapsed() < Duration::from_secs(120), "no progress");
    }
    frames(&mut app, 30);
    let (_, episode) = actors(&mut app)[0].clone();
    assert!(episode.action.iter().any(|a| *a != 0.0), "the newest policy acts");
    press(&mut app, Deed::Pause);
    std::thread::sleep(Duration::from_secs(2));
    let waiting = app.world().resource::<Lesson>().progress();
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(app.world().resource::<Lesson>().progress().curve, waiting.curve, "the trainer waits");
    press(&mut app, Deed::Learn);
    frames(&mut app, 3);
    assert!(app.world().get_resource::<Lesson>().is_none());
    assert_eq!(app.world().resource::<Show>().mode, Mode::Watch);
}

#[test]
fn what_is_recorded_is_shown_again() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    // recordings go to the present folder; no other test here looks at it
    std::env::set_current_dir(folder.path())?;
    let mut app = app(&["hopper", "--agents", "2"]);
    press(&mut app, Deed::Record);
    assert!(app.world().get_resource::<Recorder>().is_some());
    frames(&mut app, 100);
    press(&mut app, Deed::Record);
    let path = Path::new("hopper-1.replay");
    let recording = Recording::load(path)?;
    assert!(recording.agents == 2 && (1.5..2.5).contains(&recording.seconds()), "{} s", recording.seconds());

    let mut app = app_of_replay(path);
    frames(&mut app, 50);
    let at = app.world().resource::<Playback>().at;
    assert!((0.8..1.2).contains(&at), "{at}");
    let half = actors(&mut app)[1].1.distance;
    app.world_mut().resource_mut::<Playback>().at = 0.1;
    frames(&mut app, 1);
    assert!(actors(&mut app)[1].1.distance < half, "scrubbed back");
    press(&mut app, Deed::Pause);
    for (deed, expected) in
        [(Deed::Ahead, 0.6), (Deed::Ahead, 1.1), (Deed::Back, 0.6), (Deed::Back, 0.1), (Deed::Back, 0.0)]
    {
        press(&mut app, deed);
        let at = app.world().resource::<Playback>().at;
        assert!((at - expected).abs() < 0.1, "{deed:?}: {at} s, expected {expected}");
    }
    Ok(())
}

fn app_of_replay(path: &Path) -> App {
    app(&["--replay", &path.display().to_string()])
}

#[test]
fn any_model_moves_by_sliders() -> Result<(), Box<dyn std::error::Error>> {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/gymnasium/half_cheetah.xml");
    let mut app = app(&[&model.display().to_string()]);
    frames(&mut app, 30);
    let mut query = app.world_mut().query_filtered::<(Entity, &Anatomy), With<Actor>>();
    let (entity, anatomy) = query.single(app.world())?;
    let nu = anatomy.model.nu;
    app.world_mut().entity_mut(entity).insert(Controls(vec![1.0; nu]));
    frames(&mut app, 10);
    let key = app.world().get::<RagdollState>(entity).copied().ok_or("it is simulated")?;
    let state = app.world().resource::<Marathon>().state(&key).ok_or("it has a state")?;
    assert!(state.qvel.iter().any(|v| v.abs() > 0.5), "{state:?}");
    Ok(())
}
