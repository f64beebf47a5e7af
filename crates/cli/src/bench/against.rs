//! `--against mujoco`: both engines alternate on the same workload, so that other load on the computer affects both.

use super::mujoco::{Mujoco, Turn};
use super::options::Head;
use super::plan::{Counts, Plan, Which};
use super::workload::{Subject, controls, repeat};
use crate::error::CliError;
use marathon_physics::lanes::Isa;
use marathon_runs::speed::{Sample, spread};
use marathon_runs::terminal::{note, print_json, say};
use marathon_runs::text::broken;
use serde::Serialize;

/// Number of turns of each engine.
const ROUNDS: usize = 5;

/// A model on an instruction set, compared with MuJoCo. Times are medians over the rounds.
#[derive(Serialize)]
struct Row {
    agent: String,
    isa: &'static str,
    lanes: usize,
    threads: usize,
    rounds: usize,
    /// MuJoCo's time divided by Marathon's: processor time, and wall time.
    ratio: f64,
    wall_ratio: f64,
    marathon: Side,
    mujoco: Side,
}

/// One engine.
#[derive(Clone, Copy, Serialize)]
struct Side {
    /// Agent-steps of all rounds.
    steps: u64,
    /// Processor time per agent-step, and wall time per agent-step with all threads at work.
    ns_per_agent_step: f64,
    wall_ns_per_agent_step: f64,
    /// Time of the slowest round divided by that of the fastest, minus one.
    spread: f64,
    /// Mean number of contacts of an agent.
    contacts: f64,
    /// Agents whose simulation became non-finite.
    broken: u64,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    head: &'a Head,
    against: &'static str,
    mujoco_version: &'a str,
    seconds: f64,
    /// Agents of each thread, and untimed steps at the start of a repetition.
    agents: usize,
    warmup: usize,
    limp: bool,
    contacts: Which,
    rows: &'a [Row],
}

/// Measures every model on both engines.
///
/// # Errors
/// If MuJoCo is missing, or an engine refuses a model.
pub fn run(plan: &Plan, subjects: &[Subject], head: Head, json: bool) -> Result<(), CliError> {
    let mut mujoco = Mujoco::start()?;
    if !json {
        print_head(plan, subjects, &mujoco.version);
    }
    let mut rows: Vec<Row> = Vec::new();
    for subject in subjects {
        let measured = compare(plan, subject, &mut mujoco)?;
        if !json {
            measured.iter().for_each(|row| say(row.line()));
        }
        rows.extend(measured);
    }
    if json {
        print_json(&Document {
            head: &head,
            against: "mujoco",
            mujoco_version: &mujoco.version,
            seconds: plan.seconds,
            agents: plan.agents,
            warmup: plan.warmup,
            limp: plan.limp,
            contacts: plan.contacts,
            rows: &rows,
        });
    }
    for (i, row) in rows.iter().enumerate() {
        // the rows of a model share MuJoCo's result
        if i.is_multiple_of(plan.isas.len()) {
            note_broken(&row.mujoco, &row.agent, "MuJoCo");
        }
        note_broken(&row.marathon, &row.agent, &format!("Marathon {}", row.isa));
    }
    Ok(())
}

fn note_broken(side: &Side, model: &str, engine: &str) {
    if let Some(line) = broken(side.broken) {
        note(format!("{line}: {model}, {engine}"));
    }
}

fn compare(plan: &Plan, subject: &Subject, mujoco: &mut Mujoco) -> Result<Vec<Row>, CliError> {
    mujoco.load(plan, subject)?;
    let each = plan.seconds / ROUNDS as f64;
    let mut turns: Vec<Turn> = Vec::new();
    let mut ours: Vec<(Vec<Sample>, Counts)> = vec![Default::default(); plan.isas.len()];
    for round in 0..ROUNDS {
        turns.push(mujoco.turn(subject, each)?);
        for (isa, (samples, counts)) in plan.isas.iter().zip(&mut ours) {
            let sample = turn(plan, subject, *isa, each, round, counts)?;
            samples.push(sample);
        }
    }
    let contacts = turns.iter().map(|t| t.contacts).sum::<f64>() / ROUNDS as f64;
    let samples: Vec<Sample> = turns.iter().map(Turn::sample).collect();
    let theirs = Side::new(&samples, contacts, turns.iter().map(|t| t.broken).sum());
    let row = |(isa, (samples, counts)): (&Isa, &(Vec<Sample>, Counts))| {
        let steps: u64 = samples.iter().map(|s| s.steps).sum();
        let marathon = Side::new(samples, counts.stats.contacts as f64 / steps as f64, counts.non_finite);
        Row {
            agent: subject.name.clone(),
            isa: isa.name(),
            lanes: isa.lanes(),
            threads: plan.threads,
            rounds: ROUNDS,
            ratio: theirs.ns_per_agent_step / marathon.ns_per_agent_step,
            wall_ratio: theirs.wall_ns_per_agent_step / marathon.wall_ns_per_agent_step,
            marathon,
            mujoco: theirs,
        }
    };
    Ok(plan.isas.iter().zip(&ours).map(row).collect())
}

/// Marathon's turn: repetitions until the time is used up.
fn turn(
    plan: &Plan,
    subject: &Subject,
    isa: Isa,
    seconds: f64,
    round: usize,
    counts: &mut Counts,
) -> Result<Sample, CliError> {
    let mut sum = Sample::default();
    // each round has its own starts and controls
    let mut seed = (round as u64) << 32;
    while sum.cpu < seconds * plan.threads as f64 {
        let sample = repeat(plan, subject, isa, seed, counts).map_err(|e| subject.refused(e))?;
        seed += 1;
        sum.steps += sample.steps;
        sum.cpu += sample.cpu;
        sum.wall += sample.wall;
    }
    Ok(sum)
}

impl Side {
    fn new(samples: &[Sample], contacts: f64, broken: u64) -> Self {
        Self {
            steps: samples.iter().map(|s| s.steps).sum(),
            ns_per_agent_step: 1e9 * median(samples.iter().map(Sample::cpu_per_step)),
            wall_ns_per_agent_step: 1e9 * median(samples.iter().map(Sample::wall_per_step)),
            spread: spread(samples),
            contacts,
            broken,
        }
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn print_head(plan: &Plan, subjects: &[Subject], version: &str) {
    let contacts = match plan.contacts {
        Which::Ground => "contacts with the ground only",
        Which::All => "all contacts",
    };
    let (threads, agents) = (plan.threads, plan.agents);
    say(format!(
        "MuJoCo {version} in double precision and Marathon by instruction set, in turns on {threads} thread(s), {agents} \
         agent(s) each:"
    ));
    say(format!("one physics step of one agent {}, without resets, {contacts}; medians\n", controls(plan, subjects)));
    let (theirs, ours) = ("MuJoCo", "Marathon");
    say(format!(
        "{:23}  {:^26}  {:^26}  {:^18}",
        "", "processor time, us/step", "time passed, us/step", "contacts per agent"
    ));
    let times = format!("{theirs:>8} {ours:>9} {:>7}", "ratio");
    say(format!("{:14} {:>8}  {times}  {times}  {theirs:>8} {ours:>9}  {:>6}", "agent", "isa", "spread"));
}

impl Row {
    fn line(&self) -> String {
        let times = |theirs: f64, ours: f64, ratio: f64| {
            format!("{:>8.3} {:>9.3} {:>7}", theirs * 1e-3, ours * 1e-3, format!("{ratio:.1}x"))
        };
        let (m, o) = (&self.mujoco, &self.marathon);
        format!(
            "{:14} {:>8}  {}  {}  {:>8.2} {:>9.2}  {:>5.0}%",
            self.agent,
            self.isa,
            times(m.ns_per_agent_step, o.ns_per_agent_step, self.ratio),
            times(m.wall_ns_per_agent_step, o.wall_ns_per_agent_step, self.wall_ratio),
            m.contacts,
            o.contacts,
            100.0 * m.spread.max(o.spread)
        )
    }
}
