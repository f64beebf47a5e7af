//! Contacts between moving geoms and a level plane.
//!
//! A moving geom meets a plane in points that are known in advance: a sphere in one, a capsule in two, a box in its
//! corners. Each is a [`Candidate`]; all lanes walk the same list, and a lane that does not touch gets stiffness zero.

use super::Contacts;
use super::params::ContactParams;
use super::slots::pyramid_share;
use crate::lanes::Real;
use crate::model::{Cone, GeomType, Model};
use crate::rigid::{self, BodyMount, quat_to_rot};
use crate::sim::Sim;
use crate::solver::floor::FloorRow;
use crate::solver::softness::{Softness, impedance, softness};
use crate::spatial::*;
use crate::work::{Group, Work, former};

/// A point of a moving geom that may touch a level plane.
#[derive(Clone, Debug)]
pub(crate) struct Candidate<C> {
    pub link: usize,
    /// Geom index in the model.
    pub geom: usize,
    /// Geom of the plane.
    pub plane: usize,
    /// Center of the sphere that touches (radius 0 for a box corner), in the link's frame.
    pub point: [C; 3],
    pub radius: C,
    /// Capsule axis in the link's frame: the first tangent is its projection.
    pub axis: Option<[C; 3]>,
    /// Center of the box that this is a corner of, and the number of the corner among its eight.
    pub corner: Option<([C; 3], usize)>,
    /// Height of the plane.
    pub height: C,
    /// Friction along the two tangents; zero for a frictionless contact.
    pub mu: [C; 2],
    pub soft: Softness<C>,
}

/// Adds the points of a moving geom that may touch a level plane. Returns whether this file can do it: pyramidal cones
/// of condim 1 or 3, spheres, capsules and boxes.
pub(super) fn add<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    (fixed, geom): (usize, usize),
    link: Option<usize>,
    params: &ContactParams,
    contacts: &mut Contacts<T::Scalar>,
) -> bool {
    let (plane_geom, fixed, moving) = (fixed, &model.geoms[fixed], &model.geoms[geom]);
    let Some(link) = link else { return false };
    let pyramid = params.condim == 1 || (params.condim == 3 && model.opt.cone == Cone::Pyramidal);
    let shape = matches!(moving.kind, GeomType::Sphere | GeomType::Capsule | GeomType::Box);
    if fixed.kind != GeomType::Plane || mounts[fixed.body].body != 0 || !pyramid || !shape {
        return false;
    }
    let mount = &mounts[fixed.body];
    let plane = rigid::compose(&(mount.pos, mount.rot), &(fixed.pos, quat_to_rot(&fixed.quat)));
    if plane.1[2][2] < 1.0 - 1e-12 {
        return false;
    }

    let mu = if params.condim == 1 { [0.0; 2] } else { [params.friction[0], params.friction[1]] };
    let [invweight, _] = rigid::inverse_weights(model, mounts, [moving.body, fixed.body]);
    // pyramid edges share R = 2 mu^2 (1 + mu^2) / invweight-scaled impedance (MuJoCo's mj_makeImpedance)
    let diag = if params.condim == 1 {
        // four coinciding edges of a flat pyramid carry a quarter each
        4.0 * invweight
    } else {
        2.0 * mu[0] * mu[0] / model.opt.impratio * invweight * (1.0 + mu[0] * mu[0])
    };
    contacts.hard |= rigid::is_hard(model, mounts, [moving.body, fixed.body], diag);
    let out = &mut contacts.floor;
    let soft = softness::<T>(model, &params.solref, &params.solimp, params.margin, diag);

    let on_link = &mounts[moving.body];
    let frame = rigid::compose(&(on_link.pos, on_link.rot), &(moving.pos, quat_to_rot(&moving.quat)));
    let c3 = |v: [f64; 3]| [T::scalar(v[0]), T::scalar(v[1]), T::scalar(v[2])];
    let base = Candidate {
        link,
        geom,
        plane: plane_geom,
        point: c3(frame.0),
        radius: T::scalar(moving.size[0]),
        axis: None,
        corner: None,
        height: T::scalar(plane.0[2]),
        mu: mu.map(T::scalar),
        soft,
    };
    match moving.kind {
        GeomType::Sphere => out.push(base),
        GeomType::Capsule => {
            let axis = frame.1[2];
            for side in [1.0, -1.0] {
                let h = side * moving.size[1];
                let point = [frame.0[0] + h * axis[0], frame.0[1] + h * axis[1], frame.0[2] + h * axis[2]];
                out.push(Candidate { point: c3(point), axis: Some(c3(axis)), ..base.clone() });
            }
        }
        GeomType::Box => {
            for i in 0..8 {
                let sign = |bit: usize, x: f64| if i & bit != 0 { x } else { -x };
                let local = [sign(1, moving.size[0]), sign(2, moving.size[1]), sign(4, moving.size[2])];
                let at = rigid::rotate(&frame.1, &local);
                let point = [frame.0[0] + at[0], frame.0[1] + at[1], frame.0[2] + at[2]];
                out.push(Candidate {
                    point: c3(point),
                    radius: T::scalar(0.0),
                    corner: Some((c3(frame.0), i)),
                    ..base.clone()
                });
            }
        }
        _ => unreachable!("other shapes were sent away above"),
    }
    true
}

/// Finds the contacts with the floor and writes their rows.
#[inline(always)]
pub(crate) fn collide_floor<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let zero = T::zero();
    work.touching.fill(T::none());
    work.ground_contacts.fill(zero);
    // corners of the present box that are already in contact, per lane
    let mut corners = zero;
    let mut past = 0;
    for (candidate, c) in sim.contacts.floor.iter().enumerate() {
        let tree = sim.links[c.link].tree;
        let (rot, pos, reference) = (&work.rot[c.link], &work.pos[c.link], &work.reference[tree]);
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
        work.stats.contacts += T::bits(on).count_ones() as u64;
        work.stats.contact_rows += 1;
        let x = rot[0][0].mul_add(p[0], rot[1][0].mul_add(p[1], rot[2][0].mul_add(p[2], pos[0])));
        let y = rot[0][1].mul_add(p[0], rot[1][1].mul_add(p[1], rot[2][1].mul_add(p[2], pos[1])));
        // the contact point lies midway between the two surfaces
        let r = [x, y, dist.mul_add(T::lit(0.5), T::splat(c.height) - reference[2])];
        let (tx, ty) = tangent(c.axis.as_ref(), rot);
        let violation = dist - T::splat(c.soft.margin);
        let (imp, mut d) = impedance(&c.soft, violation);
        let mut mu = [T::splat(c.mu[0]), T::splat(c.mu[1])];
        if let Some(factor) = group.friction() {
            // a frictionless contact is a flat pyramid and has nothing to vary
            if c.mu[0] > T::scalar(0.0) {
                d *= pyramid_share(mu[0], factor);
            }
            mu = [mu[0] * factor, mu[1] * factor];
        }
        let vel = &work.vel[c.link];
        let v = cross_add(&ang(vel), &r, &lin(vel));
        let (v1, v2) = (v[0].mul_add(tx, v[1] * ty), v[1].mul_add(tx, -(v[0] * ty)));
        let b = T::splat(c.soft.b);
        let u0 = [v[2].mul_add(b, imp * violation * T::splat(c.soft.k)), v1 * b, v2 * b];
        let mut active = [T::none(); 4];
        let mut recalled = T::none();
        if let Some(row) = former(&work.past.contacts, &mut past, candidate, |row| row.candidate) {
            recalled = T::and(on, row.on);
            for k in 0..4 {
                active[k] = T::and(recalled, row.active[k]);
            }
        }
        work.contacts.push(FloorRow {
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
        work.touch_ground(c.geom, on);
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
