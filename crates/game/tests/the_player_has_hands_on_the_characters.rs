//! The player drags a limb, makes a character limp, and keeps the last seconds as a film. Steps, balls and falls are heard.

use crate::windowless::{self, frames};
use bevy::input::ButtonState;
use bevy::input::mouse::MouseButtonInput;
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use bevy_marathon::prelude::*;
use marathon_game::app::{
    Action, ActionPressed, Actor, Dragged, FilmProgram, FilmReel, LoadScenario, Notifications, Pile, PlaySound,
    Recording, Sound,
};
use std::error::Error;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// The sounds of the test so far.
#[derive(Resource, Default)]
struct Heard(Vec<PlaySound>);

/// The pushes that characters got.
#[derive(Resource, Default)]
struct Pushes(Vec<Push>);

fn game(words: &[&str]) -> App {
    windowless::game(words, Duration::from_millis(20), |app| {
        app.init_resource::<Heard>().init_resource::<Pushes>().add_systems(
            Last,
            |mut sounds: MessageReader<PlaySound>,
             mut pushed: MessageReader<Push>,
             mut heard: ResMut<Heard>,
             mut pushes: ResMut<Pushes>| {
                heard.0.extend(sounds.read());
                pushes.0.extend(pushed.read());
            },
        );
        app.world_mut().spawn((Window { resolution: (800, 600).into(), ..default() }, PrimaryWindow));
    })
}

fn act(app: &mut App, action: Action) {
    app.world_mut().write_message(ActionPressed(action));
    app.update();
}

/// Puts the cursor over a place of the world.
fn point(app: &mut App, at: Vec3) -> Entity {
    let mut cameras = app.world_mut().query_filtered::<(&Camera, &GlobalTransform), With<FollowCamera>>();
    let (camera, camera_at) = cameras.single(app.world()).expect("one camera");
    let cursor = camera.world_to_viewport(camera_at, at).expect("it is in the picture");
    let mut windows = app.world_mut().query_filtered::<(Entity, &mut Window), With<PrimaryWindow>>();
    let (window, mut place) = windows.single_mut(app.world_mut()).expect("one window");
    place.set_cursor_position(Some(cursor));
    window
}

fn button(app: &mut App, state: ButtonState, window: Entity) {
    app.world_mut().write_message(MouseButtonInput { button: MouseButton::Left, state, window });
    app.update();
}

/// Where the first body of the only character is.
fn trunk(app: &mut App) -> Vec3 {
    let mut anatomies = app.world_mut().query_filtered::<&Anatomy, With<Actor>>();
    let part = anatomies.single(app.world()).expect("one character").parts[1];
    app.world().get::<GlobalTransform>(part).expect("it has a place").translation()
}

#[test]
fn a_limb_is_dragged_by_a_limited_force() {
    let mut app = game(&["hopper", "--seed", "3"]);
    frames(&mut app, 20);
    let at = trunk(&mut app);
    let window = point(&mut app, at);
    button(&mut app, ButtonState::Pressed, window);
    assert!(app.world().get_resource::<Dragged>().is_none(), "a press may still become a click");
    // the camera follows the character, so the goal stays above where it was
    point(&mut app, at + 0.8 * Vec3::Y);
    frames(&mut app, 3);
    let mass: f64 = {
        let mut anatomies = app.world_mut().query::<&Anatomy>();
        anatomies.single(app.world()).expect("one").model.bodies.iter().map(|body| body.mass).sum()
    };
    let most = 1.61 * 9.81 * mass as f32;
    let mut lifted = 0.0_f32;
    for _ in 0..60 {
        point(&mut app, at + 0.8 * Vec3::Y);
        app.update();
        let force = app.world().get_resource::<Dragged>().map_or(Vec3::ZERO, Dragged::force);
        assert!(force.length() <= most, "{force} of {most} N");
        lifted = lifted.max(trunk(&mut app).y - at.y);
    }
    assert!(app.world().get_resource::<Dragged>().is_some() && lifted > 0.2, "lifted by {lifted} m");
    let pushes = std::mem::take(&mut app.world_mut().resource_mut::<Pushes>().0);
    assert!(pushes.len() > 20 && pushes.iter().all(|push| push.at.is_some()), "{} pushes", pushes.len());
    button(&mut app, ButtonState::Released, window);
    frames(&mut app, 2);
    assert!(app.world().get_resource::<Dragged>().is_none(), "it has let go");
    // a short click is a push
    app.world_mut().resource_mut::<Pushes>().0.clear();
    let at = trunk(&mut app);
    point(&mut app, at);
    button(&mut app, ButtonState::Pressed, window);
    button(&mut app, ButtonState::Released, window);
    frames(&mut app, 1);
    let pushes = &app.world().resource::<Pushes>().0;
    assert!(pushes.len() == 1 && pushes[0].seconds == 0.1, "{pushes:?}");
}

#[test]
fn a_limp_character_collapses_and_gets_its_strength_back() {
    let mut app = game(&["MarathonManController"]);
    frames(&mut app, 30);
    let standing = trunk(&mut app).y;
    act(&mut app, Action::Limp);
    let mut mode = app.world_mut().query_filtered::<&RagdollMode, With<Actor>>();
    assert_eq!(mode.single(app.world()).copied().ok(), Some(RagdollMode::Limp));
    let mut lowest = f32::MAX;
    for _ in 0..60 {
        app.update();
        lowest = lowest.min(trunk(&mut app).y);
    }
    assert!(lowest < 0.6 * standing, "from {standing} m down to {lowest} m");
    act(&mut app, Action::Limp);
    let mut up = false;
    for _ in 0..600 {
        app.update();
        up |= trunk(&mut app).y > 0.85 * standing && mode.single(app.world()).is_ok_and(|m| *m == RagdollMode::Powered);
    }
    assert!(up, "it has not got up in 10 s");
}

#[test]
fn a_key_keeps_the_last_ten_seconds_as_a_film() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    std::env::set_current_dir(folder.path())?;
    let mut app = game(&["hopper", "--agents", "2", "--skin", "none"]);
    // longer than two films, so that the start has been forgotten
    frames(&mut app, 1250);
    let expected = app.world().resource::<FilmReel>().last_seconds().ok_or("it has run")?;
    assert!((expected.seconds() - 10.0).abs() < 2.0 * expected.dt && expected.agents == 2, "{}", expected.seconds());
    // a program that keeps its words in place of a film
    let script = folder.path().join("draw.sh");
    std::fs::write(&script, "#!/bin/sh\necho \"$@\" > words.txt\n")?;
    #[cfg(unix)]
    std::fs::set_permissions(&script, std::os::unix::fs::PermissionsExt::from_mode(0o755))?;
    app.insert_resource(FilmProgram(Some(script)));
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    act(&mut app, Action::Film);
    let begun = Instant::now();
    while app.world().resource::<FilmReel>().is_drawing() {
        app.update();
        std::thread::sleep(Duration::from_millis(5));
        assert!(begun.elapsed() < Duration::from_secs(60), "it is still being drawn");
    }
    let kept = Recording::load(&PathBuf::from("hopper-film-1.replay"))?;
    assert_eq!((kept.frames(), kept.agents), (expected.frames(), 2));
    for frame in [0, kept.frames() / 2, kept.frames() - 1] {
        assert_eq!(kept.qpos(frame, 1), expected.qpos(frame, 1), "frame {frame} has the same bits");
    }
    let words = std::fs::read_to_string("words.txt")?;
    for part in ["--replay hopper-film-1.replay", "--record hopper-film-1.", "--skin none", "--seconds 10.0"] {
        assert!(words.contains(part), "{words} lacks {part}");
    }
    let notes = &app.world().resource::<Notifications>().0;
    let path = notes.iter().find(|note| note.text.starts_with("film: ")).ok_or("the place of the film is named")?;
    assert!(path.text.contains(&folder.path().display().to_string()), "{}", path.text);
    Ok(())
}

#[test]
fn a_pile_of_boxes_is_run_into() -> Result<(), Box<dyn Error>> {
    let mut app = game(&["MarathonManController", "--mode", "push"]);
    frames(&mut app, 50);
    act(&mut app, Action::Boxes);
    frames(&mut app, 50);
    let mut piles = app.world_mut().query_filtered::<Entity, With<Pile>>();
    let first = piles.single(app.world())?;
    let start = boxes(&mut app, first);
    assert_eq!(start.len(), 6);
    assert!(start.iter().all(|at| at.y > 0.1 && at.y < 0.8), "{start:?}");
    // the same key puts them in front of the character again
    act(&mut app, Action::Boxes);
    frames(&mut app, 2);
    let pile = piles.single(app.world())?;
    assert_ne!(pile, first);
    let start = boxes(&mut app, pile);
    // the key of the direction away from the camera
    app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(KeyCode::KeyW);
    frames(&mut app, 300);
    let now = boxes(&mut app, pile);
    let moved = start.iter().zip(&now).filter(|(a, b)| a.distance(**b) > 0.2).count();
    assert!(moved >= 2, "{moved} boxes have moved: {now:?}");
    assert!(now.iter().all(|at| at.is_finite() && at.y > 0.0 && at.length() < 20.0), "{now:?}");
    app.world_mut().write_message(LoadScenario);
    frames(&mut app, 3);
    assert_eq!(piles.iter(app.world()).count(), 0);
    Ok(())
}

/// Where the boxes of a pile are.
fn boxes(app: &mut App, pile: Entity) -> Vec<Vec3> {
    let mut parts = app.world_mut().query::<(&Part, &GlobalTransform)>();
    let of = parts.iter(app.world()).filter(|(part, _)| part.ragdoll == pile && part.body > 0);
    let mut places: Vec<(usize, Vec3)> = of.map(|(part, at)| (part.body, at.translation())).collect();
    places.sort_by_key(|(body, _)| *body);
    places.into_iter().map(|(_, at)| at).collect()
}

#[test]
fn boxes_are_for_characters_that_are_played_with() {
    let mut app = game(&["AntController", "--mode", "course"]);
    frames(&mut app, 20);
    act(&mut app, Action::Boxes);
    frames(&mut app, 2);
    assert_eq!(app.world_mut().query_filtered::<(), With<Pile>>().iter(app.world()).count(), 0);
}

#[test]
fn steps_balls_and_falls_are_heard() {
    let mut app = game(&["hopper", "--mode", "push"]);
    frames(&mut app, 150);
    let heard = std::mem::take(&mut app.world_mut().resource_mut::<Heard>().0);
    let steps = heard.iter().filter(|sound| matches!(sound.sound, Sound::Step | Sound::Landing)).count();
    assert!((3..40).contains(&steps), "{steps} steps of a hopper in 3 s");
    assert!(heard.iter().all(|sound| (0.0..=1.0).contains(&sound.loudness) && sound.at.is_some()), "{heard:?}");
    act(&mut app, Action::Throw);
    frames(&mut app, 100);
    let heard = std::mem::take(&mut app.world_mut().resource_mut::<Heard>().0);
    for wanted in [Sound::Throw, Sound::Impact] {
        assert!(heard.iter().any(|sound| sound.sound == wanted), "{wanted:?}: {heard:?}");
    }
}

#[test]
fn sounds_are_short_and_differ() {
    for sound in Sound::ALL {
        let variants: Vec<Vec<f32>> = (0..sound.variants()).map(|variant| sound.samples(variant)).collect();
        for (i, samples) in variants.iter().enumerate() {
            let peak = samples.iter().fold(0.0_f32, |peak, x| peak.max(x.abs()));
            assert!((0.5..=0.9001).contains(&peak), "{sound:?} {i}: peak {peak}");
            // it begins and ends in silence
            let edge = samples[0].abs().max(samples[samples.len() - 1].abs());
            assert!(edge < 0.02, "{sound:?} {i}: {edge}");
            let mean = samples.iter().sum::<f32>() / samples.len() as f32;
            assert!(mean.abs() < 0.02, "{sound:?} {i}: mean {mean}");
            assert_eq!(*samples, sound.samples(i), "the same each time");
            assert!(variants[..i].iter().all(|other| other != samples), "{sound:?} {i} differs from the others");
        }
        let most = if sound == Sound::Crowd { 3.5 } else { 0.5 };
        assert!(variants[0].len() as f32 / (marathon_game::app::RATE as f32) < most);
    }
}
