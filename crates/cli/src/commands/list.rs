//! `marathon list`: the agents.

use crate::console::say;
use crate::error::CliError;
use crate::report::print_json;
use marathon_envs::registry;
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
}

/// Lists the agents.
///
/// # Errors
/// If an agent cannot be simulated.
pub fn run(json: bool) -> Result<(), CliError> {
    let mut entries = Vec::new();
    for id in registry::ids() {
        let facts = registry::agent(&id)?.facts();
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
    say("\nNames work in any case; without a version they mean v0.");
    Ok(())
}
