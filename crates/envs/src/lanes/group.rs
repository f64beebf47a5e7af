//! `L` agents side by side: one decision, from action to observation and reward, inside vector code.

use marathon_physics::lanes::{Kernel, Real};
use marathon_physics::{Group, Sim, Work};

use super::agent_kernel::{Named, Occasion, Perceived};
use super::context::Commands;
use super::saved::LaneState;
use super::task::{EpisodeStart, Task};
use crate::agent::{Controls, Site};
use crate::shard::{BLOCK, BlockStep};

/// A coordinate or velocity beyond this has left physics for good, though it may still be finite.
pub(crate) const LARGEST: f64 = 1e6;
/// Limit on observations and rewards: the largest number that the arrays hold. An action far out of range has a large
/// cost.
const STORABLE: f64 = f32::MAX as f64;

/// State of `T::LANES` agents and the results of their last decision.
pub(crate) struct LaneGroup<T: Real> {
    pub physics: Group<T>,
    pub memory: Vec<T>,
    /// What starts have drawn of the memory, until the episodes begin; otherwise zero.
    pub start: Vec<T>,
    /// Actions of the last decision.
    pub action: Vec<T>,
    pub commands: Commands<T>,
    pub obs: Vec<T>,
    /// Terms of the reward; the termination last, if it has a reward of its own.
    pub terms: Vec<T>,
    pub info: Vec<T>,
    /// Per foot, the lanes in which it touched the ground during the last decision.
    pub feet: Vec<u32>,
    /// Per role, the lanes in which it decides next.
    pub decides: Vec<u32>,
    /// Per role, the lanes in which its part has just ended: where it has failed, and where not.
    pub leaves: Vec<[u32; 2]>,
    reward: T,
    forward: T,
}

/// What an agent did when it was let do everything once.
pub(crate) struct Rehearsal {
    /// How many numbers it observed.
    pub observed: usize,
    /// How many numbers it reported.
    pub reported: usize,
    /// What it named.
    pub named: Named,
}

/// Lanes whose episode ended in this decision, a bit each.
#[derive(Clone, Copy, Default)]
pub(crate) struct Ended {
    pub terminated: u32,
    pub truncated: u32,
    pub diverged: u32,
}

impl<T: Real> LaneGroup<T> {
    pub fn new(task: &Task<T>) -> Self {
        let mut group = LaneGroup {
            physics: Group::new(&task.sim),
            memory: vec![T::zero(); task.facts.memory],
            start: vec![T::zero(); task.facts.memory],
            action: vec![T::zero(); task.spec.act],
            commands: Commands::new(task),
            obs: vec![T::zero(); task.spec.obs],
            terms: vec![T::zero(); task.spec.reward_terms.len()],
            info: vec![T::zero(); task.spec.info.len()],
            feet: vec![0; task.bindings.feet.len()],
            decides: vec![0; task.facts.roles.len()],
            leaves: vec![[0; 2]; task.facts.roles.len()],
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
        for x in self.memory.iter_mut().chain(&mut self.start).chain(&mut self.action) {
            x.set(lane, T::scalar(0.0));
        }
    }

    /// Puts an agent where an episode starts.
    pub fn put_at_start(&mut self, sim: &Sim<T>, lane: usize, start: &EpisodeStart) {
        let EpisodeStart { state, normalize, memory, grounds, .. } = start;
        self.put(sim, lane, &state.qpos, &state.qvel);
        if !normalize {
            // these numbers, quaternions included
            for (v, x) in self.physics.qpos.iter_mut().zip(&state.qpos) {
                v.set(lane, T::scalar(*x));
            }
        }
        for (m, x) in self.start.iter_mut().zip(memory) {
            m.set(lane, T::scalar(*x));
        }
        for (field, elevations) in grounds {
            self.physics.set_ground(sim, lane, *field, elevations);
        }
    }

    /// An agent's memory.
    pub fn memory_of(&self, lane: usize) -> Vec<f64> {
        self.memory.iter().map(|x| T::widen(x.get(lane))).collect()
    }

    /// Feet of an agent that touched the ground during its last decision, a bit each.
    pub fn feet(&self, lane: usize) -> u32 {
        self.feet.iter().take(32).enumerate().fold(0, |bits, (i, lanes)| bits | (lanes >> lane & 1) << i)
    }

    /// Configuration and velocity of an agent.
    pub fn state(&self, lane: usize) -> (Vec<f64>, Vec<f64>) {
        let read = |v: &[T]| v.iter().map(|x| T::widen(x.get(lane))).collect();
        (read(&self.physics.qpos), read(&self.physics.qvel))
    }

    /// Controls of an agent.
    pub fn ctrl(&self, lane: usize) -> Vec<f64> {
        self.physics.ctrl.iter().map(|x| T::widen(x.get(lane))).collect()
    }

    /// Positions of the first agents along the axes that lead to +x.
    pub fn x_positions(&self, along_x: &[(usize, T::Scalar)], out: &mut [f64]) {
        for (lane, out) in out.iter_mut().enumerate() {
            *out = 0.0;
            for (i, axis) in along_x {
                *out += T::widen(self.physics.qpos[*i].get(lane)) * T::widen(*axis);
            }
        }
    }

    /// Copies an agent out of its lane: with its life, everything that its future depends on.
    pub fn save(&self, sim: &Sim<T>, lane: usize) -> LaneState {
        let numbers = |v: &[T]| v.iter().map(|x| T::widen(x.get(lane))).collect();
        LaneState {
            physics: self.physics.save(sim, lane),
            memory: numbers(&self.memory),
            action: numbers(&self.action),
            command: self.commands.save(lane),
        }
    }

    /// Puts an agent where it was when it was saved.
    pub fn load(&mut self, sim: &Sim<T>, lane: usize, saved: &LaneState) {
        let put = |to: &mut [T], from: &[f64]| {
            for (v, x) in to.iter_mut().zip(from) {
                v.set(lane, T::scalar(*x));
            }
        };
        self.physics.load(sim, lane, &saved.physics);
        put(&mut self.memory, &saved.memory);
        put(&mut self.action, &saved.action);
        self.commands.load(lane, &saved.command);
    }

    /// Begins and observes an episode of `lanes` (a bit each), which have been put where it starts.
    pub fn begin(&mut self, task: &Task<T>, work: &mut Work<T>, lanes: u32) {
        task.sim.measure_start(work, &self.physics, &task.bindings.measure);
        task.agent.perceive(task, self, work, Occasion::Start(lanes));
        let of_first = task.terms_of_first();
        T::enter(SumReward { group: self, termination_reward: None, of_first, ended: Ended::default() });
    }

    /// Writes the observations of `lanes` (a bit each) into a block's `obs`.
    pub fn report_start(&self, lanes: u32, first: usize, obs: &mut [f32]) {
        store_lanes(&self.obs, lanes, first, obs);
    }

    /// Writes the infos of `lanes` (a bit each) into a block's `info`.
    pub fn report_info(&self, lanes: u32, first: usize, info: &mut [f32]) {
        store_lanes(&self.info, lanes, first, info);
    }

    /// Makes one decision. `action` is the block's, `[act][16]`. `last`: lanes whose time is over with it, a bit each.
    pub fn decide(&mut self, task: &Task<T>, work: &mut Work<T>, action: &[f32], first: usize, last: u32) -> Ended {
        let along_x = &task.bindings.along_x;
        let clip = task.facts.controls == Controls::Nominal;
        let unsound = T::enter(TakeActions { group: self, along_x, action, first, clip });
        self.build(task);
        task.agent.control(task, self);
        task.sim.advance(work, &mut self.physics, task.facts.frame_skip);
        task.sim.measure(work, &self.physics, &task.bindings.measure);
        T::enter(CompleteForward { group: self, along_x });
        let perceived = task.agent.perceive(task, self, work, Occasion::Decision { last });
        self.commands.advance();
        let ended = Ended { terminated: perceived.failed, truncated: perceived.over, diverged: unsound };
        let (termination_reward, of_first) = (task.facts.termination_reward, task.terms_of_first());
        T::enter(SumReward { group: self, termination_reward, of_first, ended })
    }

    /// Changes the ground of the agents that ask for it.
    fn build(&mut self, task: &Task<T>) {
        let lanes = task.agent.builds(self);
        for lane in (0..T::LANES).filter(|lane| lanes >> lane & 1 == 1) {
            let LaneGroup { physics, memory, action, .. } = self;
            let read = |v: &[T]| -> Vec<f64> { v.iter().map(|x| T::widen(x.get(lane))).collect() };
            let fields = 0..task.blueprint.model.hfields.len();
            let before: Vec<Vec<f32>> = fields.map(|field| physics.elevations(&task.sim, lane, field)).collect();
            let (action, mut own, mut grounds) = (read(action), read(memory), before.clone());
            let mut site = Site { action: &action, memory: &mut own, grounds: &mut grounds, restart: false };
            task.agent.build(&mut site);
            let restart = site.restart;
            for (v, x) in memory.iter_mut().zip(own) {
                v.set(lane, T::scalar(x));
            }
            for (field, (before, now)) in before.iter().zip(&grounds).enumerate() {
                if now != before && now.len() == before.len() && now.iter().all(|z| z.is_finite()) {
                    physics.set_ground(&task.sim, lane, field, now);
                }
            }
            if restart {
                self.restart(task, lane);
            }
        }
    }

    /// Puts an agent's body where it spawns, in mid-episode.
    fn restart(&mut self, task: &Task<T>, lane: usize) {
        let blueprint = &task.blueprint;
        self.physics.reset_lane(&task.sim, lane, &blueprint.spawn, &blueprint.spawn_velocity);
        // its way there is none that it has gone
        let along_x = &task.bindings.along_x;
        let at = |(i, axis): &(usize, T::Scalar)| T::widen(self.physics.qpos[*i].get(lane)) * T::widen(*axis);
        self.forward.set(lane, T::scalar(-along_x.iter().map(at).sum::<f64>()));
    }

    /// Writes the results of a decision into a block's arrays.
    pub fn report(&self, first: usize, obs: &mut [f32], out: &mut BlockStep) {
        T::enter(StoreResults { group: self, first, obs, out });
    }

    /// Lets an agent do everything once.
    pub fn rehearse(&mut self, task: &Task<T>, work: &mut Work<T>) -> Rehearsal {
        let mut named = Named::default();
        task.sim.measure_start(work, &self.physics, &task.bindings.measure);
        let Perceived { observed, reported, .. } =
            task.agent.perceive(task, self, work, Occasion::Rehearsal(&mut named));
        Rehearsal { observed, reported, named }
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

/// Writes some lanes of values into a block's rows in single precision.
fn store_lanes<T: Real>(values: &[T], lanes: u32, first: usize, rows: &mut [f32]) {
    let all = lanes.count_ones() as usize == T::LANES;
    for (row, value) in rows.chunks_exact_mut(BLOCK).zip(values) {
        if all {
            store(*value, &mut row[first..]);
            continue;
        }
        for lane in (0..T::LANES).filter(|l| lanes >> l & 1 == 1) {
            row[first + lane] = T::widen(value.get(lane)) as f32;
        }
    }
}

/// Lanes in which all values are below `limit`, and therefore finite.
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

/// Takes in the actions; remembers where the agents were. Returns the lanes whose action is not finite.
struct TakeActions<'a, T: Real> {
    group: &'a mut LaneGroup<T>,
    along_x: &'a [(usize, T::Scalar)],
    action: &'a [f32],
    first: usize,
    /// To [-1, 1].
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

/// Completes the distance that [`TakeActions`] began.
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

/// Quarantine, termination and the sum of the reward. Nothing that is not a sane number leaves its lane.
struct SumReward<'a, T: Real> {
    group: &'a mut LaneGroup<T>,
    termination_reward: Option<f64>,
    /// Terms of the first role, which add up to the reward.
    of_first: usize,
    /// Failed lanes, and lanes known to be unsound.
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
        if let Some(price) = termination_reward {
            // a failure costs its own price in place of everything else
            let (termination, own) = terms.split_last_mut().expect("there is a term for it");
            for term in own {
                *term = T::masked(T::not(failed), *term);
            }
            *termination = T::masked(failed, T::lit(price));
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

/// Stores results in single precision.
struct StoreResults<'a, T: Real> {
    group: &'a LaneGroup<T>,
    first: usize,
    obs: &'a mut [f32],
    out: &'a mut BlockStep,
}

impl<T: Real> Kernel<T> for StoreResults<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let StoreResults { group, first, obs, out } = self;
        for (row, value) in obs.chunks_exact_mut(BLOCK).zip(&group.obs) {
            store(*value, &mut row[first..]);
        }
        for (row, value) in out.terms.chunks_exact_mut(BLOCK).zip(&group.terms) {
            store(*value, &mut row[first..]);
        }
        for (row, value) in out.info.chunks_exact_mut(BLOCK).zip(&group.info) {
            store(*value, &mut row[first..]);
        }
        store(group.reward, &mut out.reward[first..]);
        store(group.forward, &mut out.forward[first..]);
    }
}
