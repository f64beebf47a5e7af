//! Agents that follow motion clips, and the clip of a scenario.

use crate::app::notifications::Notifications;
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::{PolicySource, Scenario};
use marathon_envs::Clips;
use marathon_envs::agents::marathon::marathon_man::clips;
use marathon_envs::options::OptionValue;
use marathon_envs::registry;
use marathon_runs::TaskConfig;

/// An agent that follows any clip.
pub const FOLLOWER: &str = "MarathonMan-v0";
/// The option that names the clip.
pub const CLIP: &str = "clip";

/// Whether an agent follows a clip.
pub fn follows_clip(agent: &str) -> bool {
    registry::agent(agent).map(|agent| agent.facts()).is_ok_and(|facts| facts.follows_clips && !facts.clips.is_empty())
}

/// The clip that the agent of a scenario follows, if it follows any clip.
pub fn clip_of(scenario: &Scenario, shipped: &ShippedPolicies) -> Option<String> {
    let task_config = scenario.task_config(shipped).ok()?;
    let infos = registry::agent(&task_config.agent).ok()?.options();
    let default = infos.into_iter().find(|info| info.name == CLIP)?.value;
    Clips::read(task_config.options.get(CLIP).unwrap_or(&default)).map(|clips| clips.to_string())
}

/// Sets the clip that the agent of a scenario follows.
pub fn choose_clip(scenario: &mut Scenario, name: &str) {
    let chosen = std::mem::take(&mut scenario.chosen);
    let mut chosen = if chosen.agent == scenario.agent { chosen } else { TaskConfig::default() };
    chosen.agent.clone_from(&scenario.agent);
    chosen.options.set(CLIP, name);
    scenario.chosen = chosen;
}

/// Sets the next of the clips that come with Marathon. An agent of one clip makes way for the next such agent that has a
/// policy. Returns whether the scenario has changed.
pub fn next_clip(scenario: &mut Scenario, shipped: &ShippedPolicies, notes: &mut Notifications) -> bool {
    let Some(clip) = clip_of(scenario, shipped) else {
        let all: Vec<&str> = shipped.agents().filter(|agent| follows_clip(agent)).collect();
        let next = all.iter().position(|agent| *agent == scenario.agent).map_or(0, |i| (i + 1) % all.len());
        let Some(agent) = all.get(next) else { return false };
        scenario.agent = (*agent).into();
        scenario.play(PolicySource::Shipped, shipped);
        return true;
    };
    let all = clips::names();
    let next = all.iter().position(|name| *name == clip).map_or(0, |i| (i + 1) % all.len().max(1));
    let Some(name) = all.get(next) else { return false };
    choose_clip(scenario, name);
    notes.say(format!("clip: {name}"));
    true
}
