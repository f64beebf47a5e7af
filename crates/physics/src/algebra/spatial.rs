//! Vectors, rotations and spatial (6-D) algebra over lanes.
//!
//! A spatial motion vector is `[angular, linear]`, a spatial force `[torque, force]`. Both are about one reference
//! point per kinematic tree and along world axes. Closures are avoided on purpose: they are compiled for a backend's
//! instruction set only if they happen to be inlined.

use crate::lanes::Real;

/// Three components.
pub type V3<T> = [T; 3];
/// A spatial motion or force.
pub type V6<T> = [T; 6];
/// A rotation by columns: the rotated frame's axes in the outer frame.
pub type Rot<T> = [V3<T>; 3];
/// A rigid body's spatial inertia: mass, mass times center (3), inertia about the reference point (xx yy zz xy xz yz).
pub type Inertia<T> = [T; 10];
/// A symmetric 6x6 matrix: angular block (xx yy zz xy xz yz), angular-linear block (9, row by row), linear block (6).
pub type Sym6<T> = [T; 21];

/// Scalar product.
#[inline(always)]
pub fn dot<T: Real>(a: &V3<T>, b: &V3<T>) -> T {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// Vector product.
#[inline(always)]
pub fn cross<T: Real>(a: &V3<T>, b: &V3<T>) -> V3<T> {
    [a[2].neg_mul_add(b[1], a[1] * b[2]), a[0].neg_mul_add(b[2], a[2] * b[0]), a[1].neg_mul_add(b[0], a[0] * b[1])]
}

/// `a x b + c`.
#[inline(always)]
pub fn cross_add<T: Real>(a: &V3<T>, b: &V3<T>, c: &V3<T>) -> V3<T> {
    [
        a[2].neg_mul_add(b[1], a[1].mul_add(b[2], c[0])),
        a[0].neg_mul_add(b[2], a[2].mul_add(b[0], c[1])),
        a[1].neg_mul_add(b[0], a[0].mul_add(b[1], c[2])),
    ]
}

/// Sum.
#[inline(always)]
pub fn add3<T: Real>(a: &V3<T>, b: &V3<T>) -> V3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Difference.
#[inline(always)]
pub fn sub3<T: Real>(a: &V3<T>, b: &V3<T>) -> V3<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Negation.
#[inline(always)]
pub fn neg3<T: Real>(a: &V3<T>) -> V3<T> {
    [-a[0], -a[1], -a[2]]
}

/// A constant vector in every lane.
#[inline(always)]
pub fn splat3<T: Real>(a: &[T::Scalar; 3]) -> V3<T> {
    [T::splat(a[0]), T::splat(a[1]), T::splat(a[2])]
}

/// Rotates a vector.
#[inline(always)]
pub fn rotate<T: Real>(r: &Rot<T>, x: &V3<T>) -> V3<T> {
    [
        r[0][0].mul_add(x[0], r[1][0].mul_add(x[1], r[2][0] * x[2])),
        r[0][1].mul_add(x[0], r[1][1].mul_add(x[1], r[2][1] * x[2])),
        r[0][2].mul_add(x[0], r[1][2].mul_add(x[1], r[2][2] * x[2])),
    ]
}

/// Rotates a vector and adds an offset.
#[inline(always)]
pub fn rotate_add<T: Real>(r: &Rot<T>, x: &V3<T>, c: &V3<T>) -> V3<T> {
    [
        r[0][0].mul_add(x[0], r[1][0].mul_add(x[1], r[2][0].mul_add(x[2], c[0]))),
        r[0][1].mul_add(x[0], r[1][1].mul_add(x[1], r[2][1].mul_add(x[2], c[1]))),
        r[0][2].mul_add(x[0], r[1][2].mul_add(x[1], r[2][2].mul_add(x[2], c[2]))),
    ]
}

/// Components of a vector along the axes of a rotation: the inverse rotation.
#[inline(always)]
pub fn into_axes<T: Real>(axes: &Rot<T>, v: &V3<T>) -> V3<T> {
    [dot(&axes[0], v), dot(&axes[1], v), dot(&axes[2], v)]
}

/// Composition with a constant rotation.
#[inline(always)]
pub fn compose<T: Real>(r: &Rot<T>, c: &[[T::Scalar; 3]; 3]) -> Rot<T> {
    [rotate(r, &splat3(&c[0])), rotate(r, &splat3(&c[1])), rotate(r, &splat3(&c[2]))]
}

/// Product of quaternions.
#[inline(always)]
pub fn quat_mul<T: Real>(a: &[T; 4], b: &[T; 4]) -> [T; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The inverse of a unit quaternion.
#[inline(always)]
pub fn quat_conjugate<T: Real>(q: &[T; 4]) -> [T; 4] {
    [q[0], -q[1], -q[2], -q[3]]
}

/// Rotation of a unit quaternion; normalized on the fly.
#[inline(always)]
pub fn quat_to_rot<T: Real>(q: &[T; 4]) -> Rot<T> {
    let [w, x, y, z] = *q;
    let one = T::lit(1.0);
    let n = T::lit(2.0).div(w.mul_add(w, x.mul_add(x, y.mul_add(y, z * z))));
    let (xn, yn, zn) = (x * n, y * n, z * n);
    [
        [one - y.mul_add(yn, z * zn), x.mul_add(yn, w * zn), w.neg_mul_add(yn, x * zn)],
        [w.neg_mul_add(zn, x * yn), one - x.mul_add(xn, z * zn), y.mul_add(zn, w * xn)],
        [x.mul_add(zn, w * yn), w.neg_mul_add(xn, y * zn), one - x.mul_add(xn, y * yn)],
    ]
}

/// `q * exp(w h)`: a body that turns with angular velocity `w` (in its own axes) for `h` seconds; normalized.
#[inline(always)]
pub fn integrate_quat<T: Real>(q: &[T; 4], w: &V3<T>, h: T) -> [T; 4] {
    let n = dot(w, w).max(T::lit(1e-30)).sqrt();
    let (s, c) = (n * h * T::lit(0.5)).sin_cos();
    let k = s.div(n);
    let (x, y, z) = (w[0] * k, w[1] * k, w[2] * k);
    let [a, b, d, e] = *q;
    let r = [
        z.neg_mul_add(e, y.neg_mul_add(d, x.neg_mul_add(b, a * c))),
        x.mul_add(a, b.mul_add(c, z.mul_add(d, -(y * e)))),
        y.mul_add(a, d.mul_add(c, x.mul_add(e, -(z * b)))),
        z.mul_add(a, e.mul_add(c, y.mul_add(b, -(x * d)))),
    ];
    let inv = r[0].mul_add(r[0], r[1].mul_add(r[1], r[2].mul_add(r[2], r[3] * r[3]))).sqrt().recip();
    [r[0] * inv, r[1] * inv, r[2] * inv, r[3] * inv]
}

/// Rotation vector (axis times angle, angle in [0, pi]) of a quaternion.
#[inline(always)]
pub fn quat_to_rotvec<T: Real>(q: &[T; 4]) -> V3<T> {
    // the shorter of the two equivalent rotations
    let neg = q[0].lt(T::zero());
    let w = q[0].abs();
    let v = [T::select(neg, -q[1], q[1]), T::select(neg, -q[2], q[2]), T::select(neg, -q[3], q[3])];
    let s = dot(&v, &v).sqrt();
    let angle = s.atan2(w) * T::lit(2.0);
    let k = angle.div(s.max(T::lit(1e-20)));
    [v[0] * k, v[1] * k, v[2] * k]
}

/// Scalar product of a motion and a force.
#[inline(always)]
pub fn dot6<T: Real>(a: &V6<T>, b: &V6<T>) -> T {
    let x = a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]));
    let y = a[3].mul_add(b[3], a[4].mul_add(b[4], a[5] * b[5]));
    x + y
}

/// Angular part (torque of a force).
#[inline(always)]
pub fn ang<T: Real>(a: &V6<T>) -> V3<T> {
    [a[0], a[1], a[2]]
}

/// Linear part (force of a force).
#[inline(always)]
pub fn lin<T: Real>(a: &V6<T>) -> V3<T> {
    [a[3], a[4], a[5]]
}

/// `acc + s * x`.
#[inline(always)]
pub fn axpy6<T: Real>(s: &V6<T>, x: T, acc: &V6<T>) -> V6<T> {
    [
        s[0].mul_add(x, acc[0]),
        s[1].mul_add(x, acc[1]),
        s[2].mul_add(x, acc[2]),
        s[3].mul_add(x, acc[3]),
        s[4].mul_add(x, acc[4]),
        s[5].mul_add(x, acc[5]),
    ]
}

/// Rate of change of a motion vector `s` that moves with `v`.
#[inline(always)]
pub fn cross_motion<T: Real>(v: &V6<T>, s: &V6<T>) -> V6<T> {
    let a = cross(&ang(v), &ang(s));
    let l = cross_add(&lin(v), &ang(s), &cross(&ang(v), &lin(s)));
    [a[0], a[1], a[2], l[0], l[1], l[2]]
}

/// Rate of change of a force `f` that moves with `v`.
#[inline(always)]
pub fn cross_force<T: Real>(v: &V6<T>, f: &V6<T>) -> V6<T> {
    let t = cross_add(&lin(v), &lin(f), &cross(&ang(v), &ang(f)));
    let l = cross(&ang(v), &lin(f));
    [t[0], t[1], t[2], l[0], l[1], l[2]]
}

/// Spatial momentum of a rigid body moving with `v`.
#[inline(always)]
pub fn inertia_mul<T: Real>(i: &Inertia<T>, v: &V6<T>) -> V6<T> {
    let (w, u) = (ang(v), lin(v));
    let mc = [i[1], i[2], i[3]];
    let l = cross(&w, &mc);
    let iw = [
        i[4].mul_add(w[0], i[7].mul_add(w[1], i[8] * w[2])),
        i[7].mul_add(w[0], i[5].mul_add(w[1], i[9] * w[2])),
        i[8].mul_add(w[0], i[9].mul_add(w[1], i[6] * w[2])),
    ];
    let t = cross_add(&mc, &u, &iw);
    [t[0], t[1], t[2], i[0].mul_add(u[0], l[0]), i[0].mul_add(u[1], l[1]), i[0].mul_add(u[2], l[2])]
}

/// Symmetric 6x6 matrix times a motion vector.
#[inline(always)]
pub fn sym6_mul<T: Real>(k: &Sym6<T>, s: &V6<T>) -> V6<T> {
    let (w, v) = (ang(s), lin(s));
    [
        k[0].mul_add(w[0], k[3].mul_add(w[1], k[4] * w[2])) + k[6].mul_add(v[0], k[7].mul_add(v[1], k[8] * v[2])),
        k[3].mul_add(w[0], k[1].mul_add(w[1], k[5] * w[2])) + k[9].mul_add(v[0], k[10].mul_add(v[1], k[11] * v[2])),
        k[4].mul_add(w[0], k[5].mul_add(w[1], k[2] * w[2])) + k[12].mul_add(v[0], k[13].mul_add(v[1], k[14] * v[2])),
        k[15].mul_add(v[0], k[18].mul_add(v[1], k[19] * v[2])) + k[6].mul_add(w[0], k[9].mul_add(w[1], k[12] * w[2])),
        k[18].mul_add(v[0], k[16].mul_add(v[1], k[20] * v[2])) + k[7].mul_add(w[0], k[10].mul_add(w[1], k[13] * w[2])),
        k[19].mul_add(v[0], k[20].mul_add(v[1], k[17] * v[2])) + k[8].mul_add(w[0], k[11].mul_add(w[1], k[14] * w[2])),
    ]
}

/// A rigid body's inertia as a symmetric 6x6 matrix.
#[inline(always)]
pub fn sym6_of_inertia<T: Real>(c: &Inertia<T>) -> Sym6<T> {
    let z = T::zero();
    [c[4], c[5], c[6], c[7], c[8], c[9], z, -c[3], c[2], c[3], z, -c[1], -c[2], c[1], z, c[0], c[0], c[0], z, z, z]
}

/// Adds a rigid body's inertia to a symmetric 6x6 matrix.
#[inline(always)]
pub fn sym6_add_inertia<T: Real>(k: &mut Sym6<T>, c: &Inertia<T>) {
    for i in 0..6 {
        k[i] += c[4 + i];
    }
    k[7] -= c[3];
    k[8] += c[2];
    k[9] += c[3];
    k[11] -= c[1];
    k[12] -= c[2];
    k[13] += c[1];
    k[15] += c[0];
    k[16] += c[0];
    k[17] += c[0];
}

/// `k -= u v'` for `v` proportional to `u`, so that the result stays symmetric.
#[inline(always)]
pub fn sym6_sub_outer<T: Real>(k: &mut Sym6<T>, u: &V6<T>, v: &V6<T>) {
    k[0] = u[0].neg_mul_add(v[0], k[0]);
    k[1] = u[1].neg_mul_add(v[1], k[1]);
    k[2] = u[2].neg_mul_add(v[2], k[2]);
    k[3] = u[0].neg_mul_add(v[1], k[3]);
    k[4] = u[0].neg_mul_add(v[2], k[4]);
    k[5] = u[1].neg_mul_add(v[2], k[5]);
    for r in 0..3 {
        for c in 0..3 {
            k[6 + 3 * r + c] = u[r].neg_mul_add(v[3 + c], k[6 + 3 * r + c]);
        }
    }
    k[15] = u[3].neg_mul_add(v[3], k[15]);
    k[16] = u[4].neg_mul_add(v[4], k[16]);
    k[17] = u[5].neg_mul_add(v[5], k[17]);
    k[18] = u[3].neg_mul_add(v[4], k[18]);
    k[19] = u[3].neg_mul_add(v[5], k[19]);
    k[20] = u[4].neg_mul_add(v[5], k[20]);
}

/// Adds `s d s'` for a wrench direction `s`.
#[inline(always)]
pub fn sym6_add_outer<T: Real>(k: &mut Sym6<T>, s: &V6<T>, d: T) {
    let v = [s[0] * -d, s[1] * -d, s[2] * -d, s[3] * -d, s[4] * -d, s[5] * -d];
    sym6_sub_outer(k, s, &v);
}

/// Quaternion of a rotation, `w >= 0`. A fixed sequence of selections gives the same bits on every backend.
pub fn rot_to_quat<T: Real>(r: &Rot<T>) -> [T; 4] {
    let (one, half) = (T::lit(1.0), T::lit(0.5));
    let (xx, yy, zz) = (r[0][0], r[1][1], r[2][2]);
    // four times the squares of the components; the largest one is safe to divide by
    let squares = [one + xx + yy + zz, one + xx - yy - zz, one - xx + yy - zz, one - xx - yy + zz];
    let (wx, wy, wz) = (r[1][2] - r[2][1], r[2][0] - r[0][2], r[0][1] - r[1][0]);
    let (xy, xz, yz) = (r[1][0] + r[0][1], r[2][0] + r[0][2], r[2][1] + r[1][2]);
    let candidates =
        [[squares[0], wx, wy, wz], [wx, squares[1], xy, xz], [wy, xy, squares[2], yz], [wz, xz, yz, squares[3]]];
    let (mut best, mut q) = (squares[0], candidates[0]);
    for k in 1..4 {
        let better = best.lt(squares[k]);
        best = T::select(better, squares[k], best);
        for i in 0..4 {
            q[i] = T::select(better, candidates[k][i], q[i]);
        }
    }
    let scale = half.div(best.max(T::lit(1e-12)).sqrt());
    let negative = q[0].lt(T::zero());
    let scale = T::select(negative, -scale, scale);
    [q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale]
}
