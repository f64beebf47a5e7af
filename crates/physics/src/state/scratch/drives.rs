//! Measures of the drives: transmissions through sites.

use crate::lanes::Real;
use crate::sim::Sim;

/// Measures of the drives for some positions and velocities of the bodies, gears included.
#[derive(Clone, Debug)]
pub(crate) struct Drives<T: Real> {
    pub length: Vec<T>,
    pub velocity: Vec<T>,
    /// Moment arms, one drive after the other: forces on the degrees of freedom per unit of the actuator's force.
    pub moments: Vec<T>,
}

impl<T: Real> Drives<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        Drives {
            length: vec![z; sim.drives.len()],
            velocity: vec![z; sim.drives.len()],
            moments: vec![z; sim.drives.iter().map(|d| d.dofs.len()).sum()],
        }
    }

    /// Takes the measures of others over.
    #[inline(always)]
    pub fn copy_from(&mut self, other: &Drives<T>) {
        self.length.copy_from_slice(&other.length);
        self.velocity.copy_from_slice(&other.velocity);
        self.moments.copy_from_slice(&other.moments);
    }

    /// The degrees of freedom of a drive and their moment arms.
    #[inline(always)]
    pub fn arms<'a>(&'a self, sim: &'a Sim<T>, drive: usize) -> impl Iterator<Item = (usize, T)> + 'a {
        let drive = &sim.drives[drive];
        drive.dofs.iter().copied().zip(self.moments[drive.moments.clone()].iter().copied())
    }
}
