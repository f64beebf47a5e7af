//! Vectors in double precision, without fused operations: the numbers of a compiled model are the same on every processor.

use crate::model::Vec3;

pub(super) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// Adds `b` times `s` to `a`.
pub(super) fn add_scaled(a: &mut Vec3, b: Vec3, s: f64) {
    for (x, y) in a.iter_mut().zip(b) {
        *x += s * y;
    }
}
