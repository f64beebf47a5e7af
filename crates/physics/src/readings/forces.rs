//! Forces between bodies at the last physics step: contacts, and the force from a body's parent.

use super::Readings;
use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::model::EqualityKind;
use crate::rows::FloorRow;
use crate::rows::{Block, Jacobian, Source};
use crate::sim::Mount;

/// A contact in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactReading {
    /// Geoms, in the order of the model.
    pub geoms: [usize; 2],
    /// Place of the contact, m.
    pub pos: [f64; 3],
    /// Direction from the first geom to the second.
    pub normal: [f64; 3],
    /// Force on the second geom, N.
    pub force: [f64; 3],
    /// Torque on it about the contact, N m: from contacts that resist twisting or rolling.
    pub torque: [f64; 3],
}

/// A contact in some lanes.
pub(super) struct ContactForce<T: Real> {
    /// The force acts on the second geom, its opposite on the first.
    pub geoms: [usize; 2],
    /// Whether the order of the geoms is MuJoCo's.
    pub natural: bool,
    /// Lanes that have this contact.
    pub on: T::Mask,
    /// The contact point, relative to the reference point of a tree.
    pub tree: usize,
    pub point: V3<T>,
    /// Direction towards the second geom.
    pub normal: V3<T>,
    /// Force along the normal, the full force in world axes, and the torque about the contact point.
    pub push: T,
    pub force: V3<T>,
    pub torque: V3<T>,
}

/// Force of a connect or weld constraint.
pub(super) struct TieForce<T: Real> {
    /// The force acts on the second body, its opposite on the first, each at its own point.
    pub bodies: [usize; 2],
    pub points: [Mount<T::Scalar>; 2],
    pub force: V3<T>,
    pub torque: V3<T>,
}

/// A sum of forces, with their torque about one point.
pub(super) struct Wrench<T> {
    pub force: V3<T>,
    pub torque: V3<T>,
}

impl<T: Real> Wrench<T> {
    /// Adds a force at the offset `arm` from the point, and a torque, in the lanes `on`.
    #[inline(always)]
    pub fn add(&mut self, arm: &V3<T>, force: &V3<T>, torque: &V3<T>, on: T::Mask) {
        let t = cross_add(arm, force, torque);
        for k in 0..3 {
            self.force[k] += T::masked(on, force[k]);
            self.torque[k] += T::masked(on, t[k]);
        }
    }

    /// Subtracts such a force.
    #[inline(always)]
    pub fn subtract(&mut self, arm: &V3<T>, force: &V3<T>, torque: &V3<T>, on: T::Mask) {
        let (f, t) = ([-force[0], -force[1], -force[2]], [-torque[0], -torque[1], -torque[2]]);
        self.add(arm, &f, &t, on);
    }
}

impl<T: Real> Readings<'_, T> {
    /// All contacts of the last physics step.
    #[inline(always)]
    pub(super) fn contact_forces(&self) -> Vec<ContactForce<T>> {
        let mut out = Vec::new();
        for row in &self.work.rows.contacts {
            out.push(self.floor_contact(row));
        }
        for block in self.work.rows.blocks.iter().filter(|b| b.source == Source::Contacts) {
            for (index, on) in &block.members {
                out.extend(self.pair_contact(block, *index, *on));
            }
        }
        out
    }

    /// The contacts of one lane, in world axes and MuJoCo's order of the geoms.
    pub(crate) fn contacts(&self, lane: usize) -> Vec<ContactReading> {
        let get = |v: &V3<T>| v.map(|x| T::widen(x.get(lane)));
        let has = |c: &ContactForce<T>| T::bits(c.on) >> lane & 1 == 1;
        let read = |c: ContactForce<T>| {
            let pos = get(&add3(&c.point, &self.work.motion.reference[c.tree]));
            let (normal, force, torque) = (get(&c.normal), get(&c.force), get(&c.torque));
            if c.natural {
                return ContactReading { geoms: c.geoms, pos, normal, force, torque };
            }
            let [normal, force, torque] = [normal, force, torque].map(|v| v.map(|x| -x));
            ContactReading { geoms: [c.geoms[1], c.geoms[0]], pos, normal, force, torque }
        };
        self.contact_forces().into_iter().filter(has).map(read).collect()
    }

    /// A contact with a level floor.
    #[inline(always)]
    pub(super) fn floor_contact(&self, row: &FloorRow<T>) -> ContactForce<T> {
        let (z, one) = (T::zero(), T::lit(1.0));
        ContactForce {
            geoms: [row.plane, row.geom],
            natural: true,
            on: row.on,
            tree: self.sim.links[row.link].tree,
            point: row.r,
            normal: [z, z, one],
            push: row.force[0],
            force: lin(&row.wrench(&row.force)),
            torque: [z; 3],
        }
    }

    /// A contact of a pair of geoms in a block, in the lanes `on`.
    #[inline(always)]
    pub(super) fn pair_contact(&self, block: &Block<T>, index: usize, on: T::Mask) -> Option<ContactForce<T>> {
        let Jacobian::Points { sides, lin: frame, .. } = &block.jacobian else { return None };
        let pair = &self.sim.contacts.pair(&self.sim.geoms, index);
        // the second side of a block moves
        let second = pair.moving();
        let first = if pair.geoms[0] == second { pair.geoms[1] } else { pair.geoms[0] };
        let link = self.sim.geoms[second].link?;
        let wrench = block.total_wrench(&block.force, &[T::zero(); 3]);
        Some(ContactForce {
            geoms: [first, second],
            natural: second == pair.geoms[1],
            on,
            tree: self.sim.links[link].tree,
            point: sides[1].r,
            normal: frame[0],
            push: block.force[0],
            force: lin(&wrench),
            torque: ang(&wrench),
        })
    }

    /// All connect and weld constraints of the last physics step.
    #[inline(always)]
    pub(super) fn tie_forces(&self) -> Vec<TieForce<T>> {
        let mut out = Vec::new();
        for block in self.work.rows.blocks.iter() {
            let Source::Equality(index) = block.source else { continue };
            let (EqualityKind::Connect { bodies, anchors, .. } | EqualityKind::Weld { bodies, anchors, .. }) =
                &self.sim.model.equalities[index].kind
            else {
                continue;
            };
            let at = |i: usize| {
                let body = &self.sim.bodies[bodies[i]];
                let pos = rotate_add(&body.rot, &anchors[i].map(T::scalar), &body.pos);
                Mount { link: body.link, mocap: body.mocap, pos, rot: body.rot }
            };
            let wrench = block.total_wrench(&block.force, &[T::zero(); 3]);
            // the second side of a block moves
            let second = usize::from(self.sim.bodies[bodies[0]].link.is_none());
            let first = 1 - second;
            out.push(TieForce {
                bodies: [bodies[first], bodies[second]],
                points: [at(first), at(second)],
                force: lin(&wrench),
                torque: ang(&wrench),
            });
        }
        out
    }

    /// Force and torque on a site's body from its parent, about the site and in its axes (MuJoCo's `cfrc_int`). They
    /// are what the motion of the body and all bodies below it needs, minus the forces of contacts, connect and weld
    /// constraints, spatial tendons and pushes. `None` for sites of the world, which has no parent.
    #[inline(always)]
    pub(super) fn interaction(&self, site: usize) -> Option<(V3<T>, V3<T>)> {
        let m = &self.sim.model;
        let (mount, body) = (&self.sim.sites[site], m.sites[site].body);
        if body == 0 {
            return None;
        }
        let inside = self.subtree_of(body);
        let all = T::not(T::none());
        let mut sum = Wrench { force: [T::zero(); 3], torque: [T::zero(); 3] };
        for b in (body..m.bodies.len()).filter(|b| inside[*b]) {
            let (force, torque) = self.inertial_force(b);
            let arm = self.separation(mount, &self.sim.coms[b]);
            sum.add(&arm, &force, &torque, all);
            if let Some(push) = self.group.xfrc_applied.get(b) {
                sum.subtract(&arm, &lin(push), &ang(push), all);
            }
        }
        for c in self.contact_forces() {
            let arm = self.arm_from(mount, Some(c.tree), &c.point);
            match c.geoms.map(|g| inside[m.geoms[g].body]) {
                [true, false] => sum.add(&arm, &c.force, &c.torque, c.on),
                [false, true] => sum.subtract(&arm, &c.force, &c.torque, c.on),
                _ => {}
            }
        }
        for t in self.tie_forces() {
            let [first, second] = t.bodies.map(|b| inside[b]);
            if first {
                sum.add(&self.separation(mount, &t.points[0]), &t.force, &t.torque, all);
            }
            if second {
                sum.subtract(&self.separation(mount, &t.points[1]), &t.force, &t.torque, all);
            }
        }
        for s in self.string_forces() {
            let [first, second] = s.bodies.map(|b| inside[b]);
            let arm = |i: usize| self.arm_from(mount, s.trees[i], &s.points[i]);
            if first {
                sum.add(&arm(0), &s.force, &[T::zero(); 3], s.on);
            }
            if second {
                sum.subtract(&arm(1), &s.force, &[T::zero(); 3], s.on);
            }
        }
        let axes = self.work.motion.axes(mount);
        Some((into_axes(&axes, &sum.force), into_axes(&axes, &sum.torque)))
    }

    /// Force at the center of mass, and torque about it, that a body's motion and weight need.
    #[inline(always)]
    fn inertial_force(&self, body: usize) -> (V3<T>, V3<T>) {
        let com = &self.sim.coms[body];
        let (a, turn) = self.mount_acceleration(com);
        let mass = self.own_mass(body);
        // Euler's equations in the principal axes
        let axes = self.work.motion.axes(com);
        let (w, dw) = (into_axes(&axes, &self.mount_spin(com)), into_axes(&axes, &turn));
        let i = self.own_inertia(body);
        let torque = [
            i[0].mul_add(dw[0], (i[2] - i[1]) * w[1] * w[2]),
            i[1].mul_add(dw[1], (i[0] - i[2]) * w[2] * w[0]),
            i[2].mul_add(dw[2], (i[1] - i[0]) * w[0] * w[1]),
        ];
        ([a[0] * mass, a[1] * mass, a[2] * mass], rotate(&axes, &torque))
    }

    /// Whether each body belongs to a body's subtree.
    #[inline(always)]
    pub(super) fn subtree_of(&self, body: usize) -> Vec<bool> {
        let bodies = &self.sim.model.bodies;
        let mut inside = vec![false; bodies.len()];
        for (b, one) in bodies.iter().enumerate() {
            inside[b] = b == body || (b > 0 && inside[one.parent]);
        }
        inside
    }

    /// A body's angular momentum about its own center of mass.
    #[inline(always)]
    pub(super) fn spin_momentum(&self, body: usize) -> V3<T> {
        let com: &Mount<T::Scalar> = &self.sim.coms[body];
        let axes = self.work.motion.axes(com);
        let w = into_axes(&axes, &self.mount_spin(com));
        let i = self.own_inertia(body);
        rotate(&axes, &[i[0] * w[0], i[1] * w[1], i[2] * w[2]])
    }
}
