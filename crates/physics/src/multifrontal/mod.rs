//! A sparse factorization for one agent whose links touch each other in many places.
//!
//! It generalizes the articulated-body recursion. The recursion eliminates the joints of a link and hands a 6x6 matrix
//! over the parent's spatial acceleration to the parent. Here the matrix of a link, its *front*, also covers the
//! accelerations of the links that touch it. Those accelerations are carried inward unchanged until the elimination
//! reaches their links (Duff and Reid's multifrontal method, with links as variables). Rows over several joints, such as
//! tendons, are carried in the same way, each as the sum of its terms that are still to come.
//!
//! A link that touches nothing costs as much as in the recursion, and separate islands never meet. The cost of a contact
//! depends on the links between it and the root, not on the other contacts. Trees are eliminated by minimum degree
//! ([`order`]), the links of a tree from the tips to the root.
//!
//! Agents differ in which of their links touch, and therefore in order and fronts. So an agent is factorized in scalar
//! arithmetic, whatever lanes it shares. The order and every sum depend on this agent alone.

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
