//! Any number of agents with plain arrays, for all callers except the embedded learner.
//!
//! Arrays are row-major with one row per agent, and belong to the caller. Agents are stored in blocks of sixteen,
//! distributed over the threads of a pool. Results do not depend on the number of threads, the number of agents or the
//! instruction set.

use marathon_physics::lanes::Isa;
use marathon_physics::{Obstacle, Variation};
use rayon::prelude::*;

use super::arrays::{ObsNumber, Step, StepMut, to_rows};
use super::deciders::Turn;
use super::options::{Autoreset, VecEnvOptions};
use super::pool::Pool;
use super::worker::Worker;
use crate::error::EnvError;
use crate::registry::{self, Registry};
use crate::shard::{AgentContext, AgentState, BLOCK, Spec, check_memory};

/// Limit on the number of threads, because each has its own working memory.
const MOST_THREADS: usize = 1024;

/// Agents of one kind that are stepped together.
pub struct VecEnv {
    pub(super) spec: Spec,
    /// The model's own constants.
    unvaried: Variation,
    pub(super) agents: usize,
    autoreset: Autoreset,
    pub(super) workers: Vec<Worker>,
    /// Agents per worker, a multiple of the block size. The last worker may have fewer.
    pub(super) stride: usize,
    /// `None` for a single worker.
    pool: Option<Pool>,
}

impl VecEnv {
    /// Creates an environment of an agent of the global registry. [Reset](VecEnv::reset) the agents before their first
    /// step.
    ///
    /// # Errors
    /// If there is no such agent, an option is invalid, the agents exceed the memory budget, or the thread pool cannot
    /// be started.
    pub fn new(agent: &str, options: &VecEnvOptions) -> Result<VecEnv, EnvError> {
        Self::from_registry(&registry::global(), agent, options)
    }

    /// The same with another registry.
    ///
    /// # Errors
    /// As [`VecEnv::new`].
    pub fn from_registry(registry: &Registry, agent: &str, options: &VecEnvOptions) -> Result<VecEnv, EnvError> {
        let wrong = |option, found: String, expected| Err(EnvError::Option { option, found, expected });
        if options.agents == 0 {
            return wrong("agents", "0".into(), "at least 1");
        }
        if options.threads > MOST_THREADS {
            return wrong("threads", options.threads.to_string(), "at most 1024");
        }
        if options.max_episode_steps == Some(0) {
            return wrong("max_episode_steps", "0".into(), "at least 1");
        }
        let agent = registry.agent_with(agent, &options.options)?;
        let factory = agent.shards(options.isa.unwrap_or_else(Isa::best))?;
        check_memory(&*factory, options.agents)?;
        let unvaried = factory.unvaried();
        let mut spec = factory.spec().clone();
        spec.max_episode_steps = options.max_episode_steps.unwrap_or(spec.max_episode_steps);
        let blocks = options.agents.div_ceil(BLOCK);
        let threads = marathon_physics::threads(options.threads).min(blocks);
        let share = blocks.div_ceil(threads);
        let workers: Vec<_> = (0..blocks)
            .step_by(share)
            .map(|first| {
                let own = share.min(blocks - first);
                let mut shard = factory.agent_shard(first, own, options.seed);
                shard.limit_episodes(spec.max_episode_steps);
                Worker::new(shard, own)
            })
            .collect();
        let pool = if workers.len() > 1 { Some(Pool::new(workers.len())?) } else { None };
        let (agents, autoreset, stride) = (options.agents, options.autoreset, share * BLOCK);
        Ok(VecEnv { spec, unvaried, agents, autoreset, workers, stride, pool })
    }

    /// Facts of the task.
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// Number of agents.
    pub fn agents(&self) -> usize {
        self.agents
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.workers.len()
    }

    /// Arrays of the right shapes for [`VecEnv::step`].
    pub fn buffers(&self) -> Step {
        Step::new(self.agents, &self.spec)
    }

    /// Starts a new episode for every agent and writes the first observations, `[agents][obs]`. A seed restarts all
    /// random streams.
    ///
    /// # Errors
    /// If the array's length is wrong.
    pub fn reset<O: ObsNumber>(&mut self, seed: Option<u64>, obs: &mut [O]) -> Result<(), EnvError> {
        self.check("obs [agents][obs]", obs.len(), self.spec.obs)?;
        if let Some(seed) = seed {
            for worker in &mut self.workers {
                worker.shard.reseed(seed);
            }
        }
        self.each_block(&|_| true, obs, Worker::reset)
    }

    /// Starts a new episode for the agents in `mask` and writes their first observations. Other rows are unchanged.
    ///
    /// # Errors
    /// If an array's length is wrong.
    pub fn reset_agents<O: ObsNumber>(&mut self, mask: &[bool], obs: &mut [O]) -> Result<(), EnvError> {
        self.check("mask [agents]", mask.len(), 1)?;
        self.check("obs [agents][obs]", obs.len(), self.spec.obs)?;
        self.each_block(&|i| mask[i], obs, Worker::reset)
    }

    /// Restarts the random streams of one agent as those of agent `number` in an environment with this seed. The next
    /// reset begins the first episode with them.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn reseed_agent(&mut self, agent: usize, seed: u64, number: usize) -> Result<(), EnvError> {
        self.check_agent(agent)?;
        self.workers[agent / self.stride].shard.reseed_agent(agent % self.stride, seed, number as u64);
        Ok(())
    }

    /// The model's own constants, which [`VecEnv::vary`] can change.
    pub fn unvaried(&self) -> &Variation {
        &self.unvaried
    }

    /// Inputs of an agent besides actions: command, pushes, constants and ground.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn context(&mut self, agent: usize) -> Result<Box<dyn AgentContext + '_>, EnvError> {
        self.check_agent(agent)?;
        Ok(self.workers[agent / self.stride].shard.context(agent % self.stride))
    }

    /// Sets an agent's command, or returns it to its schedule, see [`AgentContext::set_command`].
    ///
    /// # Errors
    /// If there is no such agent, or the command is invalid.
    pub fn set_command(&mut self, agent: usize, command: Option<&[f64]>) -> Result<(), EnvError> {
        self.context(agent)?.set_command(command)
    }

    /// Sets an agent's masses, friction, strength and gravity, for domain randomization, see [`AgentContext::vary`].
    ///
    /// # Errors
    /// If there is no such agent, a length is wrong, or a number is out of its range.
    pub fn vary(&mut self, agent: usize, variation: &Variation) -> Result<(), EnvError> {
        self.context(agent)?.vary(variation)
    }

    /// An agent's ground, see [`AgentContext::ground`].
    ///
    /// # Errors
    /// If there is no such agent or field.
    pub fn ground(&mut self, agent: usize, field: usize) -> Result<Vec<f32>, EnvError> {
        self.context(agent)?.ground(field)
    }

    /// Sets an agent's ground, see [`AgentContext::set_ground`].
    ///
    /// # Errors
    /// If there is no such agent or field, or the heights are not finite numbers for each point of the field's grid.
    pub fn set_ground(&mut self, agent: usize, field: usize, elevations: &[f32]) -> Result<(), EnvError> {
        self.context(agent)?.set_ground(field, elevations)
    }

    /// Sets an agent's obstacles, see [`AgentContext::set_obstacles`].
    ///
    /// # Errors
    /// If there is no such agent, its model has no geom for obstacles, there are too many, or a number is out of its range.
    pub fn set_obstacles(&mut self, agent: usize, obstacles: &[Obstacle]) -> Result<(), EnvError> {
        self.context(agent)?.set_obstacles(obstacles)
    }

    /// Writes the observations of the agents in `mask` at their present states, as at the start of an episode. Use it
    /// after [`VecEnv::set_state`]. Other rows are unchanged.
    ///
    /// # Errors
    /// If an array's length is wrong.
    pub fn observe<O: ObsNumber>(&mut self, mask: &[bool], obs: &mut [O]) -> Result<(), EnvError> {
        self.check("mask [agents]", mask.len(), 1)?;
        self.check("obs [agents][obs]", obs.len(), self.spec.obs)?;
        self.each_block(&|i| mask[i], obs, Worker::observe)
    }

    /// Writes the agents' infos at their present states, `[agents][info]`. Use it after a reset, or for episodes that
    /// began within a step. [`Step::info`] belongs to the states at the end of a decision.
    ///
    /// # Errors
    /// If the array's length is wrong.
    pub fn info(&self, info: &mut [f32]) -> Result<(), EnvError> {
        let n = self.spec.info.len();
        self.check("info [agents][info]", info.len(), n)?;
        let mut block = vec![0.0; n * BLOCK];
        for (i, rows) in info.chunks_mut((n * BLOCK).max(1)).enumerate() {
            let (worker, own) = (&self.workers[i * BLOCK / self.stride], i % (self.stride / BLOCK));
            worker.shard.info(own, !0, &mut block);
            to_rows(&block, n, !0, rows);
        }
        Ok(())
    }

    /// Advances every agent by one decision. `actions` is `[agents][act]` in the units of [`Spec::action_low`].
    ///
    /// # Errors
    /// If an array's length is wrong. Then nothing has changed.
    pub fn step<'a, O: ObsNumber + 'a>(
        &mut self,
        actions: &[f32],
        out: impl Into<StepMut<'a, O>>,
    ) -> Result<(), EnvError> {
        let mut out = out.into();
        let (obs, act) = (self.spec.obs, self.spec.act);
        let (terms, infos) = (self.spec.reward_terms.len(), self.spec.info.len());
        self.check("actions [agents][act]", actions.len(), act)?;
        self.check("obs [agents][obs]", out.obs.len(), obs)?;
        self.check("final_obs [agents][obs]", out.final_obs.len(), obs)?;
        self.check("reward [agents]", out.reward.len(), 1)?;
        self.check("terms [agents][reward_terms]", out.terms.len(), terms)?;
        self.check("info [agents][info]", out.info.len(), infos)?;
        self.check("forward [agents]", out.forward.len(), 1)?;
        self.check("terminated [agents]", out.terminated.len(), 1)?;
        self.check("truncated [agents]", out.truncated.len(), 1)?;
        self.check("diverged [agents]", out.diverged.len(), 1)?;

        let autoreset = self.autoreset;
        let Some(pool) = &mut self.pool else {
            self.workers[0].step(autoreset, actions, &mut out);
            return Ok(());
        };
        let pool = pool.get()?;
        // each worker gets the rows of its own agents
        let (spec, n) = (&self.spec, self.stride);
        let mut rest = out;
        let mut parts = Vec::with_capacity(self.workers.len());
        for _ in 1..self.workers.len() {
            let (part, others) = rest.split_at(n, spec);
            parts.push(part);
            rest = others;
        }
        parts.push(rest);
        pool.install(|| {
            (self.workers.par_iter_mut(), actions.par_chunks(n * act), parts)
                .into_par_iter()
                .for_each(|(worker, actions, mut out)| worker.step(autoreset, actions, &mut out));
        });
        Ok(())
    }

    /// State of an agent.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn state(&self, agent: usize) -> Result<AgentState, EnvError> {
        self.check_agent(agent)?;
        Ok(self.workers[agent / self.stride].shard.state(agent % self.stride))
    }

    /// Configuration of the agent's clip at the present frame: `qpos` in the world, including all laps since the
    /// episode began. Rewards compare the agent with it. `None` for tasks that follow no clips.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn reference(&self, agent: usize) -> Result<Option<Vec<f64>>, EnvError> {
        self.check_agent(agent)?;
        Ok(self.workers[agent / self.stride].shard.reference(agent % self.stride))
    }

    /// Position of every agent's root along x, m. [`Step::forward`] is its difference between decisions. `None` if the
    /// root cannot move along x.
    pub fn x_positions(&self) -> Option<Vec<f64>> {
        let mut x = vec![0.0; self.agents];
        let mut there = true;
        for (worker, out) in self.workers.iter().zip(x.chunks_mut(self.stride)) {
            there &= worker.shard.x_positions(out);
        }
        there.then_some(x)
    }

    /// Controls of an agent during its last decision, `[nu]`, in the actuators' units.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn ctrl(&self, agent: usize) -> Result<Vec<f64>, EnvError> {
        self.check_agent(agent)?;
        Ok(self.workers[agent / self.stride].shard.ctrl(agent % self.stride))
    }

    /// Sets an agent's state, as if an episode began there.
    ///
    /// # Errors
    /// If there is no such agent, or the state does not match its model.
    pub fn set_state(&mut self, agent: usize, state: &AgentState) -> Result<(), EnvError> {
        self.check_agent(agent)?;
        let (worker, local) = (&mut self.workers[agent / self.stride], agent % self.stride);
        worker.shard.set_state(local, state)?;
        worker.begin(local / BLOCK, 1 << (local % BLOCK));
        Ok(())
    }

    /// Pushes a body of an agent until changed or until its next episode, see [`AgentContext::push`].
    ///
    /// # Errors
    /// If there is no such agent or body, or the numbers are not finite.
    pub fn push(&mut self, agent: usize, body: usize, force: [f64; 3], torque: [f64; 3]) -> Result<(), EnvError> {
        self.context(agent)?.push(body, force, torque)
    }

    /// Feet ([`Facts::feet`](crate::Facts::feet)) of an agent that touched the ground during its last decision, one bit
    /// each. Only the first 32 are included.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn feet(&self, agent: usize) -> Result<u32, EnvError> {
        self.check_agent(agent)?;
        Ok(self.workers[agent / self.stride].shard.feet(agent % self.stride))
    }

    /// Writes for which agents a role acts next, `[agents]`. Roles are numbered as in
    /// [`Spec::deciders`](crate::Spec::deciders). When an intermittent role does not act, repeat its last action. All
    /// roles act at the start of an episode, and after [`VecEnv::load`] until the next step.
    ///
    /// # Errors
    /// If there is no such role, or the array's length is wrong.
    pub fn decides(&self, role: usize, out: &mut [bool]) -> Result<(), EnvError> {
        self.check("decides [agents]", out.len(), 1)?;
        self.ask(role, |turn| turn.decides, out)
    }

    /// Writes for which agents the last decision ended a role's part of the episode while others continue, `[agents]`:
    /// with failure and without, see [`Agent::leaves`](crate::Agent::leaves).
    ///
    /// # Errors
    /// As [`VecEnv::decides`].
    pub fn leaves(&self, role: usize, [failed, finished]: [&mut [bool]; 2]) -> Result<(), EnvError> {
        for (which, out) in [failed, finished].into_iter().enumerate() {
            self.check("leaves [agents]", out.len(), 1)?;
            self.ask(role, |turn| turn.leaves[which], out)?;
        }
        Ok(())
    }

    /// Writes a role's mask for all agents.
    fn ask(&self, role: usize, mask: impl Fn(&Turn) -> u16, out: &mut [bool]) -> Result<(), EnvError> {
        let roles = self.spec.roles.len();
        if role >= roles.max(1) {
            let expected = "less than the number of roles";
            return Err(EnvError::Option { option: "role", found: role.to_string(), expected });
        }
        for (worker, rows) in self.workers.iter().zip(out.chunks_mut(self.stride)) {
            for (block, rows) in rows.chunks_mut(BLOCK).enumerate() {
                let mask = mask(worker.deciders.turn(block, role));
                rows.iter_mut().enumerate().for_each(|(i, bit)| *bit = mask >> i & 1 == 1);
            }
        }
        Ok(())
    }

    pub(super) fn check(&self, what: &str, found: usize, columns: usize) -> Result<(), EnvError> {
        let expected = self.agents * columns;
        if found == expected { Ok(()) } else { Err(EnvError::Shape { what: what.into(), found, expected }) }
    }

    pub(super) fn check_agent(&self, agent: usize) -> Result<(), EnvError> {
        if agent < self.agents {
            return Ok(());
        }
        Err(EnvError::Option { option: "agent", found: agent.to_string(), expected: "less than the number of agents" })
    }

    /// Calls a function for each block with chosen agents, and writes its observations to their rows.
    fn each_block<O: ObsNumber>(
        &mut self,
        chosen: Chosen,
        obs: &mut [O],
        act: fn(&mut Worker, usize, u16),
    ) -> Result<(), EnvError> {
        let (columns, n) = (self.spec.obs, self.stride);
        let run = |(i, (worker, obs)): (usize, (&mut Worker, &mut [O]))| {
            for (block, rows) in obs.chunks_mut(BLOCK * columns).enumerate() {
                let first = i * n + block * BLOCK;
                let mask = (0..rows.len() / columns).fold(0, |mask, k| mask | u16::from(chosen(first + k)) << k);
                if mask != 0 {
                    act(worker, block, mask);
                    to_rows(&worker.obs, columns, mask, rows);
                }
            }
        };
        match &mut self.pool {
            None => run((0, (&mut self.workers[0], obs))),
            Some(pool) => pool.get()?.install(|| {
                self.workers.par_iter_mut().zip(obs.par_chunks_mut(n * columns)).enumerate().for_each(run);
            }),
        }
        Ok(())
    }
}

/// Chooses agents of an environment.
type Chosen<'a> = &'a (dyn Fn(usize) -> bool + Sync);
