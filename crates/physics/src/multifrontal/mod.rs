//! A sparse factorization for one agent with many contacts between its links.
//!
//! It generalizes the articulated-body recursion. The recursion eliminates the joints of a link and passes a 6x6 matrix
//! over the parent's spatial acceleration to the parent. Here the matrix of a link, its *front*, also covers the
//! accelerations of the links that touch it. Those accelerations are passed inward unchanged until the elimination
//! reaches their links (Duff and Reid's multifrontal method, with links as variables). Rows over several joints, such
//! as tendons, are passed in the same way, each as the sum of its remaining terms.
//!
//! A link without contacts costs as much as in the recursion, and separate islands stay separate. The cost of a contact
//! depends on the links between it and the root, not on the other contacts. Trees are eliminated by minimum degree
//! ([`order`]), the links of a tree from the tips to the root.
//!
//! Agents differ in their touching links, and therefore in order and fronts. So each agent is factorized in scalar
//! arithmetic, independently of its lanes. The order and every sum depend on this agent alone.

mod assembly;
mod front;
mod numbers;
mod order;
mod plan;
mod tie;

pub(crate) use front::{factorize, solve};
pub(crate) use numbers::{JointRow, Numbers};
pub(crate) use plan::{NONE, Plan, RowTerms};
pub(crate) use tie::Tie;

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
