//! Rows of constraints that are not contacts.

mod equality;
mod joint;
mod tendon;

pub(crate) use equality::equality_blocks;
pub(crate) use joint::joint_rows;
pub(crate) use tendon::{tendon_blocks, tendon_inertia};
