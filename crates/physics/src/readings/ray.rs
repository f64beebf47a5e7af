//! A ray and its hits: the nearest hit so far, points on the ray, the faces of a box.

use crate::algebra::spatial::*;
use crate::lanes::Real;

/// Below this a direction or a discriminant counts as zero (MuJoCo's `mjMINVAL`).
pub(super) const TINY: f64 = 1e-15;

/// The hit of a ray on a shape.
#[derive(Clone, Copy)]
pub(super) struct Hit<T> {
    /// Distance; -1 without a hit.
    pub dist: T,
    /// Outward normal of the surface there; zero without a hit.
    pub normal: V3<T>,
}

impl<T: Real> Hit<T> {
    #[inline(always)]
    pub fn none() -> Self {
        Hit { dist: T::lit(-1.0), normal: [T::zero(); 3] }
    }

    /// Takes a hit at `x` in the lanes `ok`, if it is ahead and closer than the current one.
    #[inline(always)]
    pub fn offer(&mut self, ok: T::Mask, x: T, normal: &V3<T>) {
        let z = T::zero();
        let nearer = T::or(self.dist.lt(z), x.lt(self.dist));
        let take = T::and(T::and(ok, T::not(x.lt(z))), nearer);
        self.dist = T::select(take, x, self.dist);
        for k in 0..3 {
            self.normal[k] = T::select(take, normal[k], self.normal[k]);
        }
    }
}

/// Point on a ray.
#[inline(always)]
pub(super) fn along<T: Real>(p: &V3<T>, d: &V3<T>, x: T) -> V3<T> {
    [d[0].mul_add(x, p[0]), d[1].mul_add(x, p[1]), d[2].mul_add(x, p[2])]
}

#[inline(always)]
pub(super) fn normalized<T: Real>(v: &V3<T>) -> V3<T> {
    let inv = dot(v, v).max(T::lit(1e-30)).sqrt().recip();
    [v[0] * inv, v[1] * inv, v[2] * inv]
}

/// Face `2 axis` (negative side) or `2 axis + 1` of a box: distance, lanes with a hit (ahead or behind), normal.
#[inline(always)]
pub(super) fn ray_face<T: Real>(size: &V3<T>, p: &V3<T>, d: &V3<T>, face: usize) -> (T, T::Mask, V3<T>) {
    let (k, side) = (face / 2, if face.is_multiple_of(2) { T::lit(-1.0) } else { T::lit(1.0) });
    let crosses = T::lit(TINY).lt(d[k].abs());
    let x = (side * size[k] - p[k]).div(T::select(crosses, d[k], T::lit(1.0)));
    let at = along(p, d, x);
    let mut ok = crosses;
    for i in [(k + 1) % 3, (k + 2) % 3] {
        ok = T::and(ok, T::not(size[i].lt(at[i].abs())));
    }
    let mut normal = [T::zero(); 3];
    normal[k] = side;
    (x, ok, normal)
}
