//! Contacts with elliptic friction cones: the cost has a flat part, a curved one, and one without force.

use super::block::{Block, RowValues, at};
use crate::lanes::Real;

/// Zone of a point with respect to an elliptic cone.
pub(super) struct ConePoint<T: Real> {
    /// The contact sticks.
    pub bottom: T::Mask,
    /// It slides.
    pub middle: T::Mask,
    /// Scaled normal value, sliding speed, `excess = normal - slope * sliding`, inverse of the sliding speed.
    pub normal: T,
    pub sliding: T,
    pub excess: T,
    pub inv_sliding: T,
    /// Stiffness of the curved part.
    pub weight: T,
}

impl<T: Real> ConePoint<T> {
    #[inline(always)]
    pub(super) fn at(block: &Block<T>, u: &RowValues<T>) -> Self {
        let (z, one) = (T::zero(), T::lit(1.0));
        let mu = block.slope;
        let mut square = z;
        for k in 1..block.dim {
            let x = block.mu[k - 1] * u[k];
            square = x.mul_add(x, square);
        }
        let sliding = square.sqrt();
        let normal = mu * u[0];
        let excess = mu.neg_mul_add(sliding, normal);
        let inside = excess.lt(z);
        // beyond the polar cone, the full stiffness acts
        let full = T::not(z.lt(mu.mul_add(normal, sliding)));
        let square_mu = mu * mu;
        let safe = T::select(block.on, square_mu * (one + square_mu), one);
        ConePoint {
            bottom: T::and(inside, full),
            middle: T::and(inside, T::not(full)),
            normal,
            sliding,
            excess,
            inv_sliding: one.div(sliding.max(T::lit(1e-30))),
            weight: block.d[0].div(safe),
        }
    }
}

impl<T: Real> Block<T> {
    /// Second derivative of the elliptic cone's cost.
    #[inline(always)]
    pub(super) fn elliptic_stiffness(&mut self, cone: &ConePoint<T>, live: T::Mask) {
        let z = T::zero();
        let [bottom, middle] = [self.zones[0], self.zones[1]];
        let (mu, inv) = (self.slope, cone.inv_sliding);
        let radial = mu * cone.normal * inv * inv * inv;
        let round = mu * mu - mu * cone.normal * inv;
        for i in 0..self.dim {
            for j in 0..=i {
                let curved = match (i, j) {
                    (0, 0) => cone.weight * mu * mu,
                    (_, 0) => {
                        let m = self.mu[i - 1];
                        -(cone.weight * mu * mu * (m * self.u[i]) * inv * m)
                    }
                    _ => {
                        let (mi, mj) = (self.mu[i - 1], self.mu[j - 1]);
                        let mut h = radial * (mi * self.u[i]) * (mj * self.u[j]);
                        if i == j {
                            h += round;
                        }
                        cone.weight * h * mi * mj
                    }
                };
                let flat = if i == j { self.d[i] } else { z };
                let now = T::select(middle, curved, T::masked(bottom, flat));
                self.stiffness[at(i, j)] = T::select(live, now, self.stiffness[at(i, j)]);
            }
        }
    }

    /// First and second derivative of the elliptic cone's cost along `du` at `u`.
    #[inline(always)]
    pub(super) fn elliptic_slope(&self, u: &RowValues<T>, du: &RowValues<T>) -> [T; 2] {
        let z = T::zero();
        let cone = ConePoint::at(self, u);
        let (mut b1, mut b2) = (z, z);
        let (mut cross, mut square) = (z, z);
        for k in 0..self.dim {
            let w = self.d[k] * du[k];
            b1 = w.mul_add(u[k], b1);
            b2 = w.mul_add(du[k], b2);
            if k > 0 {
                let (x, dx) = (self.mu[k - 1] * u[k], self.mu[k - 1] * du[k]);
                cross = x.mul_add(dx, cross);
                square = dx.mul_add(dx, square);
            }
        }
        // derivatives of the sliding speed along the segment
        let inv = cone.inv_sliding;
        let rate = cross * inv;
        let bend = (square - rate * rate) * inv;
        let towards = self.slope * (du[0] - rate);
        let m1 = cone.weight * cone.excess * towards;
        let m2 = cone.weight * (towards * towards - cone.excess * self.slope * bend);
        [T::select(cone.middle, m1, T::masked(cone.bottom, b1)), T::select(cone.middle, m2, T::masked(cone.bottom, b2))]
    }
}
