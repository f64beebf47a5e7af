//! Changes of a scenario that need a fitting agent: another mode, another role on a course, the next agent.

use crate::app::mode::Mode;
use crate::app::stage::clips::follows_clip;
use crate::app::stage::course::{self, BUILT_AGAINST, CourseOptions, LED, PlayerRole};
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::{PolicySource, Scenario};
use bevy_marathon::Ground;
use marathon_runs::TaskConfig;

/// The agent of the mode *imitate* by default. A policy comes with it.
const FIRST_FOLLOWER: &str = "MarathonManWalk-v0";

/// The character that a player without other wishes has.
pub const HERO: &str = "MarathonManController-v0";
/// The agent that the menu lets learn first: its policy walks after seconds.
const LEARNER: &str = "Hopper-v0";
/// The runner of the courses of the menu. It observes the ground ahead.
const RUNNER: &str = "TerrainMarathonMan-v0";

/// The scenario that the main menu starts for a mode: one character with the policy that comes with it, on level ground.
pub fn fresh_start(scenario: &Scenario, mode: Mode, shipped: &ShippedPolicies) -> Scenario {
    let agent = match mode {
        Mode::Learn => LEARNER,
        Mode::Imitate => FIRST_FOLLOWER,
        Mode::Course => RUNNER,
        _ => HERO,
    };
    let mut fresh = Scenario {
        agent: agent.into(),
        chosen: TaskConfig::default(),
        source: PolicySource::Shipped,
        agents: 1,
        ground: Ground::Level,
        model: None,
        ..scenario.clone()
    };
    if mode == Mode::Course {
        fresh.course = CourseOptions { role: PlayerRole::Run, ..CourseOptions::default() };
    }
    switch_mode(&mut fresh, mode, shipped);
    fresh
}

/// Switches to a mode, as the menu does. An agent that the mode is not possible with makes way for one that is.
pub fn switch_mode(scenario: &mut Scenario, mode: Mode, shipped: &ShippedPolicies) {
    scenario.mode = mode;
    match (mode, &scenario.source) {
        (Mode::Learn, _) => scenario.play(PolicySource::Trainer, shipped),
        (Mode::Testbed, _) => scenario.play(PolicySource::Nothing, shipped),
        (_, PolicySource::File(_)) => {}
        _ => scenario.play(PolicySource::Shipped, shipped),
    }
    if mode == Mode::Imitate && !follows_clip(&scenario.agent) {
        scenario.agent = FIRST_FOLLOWER.into();
    }
    if mode == Mode::Course {
        fit_to_course(scenario, shipped);
    }
}

/// Changes the agent if the player's role on the course is not possible with it.
pub fn fit_to_course(scenario: &mut Scenario, shipped: &ShippedPolicies) {
    let fits =
        scenario.task_config(shipped).is_ok_and(|task_config| course::check(&scenario.course, &task_config).is_ok());
    if !fits {
        scenario.agent = if scenario.course.role == PlayerRole::Run { LED.into() } else { BUILT_AGAINST.into() };
        scenario.play(PolicySource::Shipped, shipped);
    }
}

/// Whether the player's role on the course is possible with an agent and the policy that comes with it.
fn fits_course(scenario: &Scenario, agent: &str, shipped: &ShippedPolicies) -> bool {
    let other = Scenario { agent: agent.into(), source: PolicySource::Shipped, ..scenario.clone() };
    other.task_config(shipped).is_ok_and(|task_config| course::check(&other.course, &task_config).is_ok())
}

/// Switches to the next agent that has a policy. Returns whether the scenario has changed.
pub fn next_agent(scenario: &mut Scenario, shipped: &ShippedPolicies) -> bool {
    let count = shipped.agents().count();
    let first = shipped.agents().position(|agent| agent == scenario.agent).map_or(0, |i| i + 1);
    let fits = |agent: &&str| scenario.mode != Mode::Course || fits_course(scenario, agent, shipped);
    let Some(next) = shipped.agents().cycle().skip(first).take(count).find(fits) else { return false };
    scenario.agent = next.into();
    scenario.model = None;
    if matches!(scenario.source, PolicySource::File(_)) {
        scenario.source = PolicySource::Shipped;
    }
    true
}
