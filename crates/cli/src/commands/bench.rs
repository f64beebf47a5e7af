//! `marathon bench`: how fast the physics, the environments or the training are on this computer.
//!
//! Figures are processor time: what a step costs, whoever else uses the computer. The step is that of one agent. A row is
//! the median of several repetitions; `spread` is the distance between its fastest and slowest repetition.

mod env;
mod gait;
mod physics;
mod row;
mod train;

use crate::console::{print_json, say};
use crate::error::CliError;
use clap::ValueEnum;
use marathon_envs::registry;
use marathon_physics::lanes::Isa;
use row::Row;
use serde::Serialize;
use std::path::PathBuf;

/// What to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum What {
    /// The physics alone: random torques, nobody is reset. A step is a physics step.
    Physics,
    /// The environments: random actions, observations, rewards, resets. A step is a decision.
    Env,
    /// Training with the agent's own configuration, everything included. A step is a decision.
    Train,
    /// Processor seconds of training until the agent runs at --speed and hardly falls, for each of --seeds.
    Gait,
}

/// Options of `bench`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Compare rows of the same threads only: cores share caches and power, so that a step costs more with all of them busy.
The physics has a counterpart in tests/oracle/bench_mujoco.py, which runs the same workload through MuJoCo.")]
pub struct BenchArgs {
    /// What to measure.
    pub what: What,
    /// Agent to measure; may be repeated [default: all; one of those with the same model, where only the model counts].
    #[arg(long, value_name = "AGENT")]
    pub agent: Vec<String>,
    /// MJCF file to measure, for `physics`; may be repeated.
    #[arg(long, value_name = "FILE.xml")]
    pub model: Vec<PathBuf>,
    /// Threads; 0 means one per processor.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(0..=4096))]
    pub threads: u64,
    /// Instruction set: f64, f32, baseline, avx2 or avx512; may be repeated [default: all that the processor has, for
    /// `train` the best].
    #[arg(long, value_name = "ISA")]
    pub isa: Vec<Isa>,
    /// Processor seconds of each thread for every row, more or less.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    pub seconds: f64,
    /// Widths of both hidden layers in `train`, instead of the configuration's.
    #[arg(long, value_name = "WIDTH", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub hidden: Option<u32>,
    /// Seeds in `gait`: 1 to N.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    /// Mean speed that `gait` asks for, m/s.
    #[arg(long, value_name = "M/S", default_value_t = 2.0)]
    pub speed: f64,
    /// Episodes of 100 that may end in a fall in `gait`.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub falls: u64,
    /// Steps between the evaluations of `gait`, which do not count.
    #[arg(long, value_name = "N", default_value_t = 250_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub every: u64,
}

/// What every benchmark needs to know.
struct Plan {
    agents: Vec<String>,
    isas: Vec<Isa>,
    threads: usize,
    seconds: f64,
    hidden: Option<usize>,
}

/// The computer.
#[derive(Serialize)]
struct Machine {
    arch: &'static str,
    os: &'static str,
    /// Processors that this program may use.
    cores: usize,
    /// Instruction sets that the processor has, narrowest first.
    isas: Vec<&'static str>,
    /// The one that everything else uses.
    best_isa: &'static str,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Document<'a> {
    bench: What,
    version: &'static str,
    machine: Machine,
    threads: usize,
    seconds: f64,
    rows: &'a [Row],
}

/// Measures and prints.
///
/// # Errors
/// If an agent or model is unknown or cannot be simulated, or the processor lacks an instruction set.
pub fn run(args: &BenchArgs, json: bool) -> Result<(), CliError> {
    let what = args.what;
    if what != What::Physics && !args.model.is_empty() {
        return Err(CliError::Usage("--model goes with `bench physics`; an MJCF file has no reward".into()));
    }
    let machine = Machine {
        arch: std::env::consts::ARCH,
        os: std::env::consts::OS,
        cores: std::thread::available_parallelism().map_or(1, |n| n.get()),
        isas: Isa::ALL.into_iter().filter(|isa| isa.supported()).map(Isa::name).collect(),
        best_isa: Isa::best().name(),
    };
    let plan = Plan {
        agents: agents(args)?,
        isas: isas(args)?,
        threads: if args.threads == 0 { machine.cores } else { args.threads as usize },
        seconds: args.seconds,
        hidden: args.hidden.map(|w| w as usize),
    };
    if what == What::Gait {
        return gait::run(&plan, args, json);
    }
    if !json {
        print_head(what, &machine, &plan);
    }
    // rows appear as they are measured
    let mut rows: Vec<Row> = Vec::new();
    let mut emit = |row: Row| {
        if !json {
            say(row.line(what));
        }
        rows.push(row);
    };
    match what {
        What::Physics => physics::run(&plan, &args.model, &mut emit)?,
        What::Env => env::run(&plan, &mut emit)?,
        What::Train | What::Gait => train::run(&plan, &mut emit)?,
    }
    if json {
        let version = env!("CARGO_PKG_VERSION");
        let (threads, seconds) = (plan.threads, plan.seconds);
        print_json(&Document { bench: what, version, machine, threads, seconds, rows: &rows });
    }
    Ok(())
}

fn print_head(what: What, machine: &Machine, plan: &Plan) {
    let Machine { arch, os, cores, isas, best_isa } = machine;
    say(format!("{arch} {os}, {cores} cores, instruction sets {} (best: {best_isa})", isas.join(", ")));
    let step = match what {
        What::Physics => "a step is one physics step of one agent under random torques, nobody reset",
        What::Env => "a step is one decision of one agent: random actions, physics, observation, reward, resets",
        What::Train | What::Gait => "a step is one decision of one agent, with all that learning from it takes",
    };
    say(format!("{step};\ntimes are processor time of {} thread(s); rows are medians\n", plan.threads));
    say(Row::header(what));
}

/// Ids of the agents to measure. By default all, but of those with the same model one, except where their tasks count.
fn agents(args: &BenchArgs) -> Result<Vec<String>, CliError> {
    if !args.agent.is_empty() {
        let id = |name: &String| Ok(registry::agent(name)?.facts().id.to_string());
        return args.agent.iter().map(id).collect();
    }
    if !args.model.is_empty() {
        return Ok(Vec::new());
    }
    let mut ids: Vec<String> = Vec::new();
    let mut models = Vec::new();
    for id in registry::ids() {
        let model = registry::agent(&id)?.facts().model;
        if args.what == What::Env || !models.contains(&model) {
            models.push(model);
            ids.push(id);
        }
    }
    Ok(ids)
}

fn isas(args: &BenchArgs) -> Result<Vec<Isa>, CliError> {
    for isa in &args.isa {
        if !isa.supported() {
            let (isa, best) = (isa.name(), Isa::best().name());
            return Err(CliError::Usage(format!("this processor cannot run '{isa}'; the best it has is '{best}'")));
        }
        if *isa == Isa::F64 && matches!(args.what, What::Train | What::Gait) {
            return Err(CliError::Usage(
                "networks train in single precision; expected f32, baseline, avx2 or avx512".into(),
            ));
        }
    }
    Ok(match (&args.isa[..], args.what) {
        ([], What::Train | What::Gait) => vec![Isa::best()],
        ([], _) => Isa::ALL.into_iter().filter(|isa| isa.supported()).collect(),
        (chosen, _) => chosen.to_vec(),
    })
}

fn seconds(text: &str) -> Result<f64, String> {
    let x: f64 = text.parse().map_err(|_| "expected a number of seconds".to_string())?;
    if x > 0.0 && x <= 86_400.0 { Ok(x) } else { Err("expected a positive number of seconds, at most a day".into()) }
}
