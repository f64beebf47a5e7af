//! Short trainings of a study: curves, times and evaluations.

use crate::error::StudyError;
use crate::statistics::spread;
use marathon_envs::ShardFactory;
use marathon_envs::registry;
use marathon_learn::{
    Control, EvalOptions, Evaluation, IterationStats, Players, Snapshot, TrainConfig, evaluate, train_with,
};
use marathon_physics::lanes::Isa;
use marathon_runs::terminal;
use marathon_runs::text;
use serde::{Deserialize, Serialize};

/// Episodes of the evaluation of a policy.
pub const EPISODES: usize = 100;

/// One training.
#[derive(Serialize, Deserialize)]
pub struct Run {
    /// Steps, and mean return of the episodes that ended in the iteration.
    pub curve: Vec<(f64, f64)>,
    /// Agent-steps.
    pub steps: u64,
    /// Wall time, s.
    pub wall: f64,
    /// Processor time of all threads and processes, s.
    pub cpu: f64,
    /// Agent-steps per second of wall time, without start and end of a program.
    pub rate: f64,
    /// The final policy with its best actions.
    pub eval: Evaluation,
}

impl Run {
    /// Mean return of the episodes that ended in the last tenth of the steps, with exploration.
    pub fn last_tenth(&self) -> f64 {
        let late = self.curve.iter().filter(|(x, _)| *x > 0.9 * self.steps as f64).map(|p| p.1);
        spread(late).0
    }

    /// Prints a line about the finished training.
    pub fn note(&self, name: &str) {
        let Run { steps, wall, cpu, eval, .. } = self;
        terminal::note(format!(
            "{name}: {} steps, {wall:.1} s, {cpu:.1} s of processor time, return {:.0}, {:.2} m/s",
            text::thousands(*steps),
            eval.return_mean,
            eval.speed_mean
        ));
    }
}

/// Trains an agent and evaluates it.
///
/// # Errors
/// If it cannot be trained.
pub fn train_one(agent: &str, config: &TrainConfig) -> Result<Run, StudyError> {
    train_on(&*registry::factory(agent, Isa::best())?, config, None)
}

/// Trains on environments and evaluates the policy. `players`, if any, play the rollouts.
///
/// # Errors
/// If that fails.
pub fn train_on(
    factory: &dyn ShardFactory,
    config: &TrainConfig,
    players: Option<&mut dyn Players>,
) -> Result<Run, StudyError> {
    let isa = Isa::best();
    let (mut curve, mut clocks) = (Vec::new(), (0, 0.0, 0.0));
    let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
        clocks = (stats.steps, stats.wall_seconds, stats.cpu_seconds);
        curve.extend(stats.learned.return_mean.map(|mean| (stats.steps as f64, mean)));
        Control::Continue
    };
    let output = train_with(players, factory, isa, config, None, &mut observer)?;
    let options = EvalOptions { episodes: EPISODES, threads: config.run.threads, ..Default::default() };
    let eval = evaluate(factory, isa, &output.policy, &options)?;
    let (steps, wall, cpu) = clocks;
    let run = Run { curve, steps, wall, cpu, rate: steps as f64 / wall, eval };
    run.note(&format!("{} {} seed {}", factory.spec().id, config.algorithm.name(), config.run.seed));
    Ok(run)
}

/// One training for each seed, from 1 on.
///
/// # Errors
/// If one fails.
pub fn each_seed(seeds: u64, one: impl FnMut(u64) -> Result<Run, StudyError>) -> Result<Vec<Run>, StudyError> {
    (1..=seeds).map(one).collect()
}

/// The mean of the runs' curves in a hundred sections of `total` steps. Each run counts once in a section.
pub fn mean_curve(runs: &[Run], total: u64) -> Vec<(f64, f64)> {
    const PLACES: usize = 100;
    let width = total as f64 / PLACES as f64;
    let at = |i: usize| {
        let (from, to) = (i as f64 * width, (i + 1) as f64 * width);
        let of_run = |run: &Run| {
            let near = run.curve.iter().filter(|(x, _)| (from..to).contains(x)).map(|p| p.1);
            let n = near.clone().count();
            (n > 0).then(|| near.sum::<f64>() / n as f64)
        };
        let known: Vec<f64> = runs.iter().filter_map(of_run).collect();
        (!known.is_empty()).then(|| (from + width / 2.0, known.iter().sum::<f64>() / known.len() as f64))
    };
    (0..PLACES).filter_map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_means() {
        let run = |y: f64| Run {
            curve: vec![(1.0, y), (5.0, y + 2.0), (150.0, 7.0)],
            steps: 1000,
            wall: 1.0,
            cpu: 1.0,
            rate: 1000.0,
            eval: Evaluation::default(),
        };
        // a section has ten steps, so the first two points fall into one
        assert_eq!(mean_curve(&[run(0.0), run(2.0)], 1000), [(5.0, 2.0), (155.0, 7.0)]);
    }
}
