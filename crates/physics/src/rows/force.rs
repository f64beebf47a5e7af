//! Cost and force of a [`Block`] for given row values.

use super::block::{Block, RowValues, at};
use super::cone::ConePoint;
use super::row::{NewtonStep, Row, replace};
use crate::algebra::spatial::V6;
use crate::lanes::Real;
use crate::sim::Cost;

impl<T: Real> Block<T> {
    /// Edges of the pyramid at `u`: pairs for each tangent.
    #[inline(always)]
    pub(super) fn edge(&self, u: &RowValues<T>, e: usize) -> T {
        let j = e / 2;
        if e.is_multiple_of(2) { self.mu[j].mul_add(u[j + 1], u[0]) } else { self.mu[j].neg_mul_add(u[j + 1], u[0]) }
    }

    pub(super) fn edges(&self) -> usize {
        2 * (self.dim - 1)
    }

    /// Forces along the edges of the pyramid at the current point; zero beyond their number.
    #[inline(always)]
    pub fn edge_forces(&self) -> [T; 10] {
        let mut f = [T::zero(); 10];
        for (e, f) in f.iter_mut().enumerate().take(self.edges()) {
            *f = -(self.d[0] * self.edge(&self.u, e).min(T::zero()));
        }
        f
    }

    /// Adds a force along an edge to row forces.
    #[inline(always)]
    fn add_edge(&self, f: &mut RowValues<T>, e: usize, x: T) {
        let j = e / 2;
        f[0] += x;
        f[j + 1] =
            if e.is_multiple_of(2) { self.mu[j].mul_add(x, f[j + 1]) } else { self.mu[j].neg_mul_add(x, f[j + 1]) };
    }

    /// Force of the block at `u`.
    #[inline(always)]
    pub fn true_force(&self, u: &RowValues<T>) -> RowValues<T> {
        let z = T::zero();
        let mut f = [z; 6];
        match self.cost {
            Cost::Push => f[0] = -(self.d[0] * u[0].min(z)),
            Cost::Equal => {
                for k in 0..self.dim {
                    f[k] = -(self.d[k] * u[k]);
                }
            }
            Cost::Dry => f[0] = -((self.d[0] * u[0]).max(-self.mu[0]).min(self.mu[0])),
            Cost::Pyramid => {
                for e in 0..self.edges() {
                    self.add_edge(&mut f, e, -(self.d[0] * self.edge(u, e).min(z)));
                }
            }
            Cost::Elliptic => {
                let cone = ConePoint::at(self, u);
                for k in 0..self.dim {
                    f[k] = T::masked(cone.bottom, -(self.d[k] * u[k]));
                }
                let normal = -(cone.weight * cone.excess * self.slope);
                f[0] = T::select(cone.middle, normal, f[0]);
                for k in 1..self.dim {
                    // against the sliding direction, proportional to the normal force
                    let m = self.mu[k - 1];
                    let along = -(normal * m * (m * u[k]) * cone.inv_sliding);
                    f[k] = T::select(cone.middle, along, f[k]);
                }
            }
        }
        f
    }

    /// Force of the current point's linear model, at `u`.
    #[inline(always)]
    pub fn linear_force(&self, u: &RowValues<T>) -> RowValues<T> {
        let mut f = [T::zero(); 6];
        for i in 0..self.dim {
            let mut sum = T::zero();
            for j in 0..self.dim {
                let w = if j <= i { self.stiffness[at(i, j)] } else { self.stiffness[at(j, i)] };
                sum = w.mul_add(u[j], sum);
            }
            f[i] = -sum;
        }
        f[0] += self.hold;
        f
    }

    /// Sets zones and the linear model at the current point in the lanes `live`. Returns the lanes with a change.
    #[inline(always)]
    pub fn activate(&mut self, live: T::Mask) -> T::Mask {
        let z = T::zero();
        let mut changed = T::none();
        match self.cost {
            Cost::Push => {
                let active = replace::<T>(live, T::and(self.u[0].lt(z), self.on), self.zones[0]);
                changed = T::xor(active, self.zones[0]);
                self.zones[0] = active;
                self.stiffness[0] = T::masked(active, self.d[0]);
            }
            Cost::Equal => {
                for k in 0..self.dim {
                    for j in 0..k {
                        self.stiffness[at(k, j)] = z;
                    }
                    self.stiffness[at(k, k)] = self.d[k];
                }
            }
            Cost::Dry => {
                let below = replace::<T>(live, (self.d[0] * self.u[0]).abs().lt(self.mu[0]), self.zones[0]);
                let positive = replace::<T>(live, z.lt(self.u[0]), self.zones[1]);
                changed = T::or(T::xor(below, self.zones[0]), T::xor(positive, self.zones[1]));
                self.zones[0] = below;
                self.zones[1] = positive;
                self.stiffness[0] = T::masked(below, self.d[0]);
                let bound = T::select(positive, -self.mu[0], self.mu[0]);
                self.hold = T::select(below, z, T::masked(self.on, bound));
            }
            Cost::Pyramid => {
                for k in 0..at(self.dim - 1, self.dim - 1) + 1 {
                    self.stiffness[k] = z;
                }
                for e in 0..self.edges() {
                    let pushes = T::and(self.edge(&self.u, e).lt(z), self.on);
                    let active = replace::<T>(live, pushes, self.zones[e]);
                    changed = T::or(changed, T::xor(active, self.zones[e]));
                    self.zones[e] = active;
                    let (s, j) = (T::masked(active, self.d[0]), e / 2 + 1);
                    let m = if e.is_multiple_of(2) { self.mu[j - 1] } else { -self.mu[j - 1] };
                    let sm = s * m;
                    self.stiffness[0] += s;
                    self.stiffness[at(j, 0)] += sm;
                    self.stiffness[at(j, j)] = sm.mul_add(m, self.stiffness[at(j, j)]);
                }
            }
            Cost::Elliptic => {
                let cone = ConePoint::at(self, &self.u);
                let bottom = replace::<T>(live, T::and(cone.bottom, self.on), self.zones[0]);
                let middle = replace::<T>(live, T::and(cone.middle, self.on), self.zones[1]);
                // on the curved part every move changes the model
                changed = T::or(T::xor(bottom, self.zones[0]), T::xor(middle, self.zones[1]));
                changed = T::or(changed, T::and(live, middle));
                self.zones[0] = bottom;
                self.zones[1] = middle;
                self.elliptic_stiffness(&cone, live);
            }
        }
        changed
    }

    /// Moves to the Newton point. Returns the lanes where the linear model does not hold there.
    #[inline(always)]
    pub fn newton_point(&mut self, link_acc: &[V6<T>], joint_acc: &[T]) -> T::Mask {
        let z = T::zero();
        let ja = self.of_motion(link_acc, joint_acc);
        for k in 0..self.dim {
            self.next[k] = ja[k] + self.u0[k];
        }
        match self.cost {
            Cost::Equal => T::none(),
            Cost::Push => T::xor(T::and(self.next[0].lt(z), self.on), self.zones[0]),
            Cost::Dry => {
                let below = (self.d[0] * self.next[0]).abs().lt(self.mu[0]);
                let flipped = T::and(T::not(below), T::xor(z.lt(self.next[0]), self.zones[1]));
                T::and(self.on, T::or(T::xor(below, self.zones[0]), flipped))
            }
            Cost::Pyramid => {
                let mut changed = T::none();
                for e in 0..self.edges() {
                    let active = T::and(self.edge(&self.next, e).lt(z), self.on);
                    changed = T::or(changed, T::xor(active, self.zones[e]));
                }
                changed
            }
            Cost::Elliptic => {
                // on the curved part of the cone the model is never exact
                let cone = ConePoint::at(self, &self.next);
                let differs = T::or(T::xor(cone.bottom, self.zones[0]), T::or(cone.middle, self.zones[1]));
                T::and(self.on, differs)
            }
        }
    }

    /// Moves. Returns the lanes whose linear model changed.
    #[inline(always)]
    pub fn advance(&mut self, step: &NewtonStep<T>) -> T::Mask {
        let linear = self.linear_force(&self.next);
        for i in 0..self.dim {
            self.u[i] = step.of(self.u[i], self.next[i]);
            self.force[i] = step.of(self.force[i], linear[i]);
        }
        self.activate(step.live())
    }

    #[inline(always)]
    fn along(&self, f: &RowValues<T>) -> T {
        let mut sum = T::zero();
        for k in 0..self.dim {
            sum = (self.next[k] - self.u[k]).mul_add(f[k], sum);
        }
        sum
    }
}

impl<T: Real> Row<T> for Block<T> {
    #[inline(always)]
    fn ends(&self) -> [T; 3] {
        [self.along(&self.force), self.along(&self.linear_force(&self.next)), self.along(&self.true_force(&self.u))]
    }

    #[inline(always)]
    fn slope(&self, alpha: T) -> [T; 2] {
        let mut du = [T::zero(); 6];
        for k in 0..self.dim {
            du[k] = self.next[k] - self.u[k];
        }
        self.slope_along(&du, alpha)
    }
}

impl<T: Real> Block<T> {
    /// First and second derivative of the cost at the fraction `alpha` of the step `du`.
    #[inline(always)]
    pub(super) fn slope_along(&self, du: &RowValues<T>, alpha: T) -> [T; 2] {
        let z = T::zero();
        let mut u = [z; 6];
        for k in 0..self.dim {
            u[k] = du[k].mul_add(alpha, self.u[k]);
        }
        match self.cost {
            Cost::Push => {
                let pushing = T::masked(u[0].lt(z), self.d[0] * du[0]);
                [pushing * u[0], pushing * du[0]]
            }
            Cost::Equal => {
                let (mut s1, mut s2) = (z, z);
                for k in 0..self.dim {
                    let w = self.d[k] * du[k];
                    s1 = w.mul_add(u[k], s1);
                    s2 = w.mul_add(du[k], s2);
                }
                [s1, s2]
            }
            Cost::Dry => {
                let force = self.true_force(&u)[0];
                let below = (self.d[0] * u[0]).abs().lt(self.mu[0]);
                [-(du[0] * force), T::masked(below, self.d[0] * du[0]) * du[0]]
            }
            Cost::Pyramid => {
                let (mut s1, mut s2) = (z, z);
                for e in 0..self.edges() {
                    let (x, dx) = (self.edge(&u, e), self.edge(du, e));
                    let pushing = T::masked(x.lt(z), dx);
                    s1 = pushing.mul_add(x, s1);
                    s2 = pushing.mul_add(dx, s2);
                }
                [self.d[0] * s1, self.d[0] * s2]
            }
            Cost::Elliptic => self.elliptic_slope(&u, du),
        }
    }
}
