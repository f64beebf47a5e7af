//! Drives: transmissions of actuators whose moment arms depend on the pose. They are sites and slider-cranks.

use super::link::Mount;
use super::string::{Lever, Mounts, Spot, levers};
use crate::lanes::Real;
use crate::model::{Actuator, Model, Transmission};
use std::ops::Range;

/// A transmission between two bodies.
#[derive(Clone, Debug)]
pub(crate) struct DriveSpec<C> {
    /// Index of the actuator.
    pub actuator: usize,
    pub kind: DriveKind<C>,
    /// The second end takes the force, the first one its opposite. The first end of a site without a reference stands
    /// still.
    pub ends: [Spot<C>; 2],
    /// Degrees of freedom that move one end and not the other, and the place of their moment arms among
    /// those of all drives.
    pub dofs: Vec<usize>,
    pub moments: Range<usize>,
    pub levers: Vec<Lever>,
}

/// The loads of a drive at its ends.
#[derive(Clone, Debug)]
pub(crate) enum DriveKind<C> {
    /// Force and torque along the axes of the second end.
    Site { force: [C; 3], torque: [C; 3] },
    /// Force and torque along the axes of the first end.
    Between { force: [C; 3], torque: [C; 3], turns: bool },
    /// A slider on the z axis of the first end, with a rod to the second.
    Crank { rod: C, gear: C },
}

/// The actuators with a drive and their indices, in the order of the drives.
pub(super) fn actuators(model: &Model) -> impl Iterator<Item = (usize, &Actuator)> {
    model.actuators.iter().enumerate().filter(|(_, a)| a.sites().is_some())
}

/// Prepares the drives.
pub(super) fn drives<T: Real>(model: &Model, mounts: &Mounts<T::Scalar>) -> Vec<DriveSpec<T::Scalar>> {
    let c = T::scalar;
    let (zero, one) = (c(0.0), c(1.0));
    let axes = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let still = Spot { mount: Mount { link: None, mocap: None, pos: [zero; 3], rot: axes }, tree: None };
    let mut count = 0;
    let mut out = Vec::new();
    for (actuator, a) in actuators(model) {
        let Some((first, second)) = a.sites() else { continue };
        let bodies = [first.map_or(0, |s| model.sites[s].body), model.sites[second].body];
        let mut dofs = model.dofs_between(bodies).concat();
        dofs.sort_unstable();
        let moments = count..count + dofs.len();
        count = moments.end;
        let [x, y, z, rx, ry, rz] = a.gear.map(c);
        let (force, torque) = ([x, y, z], [rx, ry, rz]);
        let kind = match a.transmission {
            Transmission::SliderCrank { rod, .. } => DriveKind::Crank { rod: c(rod), gear: x },
            _ if first.is_none() => DriveKind::Site { force, torque },
            _ => DriveKind::Between { force, torque, turns: a.gear[3..] != [0.0; 3] },
        };
        let spot = |site: usize| Spot::new(&mounts.sites[site], mounts.trees);
        let ends = [first.map_or_else(|| still.clone(), spot), spot(second)];
        out.push(DriveSpec { actuator, kind, ends, levers: levers(model, &dofs, bodies), dofs, moments });
    }
    out
}
