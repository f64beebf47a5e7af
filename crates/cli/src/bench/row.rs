//! The tables of the benchmarks; a row is a median of repetitions.

use super::options::{Head, Machine};
use marathon_physics::lanes::Isa;
use marathon_runs::speed::{Sample, median, spread};
use marathon_runs::terminal::{note, print_json, say};
use marathon_runs::text::short;
use serde::Serialize;

/// Columns that only one benchmark has.
pub trait Figures: Serialize {
    /// Names of their columns.
    const HEADER: &'static str;
    /// The columns.
    fn cells(&self) -> String;
    /// Agents whose simulation became non-finite.
    fn broken(&self) -> u64;
}

/// The results of an agent.
#[derive(Clone, Debug, Serialize)]
pub struct Row<F> {
    pub agent: String,
    /// Agents per vector.
    pub lanes: usize,
    pub isa: &'static str,
    pub threads: usize,
    /// Simulated agents.
    pub agents: usize,
    pub repetitions: usize,
    /// Steps of all repetitions.
    pub steps: u64,
    pub ns_per_agent_step: f64,
    pub steps_per_cpu_second: f64,
    pub steps_per_wall_second: f64,
    /// Time of the slowest repetition divided by that of the fastest, minus one.
    pub spread: f64,
    #[serde(flatten)]
    pub figures: F,
}

impl<F: Figures> Row<F> {
    /// Creates a row from at least one repetition. `size` is the number of threads and of agents.
    pub fn new(agent: &str, isa: Isa, size: (usize, usize), samples: &[Sample], figures: F) -> Self {
        let (threads, agents) = size;
        let median = median(samples);
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

/// Rows, printed one by one, or all at once as JSON.
pub struct Table<F> {
    json: bool,
    head: Head,
    seconds: f64,
    rows: Vec<Row<F>>,
}

/// Output of `--json`.
#[derive(Serialize)]
struct Document<'a, F> {
    #[serde(flatten)]
    head: &'a Head,
    seconds: f64,
    rows: &'a [Row<F>],
}

impl<F: Figures> Table<F> {
    /// Prints the heading; `step` describes a step, `seconds` is the time of a row.
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

    /// Prints the JSON document, and a note if simulations broke down.
    pub fn finish(self) {
        if self.json {
            print_json(&Document { head: &self.head, seconds: self.seconds, rows: &self.rows });
        }
        if let Some(line) = marathon_runs::text::broken(self.rows.iter().map(|row| row.figures.broken()).sum()) {
            note(line);
        }
    }
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
}
