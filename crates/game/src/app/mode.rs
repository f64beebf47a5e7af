//! The mode of the game, and the parts of a frame.

use bevy::prelude::*;
use clap::ValueEnum;

/// The use of the characters.
#[derive(States, Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum)]
pub enum Mode {
    /// Watch a policy.
    #[default]
    Watch,
    /// Push the character, throw balls at it, change its physics.
    Push,
    /// Compare the character with the motion clip that it follows.
    Imitate,
    /// Run over an assault course.
    Course,
    /// Train from random weights and watch the newest policy.
    Learn,
    /// Move the motors of any MJCF model.
    Testbed,
    /// Show a recording.
    Replay,
    /// Show what another program simulates.
    #[value(skip)]
    Outside,
}

impl Mode {
    /// All modes.
    pub const ALL: [Mode; 8] =
        [Mode::Watch, Mode::Push, Mode::Imitate, Mode::Course, Mode::Learn, Mode::Testbed, Mode::Replay, Mode::Outside];
    /// The modes that the menu offers.
    pub const IN_MENU: [Mode; 6] = [Mode::Watch, Mode::Push, Mode::Imitate, Mode::Course, Mode::Learn, Mode::Testbed];

    /// Its name on the screen.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Watch => "watch",
            Mode::Push => "push",
            Mode::Imitate => "imitate",
            Mode::Course => "assault course",
            Mode::Learn => "learn live",
            Mode::Testbed => "test bed",
            Mode::Replay => "replay",
            Mode::Outside => "from outside",
        }
    }

    /// Its goal, in a line on the screen.
    pub fn goal(self) -> &'static str {
        match self {
            Mode::Watch => "Move the character as you like, or watch it.",
            Mode::Push => "Find out what makes the character fall.",
            Mode::Imitate => "See how closely the character follows its motion clip.",
            Mode::Course => "Get to the finish.",
            Mode::Learn => "Watch a policy learn from random weights.",
            Mode::Testbed => "Move each motor of a model by hand.",
            Mode::Replay => "Look at a recording, back and forth.",
            Mode::Outside => "Watch what another program simulates.",
        }
    }

    /// Whether the game itself simulates the characters.
    pub fn is_simulated(self) -> bool {
        !matches!(self, Mode::Replay | Mode::Outside)
    }
}

/// The parts of a frame in `Update`, in this order.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AppSet {
    /// Actions change settings and the requested scenario.
    Input,
    /// The scenario is loaded, and the mode takes in what threads and files have.
    Simulate,
    /// Cameras, marks and text follow.
    Present,
}

pub(super) fn plugin(app: &mut App) {
    app.configure_sets(Update, (AppSet::Input, AppSet::Simulate, AppSet::Present).chain());
}

/// Enters a mode now, not before the next frame: the systems for leaving and entering run before this returns.
pub fn enter(world: &mut World, mode: Mode) {
    NextState::set_if_neq(&mut world.resource_mut::<NextState<Mode>>(), mode);
    world.run_schedule(StateTransition);
}
