//! Moment arms of adhesion.

use crate::algebra::spatial::V6;
use crate::lanes::Real;
use crate::sim::Sim;

/// Moment arms of adhesion at the contacts of the last evaluation. Empty for models without adhesion.
#[derive(Clone, Debug)]
pub(crate) struct Adhesion<T: Real> {
    /// Force on each degree of freedom per unit of force, one actuator after the other.
    pub moments: Vec<T>,
    /// The same on each link, for one actuator.
    pub links: Vec<V6<T>>,
}

impl<T: Real> Adhesion<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let links = if sim.adhesions.is_empty() { 0 } else { sim.links.len() };
        Adhesion { moments: vec![T::zero(); sim.adhesions.len() * sim.model.nv], links: vec![[T::zero(); 6]; links] }
    }

    /// The moment arms of one actuator.
    #[inline(always)]
    pub fn of<'a>(&'a self, sim: &Sim<T>, adhesion: usize) -> &'a [T] {
        &self.moments[adhesion * sim.model.nv..][..sim.model.nv]
    }
}
