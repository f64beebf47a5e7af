//! Training with the agent's default configuration, everything included.

use super::options::{Common, Head, for_networks, seconds};
use super::row::{Figures, Row, Table};
use crate::error::CliError;
use crate::number::count;
use crate::program;
use marathon_config as config;
use marathon_learn::{Control, IterationStats, Players, Snapshot, train_with};
use marathon_physics::lanes::Isa;
use marathon_runs::processes::Processes;
use marathon_runs::speed::Sample;
use marathon_runs::text::short;
use marathon_runs::{TaskConfig, TaskOptions};
use serde::Serialize;

/// Repetitions of a row, each with its own seed.
const REPETITIONS: usize = 3;
/// Fewest iterations with an update in a repetition.
const ITERATIONS: u64 = 2;

/// Options of `bench train`.
#[derive(Debug, clap::Args)]
pub struct TrainArgs {
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub task: TaskOptions,
    /// Instruction set: f32, baseline, avx2 or avx512; may be repeated [default: the best of this processor].
    #[arg(long, value_name = "ISA", value_parser = for_networks)]
    pub isa: Vec<Isa>,
    /// Approximate processor seconds of each thread for every row.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    pub seconds: f64,
    /// Width of both hidden layers [default: the configuration's].
    #[arg(long, value_name = "WIDTH", value_parser = count::<u32>(1..=4096))]
    pub hidden: Option<u32>,
    /// Number of agents, a multiple of 16 [default: the configuration's].
    #[arg(long, value_name = "N")]
    pub agents: Option<usize>,
    /// Processes that play rollouts; with 0, the learner plays them on its threads. The time of all processes counts.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub processes: usize,
}

/// Columns of this benchmark.
#[derive(Serialize)]
struct Train {
    /// Share of the time in the environments.
    env_share: f64,
    /// Share of the time in gradient updates.
    update_share: f64,
    physics_steps_per_wall_second: f64,
    /// Agents whose simulation became non-finite.
    diverged: u64,
}

impl Figures for Train {
    const HEADER: &'static str = "   env  update  physics steps/s";
    fn cells(&self) -> String {
        let physics = short(self.physics_steps_per_wall_second);
        format!("  {:>3.0}%  {:>5.0}%  {physics:>15}", 100.0 * self.env_share, 100.0 * self.update_share)
    }
    fn broken(&self) -> u64 {
        self.diverged
    }
}

/// Measures the agents.
///
/// # Errors
/// If an agent cannot be simulated or trained.
pub fn run(args: &TrainArgs, json: bool) -> Result<(), CliError> {
    let (agents, threads) = (args.common.agents(false)?, args.common.threads());
    let isas = if args.isa.is_empty() { vec![Isa::best()] } else { args.isa.clone() };
    let step = "one decision of one agent, learning included";
    let mut table = Table::new(json, Head::new("train", threads), args.seconds, step);
    for id in &agents {
        for isa in &isas {
            table.push(measure(args, threads, id, *isa)?);
        }
    }
    table.finish();
    Ok(())
}

fn measure(args: &TrainArgs, threads: usize, id: &str, isa: Isa) -> Result<Row<Train>, CliError> {
    let task = TaskConfig::named(id)?.with(&args.task)?;
    let factory = task.factory_on(isa)?;
    let mut base = config::default_for(id).config;
    if let Some(width) = args.hidden.map(|width| width as usize) {
        base.network.hidden = vec![width; 2];
    }
    base.run.agents = args.agents.unwrap_or(base.run.agents);
    let mut samples = Vec::new();
    let (mut shares, mut weight, mut diverged) = ([0.0; 2], 0.0, 0);
    for seed in 0..REPETITIONS as u64 {
        // a repetition ends by the clock; the cost of a step changes as agents learn to run
        let config = base.clone().with(|c| {
            c.run.seed = seed;
            c.run.threads = threads;
            c.run.total_steps = u64::MAX >> 16;
        });
        let each = args.seconds * config.run.worker_count() as f64 / REPETITIONS as f64;
        let mut first: Option<IterationStats> = None;
        let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
            diverged += stats.diverged;
            // the first iteration has no update
            let Some(first) = &first else {
                first = Some(stats.clone());
                return Control::Continue;
            };
            let seconds = stats.wall_seconds - first.wall_seconds;
            shares[0] += stats.env_share;
            shares[1] += stats.update_share;
            weight += 1.0;
            let enough = stats.iteration > ITERATIONS && stats.cpu_seconds - first.cpu_seconds >= each;
            if enough || seconds > 10.0 * args.seconds.max(1.0) { Control::Stop } else { Control::Continue }
        };
        let mut processes = match args.processes {
            0 => None,
            n => Some(Processes::start(&program::file(), &task, &config, n)?),
        };
        let players = processes.as_mut().map(|processes| processes as &mut dyn Players);
        let last = train_with(players, &*factory, isa, &config, None, &mut observer)?.last;
        if let Some(error) = processes.and_then(|mut processes| processes.error.take()) {
            return Err(error.into());
        }
        if let (Some(first), Some(last)) = (first, last) {
            samples.push(Sample {
                steps: last.steps - first.steps,
                cpu: last.cpu_seconds - first.cpu_seconds,
                wall: last.wall_seconds - first.wall_seconds,
            });
        }
    }
    let [env_share, update_share] = shares.map(|share| share / weight);
    let figures = Train { env_share, update_share, physics_steps_per_wall_second: 0.0, diverged };
    let mut row = Row::new(id, isa, (threads, base.run.agents), &samples, figures);
    row.figures.physics_steps_per_wall_second = row.steps_per_wall_second * factory.spec().frame_skip as f64;
    Ok(row)
}
