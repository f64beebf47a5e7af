//! `L` agents side by side: one decision, from action to observation and reward, inside vector code.

use marathon_physics::lanes::{Kernel, Real};
use marathon_physics::{Group, Readings, Sim, Work};

use crate::agent::Agent;
use crate::lane_env::Task;
use crate::senses::Senses;
use crate::shard::{BLOCK, BlockStep};
use crate::write::{Obs, Terms};

/// A coordinate or velocity beyond this has left physics for good, though it may still be finite.
const LARGEST: f64 = 1e6;

/// State of `T::LANES` agents and the results of their last decision.
pub(crate) struct LaneGroup<T: Real> {
    physics: Group<T>,
    memory: Vec<T>,
    obs: Vec<T>,
    /// Terms of the reward, the termination last.
    terms: Vec<T>,
    reward: T,
    forward: T,
}

/// Lanes whose episode ended in this decision, a bit each.
#[derive(Clone, Copy, Default)]
pub(crate) struct Ended {
    pub terminated: u32,
    pub diverged: u32,
}

impl<T: Real> LaneGroup<T> {
    pub fn new<A>(task: &Task<T, A>) -> Self {
        let mut group = LaneGroup {
            physics: Group::new(&task.sim),
            memory: vec![T::zero(); task.facts.memory],
            obs: vec![T::zero(); task.spec.obs],
            terms: vec![T::zero(); task.spec.reward_terms.len()],
            reward: T::zero(),
            forward: T::zero(),
        };
        let at_rest = vec![0.0; task.blueprint.model.nv];
        for lane in 0..T::LANES {
            group.put(&task.sim, lane, &task.blueprint.spawn, &at_rest);
        }
        group
    }

    /// Puts an agent into a state and empties its memory.
    pub fn put(&mut self, sim: &Sim<T>, lane: usize, qpos: &[f64], qvel: &[f64]) {
        self.physics.reset_lane(sim, lane, qpos, qvel);
        for m in &mut self.memory {
            m.set(lane, T::scalar(0.0));
        }
    }

    /// Configuration and velocity of an agent.
    pub fn state(&self, lane: usize) -> (Vec<f64>, Vec<f64>) {
        let read = |v: &[T]| v.iter().map(|x| T::widen(x.get(lane))).collect();
        (read(&self.physics.qpos), read(&self.physics.qvel))
    }

    /// Position of an agent along the axes that lead to +x.
    pub fn x_position(&self, along_x: &[(usize, T::Scalar)], lane: usize) -> f64 {
        along_x.iter().map(|(i, axis)| T::widen(self.physics.qpos[*i].get(lane)) * T::widen(*axis)).sum()
    }

    /// Everything that the future depends on. Controls do not belong to it: every decision sets them.
    pub fn future(&self) -> impl Iterator<Item = &T> {
        let p = &self.physics;
        p.qpos.iter().chain(&p.qvel).chain(&p.warm).chain(&self.memory)
    }

    /// Everything that the future depends on.
    pub fn future_mut(&mut self) -> impl Iterator<Item = &mut T> {
        let p = &mut self.physics;
        p.qpos.iter_mut().chain(&mut p.qvel).chain(&mut p.warm).chain(&mut self.memory)
    }

    /// Observes the start of an episode and writes the observations of `lanes` (a bit each) into a block's `obs`.
    pub fn observe_start<A: Agent>(
        &mut self,
        task: &Task<T, A>,
        work: &mut Work<T>,
        lanes: u32,
        first: usize,
        obs: &mut [f32],
    ) {
        task.sim.refresh(work, &self.physics);
        T::enter(Perceive { task, group: self, work, fresh: true, names: None });
        T::enter(Settle { group: self, termination_reward: 0.0, ended: Ended::default() });
        for (row, value) in obs.chunks_exact_mut(BLOCK).zip(&self.obs) {
            for lane in (0..T::LANES).filter(|l| lanes >> l & 1 == 1) {
                row[first + lane] = T::widen(value.get(lane)) as f32;
            }
        }
    }

    /// Makes one decision. `action` is the block's, `[act][16]`.
    pub fn decide<A: Agent>(&mut self, task: &Task<T, A>, work: &mut Work<T>, action: &[f32], first: usize) -> Ended {
        let along_x = &task.anatomy.along_x;
        let unsound = T::enter(Act { group: self, along_x, action, first });
        task.sim.step(work, &mut self.physics, task.facts.frame_skip);
        T::enter(Move { group: self, along_x });
        let (_, failed) = T::enter(Perceive { task, group: self, work, fresh: false, names: None });
        let ended = Ended { terminated: failed, diverged: unsound };
        T::enter(Settle { group: self, termination_reward: task.facts.termination_reward, ended })
    }

    /// Writes the results of a decision into a block's arrays.
    pub fn report(&self, first: usize, obs: &mut [f32], out: &mut BlockStep) {
        T::enter(Report { group: self, first, obs, out });
    }

    /// Lets an agent observe and reward once. Returns how much it observed and the terms that it added.
    pub fn rehearse<A: Agent>(&mut self, task: &Task<T, A>, work: &mut Work<T>) -> (usize, Vec<&'static str>) {
        let mut names = Vec::new();
        task.sim.refresh(work, &self.physics);
        let (observed, _) = T::enter(Perceive { task, group: self, work, fresh: true, names: Some(&mut names) });
        (observed, names)
    }
}

/// Reads `T::LANES` numbers of single precision.
#[inline(always)]
fn load<T: Real>(from: &[f32]) -> T {
    let mut x = [T::Scalar::default(); BLOCK];
    for (x, from) in x.iter_mut().zip(&from[..T::LANES]) {
        *x = T::scalar(f64::from(*from));
    }
    T::load(&x[..T::LANES])
}

/// Writes `T::LANES` numbers in single precision.
#[inline(always)]
fn store<T: Real>(value: T, to: &mut [f32]) {
    let mut x = [T::Scalar::default(); BLOCK];
    value.store(&mut x[..T::LANES]);
    for (to, x) in to[..T::LANES].iter_mut().zip(x) {
        *to = T::widen(x) as f32;
    }
}

/// Lanes in which all values are finite and of a sane size.
#[inline(always)]
fn sane<T: Real>(values: &[T]) -> T::Mask {
    // a NaN compares false
    let limit = T::lit(LARGEST);
    let mut ok = T::not(T::none());
    for x in values {
        ok = T::and(ok, x.abs().lt(limit));
    }
    ok
}

/// Takes in the actions; remembers where the agents were. Returns the lanes whose action is not finite.
struct Act<'a, T: Real> {
    group: &'a mut LaneGroup<T>,
    along_x: &'a [(usize, T::Scalar)],
    action: &'a [f32],
    first: usize,
}

impl<T: Real> Kernel<T> for Act<'_, T> {
    type Output = u32;
    #[inline(always)]
    fn run(self) -> u32 {
        let Act { group, along_x, action, first } = self;
        let one = T::lit(1.0);
        let mut ok = T::not(T::none());
        for (i, ctrl) in group.physics.ctrl.iter_mut().enumerate() {
            let a = load::<T>(&action[i * BLOCK + first..]);
            let finite = a.is_finite();
            ok = T::and(ok, finite);
            *ctrl = T::masked(finite, a.max(-one).min(one));
        }
        group.forward = T::zero();
        for (i, axis) in along_x {
            group.forward = group.physics.qpos[*i].neg_mul_add(T::splat(*axis), group.forward);
        }
        T::bits(T::not(ok))
    }
}

/// Completes the distance that [`Act`] began.
struct Move<'a, T: Real> {
    group: &'a mut LaneGroup<T>,
    along_x: &'a [(usize, T::Scalar)],
}

impl<T: Real> Kernel<T> for Move<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let LaneGroup { physics, forward, .. } = self.group;
        for (i, axis) in self.along_x {
            *forward = physics.qpos[*i].mul_add(T::splat(*axis), *forward);
        }
    }
}

/// Everything that is the agent's own: observe, remember, reward, terminate. Returns how much was observed and the
/// lanes that failed.
///
/// It is one kernel for decisions, starts of episodes and the rehearsal, because an agent's code is compiled
/// into it once per instruction set.
struct Perceive<'a, T: Real, A> {
    task: &'a Task<T, A>,
    group: &'a mut LaneGroup<T>,
    work: &'a Work<T>,
    /// An episode begins: nothing is remembered, and the reward is not used.
    fresh: bool,
    names: Option<&'a mut Vec<&'static str>>,
}

impl<T: Real, A: Agent> Kernel<T> for Perceive<'_, T, A> {
    type Output = (usize, u32);
    #[inline(always)]
    fn run(self) -> (usize, u32) {
        let Perceive { task, group, work, fresh, names } = self;
        let LaneGroup { physics, memory, obs, terms, .. } = group;
        let mut s = Senses {
            readings: Readings::new(&task.sim, physics, work),
            anatomy: &task.anatomy,
            action: &physics.ctrl,
            memory: &[],
            fresh,
        };
        if !fresh {
            task.agent.remember(&s, memory);
        }
        s.memory = memory;
        let mut obs = Obs::new(obs);
        task.agent.observe(&s, &mut obs);
        let own = terms.len() - 1;
        task.agent.step_reward(&s, &mut Terms::new(&mut terms[..own], names));
        (obs.len(), T::bits(task.agent.terminated(&s)))
    }
}

/// Quarantine, termination and the sum of the reward. Nothing that is not a sane number leaves its lane.
struct Settle<'a, T: Real> {
    group: &'a mut LaneGroup<T>,
    termination_reward: f64,
    /// Failed lanes, and lanes known to be unsound.
    ended: Ended,
}

impl<T: Real> Kernel<T> for Settle<'_, T> {
    type Output = Ended;
    #[inline(always)]
    fn run(self) -> Ended {
        let Settle { group, termination_reward, ended } = self;
        let LaneGroup { physics, obs, terms, reward, forward, .. } = group;
        let (termination, own) = terms.split_last_mut().expect("there is always the termination term");
        let failed = T::from_bits(ended.terminated);
        let mut ok = T::not(T::from_bits(ended.diverged));
        ok = T::and(ok, T::and(sane(&physics.qpos), sane(&physics.qvel)));
        ok = T::and(ok, T::and(sane(obs), sane(own)));
        for x in obs.iter_mut() {
            *x = T::masked(ok, *x);
        }
        *forward = T::masked(ok, *forward);

        // a failure costs its own price in place of everything else
        let alive = T::and(ok, T::not(failed));
        *reward = T::zero();
        for term in own.iter_mut() {
            *term = T::masked(alive, *term);
            *reward += *term;
        }
        *termination = T::masked(T::and(ok, failed), T::lit(termination_reward));
        *reward += *termination;
        Ended { terminated: T::bits(T::or(failed, T::not(ok))), diverged: T::bits(T::not(ok)) }
    }
}

/// Stores results in single precision.
struct Report<'a, T: Real> {
    group: &'a LaneGroup<T>,
    first: usize,
    obs: &'a mut [f32],
    out: &'a mut BlockStep,
}

impl<T: Real> Kernel<T> for Report<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Report { group, first, obs, out } = self;
        for (row, value) in obs.chunks_exact_mut(BLOCK).zip(&group.obs) {
            store(*value, &mut row[first..]);
        }
        for (row, value) in out.terms.chunks_exact_mut(BLOCK).zip(&group.terms) {
            store(*value, &mut row[first..]);
        }
        store(group.reward, &mut out.reward[first..]);
        store(group.forward, &mut out.forward[first..]);
    }
}
