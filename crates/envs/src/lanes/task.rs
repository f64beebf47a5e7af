//! The constants of a task for one lane type, and the starts of its episodes.

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
    /// The clips that the agents follow.
    pub reference: Option<Reference<T>>,
}

impl<T: Real> TaskData<T> {
    /// Number of terms that the first role earns.
    pub fn terms_of_first(&self) -> usize {
        self.spec.roles.first().map_or(self.spec.reward_terms.len(), |role| role.terms.end)
    }
}

/// The start of an episode, with the preparation that it needs, see [`Start`](crate::agent::Start).
#[derive(Clone, Debug)]
pub(crate) struct EpisodeStart {
    pub state: AgentState,
    pub memory: Vec<f64>,
    /// The agent's ground, by height field.
    pub grounds: Vec<(usize, Vec<f32>)>,
    pub normalize: bool,
    pub free_of_contacts: bool,
    pub settle: usize,
}

impl EpisodeStart {
    /// An empty start to draw into.
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

    /// Whether preparing it needs physics steps or contacts.
    pub fn takes_physics(&self) -> bool {
        self.free_of_contacts || self.settle > 0
    }
}
