//! Rigid transforms in double precision, for preparing a model.

/// A point or direction.
type Vec3 = [f64; 3];

/// Position and rotation (columns) of one frame in another.
pub(crate) type Frame = (Vec3, [Vec3; 3]);

/// Rotation matrix (columns) of a quaternion of any length.
pub(crate) fn quat_to_rot(q: &[f64; 4]) -> [Vec3; 3] {
    let n = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    let [w, x, y, z] = *q;
    [
        [1.0 - n * (y * y + z * z), n * (x * y + w * z), n * (x * z - w * y)],
        [n * (x * y - w * z), 1.0 - n * (x * x + z * z), n * (y * z + w * x)],
        [n * (x * z + w * y), n * (y * z - w * x), 1.0 - n * (x * x + y * y)],
    ]
}

/// Rotates a vector.
pub(crate) fn rotate(r: &[Vec3; 3], v: &Vec3) -> Vec3 {
    let mut out = [0.0; 3];
    for i in 0..3 {
        out[i] = r[0][i] * v[0] + r[1][i] * v[1] + r[2][i] * v[2];
    }
    out
}

/// Composes frames: `b` is given in `a`, the result in the parent of `a`.
pub(crate) fn compose(a: &Frame, b: &Frame) -> Frame {
    let p = rotate(&a.1, &b.0);
    ([a.0[0] + p[0], a.0[1] + p[1], a.0[2] + p[2]], b.1.map(|column| rotate(&a.1, &column)))
}

/// Whether a rotation is the identity up to rounding.
pub(crate) fn is_identity(r: &[Vec3; 3]) -> bool {
    (0..3).all(|i| (0..3).all(|j| (r[i][j] - f64::from(i == j)).abs() < 1e-14))
}
