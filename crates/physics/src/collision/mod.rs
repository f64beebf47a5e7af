//! Contacts: where geoms touch, and the rows that follow.
//!
//! Points above a level plane have their own list and their own rows ([`floor`]); every other pair of geoms is found by
//! [`meet`].

mod broad;
mod floor;
mod meet;
mod slots;

pub(crate) use floor::collide_floor;
pub(crate) use meet::collide_pairs;
