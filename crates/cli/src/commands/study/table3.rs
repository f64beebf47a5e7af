//! Table 3: PPO, A2C and ACKTR on the hopper, time and score at equal steps, all agents and several seeds.

use super::Options;
use super::chart::Chart;
use super::record::{Record, Run, mean_curve, plus_minus, spread, train_one};
use crate::config;
use crate::error::CliError;
use marathon_learn::{PpoConfig, Schedule};
use std::path::Path;

const AGENT: &str = "Hopper-v0";
/// The settings of the paper's ML-Agents side.
const PAPER: &[u8] = include_bytes!("../../../../../assets/configs/paper-appendix-c.yaml");

/// What is compared: a name, what the paper reports (seconds, score), and the settings.
type Case = (&'static str, &'static str, PpoConfig);

fn cases() -> Result<Vec<Case>, CliError> {
    let ml_agents = config::parse(Path::new("paper-appendix-c.yaml"), PAPER, AGENT)?.ppo;
    // OpenAI Baselines' PPO2 with the hyper-parameters of the authors' repository
    let ppo2 = PpoConfig {
        agents: 16,
        horizon: 128,
        minibatches: 32,
        epochs: 10,
        lr: 3e-4,
        value_lr: 3e-4,
        schedule: Schedule::Linear,
        max_grad_norm: 0.5,
        value_clip: Some(0.2),
        entropy_coef: 0.0,
        init_log_std: 0.0,
        min_std: 1e-3,
        max_std: 1e3,
        ..PpoConfig::default()
    };
    // the same start for all, where a third of the actions is not clipped
    let quieter = |config: PpoConfig| PpoConfig { init_log_std: -0.7, ..config };
    Ok(vec![
        ("PPO, settings of ML-Agents (supplement C)", "418 s, 455", ml_agents),
        ("PPO, settings of Baselines' PPO2", "475 s, 700", ppo2.clone()),
        ("A2C, settings of Baselines", "291 s, none", PpoConfig::a2c()),
        ("ACKTR, settings of Baselines", "281 s, none", PpoConfig::acktr()),
        ("PPO2, deviation 0.5", "", quieter(ppo2)),
        ("A2C, deviation 0.5", "", quieter(PpoConfig::a2c())),
        ("ACKTR, deviation 0.5", "", quieter(PpoConfig::acktr())),
        ("PPO, Marathon's own settings", "", config::default_for(AGENT).ppo),
    ])
}

/// Trains with each seed of each case.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options) -> Result<Record, CliError> {
    let (mut rows, mut lines) = (Vec::new(), Vec::new());
    for (name, paper, mut config) in cases()? {
        (config.total_steps, config.threads) = (options.steps, options.threads);
        let runs: Result<Vec<Run>, CliError> = (1..=options.seeds)
            .map(|seed| {
                config.seed = seed;
                train_one(AGENT, &config)
            })
            .collect();
        let runs = runs?;
        let returns = || runs.iter().map(|r| r.eval.return_mean);
        rows.push(vec![
            name.to_string(),
            plus_minus(spread(runs.iter().map(|r| r.cpu)), 1),
            plus_minus(spread(returns()), 0),
            format!("{:.0}", returns().fold(f64::NEG_INFINITY, f64::max)),
            plus_minus(spread(runs.iter().map(|r| r.eval.speed_mean)), 2),
            plus_minus(spread(runs.iter().map(|r| r.eval.length_mean)), 0),
            paper.to_string(),
        ]);
        lines.push((name.to_string(), mean_curve(&runs, options.steps)));
    }
    Ok(Record {
        name: "table3",
        title: "Table 3: algorithms on the hopper",
        about: "Hopper-v0 at equal steps: seconds of training, and the return, speed and length of a hundred episodes with the \
                best actions of all agents (the original scored one agent, and A2C and ACKTR not at all), mean and deviation \
                over the seeds. The settings of Baselines start with a deviation of 1, with which a third of all actions is \
                clipped and motors at their limits cost more than staying up brings; the rows with deviation 0.5 differ in \
                nothing else. The returns of the paper's own runs are of another physics and cannot be compared number by \
                number."
            .into(),
        columns: vec![
            "algorithm and settings",
            "seconds",
            "return",
            "best seed",
            "speed, m/s",
            "length, decisions",
            "paper: seconds, score",
        ],
        rows,
        chart: Chart::Lines("return per episode with exploration, mean over the seeds", lines),
    })
}
