//! The agents of a batch in lanes of one width.

use super::BodyReading;
use super::pool::Helpers;
use super::quantity::{Felt, Quantity};
use crate::lanes::Real;
use crate::readings::{ContactReading, Readings};
use crate::sim::Sim;
use crate::state::{AgentState, Group, Obstacle, SolverStats, Variation, Work};
use std::collections::VecDeque;
use std::sync::Arc;

/// Operations of a [`Batch`] that depend on the lane width.
pub(super) trait Lanes: Send {
    fn set_ctrl(&mut self, agent: usize, ctrl: &[f64]);
    fn step(&mut self, substeps: usize);
    fn broken(&self) -> Vec<usize>;
    fn reset(&mut self, agent: usize, qpos: &[f64], qvel: &[f64]);
    fn read(&self, agent: usize) -> (Vec<f64>, Vec<f64>);
    fn bodies(&mut self, agent: usize) -> Vec<BodyReading>;
    fn sensors(&mut self, agent: usize) -> Vec<f64>;
    fn contacts(&mut self, agent: usize) -> Vec<ContactReading>;
    fn set_act(&mut self, agent: usize, act: &[f64]);
    fn set_mocap(&mut self, agent: usize, mocap: usize, pos: &[f64; 3], quat: &[f64; 4]);
    fn gather(&mut self, wanted: &mut [(Quantity, &mut [f64])]);
    fn ground_height(&mut self, grounds: &[usize], places: &[[f64; 2]], each: usize, heights: &mut [f64]);
    fn save(&self, agent: usize) -> AgentState;
    fn load(&mut self, agent: usize, state: &AgentState);
    fn push(&mut self, agent: usize, body: usize, force: [f64; 3], torque: [f64; 3]);
    fn vary(&mut self, agent: usize, variation: &Variation);
    fn ground(&self, agent: usize, field: usize) -> Vec<f32>;
    fn set_ground(&mut self, agent: usize, field: usize, elevations: &[f32]);
    fn obstacles(&self, agent: usize) -> Vec<Obstacle>;
    fn set_obstacles(&mut self, agent: usize, obstacles: &[Obstacle]);
    /// Stores the current states. Keeps the newest `depth` of them.
    fn remember(&mut self, depth: usize);
    /// The stored states of an agent, oldest first.
    fn remembered(&self, agent: usize) -> Vec<AgentState>;
    fn stats(&self) -> SolverStats;
}

pub(super) struct LaneBatch<T: Real> {
    pub(super) sim: Arc<Sim<T>>,
    pub(super) groups: Vec<Group<T>>,
    /// One per thread.
    pub(super) works: Vec<Work<T>>,
    pub(super) helpers: Helpers,
    /// Contacts of each group in the last step.
    pub(super) felt: Vec<Felt<T>>,
    /// Earlier states, oldest first.
    past: VecDeque<Vec<Group<T>>>,
}

impl<T: Real> LaneBatch<T> {
    pub(super) fn new(sim: Sim<T>, agents: usize, threads: usize) -> Self {
        let groups = vec![Group::new(&sim); agents.div_ceil(T::LANES)];
        let works = vec![Work::new(&sim); threads.min(groups.len())];
        let felt = vec![Felt::new(sim.model()); groups.len()];
        let helpers = Helpers::new(works.len() - 1);
        LaneBatch { sim: Arc::new(sim), groups, works, helpers, felt, past: VecDeque::new() }
    }

    fn slot(agent: usize) -> (usize, usize) {
        (agent / T::LANES, agent % T::LANES)
    }
}

impl<T: Real> Lanes for LaneBatch<T> {
    fn set_ctrl(&mut self, agent: usize, ctrl: &[f64]) {
        let (g, lane) = Self::slot(agent);
        for (u, x) in self.groups[g].ctrl.iter_mut().zip(ctrl) {
            u.set(lane, T::scalar(*x));
        }
    }

    fn set_act(&mut self, agent: usize, act: &[f64]) {
        let (g, lane) = Self::slot(agent);
        for (a, x) in self.groups[g].act.iter_mut().zip(act) {
            a.set(lane, T::scalar(*x));
        }
    }

    fn set_mocap(&mut self, agent: usize, mocap: usize, pos: &[f64; 3], quat: &[f64; 4]) {
        let (g, lane) = Self::slot(agent);
        self.groups[g].set_mocap(lane, mocap, pos, quat);
    }

    fn step(&mut self, substeps: usize) {
        let LaneBatch { sim, groups, works, helpers, felt, .. } = self;
        let share = groups.len().div_ceil(works.len());
        let run = |groups: &mut [Group<T>], felt: &mut [Felt<T>], work: &mut Work<T>| {
            for (group, felt) in groups.iter_mut().zip(felt) {
                // readings are updated on request
                sim.advance(work, group, substeps);
                felt.keep(work);
            }
        };
        let shares = groups.chunks_mut(share).zip(felt.chunks_mut(share)).zip(works);
        let run = &run;
        helpers.run(shares.map(|((groups, felt), work)| move || run(groups, felt, work)));
    }

    fn broken(&self) -> Vec<usize> {
        let mut out = Vec::new();
        for (g, group) in self.groups.iter().enumerate() {
            let bad = T::bits(T::not(group.finite()));
            out.extend((0..T::LANES).filter(|i| bad >> i & 1 == 1).map(|i| g * T::LANES + i));
        }
        out
    }

    fn reset(&mut self, agent: usize, qpos: &[f64], qvel: &[f64]) {
        let (g, lane) = Self::slot(agent);
        self.groups[g].reset_lane(&self.sim, lane, qpos, qvel);
        self.felt[g].forget(lane);
    }

    fn read(&self, agent: usize) -> (Vec<f64>, Vec<f64>) {
        let (g, lane) = Self::slot(agent);
        let get = |v: &[T]| v.iter().map(|x| T::widen(x.get(lane))).collect();
        (get(&self.groups[g].qpos), get(&self.groups[g].qvel))
    }

    fn bodies(&mut self, agent: usize) -> Vec<BodyReading> {
        let (g, lane) = Self::slot(agent);
        let (group, work) = (&self.groups[g], &mut self.works[0]);
        self.sim.forward(work, group);
        let r = Readings::new(&self.sim, group, work);
        let v3 = |v: &[T; 3]| [T::widen(v[0].get(lane)), T::widen(v[1].get(lane)), T::widen(v[2].get(lane))];
        (0..self.sim.model().bodies.len())
            .map(|b| BodyReading {
                pos: v3(&r.body_pos(b)),
                axes: r.body_axes(b).map(|c| v3(&c)),
                velocity: v3(&r.body_velocity(b)),
                angular_velocity: v3(&r.body_angular_velocity(b)),
                contacts: T::widen(r.body_contacts(b).get(lane)) as usize,
            })
            .collect()
    }

    fn sensors(&mut self, agent: usize) -> Vec<f64> {
        let (g, lane) = Self::slot(agent);
        let (group, work) = (&self.groups[g], &mut self.works[0]);
        self.sim.forward(work, group);
        let r = Readings::new(&self.sim, group, work);
        let mut out = Vec::new();
        for (i, s) in self.sim.model().sensors.iter().enumerate() {
            match r.sensor(i) {
                Some(v) => out.extend(v.iter().map(|x| T::widen(x.get(lane)))),
                None => out.resize(out.len() + s.dim, f64::NAN),
            }
        }
        out
    }

    fn contacts(&mut self, agent: usize) -> Vec<ContactReading> {
        let (g, lane) = Self::slot(agent);
        let (group, work) = (&self.groups[g], &mut self.works[0]);
        self.sim.forward(work, group);
        Readings::new(&self.sim, group, work).contacts(lane)
    }

    fn gather(&mut self, wanted: &mut [(Quantity, &mut [f64])]) {
        self.gather_rows(wanted);
    }

    fn ground_height(&mut self, grounds: &[usize], places: &[[f64; 2]], each: usize, heights: &mut [f64]) {
        self.ground_rows(grounds, places, each, heights);
    }

    fn save(&self, agent: usize) -> AgentState {
        let (g, lane) = Self::slot(agent);
        self.groups[g].save(&self.sim, lane)
    }

    fn load(&mut self, agent: usize, state: &AgentState) {
        let (g, lane) = Self::slot(agent);
        self.groups[g].load(&self.sim, lane, state);
        self.felt[g].forget(lane);
    }

    fn push(&mut self, agent: usize, body: usize, force: [f64; 3], torque: [f64; 3]) {
        let (g, lane) = Self::slot(agent);
        self.groups[g].push(&self.sim, lane, body, force, torque);
    }

    fn vary(&mut self, agent: usize, variation: &Variation) {
        let (g, lane) = Self::slot(agent);
        self.groups[g].vary(&self.sim, lane, variation);
    }

    fn ground(&self, agent: usize, field: usize) -> Vec<f32> {
        let (g, lane) = Self::slot(agent);
        self.groups[g].elevations(&self.sim, lane, field)
    }

    fn set_ground(&mut self, agent: usize, field: usize, elevations: &[f32]) {
        let (g, lane) = Self::slot(agent);
        self.groups[g].set_ground(&self.sim, lane, field, elevations);
    }

    fn obstacles(&self, agent: usize) -> Vec<Obstacle> {
        let (g, lane) = Self::slot(agent);
        self.groups[g].obstacles(lane)
    }

    fn set_obstacles(&mut self, agent: usize, obstacles: &[Obstacle]) {
        let (g, lane) = Self::slot(agent);
        self.groups[g].set_obstacles(&self.sim, lane, obstacles);
    }

    fn remember(&mut self, depth: usize) {
        let mut oldest = if self.past.len() < depth { Vec::new() } else { self.past.pop_front().unwrap_or_default() };
        oldest.clone_from(&self.groups);
        self.past.push_back(oldest);
    }

    fn remembered(&self, agent: usize) -> Vec<AgentState> {
        let (g, lane) = Self::slot(agent);
        self.past.iter().map(|groups| groups[g].save(&self.sim, lane)).collect()
    }

    fn stats(&self) -> SolverStats {
        let mut sum = SolverStats::default();
        for w in &self.works {
            sum.add(&w.stats());
        }
        sum
    }
}
