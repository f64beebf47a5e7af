//! What each algorithm does with a rollout.

pub(crate) mod a2c;
pub(crate) mod acktr;
pub mod loss;
pub(crate) mod parameters;
pub(crate) mod ppo;
pub(crate) mod sac;
