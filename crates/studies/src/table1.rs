//! Table 1: training speed of the four agents with the paper's settings, sixteen agents each.

use crate::args::{Options, PeerOptions};
use crate::error::StudyError;
use crate::peers;
use crate::record::Record;
use crate::statistics::{plus_minus, spread};
use crate::training::{each_seed, train_one};
use marathon_config as config;
use marathon_runs::report::chart::Chart;
use marathon_runs::text::thousands;
use std::path::Path;

/// The paper's settings.
const PAPER: &[u8] = marathon_configs::text("paper-appendix-b.yaml").as_bytes();
/// Agents, and the agent-steps per second that the paper reports.
const AGENTS: [(&str, f64); 4] =
    [("Hopper-v0", 2190.0), ("Walker2d-v0", 2149.0), ("Ant-v0", 2359.0), ("Humanoid-v0", 1229.0)];
/// Fewest steps of ML-Agents, and fewest updates.
const PEER_STEPS: u64 = 40_000;
const PEER_UPDATES: u64 = 3;
/// ML-Agents' `time_horizon`; it does not change the speed.
const TIME_HORIZON: u64 = 128;
/// Divisor of the humanoid's steps. Its network of 2 x 512 is slow, and fewer steps measure its speed as well.
const HUMANOID: u64 = 20;

/// Trains each agent with each seed.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options, peers: &PeerOptions) -> Result<Record, StudyError> {
    let (mut rows, mut bars, mut versions) = (Vec::new(), Vec::new(), Vec::new());
    for (agent, paper) in AGENTS {
        let mut config = config::parse(Path::new("paper-appendix-b.yaml"), PAPER, agent)?.config;
        let least = 2 * config.run.rollout_steps();
        let steps = if agent.starts_with("Humanoid") { options.steps() / HUMANOID } else { options.steps() };
        config.run.total_steps = steps.max(least);
        config.run.threads = options.threads;
        let runs = each_seed(options.seeds, |seed| {
            config.run.seed = seed;
            train_one(agent, &config)
        })?;
        let cpu = spread(runs.iter().map(|r| r.steps as f64 / r.cpu));
        let wall = spread(runs.iter().map(|r| r.steps as f64 / r.wall));
        let steps = config.run.total_steps;
        // ML-Agents trains right after, under the same load of the computer
        config.run.total_steps = (PEER_UPDATES * config.run.rollout_steps()).max(PEER_STEPS);
        let mut of_peers = Vec::new();
        for seed in 1..=peers.peer_seeds {
            config.run.seed = seed;
            let (run, version) = peers::mlagents(agent, &config, TIME_HORIZON, options.keep.as_deref())?;
            of_peers.push(run.rate);
            versions = vec![version];
        }
        let of_peers = spread(of_peers.iter().copied());
        let mut row = vec![
            agent.to_string(),
            format!("{:?}", config.network.hidden),
            thousands(steps),
            plus_minus(cpu, 0),
            plus_minus(wall, 0),
            thousands(paper as u64),
            format!("{:.0}", cpu.0 / paper),
        ];
        if peers.peer_seeds > 0 {
            row.extend([plus_minus(of_peers, 0), format!("{:.0}", wall.0 / of_peers.0)]);
        }
        rows.push(row);
        bars.push((agent.to_string(), cpu.0));
    }
    let mut columns = vec![
        "agent",
        "network",
        "steps",
        "steps per processor second",
        "steps per second",
        "paper, steps per second",
        "times the paper",
    ];
    if peers.peer_seeds > 0 {
        columns.extend(["ML-Agents with our player, steps per second", "times ML-Agents, per second"]);
    }
    Ok(Record {
        name: "table1",
        title: "Table 1: speed of training",
        about: "Agent-steps per second with the settings of the paper's supplement B (`assets/configs/paper-appendix-b.yaml`: \
                sixteen agents, its networks, three epochs; without curiosity), everything included. The paper's are those of \
                ML-Agents with Unity on a desktop computer of 2018. Steps per processor second do not depend on who else uses \
                the computer; steps per second do. ML-Agents, where it is in the table, trains the same agents with the same \
                settings through `marathon-player`; its rate is taken between its first and its last summary."
            .into(),
        columns,
        rows,
        words: peers.words(),
        versions,
        chart: Chart::Bars("agent-steps per processor second", bars),
    })
}
