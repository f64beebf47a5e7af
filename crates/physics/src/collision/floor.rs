//! Contacts between moving geoms and a level plane. All lanes process the same list of points; a lane without contact
//! gets stiffness zero.

use super::slots::pyramid_share;
use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::rows::{FloorRow, former};
use crate::sim::{Sim, impedance, least_sliding};
use crate::state::{Group, Work};

/// Finds the contacts with the floor and writes their rows.
#[inline(always)]
pub(crate) fn collide_floor<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let zero = T::zero();
    let Work { motion, contacts, rows, past, stats, .. } = work;
    let (rots, places, vels) = (&motion.rot[..], &motion.pos[..], &motion.vel[..]);
    let (references, links) = (&motion.reference[..], &sim.links[..]);
    contacts.touching.fill(T::none());
    contacts.ground_contacts.fill(zero);
    // per lane, corners of the current box that are already in contact
    let mut corners = zero;
    let mut at = 0;
    for (candidate, c) in sim.contacts.floor.iter().enumerate() {
        let (rot, pos, reference) = (&rots[c.link], &places[c.link], &references[links[c.link].tree]);
        let p: V3<T> = splat3(&c.point);
        let base = pos[2] + (reference[2] - T::splat(c.height));
        let height = rot[0][2].mul_add(p[0], rot[1][2].mul_add(p[1], rot[2][2].mul_add(p[2], base)));
        let dist = height - T::splat(c.radius);
        let mut on = dist.lt(T::splat(c.soft.margin));
        if let Some((center, number)) = &c.corner {
            // MuJoCo keeps the first four corners that are below the margin and not above the center
            if *number == 0 {
                corners = zero;
            }
            let q: V3<T> = splat3(center);
            let middle = rot[0][2].mul_add(q[0], rot[1][2].mul_add(q[1], rot[2][2].mul_add(q[2], base)));
            on = T::and(on, T::not(middle.lt(height)));
            on = T::and(on, corners.lt(T::lit(3.5)));
            corners += T::masked(on, T::lit(1.0));
        }
        if !T::any(on) {
            continue;
        }
        stats.contacts += T::bits(on).count_ones() as u64;
        stats.contact_rows += 1;
        let x = rot[0][0].mul_add(p[0], rot[1][0].mul_add(p[1], rot[2][0].mul_add(p[2], pos[0])));
        let y = rot[0][1].mul_add(p[0], rot[1][1].mul_add(p[1], rot[2][1].mul_add(p[2], pos[1])));
        // the contact point lies midway between the two surfaces
        let r = [x, y, dist.mul_add(T::lit(0.5), T::splat(c.height) - reference[2])];
        let (tx, ty) = tangent(c.axis.as_ref(), rot);
        let violation = dist - T::splat(c.soft.margin);
        let (imp, mut d) = impedance(&c.soft, violation);
        let mut mu = [T::splat(c.mu[0]), T::splat(c.mu[1])];
        if let Some(factor) = group.friction() {
            // a frictionless contact is a flat pyramid, so nothing varies
            if c.mu[0] > T::scalar(0.0) {
                let factor = factor.max(T::lit(least_sliding::<T>(false)).div(mu[0]));
                d *= pyramid_share(mu[0], factor);
                mu = [mu[0] * factor, mu[1] * factor];
            }
            if let Some(weights) = group.weights() {
                d *= weights.contact([c.geom, c.plane].map(|g| sim.model.geoms[g].body));
            }
        }
        let vel = &vels[c.link];
        let v = cross_add(&ang(vel), &r, &lin(vel));
        let (v1, v2) = (v[0].mul_add(tx, v[1] * ty), v[1].mul_add(tx, -(v[0] * ty)));
        let b = T::splat(c.soft.b);
        let u0 = [v[2].mul_add(b, imp * violation * T::splat(c.soft.k)), v1 * b, v2 * b];
        let mut active = [T::none(); 4];
        let mut recalled = T::none();
        if let Some(row) = former(&past.contacts, &mut at, candidate, |row| row.candidate) {
            recalled = T::and(on, row.on);
            for k in 0..4 {
                active[k] = T::and(recalled, row.active[k]);
            }
        }
        rows.contacts.push(FloorRow {
            link: c.link,
            candidate,
            geom: c.geom,
            plane: c.plane,
            r,
            tx,
            ty,
            mu,
            d: T::masked(on, d),
            u0,
            u: u0,
            next: u0,
            force: [zero; 3],
            active,
            on,
            recalled,
        });
        contacts.touch_ground(c.geom, on);
    }
}

/// First tangent of the contact frame in the plane: the capsule's axis, else MuJoCo's choice, y.
#[inline(always)]
fn tangent<T: Real>(axis: Option<&[T::Scalar; 3]>, rot: &Rot<T>) -> (T, T) {
    let (zero, one) = (T::zero(), T::lit(1.0));
    match axis {
        None => (zero, one),
        Some(axis) => {
            let a = rotate(rot, &splat3(axis));
            let n2 = a[0].mul_add(a[0], a[1] * a[1]);
            // an upright capsule has no direction in the plane
            let ok = T::lit(1e-12).lt(n2);
            let inv = one.div(T::select(ok, n2, one).sqrt());
            (T::select(ok, a[0] * inv, one), T::select(ok, a[1] * inv, zero))
        }
    }
}
