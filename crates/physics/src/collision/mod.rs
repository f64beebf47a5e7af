//! Contacts: where geoms touch, and the rows that follow.
//!
//! Points above a level plane have their own list and their own rows ([`floor`]); every other pair of geoms is found by
//! [`narrow_phase`].

mod broad;
mod floor;
mod narrow_phase;
mod slots;

pub(crate) use floor::collide_floor;
pub(crate) use narrow_phase::collide_pairs;
