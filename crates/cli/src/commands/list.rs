//! `marathon list`: the agents.

use crate::console::{print_json, say};
use crate::error::CliError;
use marathon_envs::{OptionInfo, registry};
use marathon_physics::lanes::Isa;
use serde::Serialize;

/// What is told of an agent.
#[derive(Serialize)]
struct Entry {
    id: String,
    summary: String,
    observation: usize,
    action: usize,
    /// Seconds between decisions.
    dt: f64,
    frame_skip: usize,
    max_episode_steps: usize,
    reward_terms: Vec<String>,
    info: Vec<String>,
    /// Lowest and highest action per actuator; null for one without bounds.
    action_range: Vec<[Option<f32>; 2]>,
    options: Vec<Argument>,
}

/// A named argument that an agent takes.
#[derive(Serialize)]
struct Argument {
    name: &'static str,
    default: String,
    expected: &'static str,
    about: &'static str,
}

/// Lists the agents.
///
/// # Errors
/// If an agent cannot be simulated.
pub fn run(json: bool) -> Result<(), CliError> {
    let mut entries = Vec::new();
    for id in registry::ids() {
        let agent = registry::agent(&id)?;
        let facts = agent.facts();
        let factory = registry::factory(&id, Isa::F32)?;
        let spec = factory.spec();
        entries.push(Entry {
            summary: facts.summary,
            observation: spec.obs,
            action: spec.act,
            dt: spec.dt,
            frame_skip: spec.frame_skip,
            max_episode_steps: spec.max_episode_steps,
            reward_terms: spec.reward_terms.clone(),
            info: spec.info.clone(),
            action_range: spec
                .action_low
                .iter()
                .zip(&spec.action_high)
                .map(|(a, b)| [finite(*a), finite(*b)])
                .collect(),
            options: agent.options().into_iter().map(argument).collect(),
            id,
        });
    }
    if json {
        print_json(&serde_json::json!({ "agents": entries }));
        return Ok(());
    }
    let width = entries.iter().map(|e| e.id.len()).max().unwrap_or(0);
    say(format!("{:width$}  observation  action  decisions/s  episode", "agent"));
    for e in &entries {
        let (rate, seconds) = (1.0 / e.dt, e.dt * e.max_episode_steps as f64);
        say(format!(
            "{:width$}  {:>11}  {:>6}  {rate:>11.0}  {seconds:>5.0} s   {}",
            e.id, e.observation, e.action, e.summary
        ));
    }
    say("\nNames work in any case; without a version they mean the lowest.");
    Ok(())
}

fn argument(info: OptionInfo) -> Argument {
    let OptionInfo { name, value, expected, about, .. } = info;
    Argument { name, default: value.to_string(), expected, about }
}

/// JSON has no infinities.
fn finite(x: f32) -> Option<f32> {
    x.is_finite().then_some(x)
}
