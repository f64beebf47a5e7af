//! Creates the shards of an agent, after checking the agent against its facts and its model.

use std::sync::Arc;

use marathon_physics::lanes::Real;
use marathon_physics::model::Actuator;
use marathon_physics::{Model, Sim, Work};

use super::agent_kernel::AgentKernel;
use super::decision::Task;
use super::group::LaneGroup;
use super::perception::Rehearsal;
use super::roles;
use super::task::{EpisodeStart, TaskData};
use crate::agent::bindings::{Bindings, Blueprint, sim_options};
use crate::agent::reference::Reference;
use crate::agent::{CommandRange, Controls, FORWARD, Facts, Options};
use crate::episode_rng::{EpisodeId, EpisodeRng};
use crate::error::EnvError;
use crate::shard::{Metric, MetricSource, ObsGroup, Spec};

/// Name of the reward term that replaces all others when an agent fails.
pub const TERMINATION_TERM: &str = "termination";

/// Name of an observation without names.
const UNNAMED: &str = "observation";

/// Creates shards of an agent for one lane type.
pub(crate) struct AgentFactory<T: Real> {
    pub(super) task: Arc<Task<T>>,
}

impl<T: Real> AgentFactory<T> {
    /// Checks an agent. `facts` may differ from the agent's own in timing and model.
    pub fn new(facts: Facts, options: Options, agent: Arc<dyn AgentKernel<T>>) -> Result<Self, EnvError> {
        let blueprint = Blueprint::new(&facts)?;
        let bindings = Bindings::new(&facts, &blueprint)?;
        let id = || facts.id.clone();
        agent.fits(&blueprint.model).map_err(|problem| EnvError::Agent { id: id(), problem })?;
        let sim = Sim::new(&blueprint.model, sim_options()).map_err(|source| EnvError::Sim { id: id(), source })?;
        let mut reward_terms = facts.reward_terms.clone();
        if facts.termination_reward.is_some() {
            reward_terms.push(TERMINATION_TERM.into());
        }
        let [action_low, action_high] = action_bounds(&facts, &blueprint.model);
        let spec = Spec {
            id: id(),
            obs: facts.observation.unwrap_or(0),
            act: blueprint.model.nu,
            action_low,
            action_high,
            action_names: action_names(&blueprint.model),
            dt: blueprint.model.opt.timestep * facts.frame_skip as f64,
            frame_skip: facts.frame_skip,
            max_episode_steps: facts.max_episode_steps,
            reward_terms,
            info: facts.info.clone(),
            command: facts.command.clone(),
            observations: Vec::new(),
            roles: Vec::new(),
            metrics: metrics(&facts, !bindings.along_x.is_empty())
                .map_err(|problem| EnvError::Agent { id: id(), problem })?,
            nq: blueprint.model.nq,
            nv: blueprint.model.nv,
            options,
        };
        let reference = match facts.clips.as_slice() {
            [] => None,
            clips => {
                let table = Reference::new(clips, spec.dt, &blueprint, &bindings);
                Some(table.map_err(|problem| EnvError::Agent { id: id(), problem })?)
            }
        };
        let mut task = Task { data: TaskData { facts, spec, blueprint, bindings, sim, reference }, agent };
        task.data.spec.observations = rehearse(&task)?;
        task.data.spec.obs = task.data.spec.observations.last().map_or(0, |group| group.range.end);
        task.data.spec.roles = roles::of(&task.data.facts, &task.data.spec)
            .map_err(|problem| EnvError::Agent { id: task.data.facts.id.clone(), problem })?;
        Ok(AgentFactory { task: Arc::new(task) })
    }
}

/// Calls the agent's code once to check that it matches its facts. Returns the groups of its observation.
fn rehearse<T: Real>(task: &Task<T>) -> Result<Vec<ObsGroup>, EnvError> {
    let facts = &task.data.facts;
    let wrong = |problem: String| Err(EnvError::Agent { id: facts.id.clone(), problem });
    let (mut start, id) = (EpisodeStart::new(), EpisodeId { seed: 0, agent: 0, episode: 0 });
    task.draw_start(&mut start, id, &mut EpisodeRng::new(id), &vec![0.0; facts.memory]);
    if let Some(x) = start.state.qpos.iter().chain(&start.state.qvel).find(|x| !x.is_finite()) {
        return wrong(format!("its episodes start with a coordinate or velocity of {x}, expected finite numbers"));
    }
    if let Some(x) = start.memory.iter().find(|x| !x.is_finite()) {
        return wrong(format!("its episodes start with a memory of {x}, expected finite numbers"));
    }
    check_command(&facts.command).or_else(|problem| wrong(problem).map(|_: Vec<ObsGroup>| ()))?;
    let Rehearsal { observed, reported, named } =
        task.rehearse(&mut LaneGroup::new(&task.data), &mut Work::new(&task.data.sim));
    if let Some(expected) = facts.observation.filter(|n| *n != observed) {
        return wrong(format!("it observes {observed} numbers, but its facts say {expected}"));
    }
    if observed == 0 {
        return wrong("it observes nothing, expected at least one number".into());
    }
    if reported != facts.info.len() {
        return wrong(format!("it reports {reported} numbers, but its facts name {:?}", facts.info));
    }
    let terms = &named.terms;
    if *terms != facts.reward_terms {
        return wrong(format!("it adds the reward terms {terms:?}, but its facts say {:?}", facts.reward_terms));
    }
    parts(&named.groups, observed).or_else(wrong)
}

/// Names of the actuators. An actuator without a name is called by its number.
fn action_names(model: &Model) -> Vec<String> {
    let name = |(i, a): (usize, &Actuator)| if a.name.is_empty() { i.to_string() } else { a.name.clone() };
    model.actuators.iter().enumerate().map(name).collect()
}

/// Bounds of the actions.
fn action_bounds(facts: &Facts, model: &Model) -> [Vec<f32>; 2] {
    let bound = |side: usize| {
        let of = |a: &Actuator| match facts.controls {
            Controls::Nominal => [-1.0, 1.0][side],
            Controls::Raw if a.ctrl_limited => a.ctrl_range[side] as f32,
            Controls::Raw => [f32::NEG_INFINITY, f32::INFINITY][side],
        };
        model.actuators.iter().map(of).collect()
    };
    [bound(0), bound(1)]
}

/// Sources of the metrics.
fn metrics(facts: &Facts, moves_along_x: bool) -> Result<Vec<Metric>, String> {
    let mut out = Vec::new();
    for name in &facts.metrics {
        let source = match facts.info.iter().position(|info| info == name) {
            Some(i) => MetricSource::Info(i),
            // agents that cannot move along x have no such metric
            None if name == FORWARD && !moves_along_x => continue,
            None if name == FORWARD => MetricSource::Forward,
            None => {
                return Err(format!(
                    "its metric '{name}' is neither '{FORWARD}' nor one of its infos {:?}",
                    facts.info
                ));
            }
        };
        out.push(Metric { name: name.clone(), source });
    }
    Ok(out)
}

/// Groups of an observation, from their names and start indices and the observation's size.
fn parts(begun: &[(&'static str, usize)], observed: usize) -> Result<Vec<ObsGroup>, String> {
    let mut out: Vec<ObsGroup> = Vec::new();
    let unnamed = [(UNNAMED, 0)];
    let ends = begun.iter().map(|(_, at)| *at).chain([observed]);
    for ((name, start), end) in unnamed.iter().chain(begun).zip(ends) {
        if out.iter().any(|group| group.name == *name) {
            return Err(format!("two parts of its observation are called '{name}', expected unique names"));
        }
        if *start < end {
            out.push(ObsGroup { name: (*name).into(), range: *start..end });
        }
    }
    Ok(out)
}

/// Checks that the numbers of a command have unique names and valid ranges.
fn check_command(ranges: &[CommandRange]) -> Result<(), String> {
    for (i, CommandRange { name, low, high, .. }) in ranges.iter().enumerate() {
        if name.is_empty() || ranges[..i].iter().any(|other| other.name == *name) {
            return Err(format!("number {i} of its command is called '{name}', expected a unique name"));
        }
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(format!("its command '{name}' is from {low} to {high}, expected a range of finite numbers"));
        }
    }
    Ok(())
}
