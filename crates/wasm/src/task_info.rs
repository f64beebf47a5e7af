//! Tasks as JSON.

use marathon_envs::Spec;
use serde_json::{Value, json};

/// Facts of a task for pages.
pub fn spec(spec: &Spec) -> Value {
    let command = spec
        .command
        .iter()
        .map(|range| json!({ "name": range.name, "low": range.low, "high": range.high, "unit": range.unit }));
    let range = |i: usize| spec.action_range(i);
    json!({
        "id": spec.id,
        "obs": spec.obs,
        "act": spec.act,
        "action_names": spec.action_names,
        "action_low": (0..spec.act).map(|i| range(i)[0]).collect::<Vec<_>>(),
        "action_high": (0..spec.act).map(|i| range(i)[1]).collect::<Vec<_>>(),
        "dt": spec.dt,
        "frame_skip": spec.frame_skip,
        "max_episode_steps": spec.max_episode_steps,
        "reward_terms": spec.reward_terms,
        "info": spec.info,
        "command": command.collect::<Vec<_>>(),
        "nq": spec.nq,
        "nv": spec.nv,
    })
}
