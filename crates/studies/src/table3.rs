//! Table 3: PPO, A2C and ACKTR on the hopper, time and score at equal steps, all agents and several seeds.

use crate::args::{Options, PeerOptions};
use crate::error::StudyError;
use crate::peers::{self, Sb3};
use crate::record::Record;
use crate::statistics::{plus_minus, spread};
use crate::training::{Run, each_seed, mean_curve, train_one};
use marathon_config as config;
use marathon_learn::{A2c, ActionStd, Algorithm, LrSchedule, Ppo, Schedule, TrainConfig};
use marathon_runs::report::chart::Chart;
use std::path::Path;

const AGENT: &str = "Hopper-v0";
/// The settings of the paper's ML-Agents side.
const PAPER: &[u8] = marathon_configs::text("paper-appendix-c.yaml").as_bytes();

/// `time_horizon` of the paper's file.
const TIME_HORIZON: u64 = 128;

/// A row: a name, the paper's seconds and score, and the settings.
type Case = (&'static str, &'static str, TrainConfig);

/// The settings of the paper's ML-Agents side.
fn supplement_c() -> Result<TrainConfig, StudyError> {
    Ok(config::parse(Path::new("paper-appendix-c.yaml"), PAPER, AGENT)?.config)
}

/// OpenAI Baselines' PPO2 with the hyper-parameters of the authors' repository.
pub fn ppo2() -> TrainConfig {
    let ppo = Ppo {
        minibatches: 32,
        epochs: 10,
        lr: 3e-4,
        value_lr: 3e-4,
        lr_schedule: LrSchedule::Linear,
        max_grad_norm: 0.5,
        value_clip: Some(0.2),
        entropy_coef: Schedule::constant(0.0),
        action_std: ActionStd::FREE,
        ..Default::default()
    };
    TrainConfig::default().with(|config| {
        (config.run.agents, config.run.horizon) = (16, 128);
        config.algorithm = Algorithm::Ppo(ppo);
    })
}

fn cases() -> Result<Vec<Case>, StudyError> {
    // a smaller deviation at the start, so that a third of the actions is not clipped
    let faster = Algorithm::A2c(A2c { lr: 2e-3, ..Default::default() });
    let faster = TrainConfig::a2c().with(|config| config.algorithm = faster);
    let quieter = |config: TrainConfig| {
        config.with(|config| {
            if let Some(action_std) = config.algorithm.action_std_mut() {
                action_std.init_log = -0.7;
            }
        })
    };
    Ok(vec![
        ("PPO, settings of ML-Agents (supplement C)", "418 s, 455", supplement_c()?),
        ("PPO, settings of Baselines' PPO2", "475 s, 700", ppo2()),
        ("A2C, settings of Baselines", "291 s, none", TrainConfig::a2c()),
        ("ACKTR, settings of Baselines", "281 s, none", TrainConfig::acktr()),
        ("PPO2, deviation 0.5", "", quieter(ppo2())),
        (
            "PPO2, deviation 0.5, following the statistics",
            "",
            quieter(ppo2()).with(|c| c.statistics.follow_statistics = true),
        ),
        ("A2C, deviation 0.5", "", quieter(TrainConfig::a2c())),
        ("ACKTR, deviation 0.5", "", quieter(TrainConfig::acktr())),
        ("A2C, deviation 0.5, rate 2e-3", "", quieter(faster)),
        ("PPO, Marathon's own settings", "", config::default_for(AGENT).config),
    ])
}

/// Trains each seed of each case, and with the trainers of other projects.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options, peers: &PeerOptions) -> Result<Record, StudyError> {
    let (mut rows, mut lines, mut versions) = (Vec::new(), Vec::new(), Vec::new());
    let mut add = |name: &str, paper: &str, runs: &[Run]| {
        let returns = || runs.iter().map(|r| r.eval.return_mean);
        rows.push(vec![
            name.to_string(),
            runs.len().to_string(),
            plus_minus(spread(runs.iter().map(|r| r.cpu)), 1),
            plus_minus(spread(returns()), 0),
            format!("{:.0}", returns().fold(f64::NEG_INFINITY, f64::max)),
            plus_minus(spread(runs.iter().map(|r| r.eval.speed_mean)), 2),
            plus_minus(spread(runs.iter().map(|r| r.eval.length_mean)), 0),
            paper.to_string(),
        ]);
        lines.push((name.to_string(), mean_curve(runs, options.steps())));
    };
    for (name, paper, mut config) in cases()? {
        (config.run.total_steps, config.run.threads) = (options.steps(), options.threads);
        let runs = each_seed(options.seeds, |seed| {
            config.run.seed = seed;
            train_one(AGENT, &config)
        })?;
        add(name, paper, &runs);
    }
    if peers.peer_seeds > 0 {
        let mut note = |(run, version): (Run, String)| {
            if !versions.contains(&version) {
                versions.push(version);
            }
            run
        };
        let mut config = supplement_c()?;
        config.run.total_steps = options.steps();
        let keep = options.keep_for("paper-appendix-c");
        let runs = each_seed(peers.peer_seeds, |seed| {
            config.run.seed = seed;
            Ok(note(peers::mlagents(AGENT, &config, TIME_HORIZON, keep.as_deref())?))
        })?;
        add("ML-Agents' own PPO (supplement C)", "418 s, 455", &runs);
        let keep = options.keep.as_deref();
        for (algorithm, paper) in [(Sb3::Ppo, "475 s, 700"), (Sb3::A2c, "291 s, none")] {
            let runs = each_seed(peers.peer_seeds, |seed| {
                Ok(note(peers::sb3((AGENT, algorithm), ("cpu", 0.0), (seed, options.steps()), keep)?))
            })?;
            add(&format!("Stable-Baselines3's {}, settings of Baselines", algorithm.name()), paper, &runs);
        }
    }
    Ok(Record {
        name: "table3",
        title: "Table 3: algorithms on the hopper",
        about: "Hopper-v0 at equal steps: processor seconds of training, and the return, speed and length of a hundred \
                episodes with the best actions of all agents (the original scored one agent, and A2C and ACKTR not at all), \
                mean and deviation over the seeds. A hopper that stands upright to the end earns some 490, so whatever has \
                that return at no speed stands still; how to get from there to hopping, and in how many steps, is in \
                [Experiments](../research/learning.md#settings-of-other-libraries). The settings of Baselines start with a \
                deviation of 1, with which a third of all actions is clipped and motors at their limits cost more than \
                staying up brings; ML-Agents starts with a third. The rows with deviation 0.5 differ in nothing else, but \
                for the rate that A2C needs, and for networks that follow the statistics of observations, as those with \
                ML-Agents' settings do. The returns of the paper's own runs are of another physics and cannot be compared \
                number by number."
            .into(),
        columns: vec![
            "algorithm and settings",
            "seeds",
            "seconds",
            "return",
            "best seed",
            "speed, m/s",
            "length, decisions",
            "paper: seconds, score",
        ],
        rows,
        words: peers.words(),
        versions,
        chart: Chart::Lines("return per episode with exploration, mean over the seeds", lines),
    })
}
