//! Training with the agent's own configuration, everything included.

use super::Plan;
use super::row::{More, Row, Sample};
use crate::config;
use crate::error::CliError;
use marathon_envs::registry;
use marathon_learn::{Control, IterationStats, PpoConfig, Snapshot, train};
use marathon_physics::lanes::Isa;

/// Repetitions of a row, each with a seed of its own.
const REPETITIONS: usize = 3;
/// Iterations with an update that a repetition has at least.
const ITERATIONS: u64 = 2;

/// Measures the agents.
///
/// # Errors
/// If an agent cannot be simulated or trained.
pub fn run(plan: &Plan, emit: &mut dyn FnMut(Row)) -> Result<(), CliError> {
    for id in &plan.agents {
        for isa in &plan.isas {
            emit(measure(plan, id, *isa)?);
        }
    }
    Ok(())
}

fn measure(plan: &Plan, id: &str, isa: Isa) -> Result<Row, CliError> {
    let factory = registry::factory(id, isa)?;
    let mut base = config::default_for(id).ppo;
    if let Some(width) = plan.hidden {
        (base.actor_hidden, base.critic_hidden) = (vec![width; 2], vec![width; 2]);
    }
    let mut samples = Vec::new();
    let (mut shares, mut weight) = ([0.0; 2], 0.0);
    for seed in 0..REPETITIONS as u64 {
        // it ends by the clock; agents fall at first and run later, so the cost of a step moves with learning
        let config = PpoConfig { seed, threads: plan.threads, total_steps: u64::MAX >> 16, ..base.clone() };
        let each = plan.seconds * config.worker_count() as f64 / REPETITIONS as f64;
        let mut first: Option<IterationStats> = None;
        let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
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
            if enough || seconds > 10.0 * plan.seconds.max(1.0) { Control::Stop } else { Control::Continue }
        };
        let last = train(&*factory, isa, &config, None, &mut observer)?.last;
        if let (Some(first), Some(last)) = (first, last) {
            samples.push(Sample {
                steps: last.steps - first.steps,
                cpu: last.cpu_seconds - first.cpu_seconds,
                wall: last.wall_seconds - first.wall_seconds,
            });
        }
    }
    let [env_share, update_share] = shares.map(|share| share / weight);
    let mut row = Row::new(
        id,
        isa,
        (plan.threads, base.agents),
        &samples,
        More::Train { env_share, update_share, physics_steps_per_wall_second: 0.0 },
    );
    row.more = More::Train {
        env_share,
        update_share,
        physics_steps_per_wall_second: row.steps_per_wall_second * factory.spec().frame_skip as f64,
    };
    Ok(row)
}
