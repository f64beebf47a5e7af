//! An agent on the physics kernels: the [`Shard`] of every registered agent, for any lane width.
//!
//! A block of sixteen agents is `16 / L` lane groups. One decision of a group is: take the actions, step the physics
//! `frame_skip` times, look at the state reached, reward, terminate. Nothing in it allocates and no lane sees another.

use std::sync::Arc;

use marathon_physics::lanes::Real;
use marathon_physics::model::Actuator;
use marathon_physics::{Model, Sim, Variation, Work};

use crate::agent::{Controls, Facts};
use crate::anatomy::{Anatomy, Blueprint, sim_options};
use crate::error::EnvError;
use crate::lane_group::{LaneGroup, Rehearsal};
use crate::mind::Mind;
use crate::options::Options;
use crate::prepared::Prepared;
use crate::random::{EpisodeId, EpisodeRng};
use crate::saved;
use crate::shard::{BLOCK, BlockStep, Shard, ShardFactory, Spec};
use crate::start::Start;

/// Name of the reward term that replaces all others when an agent fails.
pub const TERMINATION_TERM: &str = "termination";

/// A state of one agent.
#[derive(Clone, Debug, PartialEq)]
pub struct AgentState {
    /// Configuration, MuJoCo's layout.
    pub qpos: Vec<f64>,
    /// Velocity, MuJoCo's layout.
    pub qvel: Vec<f64>,
}

/// A [`Shard`] whose agents can be looked at: for viewers, tests and tools.
pub trait AgentShard: Shard {
    /// State of an agent, numbered within this shard.
    fn state(&self, agent: usize) -> AgentState;
    /// Writes the positions of the agents' roots along x, m, which [`BlockStep::forward`] is a difference of; as many as
    /// fit. Returns whether roots can move along x.
    fn x_positions(&self, out: &mut [f64]) -> bool;
    /// Puts an agent into a state, as if an episode had begun there.
    ///
    /// # Errors
    /// If lengths are wrong or a number is not finite.
    fn set_state(&mut self, agent: usize, state: &AgentState) -> Result<(), EnvError>;
    /// Pushes a body of an agent, numbered within this shard, until told otherwise or until its next episode: force, N, and
    /// torque, N m, in world axes at the body's center of mass.
    fn push(&mut self, agent: usize, body: usize, force: [f64; 3], torque: [f64; 3]);
    /// Feet ([`Facts::feet`]) of an agent that touched the ground during its last decision: a bit each, of the first 32.
    fn feet(&self, agent: usize) -> u32;
    /// Writes what the agents in `mask` report about their present states into `info` (`[info][16]`, see
    /// [`Facts::info`]; lanes outside the mask are left alone).
    fn info(&self, block: usize, mask: u16, info: &mut [f32]);
    /// Starts all random streams anew from a seed; the next reset begins every agent's first episode under it.
    fn reseed(&mut self, seed: u64);
    /// The same for one agent, numbered within this shard, which gets the streams of agent `number`.
    fn reseed_agent(&mut self, agent: usize, seed: u64, number: u64);
    /// Writes the observations of the agents in `mask` as if their episodes began in their present states into `obs`
    /// (`[obs][16]`; lanes outside the mask are left alone).
    fn observe(&mut self, block: usize, mask: u16, obs: &mut [f32]);
    /// Sets the number of decisions after which an episode is truncated, in place of the task's own.
    fn limit_episodes(&mut self, max_episode_steps: usize);
    /// Gives an agent, numbered within this shard, masses, friction, strength and gravity of its own, until changed.
    fn vary(&mut self, agent: usize, variation: &Variation);
    /// Gives an agent, numbered within this shard, ground of its own, until changed: elevations, m above the zero of the
    /// model's height field `field`, row by row.
    ///
    /// # Errors
    /// If there is no such field, or the elevations are not finite numbers for each point of its grid.
    fn set_ground(&mut self, agent: usize, field: usize, elevations: &[f32]) -> Result<(), EnvError>;
}

/// A [`ShardFactory`] that can also make [`AgentShard`]s.
pub trait AgentShards: ShardFactory {
    /// Same as [`ShardFactory::shard`].
    fn agent_shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn AgentShard>;
    /// The model's own constants: what [`AgentShard::vary`] may deviate from.
    fn unvaried(&self) -> Variation;
}

/// What all shards of an agent share.
pub(crate) struct Task<T: Real> {
    pub mind: Arc<dyn Mind<T>>,
    pub facts: Facts,
    pub spec: Spec,
    pub blueprint: Blueprint,
    pub anatomy: Anatomy<T>,
    pub sim: Sim<T>,
}

/// Makes shards of an agent for one lane width.
pub(crate) struct AgentFactory<T: Real> {
    task: Arc<Task<T>>,
}

impl<T: Real> AgentFactory<T> {
    /// With facts that are the agent's but for its pace or its model.
    pub fn new(facts: Facts, options: Options, mind: Arc<dyn Mind<T>>) -> Result<Self, EnvError> {
        let blueprint = Blueprint::new(&facts)?;
        let anatomy = Anatomy::new(&facts, &blueprint)?;
        let id = || facts.id.clone();
        mind.fits(&blueprint.model).map_err(|problem| EnvError::Agent { id: id(), problem })?;
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
            nq: blueprint.model.nq,
            nv: blueprint.model.nv,
            options,
        };
        let mut task = Task { mind, facts, spec, blueprint, anatomy, sim };
        task.spec.obs = task.rehearse()?;
        Ok(AgentFactory { task: Arc::new(task) })
    }
}

/// Names of the actuators; of one without a name, its number.
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

impl<T: Real> Task<T> {
    /// Lets the agent begin an episode, observe and reward once, to find out whether it keeps to its facts. Returns the
    /// length of its observation.
    fn rehearse(&self) -> Result<usize, EnvError> {
        let facts = &self.facts;
        let wrong = |problem: String| Err(EnvError::Agent { id: facts.id.clone(), problem });
        let mut start = AgentState { qpos: Vec::new(), qvel: Vec::new() };
        self.draw_start(&mut start, &mut EpisodeRng::new(EpisodeId { seed: 0, agent: 0, episode: 0 }));
        if let Some(x) = start.qpos.iter().chain(&start.qvel).find(|x| !x.is_finite()) {
            return wrong(format!("its episodes start with a coordinate or velocity of {x}, expected finite numbers"));
        }
        let Rehearsal { observed, reported, terms } = LaneGroup::new(self).rehearse(self, &mut Work::new(&self.sim));
        if let Some(expected) = facts.observation.filter(|n| *n != observed) {
            return wrong(format!("it observes {observed} numbers, but its facts say {expected}"));
        }
        if observed == 0 {
            return wrong("it observes nothing, expected at least one number".into());
        }
        if reported != facts.info.len() {
            return wrong(format!("it reports {reported} numbers, but its facts name {:?}", facts.info));
        }
        if terms != facts.reward_terms {
            return wrong(format!("it adds the reward terms {terms:?}, but its facts say {:?}", facts.reward_terms));
        }
        Ok(observed)
    }

    /// Lets the agent draw the start of an episode into `state`.
    pub fn draw_start(&self, state: &mut AgentState, random: &mut EpisodeRng) -> Drawn {
        let blueprint = &self.blueprint;
        state.qpos.clone_from(&blueprint.spawn);
        state.qvel.clone_from(&blueprint.spawn_velocity);
        let AgentState { qpos, qvel } = state;
        let mut start = Start { qpos, qvel, random, normalize: true, free_of_contacts: false, settle: 0, blueprint };
        self.mind.draw(&mut start);
        let Start { normalize, free_of_contacts, settle, .. } = start;
        Drawn { normalize, free_of_contacts, settle }
    }
}

/// What is to be done with a start that was drawn, see [`Start`].
pub(crate) struct Drawn {
    pub normalize: bool,
    pub free_of_contacts: bool,
    pub settle: usize,
}

impl<T: Real> ShardFactory for AgentFactory<T> {
    fn spec(&self) -> &Spec {
        &self.task.spec
    }

    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        Box::new(LaneShard::new(self.task.clone(), first, blocks, seed))
    }
}

impl<T: Real> AgentShards for AgentFactory<T> {
    fn unvaried(&self) -> Variation {
        Variation::none(&self.task.blueprint.model)
    }

    fn agent_shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn AgentShard> {
        Box::new(LaneShard::new(self.task.clone(), first, blocks, seed))
    }
}

/// Whose life it is, and how far it has come: what an agent is besides its physics.
#[derive(Clone, Copy, Debug)]
struct Life {
    /// The present episode; number 0 before the first.
    id: EpisodeId,
    /// Decisions made in it.
    steps: u64,
}

impl Life {
    /// Before its first episode.
    fn new(seed: u64, agent: u64) -> Self {
        Life { id: EpisodeId { seed, agent, episode: 0 }, steps: 0 }
    }

    /// The episode after the present one.
    fn next(&self) -> EpisodeId {
        EpisodeId { episode: self.id.episode + 1, ..self.id }
    }
}

/// Sixteen agents.
struct Block<T: Real> {
    groups: Vec<LaneGroup<T>>,
    lives: [Life; BLOCK],
}

/// A run of blocks of one agent, owned by one thread.
struct LaneShard<T: Real> {
    task: Arc<Task<T>>,
    work: Work<T>,
    blocks: Vec<Block<T>>,
    /// Decisions after which an episode is truncated.
    max_episode_steps: u64,
    /// Starts that took physics.
    prepared: Prepared<T>,
    /// Scratch of resets.
    start: AgentState,
}

impl<T: Real> LaneShard<T> {
    fn new(task: Arc<Task<T>>, first: usize, blocks: usize, seed: u64) -> Self {
        let groups = |task| (0..BLOCK / T::LANES).map(|_| LaneGroup::new(task)).collect();
        let prepared = Prepared::new(blocks * BLOCK);
        let blocks = (first..first + blocks)
            .map(|b| Block {
                groups: groups(&task),
                lives: std::array::from_fn(|i| Life::new(seed, (b * BLOCK + i) as u64)),
            })
            .collect();
        let work = Work::new(&task.sim);
        let max_episode_steps = task.spec.max_episode_steps as u64;
        let start = AgentState { qpos: Vec::new(), qvel: Vec::new() };
        LaneShard { task, work, blocks, max_episode_steps, prepared, start }
    }

    /// Puts an agent where its next episode starts: the spawn pose with noise of the agent's own.
    fn begin_episode(&mut self, block: usize, agent: usize) {
        let LaneShard { task, work, blocks, prepared, start, .. } = self;
        let Block { groups, lives } = &mut blocks[block];
        let (group, lane, number) = (&mut groups[agent / T::LANES], agent % T::LANES, block * BLOCK + agent);
        let id = lives[agent].next();
        if prepared.get(number, id).is_none() {
            let drawn = task.draw_start(start, &mut EpisodeRng::new(id));
            if drawn.free_of_contacts || drawn.settle > 0 {
                let ids: Vec<EpisodeId> = lives[agent - lane..][..T::LANES].iter().map(Life::next).collect();
                prepared.make(task, work, number - lane, &ids);
            } else {
                group.put(&task.sim, lane, &start.qpos, &start.qvel);
                if !drawn.normalize {
                    group.set_qpos(lane, &start.qpos);
                }
            }
        }
        if let Some(start) = prepared.get(number, id) {
            group.put(&task.sim, lane, &start.qpos, &start.qvel);
        }
        lives[agent] = Life { id, steps: 0 };
    }
}

/// Bits of a block's mask that belong to the group whose first agent is `first`.
fn lanes_of<T: Real>(mask: u16, first: usize) -> u32 {
    (u32::from(mask) >> first) & ((1 << T::LANES) - 1)
}

impl<T: Real> Shard for LaneShard<T> {
    fn spec(&self) -> &Spec {
        &self.task.spec
    }

    fn blocks(&self) -> usize {
        self.blocks.len()
    }

    fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
        for agent in (0..BLOCK).filter(|i| mask >> i & 1 == 1) {
            self.begin_episode(block, agent);
        }
        self.observe(block, mask, obs);
    }

    fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut BlockStep) {
        let task = &*self.task;
        let Block { groups, lives } = &mut self.blocks[block];
        out.terms.resize(BLOCK * task.spec.reward_terms.len(), 0.0);
        out.info.resize(BLOCK * task.spec.info.len(), 0.0);
        (out.terminated, out.truncated, out.diverged) = (0, 0, 0);
        for (i, group) in groups.iter_mut().enumerate() {
            let first = i * T::LANES;
            let ended = group.decide(task, &mut self.work, action, first);
            group.report(first, obs, out);
            out.terminated |= (ended.terminated << first) as u16;
            out.diverged |= (ended.diverged << first) as u16;
            // a broken state is put away at once: it must not slow its group down until the caller resets it
            for lane in (0..T::LANES).filter(|l| ended.diverged >> l & 1 == 1) {
                group.put(&task.sim, lane, &task.blueprint.spawn, &vec![0.0; task.blueprint.model.nv]);
            }
        }
        for (i, life) in lives.iter_mut().enumerate() {
            life.steps += 1;
            if life.steps >= self.max_episode_steps {
                out.truncated |= 1 << i;
            }
        }
        out.truncated &= !out.terminated;
    }

    fn save(&self, block: usize, bytes: &mut Vec<u8>) {
        let Block { groups, lives } = &self.blocks[block];
        saved::begin(bytes);
        for (i, life) in lives.iter().enumerate() {
            let Life { id: EpisodeId { seed, agent, episode }, steps } = *life;
            let (physics, memory) = groups[i / T::LANES].save(&self.task.sim, i % T::LANES);
            saved::add(bytes, [seed, agent, episode, steps], &physics, memory);
        }
    }

    fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        let task = &*self.task;
        let Block { groups, lives } = &mut self.blocks[block];
        let (agents, rest) = saved::read(&task.blueprint.model, task.facts.memory, bytes)?;
        for (i, (life, agent)) in lives.iter_mut().zip(&agents).enumerate() {
            let [seed, number, episode, steps] = agent.life;
            *life = Life { id: EpisodeId { seed, agent: number, episode }, steps };
            groups[i / T::LANES].load(&task.sim, i % T::LANES, &agent.body);
        }
        Ok(rest)
    }
}

impl<T: Real> AgentShard for LaneShard<T> {
    fn state(&self, agent: usize) -> AgentState {
        let group = &self.blocks[agent / BLOCK].groups[agent % BLOCK / T::LANES];
        let (qpos, qvel) = group.state(agent % T::LANES);
        AgentState { qpos, qvel }
    }

    fn x_positions(&self, out: &mut [f64]) -> bool {
        let along_x = &self.task.anatomy.along_x;
        let groups = self.blocks.iter().flat_map(|block| &block.groups);
        for (group, out) in groups.zip(out.chunks_mut(T::LANES)) {
            group.x_positions(along_x, out);
        }
        !along_x.is_empty()
    }

    fn set_state(&mut self, agent: usize, state: &AgentState) -> Result<(), EnvError> {
        let model = &self.task.blueprint.model;
        for (what, given, expected) in [("qpos", &state.qpos, model.nq), ("qvel", &state.qvel, model.nv)] {
            if given.len() != expected {
                return Err(EnvError::Shape { what: what.into(), found: given.len(), expected });
            }
            if let Some(x) = given.iter().find(|x| !x.is_finite()) {
                return Err(EnvError::Option { option: what, found: x.to_string(), expected: "finite numbers" });
            }
        }
        let block = &mut self.blocks[agent / BLOCK];
        block.lives[agent % BLOCK].steps = 0;
        let (group, lane) = (&mut block.groups[agent % BLOCK / T::LANES], agent % T::LANES);
        group.put(&self.task.sim, lane, &state.qpos, &state.qvel);
        group.begin(&self.task, &mut self.work, 1 << lane);
        Ok(())
    }

    fn push(&mut self, agent: usize, body: usize, force: [f64; 3], torque: [f64; 3]) {
        let group = &mut self.blocks[agent / BLOCK].groups[agent % BLOCK / T::LANES];
        group.push(&self.task.sim, agent % T::LANES, body, force, torque);
    }

    fn feet(&self, agent: usize) -> u32 {
        self.blocks[agent / BLOCK].groups[agent % BLOCK / T::LANES].feet(agent % T::LANES)
    }

    fn info(&self, block: usize, mask: u16, info: &mut [f32]) {
        for (i, group) in self.blocks[block].groups.iter().enumerate() {
            let first = i * T::LANES;
            group.report_info(lanes_of::<T>(mask, first), first, info);
        }
    }

    fn reseed(&mut self, seed: u64) {
        for life in self.blocks.iter_mut().flat_map(|b| &mut b.lives) {
            *life = Life::new(seed, life.id.agent);
        }
    }

    fn reseed_agent(&mut self, agent: usize, seed: u64, number: u64) {
        self.blocks[agent / BLOCK].lives[agent % BLOCK] = Life::new(seed, number);
    }

    fn observe(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
        let task = &*self.task;
        for (i, group) in self.blocks[block].groups.iter_mut().enumerate() {
            let first = i * T::LANES;
            let lanes = lanes_of::<T>(mask, first);
            if lanes != 0 {
                group.begin(task, &mut self.work, lanes);
                group.report_start(lanes, first, obs);
            }
        }
    }

    fn limit_episodes(&mut self, max_episode_steps: usize) {
        self.max_episode_steps = max_episode_steps as u64;
    }

    fn vary(&mut self, agent: usize, variation: &Variation) {
        let group = &mut self.blocks[agent / BLOCK].groups[agent % BLOCK / T::LANES];
        group.vary(&self.task.sim, agent % T::LANES, variation);
    }

    fn set_ground(&mut self, agent: usize, field: usize, elevations: &[f32]) -> Result<(), EnvError> {
        let fields = &self.task.blueprint.model.hfields;
        let Some(grid) = fields.get(field) else {
            let expected = "less than the number of the model's height fields";
            return Err(EnvError::Option { option: "field", found: field.to_string(), expected });
        };
        let (found, expected) = (elevations.len(), grid.nrow * grid.ncol);
        if found != expected {
            return Err(EnvError::Shape { what: "elevations [nrow][ncol]".into(), found, expected });
        }
        if let Some(x) = elevations.iter().find(|x| !x.is_finite()) {
            return Err(EnvError::Option { option: "elevations", found: x.to_string(), expected: "finite numbers" });
        }
        let group = &mut self.blocks[agent / BLOCK].groups[agent % BLOCK / T::LANES];
        group.set_ground(&self.task.sim, agent % T::LANES, field, elevations);
        Ok(())
    }
}
