//! `L` agents in parallel: their state, and the results of their last decision.

use marathon_physics::lanes::{Kernel, Real};
use marathon_physics::{Group, Sim};

use super::commands::Commands;
use super::saved::LaneState;
use super::task::{EpisodeStart, TaskData};
use crate::shard::{BLOCK, BlockStep};

/// State of `T::LANES` agents and the results of their last decision.
pub(crate) struct LaneGroup<T: Real> {
    pub physics: Group<T>,
    pub memory: Vec<T>,
    /// Values that [`Agent::reset`](crate::Agent::reset) has set in the memory, until the episode begins. Otherwise
    /// zero.
    pub start: Vec<T>,
    /// Actions of the last decision.
    pub action: Vec<T>,
    pub commands: Commands<T>,
    pub obs: Vec<T>,
    /// Terms of the reward. If the termination has a reward, it is the last one.
    pub terms: Vec<T>,
    pub info: Vec<T>,
    /// For each foot, the lanes in which it touched the ground during the last decision.
    pub feet: Vec<u32>,
    /// For each role, the lanes in which it acts next.
    pub decides: Vec<u32>,
    /// For each role, the lanes in which its part has just ended: with failure and without.
    pub leaves: Vec<[u32; 2]>,
    pub(super) reward: T,
    pub(super) forward: T,
}

impl<T: Real> LaneGroup<T> {
    pub fn new(task: &TaskData<T>) -> Self {
        let mut group = LaneGroup {
            physics: Group::new(&task.sim),
            memory: vec![T::zero(); task.facts.memory],
            start: vec![T::zero(); task.facts.memory],
            action: vec![T::zero(); task.spec.act],
            commands: Commands::new(&task.spec.command),
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

    /// Sets an agent's state and clears its memory.
    pub fn put(&mut self, sim: &Sim<T>, lane: usize, qpos: &[f64], qvel: &[f64]) {
        self.physics.reset_lane(sim, lane, qpos, qvel);
        for x in self.memory.iter_mut().chain(&mut self.start).chain(&mut self.action) {
            x.set(lane, T::scalar(0.0));
        }
    }

    /// Sets the start state of an agent's episode.
    pub fn put_at_start(&mut self, sim: &Sim<T>, lane: usize, start: &EpisodeStart) {
        let EpisodeStart { state, normalize, memory, grounds, .. } = start;
        self.put(sim, lane, &state.qpos, &state.qvel);
        if !normalize {
            // keep these numbers, including quaternions, as they are
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

    /// Feet of an agent that touched the ground during its last decision, one bit each.
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

    /// Coordinates along x of the first agents.
    pub fn x_positions(&self, along_x: &[(usize, T::Scalar)], out: &mut [f64]) {
        for (lane, out) in out.iter_mut().enumerate() {
            *out = 0.0;
            for (i, axis) in along_x {
                *out += T::widen(self.physics.qpos[*i].get(lane)) * T::widen(*axis);
            }
        }
    }

    /// Copies an agent's state. Together with its life, it determines the agent's future.
    pub fn save(&self, sim: &Sim<T>, lane: usize) -> LaneState {
        let numbers = |v: &[T]| v.iter().map(|x| T::widen(x.get(lane))).collect();
        LaneState {
            physics: self.physics.save(sim, lane),
            memory: numbers(&self.memory),
            action: numbers(&self.action),
            command: self.commands.save(lane),
        }
    }

    /// Restores an agent's state.
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

    /// Writes the observations of `lanes` (one bit each) into a block's `obs`.
    pub fn report_start(&self, lanes: u32, first: usize, obs: &mut [f32]) {
        store_lanes(&self.obs, lanes, first, obs);
    }

    /// Writes the infos of `lanes` (one bit each) into a block's `info`.
    pub fn report_info(&self, lanes: u32, first: usize, info: &mut [f32]) {
        store_lanes(&self.info, lanes, first, info);
    }

    /// Writes the results of a decision into a block's arrays.
    pub fn report(&self, first: usize, obs: &mut [f32], out: &mut BlockStep) {
        T::enter(StoreResults { group: self, first, obs, out });
    }
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
