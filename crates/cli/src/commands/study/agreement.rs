//! The same configuration in `mlagents-learn` and in our own trainer.

use super::Options;
use super::chart::Chart;
use super::peers;
use super::record::{Record, Run, mean_curve, train_one};
use crate::config;
use crate::error::CliError;
use std::path::Path;

const AGENT: &str = "Hopper-v0";
/// The paper's settings for both trainers.
const FILE: &[u8] = include_bytes!("../../../../../assets/configs/hopper-mlagents.yaml");
const TIME_HORIZON: u64 = 128;
/// Agents of the paper's scenes.
const AGENTS: usize = 16;

/// Trains each seed in both.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options) -> Result<Record, CliError> {
    let mut config = config::parse(Path::new("hopper-mlagents.yaml"), FILE, AGENT)?.ppo;
    // the buffer is that of all agents
    config.horizon = (config.rollout_steps() as usize).div_ceil(AGENTS);
    (config.agents, config.total_steps, config.threads) = (AGENTS, options.steps, options.threads);
    let (mut theirs, mut ours, mut rows, mut versions) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for seed in 1..=options.seeds {
        config.seed = seed;
        let (run, version) = peers::mlagents(AGENT, &config, TIME_HORIZON)?;
        versions = vec![version];
        theirs.push(run);
        ours.push(train_one(AGENT, &config)?);
        rows.push(row(&seed.to_string(), &theirs[theirs.len() - 1..], &ours[ours.len() - 1..]));
    }
    rows.push(row("mean", &theirs, &ours));
    let lines = [("mlagents-learn", &theirs), ("marathon train", &ours)];
    let lines = lines.map(|(name, runs)| (name.to_string(), mean_curve(runs, options.steps)));
    Ok(Record {
        name: "mlagents-agreement",
        title: "Agreement with ML-Agents",
        about: "Hopper-v0 with `assets/configs/hopper-mlagents.yaml` (the paper's networks and rates, sixteen agents), trained \
                by `mlagents-learn` through `marathon-player` and by `marathon train`, for as many steps with the same \
                schedules. Policies are judged alike: the best actions of ML-Agents' `.onnx` and of our policy file over a \
                hundred episodes here. `while training` is the mean return of the episodes that ended in the last tenth of \
                the steps, with exploration. On the way ML-Agents is ahead for a while: here the first rollout only fills the \
                statistics, weights start elsewhere, and the probability ratio that is clipped is that of all actions \
                together, there that of each by itself."
            .into(),
        columns: vec![
            "seed",
            "ML-Agents: return",
            "Marathon: return",
            "ratio",
            "ML-Agents: while training",
            "Marathon: while training",
            "ratio",
            "ML-Agents: processor seconds",
            "Marathon: processor seconds",
        ],
        rows,
        words: String::new(),
        versions,
        chart: Chart::Lines("return per episode with exploration, mean over the seeds", lines.into()),
    })
}

fn row(name: &str, theirs: &[Run], ours: &[Run]) -> Vec<String> {
    let mean = |runs: &[Run], of: fn(&Run) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
    let mut cells = vec![name.to_string()];
    for of in [(|r: &Run| r.eval.return_mean) as fn(&Run) -> f64, Run::last_tenth] {
        let (a, b) = (mean(theirs, of), mean(ours, of));
        cells.extend([format!("{a:.1}"), format!("{b:.1}"), format!("{:.2}", b / a)]);
    }
    let cpu = |runs| format!("{:.0}", mean(runs, |r| r.cpu));
    cells.extend([cpu(theirs), cpu(ours)]);
    cells
}
