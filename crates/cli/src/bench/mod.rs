//! `marathon bench`: speed of the physics, the environments and the training on this computer, and how well a policy
//! tracks commands.
//!
//! Times are processor time, so other programs on the computer hardly change them. A step is a step of one agent. A row is
//! the median of several repetitions; `spread` compares its slowest repetition with its fastest.

mod against;
mod controller;
pub mod env;
mod gait;
mod mujoco;
pub mod options;
mod physics;
mod plan;
mod row;
mod scene;
mod train;
mod workload;

use crate::error::CliError;
use clap::Subcommand;

/// Options of `bench`.
#[derive(Debug, clap::Args)]
#[command(
    arg_required_else_help = true,
    after_help = "Compare only rows with the same number of threads: cores share caches and power, so a step costs more \
                  when all of them are busy."
)]
pub struct BenchArgs {
    /// Benchmark to run.
    #[command(subcommand)]
    pub what: What,
}

/// Benchmark to run.
#[derive(Debug, Subcommand)]
pub enum What {
    /// The physics only, under random torques or the recorded controls of a policy. A step is a physics step.
    Physics(physics::PhysicsArgs),
    /// The environments: random actions, physics, observations, rewards, resets. A step is a decision.
    Env(env::EnvArgs),
    /// Training with the agent's default configuration, everything included. A step is a decision.
    Train(train::TrainArgs),
    /// Processor seconds of training until the agent runs at --speed with at most --falls falls, for each seed.
    Gait(gait::GaitArgs),
    /// How well a policy tracks commands: a minute of random commands, speed steps, turns, standing, jumps, pushes.
    Controller(controller::ControllerArgs),
}

/// Measures and prints the results.
///
/// # Errors
/// If an agent or model is unknown or cannot be simulated, or MuJoCo is missing.
pub fn run(args: &BenchArgs, json: bool) -> Result<(), CliError> {
    match &args.what {
        What::Physics(args) => physics::run(args, json),
        What::Env(args) => env::run(args, json),
        What::Train(args) => train::run(args, json),
        What::Gait(args) => gait::run(args, json),
        What::Controller(args) => controller::run(args, json),
    }
}
