//! The plugin that makes up the game.

use crate::app::cli::{self, Args};
use crate::app::error::GameError;
use crate::app::features::course::{Runs, check_table};
use crate::app::features::replay::play::Playback;
use crate::app::features::training::{TrainingOptions, settings};
use crate::app::input::camera::{CameraSettings, ChosenCamera};
use crate::app::input::scripted::{ScriptedActions, ScriptedInputs};
use crate::app::mode::Mode;
use crate::app::stage::actors::ShownMarks;
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::recording::Recording;
use crate::app::stage::scenario::Scenario;
use crate::app::stage::skin::SkinChoice;
use crate::app::ui::theme::Hud;
use crate::app::{audio, features, input, mode, notifications, pacing, stage, ui};
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
}

impl GamePlugin {
    /// The game of a command line.
    ///
    /// # Errors
    /// If an agent, a policy, a model or a recording cannot be used.
    pub fn new(args: &Args) -> Result<Self, GameError> {
        let shipped = ShippedPolicies::decode();
        let mut scenario = cli::scenario(args, &shipped)?;
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
            settings(&scenario.task_config(&shipped)?, &TrainingOptions { learn: args.learn.clone(), seed: 0 })?;
        }
        if scenario.mode == Mode::Course {
            check_table(args.table.as_deref())?;
        }
        if args.mlagents_port.is_some() || args.watch_stream {
            scenario.mode = Mode::Outside;
        }
        let skin = SkinChoice::read(args.skin.as_deref(), args.mapping.as_deref())?;
        Ok(GamePlugin { args: args.clone(), scenario, shipped, playback, skin, quality: args.quality() })
    }

    /// Sets the quality of the picture.
    pub fn set_quality(&mut self, quality: Quality) {
        self.quality = quality;
    }

    /// The task of the scenario.
    ///
    /// # Errors
    /// If there is no such agent, or the policy's file cannot be read.
    pub fn task_config(&self) -> Result<TaskConfig, RunError> {
        self.scenario.task_config(&self.shipped)
    }

    /// Inserts what the command line sets.
    fn insert_settings(&self, app: &mut App) {
        let args = &self.args;
        app.insert_state(self.scenario.mode)
            .insert_resource(self.scenario.clone())
            .insert_resource(self.shipped.clone())
            .insert_resource(Hud { on: !args.no_hud, help: false })
            .insert_resource(ShownMarks { contacts: args.contacts, joints: args.joints })
            .insert_resource(TrainingOptions { learn: args.learn.clone(), seed: args.seed() })
            .insert_resource(ChosenCamera(args.camera))
            .insert_resource(CameraSettings { reduced_motion: args.reduced_motion, ..default() })
            .insert_resource(args.steering)
            .insert_resource(args.fixed_settings())
            .insert_resource(args.mappings())
            .insert_resource(ScriptedActions::new(args.action.clone()))
            .insert_resource(ScriptedInputs::new(&args.input))
            .insert_resource(self.skin.clone())
            .insert_resource(Runs::new(args.table.clone(), args.player.clone()));
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
