//! The constants of a task in lanes of one kind, and the starts of its episodes.

use marathon_physics::Sim;
use marathon_physics::lanes::Real;

use crate::agent::Facts;
use crate::agent::bindings::{Bindings, Blueprint};
use crate::agent::reference::Reference;
use crate::shard::{AgentState, Spec};

/// Constants of a task, without the agent's code.
pub(crate) struct TaskData<T: Real> {
    pub facts: Facts,
    pub spec: Spec,
    pub blueprint: Blueprint,
    pub bindings: Bindings<T>,
    pub sim: Sim<T>,
    /// What the agents follow.
    pub reference: Option<Reference<T>>,
}

impl<T: Real> TaskData<T> {
    /// How many terms the first role earns.
    pub fn terms_of_first(&self) -> usize {
        self.spec.roles.first().map_or(self.spec.reward_terms.len(), |role| role.terms.end)
    }
}

/// Where an episode starts, and what is to be done with it first, see [`Start`](crate::agent::Start).
#[derive(Clone, Debug)]
pub(crate) struct EpisodeStart {
    pub state: AgentState,
    pub memory: Vec<f64>,
    /// Ground of the agent's own, by height field.
    pub grounds: Vec<(usize, Vec<f32>)>,
    pub normalize: bool,
    pub free_of_contacts: bool,
    pub settle: usize,
}

impl EpisodeStart {
    /// To be drawn into.
    pub fn new() -> Self {
        EpisodeStart {
            state: AgentState { qpos: Vec::new(), qvel: Vec::new() },
            memory: Vec::new(),
            grounds: Vec::new(),
            normalize: true,
            free_of_contacts: false,
            settle: 0,
        }
    }

    /// Whether it takes physics to find.
    pub fn takes_physics(&self) -> bool {
        self.free_of_contacts || self.settle > 0
    }
}
