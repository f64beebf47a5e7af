//! Table 1: how fast the four agents train with the paper's own settings, sixteen agents each.

use super::Options;
use super::chart::Chart;
use super::record::{Record, Run, plus_minus, spread, train_one};
use crate::config;
use crate::error::CliError;
use crate::text::thousands;
use std::path::Path;

/// The paper's settings, and what it reports: agent-steps per second.
const PAPER: &[u8] = include_bytes!("../../../../../assets/configs/paper-appendix-b.yaml");
const AGENTS: [(&str, f64); 4] =
    [("Hopper-v0", 2190.0), ("Walker2d-v0", 2149.0), ("Ant-v0", 2359.0), ("Humanoid-v0", 1229.0)];
/// The humanoid's network is 2 x 512: a twentieth of the steps tells its speed as well.
const HUMANOID: u64 = 20;

/// Trains each agent with each seed.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options) -> Result<Record, CliError> {
    let (mut rows, mut bars) = (Vec::new(), Vec::new());
    for (agent, paper) in AGENTS {
        let mut config = config::parse(Path::new("paper-appendix-b.yaml"), PAPER, agent)?.ppo;
        let least = 2 * config.rollout_steps();
        let steps = if agent.starts_with("Humanoid") { options.steps / HUMANOID } else { options.steps };
        config.total_steps = steps.max(least);
        config.threads = options.threads;
        let runs: Result<Vec<Run>, CliError> = (1..=options.seeds)
            .map(|seed| {
                config.seed = seed;
                train_one(agent, &config)
            })
            .collect();
        let runs = runs?;
        let cpu = spread(runs.iter().map(|r| r.steps as f64 / r.cpu));
        let wall = spread(runs.iter().map(|r| r.steps as f64 / r.wall));
        rows.push(vec![
            agent.to_string(),
            format!("{:?}", config.actor_hidden),
            thousands(config.total_steps),
            plus_minus(cpu, 0),
            plus_minus(wall, 0),
            thousands(paper as u64),
            format!("{:.0}", cpu.0 / paper),
        ]);
        bars.push((agent.to_string(), cpu.0));
    }
    Ok(Record {
        name: "table1",
        title: "Table 1: speed of training",
        about: "Agent-steps per second with the settings of the paper's supplement B (`assets/configs/paper-appendix-b.yaml`: \
                sixteen agents, its networks, three epochs; without curiosity), everything included. The paper's are those of \
                ML-Agents with Unity on a desktop computer of 2018. Steps per processor second do not depend on who else uses \
                the computer; steps per second do."
            .into(),
        columns: vec![
            "agent",
            "network",
            "steps",
            "steps per processor second",
            "steps per second",
            "paper, steps per second",
            "times the paper",
        ],
        rows,
        chart: Chart::Bars("agent-steps per processor second", bars),
    })
}
