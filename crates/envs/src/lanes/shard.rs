//! The [`Shard`] of every registered agent, on the physics kernels, for any lane type.
//!
//! A block of sixteen agents is `16 / L` lane groups. A decision of a group stores the actions, steps the physics
//! `frame_skip` times, observes the new state, and computes reward and termination. It allocates nothing, and lanes are
//! independent.

use std::sync::Arc;

use marathon_physics::lanes::Real;
use marathon_physics::{Group, Variation, Work};

use super::context::LaneContext;
use super::decision::Task;
use super::demonstrations::demonstrations;
use super::factory::AgentFactory;
use super::group::LaneGroup;
use super::saved::{self, Saved};
use super::start_cache::StartCache;
use super::task::{EpisodeStart, TaskData};
use crate::episode_rng::{EpisodeId, EpisodeRng};
use crate::error::EnvError;
use crate::shard::spec::NUMBER;
use crate::shard::{
    AgentContext, AgentShard, AgentShards, AgentState, BLOCK, BlockStep, Demonstrations, Shard, ShardFactory, Spec,
};

impl<T: Real> ShardFactory for AgentFactory<T> {
    fn spec(&self) -> &Spec {
        &self.task.data.spec
    }

    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        Box::new(LaneShard::new(self.task.clone(), first, blocks, seed))
    }

    fn agent_bytes(&self) -> usize {
        let TaskData { spec, facts, blueprint, .. } = &self.task.data;
        let model = &blueprint.model;
        // pushes are six numbers per body; a start that needs physics is stored with its memory
        let own = 2 * model.nu + model.na + 6 * model.bodies.len() + 3 * facts.memory + model.nq + model.nv;
        // ground is stored once in the lanes' precision, and once more if starts draw it
        let ground: usize = model.hfields.iter().map(|field| field.nrow * field.ncol).sum();
        spec.agent_bytes() + NUMBER * own + 2 * size_of::<f32>() * ground + Group::kept_bytes(&self.task.data.sim)
    }

    fn demonstrations(&self) -> Option<Demonstrations> {
        demonstrations(&self.task)
    }
}

impl<T: Real> AgentShards for AgentFactory<T> {
    fn unvaried(&self) -> Variation {
        Variation::none(&self.task.data.blueprint.model)
    }

    fn agent_shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn AgentShard> {
        Box::new(LaneShard::new(self.task.clone(), first, blocks, seed))
    }
}

/// An agent's identity and progress, without its physics.
#[derive(Clone, Copy, Debug)]
struct Life {
    /// The present episode. Its number is 0 before the first one.
    id: EpisodeId,
    /// Decisions in it.
    steps: u64,
}

impl Life {
    /// The life before the first episode.
    fn new(seed: u64, agent: u64) -> Self {
        Life { id: EpisodeId { seed, agent, episode: 0 }, steps: 0 }
    }

    /// The numbers of a snapshot.
    fn words(&self) -> [u64; 4] {
        let Life { id: EpisodeId { seed, agent, episode }, steps } = *self;
        [seed, agent, episode, steps]
    }

    /// The life of the numbers of a snapshot.
    fn of_words([seed, agent, episode, steps]: [u64; 4]) -> Self {
        Life { id: EpisodeId { seed, agent, episode }, steps }
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

/// Consecutive blocks of one agent, owned by one thread.
struct LaneShard<T: Real> {
    task: Arc<Task<T>>,
    work: Work<T>,
    blocks: Vec<Block<T>>,
    /// Decisions after which an episode is truncated.
    max_episode_steps: u64,
    /// Starts that need physics.
    starts: StartCache<T>,
    /// Reused by resets.
    start: EpisodeStart,
}

impl<T: Real> LaneShard<T> {
    fn new(task: Arc<Task<T>>, first: usize, blocks: usize, seed: u64) -> Self {
        let groups = |data| (0..BLOCK / T::LANES).map(|_| LaneGroup::new(data)).collect();
        let starts = StartCache::new(blocks * BLOCK);
        let blocks = (first..first + blocks)
            .map(|b| Block {
                groups: groups(&task.data),
                lives: std::array::from_fn(|i| Life::new(seed, (b * BLOCK + i) as u64)),
            })
            .collect();
        let work = Work::new(&task.data.sim);
        let max_episode_steps = task.data.spec.max_episode_steps as u64;
        let start = EpisodeStart::new();
        LaneShard { task, work, blocks, max_episode_steps, starts, start }
    }

    /// Starts an agent's next episode: the spawn pose with random noise.
    fn begin_episode(&mut self, block: usize, agent: usize) {
        let LaneShard { task, work, blocks, starts, start, .. } = self;
        let Block { groups, lives } = &mut blocks[block];
        let (group, lane, number) = (&mut groups[agent / T::LANES], agent % T::LANES, block * BLOCK + agent);
        let id = lives[agent].next();
        if starts.get(number, id).is_none() {
            let previous = if id.episode <= 1 { vec![0.0; task.data.facts.memory] } else { group.memory_of(lane) };
            task.draw_start(start, id, &mut EpisodeRng::new(id), &previous);
            if start.takes_physics() {
                let ids: Vec<EpisodeId> = lives[agent - lane..][..T::LANES].iter().map(Life::next).collect();
                starts.make(task, work, number - lane, &ids);
            }
        }
        group.put_at_start(&task.data.sim, lane, starts.get(number, id).unwrap_or(start));
        task.tell(&mut group.commands, lane, id, 0);
        group.commands.begin(lane);
        lives[agent] = Life { id, steps: 0 };
    }
}

/// Bits of a block's mask for the group whose first agent is `first`.
fn lanes_of<T: Real>(mask: u16, first: usize) -> u32 {
    (u32::from(mask) >> first) & ((1 << T::LANES) - 1)
}

impl<T: Real> Shard for LaneShard<T> {
    fn spec(&self) -> &Spec {
        &self.task.data.spec
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
        out.terms.resize(BLOCK * task.data.spec.reward_terms.len(), 0.0);
        out.info.resize(BLOCK * task.data.spec.info.len(), 0.0);
        (out.terminated, out.truncated, out.diverged) = (0, 0, 0);
        out.decides.clear();
        out.decides.resize(task.data.spec.roles.len(), 0);
        out.leaves.clear();
        out.leaves.resize(task.data.spec.roles.len(), [0; 2]);
        for (i, group) in groups.iter_mut().enumerate() {
            let first = i * T::LANES;
            let mut last = 0;
            for (lane, life) in lives[first..].iter_mut().take(T::LANES).enumerate() {
                life.steps += 1;
                task.tell(&mut group.commands, lane, life.id, life.steps);
                last |= u32::from(life.steps >= self.max_episode_steps) << lane;
            }
            let ended = task.decide(group, &mut self.work, action, first, last);
            group.report(first, obs, out);
            out.terminated |= (ended.terminated << first) as u16;
            out.truncated |= ((ended.truncated | last) << first) as u16;
            out.diverged |= (ended.diverged << first) as u16;
            for (all, lanes) in out.decides.iter_mut().zip(&group.decides) {
                *all |= (lanes << first) as u16;
            }
            for (all, lanes) in out.leaves.iter_mut().flatten().zip(group.leaves.iter().flatten()) {
                *all |= (lanes << first) as u16;
            }
            // reset a diverged state at once, so that it does not slow its group down until the caller resets it
            for lane in (0..T::LANES).filter(|l| ended.diverged >> l & 1 == 1) {
                group.put(&task.data.sim, lane, &task.data.blueprint.spawn, &vec![0.0; task.data.blueprint.model.nv]);
            }
        }
        out.truncated &= !out.terminated;
    }

    fn save(&self, block: usize, bytes: &mut Vec<u8>) {
        let Block { groups, lives } = &self.blocks[block];
        saved::begin(bytes);
        for (i, life) in lives.iter().enumerate() {
            let state = groups[i / T::LANES].save(&self.task.data.sim, i % T::LANES);
            saved::add(bytes, &Saved { life: life.words(), state });
        }
    }

    fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        let task = &*self.task;
        let Block { groups, lives } = &mut self.blocks[block];
        let (agents, rest) = saved::read(&task.data.blueprint.model, &task.data.spec, task.data.facts.memory, bytes)?;
        for (i, (life, saved)) in lives.iter_mut().zip(&agents).enumerate() {
            *life = Life::of_words(saved.life);
            groups[i / T::LANES].load(&task.data.sim, i % T::LANES, &saved.state);
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

    fn reference(&self, agent: usize) -> Option<Vec<f64>> {
        let reference = self.task.data.reference.as_ref().filter(|_| self.task.data.facts.follows_clips)?;
        let group = &self.blocks[agent / BLOCK].groups[agent % BLOCK / T::LANES];
        Some(reference.qpos(&group.memory_of(agent % T::LANES)))
    }

    fn x_positions(&self, out: &mut [f64]) -> bool {
        let along_x = &self.task.data.bindings.along_x;
        let groups = self.blocks.iter().flat_map(|block| &block.groups);
        for (group, out) in groups.zip(out.chunks_mut(T::LANES)) {
            group.x_positions(along_x, out);
        }
        !along_x.is_empty()
    }

    fn ctrl(&self, agent: usize) -> Vec<f64> {
        self.blocks[agent / BLOCK].groups[agent % BLOCK / T::LANES].ctrl(agent % T::LANES)
    }

    fn set_state(&mut self, agent: usize, state: &AgentState) -> Result<(), EnvError> {
        let model = &self.task.data.blueprint.model;
        for (what, given, expected) in [("qpos", &state.qpos, model.nq), ("qvel", &state.qvel, model.nv)] {
            if given.len() != expected {
                return Err(EnvError::Shape { what: what.into(), found: given.len(), expected });
            }
            if let Some(x) = given.iter().find(|x| !x.is_finite()) {
                return Err(EnvError::Option { option: what, found: x.to_string(), expected: "finite numbers" });
            }
        }
        let block = &mut self.blocks[agent / BLOCK];
        let life = &mut block.lives[agent % BLOCK];
        life.steps = 0;
        let (group, lane) = (&mut block.groups[agent % BLOCK / T::LANES], agent % T::LANES);
        group.put(&self.task.data.sim, lane, &state.qpos, &state.qvel);
        self.task.tell(&mut group.commands, lane, life.id, 0);
        group.commands.begin(lane);
        self.task.begin(group, &mut self.work, 1 << lane);
        Ok(())
    }

    fn save_agent(&self, agent: usize, bytes: &mut Vec<u8>) {
        let Block { groups, lives } = &self.blocks[agent / BLOCK];
        let state = groups[agent % BLOCK / T::LANES].save(&self.task.data.sim, agent % T::LANES);
        saved::add(bytes, &Saved { life: lives[agent % BLOCK].words(), state });
    }

    fn load_agent<'a>(&mut self, agent: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        let TaskData { blueprint, spec, facts, sim, .. } = &self.task.data;
        let (saved, rest) = saved::read_agent(&blueprint.model, spec, facts.memory, bytes)?;
        let Block { groups, lives } = &mut self.blocks[agent / BLOCK];
        lives[agent % BLOCK] = Life::of_words(saved.life);
        groups[agent % BLOCK / T::LANES].load(sim, agent % T::LANES, &saved.state);
        Ok(rest)
    }

    fn context(&mut self, agent: usize) -> Box<dyn AgentContext + '_> {
        let group = &mut self.blocks[agent / BLOCK].groups[agent % BLOCK / T::LANES];
        Box::new(LaneContext { task: &self.task.data, group, lane: agent % T::LANES })
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
                task.begin(group, &mut self.work, lanes);
                group.report_start(lanes, first, obs);
            }
        }
    }

    fn limit_episodes(&mut self, max_episode_steps: usize) {
        self.max_episode_steps = max_episode_steps as u64;
    }
}
