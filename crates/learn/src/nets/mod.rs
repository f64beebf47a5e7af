//! Networks, their initial weights, and the action distributions that they parameterize.

pub mod acting;
pub mod activation;
pub mod gaussian;
pub mod init;
pub mod mlp;
pub mod normalize;
pub mod penalty;
pub mod squash;
pub mod widen;

use crate::error::Error;
use activation::Activation;
use init::Init;
use serde::{Deserialize, Serialize};

/// Shape and initial weights of the policy and value networks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NetworkConfig {
    /// Widths of the policy's hidden layers.
    pub hidden: Vec<usize>,
    /// Widths of the value function's hidden layers; none: those of the policy's.
    pub critic_hidden: Option<Vec<usize>>,
    /// Activation of all hidden layers.
    pub activation: Activation,
    /// Initial weights of the networks.
    pub initialization: Init,
}

impl Default for NetworkConfig {
    fn default() -> Self {
        Self {
            hidden: vec![64, 64],
            critic_hidden: None,
            activation: Activation::Tanh,
            initialization: Init::Orthogonal,
        }
    }
}

impl NetworkConfig {
    /// Widths of the value function's hidden layers.
    pub fn critic(&self) -> &[usize] {
        self.critic_hidden.as_deref().unwrap_or(&self.hidden)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self) -> Result<(), Error> {
        for (field, widths) in [("hidden", &self.hidden[..]), ("critic_hidden", self.critic())] {
            if widths.iter().any(|w| !(1..=65536).contains(w)) || widths.len() > 64 {
                return Err(Error::config(field, format!("{widths:?}"), "up to 64 widths between 1 and 65536"));
            }
        }
        Ok(())
    }
}
