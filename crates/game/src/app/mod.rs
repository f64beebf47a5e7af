//! The `marathon-game` app: an app around the plugin.
//!
//! Read it from the bottom. `mode` has the states and the order of a frame, `stage` the characters, `input` the actions, `audio`
//! the sounds.
//! `ui` has text and menu, `features` the modes. `cli` and `launch` start the app.

mod audio;
mod cli;
mod display;
mod error;
mod features;
mod files;
mod first_scene;
mod game;
mod input;
mod interrupt;
mod launch;
mod mode;
mod notifications;
mod pacing;
mod settings;
mod stage;
mod ui;
mod video;

pub use audio::{PlaySound, RATE, Sound};
pub use cli::Args;
pub use error::GameError;
pub use features::boxes::Pile;
pub use features::course::leaderboard::{Course, KEPT, Place, ROWS, Run, Table};
pub use features::course::{List, MOST_STEPS, Runs, Site, Step};
pub use features::drag::Dragged;
pub use features::film::{FilmProgram, FilmReel};
pub use features::imitation::{GhostAt, Imitation, Reading};
pub use features::perturb::{Ball, Perturbations};
pub use features::remote::{Mailbox, RemotePose, RemoteSource};
pub use features::replay::play::Playback;
pub use features::replay::record::Recorder;
pub use features::training::{TrainingOptions, TrainingRun};
pub use game::{GamePlugin, KeysPlugin};
pub use input::actions::{Action, ActionPressed, ActionRequested, KeysFor, Steer, Steering};
pub use input::bindings::{Bindable, Bindings, Press};
pub use input::camera::CameraSettings;
pub use input::device::{Device, DeviceInUse, PadShapes};
pub use input::rebind::Rebinding;
pub use input::response::{Mapping, Mappings};
pub use input::scripted::{ScriptedAction, ScriptedActions, ScriptedInput, ScriptedInputs};
pub use launch::{main, run};
pub use mode::Mode;
pub use notifications::{Notification, Notifications};
pub use settings::file::{Loaded, SettingsFile, load as load_settings};
pub use settings::values::{Detail, QualityChoice, Settings, SkinSetting, Volumes, WindowKind};
pub use stage::actors::{Actor, Focus};
pub use stage::course::{CourseOptions, PlayerRole};
pub use stage::loaded::LoadedPolicy;
pub use stage::policies::ShippedPolicies;
pub use stage::puppets::Kind as PuppetKind;
pub use stage::recording::{PlayRecording, Recording, Row};
pub use stage::scenario::{LoadScenario, PolicySource, Scenario};
pub use stage::selection::switch_mode;
pub use stage::skin::{SkinChoice, SkinFile, SkinState};
pub use ui::glyphs::Glyph;
pub use ui::menu::state::{Menu, Screen};
pub use ui::prompts::{Prompt, Prompts};
pub use ui::question::{Asked, Question};
pub use ui::theme::Hud;
