//! Contacts between geoms, and their rows.
//!
//! Points above a level plane have their own list and rows ([`floor`]). [`narrow_phase`] finds all other pairs of
//! geoms.

mod adhesion;
mod broad;
mod candidate;
mod convex;
mod floor;
mod narrow_phase;
mod obstacles;
mod slots;

pub(crate) use adhesion::adhere;
pub(crate) use floor::collide_floor;
pub(crate) use narrow_phase::collide_pairs;
