//! Repetitions, and the row of a table that they make.

use super::options::{Head, Machine};
use crate::console::{note, print_json, say};
use marathon_physics::lanes::Isa;
use marathon_runs::text::short;
use serde::Serialize;
use std::time::Instant;

/// One repetition.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Agent-steps.
    pub steps: u64,
    /// Processor time of all threads, s.
    pub cpu: f64,
    /// Time that passed, s.
    pub wall: f64,
}

impl Sample {
    /// Processor time of an agent-step, s.
    pub fn cpu_per_step(&self) -> f64 {
        self.cpu / self.steps as f64
    }
    /// Time that passed per agent-step, s.
    pub fn wall_per_step(&self) -> f64 {
        self.wall / self.steps as f64
    }
}

/// Figures that only one benchmark has.
pub trait Figures: Serialize {
    /// Names of their columns.
    const HEADER: &'static str;
    /// The columns.
    fn cells(&self) -> String;
    /// Agents whose simulation broke down.
    fn broken(&self) -> u64;
}

/// What was measured of an agent.
#[derive(Clone, Debug, Serialize)]
pub struct Row<F> {
    pub agent: String,
    /// Agents per vector.
    pub lanes: usize,
    pub isa: &'static str,
    pub threads: usize,
    /// Agents that were simulated.
    pub agents: usize,
    pub repetitions: usize,
    /// Steps of all repetitions.
    pub steps: u64,
    pub ns_per_agent_step: f64,
    pub steps_per_cpu_second: f64,
    pub steps_per_wall_second: f64,
    /// Slowest repetition by fastest, less one.
    pub spread: f64,
    #[serde(flatten)]
    pub figures: F,
}

impl<F: Figures> Row<F> {
    /// From its repetitions, of which there is at least one; `size` is the number of threads and of agents.
    pub fn new(agent: &str, isa: Isa, size: (usize, usize), samples: &[Sample], figures: F) -> Self {
        let (threads, agents) = size;
        let mut sorted = samples.to_vec();
        sorted.sort_by(|a, b| a.cpu_per_step().total_cmp(&b.cpu_per_step()));
        let median = sorted[sorted.len() / 2];
        Row {
            agent: agent.into(),
            lanes: isa.lanes(),
            isa: isa.name(),
            threads,
            agents,
            repetitions: samples.len(),
            steps: samples.iter().map(|s| s.steps).sum(),
            ns_per_agent_step: median.cpu_per_step() * 1e9,
            steps_per_cpu_second: 1.0 / median.cpu_per_step(),
            steps_per_wall_second: 1.0 / median.wall_per_step(),
            spread: spread(samples),
            figures,
        }
    }

    fn header() -> String {
        format!(
            "{:14} {:>8} {:>5}  {:>12}  {:>11}  {:>11}  {:>6}{}",
            "agent",
            "isa",
            "lanes",
            "ns/step",
            "steps/cpu s",
            "steps/s",
            "spread",
            F::HEADER
        )
    }

    fn line(&self) -> String {
        format!(
            "{:14} {:>8} {:>5}  {:>12.1}  {:>11}  {:>11}  {:>5.0}%{}",
            self.agent,
            self.isa,
            self.lanes,
            self.ns_per_agent_step,
            short(self.steps_per_cpu_second),
            short(self.steps_per_wall_second),
            100.0 * self.spread,
            self.figures.cells()
        )
    }
}

/// Processor time of the slowest repetition by that of the fastest, less one.
pub fn spread(samples: &[Sample]) -> f64 {
    let costs = samples.iter().map(Sample::cpu_per_step);
    let (fast, slow) = costs.fold((f64::INFINITY, 0.0_f64), |(fast, slow), x| (fast.min(x), slow.max(x)));
    slow / fast - 1.0
}

/// Rows that appear as they are measured, or all at once as JSON.
pub struct Table<F> {
    json: bool,
    head: Head,
    seconds: f64,
    rows: Vec<Row<F>>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Document<'a, F> {
    #[serde(flatten)]
    head: &'a Head,
    seconds: f64,
    rows: &'a [Row<F>],
}

impl<F: Figures> Table<F> {
    /// Prints the head; `step` says what a step is, `seconds` those of a row.
    pub fn new(json: bool, head: Head, seconds: f64, step: &str) -> Self {
        if !json {
            let Machine { arch, os, cores, isas, best_isa } = &head.machine;
            say(format!("{arch} {os}, {cores} cores, instruction sets {} (best: {best_isa})", isas.join(", ")));
            say(format!(
                "a step is {step};\ntimes are processor time of {} thread(s); rows are medians\n",
                head.threads
            ));
            say(Row::<F>::header());
        }
        Self { json, head, seconds, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn push(&mut self, row: Row<F>) {
        if !self.json {
            say(row.line());
        }
        self.rows.push(row);
    }

    /// Prints what is still to be said.
    pub fn finish(self) {
        if self.json {
            print_json(&Document { head: &self.head, seconds: self.seconds, rows: &self.rows });
        }
        if let Some(line) = marathon_runs::text::broken(self.rows.iter().map(|row| row.figures.broken()).sum()) {
            note(line);
        }
    }
}

/// Processor time of this thread, s.
pub fn thread_cpu() -> f64 {
    cpu_time::ThreadTime::try_now().map_or(0.0, |t| t.as_duration().as_secs_f64())
}

/// Runs `work` on every worker, each on a thread of its own (a single one on this thread), and returns what they
/// returned with the time that passed.
pub fn on_threads<W: Send, R: Send>(workers: &mut [W], work: impl Fn(usize, &mut W) -> R + Sync) -> (Vec<R>, f64) {
    let start = Instant::now();
    let results = match workers {
        [one] => vec![work(0, one)],
        many => std::thread::scope(|scope| {
            let work = &work;
            let handles: Vec<_> =
                many.iter_mut().enumerate().map(|(i, worker)| scope.spawn(move || work(i, worker))).collect();
            handles.into_iter().map(|h| h.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
        }),
    };
    (results, start.elapsed().as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize)]
    struct Nothing;
    impl Figures for Nothing {
        const HEADER: &'static str = "  more";
        fn cells(&self) -> String {
            "     -".into()
        }
        fn broken(&self) -> u64 {
            0
        }
    }

    #[test]
    fn a_row_is_the_median_by_processor_time() {
        let sample = |cpu: f64, wall: f64| Sample { steps: 1000, cpu, wall };
        let samples = [sample(3.0, 1.0), sample(1.0, 9.0), sample(2.0, 4.0)];
        let row = Row::new("Hopper-v0", Isa::F32, (2, 64), &samples, Nothing);
        assert_eq!((row.ns_per_agent_step, row.steps_per_cpu_second), (2e6, 500.0));
        assert_eq!((row.steps_per_wall_second, row.spread), (250.0, 2.0));
        assert_eq!((row.steps, row.repetitions, row.lanes, row.agents), (3000, 3, 1, 64));
        assert_eq!(row.line().len(), Row::<Nothing>::header().len());
    }

    #[test]
    fn workers_keep_their_order() {
        let (sums, _) = on_threads(&mut [10, 20, 30], |i, x| *x + i);
        assert_eq!(sums, [10, 21, 32]);
        assert_eq!(on_threads(&mut [5], |i, x| *x + i).0, [5]);
    }
}
