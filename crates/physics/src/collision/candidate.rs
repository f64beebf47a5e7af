//! Pairs of geoms that are near, and the contacts found for them.

use super::slots::{Place, Slots, write_contact};
use crate::algebra::spatial::*;
use crate::geometry::{Touch, Touches};
use crate::lanes::Real;
use crate::sim::Sim;
use crate::state::{Group, Work};

/// A pair that is near in some lanes.
pub(super) struct Candidate<T: Real> {
    pub place: Place,
    /// Centers of the geoms, relative to the place's reference point.
    pub centers: [V3<T>; 2],
    pub near: T::Mask,
}

/// Writes the contacts that a pair has in some lanes.
#[inline(always)]
pub(super) fn add_all<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &mut Work<T>,
    slots: &mut Slots<T>,
    place: Place,
    found: &[Touch<T>],
) {
    for touch in found {
        if T::any(touch.on) {
            write_contact(sim, group, work, slots, place, touch);
        }
    }
}

/// Copies one lane's contacts into that lane of `found`.
#[inline(always)]
pub(super) fn gather<T: Real>(touches: &Touches<T::Scalar>, lane: usize, found: &mut Vec<Touch<T>>) {
    for (k, t) in touches.as_slice().iter().enumerate() {
        if k == found.len() {
            found.push(Touch::none());
        }
        let touch = &mut found[k];
        touch.on = T::or(touch.on, T::from_bits(1 << lane));
        touch.dist.set(lane, t.dist);
        for i in 0..3 {
            touch.pos[i].set(lane, t.pos[i]);
            touch.normal[i].set(lane, t.normal[i]);
            touch.tangent[i].set(lane, t.tangent[i]);
        }
    }
}
