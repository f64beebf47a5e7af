//! Forces of adhesion: actuators that pull a body along the normals of its contacts.

use crate::algebra::spatial::*;
use crate::dynamics::joint_space;
use crate::lanes::{Real, kernel_fn};
use crate::rows::{Jacobian, Source};
use crate::sim::{AdhesionSpec, Sim};
use crate::state::Work;

kernel_fn! {
    /// Finds the moment arms of adhesion at the contacts, and adds its forces to those of the joints.
    pub(crate) fn adhere<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>) {
        for (i, spec) in sim.adhesions.iter().enumerate() {
            let share = pull(sim, work, spec);
            let Work { adhesion, dofs, forces, .. } = work;
            let moments = &mut adhesion.moments[i * sim.model.nv..][..sim.model.nv];
            moments.fill(T::zero());
            joint_space(sim, dofs, &mut adhesion.links, moments);
            let force = forces.actuator_force[spec.actuator];
            for (sum, arm) in forces.qfrc_passive_actuator.iter_mut().zip(moments) {
                *arm *= share;
                *sum = force.mul_add(*arm, *sum);
            }
        }
    }
}

/// Adds unit forces against the normals of the body's contacts, on links. Returns the inverse of their number.
#[inline(always)]
fn pull<T: Real>(sim: &Sim<T>, work: &mut Work<T>, spec: &AdhesionSpec) -> T {
    let (zero, one) = (T::zero(), T::lit(1.0));
    let Work { adhesion, rows, .. } = work;
    adhesion.links.fill([zero; 6]);
    let mut count = zero;
    for row in rows.contacts.iter().filter(|row| spec.geoms[row.geom] || spec.geoms[row.plane]) {
        count += T::masked(row.on, one);
        let w = row.wrench(&[-one, zero, zero]);
        for i in 0..6 {
            adhesion.links[row.link][i] += T::masked(row.on, w[i]);
        }
    }
    for block in rows.blocks.iter().filter(|b| b.source == Source::Contacts) {
        let Jacobian::Points { sides, lin, .. } = &block.jacobian else { continue };
        let mut on = T::none();
        for (index, lanes) in &block.members {
            if sim.contacts.pairs[*index].geoms.iter().any(|g| spec.geoms[*g as usize]) {
                on = T::or(on, *lanes);
            }
        }
        if !T::any(on) {
            continue;
        }
        count += T::masked(on, one);
        let normal = lin[0];
        for (s, side) in sides.iter().enumerate() {
            // the normal points to the second side
            let force = if s == 0 { normal } else { neg3(&normal) };
            let turn = cross(&side.r, &force);
            let w = [turn[0], turn[1], turn[2], force[0], force[1], force[2]];
            for (link, lanes) in &side.links {
                let here = T::and(on, *lanes);
                for i in 0..6 {
                    adhesion.links[*link][i] += T::masked(here, w[i]);
                }
            }
        }
    }
    one.div(count.max(one))
}
