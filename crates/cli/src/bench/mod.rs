//! `marathon bench`: how fast the physics, the environments or the training are on this computer, and how well a policy obeys.
//!
//! Figures are processor time: what a step costs, whoever else uses the computer. The step is that of one agent. A row is
//! the median of several repetitions; `spread` is the distance between its fastest and slowest repetition.

mod against;
mod controller;
pub mod env;
mod gait;
mod mujoco;
mod options;
mod physics;
mod row;
mod scene;
mod train;

use crate::error::CliError;
use clap::Subcommand;

/// Options of `bench`.
#[derive(Debug, clap::Args)]
#[command(
    arg_required_else_help = true,
    after_help = "Compare rows of the same threads only: cores share caches and power, so that a step costs more with all \
                  of them busy."
)]
pub struct BenchArgs {
    /// What to measure.
    #[command(subcommand)]
    pub what: What,
}

/// What to measure.
#[derive(Debug, Subcommand)]
pub enum What {
    /// The physics alone: random torques, or what a policy did. A step is a physics step.
    Physics(physics::PhysicsArgs),
    /// The environments: random actions, observations, rewards, resets. A step is a decision.
    Env(env::EnvArgs),
    /// Training with the agent's own configuration, everything included. A step is a decision.
    Train(train::TrainArgs),
    /// Processor seconds of training until the agent runs at --speed and hardly falls, for each of --seeds.
    Gait(gait::GaitArgs),
    /// How well a policy obeys commands: a minute of random ones, steps of the speed, turns, standing, jumps, pushes.
    Controller(controller::ControllerArgs),
}

/// Measures and prints.
///
/// # Errors
/// If an agent or model is unknown or cannot be simulated, or what to compare with is missing.
pub fn run(args: &BenchArgs, json: bool) -> Result<(), CliError> {
    match &args.what {
        What::Physics(args) => physics::run(args, json),
        What::Env(args) => env::run(args, json),
        What::Train(args) => train::run(args, json),
        What::Gait(args) => gait::run(args, json),
        What::Controller(args) => controller::run(args, json),
    }
}
