//! A sparse factorization of one agent in which much touches much.
//!
//! It generalizes the articulated-body recursion. That recursion eliminates the joints of a link and hands to the
//! parent a 6x6 matrix over the parent's spatial acceleration. Here the matrix of a link, its front, is also over the
//! accelerations of the links that it touches: they are carried inward as they are, until the elimination reaches them
//! (Duff and Reid's multifrontal method, with links for variables). Rows over several joints, such as tendons, are carried
//! along in the same way, as the sum of their terms that are still to come. A link that touches nothing costs what it
//! costs in the recursion, islands never meet, and a contact costs by the links between it and the root, not by the other
//! contacts. Trees are eliminated by minimum degree ([`order`]), the links of a tree from the tips to the root.
//!
//! Which links touch differs between agents, and so do order and fronts: an agent is factorized in scalar arithmetic,
//! whatever lanes it shares. The order and every sum depend on that agent alone.

mod assembly;
mod front;
mod order;
mod plan;

pub(crate) use assembly::Tie;
pub(crate) use front::{JointRow, Numbers, factorize, solve};
pub(crate) use plan::{NONE, Plan, RowTerms};

use crate::lanes::Real;

/// The factorization of one agent.
#[derive(Clone, Debug)]
pub(crate) struct Crowd<S> {
    pub plan: Plan<S>,
    pub numbers: Numbers<S>,
}

impl<S: Real> Crowd<S> {
    pub fn new() -> Self {
        Crowd { plan: Plan::new(), numbers: Numbers::new() }
    }
}
