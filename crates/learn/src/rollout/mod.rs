//! Experience of agents: collecting, storing, and computing advantages.

pub(crate) mod advantage;
pub mod collect;
pub mod context;
pub mod data;
pub(crate) mod replay;
pub mod role_rollout;
pub(crate) mod states;
pub mod statistics;
pub mod sums;
