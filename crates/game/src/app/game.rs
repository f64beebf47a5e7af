//! The plugin that makes up the game.

use crate::app::cli::Args;
use crate::app::error::GameError;
use crate::app::features::course::{Runs, check_table};
use crate::app::features::replay::play::Playback;
use crate::app::features::training::{self, TrainingOptions};
use crate::app::first_scene;
use crate::app::input::camera::{CameraSettings, ChosenCamera};
use crate::app::input::scripted::{ScriptedActions, ScriptedInputs};
use crate::app::mode::Mode;
use crate::app::settings::apply::{self, AutomaticQuality};
use crate::app::settings::values::{Detail, Interface, Settings};
use crate::app::stage::actors::ShownMarks;
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::recording::Recording;
use crate::app::stage::scenario::Scenario;
use crate::app::stage::selection::fresh_start;
use crate::app::stage::skin::SkinChoice;
use crate::app::ui::menu::state::{Menu, Screen};
use crate::app::ui::theme::Hud;
use crate::app::{audio, features, input, mode, notifications, pacing, settings, stage, ui};
use bevy::prelude::*;
use bevy_egui::EguiPlugin;
use bevy_marathon::look::{
    DustPlugin, FollowCameraPlugin, GeneratedSkinPlugin, GhostPlugin, LookPlugin, MarksPlugin, Quality, SceneryPlugin,
    SkinPlugin,
};
use bevy_marathon::{Ground, MarathonPlugin};
use marathon_runs::{RunError, TaskConfig};

/// Everything that the app adds to Bevy's own plugins.
pub struct GamePlugin {
    args: Args,
    scenario: Scenario,
    shipped: ShippedPolicies,
    playback: Option<Playback>,
    skin: SkinChoice,
    quality: Quality,
    automatic: Quality,
    settings: Settings,
}

impl GamePlugin {
    /// The game of a command line.
    ///
    /// # Errors
    /// If an agent, a policy, a model or a recording cannot be used.
    pub fn new(args: &Args) -> Result<Self, GameError> {
        let shipped = ShippedPolicies::decode();
        let mut scenario = first_scene::scenario(args, &shipped)?;
        let mut playback = None;
        if let Some(path) = &args.replay {
            let recording = Recording::load(path)?;
            if !args.task.given.is_empty() {
                return Err(RunError::option("option", "does not go with a recording, which has its run's").into());
            }
            scenario.mode = Mode::Replay;
            (scenario.agent, scenario.agents) = (recording.task_config.agent.clone(), recording.agents);
            if Ground::ALL.contains(&recording.ground) {
                scenario.ground = recording.ground;
            }
            playback = Some(Playback::new(recording)?);
        }
        if scenario.mode == Mode::Learn {
            training::settings(
                &scenario.task_config(&shipped)?,
                &TrainingOptions { learn: args.learn.clone(), seed: 0 },
            )?;
        }
        if scenario.mode == Mode::Course {
            check_table(args.table.as_deref())?;
        }
        if args.mlagents_port.is_some() || args.watch_stream {
            scenario.mode = Mode::Outside;
        }
        if args.opens_menu() {
            scenario = fresh_start(&scenario, Mode::Watch, &shipped);
        }
        let skin = SkinChoice::read(args.skin.as_deref(), args.mapping.as_deref())?;
        // videos and tests show all numbers, and do not depend on what a user has set
        let interface = Interface { detail: Detail::Full, prompts: args.prompts, ..Interface::default() };
        let settings = Settings { interface, ..Settings::default() };
        Ok(GamePlugin {
            args: args.clone(),
            scenario,
            shipped,
            playback,
            skin,
            quality: args.quality(),
            automatic: Quality::default(),
            settings,
        })
    }

    /// Takes the settings of the player. Options of the command line win over them.
    ///
    /// # Errors
    /// If the skin of the settings cannot be read; the other settings are taken.
    pub fn set_settings(&mut self, settings: Settings) -> Result<(), GameError> {
        let chosen = settings.skin.clone();
        if let Some(quality) = settings.display.quality.quality().filter(|_| self.args.quality.is_none()) {
            self.quality = quality;
        }
        self.settings = settings;
        if self.args.skin.is_none() {
            self.skin = apply::skin(&chosen)?;
        }
        Ok(())
    }

    /// Sets the quality that fits the computer, unless the command line sets one.
    pub fn set_automatic_quality(&mut self, quality: Quality) {
        self.automatic = quality;
        self.quality = self.args.quality.unwrap_or(quality);
    }

    /// The task of the scenario.
    ///
    /// # Errors
    /// If there is no such agent, or the policy's file cannot be read.
    pub fn task_config(&self) -> Result<TaskConfig, RunError> {
        self.scenario.task_config(&self.shipped)
    }

    /// The camera of the settings, or of the command line.
    fn camera(&self) -> CameraSettings {
        let mut camera = apply::camera(&self.settings.camera);
        camera.reduced_motion |= self.args.reduced_motion;
        camera
    }

    /// Inserts what the command line sets.
    fn insert_settings(&self, app: &mut App) {
        let args = &self.args;
        app.insert_state(self.scenario.mode)
            .insert_resource(self.scenario.clone())
            .insert_resource(self.shipped.clone())
            .insert_resource(Hud { on: !args.no_hud, help: false, detail: self.settings.interface.detail })
            .insert_resource(AutomaticQuality(self.automatic))
            .insert_resource(self.settings.clone())
            .insert_resource(self.settings.bindings.clone())
            .insert_resource(ShownMarks { contacts: args.contacts, joints: args.joints })
            .insert_resource(TrainingOptions { learn: args.learn.clone(), seed: args.seed() })
            .insert_resource(ChosenCamera(args.camera))
            .insert_resource(self.camera())
            .insert_resource(args.steering)
            .insert_resource(args.fixed_settings())
            .insert_resource(args.mappings())
            .insert_resource(ScriptedActions::new(args.action.clone()))
            .insert_resource(ScriptedInputs::new(&args.input))
            .insert_resource(self.skin.clone())
            .insert_resource(Runs::new(args.table.clone(), args.player.clone()));
        if args.opens_menu() {
            let mut menu = Menu::default();
            menu.show(Screen::Main);
            app.insert_resource(menu);
        }
        if let Some(playback) = self.playback.clone() {
            app.insert_resource(playback);
        }
    }
}

impl Plugin for GamePlugin {
    fn build(&self, app: &mut App) {
        self.insert_settings(app);
        app.add_plugins((
            EguiPlugin::default(),
            MarathonPlugin,
            LookPlugin,
            FollowCameraPlugin,
            MarksPlugin,
            GhostPlugin,
            SkinPlugin,
            GeneratedSkinPlugin,
            DustPlugin,
            SceneryPlugin(self.quality),
        ));
        app.add_plugins((
            mode::plugin,
            pacing::plugin,
            notifications::plugin,
            settings::plugin,
            KeysPlugin,
            stage::plugin,
            audio::plugin,
            input::plugin,
            ui::plugin,
            features::plugin,
        ));
    }
}

/// Turns keys and buttons into [`ActionPressed`](crate::app::ActionPressed) messages. If something would be lost, a question
/// comes first.
#[derive(Clone, Copy, Debug, Default)]
pub struct KeysPlugin;

impl Plugin for KeysPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins((input::keys_plugin, ui::question::gate_plugin));
    }
}
