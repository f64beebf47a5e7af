//! Positions of geoms, and their contacts.

use crate::geometry::field_capsule::Gaps;
use crate::geometry::{Touch, Touches, convex};
use crate::lanes::Real;
use crate::sim::Sim;
use crate::state::clearance::GeomPlaces;
use crate::state::sweep::Sweep;

/// Positions of geoms, and their contacts.
#[derive(Clone, Debug)]
pub(crate) struct GeomContacts<T: Real> {
    /// Per geom: lanes that touch the static world at the last physics step, and at any step of the last `step` call.
    pub touching: Vec<T::Mask>,
    pub touched: Vec<T::Mask>,
    /// Per geom: number of contacts with the static world, and their normal force, N, at the last physics step.
    pub ground_contacts: Vec<T>,
    pub normal_force: Vec<T>,
    /// Per geom: lanes that touch another moving geom at the last physics step.
    pub touching_bodies: Vec<T::Mask>,
    /// Places of the geoms in pairs, of the group that is evaluated.
    pub places: GeomPlaces<T>,
    /// Pairs that may touch, if the broad phase is used.
    pub sweep: Sweep<T::Scalar>,
    /// Contacts of one pair of geoms, and of one lane of them.
    pub touches: Vec<Touch<T>>,
    pub lane_touches: Touches<T::Scalar>,
    /// Contacts and gaps between the height field of an obstacle and a geom of one lane.
    pub lane_found: Vec<Touch<T::Scalar>>,
    pub lane_gaps: Gaps<T::Scalar>,
    /// Memory of the searches between convex shapes.
    pub convex: convex::Scratch<T::Scalar>,
    /// Gaps between one pair of a height field and another geom.
    pub gaps: Gaps<T>,
}

impl<T: Real> GeomContacts<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        GeomContacts {
            touching: vec![T::none(); sim.geoms.len()],
            touched: vec![T::none(); sim.geoms.len()],
            ground_contacts: vec![z; sim.geoms.len()],
            normal_force: vec![z; sim.geoms.len()],
            touching_bodies: vec![T::none(); sim.geoms.len()],
            places: GeomPlaces::new(sim),
            sweep: Sweep::new(if sim.contacts.broad.is_some() { sim.geoms.len() } else { 0 }),
            touches: Vec::new(),
            lane_touches: Touches::new(),
            lane_found: Vec::new(),
            lane_gaps: Gaps::new(),
            convex: convex::Scratch::new(),
            gaps: Gaps::new(),
        }
    }

    /// Marks a geom as touching the static world in the lanes `on`.
    #[inline(always)]
    pub fn touch_ground(&mut self, geom: usize, on: T::Mask) {
        self.touching[geom] = T::or(self.touching[geom], on);
        self.touched[geom] = T::or(self.touched[geom], on);
        self.ground_contacts[geom] += T::masked(on, T::lit(1.0));
    }
}
