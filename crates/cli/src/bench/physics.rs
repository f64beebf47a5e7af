//! `bench physics`: the physics only.

use super::against;
use super::options::{Common, Head, isas, seconds, supported};
use super::plan::{Counts, Plan, Which};
use super::row::{Figures, Row, Table};
use super::workload::{Subject, controls, repeat};
use crate::error::CliError;
use crate::number::count;
use clap::ValueEnum;
use marathon_physics::SimError;
use marathon_physics::lanes::Isa;
use marathon_physics::workload::HOLD;
use marathon_runs::speed::Sample;
use serde::Serialize;
use std::path::PathBuf;

/// Options of `bench physics`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "--against mujoco needs a Python with the package `mujoco`. Marathon uses the Python that MARATHON_PYTHON names, \
                  else .venv/bin/python in the working directory or the root of its repository, else python3."
)]
pub struct PhysicsArgs {
    #[command(flatten)]
    pub common: Common,
    /// MJCF file to measure; may be repeated.
    #[arg(long, value_name = "FILE.xml")]
    pub model: Vec<PathBuf>,
    /// Policy, a file or the folder of a run: record scenes of about half a second with it, and replay their states and controls
    /// instead of random torques; may be repeated.
    #[arg(long, value_name = "RUN|F", conflicts_with_all = ["warmup", "limp"])]
    pub policy: Vec<PathBuf>,
    /// Instruction set: f64, f32, baseline, avx2 or avx512; may be repeated [default: all of this processor].
    #[arg(long, value_name = "ISA", value_parser = supported)]
    pub isa: Vec<Isa>,
    /// Approximate processor seconds of each thread for every row.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    pub seconds: f64,
    /// Agents of each thread, rounded up to whole groups of lanes.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = count::<u64>(1..=65536))]
    pub agents: u64,
    /// Untimed steps at the start of a repetition, rounded up to a multiple of four, the steps that a control is held.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = count::<u64>(0..=1_000_000))]
    pub warmup: u64,
    /// Turn the actuators off, so that bodies only fall and pile up.
    #[arg(long)]
    pub limp: bool,
    /// Contacts to simulate.
    #[arg(long, value_name = "WHICH", default_value = "ground")]
    pub contacts: Which,
    /// Another engine that runs the same workload in turns with Marathon.
    #[arg(long, value_name = "ENGINE")]
    pub against: Option<Engine>,
}

/// Another engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// The Python package `mujoco`.
    Mujoco,
}

/// Columns of this benchmark.
#[derive(Serialize)]
struct Physics {
    /// Mean number of contacts of an agent.
    contacts: f64,
    /// Mean number of Newton iterations of a lane group per step.
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
/// If a model cannot be read or simulated, or the other engine is missing.
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
    let step = format!("one physics step of one agent {}, without resets", controls(&plan, &subjects));
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
    // if only files are given, skip the built-in agents
    let files = !args.model.is_empty() || !args.policy.is_empty();
    let agents = if args.common.agent.is_empty() && files { Vec::new() } else { args.common.agents(false)? };
    for id in agents {
        subjects.push(Subject::agent(id)?);
    }
    for file in &args.model {
        subjects.push(Subject::file(file)?);
    }
    for file in &args.policy {
        subjects.push(Subject::policy(file, args.agents as usize)?);
    }
    subjects.iter_mut().for_each(|s| s.model.opt.flags.actuation &= !args.limp);
    Ok(subjects)
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
