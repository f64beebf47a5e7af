//! The same configurations in `mlagents-learn` and in Marathon's trainer.

use crate::args::Options;
use crate::error::StudyError;
use crate::peers;
use crate::record::Record;
use crate::training::{Run, mean_curve, train_one};
use marathon_config as config;
use marathon_runs::report::chart::Chart;
use std::path::Path;

const AGENT: &str = "Hopper-v0";
/// Configurations of both trainers: the paper's for this agent, and one with the keys of today's ML-Agents.
const FILES: [(&str, &[u8]); 2] = [
    ("paper-appendix-c", marathon_configs::text("paper-appendix-c.yaml").as_bytes()),
    ("hopper-mlagents", marathon_configs::text("hopper-mlagents.yaml").as_bytes()),
];
const TIME_HORIZON: u64 = 128;
/// Agents of the paper's scenes.
const AGENTS: usize = 16;

/// Trains each seed with each configuration in both trainers.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options) -> Result<Record, StudyError> {
    let (mut rows, mut versions, mut lines) = (Vec::new(), Vec::new(), Vec::new());
    for (name, file) in FILES {
        let mut config = config::parse(Path::new(&format!("{name}.yaml")), file, AGENT)?.config;
        // the buffer is that of all agents
        config.run.horizon = (config.run.rollout_steps() as usize).div_ceil(AGENTS);
        (config.run.agents, config.run.total_steps, config.run.threads) = (AGENTS, options.steps(), options.threads);
        let keep = options.keep_for(name);
        let (mut theirs, mut ours) = (Vec::new(), Vec::new());
        for seed in 1..=options.seeds {
            config.run.seed = seed;
            let (run, version) = peers::mlagents(AGENT, &config, TIME_HORIZON, keep.as_deref())?;
            versions = vec![version];
            theirs.push(run);
            ours.push(train_one(AGENT, &config)?);
            rows.push(row(name, &seed.to_string(), &theirs[theirs.len() - 1..], &ours[ours.len() - 1..]));
        }
        rows.push(row(name, "mean", &theirs, &ours));
        for (trainer, runs) in [("mlagents-learn", &theirs), ("marathon train", &ours)] {
            lines.push((format!("{trainer}, {name}"), mean_curve(runs, options.steps())));
        }
    }
    Ok(Record {
        name: "mlagents-agreement",
        title: "Agreement with ML-Agents",
        about: "Hopper-v0 with `assets/configs/paper-appendix-c.yaml`, the paper's settings for this agent, and with \
                `hopper-mlagents.yaml`, its general networks and rates; sixteen agents, trained by `mlagents-learn` through \
                `marathon-player` and by `marathon train`, for as many steps with the same schedules. Policies are judged \
                alike: the best actions of ML-Agents' `.onnx` and of our policy file over a hundred episodes here. `while \
                training` is the mean return of the episodes that ended in the last tenth of the steps, with exploration. \
                Marathon also adopts the behavior of ML-Agents that no key controls: each action's probability ratio is bounded by \
                itself, networks start from its weights, samples are clipped to 3 and divided by it, Adam has PyTorch's \
                epsilon, and the value's change is not bounded, since ML-Agents 1.1.0 reads the returns where it stored \
                the old values."
            .into(),
        columns: vec![
            "configuration",
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
        chart: Chart::Lines("return per episode with exploration, mean over the seeds", lines),
    })
}

fn row(configuration: &str, seed: &str, theirs: &[Run], ours: &[Run]) -> Vec<String> {
    let mean = |runs: &[Run], of: fn(&Run) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
    let mut cells = vec![configuration.to_string(), seed.to_string()];
    for of in [(|r: &Run| r.eval.return_mean) as fn(&Run) -> f64, Run::last_tenth] {
        let (a, b) = (mean(theirs, of), mean(ours, of));
        cells.extend([format!("{a:.1}"), format!("{b:.1}"), format!("{:.2}", b / a)]);
    }
    let cpu = |runs| format!("{:.0}", mean(runs, |r| r.cpu));
    cells.extend([cpu(theirs), cpu(ours)]);
    cells
}
