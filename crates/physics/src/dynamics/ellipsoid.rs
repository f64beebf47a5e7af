//! Forces of the medium on a geom that is like an ellipsoid to it, and their derivative by the geom's velocity.
//!
//! The formulas are those of MuJoCo's documentation ("Fluid forces", ellipsoid model). Vectors are along the geom's axes.

use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::sim::EllipsoidDrag;

/// Least divisor: a geom at rest has no direction.
const LEAST: f64 = 1e-30;

/// A velocity through the medium, and what several formulas need of it.
struct Flow<T: Real> {
    /// Angular velocity, linear velocity, the length of the latter and its direction.
    w: V3<T>,
    v: V3<T>,
    speed: T,
    to: V3<T>,
    /// The direction weighted with the squares of the cross sections, its product with the direction, and its square.
    normal: V3<T>,
    along: T,
    across: T,
    /// Area of the ellipsoid's shadow in this direction.
    shadow: T,
    /// Moments of the drag against rotations, before the density, and their length.
    spin: V3<T>,
    spinning: T,
}

impl<T: Real> Flow<T> {
    #[inline(always)]
    fn new(drag: &EllipsoidDrag<T::Scalar>, w: &V3<T>, v: &V3<T>) -> Self {
        let (a, m, least) = (splat3::<T>(&drag.squares), splat3::<T>(&drag.moments), T::lit(LEAST));
        let speed = dot(v, v).sqrt();
        let inverse = speed.max(least).recip();
        let to = [v[0] * inverse, v[1] * inverse, v[2] * inverse];
        let normal = [a[0] * to[0], a[1] * to[1], a[2] * to[2]];
        let spin = [m[0] * w[0], m[1] * w[1], m[2] * w[2]];
        let (along, across) = (dot(&normal, &to), dot(&normal, &normal));
        let shadow = T::splat(drag.section) * across.div(along.max(least)).sqrt();
        let spinning = dot(&spin, &spin).sqrt();
        Flow { w: *w, v: *v, speed, to, normal, along, across, shadow, spin, spinning }
    }

    /// Drag per squared speed of a body with this shadow, viscosity aside.
    #[inline(always)]
    fn drag(&self, drag: &EllipsoidDrag<T::Scalar>) -> T {
        let rest = T::splat(drag.area) - self.shadow;
        self.shadow.mul_add(T::splat(drag.blunt), T::splat(drag.slender) * rest)
    }
}

/// Torque and force on a geom that moves through the medium.
#[inline(always)]
pub(super) fn ellipsoid_force<T: Real>(drag: &EllipsoidDrag<T::Scalar>, w: &V3<T>, v: &V3<T>) -> [V3<T>; 2] {
    let flow = Flow::new(drag, w, v);
    let (m, i) = (splat3::<T>(&drag.mass), splat3::<T>(&drag.inertia));
    let momentum = [m[0] * v[0], m[1] * v[1], m[2] * v[2]];
    let turning = [i[0] * w[0], i[1] * w[1], i[2] * w[2]];
    let ratio = flow.along.div(flow.across.max(T::lit(LEAST))).sqrt();
    let lifting = T::splat(drag.kutta) * T::splat(drag.section) * ratio * flow.speed * flow.speed;
    let lift = cross(&cross(&flow.normal, &flow.to), &flow.to);
    let magnus = cross(w, v);
    let slow = flow.speed.mul_add(flow.drag(drag), T::splat(drag.viscous[1]));
    let brake = T::splat(drag.density).mul_add(flow.spinning, T::splat(drag.viscous[0]));
    let mut force = cross(&momentum, w);
    let mut torque = cross_add(&turning, w, &cross(&momentum, v));
    for k in 0..3 {
        torque[k] = brake.neg_mul_add(w[k], torque[k]);
        force[k] += T::splat(drag.magnus).mul_add(magnus[k], lifting * lift[k]);
        force[k] = slow.neg_mul_add(v[k], force[k]);
    }
    [torque, force]
}

/// Derivative of torque and force (rows) by the angular and the linear velocity (columns).
#[inline(always)]
pub(super) fn ellipsoid_derivative<T: Real>(drag: &EllipsoidDrag<T::Scalar>, w: &V3<T>, v: &V3<T>) -> [[T; 6]; 6] {
    let z = T::zero();
    let flow = Flow::new(drag, w, v);
    let mut out = [[z; 6]; 6];
    moving_along(drag, &flow, &mut out);
    brake(drag, &flow, &mut out);
    slow(drag, &flow, &mut out);
    lift(drag, &flow, &mut out);
    out
}

/// Derivatives of vector products: the medium that moves along, and Magnus' lift.
#[inline(always)]
fn moving_along<T: Real>(drag: &EllipsoidDrag<T::Scalar>, flow: &Flow<T>, out: &mut [[T; 6]; 6]) {
    let (m, i, magnus) = (splat3::<T>(&drag.mass), splat3::<T>(&drag.inertia), T::splat(drag.magnus));
    let (w, v) = (&flow.w, &flow.v);
    let momentum = [m[0] * v[0], m[1] * v[1], m[2] * v[2]];
    let turning = [i[0] * w[0], i[1] * w[1], i[2] * w[2]];
    for k in 0..3 {
        let mut e = [T::zero(); 3];
        e[k] = T::lit(1.0);
        let (ew, ev) = (cross(&e, w), cross(&e, v));
        let (turned, moved) = (cross(&turning, &e), cross(&momentum, &e));
        for r in 0..3 {
            out[r][k] += i[k].mul_add(ew[r], turned[r]);
            out[r][3 + k] += m[k].mul_add(ev[r], moved[r]);
            out[3 + r][k] += magnus.mul_add(ev[r], moved[r]);
            // w x e is the opposite of e x w
            out[3 + r][3 + k] += (m[k] - magnus) * ew[r];
        }
    }
}

/// Drag against rotations.
#[inline(always)]
fn brake<T: Real>(drag: &EllipsoidDrag<T::Scalar>, flow: &Flow<T>, out: &mut [[T; 6]; 6]) {
    let m = splat3::<T>(&drag.moments);
    let rate = T::splat(drag.density).div(flow.spinning.max(T::lit(LEAST)));
    let same = rate.mul_add(dot(&flow.spin, &flow.spin), T::splat(drag.viscous[0]));
    for r in 0..3 {
        out[r][r] -= same;
        for k in 0..3 {
            out[r][k] = (rate * flow.w[r]).neg_mul_add(flow.spin[k] * m[k], out[r][k]);
        }
    }
}

/// Drag against the velocity.
#[inline(always)]
fn slow<T: Real>(drag: &EllipsoidDrag<T::Scalar>, flow: &Flow<T>, out: &mut [[T; 6]; 6]) {
    let (a, to) = (splat3::<T>(&drag.squares), &flow.to);
    let rate = flow.drag(drag) * flow.speed;
    // derivative of the shadow
    let root = (flow.along * flow.along * flow.along * flow.across).sqrt().max(T::lit(LEAST));
    let share = (T::splat(drag.blunt) - T::splat(drag.slender)) * T::splat(drag.section) * flow.speed;
    let share = share.div(root);
    for k in 0..3 {
        let mut sum = T::zero();
        for j in 0..3 {
            sum = (flow.normal[j] * to[j]).mul_add(a[k] - a[j], sum);
        }
        let both = rate.mul_add(to[k], share * flow.normal[k] * sum);
        for r in 0..3 {
            out[3 + r][3 + k] = to[r].neg_mul_add(both, out[3 + r][3 + k]);
        }
        out[3 + k][3 + k] -= rate + T::splat(drag.viscous[1]);
    }
}

/// Kutta's lift.
#[inline(always)]
fn lift<T: Real>(drag: &EllipsoidDrag<T::Scalar>, flow: &Flow<T>, out: &mut [[T; 6]; 6]) {
    let (a, to, least) = (splat3::<T>(&drag.squares), &flow.to, T::lit(LEAST));
    let root = (flow.across * flow.along).sqrt().max(least);
    let scale = (T::splat(drag.kutta) * T::splat(drag.section) * flow.speed).div(root);
    let by_across = flow.along.div(flow.across.max(least));
    for r in 0..3 {
        let mut bend = T::zero();
        for j in 0..3 {
            bend = (to[j] * to[j]).mul_add(a[r] - a[j], bend);
        }
        for k in 0..3 {
            let inner = (a[k] * a[k]).mul_add(by_across, flow.along - a[k]);
            let outer = (T::lit(2.0) * flow.along).mul_add(a[k] - a[r], inner * bend);
            out[3 + r][3 + k] += scale * outer * to[r] * to[k];
        }
        out[3 + r][3 + r] -= scale * bend * flow.along;
    }
}
