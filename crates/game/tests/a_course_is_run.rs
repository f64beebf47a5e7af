//! Assault courses in the game: a policy runs, a player leads a runner, or builds the ground ahead of one by mouse and
//! keys. Finished runs enter the table of the longest runs, and their replays match them bit for bit, ground included.

use crate::windowless::{self, frames};
use bevy::input::ButtonState;
use bevy::input::keyboard::{Key, KeyboardInput};
use bevy::input::mouse::{MouseButtonInput, MouseScrollUnit, MouseWheel};
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use bevy_marathon::prelude::*;
use clap::Parser;
use marathon_envs::{Autoreset, VecEnvOptions};
use marathon_game::app::{
    Action, Actor, Args, Bindings, GamePlugin, List, Mode, Place, Playback, Recording, Run, Runs, Scenario, Step, Table,
};
use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Where a course's ground has a place, m: its first point and the distance of its points.
const FROM: f64 = -6.0;
const CELL: f64 = 0.1;

/// The game on a course, with a window that is never drawn.
fn game(table: &Path, words: &[&str]) -> App {
    let table = table.display().to_string();
    let words = [&["--table", &table, "--player", "Ada"], words].concat();
    windowless::game(&words, Duration::from_millis(20), |app| {
        app.init_resource::<Seen>().add_systems(FixedUpdate, see.after(MarathonSystems::Report));
        app.world_mut().spawn((Window { resolution: (800, 600).into(), ..default() }, PrimaryWindow));
    })
}

/// A decision of the only character: number of the episode, coordinates, elevations.
struct Decision {
    episode: u64,
    qpos: Vec<f64>,
    ground: Arc<Vec<Vec<f32>>>,
}

/// All decisions.
#[derive(Resource, Default)]
struct Seen(Vec<Decision>);

fn see(
    marathon: Res<Marathon>,
    mut seen: ResMut<Seen>,
    actors: Query<(&RagdollState, &Episode, &OwnGround), With<Actor>>,
) {
    for (state, episode, ground) in actors.iter().filter(|(_, episode, _)| !episode.down) {
        let qpos = marathon.state(state).map(|state| state.qpos).unwrap_or_default();
        seen.0.push(Decision { episode: episode.number, qpos, ground: ground.0.clone() });
    }
}

fn key(app: &mut App, key_code: KeyCode, state: ButtonState) {
    let (logical_key, window) = (Key::Character("key".into()), Entity::PLACEHOLDER);
    app.world_mut().write_message(KeyboardInput { key_code, logical_key, state, text: None, repeat: false, window });
    app.update();
}

fn press(app: &mut App, key_code: KeyCode) {
    key(app, key_code, ButtonState::Pressed);
    key(app, key_code, ButtonState::Released);
}

fn episode(app: &mut App) -> Episode {
    app.world_mut().query_filtered::<&Episode, With<Actor>>().single(app.world()).expect("one character").clone()
}

/// Runs until a run has ended, and returns it with its place.
fn run_to_the_end(app: &mut App) -> (Run, Place) {
    for _ in 0..2000 {
        app.update();
        if let Some(last) = app.world().resource::<Runs>().last.clone() {
            return last;
        }
    }
    panic!("no run ends: {:?}", episode(app));
}

fn height(ground: &[f32], x: f64) -> f32 {
    ground[((x - FROM) / CELL).round() as usize]
}

#[test]
fn a_policy_runs_and_nobody_meddles() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let table = folder.path().join("runs.sqlite");
    let words = ["--mode", "course", "--course", "boxes", "--difficulty", "0.8", "--seed", "4"];
    let mut app = game(&table, &words);
    assert_eq!(app.world().resource::<Scenario>().agent, "TerrainWalker2d-v0", "the default");
    let (run, place) = run_to_the_end(&mut app);
    assert_eq!((place.rank, place.of), (1, 1));
    assert!(run.distance > 5.0 && run.seconds > 1.0, "{run:?}");
    assert!(run.runner.starts_with("terrainwalker2d.safetensors ") && run.builder == "seed", "{run:?}");
    assert_eq!(run.draw, [4, 0, 1]);
    let kept = Table::open(&table)?.longest(&run.course, 9)?;
    let [kept] = &kept[..] else { panic!("one run: {kept:?}") };
    assert_eq!((kept.distance, &kept.runner, kept.draw), (run.distance, &run.runner, run.draw));
    assert!(kept.replay.as_ref().is_some_and(|path| path.exists()), "{kept:?}");
    assert!(
        kept.date.starts_with("20") && kept.options.contains("levels=fixed") && kept.options.contains("course=boxes"),
        "{kept:?}"
    );
    // pushes and balls are for other modes, and the same run to the bit is in the table once
    let mut again = game(&table, &words);
    frames(&mut again, 30);
    press(&mut again, KeyCode::KeyP);
    press(&mut again, KeyCode::KeyB);
    let (same, place) = run_to_the_end(&mut again);
    assert_eq!((same.distance, place.of), (run.distance, 1));
    Ok(())
}

#[test]
fn the_replay_of_a_run_on_a_builders_course_is_the_run_to_the_bit() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let table = folder.path().join("runs.sqlite");
    let mut app = game(&table, &["--mode", "course", "--role", "build", "--difficulty", "0.4", "--seed", "3"]);
    // up and down, by the keys
    for (key, times) in [(KeyCode::PageUp, 4), (KeyCode::PageDown, 7), (KeyCode::Home, 1), (KeyCode::PageUp, 5)] {
        (0..times).for_each(|_| press(&mut app, key));
        frames(&mut app, 20);
    }
    assert_eq!(*app.world().resource::<Step>(), Step(5));
    let (run, _) = run_to_the_end(&mut app);
    assert!(run.runner.starts_with("terrainwalker2d.safetensors ") && run.builder == "Ada", "{run:?}");
    let kept = Table::open(&table)?.longest(&run.course, 1)?;
    let path = kept[0].replay.clone().ok_or("the best has its replay")?;
    let recording = Recording::load(&path)?;
    let seen = std::mem::take(&mut app.world_mut().resource_mut::<Seen>().0);
    let first: Vec<_> = seen.iter().filter(|decision| decision.episode == 1).collect();
    assert!(recording.frames() > 300, "{} frames", recording.frames());
    // the first frame is the start, before any decision
    let (mut same, mut lies) = (0, 0);
    for (frame, Decision { qpos, ground, .. }) in first.iter().enumerate().map(|(i, seen)| (i + 1, *seen)) {
        if frame < recording.frames() {
            assert_eq!(recording.qpos(frame, 0), qpos, "frame {frame}");
            assert_eq!(recording.grounds(frame, 0), Some(ground), "frame {frame}");
            lies += usize::from(recording.grounds(frame, 0) != recording.grounds(frame - 1, 0));
            same += 1;
        }
    }
    assert!(same + 2 >= recording.frames(), "{same} of {} frames", recording.frames());
    assert!(lies > 3, "the ground has changed {lies} times");

    // the recorded actions give the same run in the environment
    let options = VecEnvOptions { agents: 1, autoreset: Autoreset::Disabled, ..VecEnvOptions::default() };
    let mut env = recording.task_config.vec_env(&options)?;
    let mut out = env.buffers();
    let [seed, number, _] = run.draw;
    env.reseed_agent(0, seed, number as usize)?;
    env.reset(None, &mut out.obs)?;
    assert_eq!(env.state(0)?.qpos, recording.qpos(0, 0));
    for frame in 1..recording.frames() {
        env.step(recording.action(frame, 0), &mut out)?;
        assert_eq!(env.state(0)?.qpos, recording.qpos(frame, 0), "frame {frame}");
        assert_eq!(recording.grounds(frame, 0).map(|fields| &fields[0]), Some(&env.ground(0, 0)?), "frame {frame}");
    }

    // and so it is shown
    let mut app = game(&table, &["--replay", &path.display().to_string()]);
    for frame in [0, recording.frames() / 2, recording.frames() - 2] {
        app.world_mut().resource_mut::<Time<Virtual>>().pause();
        app.world_mut().resource_mut::<Playback>().at = (frame as f64 + 1e-6) * recording.dt;
        frames(&mut app, 2);
        let mut puppets = app.world_mut().query::<(&OwnGround, &Episode)>();
        let (ground, episode) = puppets.single(app.world())?;
        assert_eq!(Some(&ground.0), recording.grounds(frame, 0), "frame {frame}");
        assert_eq!(episode.action, recording.action(frame, 0), "frame {frame}");
    }
    Ok(())
}

#[test]
fn the_mouse_builds() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let table = folder.path().join("runs.sqlite");
    let mut app = game(&table, &["--mode", "course", "--role", "build", "--difficulty", "1"]);
    frames(&mut app, 5);
    let step = |app: &App| app.world().resource::<Step>().0;
    // the runner's first meters are not yet made: the next one is from 6 to 7 m
    let drag = |app: &mut App, height: f32| {
        let mut cameras = app.world_mut().query::<(&Camera, &GlobalTransform)>();
        let (camera, at) = cameras.single(app.world()).expect("one camera");
        let cursor = camera.world_to_viewport(at, Vec3::new(7.0, height, 0.0)).expect("it is in the picture");
        let mut windows = app.world_mut().query_filtered::<(Entity, &mut Window), With<PrimaryWindow>>();
        let (window, mut place) = windows.single_mut(app.world_mut()).expect("one window");
        place.set_cursor_position(Some(cursor));
        for state in [ButtonState::Pressed, ButtonState::Released] {
            app.world_mut().write_message(MouseButtonInput { button: MouseButton::Left, state, window });
            app.update();
        }
        window
    };
    let window = drag(&mut app, 0.41);
    assert_eq!(step(&app), 4);
    drag(&mut app, -0.69);
    assert_eq!(step(&app), -7);
    drag(&mut app, 1.6);
    assert_eq!(step(&app), 10, "no more than the difficulty");
    let before = app.world_mut().query::<&FollowCamera>().single(app.world())?.goal[2];
    for (y, expected) in [(-4.0, 6), (1.0, 7), (-9.0, -2)] {
        app.world_mut().write_message(MouseWheel {
            unit: MouseScrollUnit::Line,
            x: 0.0,
            y,
            window,
            phase: bevy::input::touch::TouchPhase::Moved,
        });
        app.update();
        assert_eq!(step(&app), expected);
    }
    assert_eq!(app.world_mut().query::<&FollowCamera>().single(app.world())?.goal[2], before, "the camera stays");
    // the meter that the runner reaches next is built as chosen: two steps of 0.1 m down
    let begun = episode(&mut app).number;
    for _ in 0..200 {
        app.update();
        let mut grounds = app.world_mut().query::<(&OwnGround, &Episode)>();
        let (ground, episode) = grounds.single(app.world())?;
        let ground = &ground.0[0];
        if height(ground, 7.0) != height(ground, 6.0) {
            assert!((height(ground, 7.0) - height(ground, 6.0) + 0.2).abs() < 1e-6 && episode.number == begun);
            return Ok(());
        }
    }
    panic!("nothing is built");
}

#[test]
fn a_player_leads_a_runner_over_a_course() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let table = folder.path().join("runs.sqlite");
    let words = ["--mode", "course", "--role", "run", "--course", "rubble", "--difficulty", "0.3", "--seed", "2"];
    let mut app = game(&table, &words);
    assert_eq!(app.world().resource::<Scenario>().agent, "AntController-v0", "the default");
    frames(&mut app, 100);
    let stands = episode(&mut app);
    assert!(stands.distance.abs() < 0.5 && stands.command == [0.0; 3], "{stands:?}");
    let mut grounds = app.world_mut().query::<&OwnGround>();
    let ground = grounds.single(app.world())?.0[0].clone();
    assert!(ground.iter().any(|z| *z != 0.0) && height(&ground, 4.0) == 0.0);
    key(&mut app, KeyCode::ArrowUp, ButtonState::Pressed);
    frames(&mut app, 150);
    let runs = episode(&mut app);
    assert!(runs.distance > 4.0 && runs.command[0] == 3.0 && runs.number == 1, "{runs:?}");
    // who stays where he is for 5 s has ended
    key(&mut app, KeyCode::ArrowUp, ButtonState::Released);
    let (run, _) = run_to_the_end(&mut app);
    assert_eq!((run.ended.as_str(), run.builder.as_str()), ("stuck", "seed"));
    assert!(run.distance > 4.0 && run.runner.starts_with("Ada, leading antcontroller.safetensors "), "{run:?}");
    let replay = Table::open(&table)?.longest(&run.course, 1)?[0].replay.clone().ok_or("it is the best")?;
    let recording = Recording::load(&replay)?;
    assert_eq!((recording.command(50, 0), recording.command(350, 0)), (&[0.0, 0.0, 0.0][..], &[3.0, 0.0, 0.0][..]));
    assert_eq!(recording.grounds(0, 0).map(|fields| &fields[0]), Some(&ground));
    Ok(())
}

#[test]
fn the_list_starts_a_replay() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let table = folder.path().join("runs.sqlite");
    let mut app = game(&table, &["--mode", "course", "--difficulty", "1", "--seed", "5"]);
    frames(&mut app, 100);
    // a run that is given up counts as far as it came
    press(&mut app, KeyCode::KeyX);
    let (run, _) = run_to_the_end(&mut app);
    assert!(run.ended == "given up" && run.distance > 1.0, "{run:?}");
    // the next agent is one that can do the same
    press(&mut app, KeyCode::KeyN);
    frames(&mut app, 5);
    assert_eq!(app.world().resource::<Scenario>().agent, "HopperController-v0");
    assert!(app.world().resource::<Runs>().last.is_none());
    assert_eq!(app.world().resource::<Bindings>().key(Action::Runs), "T");
    press(&mut app, KeyCode::KeyT);
    let list = app.world().resource::<List>();
    assert!(list.open && list.courses.len() == 1 && list.courses[0].1[0].distance == run.distance);
    // the table has no run of the present agent
    press(&mut app, KeyCode::Digit1);
    frames(&mut app, 2);
    assert_eq!(app.world().resource::<Scenario>().mode, Mode::Course);
    windowless::load(&mut app, |scenario| scenario.agent = "TerrainWalker2d-v0".into());
    frames(&mut app, 3);
    press(&mut app, KeyCode::Digit1);
    frames(&mut app, 20);
    assert_eq!(app.world().resource::<Scenario>().mode, Mode::Replay);
    assert!(!app.world().resource::<List>().open);
    assert!(app.world().resource::<Playback>().at > 0.1);
    Ok(())
}

#[test]
fn what_cannot_be_done_is_told() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let broken = folder.path().join("broken.sqlite");
    std::fs::write(&broken, "no database".repeat(200))?;
    let broken = broken.display().to_string();
    let table = folder.path().join("runs.sqlite").display().to_string();
    let cases: [(&[&str], &[&str]); 9] = [
        (&["walker", "--course", "stairs"], &["--course", "--mode course"]),
        (&["--mode", "course", "--difficulty", "2"], &["--difficulty", "from 0 to 1"]),
        (&["--mode", "course", "--course", "stair"], &["stair", "stairs"]),
        (&["ant", "--mode", "course", "--course", "stair"], &["stair", "stairs"]),
        (&["TerrainAnt", "--mode", "course", "--role", "run"], &["--role", "takes none", "AntController-v0 does"]),
        (&["ant", "--mode", "course", "--role", "build"], &["--role", "TerrainWalker2d-v0 has"]),
        (&["ant", "--mode", "course", "--course", "adversary"], &["--course", "TerrainWalker2d-v0 has"]),
        (&["Swimmer-v5", "--mode", "course"], &["Swimmer-v5", "no level floor"]),
        (&["--mode", "course", "--table", &broken], &["broken.sqlite", "SQLite", "--table FILE"]),
    ];
    for (words, parts) in cases {
        let table: &[&str] = if words.contains(&"--table") { &[] } else { &["--table", &table] };
        let args = Args::parse_from([&["marathon-game"], words, table].concat());
        let error = GamePlugin::new(&args).err().unwrap_or_else(|| panic!("{words:?}")).to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{words:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    Ok(())
}
