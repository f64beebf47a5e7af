//! Repetitions and the row that they make.

use super::What;
use crate::text::short;
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
    fn cpu_per_step(&self) -> f64 {
        self.cpu / self.steps as f64
    }
}

/// What was measured of an agent.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
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
    /// Figures that only some benchmarks have.
    #[serde(flatten)]
    pub more: More,
}

/// Figures that only some benchmarks have.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum More {
    Physics {
        /// Contacts of an agent, on average.
        contacts: f64,
        /// Newton iterations of a lane group per step, on average.
        newton: f64,
        /// Agents whose state was not finite at the end.
        non_finite: usize,
    },
    Env {
        /// Physics steps per decision.
        frame_skip: usize,
        /// Decisions per ended episode.
        episode_length: Option<f64>,
    },
    Train {
        /// Part of the time spent in the environments, and on gradients.
        env_share: f64,
        update_share: f64,
        physics_steps_per_wall_second: f64,
    },
}

impl Row {
    /// From its repetitions, of which there is at least one.
    pub fn new(
        agent: &str,
        isa: marathon_physics::lanes::Isa,
        size: (usize, usize),
        samples: &[Sample],
        more: More,
    ) -> Row {
        let (threads, agents) = size;
        let mut sorted = samples.to_vec();
        sorted.sort_by(|a, b| a.cpu_per_step().total_cmp(&b.cpu_per_step()));
        let median = sorted[sorted.len() / 2];
        let [fast, slow] = [sorted[0], sorted[sorted.len() - 1]].map(|s| s.cpu_per_step());
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
            steps_per_wall_second: median.steps as f64 / median.wall,
            spread: slow / fast - 1.0,
            more,
        }
    }

    /// Names of the columns.
    pub fn header(what: What) -> String {
        let more = match what {
            What::Physics => "  contacts  newton",
            What::Env => "  episode",
            What::Train | What::Gait => "   env  update  physics steps/s",
        };
        format!(
            "{:14} {:>8} {:>5}  {:>12}  {:>11}  {:>11}  {:>6}{more}",
            "agent", "isa", "lanes", "ns/step", "steps/cpu s", "steps/s", "spread"
        )
    }

    /// The row as a person reads it.
    pub fn line(&self, what: What) -> String {
        let more = match &self.more {
            More::Physics { contacts, newton, non_finite } => {
                let broken = if *non_finite > 0 { format!("  {non_finite} agents not finite") } else { String::new() };
                format!("  {contacts:>8.2}  {newton:>6.2}{broken}")
            }
            More::Env { episode_length, .. } => {
                format!("  {:>7}", episode_length.map_or("-".into(), |n| format!("{n:.0}")))
            }
            More::Train { env_share, update_share, physics_steps_per_wall_second } => {
                let physics = short(*physics_steps_per_wall_second);
                format!("  {:>3.0}%  {:>5.0}%  {physics:>15}", 100.0 * env_share, 100.0 * update_share)
            }
        };
        debug_assert!(matches!(
            (what, &self.more),
            (What::Physics, More::Physics { .. }) | (What::Env, More::Env { .. }) | (What::Train, More::Train { .. })
        ));
        format!(
            "{:14} {:>8} {:>5}  {:>12.1}  {:>11}  {:>11}  {:>5.0}%{more}",
            self.agent,
            self.isa,
            self.lanes,
            self.ns_per_agent_step,
            short(self.steps_per_cpu_second),
            short(self.steps_per_wall_second),
            100.0 * self.spread
        )
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
    use marathon_physics::lanes::Isa;

    #[test]
    fn a_row_is_the_median_by_processor_time() {
        let sample = |cpu: f64, wall: f64| Sample { steps: 1000, cpu, wall };
        let samples = [sample(3.0, 1.0), sample(1.0, 9.0), sample(2.0, 4.0)];
        let more = More::Env { frame_skip: 4, episode_length: None };
        let row = Row::new("Hopper-v0", Isa::F32, (2, 64), &samples, more);
        assert_eq!((row.ns_per_agent_step, row.steps_per_cpu_second), (2e6, 500.0));
        assert_eq!((row.steps_per_wall_second, row.spread), (250.0, 2.0));
        assert_eq!((row.steps, row.repetitions, row.lanes, row.agents), (3000, 3, 1, 64));
        assert_eq!(row.line(What::Env).len(), Row::header(What::Env).len());
    }

    #[test]
    fn workers_keep_their_order() {
        let (sums, _) = on_threads(&mut [10, 20, 30], |i, x| *x + i);
        assert_eq!(sums, [10, 21, 32]);
        assert_eq!(on_threads(&mut [5], |i, x| *x + i).0, [5]);
    }
}
