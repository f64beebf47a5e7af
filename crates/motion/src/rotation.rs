//! Unit quaternions: exponential, logarithm, interpolation, heading. Transcendental functions are those of `libm`, so that
//! results do not depend on the platform.

use glam::{DQuat, DVec3};

/// Converts from MuJoCo's order `[w, x, y, z]`.
pub(crate) fn quat(q: &[f64]) -> DQuat {
    DQuat::from_xyzw(q[1], q[2], q[3], q[0])
}

/// Converts to MuJoCo's order `[w, x, y, z]`.
pub(crate) fn wxyz(q: DQuat) -> [f64; 4] {
    [q.w, q.x, q.y, q.z]
}

/// The rotation by `|v|` rad about `v`.
pub(crate) fn exp(v: DVec3) -> DQuat {
    let half = 0.5 * v.length();
    // exact limit of sin(x)/x where the quotient would be 0/0
    let scale = if half < 1e-8 { 0.5 } else { 0.5 * libm::sin(half) / half };
    let axis = scale * v;
    DQuat::from_xyzw(axis.x, axis.y, axis.z, libm::cos(half))
}

/// The rotation vector of the shorter rotation, with a length of at most pi.
pub(crate) fn log(q: DQuat) -> DVec3 {
    let q = if q.w < 0.0 { -q } else { q };
    let sin = DVec3::new(q.x, q.y, q.z);
    let norm = sin.length();
    if norm < 1e-12 { 2.0 * sin } else { 2.0 * libm::atan2(norm, q.w) / norm * sin }
}

/// Interpolation along the shorter great arc: `a` at 0, `b` at 1.
pub(crate) fn slerp(a: DQuat, b: DQuat, s: f64) -> DQuat {
    (a * exp(s * log(a.conjugate() * b))).normalize()
}

/// Cubic interpolation between `a` and `b`, `seconds` apart, with these angular velocities in body axes, at the
/// fraction `s`.
pub(crate) fn cubic(a: DQuat, b: DQuat, velocities: [DVec3; 2], seconds: f64, s: f64) -> DQuat {
    let way = log(a.conjugate() * b);
    let [start, end] = velocities.map(|v| v * seconds);
    // the end's velocity as the rate of the rotation vector from `a`: the inverse right Jacobian to second order
    let end = end + 0.5 * way.cross(end) + way.cross(way.cross(end)) / 12.0;
    let [_, first, second, third] = hermite(s);
    (a * exp(first * way + second * start + third * end)).normalize()
}

/// Weights of Hermite's cubic at the fraction `s`: of the start, the end, and the two slopes.
pub(crate) fn hermite(s: f64) -> [f64; 4] {
    let rest = 1.0 - s;
    [(1.0 + 2.0 * s) * rest * rest, s * s * (3.0 - 2.0 * s), s * rest * rest, -s * s * rest]
}

/// The rotation by `angle` rad about the vertical axis.
pub(crate) fn about_z(angle: f64) -> DQuat {
    DQuat::from_xyzw(0.0, 0.0, libm::sin(0.5 * angle), libm::cos(0.5 * angle))
}

/// Heading, rad: the twist of a rotation about the vertical axis. Unlike the direction of one axis, it changes smoothly
/// through a somersault.
pub(crate) fn heading(q: DQuat) -> f64 {
    wrap_angle(2.0 * libm::atan2(q.z, q.w))
}

/// The equivalent angle from -pi to pi, rad.
pub fn wrap_angle(angle: f64) -> f64 {
    let turns = libm::round(angle / std::f64::consts::TAU);
    angle - turns * std::f64::consts::TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn angles_are_wrapped() {
        for (angle, expected) in [(0.0, 0.0), (3.5, 3.5 - TAU), (-3.5, TAU - 3.5), (7.0, 7.0 - TAU)] {
            assert!((wrap_angle(angle) - expected).abs() < 1e-12, "{angle}");
        }
    }

    #[test]
    fn the_logarithm_undoes_the_exponential() {
        for v in [DVec3::ZERO, DVec3::new(1e-9, 0.0, 0.0), DVec3::new(0.3, -1.2, 0.4), DVec3::new(0.0, 3.1, 0.0)] {
            assert!((log(exp(v)) - v).length() < 1e-14, "{v}");
        }
    }

    #[test]
    fn a_turn_about_the_vertical_adds_to_the_heading() {
        let tilted = exp(DVec3::new(0.4, -0.2, 0.0));
        for angle in [-3.0, -0.5, 0.0, 1.0, 3.1] {
            let turned = about_z(angle) * tilted;
            assert!(wrap_angle(heading(turned) - heading(tilted) - angle).abs() < 1e-14, "{angle}");
        }
    }
}
