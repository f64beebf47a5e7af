//! Spatial algebra restricted to the motions a model can make.
//!
//! The recursions of the solver are written over [`Space`]. In [`Full`] space a motion has six components. A planar
//! model (hopper, walker, cheetah: every joint slides in the x-z plane or turns about y) only uses three of them:
//! rotation about y and translation along x and z. The others are multiplied by exact zeros, so [`Planar`] leaves them
//! out: same numbers, a third of the work. The arrays keep their shape; unused components are never read.

use crate::algebra::spatial::*;
use crate::lanes::Real;

/// Selects the components of spatial vectors that are used.
pub(crate) trait Space: Copy + Send + Sync + 'static {
    /// Scalar product of a motion and a force.
    fn dot<T: Real>(a: &V6<T>, b: &V6<T>) -> T;
    /// `acc + s * x`.
    fn axpy<T: Real>(s: &V6<T>, x: T, acc: &V6<T>) -> V6<T>;
    /// `a += b`.
    fn add<T: Real>(a: &mut V6<T>, b: &V6<T>);
    /// `a -= b`.
    fn sub<T: Real>(a: &mut V6<T>, b: &V6<T>);
    /// `a += b` for symmetric matrices.
    fn add_sym<T: Real>(a: &mut Sym6<T>, b: &Sym6<T>);
    /// Symmetric matrix times a motion.
    fn mul<T: Real>(k: &Sym6<T>, s: &V6<T>) -> V6<T>;
    /// `s * x`.
    fn scale<T: Real>(s: &V6<T>, x: T) -> V6<T>;
    /// `k -= u v'` for `v` proportional to `u`.
    fn sub_outer<T: Real>(k: &mut Sym6<T>, u: &V6<T>, v: &V6<T>);
    /// Copies the used components.
    fn copy<T: Real>(to: &mut V6<T>, from: &V6<T>);
    /// Copies the used entries of a symmetric matrix.
    fn copy_sym<T: Real>(to: &mut Sym6<T>, from: &Sym6<T>);
    /// Momentum of a rigid body.
    fn momentum<T: Real>(i: &Inertia<T>, v: &V6<T>) -> V6<T>;
}

/// All six components.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Full;

/// Rotation about y, and translation along x and z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Planar;

impl Space for Full {
    #[inline(always)]
    fn dot<T: Real>(a: &V6<T>, b: &V6<T>) -> T {
        dot6(a, b)
    }
    #[inline(always)]
    fn axpy<T: Real>(s: &V6<T>, x: T, acc: &V6<T>) -> V6<T> {
        axpy6(s, x, acc)
    }
    #[inline(always)]
    fn add<T: Real>(a: &mut V6<T>, b: &V6<T>) {
        for i in 0..6 {
            a[i] += b[i];
        }
    }
    #[inline(always)]
    fn sub<T: Real>(a: &mut V6<T>, b: &V6<T>) {
        for i in 0..6 {
            a[i] -= b[i];
        }
    }
    #[inline(always)]
    fn add_sym<T: Real>(a: &mut Sym6<T>, b: &Sym6<T>) {
        for i in 0..21 {
            a[i] += b[i];
        }
    }
    #[inline(always)]
    fn mul<T: Real>(k: &Sym6<T>, s: &V6<T>) -> V6<T> {
        sym6_mul(k, s)
    }
    #[inline(always)]
    fn scale<T: Real>(s: &V6<T>, x: T) -> V6<T> {
        [s[0] * x, s[1] * x, s[2] * x, s[3] * x, s[4] * x, s[5] * x]
    }
    #[inline(always)]
    fn sub_outer<T: Real>(k: &mut Sym6<T>, u: &V6<T>, v: &V6<T>) {
        sym6_sub_outer(k, u, v);
    }
    #[inline(always)]
    fn copy<T: Real>(to: &mut V6<T>, from: &V6<T>) {
        *to = *from;
    }
    #[inline(always)]
    fn copy_sym<T: Real>(to: &mut Sym6<T>, from: &Sym6<T>) {
        *to = *from;
    }
    #[inline(always)]
    fn momentum<T: Real>(i: &Inertia<T>, v: &V6<T>) -> V6<T> {
        inertia_mul(i, v)
    }
}

/// Planar components: rotation about y, translation along x and z.
const COMPONENTS: [usize; 3] = [1, 3, 5];
/// Entries of a [`Sym6`] that couple the planar components: (y, y), (y, x), (y, z), (x, x), (z, z), (x, z).
const ENTRIES: [usize; 6] = [1, 9, 11, 15, 17, 19];

impl Space for Planar {
    #[inline(always)]
    fn dot<T: Real>(a: &V6<T>, b: &V6<T>) -> T {
        a[1].mul_add(b[1], a[3].mul_add(b[3], a[5] * b[5]))
    }
    #[inline(always)]
    fn axpy<T: Real>(s: &V6<T>, x: T, acc: &V6<T>) -> V6<T> {
        let z = T::zero();
        [z, s[1].mul_add(x, acc[1]), z, s[3].mul_add(x, acc[3]), z, s[5].mul_add(x, acc[5])]
    }
    #[inline(always)]
    fn add<T: Real>(a: &mut V6<T>, b: &V6<T>) {
        a[1] += b[1];
        a[3] += b[3];
        a[5] += b[5];
    }
    #[inline(always)]
    fn sub<T: Real>(a: &mut V6<T>, b: &V6<T>) {
        a[1] -= b[1];
        a[3] -= b[3];
        a[5] -= b[5];
    }
    #[inline(always)]
    fn add_sym<T: Real>(a: &mut Sym6<T>, b: &Sym6<T>) {
        for i in ENTRIES {
            a[i] += b[i];
        }
    }
    #[inline(always)]
    fn mul<T: Real>(k: &Sym6<T>, s: &V6<T>) -> V6<T> {
        let z = T::zero();
        [
            z,
            k[1].mul_add(s[1], k[9].mul_add(s[3], k[11] * s[5])),
            z,
            k[9].mul_add(s[1], k[15].mul_add(s[3], k[19] * s[5])),
            z,
            k[11].mul_add(s[1], k[19].mul_add(s[3], k[17] * s[5])),
        ]
    }
    #[inline(always)]
    fn scale<T: Real>(s: &V6<T>, x: T) -> V6<T> {
        let z = T::zero();
        [z, s[1] * x, z, s[3] * x, z, s[5] * x]
    }
    #[inline(always)]
    fn sub_outer<T: Real>(k: &mut Sym6<T>, u: &V6<T>, v: &V6<T>) {
        k[1] = u[1].neg_mul_add(v[1], k[1]);
        k[9] = u[1].neg_mul_add(v[3], k[9]);
        k[11] = u[1].neg_mul_add(v[5], k[11]);
        k[15] = u[3].neg_mul_add(v[3], k[15]);
        k[17] = u[5].neg_mul_add(v[5], k[17]);
        k[19] = u[3].neg_mul_add(v[5], k[19]);
    }
    #[inline(always)]
    fn copy<T: Real>(to: &mut V6<T>, from: &V6<T>) {
        for i in COMPONENTS {
            to[i] = from[i];
        }
    }
    #[inline(always)]
    fn copy_sym<T: Real>(to: &mut Sym6<T>, from: &Sym6<T>) {
        for i in ENTRIES {
            to[i] = from[i];
        }
    }
    #[inline(always)]
    fn momentum<T: Real>(i: &Inertia<T>, v: &V6<T>) -> V6<T> {
        let z = T::zero();
        let (w, x, y) = (v[1], v[3], v[5]);
        [
            z,
            i[5].mul_add(w, i[3].mul_add(x, -(i[1] * y))),
            z,
            i[0].mul_add(x, w * i[3]),
            z,
            i[0].mul_add(y, -(w * i[1])),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers<const N: usize>(seed: u64) -> [f64; N] {
        let mut s = seed;
        std::array::from_fn(|_| {
            s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (s >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        })
    }

    fn planar(mut v: V6<f64>) -> V6<f64> {
        v[0] = 0.0;
        v[2] = 0.0;
        v[4] = 0.0;
        v
    }

    #[test]
    fn planar_algebra_is_full_algebra_on_planar_motions() {
        for seed in 0..20 {
            let s = planar(numbers(seed));
            let f: V6<f64> = numbers(seed + 100);
            let mut k: Sym6<f64> = numbers(seed + 200);
            assert!((Planar::dot(&s, &f) - Full::dot(&s, &f)).abs() < 1e-15);
            let (a, b) = (Planar::mul(&k, &s), Full::mul(&k, &s));
            let inertia: Inertia<f64> = numbers(seed + 300);
            let (c, d) = (Planar::momentum(&inertia, &s), Full::momentum(&inertia, &s));
            for i in [1, 3, 5] {
                assert!((a[i] - b[i]).abs() < 1e-15 && (c[i] - d[i]).abs() < 1e-15);
            }
            let mut other = k;
            let v = Full::scale(&f, 0.7);
            Planar::sub_outer(&mut k, &f, &v);
            Full::sub_outer(&mut other, &f, &v);
            for i in ENTRIES {
                assert_eq!(k[i], other[i], "entry {i}");
            }
        }
    }
}
