//! Support points: the point of a shape that is farthest along a direction.

use super::super::{Rot, V3};
use super::polyhedron::Polyhedron;
use super::vector::*;

/// A convex shape without its place.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Form<'a, S> {
    Sphere {
        radius: S,
    },
    Capsule {
        radius: S,
        half: S,
    },
    Ellipsoid {
        half: V3<S>,
    },
    Cylinder {
        radius: S,
        half: S,
    },
    Cuboid {
        half: V3<S>,
    },
    Hull(&'a Polyhedron<S>),
    /// Three columns of a height field over one triangle: the corners of the base, then those of the top. They are not
    /// relative to the shape's place.
    Prism([V3<S>; 6]),
}

/// A convex shape at its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solid<'a, S> {
    pub center: V3<S>,
    pub axes: Rot<S>,
    pub form: Form<'a, S>,
}

/// A shape during a search: a [`Solid`], shrunk or inflated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape<'a, S> {
    pub solid: Solid<'a, S>,
    /// Whether a sphere is a point and a capsule a segment.
    pub shrunk: bool,
    /// Added all around.
    pub inflation: S,
    /// Corner of a hull found last.
    hint: Option<usize>,
}

/// A support point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Support<S> {
    pub point: V3<S>,
    /// The point without the inflation.
    pub core: V3<S>,
    /// Number of the corner, of a box or hull; of the cap, of a cylinder; of the level, of a prism; else -1.
    pub index: i32,
}

/// Square of the length below which a direction's part has no direction of its own.
const NONE: f64 = 1e-30;

impl<'a, S: Number> Solid<'a, S> {
    /// The shape during a search, not shrunk and not inflated.
    pub(super) fn shape(&self) -> Shape<'a, S> {
        Shape { solid: *self, shrunk: false, inflation: S::zero(), hint: None }
    }

    /// A point inside.
    pub(super) fn inside(&self) -> V3<S> {
        match &self.form {
            Form::Prism(corners) => {
                let mut sum = corners[0];
                for corner in &corners[1..] {
                    sum = add(&sum, corner);
                }
                scale(&sum, S::lit(1.0 / 6.0))
            }
            _ => self.center,
        }
    }

    /// Radius of a sphere or capsule: what is left when it is shrunk.
    pub(super) fn radius(&self) -> Option<S> {
        match self.form {
            Form::Sphere { radius } | Form::Capsule { radius, .. } => Some(radius),
            _ => None,
        }
    }

    /// Whether the shape has finitely many support points.
    pub(super) fn is_discrete(&self) -> bool {
        matches!(self.form, Form::Cuboid { .. } | Form::Hull(_) | Form::Prism(_))
    }

    /// Local coordinates in the outer frame.
    #[inline]
    pub(super) fn outer(&self, local: &V3<S>) -> V3<S> {
        add(&turn(&self.axes, local), &self.center)
    }

    /// A corner of a box. Bit `k` of its number is its side along axis `k`.
    pub(super) fn corner(half: &V3<S>, number: i32) -> V3<S> {
        let side = |k: usize| if number >> k & 1 == 1 { half[k] } else { -half[k] };
        [side(0), side(1), side(2)]
    }
}

impl<S: Number> Shape<'_, S> {
    /// The point farthest along a unit direction.
    pub(super) fn support(&mut self, direction: &V3<S>) -> Support<S> {
        let mut found = self.core_support(direction);
        if S::zero() < self.inflation {
            found.point = along(&found.point, direction, self.inflation);
        }
        found
    }

    fn core_support(&mut self, direction: &V3<S>) -> Support<S> {
        let (solid, zero) = (&self.solid, S::zero());
        if let Form::Prism(corners) = &solid.form {
            return prism_support(corners, direction);
        }
        if let Form::Sphere { radius } = solid.form {
            let point = if self.shrunk { solid.center } else { along(&solid.center, direction, radius) };
            return Support { point, core: point, index: -1 };
        }
        let d = into_local(&solid.axes, direction);
        let up = |half: S| if d[2] < zero { -half } else { half };
        let mut index = -1;
        let local = match solid.form {
            Form::Capsule { half, .. } if self.shrunk => [zero, zero, up(half)],
            Form::Capsule { radius, half } => [d[0] * radius, d[1] * radius, d[2] * radius + up(half)],
            Form::Ellipsoid { half } => {
                let s = [d[0] * half[0], d[1] * half[1], d[2] * half[2]];
                let square = dot(&s, &s);
                if square < S::lit(NONE) {
                    [half[0], zero, zero]
                } else {
                    let k = S::lit(1.0).div(square.sqrt());
                    [s[0] * (k * half[0]), s[1] * (k * half[1]), s[2] * (k * half[2])]
                }
            }
            Form::Cylinder { radius, half } => {
                index = i32::from(d[2] < zero);
                let square = d[0] * d[0] + d[1] * d[1];
                let k = if square < S::lit(NONE) { zero } else { radius.div(square.sqrt()) };
                [d[0] * k, d[1] * k, up(half)]
            }
            Form::Cuboid { half } => {
                index = (0..3).map(|k| i32::from(!(d[k] < zero)) << k).sum();
                Solid::corner(&half, index)
            }
            Form::Hull(hull) => {
                let found = hull.farthest(&d, self.hint);
                self.hint = Some(found);
                index = found as i32;
                hull.vertices[found]
            }
            Form::Sphere { .. } | Form::Prism(_) => [zero; 3],
        };
        let point = self.solid.outer(&local);
        Support { point, core: point, index }
    }
}

/// Of a prism, the sign of the direction chooses the base or the top.
fn prism_support<S: Number>(corners: &[V3<S>; 6], direction: &V3<S>) -> Support<S> {
    let first = if direction[2] < S::zero() { 0 } else { 3 };
    let mut best = first;
    let mut most = dot(&corners[first], direction);
    for i in first + 1..first + 3 {
        let reach = dot(&corners[i], direction);
        if most < reach {
            (best, most) = (i, reach);
        }
    }
    Support { point: corners[best], core: corners[best], index: -1 }
}
