//! What happened before an agent's state stopped being finite, and the same again step by step.

use super::{Batch, BatchOptions};
use crate::lanes::Isa;
use crate::model::Model;
use crate::sim::SimError;
use crate::state::AgentState;
use serde::{Deserialize, Serialize};

/// The last states of an agent before it broke. It can be written to a file (`serde`) and replayed elsewhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Blowup {
    /// Number of the agent.
    pub agent: usize,
    /// Name of the model.
    pub model: String,
    /// Precision: name of the instruction set.
    pub isa: String,
    /// Physics steps of each [`Batch::step`] call.
    pub substeps: usize,
    /// The agent's state at the beginning of each of the last calls, oldest first, with the controls of that call. In the
    /// last one it broke.
    pub states: Vec<AgentState>,
}

/// One physics step of a replay.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// Configuration after the step.
    pub qpos: Vec<f64>,
    /// Velocity after the step.
    pub qvel: Vec<f64>,
    /// All of it is finite.
    pub finite: bool,
}

impl Blowup {
    /// Blow-ups that a batch keeps until they are taken; further ones are only counted.
    pub const MOST: usize = 16;

    /// Steps the agent once more from its oldest state to where it broke, alone: the same bits.
    ///
    /// # Errors
    /// If the model is not simulated.
    ///
    /// # Panics
    /// If the model is not the one that the agent had.
    pub fn replay(&self, model: &Model, options: &BatchOptions) -> Result<Vec<Replay>, SimError> {
        let single = match self.isa.parse() {
            Ok(Isa::F64) => Isa::F64,
            _ => Isa::F32,
        };
        let options = BatchOptions { agents: 1, threads: 1, isa: single, guard: 0, sim: options.sim.clone() };
        let mut batch = Batch::new(model, &options)?;
        let mut out = Vec::new();
        for state in &self.states {
            for steps in 1..=self.substeps {
                // from the start in one call, as it was: calls of single steps may round otherwise
                batch.set_agent_state(0, state);
                batch.inner.step(steps);
                let (qpos, qvel) = batch.inner.read(0);
                let finite = batch.inner.broken().is_empty();
                out.push(Replay { qpos, qvel, finite });
            }
        }
        Ok(out)
    }
}

impl Batch {
    /// Takes the blow-ups since the last call: at most [`Blowup::MOST`], and only with [`BatchOptions::guard`].
    pub fn take_blowups(&mut self) -> Vec<Blowup> {
        std::mem::take(&mut self.blowups)
    }

    pub(super) fn blowup(&self, agent: usize, substeps: usize) -> Blowup {
        Blowup {
            agent,
            model: self.model.name.clone(),
            isa: self.isa.name().into(),
            substeps,
            states: self.inner.remembered(agent),
        }
    }
}
