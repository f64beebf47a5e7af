//! `bench env`: the environments under random actions, including resets.

use super::options::{Common, Head, isas, seconds, supported};
use super::row::{Figures, Row, Table};
use crate::error::CliError;
use marathon_envs::ShardFactory;
use marathon_physics::lanes::Isa;
use marathon_runs::speed::{EnvSpeed, env_speed};
use marathon_runs::{TaskConfig, TaskOptions};
use serde::Serialize;

/// Options of `bench env`.
#[derive(Debug, clap::Args)]
pub struct EnvArgs {
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub task: TaskOptions,
    /// Instruction set: f64, f32, baseline, avx2 or avx512; may be repeated [default: all of this processor].
    #[arg(long, value_name = "ISA", value_parser = supported)]
    pub isa: Vec<Isa>,
    /// Approximate processor seconds of each thread for every row.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    pub seconds: f64,
}

/// Columns of this benchmark.
#[derive(Serialize)]
struct Env {
    /// Physics steps per decision.
    frame_skip: usize,
    /// Mean decisions per episode. `None` if no episode ended.
    episode_length: Option<f64>,
    /// Agents whose simulation became non-finite.
    diverged: u64,
}

impl Figures for Env {
    const HEADER: &'static str = "  episode";
    fn cells(&self) -> String {
        format!("  {:>7}", self.episode_length.map_or("-".into(), |n| format!("{n:.0}")))
    }
    fn broken(&self) -> u64 {
        self.diverged
    }
}

/// Measures the agents for every instruction set.
///
/// # Errors
/// If an agent cannot be simulated.
pub fn run(args: &EnvArgs, json: bool) -> Result<(), CliError> {
    let (agents, threads) = (args.common.agents(true)?, args.common.threads());
    let step = "one decision of one agent: random actions, physics, observation, reward, resets";
    let mut table = Table::new(json, Head::new("env", threads), args.seconds, step);
    for id in &agents {
        // all that can run, or those that were asked for
        let can = |isa: &Isa| !args.isa.is_empty() || marathon_envs::obstacle(*isa).is_none();
        for isa in isas(&args.isa).into_iter().filter(can) {
            let factory = TaskConfig::named(id)?.with(&args.task)?.factory_on(isa)?;
            table.push(measure(threads, args.seconds, &*factory, isa));
        }
    }
    table.finish();
    Ok(())
}

fn measure(threads: usize, seconds: f64, factory: &dyn ShardFactory, isa: Isa) -> Row<Env> {
    let (spec, speed) = (factory.spec(), env_speed(threads, seconds, factory));
    let EnvSpeed { samples, agents, episode_length, diverged } = speed;
    let figures = Env { frame_skip: spec.frame_skip, episode_length, diverged };
    Row::new(&spec.id, isa, (threads, agents), &samples, figures)
}
