//! Rotations, frames and principal axes, in `f64`.

pub(crate) use crate::model::vector::{MIN_VAL, add, cross, dot, norm, scale, sub};
use crate::model::{Quat, Vec3};

/// Vectors shorter than this have no direction; MuJoCo's `mjEPS`.
pub(crate) const EPS: f64 = 1e-14;

/// The rotation that does nothing.
pub(crate) const IDENTITY: Quat = [1.0, 0.0, 0.0, 0.0];

/// Position and orientation of one frame in another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    pub pos: Vec3,
    pub quat: Quat,
}

impl Frame {
    pub const IDENTITY: Frame = Frame { pos: [0.0; 3], quat: IDENTITY };

    /// `child`, given in this frame, as seen from where this frame is given.
    pub fn compose(&self, child: &Frame) -> Frame {
        Frame { pos: self.point(child.pos), quat: normalized(mul_quat(self.quat, child.quat)) }
    }

    /// A point of this frame as seen from outside.
    pub fn point(&self, p: Vec3) -> Vec3 {
        add(self.pos, rotate(self.quat, p))
    }
}

/// Unit vector, unless `a` is too short to have a direction.
pub(crate) fn unit(a: Vec3) -> Option<Vec3> {
    let length = norm(a);
    (length.is_finite() && length >= EPS).then(|| scale(a, 1.0 / length))
}

/// First `b`, then `a`.
pub(crate) fn mul_quat(a: Quat, b: Quat) -> Quat {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

pub(crate) fn quat_norm(q: Quat) -> f64 {
    q.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Unit quaternion; the identity when `q` is too short to be a rotation.
pub(crate) fn normalized(q: Quat) -> Quat {
    let length = quat_norm(q);
    if length.is_finite() && length >= EPS { q.map(|x| x / length) } else { IDENTITY }
}

/// Rotates `v` by the unit quaternion `q`.
pub(crate) fn rotate(q: Quat, v: Vec3) -> Vec3 {
    let m = matrix(q);
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}

/// Rotation matrix by rows.
pub(crate) fn matrix(q: Quat) -> [Vec3; 3] {
    let [w, x, y, z] = q;
    [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
}

/// The columns of the rotation matrix: the frame's axes seen from outside.
pub(crate) fn axes(q: Quat) -> [Vec3; 3] {
    let m = matrix(q);
    [0, 1, 2].map(|i| [m[0][i], m[1][i], m[2][i]])
}

/// Rotation by `angle` about the unit vector `axis`.
pub(crate) fn from_axis_angle(axis: Vec3, angle: f64) -> Quat {
    let (s, c) = libm::sincos(angle / 2.0);
    [c, axis[0] * s, axis[1] * s, axis[2] * s]
}

/// Shortest rotation that takes the z axis to the unit vector `to`; half a turn about x for the opposite direction.
pub(crate) fn from_z_axis(to: Vec3) -> Quat {
    let perpendicular = cross([0.0, 0.0, 1.0], to);
    let sine = norm(perpendicular);
    let axis = if sine < 1e-10 { [1.0, 0.0, 0.0] } else { scale(perpendicular, 1.0 / sine) };
    from_axis_angle(axis, libm::atan2(sine, to[2]))
}

/// Rotation with the given right-handed orthonormal axes.
pub(crate) fn from_axes(x: Vec3, y: Vec3, z: Vec3) -> Quat {
    let squares =
        [1.0 + x[0] + y[1] + z[2], 1.0 + x[0] - y[1] - z[2], 1.0 - x[0] + y[1] - z[2], 1.0 - x[0] - y[1] + z[2]];
    // the root of a large component has no cancellation; MuJoCo's choice of it decides the sign of the quaternion
    let largest = if x[0] + y[1] + z[2] > 0.0 {
        0
    } else if x[0] > y[1] && x[0] > z[2] {
        1
    } else if y[1] > z[2] {
        2
    } else {
        3
    };
    let r = squares[largest].max(0.0).sqrt();
    let (s, h) = (0.5 / r, 0.5 * r);
    normalized(match largest {
        0 => [h, (y[2] - z[1]) * s, (z[0] - x[2]) * s, (x[1] - y[0]) * s],
        1 => [(y[2] - z[1]) * s, h, (y[0] + x[1]) * s, (z[0] + x[2]) * s],
        2 => [(z[0] - x[2]) * s, (y[0] + x[1]) * s, h, (z[1] + y[2]) * s],
        _ => [(x[1] - y[0]) * s, (z[0] + x[2]) * s, (z[1] + y[2]) * s, h],
    })
}

/// Symmetric 3x3 matrix `R diag(moments) R'` as `[xx, yy, zz, xy, xz, yz]`.
pub(crate) fn rotate_diagonal(quat: Quat, moments: Vec3) -> [f64; 6] {
    let m = matrix(quat);
    let at = |i: usize, j: usize| (0..3).map(|k| m[i][k] * moments[k] * m[j][k]).sum();
    [at(0, 0), at(1, 1), at(2, 2), at(0, 1), at(0, 2), at(1, 2)]
}

/// Principal moments of a symmetric matrix `[xx, yy, zz, xy, xz, yz]`, largest first, and the frame of its axes.
pub(crate) fn principal_axes(full: [f64; 6]) -> (Vec3, Quat) {
    let size = full.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    principal_axes_within(full, f64::EPSILON * size, 1e-12)
}

/// The same for a mesh: MuJoCo leaves a ten millionth of the largest entry off the diagonal, and its meshes are turned accordingly.
pub(crate) fn principal_axes_of_mesh(full: [f64; 6]) -> (Vec3, Quat) {
    let size = full.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    principal_axes_within(full, 1e-7 * size, 1e-7 * size)
}

/// Jacobi's method with the rotation kept as a quaternion. It ends when all entries off the diagonal are at most `rest`. Moments
/// that differ by less than `same` keep their order.
fn principal_axes_within(full: [f64; 6], rest: f64, same: f64) -> (Vec3, Quat) {
    let [xx, yy, zz, xy, xz, yz] = full;
    let symmetric = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let mut quat = IDENTITY;
    let mut moments = [xx, yy, zz];
    // convergence is quadratic; a handful of turns reaches rounding error
    for _ in 0..100 {
        let axes = axes(quat);
        let entry = |i: usize, j: usize| dot(axes[i], symmetric.map(|row| dot(row, axes[j])));
        moments = [entry(0, 0), entry(1, 1), entry(2, 2)];
        // the plane with the largest off-diagonal entry, and the axis it turns about
        let off = [entry(1, 2), entry(0, 2), entry(0, 1)];
        let turn = if off[2].abs() > off[1].abs() && off[2].abs() > off[0].abs() {
            2
        } else if off[1].abs() > off[0].abs() {
            1
        } else {
            0
        };
        if !(off[turn].abs() > rest) {
            break;
        }
        let (row, column) = [(1, 2), (0, 2), (0, 1)][turn];
        let tau = (moments[column] - moments[row]) / (2.0 * off[turn]);
        let sign = if tau >= 0.0 { 1.0 } else { -1.0 };
        let tangent = sign / (tau.abs() + (1.0 + tau * tau).sqrt());
        let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
        // half the angle, without cancellation for small ones; the plane (0, 2) is left-handed about axis 1
        let half = tangent * cosine / (2.0 * (1.0 + cosine)).sqrt();
        let mut step = IDENTITY;
        step[turn + 1] = if turn == 1 { half } else { -half };
        step[0] = (1.0 - half * half).sqrt();
        quat = normalized(mul_quat(quat, step));
    }
    // sort by quarter turns, which keep the frame right-handed; equal moments stay in place
    for lead in [0, 1, 0] {
        if moments[lead] + same < moments[lead + 1] {
            moments.swap(lead, lead + 1);
            let mut step = [std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, 0.0];
            step[(lead + 2) % 3 + 1] = step[0];
            quat = normalized(mul_quat(quat, step));
        }
    }
    (moments, quat)
}
