//! Recording and replaying the steps before an agent's state becomes non-finite.

use super::{Batch, BatchOptions};
use crate::lanes::Isa;
use crate::model::Model;
use crate::sim::SimError;
use crate::state::AgentState;
use serde::{Deserialize, Serialize};

/// The last states of an agent before its state became non-finite. You can write it to a file (`serde`) and replay it
/// elsewhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Blowup {
    /// Number of the agent.
    pub agent: usize,
    /// Name of the model.
    pub model: String,
    /// Instruction set, which sets the precision.
    pub isa: String,
    /// Physics steps of each [`Batch::step`] call.
    pub substeps: usize,
    /// The agent's state and controls at the start of each of the last calls, oldest first. The state became non-finite
    /// in the last call.
    pub states: Vec<AgentState>,
}

/// One physics step of a replay.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// Configuration after the step.
    pub qpos: Vec<f64>,
    /// Velocity after the step.
    pub qvel: Vec<f64>,
    /// Whether all values are finite.
    pub finite: bool,
}

impl Blowup {
    /// Number of blow-ups that a batch keeps until they are taken. Further ones are only counted.
    pub const MOST: usize = 16;

    /// Simulates the agent alone, from its oldest state to the non-finite one, with the same bits.
    ///
    /// # Errors
    /// If the model is not simulated.
    ///
    /// # Panics
    /// If the model is not the one that the agent had.
    pub fn replay(&self, model: &Model, options: &BatchOptions) -> Result<Vec<Replay>, SimError> {
        let single = match self.isa.parse() {
            Ok(Isa::F64) => Isa::F64,
            _ if Isa::F32.supported() => Isa::F32,
            _ => Isa::best(),
        };
        let options = BatchOptions { agents: 1, threads: 1, isa: single, guard: 0, sim: options.sim.clone() };
        let mut batch = Batch::new(model, &options)?;
        let mut out = Vec::new();
        for state in &self.states {
            for steps in 1..=self.substeps {
                // first the whole call at once, as recorded: calls of single steps may round differently
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
