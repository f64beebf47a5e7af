//! Any number of agents, on any number of threads, in the widest lanes of the processor.
//!
//! [`Batch`] hides the lane width. States go in and out in MuJoCo's layout, agent by agent or, with [`Batch::gather`],
//! in arrays of all agents. An agent's bits do not depend on the width, the number of threads, the number of other
//! agents or its slot.

/// [`with_lanes`](crate::with_lanes) for whole simulations. Unit tests run none, and compile in half the time without
/// their kernels.
macro_rules! with_kernels {
    ($isa:expr, $T:ident => $body:expr) => {{
        #[cfg(not(test))]
        let result = crate::with_lanes!($isa, $T => $body);
        #[cfg(test)]
        let result = {
            type $T = f64;
            $body
        };
        result
    }};
}

mod blowup;
mod gather;
mod lanes;
mod pool;
mod quantity;
pub mod workload;

pub use blowup::{Blowup, Replay};
pub use quantity::Quantity;

use crate::lanes::Isa;
use crate::model::Model;
use crate::readings::ContactReading;
use crate::sim::{Sim, SimError, SimOptions};
use crate::state::{AgentState, Obstacle, SolverStats, Variation};
use lanes::{LaneBatch, Lanes};
use std::sync::Arc;

/// Number of agents, threads and lanes of a [`Batch`].
#[derive(Clone, Debug)]
pub struct BatchOptions {
    /// Number of agents, at least 1.
    pub agents: usize,
    /// Number of threads for stepping, at least 1. They start with the first step and sleep between steps.
    pub threads: usize,
    /// Instruction set; by default the best of this processor. A single agent uses one lane.
    pub isa: Isa,
    /// Simulation options.
    pub sim: SimOptions,
    /// Number of past [`Batch::step`] calls whose states are kept, to replay how a state became non-finite: see
    /// [`Batch::take_blowups`]. 0 keeps none and costs nothing.
    pub guard: usize,
}

impl Default for BatchOptions {
    fn default() -> Self {
        BatchOptions { agents: 1, threads: 1, isa: Isa::best(), sim: SimOptions::default(), guard: 0 }
    }
}

/// An exact copy of the complete state of some agents, for restoring into a batch of the same model and precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    agents: Vec<AgentState>,
}

/// Agents of one model, stepped together.
pub struct Batch {
    inner: Box<dyn Lanes>,
    model: Arc<Model>,
    agents: usize,
    isa: Isa,
    home: Vec<f64>,
    quarantined: u64,
    options: BatchOptions,
    blowups: Vec<Blowup>,
}

impl Batch {
    /// Creates a batch with every agent in the reference configuration, at rest.
    ///
    /// # Errors
    /// If the model uses something that is not simulated.
    ///
    /// # Panics
    /// If the processor does not support the instruction set.
    pub fn new(model: &Model, options: &BatchOptions) -> Result<Batch, SimError> {
        assert!(options.isa.supported(), "cannot run {}: {}", options.isa.name(), options.isa.obstacle().unwrap_or(""));
        let (agents, threads) = (options.agents.max(1), options.threads.max(1));
        // one lane gives the same bits without computing unused lanes
        let alone = agents == 1 && options.isa != Isa::F64 && Isa::F32.supported();
        let isa = if alone { Isa::F32 } else { options.isa };
        let inner = with_kernels!(isa, T => {
            let sim = Sim::<T>::new(model, options.sim.clone())?;
            Box::new(LaneBatch::new(sim, agents, threads)) as Box<dyn Lanes>
        });
        Ok(Batch {
            inner,
            agents,
            isa,
            home: model.qpos0.clone(),
            model: Arc::new(model.clone()),
            quarantined: 0,
            options: options.clone(),
            blowups: Vec::new(),
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

    /// Sets the configuration of quarantined agents, length `nq` (default: `qpos0`).
    ///
    /// # Panics
    /// If the length is not `nq`.
    pub fn set_home(&mut self, qpos: &[f64]) {
        assert_eq!(qpos.len(), self.model.nq, "qpos has the model's length");
        self.home = qpos.to_vec();
    }

    /// Advances all agents by `substeps` steps under `ctrl` (`[agents][nu]`, row-major).
    ///
    /// Returns the agents whose state became non-finite. Each of them is reset to the home configuration at rest before
    /// its state can be read, and counted in [`Batch::quarantined`].
    ///
    /// # Panics
    /// If `ctrl` does not have `agents * nu` entries.
    pub fn step(&mut self, ctrl: &[f64], substeps: usize) -> Vec<usize> {
        let nu = self.model.nu;
        assert_eq!(ctrl.len(), self.agents * nu, "one control per agent and actuator");
        for (agent, u) in ctrl.chunks(nu.max(1)).enumerate().take(self.agents) {
            self.inner.set_ctrl(agent, u);
        }
        if self.options.guard > 0 {
            self.inner.remember(self.options.guard);
        }
        self.inner.step(substeps);
        let broken: Vec<usize> = self.inner.broken().into_iter().filter(|a| *a < self.agents).collect();
        for &agent in &broken {
            if self.options.guard > 0 && self.blowups.len() < Blowup::MOST {
                self.blowups.push(self.blowup(agent, substeps));
            }
            self.inner.reset(agent, &self.home, &vec![0.0; self.model.nv]);
            self.quarantined += 1;
        }
        broken
    }

    /// Number of quarantined agents since the batch was created.
    pub fn quarantined(&self) -> u64 {
        self.quarantined
    }

    /// Sets the state of an agent (MuJoCo's layout). Clears its controls and warm start, and puts its mocap bodies where the model has
    /// them.
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

    /// Sensor values of an agent at its current state, in the model's order. Forces of the last step are not kept
    /// between steps, so they are recomputed for the current state and controls. Sensors that cannot be evaluated are
    /// NaN.
    pub fn sensors(&mut self, agent: usize) -> Vec<f64> {
        self.inner.sensors(agent)
    }

    /// Contacts of an agent at its current state and controls, and their forces.
    ///
    /// # Panics
    /// If the agent does not exist.
    pub fn contacts(&mut self, agent: usize) -> Vec<ContactReading> {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        self.inner.contacts(agent)
    }

    /// Sets the activations of an agent's actuators.
    ///
    /// # Panics
    /// If the agent does not exist, or there are not `na` activations.
    pub fn set_act(&mut self, agent: usize, act: &[f64]) {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        assert_eq!(act.len(), self.model.na, "an activation for each actuator that has one");
        self.inner.set_act(agent, act);
    }

    /// Moves a mocap body of an agent, until changed or until a reset: its position, m, and its orientation, which is normalized.
    /// `mocap` is its number in [`Model::mocap_bodies`].
    ///
    /// # Panics
    /// If the agent or the mocap body does not exist.
    pub fn set_mocap(&mut self, agent: usize, mocap: usize, pos: &[f64; 3], quat: &[f64; 4]) {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        self.inner.set_mocap(agent, mocap, pos, quat);
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

    /// The complete state of one agent.
    pub fn agent_state(&self, agent: usize) -> AgentState {
        self.inner.save(agent)
    }

    /// Sets the complete state of an agent.
    ///
    /// # Panics
    /// If the agent does not exist or the state belongs to another model.
    pub fn set_agent_state(&mut self, agent: usize, state: &AgentState) {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        self.inner.load(agent, state);
    }

    /// Pushes a body of an agent until the next call or reset: force, N, and torque, N m, in world axes at the body's
    /// center of mass.
    ///
    /// # Panics
    /// If the agent or the body does not exist.
    pub fn push(&mut self, agent: usize, body: usize, force: [f64; 3], torque: [f64; 3]) {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        self.inner.push(agent, body, force, torque);
    }

    /// Sets an agent's own masses, friction, strength and gravity. They survive a reset.
    ///
    /// # Panics
    /// If the agent does not exist or a length is not the model's.
    pub fn vary(&mut self, agent: usize, variation: &Variation) {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        self.inner.vary(agent, variation);
    }

    /// An agent's ground: elevations, m above the zero of the model's height field `field`, row by row.
    ///
    /// # Panics
    /// If the agent or the field does not exist.
    pub fn ground(&self, agent: usize, field: usize) -> Vec<f32> {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        self.inner.ground(agent, field)
    }

    /// Sets an agent's own ground: elevations, m above the zero of the model's height field `field`, row by row. It can
    /// change between steps and survives a reset.
    ///
    /// # Panics
    /// If the agent or the field does not exist, or the number of elevations is not that of the field's grid.
    pub fn set_ground(&mut self, agent: usize, field: usize, elevations: &[f32]) {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        self.inner.set_ground(agent, field, elevations);
    }

    /// An agent's obstacles, where they are now.
    ///
    /// # Panics
    /// If the agent does not exist.
    pub fn obstacles(&self, agent: usize) -> Vec<Obstacle> {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        self.inner.obstacles(agent)
    }

    /// Sets an agent's obstacles: solids that it touches and cannot move. They keep their velocities until they are set
    /// again, and survive a reset.
    ///
    /// # Panics
    /// If the agent does not exist, the model has no
    /// [geom for obstacles](crate::spec::ModelSpec::add_obstacles), there are more than [`Obstacle::MOST`], or a number is
    /// [out of its range](Obstacle::out_of_range).
    pub fn set_obstacles(&mut self, agent: usize, obstacles: &[Obstacle]) {
        assert!(agent < self.agents, "agent {agent} of {}", self.agents);
        self.inner.set_obstacles(agent, obstacles);
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
    /// Number of contacts with the floor at the current state.
    pub contacts: usize,
}
