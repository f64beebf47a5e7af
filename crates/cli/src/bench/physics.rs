//! The physics alone.

use super::against;
use super::options::{Common, Head, isas, seconds, supported};
use super::row::{Figures, Row, Sample, Table, on_threads, thread_cpu};
use super::scene::{self, Scene};
use crate::error::CliError;
use clap::ValueEnum;
use marathon_envs::{EnvError, ModelSource, registry};
use marathon_physics::lanes::Isa;
use marathon_physics::workload::{HOLD, Report, Workload};
use marathon_physics::{Model, SimError, SimOptions, SolverStats};
use serde::Serialize;
use std::cell::RefCell;
use std::path::PathBuf;
use std::time::Instant;

/// Steps of a repetition under the clock.
pub const STEPS: usize = 400;

/// Options of `bench physics`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "--against mujoco needs a Python with the package `mujoco`: the one that the variable MARATHON_PYTHON \
                  names, else .venv/bin/python in the working directory or the root of its repository, else python3."
)]
pub struct PhysicsArgs {
    #[command(flatten)]
    pub common: Common,
    /// MJCF file to measure; may be repeated.
    #[arg(long, value_name = "FILE.xml")]
    pub model: Vec<PathBuf>,
    /// Policy, a file or the folder of a run: measure half seconds of its agents, with the states and controls that they had,
    /// instead of random torques; may be repeated.
    #[arg(long, value_name = "RUN|F", conflicts_with_all = ["warmup", "limp"])]
    pub policy: Vec<PathBuf>,
    /// Instruction set: f64, f32, baseline, avx2 or avx512; may be repeated [default: all that the processor has].
    #[arg(long, value_name = "ISA", value_parser = supported)]
    pub isa: Vec<Isa>,
    /// Processor seconds of each thread for every row, more or less.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    pub seconds: f64,
    /// Agents of each thread, rounded up to whole groups of lanes.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u64).range(1..=65536))]
    pub agents: u64,
    /// Steps of a repetition before those that are timed, rounded up to a multiple of the four that a control is held.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(0..=1_000_000))]
    pub warmup: u64,
    /// Leave the actuators out, so that bodies only fall and pile up.
    #[arg(long)]
    pub limp: bool,
    /// Contacts to simulate.
    #[arg(long, value_name = "WHICH", default_value = "ground")]
    pub contacts: Which,
    /// Another engine to run the same workload, in turns with this one.
    #[arg(long, value_name = "ENGINE")]
    pub against: Option<Engine>,
}

/// Contacts to simulate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Which {
    /// Those with what does not move.
    Ground,
    /// All that the model has.
    All,
}

/// Another engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// The Python package `mujoco`.
    Mujoco,
}

/// A model to measure.
pub struct Subject {
    pub name: String,
    pub model: Model,
    pub source: Source,
    /// What the agents do; empty: random torques.
    pub scenes: Vec<Scene>,
}

/// Where a model comes from.
pub enum Source {
    /// Text in MJCF.
    Text(String),
    /// A file in MJCF.
    File(PathBuf),
}

/// What a run of the benchmark has in common.
pub struct Plan {
    pub threads: usize,
    /// Agents of each thread.
    pub agents: usize,
    /// Steps before those under the clock.
    pub warmup: usize,
    /// Without actuators.
    pub limp: bool,
    pub contacts: Which,
    pub seconds: f64,
    pub isas: Vec<Isa>,
}

/// Counts of repetitions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub stats: SolverStats,
    /// Agents whose state was not finite at the end.
    pub non_finite: u64,
}

/// Columns of this benchmark.
#[derive(Serialize)]
struct Physics {
    /// Contacts of an agent, on average.
    contacts: f64,
    /// Newton iterations of a lane group per step, on average.
    newton: f64,
    /// Agents whose state was not finite at the end.
    non_finite: u64,
}

impl Figures for Physics {
    const HEADER: &'static str = "  contacts  newton";
    fn cells(&self) -> String {
        format!("  {:>8.2}  {:>6.2}", self.contacts, self.newton)
    }
    fn broken(&self) -> u64 {
        self.non_finite
    }
}

/// Measures the models of the agents and of the files for every instruction set.
///
/// # Errors
/// If a model cannot be read or simulated, or there is nothing to compare with.
pub fn run(args: &PhysicsArgs, json: bool) -> Result<(), CliError> {
    let subjects = subjects(args)?;
    let plan = Plan {
        threads: args.common.threads(),
        agents: args.agents as usize,
        warmup: (args.warmup as usize).next_multiple_of(HOLD),
        limp: args.limp,
        contacts: args.contacts,
        seconds: args.seconds,
        isas: isas(&args.isa),
    };
    let head = Head::new("physics", plan.threads);
    if args.against == Some(Engine::Mujoco) {
        return against::run(&plan, &subjects, head, json);
    }
    let step = format!("one physics step of one agent {}, nobody reset", plan.load(&subjects));
    let mut table = Table::new(json, head, args.seconds, &step);
    for subject in &subjects {
        for isa in &plan.isas {
            table.push(measure(&plan, subject, *isa).map_err(|e| subject.refused(e))?);
        }
    }
    table.finish();
    Ok(())
}

fn subjects(args: &PhysicsArgs) -> Result<Vec<Subject>, CliError> {
    let mut subjects = Vec::new();
    // files alone mean the files alone
    let files = !args.model.is_empty() || !args.policy.is_empty();
    let agents = if args.common.agent.is_empty() && files { Vec::new() } else { args.common.agents(false)? };
    for id in agents {
        let agent = registry::agent(&id)?;
        let source = match agent.facts().model {
            ModelSource::Text(text) => Source::Text(text.into()),
            ModelSource::File(path) => Source::File(path),
        };
        subjects.push(Subject { name: id, model: agent.model()?, source, scenes: Vec::new() });
    }
    for file in &args.model {
        let name = file.file_stem().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
        let (model, source) = (Model::from_xml_file(file)?, Source::File(file.clone()));
        subjects.push(Subject { name, model, source, scenes: Vec::new() });
    }
    for file in &args.policy {
        subjects.push(scene::subject(file, args.agents as usize)?);
    }
    subjects.iter_mut().for_each(|s| s.model.opt.flags.actuation &= !args.limp);
    Ok(subjects)
}

impl Plan {
    /// What moves the agents.
    pub fn load(&self, subjects: &[Subject]) -> &'static str {
        let replayed = subjects.iter().filter(|subject| !subject.scenes.is_empty()).count();
        match (self.limp, replayed) {
            (true, _) => "without actuators",
            (false, 0) => "under random controls",
            (false, n) if n == subjects.len() => "that does what its policy did",
            (false, _) => "under random controls or those of its policy",
        }
    }
}

impl Subject {
    /// The error of a model that cannot be simulated.
    pub fn refused(&self, source: SimError) -> CliError {
        EnvError::Sim { id: self.name.clone(), source }.into()
    }
}

fn measure(plan: &Plan, subject: &Subject, isa: Isa) -> Result<Row<Physics>, SimError> {
    let mut samples: Vec<Sample> = Vec::new();
    let mut counts = Counts::default();
    while samples.iter().map(|s| s.cpu).sum::<f64>() < plan.seconds * plan.threads as f64 {
        let seed = samples.len() as u64;
        samples.push(repeat(plan, subject, isa, seed, &mut counts)?);
    }
    let steps: u64 = samples.iter().map(|s| s.steps).sum();
    let figures = Physics {
        contacts: counts.stats.contacts as f64 / steps as f64,
        newton: counts.stats.newton as f64 / counts.stats.solves.max(1) as f64,
        non_finite: counts.non_finite,
    };
    let agents = plan.agents.next_multiple_of(isa.lanes()) * plan.threads;
    Ok(Row::new(&subject.name, isa, (plan.threads, agents), &samples, figures))
}

/// One repetition on every thread, and its counts.
///
/// # Errors
/// If the model cannot be simulated.
pub fn repeat(plan: &Plan, subject: &Subject, isa: Isa, seed: u64, counts: &mut Counts) -> Result<Sample, SimError> {
    let Subject { model, scenes, .. } = subject;
    if !scenes.is_empty() {
        return scene::replay(plan, model, scenes, isa, counts);
    }
    let work = |thread: usize, _: &mut ()| {
        let sim = SimOptions { ground_contacts_only: plan.contacts == Which::Ground, ..Default::default() };
        let seed = seed * plan.threads as u64 + thread as u64;
        let workload = Workload { isa, agents: plan.agents, warmup: plan.warmup, steps: STEPS, seed, sim };
        let ticks = RefCell::new(Vec::new());
        let clock = || {
            ticks.borrow_mut().push(Instant::now());
            thread_cpu()
        };
        let report = workload.run(model, &clock)?;
        let ticks = ticks.into_inner();
        let wall = ticks.last().zip(ticks.first()).map_or(0.0, |(last, first)| (*last - *first).as_secs_f64());
        Ok((report, wall))
    };
    let (reports, _) = on_threads(&mut vec![(); plan.threads], work);
    let reports: Vec<(Report, f64)> = reports.into_iter().collect::<Result<_, SimError>>()?;
    let mut sample = Sample::default();
    for (report, wall) in &reports {
        sample.steps += (report.agents * STEPS) as u64;
        sample.cpu += report.seconds;
        // threads run side by side, each with its own warm-up outside the clock
        sample.wall = sample.wall.max(*wall);
        counts.stats.add(&report.stats);
        counts.non_finite += report.non_finite as u64;
    }
    Ok(sample)
}
