//! One decision of a lane group: from actions to observations and rewards, inside vector code.

use std::sync::Arc;

use marathon_physics::Work;
use marathon_physics::lanes::{Kernel, Real};

use super::agent_kernel::AgentKernel;
use super::commands::{Commands, idle};
use super::group::LaneGroup;
use super::perception::{Ended, Named, Occasion, Perceived, Rehearsal};
use super::task::{EpisodeStart, TaskData};
use crate::agent::{Controls, Site, Start};
use crate::episode_rng::{EpisodeId, EpisodeRng};
use crate::shard::{AgentState, BLOCK};

/// Limit on coordinates and velocities. A larger value means that the simulation has diverged, even if it is still
/// finite.
pub(crate) const LARGEST: f64 = 1e6;
/// Limit on observations and rewards: the largest number that the arrays hold. An action far out of range has a large
/// cost.
const STORABLE: f64 = f32::MAX as f64;

/// Shared by all shards of an agent: its code and the constants of its task.
pub(crate) struct Task<T: Real> {
    pub data: TaskData<T>,
    pub agent: Arc<dyn AgentKernel<T>>,
}

impl<T: Real> Task<T> {
    /// Draws the command of the agent's schedule for observation `step` of an episode. `out` holds the last scheduled
    /// command and receives the new one. Returns for how many decisions it holds.
    pub fn draw_command(&self, id: EpisodeId, step: u64, out: &mut [f64]) -> usize {
        let holds = self.agent.command(&mut EpisodeRng::at(id, step), step as usize, out);
        for (x, range) in out.iter_mut().zip(&self.data.spec.command) {
            // NaN becomes the low end
            *x = x.max(range.low).min(range.high);
        }
        holds
    }

    /// Updates an agent's command for observation `step` of an episode, 0 at the start.
    pub fn tell(&self, commands: &mut Commands<T>, lane: usize, id: EpisodeId, step: u64) {
        commands.tell(&self.data.spec.command, lane, step, |out| self.draw_command(id, step, out));
    }

    /// Draws the start of an episode into `out`, with the episode's random numbers from the present state of `random`
    /// on. `previous` is the agent's memory at the end of its last episode.
    pub fn draw_start(&self, out: &mut EpisodeStart, id: EpisodeId, random: &mut EpisodeRng, previous: &[f64]) {
        let blueprint = &self.data.blueprint;
        let mut scheduled = idle(&self.data.spec.command);
        if !scheduled.is_empty() {
            self.draw_command(id, 0, &mut scheduled);
        }
        let EpisodeStart { state: AgentState { qpos, qvel }, memory, grounds, .. } = out;
        qpos.clone_from(&blueprint.spawn);
        qvel.clone_from(&blueprint.spawn_velocity);
        memory.clear();
        memory.resize(self.data.facts.memory, 0.0);
        grounds.clear();
        let mut start = Start {
            qpos,
            qvel,
            random,
            normalize: true,
            free_of_contacts: false,
            settle: 0,
            memory,
            previous,
            scheduled: &scheduled,
            grounds,
            timeline: self.data.reference.as_ref().map(|reference| &reference.timeline),
            blueprint,
        };
        self.agent.draw(&mut start);
        let Start { normalize, free_of_contacts, settle, .. } = start;
        (out.normalize, out.free_of_contacts, out.settle) = (normalize, free_of_contacts, settle);
    }

    /// Begins episodes in `lanes` (one bit each), whose start states have been set, and observes them.
    pub fn begin(&self, group: &mut LaneGroup<T>, work: &mut Work<T>, lanes: u32) {
        self.data.sim.measure_start(work, &group.physics, &self.data.bindings.measure);
        self.agent.perceive(&self.data, group, work, Occasion::Start(lanes));
        let of_first = self.data.terms_of_first();
        T::enter(SumReward { group, termination_reward: None, of_first, ended: Ended::default() });
    }

    /// Executes one decision. `action` is the block's, `[act][16]`. `last` holds the lanes that reach their time limit,
    /// one bit each.
    pub fn decide(
        &self,
        group: &mut LaneGroup<T>,
        work: &mut Work<T>,
        action: &[f32],
        first: usize,
        last: u32,
    ) -> Ended {
        let along_x = &self.data.bindings.along_x;
        let clip = self.data.facts.controls == Controls::Nominal;
        let unsound = T::enter(TakeActions { group, along_x, action, first, clip });
        self.build(group);
        self.agent.control(&self.data, group);
        self.data.sim.advance(work, &mut group.physics, self.data.facts.frame_skip);
        self.data.sim.measure(work, &group.physics, &self.data.bindings.measure);
        T::enter(CompleteForward { group, along_x });
        let perceived = self.agent.perceive(&self.data, group, work, Occasion::Decision { last });
        group.commands.advance();
        let ended = Ended { terminated: perceived.failed, truncated: perceived.over, diverged: unsound };
        let (termination_reward, of_first) = (self.data.facts.termination_reward, self.data.terms_of_first());
        T::enter(SumReward { group, termination_reward, of_first, ended })
    }

    /// Changes the ground of the agents for which [`Agent::builds`](crate::Agent::builds) is true.
    fn build(&self, group: &mut LaneGroup<T>) {
        let lanes = self.agent.builds(group);
        for lane in (0..T::LANES).filter(|lane| lanes >> lane & 1 == 1) {
            let LaneGroup { physics, memory, action, .. } = group;
            let read = |v: &[T]| -> Vec<f64> { v.iter().map(|x| T::widen(x.get(lane))).collect() };
            let fields = 0..self.data.blueprint.model.hfields.len();
            let before: Vec<Vec<f32>> = fields.map(|field| physics.elevations(&self.data.sim, lane, field)).collect();
            let (action, mut own, mut grounds) = (read(action), read(memory), before.clone());
            let mut site = Site { action: &action, memory: &mut own, grounds: &mut grounds, restart: false };
            self.agent.build(&mut site);
            let restart = site.restart;
            for (v, x) in memory.iter_mut().zip(own) {
                v.set(lane, T::scalar(x));
            }
            for (field, (before, now)) in before.iter().zip(&grounds).enumerate() {
                if now != before && now.len() == before.len() && now.iter().all(|z| z.is_finite()) {
                    physics.set_ground(&self.data.sim, lane, field, now);
                }
            }
            if restart {
                self.restart(group, lane);
            }
        }
    }

    /// Moves an agent's body to its spawn state during an episode.
    fn restart(&self, group: &mut LaneGroup<T>, lane: usize) {
        let blueprint = &self.data.blueprint;
        group.physics.reset_lane(&self.data.sim, lane, &blueprint.spawn, &blueprint.spawn_velocity);
        // the teleport must not count as distance traveled
        let along_x = &self.data.bindings.along_x;
        let at = |(i, axis): &(usize, T::Scalar)| T::widen(group.physics.qpos[*i].get(lane)) * T::widen(*axis);
        group.forward.set(lane, T::scalar(-along_x.iter().map(at).sum::<f64>()));
    }

    /// Calls the agent's code once. Returns the names that it set and how many numbers it wrote.
    pub fn rehearse(&self, group: &mut LaneGroup<T>, work: &mut Work<T>) -> Rehearsal {
        let mut named = Named::default();
        self.data.sim.measure_start(work, &group.physics, &self.data.bindings.measure);
        let Perceived { observed, reported, .. } =
            self.agent.perceive(&self.data, group, work, Occasion::Rehearsal(&mut named));
        Rehearsal { observed, reported, named }
    }
}

/// Reads `T::LANES` numbers in single precision.
#[inline(always)]
fn load<T: Real>(from: &[f32]) -> T {
    let mut x = [T::Scalar::default(); BLOCK];
    for (x, from) in x.iter_mut().zip(&from[..T::LANES]) {
        *x = T::scalar(f64::from(*from));
    }
    T::load(&x[..T::LANES])
}

/// Lanes in which all values are finite and below `limit`.
#[inline(always)]
fn below<T: Real>(values: &[T], limit: f64) -> T::Mask {
    // a NaN compares false
    let limit = T::lit(limit);
    let mut ok = T::not(T::none());
    for x in values {
        ok = T::and(ok, x.abs().lt(limit));
    }
    ok
}

/// Stores the actions and the agents' positions along x. Returns the lanes whose action is not finite.
struct TakeActions<'a, T: Real> {
    group: &'a mut LaneGroup<T>,
    along_x: &'a [(usize, T::Scalar)],
    action: &'a [f32],
    first: usize,
    /// Whether to clip actions to [-1, 1].
    clip: bool,
}

impl<T: Real> Kernel<T> for TakeActions<'_, T> {
    type Output = u32;
    #[inline(always)]
    fn run(self) -> u32 {
        let TakeActions { group, along_x, action, first, clip } = self;
        let one = T::lit(1.0);
        let mut ok = T::not(T::none());
        for (i, own) in group.action.iter_mut().enumerate() {
            let a = load::<T>(&action[i * BLOCK + first..]);
            let finite = a.is_finite();
            ok = T::and(ok, finite);
            *own = T::masked(finite, if clip { a.max(-one).min(one) } else { a });
        }
        group.forward = T::zero();
        for (i, axis) in along_x {
            group.forward = group.physics.qpos[*i].neg_mul_add(T::splat(*axis), group.forward);
        }
        T::bits(T::not(ok))
    }
}

/// Completes the distance that [`TakeActions`] started.
struct CompleteForward<'a, T: Real> {
    group: &'a mut LaneGroup<T>,
    along_x: &'a [(usize, T::Scalar)],
}

impl<T: Real> Kernel<T> for CompleteForward<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let LaneGroup { physics, forward, .. } = self.group;
        for (i, axis) in self.along_x {
            *forward = physics.qpos[*i].mul_add(T::splat(*axis), *forward);
        }
    }
}

/// Quarantines bad lanes, applies the termination reward and sums the reward. After it, all outputs are finite and
/// storable.
struct SumReward<'a, T: Real> {
    group: &'a mut LaneGroup<T>,
    termination_reward: Option<f64>,
    /// Number of terms of the first role, which add up to the reward.
    of_first: usize,
    /// Lanes that failed, and lanes known to be bad.
    ended: Ended,
}

impl<T: Real> Kernel<T> for SumReward<'_, T> {
    type Output = Ended;
    #[inline(always)]
    fn run(self) -> Ended {
        let SumReward { group, termination_reward, of_first, ended } = self;
        let LaneGroup { physics, obs, terms, info, reward, forward, .. } = group;
        let failed = T::from_bits(ended.terminated);
        let mut ok = T::not(T::from_bits(ended.diverged));
        ok = T::and(ok, T::and(below(&physics.qpos, LARGEST), below(&physics.qvel, LARGEST)));
        ok = T::and(ok, T::and(below(obs, STORABLE), below(terms, STORABLE)));
        if let Some(reward) = termination_reward {
            // the reward of a failure replaces all other terms
            let (termination, own) = terms.split_last_mut().expect("there is a term for it");
            for term in own {
                *term = T::masked(T::not(failed), *term);
            }
            *termination = T::masked(failed, T::lit(reward));
        }
        *reward = T::zero();
        for term in &terms[..of_first] {
            *reward += *term;
        }
        ok = T::and(ok, below(std::slice::from_ref(reward), STORABLE));
        for x in terms.iter_mut().chain(obs).chain(info).chain([reward, forward]) {
            *x = T::masked(ok, *x);
        }
        Ended { terminated: T::bits(T::or(failed, T::not(ok))), diverged: T::bits(T::not(ok)), ..ended }
    }
}
