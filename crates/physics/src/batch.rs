//! Any number of agents, on any number of threads, in the widest lanes the processor has.
//!
//! [`Batch`] hides the lane width: states go in and out in MuJoCo's layout, agent by agent. The same agents give the same
//! bits whatever the width, the number of threads, the number of other agents and the slots they sit in.

use crate::lanes::{Isa, Real};
use crate::model::Model;
use crate::readings::Readings;
use crate::sim::{Sim, SimError, SimOptions};
use crate::with_lanes;
use crate::work::{Group, SolverStats, Work};
use std::sync::Arc;

/// Number of agents, threads and lanes of a [`Batch`].
#[derive(Clone, Debug)]
pub struct BatchOptions {
    /// Number of agents, at least 1.
    pub agents: usize,
    /// Number of threads that step them, at least 1.
    pub threads: usize,
    /// Instruction set; the best of this processor by default.
    pub isa: Isa,
    /// Simulation options.
    pub sim: SimOptions,
}

impl Default for BatchOptions {
    fn default() -> Self {
        BatchOptions { agents: 1, threads: 1, isa: Isa::best(), sim: SimOptions::default() }
    }
}

/// The complete state of some agents: an exact copy, to be restored into a batch of the same model and precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// Per agent: qpos, qvel, ctrl and the solver's warm start.
    agents: Vec<Vec<f64>>,
}

/// Agents of one model, stepped together.
pub struct Batch {
    inner: Box<dyn Lanes>,
    model: Arc<Model>,
    agents: usize,
    isa: Isa,
    home: Vec<f64>,
    quarantined: u64,
}

impl Batch {
    /// A batch with every agent in the reference configuration, at rest.
    ///
    /// # Errors
    /// If the model uses something that is not simulated.
    ///
    /// # Panics
    /// If the processor does not support the instruction set asked for.
    pub fn new(model: &Model, options: &BatchOptions) -> Result<Batch, SimError> {
        assert!(options.isa.supported(), "this processor has no {}", options.isa.name());
        let (agents, threads) = (options.agents.max(1), options.threads.max(1));
        let inner = with_lanes!(options.isa, T => {
            let sim = Sim::<T>::new(model, options.sim.clone())?;
            Box::new(LaneBatch::new(sim, agents, threads)) as Box<dyn Lanes>
        });
        Ok(Batch {
            inner,
            agents,
            isa: options.isa,
            home: model.qpos0.clone(),
            model: Arc::new(model.clone()),
            quarantined: 0,
        })
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Number of agents.
    pub fn agents(&self) -> usize {
        self.agents
    }

    /// Instruction set in use.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// Sets the configuration that quarantined agents are put into, length `nq` (default: `qpos0`).
    ///
    /// # Panics
    /// If the length is not `nq`.
    pub fn set_home(&mut self, qpos: &[f64]) {
        assert_eq!(qpos.len(), self.model.nq, "qpos has the model's length");
        self.home = qpos.to_vec();
    }

    /// Advances all agents by `substeps` steps under `ctrl` (`[agents][nu]`, row-major).
    ///
    /// Returns the agents whose state stopped being finite: each was put back into the home configuration at rest,
    /// before anybody could read the broken state, and counted in [`Batch::quarantined`].
    ///
    /// # Panics
    /// If `ctrl` does not have `agents * nu` entries.
    pub fn step(&mut self, ctrl: &[f64], substeps: usize) -> Vec<usize> {
        let nu = self.model.nu;
        assert_eq!(ctrl.len(), self.agents * nu, "one control per agent and actuator");
        for (agent, u) in ctrl.chunks(nu.max(1)).enumerate().take(self.agents) {
            self.inner.set_ctrl(agent, u);
        }
        self.inner.step(substeps);
        let broken: Vec<usize> = self.inner.broken().into_iter().filter(|a| *a < self.agents).collect();
        for &agent in &broken {
            self.inner.reset(agent, &self.home, &vec![0.0; self.model.nv]);
            self.quarantined += 1;
        }
        broken
    }

    /// Number of times an agent was quarantined since the batch was made.
    pub fn quarantined(&self) -> u64 {
        self.quarantined
    }

    /// Puts an agent into a state (MuJoCo's layout); its controls and warm start are cleared.
    ///
    /// # Panics
    /// If the agent does not exist or a length is not the model's.
    pub fn reset(&mut self, agent: usize, qpos: &[f64], qvel: &[f64]) {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        self.inner.reset(agent, qpos, qvel);
    }

    /// Configuration of an agent, length `nq`.
    pub fn qpos(&self, agent: usize) -> Vec<f64> {
        self.inner.read(agent).0
    }

    /// Velocity of an agent, length `nv`.
    pub fn qvel(&self, agent: usize) -> Vec<f64> {
        self.inner.read(agent).1
    }

    /// Pose of every body of an agent.
    pub fn bodies(&mut self, agent: usize) -> Vec<BodyReading> {
        self.inner.bodies(agent)
    }

    /// Values of the sensors of an agent at its present state, in the model's order. The forces of the last step are not
    /// kept between steps: they are recomputed for the present state and controls. Sensors that cannot be evaluated are
    /// NaN.
    pub fn sensors(&mut self, agent: usize) -> Vec<f64> {
        self.inner.sensors(agent)
    }

    /// An exact copy of all agents' states.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot { agents: (0..self.agents).map(|a| self.inner.save(a)).collect() }
    }

    /// Restores a snapshot: the future is then exactly what it was when the snapshot was taken.
    ///
    /// # Panics
    /// If the snapshot has another number of agents or belongs to another model.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        assert_eq!(snapshot.agents.len(), self.agents, "a snapshot of the same number of agents");
        for (agent, state) in snapshot.agents.iter().enumerate() {
            self.inner.load(agent, state);
        }
    }

    /// Counts of the constraint solver's work.
    pub fn stats(&self) -> SolverStats {
        self.inner.stats()
    }
}

/// Pose and motion of a body in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyReading {
    /// Origin of the body's frame, m.
    pub pos: [f64; 3],
    /// Axes of the body's frame (columns).
    pub axes: [[f64; 3]; 3],
    /// Velocity of the frame's origin, m/s.
    pub velocity: [f64; 3],
    /// Angular velocity, rad/s.
    pub angular_velocity: [f64; 3],
    /// Number of contacts with the floor at the present state.
    pub contacts: usize,
}

/// What [`Batch`] needs of a lane width.
trait Lanes: Send {
    fn set_ctrl(&mut self, agent: usize, ctrl: &[f64]);
    fn step(&mut self, substeps: usize);
    fn broken(&self) -> Vec<usize>;
    fn reset(&mut self, agent: usize, qpos: &[f64], qvel: &[f64]);
    fn read(&self, agent: usize) -> (Vec<f64>, Vec<f64>);
    fn bodies(&mut self, agent: usize) -> Vec<BodyReading>;
    fn sensors(&mut self, agent: usize) -> Vec<f64>;
    fn save(&self, agent: usize) -> Vec<f64>;
    fn load(&mut self, agent: usize, state: &[f64]);
    fn stats(&self) -> SolverStats;
}

struct LaneBatch<T: Real> {
    sim: Arc<Sim<T>>,
    groups: Vec<Group<T>>,
    /// One per thread.
    works: Vec<Work<T>>,
}

impl<T: Real> LaneBatch<T> {
    fn new(sim: Sim<T>, agents: usize, threads: usize) -> Self {
        let groups = vec![Group::new(&sim); agents.div_ceil(T::LANES)];
        let works = vec![Work::new(&sim); threads.min(groups.len())];
        LaneBatch { sim: Arc::new(sim), groups, works }
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

    fn step(&mut self, substeps: usize) {
        let share = self.groups.len().div_ceil(self.works.len());
        let sim = &self.sim;
        if self.works.len() == 1 {
            for group in &mut self.groups {
                sim.step(&mut self.works[0], group, substeps);
            }
            return;
        }
        std::thread::scope(|scope| {
            for (groups, work) in self.groups.chunks_mut(share).zip(&mut self.works) {
                scope.spawn(move || {
                    for group in groups {
                        sim.step(work, group, substeps);
                    }
                });
            }
        });
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

    fn save(&self, agent: usize) -> Vec<f64> {
        let (g, lane) = Self::slot(agent);
        let group = &self.groups[g];
        let parts = [&group.qpos, &group.qvel, &group.ctrl, &group.act, &group.warm];
        let pushes = group.external.iter().flatten();
        parts.into_iter().flatten().chain(pushes).map(|x| T::widen(x.get(lane))).collect()
    }

    fn load(&mut self, agent: usize, state: &[f64]) {
        let (g, lane) = Self::slot(agent);
        let group = &mut self.groups[g];
        let plain = group.qpos.len() + group.qvel.len() + group.ctrl.len() + group.act.len() + group.warm.len();
        let pushes = 6 * self.sim.model().bodies.len();
        assert!(state.len() == plain || state.len() == plain + pushes, "a snapshot of the same model");
        if state.len() > plain && group.external.is_empty() {
            group.external = vec![[T::zero(); 6]; self.sim.model().bodies.len()];
        }
        let parts = [&mut group.qpos, &mut group.qvel, &mut group.ctrl, &mut group.act, &mut group.warm];
        let pushes = group.external.iter_mut().flatten();
        // an agent that was not pushed when it was saved is not pushed now
        let state = state.iter().copied().chain(std::iter::repeat(0.0));
        for (x, s) in parts.into_iter().flatten().chain(pushes).zip(state) {
            x.set(lane, T::scalar(s));
        }
    }

    fn stats(&self) -> SolverStats {
        let mut sum = SolverStats::default();
        for w in &self.works {
            sum.add(&w.stats());
        }
        sum
    }
}
