//! Networks, what they start from, and the distributions of actions that they give.

pub mod activation;
pub mod gaussian;
pub(crate) mod init;
pub mod mlp;
pub mod normalize;
pub mod squash;
