//! Processor seconds until a gait: training stops when an evaluation meets the demanded speed and falls. Evaluations come at
//! regular steps, and their time does not count.

use super::options::{Common, Head, for_networks};
use crate::error::CliError;
use crate::number::count;
use marathon_config as config;
use marathon_envs::registry;
use marathon_learn::{Control, EvalOptions, Evaluation, IterationStats, Snapshot, evaluate, train};
use marathon_physics::lanes::Isa;
use marathon_runs::configuration;
use marathon_runs::terminal::{note, print_json, say};
use marathon_runs::text::{broken, short};
use serde::Serialize;
use std::path::PathBuf;

/// Episodes of an evaluation.
const EPISODES: usize = 100;

/// Options of `bench gait`.
#[derive(Debug, clap::Args)]
pub struct GaitArgs {
    #[command(flatten)]
    pub common: Common,
    /// Instruction set: f32, baseline, avx2 or avx512 [default: the best of this processor].
    #[arg(long, value_name = "ISA", value_parser = for_networks)]
    pub isa: Option<Isa>,
    /// Configuration of all agents [default: the fast configuration of each agent].
    #[arg(long, value_name = "F.yaml")]
    pub config: Option<PathBuf>,
    /// Number of seeds.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = count::<u64>(1..=1000))]
    pub seeds: u64,
    /// The first seed; the others follow it.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = count::<u64>(0..=u64::MAX - 1000))]
    pub first_seed: u64,
    /// Demanded mean speed, m/s.
    #[arg(long, value_name = "M/S", default_value_t = 2.0, value_parser = speed)]
    pub speed: f64,
    /// Largest number of falls in 100 episodes.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = count::<u64>(0..=EPISODES as u64))]
    pub falls: u64,
    /// Steps between two evaluations, whose time does not count.
    #[arg(long, value_name = "N", default_value_t = 250_000, value_parser = count::<u64>(1..=u64::MAX))]
    pub every: u64,
}

/// Reads a finite speed.
fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().ok().filter(|x: &f64| x.is_finite());
    speed.ok_or_else(|| "expected a finite number of meters per second, such as 2.5".into())
}

/// One seed.
#[derive(Serialize)]
struct Run {
    agent: String,
    seed: u64,
    /// Whether an evaluation met the demand within the configuration's steps.
    reached: bool,
    steps: u64,
    cpu_seconds: f64,
    wall_seconds: f64,
    /// Agents whose simulation became non-finite.
    diverged: u64,
    /// The last evaluation.
    eval: Option<Evaluation>,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    head: Head,
    speed: f64,
    falls: u64,
    episodes: usize,
    runs: &'a [Run],
}

/// Trains every agent with every seed.
///
/// # Errors
/// If an agent cannot be simulated or trained.
pub fn run(args: &GaitArgs, json: bool) -> Result<(), CliError> {
    let (agents, threads) = (args.common.agents(false)?, args.common.threads());
    let GaitArgs { speed, falls, every, .. } = *args;
    let mut runs = Vec::new();
    if !json {
        say(format!("until {EPISODES} episodes run at {speed} m/s on average with at most {falls} falls, tried every"));
        say(format!("{} steps off the clock; seconds are those of {} thread(s)\n", short(every as f64), threads));
        say(format!(
            "{:14} {:>4} {:>8} {:>8} {:>8} {:>8} {:>6} {:>6}",
            "agent", "seed", "steps", "cpu s", "wall s", "return", "m/s", "falls"
        ));
    }
    for id in &agents {
        for seed in args.first_seed..args.first_seed + args.seeds {
            let run = one(args, threads, id, seed)?;
            if !json {
                print(&run);
            }
            runs.push(run);
        }
        if !json {
            let mut seconds: Vec<f64> = runs
                .iter()
                .filter(|r| r.agent == *id)
                .map(|r| if r.reached { r.cpu_seconds } else { f64::INFINITY })
                .collect();
            seconds.sort_by(f64::total_cmp);
            say(format!(
                "{id:14} median {:.1}, largest {:.1} CPU seconds\n",
                seconds[seconds.len() / 2],
                seconds[seconds.len() - 1]
            ));
        }
    }
    if json {
        let head = Head::new("gait", threads);
        print_json(&Document { head, speed, falls, episodes: EPISODES, runs: &runs });
    }
    if let Some(line) = broken(runs.iter().map(|run| run.diverged).sum()) {
        note(line);
    }
    Ok(())
}

fn one(args: &GaitArgs, threads: usize, id: &str, seed: u64) -> Result<Run, CliError> {
    let isa = args.isa.unwrap_or_else(Isa::best);
    let factory = registry::factory(id, isa)?;
    let loaded = match &args.config {
        Some(path) => configuration::load(path, id)?,
        None => config::default_for(id),
    };
    let config = loaded.config.with(|c| {
        c.run.seed = seed;
        c.run.threads = threads;
    });
    let options = EvalOptions { episodes: EPISODES, ..Default::default() };
    let mut next = args.every;
    let mut failed = None;
    let mut run = Run {
        agent: id.into(),
        seed,
        reached: false,
        steps: 0,
        cpu_seconds: 0.0,
        wall_seconds: 0.0,
        diverged: 0,
        eval: None,
    };
    let mut observer = |stats: &IterationStats, snapshot: &Snapshot<'_>| {
        (run.steps, run.cpu_seconds, run.wall_seconds) = (stats.steps, stats.cpu_seconds, stats.wall_seconds);
        run.diverged += stats.diverged;
        if stats.steps < next {
            return Control::Continue;
        }
        next += args.every;
        match evaluate(&*factory, isa, &snapshot.policy(), &options) {
            Ok(eval) => {
                run.reached = eval.falls <= args.falls && eval.speed_mean > args.speed;
                run.eval = Some(eval);
            }
            Err(error) => failed = Some(error),
        }
        if run.reached || failed.is_some() { Control::Stop } else { Control::Continue }
    };
    train(&*factory, isa, &config, None, &mut observer)?;
    match failed {
        Some(error) => Err(error.into()),
        None => Ok(run),
    }
}

fn print(run: &Run) {
    let Run { agent, seed, steps, cpu_seconds, wall_seconds, .. } = run;
    let steps = short(*steps as f64);
    let eval = run
        .eval
        .as_ref()
        .map_or(String::new(), |e| format!("{:>8.0} {:>6.2} {:>6}", e.return_mean, e.speed_mean, e.falls));
    let note = if run.reached { "" } else { "  not reached" };
    say(format!("{agent:14} {seed:>4} {steps:>8} {cpu_seconds:>8.1} {wall_seconds:>8.1} {eval}{note}"));
}
