//! Contact sensors: the number of matching contacts, and their total force.

use super::Readings;
use super::forces::ContactForce;
use super::rays::inside_shape;
use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::model::{Sensor, SensorObject};

/// Fields of the sensor, as bits: number of contacts, force, torque, distance, position, normal, tangent.
const FOUND: i32 = 1;
const KNOWN: i32 = 127;
const SIZES: [usize; 7] = [1, 3, 3, 1, 3, 3, 3];
/// The reduction that sums all contacts.
const NET_FORCE: i32 = 3;

impl<T: Real> Readings<'_, T> {
    /// Value of a contact sensor. `None` unless it only counts contacts or sums them: the order of several contacts
    /// differs from MuJoCo's.
    #[inline(always)]
    pub(super) fn contact_value(&self, s: &Sensor) -> Option<Vec<T>> {
        let [mask, reduce, _] = s.intprm;
        if mask & !KNOWN != 0 || (reduce != NET_FORCE && mask != FOUND) {
            return None;
        }
        let (z, one) = (T::zero(), T::lit(1.0));
        let mut found = z;
        let mut matches = Vec::new();
        for c in self.contact_forces() {
            let (on, flip) = self.contact_match(&c, s.object, s.reference);
            found += T::masked(on, one);
            matches.push((c, on, flip));
        }
        let mut out = vec![z; s.dim];
        if reduce != NET_FORCE {
            // every slot of a contact has their number
            for (slot, x) in out.iter_mut().enumerate() {
                *x = T::masked(T::lit(slot as f64).lt(found), found);
            }
            return Some(out);
        }

        // the position is the mean of all positions, weighted by the forces
        let (mut weight, mut place) = (z, [z; 3]);
        for (c, on, _) in &matches {
            let w = T::masked(*on, dot(&c.force, &c.force).sqrt());
            let at = add3(&c.point, &self.work.motion.reference[c.tree]);
            weight += w;
            for k in 0..3 {
                place[k] = at[k].mul_add(w, place[k]);
            }
        }
        let inverse = weight.max(T::lit(1e-15)).recip();
        let place = [place[0] * inverse, place[1] * inverse, place[2] * inverse];
        let (mut force, mut torque) = ([z; 3], [z; 3]);
        for (c, on, flip) in &matches {
            let arm = sub3(&add3(&c.point, &self.work.motion.reference[c.tree]), &place);
            let t = cross_add(&arm, &c.force, &c.torque);
            for k in 0..3 {
                let (f, t) = (T::masked(*on, c.force[k]), T::masked(*on, t[k]));
                force[k] += if *flip { -f } else { f };
                torque[k] += if *flip { -t } else { t };
            }
        }
        let any = T::masked(z.lt(found), one);
        let fields: [&[T]; 7] = [&[found], &force, &torque, &[z], &place, &[any, z, z], &[z, any, z]];
        let mut at = 0;
        for (i, field) in fields.iter().enumerate() {
            if mask & (1 << i) != 0 {
                out[at..at + SIZES[i]].copy_from_slice(field);
                at += SIZES[i];
            }
        }
        Some(out)
    }

    /// Lanes in which a contact matches the objects of a sensor, and whether its force on the second geom must be
    /// negated.
    #[inline(always)]
    fn contact_match(&self, c: &ContactForce<T>, a: SensorObject, b: SensorObject) -> (T::Mask, bool) {
        let none = SensorObject::None;
        // in MuJoCo's order
        let [first, second] = if c.natural { c.geoms } else { [c.geoms[1], c.geoms[0]] };
        let (a1, a2) = (self.takes_part(first, a), self.takes_part(second, a));
        let (b1, b2) = (self.takes_part(first, b), self.takes_part(second, b));
        let reversed = match (a != none, b != none) {
            (true, true) if a1 && b2 => false,
            (true, true) if a2 && b1 => true,
            (true, true) => return (T::none(), false),
            (true, false) if a1 || a2 => !a1,
            (false, true) if b1 || b2 => !b2,
            (false, false) => false,
            _ => return (T::none(), false),
        };
        let mut on = c.on;
        if let SensorObject::Site(site) = a {
            let (zone, mount) = (&self.sim.model.sites[site], &self.sim.sites[site]);
            let p = into_axes(&self.work.motion.axes(mount), &self.arm_from(mount, Some(c.tree), &c.point));
            on = T::and(on, inside_shape(zone.kind, &zone.size, &p));
        }
        (on, reversed == c.natural)
    }

    /// Whether a geom belongs to an object of a contact sensor.
    #[inline(always)]
    fn takes_part(&self, geom: usize, object: SensorObject) -> bool {
        let bodies = &self.sim.model.bodies;
        let mut body = self.sim.model.geoms[geom].body;
        match object {
            SensorObject::Geom(g) => g == geom,
            SensorObject::Body(b) => b == body,
            SensorObject::XBody(b) => {
                while body > b {
                    body = bodies[body].parent;
                }
                body == b
            }
            _ => true,
        }
    }
}
