//! A key that would lose something asks first: the same key means yes, S saves, Esc means no. Binding a key has no side
//! effects.

use crate::devices;
use crate::windowless::{self, frames};
use bevy::input::ButtonState;
use bevy::prelude::*;
use marathon_game::app::{
    Action, Asked, Bindable, Bindings, Device, Menu, Mode, Question, Rebinding, Scenario, Screen, TrainingRun,
};
use std::error::Error;
use std::time::{Duration, Instant};

fn app(words: &[&str]) -> App {
    windowless::game(words, Duration::from_millis(20), |_| ())
}

fn press(app: &mut App, key: KeyCode) {
    devices::key(app, key, ButtonState::Pressed);
    devices::key(app, key, ButtonState::Released);
}

fn asked(app: &App) -> Option<Asked> {
    app.world().resource::<Question>().0.as_ref().map(|(asked, _)| *asked)
}

#[test]
fn quitting_asks_while_the_menu_is_open() {
    let mut app = app(&["hopper"]);
    press(&mut app, KeyCode::Escape);
    assert!(app.world().resource::<Menu>().is_open());
    press(&mut app, KeyCode::KeyQ);
    assert_eq!((asked(&app), app.should_exit()), (Some(Asked::Action(Action::Quit)), None));
    // no
    press(&mut app, KeyCode::Escape);
    assert_eq!((asked(&app), app.should_exit(), app.world().resource::<Menu>().is_open()), (None, None, true));
    press(&mut app, KeyCode::KeyQ);
    devices::key(&mut app, KeyCode::KeyQ, ButtonState::Pressed);
    assert!(app.should_exit().is_some_and(|exit| exit.is_success()));
}

#[test]
fn quitting_does_not_ask_when_nothing_is_lost() {
    let mut app = app(&["hopper"]);
    devices::key(&mut app, KeyCode::KeyQ, ButtonState::Pressed);
    assert!(app.should_exit().is_some_and(|exit| exit.is_success()));
}

/// The game saves policies and recordings in the current folder. A process has only one, so a single test saves
/// everything.
#[test]
fn a_policy_that_learns_and_a_recording_are_not_lost() -> Result<(), Box<dyn Error>> {
    let (home, folder) = (std::env::current_dir()?, tempfile::tempdir()?);
    std::env::set_current_dir(folder.path())?;
    let file = |name: &str| folder.path().join(name);
    let learning = || {
        let mut app = app(&["hopper", "--mode", "learn", "--threads", "1"]);
        let begun = Instant::now();
        while app.world().get_resource::<TrainingRun>().is_none_or(|run| run.unsaved().is_none()) {
            app.update();
            std::thread::sleep(Duration::from_millis(5));
            assert!(begun.elapsed() < Duration::from_secs(120), "no progress");
        }
        app
    };
    let mut app = learning();
    for key in [KeyCode::KeyQ, KeyCode::KeyL, KeyCode::KeyX, KeyCode::KeyN] {
        press(&mut app, key);
        assert!(asked(&app).is_some() && app.should_exit().is_none(), "{key:?}");
        press(&mut app, KeyCode::Escape);
        assert!(asked(&app).is_none() && app.world().get_resource::<TrainingRun>().is_some(), "{key:?}");
        assert!(!app.world().resource::<Menu>().is_open(), "{key:?}: Esc answers");
    }
    // yes, after saving
    press(&mut app, KeyCode::KeyL);
    press(&mut app, KeyCode::KeyS);
    frames(&mut app, 2);
    assert_eq!(app.world().resource::<Scenario>().mode, Mode::Watch);
    assert!(file("hopper-live-1.safetensors").exists());
    // yes, without saving
    let mut app = learning();
    press(&mut app, KeyCode::KeyL);
    press(&mut app, KeyCode::KeyL);
    frames(&mut app, 2);
    assert_eq!(app.world().resource::<Scenario>().mode, Mode::Watch);
    assert!(!file("hopper-live-2.safetensors").exists());
    // ending a run in another way saves its policy
    let mut app = learning();
    windowless::load(&mut app, |scenario| scenario.mode = Mode::Watch);
    frames(&mut app, 2);
    assert!(file("hopper-live-2.safetensors").exists());

    let mut app = self::app(&["walker"]);
    press(&mut app, KeyCode::KeyR);
    frames(&mut app, 30);
    press(&mut app, KeyCode::KeyQ);
    assert_eq!(asked(&app), Some(Asked::Action(Action::Quit)));
    press(&mut app, KeyCode::Escape);
    assert!(!file("walker2d-1.replay").exists());
    press(&mut app, KeyCode::KeyQ);
    devices::key(&mut app, KeyCode::KeyQ, ButtonState::Pressed);
    assert!(app.should_exit().is_some() && file("walker2d-1.replay").exists());
    std::env::set_current_dir(home)?;
    Ok(())
}

#[test]
fn esc_leaves_a_binding_as_it_is_and_a_closed_menu_mutes_no_key() {
    let mut app = app(&["hopper"]);
    press(&mut app, KeyCode::Escape);
    let push = Bindable::Action(Action::Push);
    app.world_mut().resource_mut::<Menu>().show(Screen::Keys);
    app.world_mut().resource_mut::<Rebinding>().start(push, Device::Keyboard);
    press(&mut app, KeyCode::Escape);
    assert_eq!(app.world().resource::<Bindings>(), &Bindings::default());
    assert_eq!(*app.world().resource::<Rebinding>(), Rebinding::Idle);
    assert_eq!(app.world().resource::<Menu>().screen(), Some(Screen::Keys));
    // the menu closes while it waits for a key
    app.world_mut().resource_mut::<Rebinding>().start(push, Device::Keyboard);
    app.world_mut().resource_mut::<Menu>().close();
    frames(&mut app, 2);
    press(&mut app, KeyCode::Enter);
    assert!(app.world().resource::<Time<Virtual>>().is_paused(), "keys are heard");
    assert_eq!(app.world().resource::<Bindings>(), &Bindings::default());
}
