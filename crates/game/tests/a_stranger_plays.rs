//! A stranger plays: prompts teach the controls, the menus work by a gamepad alone, the menu key pauses, and no sequence of
//! presses and clicks leads to a panic or to a state without a way out.

use crate::devices;
use crate::windowless::{self, frames};
use bevy::input::ButtonState;
use bevy::input::gamepad::{GamepadAxis, GamepadButton};
use bevy::input::mouse::{MouseButtonInput, MouseMotion, MouseScrollUnit, MouseWheel};
use bevy::prelude::*;
use bevy::window::{CursorMoved, PrimaryWindow};
use bevy_marathon::prelude::*;
use marathon_game::app::{
    Action, Actor, Ball, Bindable, Bindings, Device, DeviceInUse, Glyph, Menu, Mode, Press, Prompt, Prompts, Question,
    Rebinding, Scenario, Screen, Settings, Steer,
};
use std::error::Error;
use std::time::Duration;

const FRAME: Duration = Duration::from_millis(20);

fn press(app: &mut App, key: KeyCode) {
    devices::key(app, key, ButtonState::Pressed);
    devices::key(app, key, ButtonState::Released);
}

/// The motion of the character in focus, as its physics has it.
#[derive(Debug, Default)]
struct Seen {
    walked: f64,
    turned: f64,
    fastest: f64,
    risen: f64,
    upside_down: bool,
    ball: bool,
    last: Option<[f64; 2]>,
}

impl Seen {
    fn look(&mut self, app: &mut App) {
        self.ball |= app.world_mut().query::<&Ball>().iter(app.world()).next().is_some();
        let mut actors = app.world_mut().query_filtered::<&RagdollState, With<Actor>>();
        let Ok(key) = actors.single(app.world()) else { return };
        let Some(state) = app.world().resource::<Marathon>().state(key) else { return };
        let [x, y, z] = [state.qpos[0], state.qpos[1], state.qpos[2]];
        let [w, i, j, k] = [state.qpos[3], state.qpos[4], state.qpos[5], state.qpos[6]];
        let heading = (2.0 * (w * k + i * j)).atan2(1.0 - 2.0 * (j * j + k * k));
        self.walked = self.walked.max(x.hypot(y));
        self.fastest = self.fastest.max(state.qvel[0].hypot(state.qvel[1]));
        self.turned = self.turned.max(heading.abs());
        self.risen = self.risen.max(z);
        self.upside_down |= 1.0 - 2.0 * (i * i + j * j) < -0.3;
        self.last = Some([x, y]);
    }
}

/// Holds the controls of a prompt: sticks and moving keys all the time, others in presses.
struct Player {
    pad: Entity,
    held: Vec<Press>,
    stick: [f32; 2],
    beat: usize,
}

impl Player {
    fn hold(&mut self, app: &mut App, glyphs: &[Glyph], moves: bool) {
        self.beat += 1;
        let bindings = app.world().resource::<Bindings>().clone();
        let down = moves || self.beat % 75 < 12;
        let named = |press: Press, name: &str| (press.name() == name).then_some(press);
        let presses = glyphs.iter().filter(|_| down).filter_map(|glyph| match glyph {
            Glyph::Key(name) => bindings.rows().find_map(|row| named(Press::Key(row.key), name)),
            Glyph::Button(button, _) => Some(Press::Button(*button)),
            Glyph::Stick(_) => None,
        });
        let presses: Vec<Press> = presses.collect();
        for press in self.held.iter().filter(|held| !presses.contains(held)) {
            self.set(app, *press, false);
        }
        for press in presses.iter().filter(|press| !self.held.contains(press)) {
            self.set(app, *press, true);
        }
        self.held = presses;
        let stick = glyphs.iter().find_map(|glyph| if let Glyph::Stick(stick) = glyph { Some(*stick) } else { None });
        let stick = stick.unwrap_or_default();
        if stick != self.stick {
            devices::push(app, self.pad, GamepadAxis::LeftStickX, stick[0]);
            devices::push(app, self.pad, GamepadAxis::LeftStickY, stick[1]);
            self.stick = stick;
        }
    }

    fn set(&self, app: &mut App, press: Press, down: bool) {
        match press {
            Press::Key(key) => {
                devices::key(app, key, if down { ButtonState::Pressed } else { ButtonState::Released });
            }
            Press::Button(button) => devices::pull(app, self.pad, button, f32::from(u8::from(down))),
        }
    }
}

/// Plays for at most 40 s, and presses only what the screen shows. Returns the seconds.
fn play_by_prompts(device: Device) -> f64 {
    let mut app = windowless::game(&["MarathonManController"], FRAME, |app| {
        app.world_mut().resource_mut::<Settings>().interface.prompts = true;
    });
    let pad = devices::pad(&mut app);
    let mut player = Player { pad, held: Vec::new(), stick: [0.0; 2], beat: 0 };
    if device == Device::Pad {
        frames(&mut app, 30);
        devices::press(&mut app, pad, GamepadButton::DPadDown);
        devices::press(&mut app, pad, GamepadButton::DPadUp);
    }
    let (mut seen, mut shown) = (Seen::default(), Vec::new());
    let begun = app.world().resource::<Time<Real>>().elapsed_secs_f64();
    loop {
        let seconds = app.world().resource::<Time<Real>>().elapsed_secs_f64() - begun;
        let prompts = app.world().resource::<Prompts>();
        if Prompt::ALL.iter().all(|prompt| prompts.is_done(*prompt)) {
            let fine = seen.walked > 1.0 && seen.turned > 0.8 && seen.fastest > 1.9 && seen.upside_down && seen.ball;
            assert!(fine && seen.risen > 1.0, "{device:?}: {seen:?}");
            return seconds;
        }
        assert!(seconds < 40.0, "{device:?}: {shown:?}, {seen:?}");
        let current = prompts.current();
        if current != shown.last().copied() {
            shown.extend(current);
        }
        let in_use = app.world().resource::<DeviceInUse>().device;
        let glyphs = current.map(|prompt| prompt.glyphs(in_use, app.world().resource::<Bindings>()));
        let moves = matches!(current, Some(Prompt::Walk | Prompt::Turn | Prompt::Run));
        player.hold(&mut app, &glyphs.unwrap_or_default(), moves);
        app.update();
        seen.look(&mut app);
    }
}

#[test]
fn a_player_who_presses_what_the_screen_shows_knows_all_controls_after_40_s() {
    for device in [Device::Keyboard, Device::Pad] {
        let seconds = play_by_prompts(device);
        println!("{device:?}: {seconds:.1} s");
    }
}

#[test]
fn prompts_follow_the_device_and_the_bindings() {
    let mut bindings = Bindings::default();
    assert_eq!(Prompt::Jump.glyphs(Device::Keyboard, &bindings), [Glyph::Key("Space")]);
    assert_eq!(Prompt::Jump.glyphs(Device::Pad, &bindings), [Glyph::Button(GamepadButton::South, "A")]);
    bindings.bind(Bindable::Steer(Steer::Jump), Press::Key(KeyCode::KeyZ));
    assert_eq!(Prompt::Jump.glyphs(Device::Keyboard, &bindings), [Glyph::Key("Z")]);
    // videos and tests have none unless they ask for them
    let mut app = windowless::game(&["MarathonManController"], FRAME, |_| ());
    frames(&mut app, 100);
    assert_eq!(app.world().resource::<Prompts>().current(), None);
}

/// Positions of all characters.
fn positions(app: &mut App) -> Vec<Vec<f64>> {
    let mut actors = app.world_mut().query_filtered::<&RagdollState, With<Actor>>();
    let marathon = app.world().resource::<Marathon>();
    actors.iter(app.world()).filter_map(|key| Some(marathon.state(key)?.qpos)).collect()
}

#[test]
fn the_menu_key_stops_the_simulation_and_goes_back_into_play() {
    let mut app = windowless::game(&["hopper"], FRAME, |_| ());
    frames(&mut app, 20);
    press(&mut app, KeyCode::Escape);
    assert_eq!(app.world().resource::<Menu>().screen(), Some(Screen::Pause));
    let before = positions(&mut app);
    frames(&mut app, 30);
    assert_eq!(positions(&mut app), before, "it stands still");
    // keys of the game have no effect
    press(&mut app, KeyCode::KeyN);
    assert_eq!(app.world().resource::<Scenario>().agent, "Hopper-v0");
    press(&mut app, KeyCode::Escape);
    frames(&mut app, 10);
    assert_ne!(positions(&mut app), before);
    // a game that the player has paused stays so
    press(&mut app, KeyCode::Enter);
    press(&mut app, KeyCode::Escape);
    press(&mut app, KeyCode::Escape);
    assert!(app.world().resource::<Time<Virtual>>().is_paused() && !app.world().resource::<Menu>().is_open());
}

#[test]
fn a_gamepad_alone_goes_through_the_menus() {
    let mut app = windowless::game_in(Some(Window::default()), &[], FRAME, |_| ());
    let pad = devices::pad(&mut app);
    let screen = |app: &App| app.world().resource::<Menu>().screen();
    let tap = |app: &mut App, button| {
        devices::press(app, pad, button);
        frames(app, 2);
    };
    assert_eq!(screen(&app), Some(Screen::Main));
    assert_eq!(app.world().resource::<Scenario>().agent, "MarathonManController-v0");
    // two rows of pictures, then the buttons
    tap(&mut app, GamepadButton::DPadDown);
    tap(&mut app, GamepadButton::DPadDown);
    tap(&mut app, GamepadButton::South);
    assert_eq!(screen(&app), Some(Screen::Settings));
    // a slider moves
    let field = |app: &App| app.world().resource::<Settings>().camera.field_of_view;
    let before = app.world().resource::<Settings>().clone();
    for _ in 0..60 {
        tap(&mut app, GamepadButton::DPadDown);
        tap(&mut app, GamepadButton::DPadRight);
        if field(&app) != before.camera.field_of_view {
            break;
        }
    }
    assert_ne!(field(&app), before.camera.field_of_view, "a gamepad changes a setting");
    tap(&mut app, GamepadButton::East);
    assert_eq!(screen(&app), Some(Screen::Main));
    // the first picture has the focus again: play
    tap(&mut app, GamepadButton::South);
    assert_eq!(screen(&app), None);
    tap(&mut app, GamepadButton::Start);
    assert_eq!(screen(&app), Some(Screen::Pause));
    tap(&mut app, GamepadButton::South);
    assert_eq!(screen(&app), None, "continue");
    assert!(!app.world().resource::<Time<Virtual>>().is_paused());
}

#[test]
fn a_taken_key_or_button_asks_before_it_is_bound() {
    let mut app = windowless::game_in(Some(Window::default()), &["hopper"], FRAME, |_| ());
    let pad = devices::pad(&mut app);
    app.world_mut().resource_mut::<Menu>().show(Screen::Keys);
    frames(&mut app, 2);
    let [push, throw] = [Action::Push, Action::Throw].map(Bindable::Action);
    app.world_mut().resource_mut::<Rebinding>().start(push, Device::Keyboard);
    press(&mut app, KeyCode::KeyB);
    let taken = Rebinding::Taken { what: push, press: Press::Key(KeyCode::KeyB), by: throw };
    assert_eq!(*app.world().resource::<Rebinding>(), taken);
    assert_eq!(app.world().resource::<Bindings>(), &Bindings::default(), "it asks first");
    // the question has the focus on: swap
    frames(&mut app, 2);
    devices::press(&mut app, pad, GamepadButton::South);
    frames(&mut app, 2);
    let bindings = app.world().resource::<Bindings>();
    assert_eq!((bindings.key(Action::Push), bindings.key(Action::Throw)), ("B", "P"));
    // a free button of a gamepad, and a key that steers
    app.world_mut().resource_mut::<Rebinding>().start(throw, Device::Pad);
    devices::press(&mut app, pad, GamepadButton::LeftTrigger2);
    app.world_mut().resource_mut::<Rebinding>().start(Bindable::Steer(Steer::MoveAhead), Device::Keyboard);
    press(&mut app, KeyCode::KeyU);
    let bindings = app.world().resource::<Bindings>();
    assert_eq!(bindings.row(throw).button, Some(GamepadButton::LeftTrigger2));
    assert_eq!(bindings.steering_key(Steer::MoveAhead), KeyCode::KeyU);
    assert_eq!(app.world().resource::<Settings>().bindings, *bindings, "the settings keep them");
}

/// A generator of numbers below a limit.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % limit
    }

    fn share(&mut self) -> f32 {
        self.roll(2001) as f32 / 1000.0 - 1.0
    }
}

const BUTTONS: [GamepadButton; 16] = [
    GamepadButton::South,
    GamepadButton::East,
    GamepadButton::West,
    GamepadButton::North,
    GamepadButton::Start,
    GamepadButton::Select,
    GamepadButton::LeftTrigger,
    GamepadButton::RightTrigger,
    GamepadButton::LeftTrigger2,
    GamepadButton::RightTrigger2,
    GamepadButton::LeftThumb,
    GamepadButton::RightThumb,
    GamepadButton::DPadUp,
    GamepadButton::DPadDown,
    GamepadButton::DPadLeft,
    GamepadButton::DPadRight,
];

/// A random event of a keyboard, a mouse or a gamepad. Each lets a frame go by.
fn random_event(app: &mut App, dice: &mut Dice, window: Entity, pad: Entity) {
    let keys: Vec<KeyCode> = app.world().resource::<Bindings>().rows().map(|row| row.key).collect();
    match dice.roll(6) {
        0 => {
            let key = keys[dice.roll(keys.len())];
            devices::key(app, key, if dice.roll(2) == 0 { ButtonState::Pressed } else { ButtonState::Released });
        }
        1 => press(app, keys[dice.roll(keys.len())]),
        2 => devices::press(app, pad, BUTTONS[dice.roll(BUTTONS.len())]),
        3 => {
            let axes =
                [GamepadAxis::LeftStickX, GamepadAxis::LeftStickY, GamepadAxis::RightStickX, GamepadAxis::RightStickY];
            devices::push(app, pad, axes[dice.roll(4)], dice.share());
        }
        4 => {
            let at = Vec2::new(640.0 + 640.0 * dice.share(), 360.0 + 360.0 * dice.share());
            app.world_mut().write_message(CursorMoved { window, position: at, delta: None });
            app.world_mut().write_message(MouseMotion { delta: 30.0 * Vec2::new(dice.share(), dice.share()) });
            let (unit, y) = (MouseScrollUnit::Line, dice.share().round());
            app.world_mut().write_message(MouseWheel {
                unit,
                x: 0.0,
                y,
                window,
                phase: bevy::input::touch::TouchPhase::Moved,
            });
            app.update();
        }
        _ => {
            let button = [MouseButton::Left, MouseButton::Right][dice.roll(2)];
            for state in [ButtonState::Pressed, ButtonState::Released] {
                app.world_mut().write_message(MouseButtonInput { button, state, window });
                app.update();
            }
        }
    }
}

/// Leads from any state to a paused game, and back into play.
fn find_a_way_out(app: &mut App, what: &str) {
    // let go of everything, and let a wait for a key end
    app.world_mut().resource_mut::<ButtonInput<KeyCode>>().reset_all();
    frames(app, 350);
    for _ in 0..12 {
        let quiet = !app.world().resource::<Menu>().is_open() && app.world().resource::<Question>().0.is_none();
        if quiet {
            break;
        }
        let key = app.world().resource::<Bindings>().row(Bindable::Action(Action::Menu)).key;
        press(app, key);
        frames(app, 2);
    }
    assert!(!app.world().resource::<Menu>().is_open(), "{what}: the menu does not close");
    assert!(app.world().resource::<Question>().0.is_none(), "{what}: a question stays");
    let mut scenario = app.world().resource::<Scenario>().clone();
    (scenario.mode, scenario.agent, scenario.agents) = (Mode::Watch, "Hopper-v0".into(), 1);
    app.world_mut().resource_mut::<Menu>().start(scenario);
    frames(app, 5);
    let before = positions(app);
    frames(app, 20);
    assert_ne!(positions(app), before, "{what}: nothing moves after another start");
}

/// Plays at random.
fn play_at_random(seed: usize, seconds: f64) -> Result<(), Box<dyn Error>> {
    let starts: [&[&str]; 7] = [
        &[],
        &["MarathonManController"],
        &["--mode", "course", "--role", "run"],
        &["--mode", "imitate"],
        &["hopper", "--mode", "learn"],
        &["hopper", "--mode", "push"],
        &["--mode", "testbed"],
    ];
    let (home, folder) = (std::env::current_dir()?, tempfile::tempdir()?);
    std::env::set_current_dir(folder.path())?;
    let words = [starts[seed % starts.len()], &["--threads", "1", "--table", "runs.sqlite"]].concat();
    let window = Window { resolution: (1280, 720).into(), ..default() };
    let mut app = windowless::game_in(Some(window), &words, FRAME, |_| ());
    let pad = devices::pad(&mut app);
    let window = app.world_mut().query_filtered::<Entity, With<PrimaryWindow>>().single(app.world())?;
    let mut dice = Dice(seed as u64);
    let time = |app: &App| app.world().resource::<Time<Real>>().elapsed_secs_f64();
    while time(&app) < seconds {
        random_event(&mut app, &mut dice, window, pad);
        let pause = dice.roll(12);
        frames(&mut app, pause);
        // many characters only take time
        let mut scenario = app.world_mut().resource_mut::<Scenario>();
        if scenario.agents > 4 {
            scenario.agents = 4;
        }
    }
    find_a_way_out(&mut app, &format!("seed {seed}"));
    std::env::set_current_dir(home)?;
    Ok(())
}

#[test]
fn a_random_player_finds_no_panic_and_no_dead_end() -> Result<(), Box<dyn Error>> {
    (0..7).try_for_each(|seed| play_at_random(seed, 20.0))
}

/// Run it by name: `tests/long.sh player`.
#[test]
#[ignore = "takes an hour"]
fn twenty_random_players_play_for_ten_minutes_each() -> Result<(), Box<dyn Error>> {
    (0..20).try_for_each(|seed| play_at_random(seed, 600.0))
}
