//! The commanded direction of a character in space. It turns as commanded and stops when the character falls too far
//! behind.

use marathon_physics::lanes::Real;

use crate::agent::senses::clamp;

/// Components of a ground vector to the left of a heading (given as cosine and sine) and along it. For a unit vector,
/// these are the sine and cosine of its angle from the heading.
#[inline(always)]
pub(super) fn beside<T: Real>([c, d]: [T; 2], [x, y]: [T; 2]) -> [T; 2] {
    [c.mul_add(y, -(d * x)), c.mul_add(x, d * y)]
}

/// Angle from a heading to a direction, rad.
#[inline(always)]
pub(super) fn off<T: Real>(heading: [T; 2], direction: [T; 2]) -> T {
    let [sin, cos] = beside(heading, direction);
    sin.atan2(cos)
}

/// The direction one decision later. `by` maps its angle from the heading to the new one, which is limited to `most`,
/// rad.
#[inline(always)]
pub(super) fn turned<T: Real>(heading: [T; 2], direction: [T; 2], by: impl FnOnce(T) -> T, most: f64) -> [T; 2] {
    let angle = clamp(by(off(heading, direction)), -most, most);
    let ((sin, cos), [c, d]) = (angle.sin_cos(), heading);
    [d.neg_mul_add(sin, c * cos), d.mul_add(cos, c * sin)]
}
