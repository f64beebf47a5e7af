//! Speed and score at equal steps with 16 to 4096 agents.

use crate::args::Options;
use crate::error::StudyError;
use crate::record::Record;
use crate::statistics::{plus_minus, spread};
use crate::training::{each_seed, mean_curve, train_one};
use marathon_config as config;
use marathon_learn::Algorithm;
use marathon_runs::report::chart::Chart;

const AGENT: &str = "Hopper-v0";
const AGENTS: [usize; 4] = [16, 64, 512, 4096];
/// Decisions of all agents per rollout, unless [`SHORTEST`] requires more.
const ROLLOUT: usize = 8192;
/// Fewest decisions of each agent per rollout; advantages need that many.
const SHORTEST: usize = 16;
/// Samples of a minibatch.
const MINIBATCH: usize = 1024;

/// Trains with each seed of each number of agents.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options) -> Result<Record, StudyError> {
    let base = config::default_for(AGENT).config;
    let (mut rows, mut lines) = (Vec::new(), Vec::new());
    for agents in AGENTS {
        let horizon = (ROLLOUT / agents).max(SHORTEST);
        let mut config = base.clone().with(|c| {
            c.run.agents = agents;
            c.run.horizon = horizon;
            if let Algorithm::Ppo(ppo) = &mut c.algorithm {
                ppo.minibatches = agents * horizon / MINIBATCH;
            }
            c.run.total_steps = options.steps();
            c.run.threads = options.threads;
        });
        let runs = each_seed(options.seeds, |seed| {
            config.run.seed = seed;
            train_one(AGENT, &config)
        })?;
        rows.push(vec![
            agents.to_string(),
            format!("{horizon}"),
            plus_minus(spread(runs.iter().map(|r| r.steps as f64 / r.cpu)), 0),
            plus_minus(spread(runs.iter().map(|r| r.steps as f64 / r.wall)), 0),
            plus_minus(spread(runs.iter().map(|r| r.eval.return_mean)), 0),
            plus_minus(spread(runs.iter().map(|r| r.eval.speed_mean)), 2),
        ]);
        lines.push((format!("{agents} agents"), mean_curve(&runs, options.steps())));
    }
    Ok(Record {
        name: "concurrency",
        title: "Agents side by side",
        about: "Hopper-v0 with its own settings and more or fewer agents, at equal steps. Rollouts hold 8192 decisions in all \
                (with 4096 agents 65536, 16 of each), minibatches 1024. Agents cost memory, not time: a vector carries sixteen, \
                and more than that fill the same vectors one after another. Steps per \
                second, unlike those per processor second, depend on who else uses the computer."
            .into(),
        columns: vec![
            "agents",
            "decisions of each per rollout",
            "steps per processor second",
            "steps per second",
            "return",
            "speed, m/s",
        ],
        rows,
        words: String::new(),
        versions: Vec::new(),
        chart: Chart::Lines("return per episode with exploration, mean over the seeds", lines),
    })
}
