//! Decision period: a decision after every physics step, or after every few, with physics-only steps between.

use crate::args::Options;
use crate::error::StudyError;
use crate::record::Record;
use crate::statistics::{plus_minus, spread};
use crate::training::{Run, each_seed, mean_curve, train_on};
use marathon_config as config;
use marathon_envs::registry;
use marathon_learn::Algorithm;
use marathon_physics::lanes::Isa;
use marathon_runs::report::chart::Chart;
use marathon_runs::speed::{env_speed, median};
use marathon_runs::text::thousands;

const AGENT: &str = "Hopper-v0";
const AGENTS: [&str; 4] = ["Hopper-v0", "Walker2d-v0", "Ant-v0", "Humanoid-v0"];
/// Processor seconds of each measurement without learning.
const SECONDS: f64 = 2.0;

/// Measures the environments of all agents, and trains the hopper.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options) -> Result<Record, StudyError> {
    // one function: the text of the page in order
    let (isa, mut rows, mut lines) = (Isa::best(), Vec::new(), Vec::new());
    for agent in AGENTS {
        let own = registry::factory(agent, isa)?.spec().frame_skip;
        for frame_skip in [own, 1] {
            let factory = registry::factory_every(agent, frame_skip, isa)?;
            let decisions = 1.0 / median(&env_speed(1, SECONDS, &*factory).samples).cpu_per_step();
            rows.push(vec![
                agent.to_string(),
                "random actions, no learning".into(),
                frame_skip.to_string(),
                thousands(decisions as u64),
                thousands((decisions * frame_skip as f64) as u64),
                String::new(),
                String::new(),
                String::new(),
            ]);
        }
    }

    let base = config::default_for(AGENT).config.with(|c| {
        c.run.total_steps = options.steps();
        c.run.threads = options.threads;
    });
    let own = registry::factory(AGENT, isa)?.spec().frame_skip;
    let longer = |x: f64| x.powf(1.0 / own as f64);
    let cases = [
        ("own settings", own, base.clone()),
        ("own settings, as many decisions", 1, base.clone()),
        (
            "as much simulated time; discounts, rollouts and minibatches for the same time",
            1,
            base.with(|config| {
                config.run.total_steps *= own as u64;
                config.run.horizon *= own;
                config.rewards[0].gamma = longer(config.rewards[0].gamma);
                if let Algorithm::Ppo(ppo) = &mut config.algorithm {
                    ppo.minibatches *= own;
                    ppo.gae_lambda = longer(ppo.gae_lambda);
                }
            }),
        ),
    ];
    for (name, frame_skip, mut config) in cases {
        let factory = registry::factory_every(AGENT, frame_skip, isa)?;
        let runs = each_seed(options.seeds, |seed| {
            config.run.seed = seed;
            train_on(&*factory, &config, None)
        })?;
        let decisions = spread(runs.iter().map(|r| r.steps as f64 / r.cpu)).0;
        let seconds = |r: &Run| r.eval.length_mean * factory.spec().dt;
        rows.push(vec![
            AGENT.to_string(),
            format!("training: {name}"),
            frame_skip.to_string(),
            thousands(decisions as u64),
            thousands((decisions * frame_skip as f64) as u64),
            plus_minus(spread(runs.iter().map(|r| r.cpu)), 1),
            plus_minus(spread(runs.iter().map(|r| r.eval.speed_mean)), 2),
            plus_minus(spread(runs.iter().map(seconds)), 1),
        ]);
        // in units of the own period's decisions, so that periods can be compared
        let part = frame_skip as f64 / own as f64;
        let line = mean_curve(&runs, config.run.total_steps).into_iter().map(|(x, y)| (x * part, y * part)).collect();
        lines.push((format!("every {frame_skip}: {name}"), line));
    }
    Ok(Record {
        name: "decision-period",
        title: "Decision period and physics-only steps",
        about: "An agent that decides after every physics step, against its own period with physics-only steps between two \
                decisions (the paper's `PhysicsOnlySteps` and `Decision-Frequency`). Without learning, what a decision costs \
                beside the physics shows in the physics steps per second. In training, acting and learning come on top, so \
                that the same simulated time costs several times as much with a decision per step. The hopper learns with \
                its own settings; episodes last as many seconds in all rows."
            .into(),
        columns: vec![
            "agent",
            "workload",
            "physics steps per decision",
            "decisions per processor second",
            "physics steps per processor second",
            "seconds of training",
            "speed, m/s",
            "seconds until the episode ends",
        ],
        rows,
        words: String::new(),
        versions: Vec::new(),
        chart: Chart::Lines("return with exploration; it and steps in units of the agent's own period", lines),
    })
}
