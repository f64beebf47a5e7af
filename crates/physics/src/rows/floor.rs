//! Contacts with a level plane with a pyramidal cone: the fast path, and the common case in walking.
//!
//! The plane is static, so the contact only adds a symmetric 6x6 matrix to its own link.

use super::row::{NewtonStep, Row, replace};
use crate::algebra::planar::Space;
use crate::algebra::spatial::*;
use crate::lanes::Real;

/// A contact with the floor: a pyramid of four edges. Vectors are along (normal, tangent 1, tangent 2).
#[derive(Clone, Copy, Debug)]
pub(crate) struct FloorRow<T: Real> {
    pub link: usize,
    /// Index of the candidate point.
    pub candidate: usize,
    pub geom: usize,
    /// Geom of the plane.
    pub plane: usize,
    /// Contact point relative to the tree's reference point.
    pub r: V3<T>,
    /// First tangent in the plane.
    pub tx: T,
    pub ty: T,
    pub mu: [T; 2],
    /// Stiffness of an edge, 0 in lanes without this contact.
    pub d: T,
    /// Negative reference acceleration.
    pub u0: V3<T>,
    /// `J a - aref` at the current point and at the Newton point.
    pub u: V3<T>,
    pub next: V3<T>,
    /// Force at the current point in the sense of the solver's first identity.
    pub force: V3<T>,
    /// Edges that push.
    pub active: [T::Mask; 4],
    pub on: T::Mask,
    /// Lanes whose active edges come from the previous evaluation.
    pub recalled: T::Mask,
}

impl<T: Real> FloorRow<T> {
    /// Row values of a motion of the link.
    #[inline(always)]
    pub fn of_motion(&self, w: &V6<T>) -> V3<T> {
        let v = cross_add(&ang(w), &self.r, &lin(w));
        [v[2], v[0].mul_add(self.tx, v[1] * self.ty), v[1].mul_add(self.tx, -(v[0] * self.ty))]
    }

    /// Values along the four edges of the pyramid.
    #[inline(always)]
    pub fn edges(&self, u: &V3<T>) -> [T; 4] {
        let (m1, m2) = (self.mu[0], self.mu[1]);
        [m1.mul_add(u[1], u[0]), m1.neg_mul_add(u[1], u[0]), m2.mul_add(u[2], u[0]), m2.neg_mul_add(u[2], u[0])]
    }

    /// Total of forces along the edges.
    #[inline(always)]
    fn total(&self, f: &[T; 4]) -> V3<T> {
        let (m1, m2) = (self.mu[0], self.mu[1]);
        [(f[0] + f[1]) + (f[2] + f[3]), m1 * (f[0] - f[1]), m2 * (f[2] - f[3])]
    }

    /// Force of the row's linear model with the current active set, at `u`.
    #[inline(always)]
    pub fn linear_force(&self, u: &V3<T>) -> V3<T> {
        let e = self.edges(u);
        let mut f = [T::zero(); 4];
        for k in 0..4 {
            f[k] = -(T::masked(self.active[k], self.d) * e[k]);
        }
        self.total(&f)
    }

    /// Force of the row at `u`.
    #[inline(always)]
    pub fn true_force(&self, u: &V3<T>) -> V3<T> {
        let e = self.edges(u);
        let mut f = [T::zero(); 4];
        for k in 0..4 {
            f[k] = -(self.d * e[k].min(T::zero()));
        }
        self.total(&f)
    }

    /// Forces along the edges at the current point.
    #[inline(always)]
    pub fn edge_forces(&self) -> [T; 4] {
        self.edges(&self.u).map(|e| -(self.d * e.min(T::zero())))
    }

    /// A force in the contact frame as a wrench about the reference point.
    #[inline(always)]
    pub fn wrench(&self, f: &V3<T>) -> V6<T> {
        let world = [f[1].mul_add(self.tx, -(f[2] * self.ty)), f[1].mul_add(self.ty, f[2] * self.tx), f[0]];
        let t = cross(&self.r, &world);
        [t[0], t[1], t[2], world[0], world[1], world[2]]
    }

    /// Sets the pushing edges at `u` in the lanes `live`. Returns the lanes with a change.
    #[inline(always)]
    pub fn activate(&mut self, live: T::Mask) -> T::Mask {
        let e = self.edges(&self.u);
        let mut changed = T::none();
        for k in 0..4 {
            let active = replace::<T>(live, T::and(e[k].lt(T::zero()), self.on), self.active[k]);
            changed = T::or(changed, T::xor(active, self.active[k]));
            self.active[k] = active;
        }
        changed
    }

    /// Moves to the Newton point. Returns the lanes whose active edges differ there.
    #[inline(always)]
    pub fn newton_point(&mut self, link_acc: &V6<T>) -> T::Mask {
        let ja = self.of_motion(link_acc);
        self.next = add3(&ja, &self.u0);
        let e = self.edges(&self.next);
        let mut changed = T::none();
        for k in 0..4 {
            let active = T::and(e[k].lt(T::zero()), self.on);
            changed = T::or(changed, T::xor(active, self.active[k]));
        }
        changed
    }

    /// Moves. Returns the lanes whose active edges changed.
    #[inline(always)]
    pub fn advance(&mut self, step: &NewtonStep<T>) -> T::Mask {
        let linear = self.linear_force(&self.next);
        for i in 0..3 {
            self.u[i] = step.of(self.u[i], self.next[i]);
            self.force[i] = step.of(self.force[i], linear[i]);
        }
        self.activate(step.live())
    }

    /// Adds the active edges' stiffness to the link's 6x6 matrix.
    #[inline(always)]
    pub fn add_stiffness<S: Space>(&self, k: &mut Sym6<T>) {
        let (m1, m2) = (self.mu[0], self.mu[1]);
        let mut s = [T::zero(); 4];
        for e in 0..4 {
            s[e] = T::masked(self.active[e], self.d);
        }
        // the 3x3 block in the contact frame, rotated into world axes
        let nn = (s[0] + s[1]) + (s[2] + s[3]);
        let (n1, n2) = (m1 * (s[0] - s[1]), m2 * (s[2] - s[3]));
        let (t11, t22) = (m1 * m1 * (s[0] + s[1]), m2 * m2 * (s[2] + s[3]));
        let (tx, ty) = (self.tx, self.ty);
        let (cxx, cyy, cxy) = (tx * tx, ty * ty, tx * ty);
        let xx = t11.mul_add(cxx, t22 * cyy);
        let yy = t11.mul_add(cyy, t22 * cxx);
        let xy = (t11 - t22) * cxy;
        let xz = n1.mul_add(tx, -(n2 * ty));
        let yz = n1.mul_add(ty, n2 * tx);
        // moment arms: [r] W and [r] W [r]'
        let r = &self.r;
        let c0 = cross(r, &[xx, xy, xz]);
        let c1 = cross(r, &[xy, yy, yz]);
        let c2 = cross(r, &[xz, yz, nn]);
        let q0 = cross(r, &[c0[0], c1[0], c2[0]]);
        let q1 = cross(r, &[c0[1], c1[1], c2[1]]);
        let q2 = cross(r, &[c0[2], c1[2], c2[2]]);
        S::add_sym(
            k,
            &[
                q0[0], q1[1], q2[2], q0[1], q0[2], q1[2], c0[0], c1[0], c2[0], c0[1], c1[1], c2[1], c0[2], c1[2],
                c2[2], xx, yy, nn, xy, xz, yz,
            ],
        );
    }
}

impl<T: Real> FloorRow<T> {
    /// First and second derivative of the cost at the fraction `alpha` of the step `du`.
    #[inline(always)]
    pub(super) fn slope_along(&self, du: &V3<T>, alpha: T) -> [T; 2] {
        let u = [du[0].mul_add(alpha, self.u[0]), du[1].mul_add(alpha, self.u[1]), du[2].mul_add(alpha, self.u[2])];
        let (e, de) = (self.edges(&u), self.edges(du));
        let (mut s1, mut s2) = (T::zero(), T::zero());
        for k in 0..4 {
            let pushing = T::masked(e[k].lt(T::zero()), de[k]);
            s1 = pushing.mul_add(e[k], s1);
            s2 = pushing.mul_add(de[k], s2);
        }
        [self.d * s1, self.d * s2]
    }
}

impl<T: Real> Row<T> for FloorRow<T> {
    #[inline(always)]
    fn ends(&self) -> [T; 3] {
        let du = sub3(&self.next, &self.u);
        [dot(&du, &self.force), dot(&du, &self.linear_force(&self.next)), dot(&du, &self.true_force(&self.u))]
    }

    #[inline(always)]
    fn slope(&self, alpha: T) -> [T; 2] {
        self.slope_along(&sub3(&self.next, &self.u), alpha)
    }
}
