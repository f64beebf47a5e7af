//! The systems of the app, driven by its keys, without a window and without drawing.

use crate::windowless::{self, frames};
use bevy::input::ButtonState;
use bevy::input::keyboard::{Key, KeyboardInput};
use bevy::prelude::*;
use bevy::window::FileDragAndDrop;
use bevy_marathon::axes::to_game;
use bevy_marathon::look::{CameraMode, Dressed, part_errors};
use bevy_marathon::prelude::*;
use marathon_game::app::{
    Action, Actor, Ball, Bindings, Focus, Mode, Notifications, Playback, Reading, Recorder, Recording, Scenario,
    SkinChoice, SkinState, TrainingRun,
};
use marathon_render::Scene;
use std::path::Path;
use std::time::{Duration, Instant};

fn app(words: &[&str]) -> App {
    windowless::game(words, Duration::from_millis(20), |_| ())
}

/// Presses the key that does something, as a window would send it.
fn press(app: &mut App, action: Action) {
    let name = app.world().resource::<Bindings>().key(action);
    let key_code = match name {
        "Enter" => KeyCode::Enter,
        "Tab" => KeyCode::Tab,
        "Up" => KeyCode::ArrowUp,
        "Left" => KeyCode::ArrowLeft,
        "Right" => KeyCode::ArrowRight,
        "E" => KeyCode::KeyE,
        "K" => KeyCode::KeyK,
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
    press(&mut app, Action::NextFocus);
    assert_eq!(app.world().resource::<Focus>().0, 1);
    let mut cameras = app.world_mut().query::<&FollowCamera>();
    let target = cameras.single(app.world()).expect("one camera").target.expect("it follows somebody");
    assert_eq!(app.world().get::<Actor>(target).map(|a| a.0), Some(1));
    // one can look about while the time stands still
    press(&mut app, Action::Pause);
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
    press(&mut app, Action::NextAgent);
    frames(&mut app, 60);
    assert_eq!(app.world().resource::<Scenario>().agent, "Walker2d-v0");
    let (_, episode) = actors(&mut app)[0].clone();
    assert!(episode.distance > 0.5, "{episode:?}");
    press(&mut app, Action::Pause);
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
    press(&mut struck, Action::Push);
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
            press(&mut struck, Action::Throw);
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
    while app.world().get_resource::<TrainingRun>().is_none_or(|l| l.progress().curve.len() < 3) {
        app.update();
        std::thread::sleep(Duration::from_millis(5));
        assert!(begun.elapsed() < Duration::from_secs(120), "no progress");
    }
    frames(&mut app, 30);
    let (_, episode) = actors(&mut app)[0].clone();
    assert!(episode.action.iter().any(|a| *a != 0.0), "the newest policy acts");
    press(&mut app, Action::Pause);
    std::thread::sleep(Duration::from_secs(2));
    let waiting = app.world().resource::<TrainingRun>().progress();
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(app.world().resource::<TrainingRun>().progress().curve, waiting.curve, "the trainer waits");
    // it asks whether to discard the policy
    press(&mut app, Action::Learn);
    assert!(app.world().get_resource::<TrainingRun>().is_some());
    press(&mut app, Action::Learn);
    frames(&mut app, 3);
    assert!(app.world().get_resource::<TrainingRun>().is_none());
    assert_eq!(app.world().resource::<Scenario>().mode, Mode::Watch);
}

/// The robot of a file learns as an agent does; without `--mode learn` its motors have sliders.
#[test]
fn the_robot_of_a_file_learns() -> Result<(), Box<dyn std::error::Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/gymnasium/ant.xml").display().to_string();
    let mut app = app(&[&file, "--mode", "learn", "--threads", "1", "--agents", "2"]);
    let begun = Instant::now();
    while app.world().get_resource::<TrainingRun>().is_none_or(|l| l.progress().curve.is_empty()) {
        app.update();
        std::thread::sleep(Duration::from_millis(5));
        assert!(begun.elapsed() < Duration::from_secs(120), "no progress");
    }
    frames(&mut app, 30);
    assert_eq!(actors(&mut app).len(), 2);
    assert!(actors(&mut app).iter().all(|(_, episode)| episode.action.len() == 8), "the ant's motors");
    assert_eq!(app.world().resource::<Scenario>().agent, "Robot-v0");
    Ok(())
}

#[test]
fn what_is_recorded_is_shown_again() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    // recordings go to the present folder; no other test here looks at it
    std::env::set_current_dir(folder.path())?;
    let mut app = app(&["hopper", "--agents", "2"]);
    press(&mut app, Action::Record);
    assert!(app.world().get_resource::<Recorder>().is_some());
    frames(&mut app, 100);
    press(&mut app, Action::Record);
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
    press(&mut app, Action::Pause);
    for (action, expected) in
        [(Action::Ahead, 0.6), (Action::Ahead, 1.1), (Action::Back, 0.6), (Action::Back, 0.1), (Action::Back, 0.0)]
    {
        press(&mut app, action);
        let at = app.world().resource::<Playback>().at;
        assert!((at - expected).abs() < 0.1, "{action:?}: {at} s, expected {expected}");
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

/// Where the parts of the only ghost are, by body, and of the only character.
fn ghost_and_body(app: &mut App) -> Option<[Vec<Vec3>; 2]> {
    let mut names = app.world_mut().query::<(&Name, &Children, &GlobalTransform)>();
    let (_, children, _) = names.iter(app.world()).find(|(name, ..)| name.as_str() == "ghost")?;
    let ghost: Vec<Entity> = children.iter().collect();
    let mut anatomies = app.world_mut().query_filtered::<&Anatomy, With<Actor>>();
    let parts = anatomies.single(app.world()).ok()?.parts.clone();
    let place = |entity: &Entity| app.world().get::<GlobalTransform>(*entity).map(GlobalTransform::translation);
    Some([ghost.iter().filter_map(place).collect(), parts.iter().filter_map(place).collect()])
}

#[test]
fn a_ghost_moves_as_the_clip_does_and_keys_switch_it() -> Result<(), Box<dyn std::error::Error>> {
    let mut app = app(&["MarathonManRun", "--mode", "imitate", "--option", "start=first"]);
    frames(&mut app, 10);
    let [ghost, body] = ghost_and_body(&mut app).ok_or("a ghost and a body")?;
    assert_eq!(ghost.len(), body.len());
    let apart = |pair: (&Vec3, &Vec3)| pair.0.distance(*pair.1);
    let worst = ghost.iter().zip(&body).map(apart).fold(0.0, f32::max);
    assert!((1e-4..0.6).contains(&worst), "{worst} m apart");
    // the clip, computed apart, at the moment of the last decision and about it: frames lie between decisions
    let clip =
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/motions/marathon_man/run.motion"))?;
    let clip = marathon_motion::Clip::parse(Path::new("run.motion"), &clip)?;
    let model = marathon_envs::agent("MarathonMan")?.model()?;
    let info = actors(&mut app)[0].1.info.clone();
    let [_, _, phase] = info[..] else { return Err("errors and phase are told".into()) };
    let decided = f64::from(phase) * clip.duration();
    assert!((0.05..0.3).contains(&decided), "some decisions are made: {decided} s");
    let mut nearest = (f32::INFINITY, 0.0);
    for ms in -200..=200 {
        let (mut qpos, late) = (vec![0.0; model.nq], 0.001 * f64::from(ms));
        clip.qpos(decided - late, &mut qpos);
        let places = bevy_marathon::pose::places(&model, &qpos).ok_or("a sound pose")?;
        let apart = places.iter().zip(&ghost).map(|(place, at)| place.translation.distance(*at));
        let apart = apart.fold(0.0, f32::max);
        if apart < nearest.0 {
            nearest = (apart, late);
        }
    }
    let (apart, late) = nearest;
    assert!(apart < 0.02, "the ghost is {apart} m from the clip at best");
    // what is shown is between the last decision and the one before
    assert!((-0.005..0.03).contains(&late), "the ghost is {late} s behind the decision");

    let inside = ghost[1].z;
    press(&mut app, Action::Ghost);
    frames(&mut app, 2);
    let [ghost, _] = ghost_and_body(&mut app).ok_or("a ghost beside the body")?;
    assert!((0.8..1.0).contains(&(inside - ghost[1].z)), "beside: it has moved from {inside} to {} m", ghost[1].z);
    press(&mut app, Action::Ghost);
    frames(&mut app, 2);
    assert!(ghost_and_body(&mut app).is_none(), "off");

    let mut colored = app.world_mut().query::<&ErrorColors>();
    assert_eq!(colored.iter(app.world()).count(), 1);
    press(&mut app, Action::Errors);
    frames(&mut app, 2);
    assert_eq!(colored.iter(app.world()).count(), 0);
    Ok(())
}

#[test]
fn an_agent_of_any_clip_goes_on_to_the_next() -> Result<(), Box<dyn std::error::Error>> {
    let mut app = app(&["MarathonMan", "--mode", "imitate", "--option", "clip=run", "--option", "control=torque"]);
    for clip in ["backflip", "spinkick"] {
        press(&mut app, Action::NextAgent);
        frames(&mut app, 3);
        let mut specs = app.world_mut().query_filtered::<&Anatomy, With<Actor>>();
        let spec = specs.single(app.world())?.spec.clone().ok_or("a task")?;
        assert_eq!(spec.options.get("clip"), Some(&clip.into()));
        assert_eq!(spec.options.get("control"), Some(&"torque".into()), "other options stay");
    }
    Ok(())
}

/// Greatest distance of a geom of the only character from where the clip has it, m, and that geom's color.
fn worst_part(app: &mut App) -> Option<(f32, LinearRgba)> {
    let mut query = app.world_mut().query_filtered::<(&Anatomy, &RagdollState), With<Actor>>();
    let (anatomy, state) = query.single(app.world()).ok()?;
    let time = app.world().resource::<Time<Fixed>>();
    let (marathon, now) = (app.world().resource::<Marathon>(), time.elapsed() + time.overstep());
    let errors = part_errors(&anatomy.model, &marathon.places(state, now)?, &marathon.clip_places(state, now)?);
    let geoms = anatomy.model.geoms.iter().zip(errors).filter(|(geom, _)| geom.body > 0);
    let (geom, error) = geoms.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let name = geom.name.clone();
    let mut shapes = app.world_mut().query::<(&Name, &MeshMaterial3d<StandardMaterial>, &ChildOf)>();
    let (_, material, _) = shapes.iter(app.world()).find(|(known, ..)| known.as_str() == name)?;
    let material = app.world().resource::<Assets<StandardMaterial>>().get(&material.0)?;
    Some((error, material.base_color.into()))
}

#[test]
fn parts_near_their_clip_are_green_and_far_ones_red() -> Result<(), Box<dyn std::error::Error>> {
    // no policy keeps the character on its feet
    let mut app = app(&["MarathonMan", "--mode", "imitate", "--option", "clip=run", "--option", "start=first"]);
    let mut seen = [0, 0];
    for _ in 0..300 {
        frames(&mut app, 1);
        let (error, LinearRgba { red, green, .. }) = worst_part(&mut app).ok_or("a part")?;
        if error < 0.1 {
            assert!(green > 1.2 * red, "{error} m: {red} {green}");
            seen[0] += 1;
        }
        if error > 0.3 {
            assert!(red > 10.0 * green, "{error} m: {red} {green}");
            seen[1] += 1;
        }
    }
    assert!(seen.iter().all(|times| *times > 5), "near and far {seen:?} times");
    Ok(())
}

#[test]
fn agents_of_one_clip_take_turns_and_keep_to_it() {
    let mut app = app(&["--mode", "imitate"]);
    let people = ["MarathonManWalk-v0", "MarathonManRun-v0", "MarathonManBackflip-v0"];
    for agent in people.into_iter().chain(["HumanoidStyleWalk-v0", "HumanoidStyleRun-v0", "MarathonManWalk-v0"]) {
        assert_eq!(app.world().resource::<Scenario>().agent, agent);
        frames(&mut app, 200);
        let (_, episode) = actors(&mut app)[0].clone();
        assert_eq!(episode.number, 1, "{agent} is still up after 4 s: {episode:?}");
        assert!(episode.info[1] < 0.2, "{agent} is near its clip: {:?}", episode.info);
        press(&mut app, Action::NextAgent);
        frames(&mut app, 3);
    }
}

/// Drops a file on the window, and waits until it has been read.
fn drop_file(app: &mut App, path: &Path) {
    let window = Entity::PLACEHOLDER;
    app.world_mut().write_message(FileDragAndDrop::DroppedFile { window, path_buf: path.into() });
    app.update();
    let begun = Instant::now();
    while app.world().get_resource::<Reading>().is_some() {
        app.update();
        std::thread::sleep(Duration::from_millis(5));
        assert!(begun.elapsed() < Duration::from_secs(120), "it is still being read");
    }
    frames(app, 5);
}

#[test]
fn a_dropped_clip_is_followed_and_a_bad_file_changes_nothing() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let [good, bad] = ["mine.motion", "broken.bvh"].map(|name| folder.path().join(name));
    let run = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/motions/marathon_man/kick.motion");
    std::fs::copy(run, &good)?;
    std::fs::write(&bad, "HIERARCHY nothing")?;
    let mut app = app(&["hopper"]);
    drop_file(&mut app, &bad);
    let scenario = app.world().resource::<Scenario>();
    assert_eq!((scenario.agent.as_str(), scenario.mode), ("Hopper-v0", Mode::Watch));
    assert!(
        app.world().resource::<Notifications>().0.iter().any(|note| note.error && note.text.contains("broken.bvh"))
    );
    drop_file(&mut app, &good);
    let scenario = app.world().resource::<Scenario>();
    assert_eq!((scenario.agent.as_str(), scenario.mode), ("MarathonMan-v0", Mode::Imitate));
    let mut anatomies = app.world_mut().query_filtered::<&Anatomy, With<Actor>>();
    let spec = anatomies.single(app.world())?.spec.clone().ok_or("a task")?;
    assert!(spec.options.given_clips().contains_key("mine.motion"));
    assert!(ghost_and_body(&mut app).is_some(), "its ghost is there");
    // L learns it
    press(&mut app, Action::Learn);
    let begun = Instant::now();
    let newest = loop {
        app.update();
        if let Some(newest) = app.world().get_resource::<TrainingRun>().and_then(TrainingRun::newest) {
            break newest;
        }
        std::thread::sleep(Duration::from_millis(5));
        assert!(begun.elapsed() < Duration::from_secs(240), "no progress");
    };
    assert!(newest.meta().options.given_clips().contains_key("mine.motion"), "a policy holds its clip");
    Ok(())
}

/// Runs frames until the skins are worn.
fn dress(app: &mut App) {
    let begun = Instant::now();
    while *app.world().resource::<SkinState>() == SkinState::Waiting {
        frames(app, 1);
        std::thread::sleep(Duration::from_millis(5));
        assert!(begun.elapsed() < Duration::from_secs(60), "it is still being made");
    }
    assert_eq!(*app.world().resource::<SkinState>(), SkinState::Worn);
}

/// Whether the characters wear the skin of a file, a generated one, and how many wear one at all.
fn worn(app: &mut App) -> [usize; 3] {
    let world = app.world_mut();
    let file = world.query_filtered::<(), (With<Skin>, Without<GeneratedSkin>)>().iter(world).count();
    let generated = world.query_filtered::<(), (With<Skin>, With<GeneratedSkin>)>().iter(world).count();
    [file, generated, world.query_filtered::<(), With<Dressed>>().iter(world).count()]
}

#[test]
fn characters_wear_skins_that_fit_them_unless_the_user_chooses() {
    let mut app = app(&["hopper", "--agents", "2"]);
    dress(&mut app);
    assert_eq!(worn(&mut app), [0, 2, 2], "both share a generated skin");
    let mut skins = app.world_mut().query::<&Skin>();
    let scenes: Vec<_> = skins.iter(app.world()).map(|skin| skin.scene.clone()).collect();
    assert_eq!(scenes[0], scenes[1]);
    app.insert_resource(SkinChoice::Bare);
    frames(&mut app, 2);
    assert_eq!(worn(&mut app), [0; 3]);
    let mut shapes = app.world_mut().query_filtered::<&Visibility, With<Mesh3d>>();
    assert!(shapes.iter(app.world()).any(|visibility| *visibility == Visibility::Inherited), "the shapes are back");

    app.insert_resource(SkinChoice::Fitting);
    windowless::load(&mut app, |scenario| scenario.mode = Mode::Testbed);
    frames(&mut app, 4);
    assert_eq!(worn(&mut app), [0; 3], "the test bed shows the shapes of the physics");
    windowless::load(&mut app, |scenario| {
        (scenario.mode, scenario.agent, scenario.agents) = (Mode::Watch, "MarathonManWalk-v0".into(), 1);
    });
    frames(&mut app, 4);
    dress(&mut app);
    assert_eq!(worn(&mut app), [1, 0, 1], "Marathon Man has a skin of his own");
}

#[test]
fn a_skin_follows_the_body() -> Result<(), Box<dyn std::error::Error>> {
    let mut app = app(&["MarathonManWalk"]);
    dress(&mut app);
    let mut names = app.world_mut().query::<(&Name, &GlobalTransform)>();
    let mut anatomies = app.world_mut().query_filtered::<&Anatomy, With<Actor>>();
    for _ in 0..3 {
        frames(&mut app, 15);
        for (bone, body, most) in [
            ("LeftLeg", "left_shin", 0.005),
            ("RightFoot", "right_foot", 0.005),
            ("RightForeArm", "right_larm", 0.06),
            ("LeftArm", "left_upper_arm", 0.06),
        ] {
            let anatomy = anatomies.single(app.world())?;
            let part = *app.world().get::<GlobalTransform>(anatomy.part(body).ok_or("a part")?).ok_or("a place")?;
            let (_, bone_at) = names.iter(app.world()).find(|(name, _)| name.as_str() == bone).ok_or("a bone")?;
            let apart = bone_at.translation().distance(part.translation());
            assert!(apart < most, "{bone} is {apart} m from {body}");
            // the skin rests in the axes of glTF: z forward, y up
            let rest = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
            let angle = (bone_at.rotation() * rest.inverse()).angle_between(part.rotation());
            assert!(angle < 0.02, "{bone} is turned by {angle} rad from {body}");
        }
    }
    let mut meshes = app.world_mut().query::<(&Name, &Mesh3d, &Visibility)>();
    let hidden = |name: &str| {
        meshes.iter(app.world()).filter(|(n, ..)| n.as_str() == name).all(|(.., v)| *v == Visibility::Hidden)
    };
    assert!(["torso", "left_shin", "joint"].map(hidden) == [true; 3], "the shapes are hidden");
    Ok(())
}
