//! Training, an iteration at a time.

use crate::abi::respond;
use crate::answer::{Answer, Failure, Request};
use crate::objects::{Kind, ask, keep};
use marathon_config::parse_object;
use marathon_envs::Options;
use marathon_learn::TrainLoop;
use marathon_physics::Isa;
use serde::Deserialize;
use serde_json::{Value, json};

/// A run in training.
pub struct Training {
    run: TrainLoop,
}

impl Kind for Training {
    const NAME: &'static str = "training";
}

impl Training {
    fn new(mut request: Request) -> Result<Self, Failure> {
        #[derive(Deserialize)]
        struct Fields {
            agent: String,
            #[serde(default)]
            config: Value,
        }
        let Fields { agent, config } = request.fields()?;
        let config = if config.is_null() { json!({}) } else { config };
        let mut loaded = parse_object("config", &config.to_string(), &agent)?;
        loaded.config.run.threads = 1;
        let network = &loaded.config.network;
        for hidden in [&network.hidden[..], network.critic()] {
            fits(hidden)?;
        }
        let mut options = Options::new();
        loaded.options.into_iter().for_each(|(name, value)| options.set(&name, value));
        let factory = marathon_envs::factory_with(&agent, &options, Isa::best())?;
        Ok(Training { run: TrainLoop::new(&*factory, Isa::best(), &loaded.config)? })
    }
}

/// Most weights between two hidden layers: 32-bit sizes and a memory of 4 GB hold no more.
const MOST_WEIGHTS: f64 = 1e8;

/// Checks that the weights of hidden layers can be counted here.
fn fits(hidden: &[usize]) -> Result<(), Failure> {
    let most = hidden.windows(2).map(|pair| pair[0] as f64 * pair[1] as f64).fold(0.0, f64::max);
    let widest = hidden.iter().fold(0.0, |most: f64, n| most.max(*n as f64));
    if most.max(1000.0 * widest) > MOST_WEIGHTS {
        return Err(
            format!("network.hidden is {hidden:?}, expected layers with at most 1e8 weights between them").into()
        );
    }
    Ok(())
}

/// Creates a run of the task `agent`; the answer has its configuration.
#[unsafe(no_mangle)]
pub extern "C" fn training_new() -> i32 {
    respond(|request| {
        let training = Training::new(request)?;
        let answer = Answer::json(training.run.config())?;
        Ok(answer.about(keep(training)))
    })
}

/// The next iteration; the answer has its numbers. Returns 1 after the last one.
#[unsafe(no_mangle)]
pub extern "C" fn training_iterate(training: usize) -> i32 {
    ask::<Training>(training, |training, _| {
        let total = training.run.config().run.total_steps;
        if training.run.is_done() {
            return Err(format!("the training has made its {total} steps").into());
        }
        let stats = training.run.iterate()?;
        let answer = Answer::json(&json!({
            "steps": stats.steps,
            "total_steps": total,
            "iteration": stats.iteration,
            "return_mean": stats.learned.return_mean,
            "speed_mean": stats.speed_mean,
            "length_mean": stats.length_mean,
            "fall_fraction": stats.fall_fraction,
        }))?;
        Ok(answer.about(training.run.is_done().into()))
    })
}

/// The policy as a file.
#[unsafe(no_mangle)]
pub extern "C" fn training_policy(training: usize) -> i32 {
    ask::<Training>(training, |training, _| Ok(Answer::bytes(training.run.policy().to_bytes())))
}
