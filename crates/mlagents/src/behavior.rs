// one file: the behavior of a role is one protocol object, and its parts share their fields
//! Agents of one kind under one of ML-Agents' behavior names, or one name per role of their task: from actions to
//! infos.

use crate::channels::{Aggregation, write_stat};
use crate::error::PlayerError;
use crate::face::{Face, roles};
use crate::parameters::{Names, Parameters};
use crate::wire::{AgentActionList, BrainParameters};
use marathon_envs::{Autoreset, Options, Spec, Step, VecEnv, VecEnvOptions, registry};
use marathon_physics::Model;
use marathon_physics::lanes::Isa;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Options of a [`Behavior`].
#[derive(Clone, Debug, PartialEq)]
pub struct BehaviorOptions {
    /// Agent, such as `Hopper-v0`.
    pub env: String,
    /// Number of agents in one area.
    pub agents: usize,
    /// Name for the trainer; `None` for the agent's registry name. With several roles, it is the first role's. Names of
    /// the others append a point and the role's name.
    pub name: Option<String>,
    /// Options of the agent.
    pub options: Options,
    /// Decisions after which an episode is truncated; `None` for the task's own number.
    pub max_episode_steps: Option<usize>,
}

impl Default for BehaviorOptions {
    /// As many hoppers as the original spawned for training.
    fn default() -> Self {
        BehaviorOptions {
            env: "Hopper-v0".into(),
            agents: 64,
            name: None,
            options: Options::new(),
            max_episode_steps: None,
        }
    }
}

/// Message size of a behavior's agents.
pub(crate) struct Sizes {
    /// The behavior's name in messages to the trainer.
    pub name: String,
    /// Bytes without agents, and bytes per agent.
    frame: usize,
    each: usize,
}

impl Sizes {
    /// Computes the sizes for a behavior before it is created.
    ///
    /// # Errors
    /// If the agent does not exist or does not take the options.
    pub fn of(options: &BehaviorOptions) -> Result<Self, PlayerError> {
        let agent = registry::global().agent_with(&options.env, &options.options)?;
        let shards = agent.shards(Isa::best())?;
        let spec = shards.spec();
        Ok(Self::of_faces(&Face::all(options.name.as_ref().unwrap_or(&spec.id), spec, 1, 0)))
    }

    fn of_faces(faces: &[Face]) -> Self {
        let sum = |bytes: fn(&Face) -> usize| faces.iter().map(bytes).sum();
        let name = faces.first().map_or("", Face::name).to_owned();
        Sizes { name, frame: sum(Face::frame_bytes), each: sum(Face::bytes_per_agent) }
    }

    /// Size of the longest message part for a number of agents, bytes.
    pub fn largest(&self, agents: usize) -> usize {
        agents.saturating_mul(self.each).saturating_add(self.frame)
    }

    /// Largest number of agents whose messages fit into this many bytes.
    pub fn most_agents(&self, bytes: usize) -> usize {
        bytes.saturating_sub(self.frame) / self.each.max(1)
    }
}

/// Totals of an agent's current episode, for statistics.
#[derive(Clone, Default)]
struct Episode {
    /// Decisions.
    steps: u32,
    /// Distance along +x, m.
    distance: f32,
    /// Sum per term of the reward.
    terms: Vec<f32>,
}

/// Agents of one kind. The trainer sees one behavior, or one per role of their task.
pub struct Behavior {
    /// One per role.
    faces: Vec<Face>,
    spec: Spec,
    env: VecEnv,
    /// Options of the environment without parameters, and with the current ones.
    plain: VecEnvOptions,
    made: VecEnvOptions,
    names: Names,
    model: Arc<Model>,
    out: Step,
    actions: Vec<f32>,
    ended: Vec<bool>,
    episodes: Vec<Episode>,
    /// Number of episodes of each agent.
    begun: Vec<u64>,
    /// Number of resets.
    resets: u64,
    /// Whether any agent has been varied.
    varied: bool,
    /// Whether parameters have commanded any agent.
    commanded: bool,
}

impl Behavior {
    /// Creates `areas` times as many agents as the options say. Their numbers begin at `first_id`.
    ///
    /// # Errors
    /// If the agent does not exist or does not take its options.
    pub fn new(options: &BehaviorOptions, areas: usize, threads: usize, first_id: i32) -> Result<Self, PlayerError> {
        let made = VecEnvOptions {
            agents: options.agents.saturating_mul(areas),
            threads,
            // an agent's own constants are drawn between two episodes
            autoreset: Autoreset::Disabled,
            max_episode_steps: options.max_episode_steps,
            options: options.options.clone(),
            ..Default::default()
        };
        let env = VecEnv::new(&options.env, &made)?;
        let spec = env.spec().clone();
        let model = Arc::new(registry::global().agent_with(&spec.id, &spec.options)?.model()?);
        let names = Names::new(&model, &spec.action_names, &spec.command, &spec.options);
        let n = env.agents();
        Ok(Behavior {
            faces: Face::all(options.name.as_ref().unwrap_or(&spec.id), &spec, n, first_id),
            out: env.buffers(),
            actions: vec![0.0; n * spec.act],
            ended: vec![false; n],
            episodes: vec![Episode { terms: vec![0.0; spec.reward_terms.len()], ..Default::default() }; n],
            begun: vec![0; n],
            resets: 0,
            varied: false,
            commanded: false,
            spec,
            env,
            plain: made.clone(),
            made,
            names,
            model,
        })
    }

    /// Name for the trainer, such as `Hopper-v0?team=0`: the first role's.
    pub fn name(&self) -> &str {
        self.faces.first().map_or("", Face::name)
    }

    /// Names of all roles for the trainer, such as `TerrainWalker2d-v0?team=0` and `TerrainWalker2d-v0.builder?team=0`.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.faces.iter().map(Face::name)
    }

    /// Number of agent numbers: one per agent and role.
    pub fn ids(&self) -> usize {
        self.faces.len() * self.env.agents()
    }

    /// Description of the task.
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// The compiled model of an agent.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The environments, for reading.
    pub fn env(&self) -> &VecEnv {
        &self.env
    }

    /// Results of the last decision.
    pub fn last(&self) -> &Step {
        &self.out
    }

    /// Names of the environment parameters that have an effect here.
    pub fn parameter_names(&self) -> &Names {
        &self.names
    }

    /// Bytes of the longest message part that the agents can need. If all their episodes end at once, there are two
    /// infos per agent and role.
    pub fn largest(&self) -> usize {
        Sizes::of_faces(&self.faces).largest(self.env.agents())
    }

    /// Number of agents whose messages fit into this many bytes.
    pub fn most_agents(&self, bytes: usize) -> usize {
        Sizes::of_faces(&self.faces).most_agents(bytes)
    }

    /// Starts all episodes again. The first call also sets the seed.
    ///
    /// # Errors
    /// If parameters are invalid; the text names them. The episodes have started nevertheless.
    pub fn reset(&mut self, seed: Option<u64>, parameters: &Parameters) -> Result<(), PlayerError> {
        self.resets += 1;
        let configured = self.configure(parameters);
        self.ended.fill(true);
        self.begun.iter_mut().for_each(|n| *n += 1);
        let varied = self.vary(parameters);
        self.made.seed = seed.unwrap_or(self.made.seed);
        self.env.reset(seed, &mut self.out.obs)?;
        self.faces.iter_mut().for_each(Face::begin);
        self.clear_ended();
        configured.and(varied)
    }

    /// Applies parameters that also take effect within episodes: commands, and options that all agents share.
    ///
    /// # Errors
    /// If a command is out of range, or an option is invalid or would change the observations or actions. The previous
    /// values stay.
    pub fn change(&mut self, parameters: &Parameters) -> Result<(), PlayerError> {
        let configured = self.configure(parameters);
        (0..self.ended.len()).map(|i| self.command(i, parameters)).fold(configured, Result::and)
    }

    /// Applies parameters that all agents share.
    fn configure(&mut self, parameters: &Parameters) -> Result<(), PlayerError> {
        let mut wanted = VecEnvOptions { seed: self.made.seed, ..self.plain.clone() };
        parameters.configure(&self.names, self.resets, &mut wanted);
        if wanted.options == self.made.options && wanted.max_episode_steps == self.made.max_episode_steps {
            return Ok(());
        }
        let mut env = VecEnv::new(&self.spec.id, &wanted)?;
        let sizes = |spec: &Spec| (spec.obs, spec.act, spec.reward_terms.len(), spec.info.len());
        if sizes(env.spec()) != sizes(&self.spec) {
            let (expected, found) = ((self.spec.obs, self.spec.act), (env.spec().obs, env.spec().act));
            return Err(PlayerError::Sizes { name: self.name().into(), expected, found });
        }
        let (expected, found) = (roles(&self.spec), roles(env.spec()));
        if found != expected {
            return Err(PlayerError::Roles { name: self.name().into(), expected, found });
        }
        self.faces.iter_mut().zip(env.spec().deciders()).for_each(|(face, role)| face.set_role(role));
        env.load(&self.env.save())?;
        self.env = env;
        self.made = wanted;
        if self.varied {
            // snapshots do not include variations
            self.ended.fill(true);
            let varied = self.vary(parameters);
            self.ended.fill(false);
            return varied;
        }
        Ok(())
    }

    /// Acts, advances to the next decision, and starts new episodes after ended ones. `chosen` has the actions of each
    /// behavior, for the agents for which its role decides. A role that does not decide keeps its last action.
    ///
    /// # Errors
    /// If the number of actions differs from that of these agents, an action has another length, or parameters are
    /// invalid.
    pub fn step(
        &mut self,
        chosen: &BTreeMap<String, AgentActionList>,
        parameters: &Parameters,
    ) -> Result<(), PlayerError> {
        for face in &self.faces {
            face.act(chosen.get(face.name()), &self.spec, &mut self.actions)?;
        }
        self.env.step(&self.actions, &mut self.out)?;
        let terms = self.spec.reward_terms.len();
        for (i, episode) in self.episodes.iter_mut().enumerate() {
            self.ended[i] = self.out.terminated[i] || self.out.truncated[i];
            episode.steps += 1;
            episode.distance += self.out.forward[i];
            for (sum, x) in episode.terms.iter_mut().zip(&self.out.terms[i * terms..(i + 1) * terms]) {
                *sum += x;
            }
        }
        self.faces.iter_mut().for_each(|face| face.earn(&self.spec, &self.out));
        if !self.ended.contains(&true) {
            return self.look();
        }
        for (begun, ended) in self.begun.iter_mut().zip(&self.ended) {
            *begun += u64::from(*ended);
        }
        let varied = self.vary(parameters);
        self.env.reset_agents(&self.ended, &mut self.out.obs)?;
        self.look().and(varied)
    }

    /// Reads which roles decide next.
    fn look(&mut self) -> Result<(), PlayerError> {
        for face in &mut self.faces {
            face.look(&self.env)?;
        }
        Ok(())
    }

    /// Draws the properties of agents whose episodes ended, for their next episode.
    fn vary(&mut self, parameters: &Parameters) -> Result<(), PlayerError> {
        let mut result = Ok(());
        for i in 0..self.ended.len() {
            if !self.ended[i] {
                continue;
            }
            let own = parameters.variation(&self.names, self.env.unvaried(), i as u64, self.begun[i]);
            if own.is_some() || self.varied {
                self.varied = true;
                let own = own.unwrap_or_else(|| self.env.unvaried().clone());
                // one invalid draw must not affect the other agents
                result = result.and(self.env.vary(i, &own).map_err(PlayerError::from));
            }
            result = result.and(self.command(i, parameters));
        }
        result
    }

    /// Sets an agent's command from parameters, or returns it to its schedule if no parameter sets it.
    fn command(&mut self, agent: usize, parameters: &Parameters) -> Result<(), PlayerError> {
        let command = parameters.command(&self.names, &self.spec.command, agent as u64, self.begun[agent]);
        if command.is_some() || self.commanded {
            self.commanded = true;
            self.env.set_command(agent, command.as_deref())?;
        }
        Ok(())
    }

    /// Clears the ended episodes and their totals.
    fn clear_ended(&mut self) {
        for (ended, episode) in self.ended.iter_mut().zip(&mut self.episodes) {
            if std::mem::take(ended) {
                (episode.steps, episode.distance) = (0, 0.0);
                episode.terms.fill(0.0);
            }
        }
    }

    /// Descriptions of the behaviors for the trainer.
    pub fn parameters(&self) -> impl Iterator<Item = BrainParameters> {
        self.faces.iter().map(Face::parameters)
    }

    /// Writes the infos of all roles, for each behavior an encoded [`AgentInfoList`](crate::wire::AgentInfoList), and
    /// appends statistics about the episodes that ended. Call it once after every [`Behavior::reset`] and
    /// [`Behavior::step`]. With `fresh_ids`, the number for the next new episode, agents change their numbers between
    /// episodes.
    pub fn report(
        &mut self,
        infos: &mut BTreeMap<String, Vec<u8>>,
        stats: &mut Vec<u8>,
        mut fresh_ids: Option<&mut i32>,
    ) {
        for face in &mut self.faces {
            // a lookup that does not create a new key
            if !infos.contains_key(face.name()) {
                infos.insert(face.name().to_string(), Vec::new());
            }
            if let Some(infos) = infos.get_mut(face.name()) {
                infos.clear();
                face.report(&self.spec, &self.out, &self.ended, fresh_ids.as_deref_mut(), infos);
            }
        }
        for i in 0..self.ended.len() {
            if self.ended[i] {
                self.write_stats(i, stats);
            }
        }
        self.clear_ended();
    }

    /// Writes statistics of an episode for TensorBoard: the task's metrics under the first role's name.
    fn write_stats(&self, i: usize, stats: &mut Vec<u8>) {
        let episode = &self.episodes[i];
        let mut average = |label: &str, name: &str, value: f32| {
            if value.is_finite() {
                write_stat(stats, &format!("{label}/{name}"), value, Aggregation::Average);
            }
        };
        let label = self.faces.first().map_or("", Face::label);
        average(label, "Distance", episode.distance);
        average(label, "Speed", episode.distance / (episode.steps as f32 * self.spec.dt as f32));
        for face in &self.faces {
            let own = face.role().terms.clone();
            for (name, sum) in self.spec.reward_terms[own.clone()].iter().zip(&episode.terms[own]) {
                average(face.label(), &format!("Reward/{name}"), *sum);
            }
        }
        if self.out.diverged[i] {
            write_stat(stats, &format!("{label}/Diverged"), 1.0, Aggregation::Sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channels::Sampler;
    use crate::wire::AgentInfoList;
    use prost::Message;

    const NAME: &str = "Hopper-v0?team=0";
    /// An empty map of actions.
    const NOBODY: BTreeMap<String, AgentActionList> = BTreeMap::new();

    fn hoppers(agents: usize, max_episode_steps: usize) -> Behavior {
        let options = BehaviorOptions { agents, max_episode_steps: Some(max_episode_steps), ..Default::default() };
        Behavior::new(&options, 1, 1, 0).unwrap()
    }

    #[test]
    fn the_longest_list_of_infos_is_foreseen() {
        let mut behavior = hoppers(300, 1);
        let none = Parameters::default();
        behavior.reset(Some(1), &none).unwrap();
        let (mut all, mut stats) = (BTreeMap::new(), Vec::new());
        behavior.report(&mut all, &mut stats, None);
        let begun = all[NAME].len();
        behavior.step(&NOBODY, &none).unwrap();
        behavior.report(&mut all, &mut stats, None);
        let infos = &all[NAME];
        assert_eq!(AgentInfoList::decode(&**infos).unwrap().value.len(), 600);
        let (length, foreseen) = (infos.len(), behavior.largest());
        assert!(length > 2 * begun - 600 * 8 && length < foreseen && length > foreseen * 9 / 10);
        assert!(behavior.most_agents(foreseen) == 300 && behavior.most_agents(foreseen / 2) < 150);
        assert!(!stats.is_empty());
    }

    #[test]
    fn a_changed_task_goes_on_where_it_was() {
        let none = Parameters::default();
        let (mut plain, mut changed) = (hoppers(2, 100), hoppers(2, 100));
        for behavior in [&mut plain, &mut changed] {
            behavior.reset(Some(5), &none).unwrap();
            behavior.step(&NOBODY, &none).unwrap();
        }
        let mut longer = Parameters::default();
        longer.set("max_episode_steps".into(), Sampler::Constant(200.0));
        changed.change(&longer).unwrap();
        for _ in 0..5 {
            plain.step(&NOBODY, &none).unwrap();
            changed.step(&NOBODY, &longer).unwrap();
        }
        assert_eq!(plain.last().obs, changed.last().obs);
        assert_eq!(changed.env().spec().max_episode_steps, 200);
        longer.set("max_episode_steps".into(), Sampler::Constant(f32::NAN));
        changed.change(&longer).unwrap();
        assert!(longer.is_empty() && changed.env().spec().max_episode_steps == 100);
    }
}
