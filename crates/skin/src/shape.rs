//! Solids in world coordinates, and the signed distance to them.
//!
//! Distances are negative inside, in m. Those of balls, rods of one radius, boxes and cylinders are exact. The formulas
//! are those of Inigo Quilez, "Distance functions" (iquilezles.org/articles/distfunctions).

use glam::{DQuat, DVec3};

/// A solid without sharp edges.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    /// A capsule whose radius changes evenly from one end to the other. A ball if both ends coincide.
    Rod { ends: [DVec3; 2], radii: [f64; 2] },
    /// A rod that sweeps from one segment to another.
    Sheet { from: [DVec3; 2], to: [DVec3; 2], radii: [f64; 2] },
    /// A box with rounded edges.
    Box { center: DVec3, turn: DQuat, half: DVec3, round: f64 },
    /// A cylinder along its z axis with rounded rims.
    Cylinder { center: DVec3, turn: DQuat, radius: f64, half: f64, round: f64 },
    /// An ellipsoid.
    Ellipsoid { center: DVec3, turn: DQuat, semi: DVec3 },
}

/// The signed distance at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// Signed distance, m.
    pub distance: f64,
    /// Direction in which the distance grows, a unit vector.
    pub gradient: DVec3,
    /// Place along the shape: 0 at its first end, 1 at its second.
    pub along: f64,
}

/// The axis of a shape that a link can start from, and the radius about it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub ends: [DVec3; 2],
    pub radius: f64,
}

impl Shape {
    pub fn ball(center: DVec3, radius: f64) -> Self {
        Shape::Rod { ends: [center; 2], radii: [radius; 2] }
    }

    /// Signed distance, gradient, and place along the shape.
    pub fn sample(&self, p: DVec3) -> Sample {
        match *self {
            Shape::Rod { ends: [a, b], radii } => {
                let t = nearest_on(a, b, p);
                tube(p, a + t * (b - a), radii[0] + t * (radii[1] - radii[0]), t)
            }
            Shape::Sheet { from, to, radii } => {
                let (mut t, mut q) = (0.5, DVec3::ZERO);
                // the sheet is nearly flat, so turns between its two directions converge quickly
                for _ in 0..4 {
                    let a = from[0].lerp(to[0], t);
                    let b = from[1].lerp(to[1], t);
                    let s = nearest_on(a, b, p);
                    let (low, high) = (from[0].lerp(from[1], s), to[0].lerp(to[1], s));
                    t = nearest_on(low, high, p);
                    q = low.lerp(high, t);
                }
                tube(p, q, radii[0] + t * (radii[1] - radii[0]), t)
            }
            Shape::Box { center, turn, half, round } => {
                let local = turn.conjugate() * (p - center);
                let q = local.abs() - (half - round);
                let out = q.max(DVec3::ZERO);
                let sign = DVec3::new(sign(local.x), sign(local.y), sign(local.z));
                let length = out.length();
                let gradient = if length > 0.0 { out / length } else { largest(q) };
                sample(length + q.max_element().min(0.0) - round, turn * (sign * gradient))
            }
            Shape::Cylinder { center, turn, radius, half, round } => {
                let local = turn.conjugate() * (p - center);
                let around = DVec3::new(local.x, local.y, 0.0);
                let across = around.length();
                let (q, z) = (across - (radius - round), local.z.abs() - (half - round));
                let side = if across > 0.0 { around / across } else { DVec3::X };
                let cap = DVec3::new(0.0, 0.0, sign(local.z));
                let (x, y) = (q.max(0.0), z.max(0.0));
                let length = (x * x + y * y).sqrt();
                let gradient = match (length > 0.0, q > z) {
                    (true, _) => (x * side + y * cap) / length,
                    (false, true) => side,
                    (false, false) => cap,
                };
                sample(length + q.max(z).min(0.0) - round, turn * gradient)
            }
            Shape::Ellipsoid { center, turn, semi } => {
                let local = turn.conjugate() * (p - center);
                let (scaled, steep) = (local / semi, local / (semi * semi));
                let (k0, k1) = (scaled.length(), steep.length());
                if k1 < 1e-12 {
                    return sample(-semi.min_element(), turn * DVec3::Z);
                }
                // to first order: exact on the surface, too large far outside
                sample(k0 * (k0 - 1.0) / k1, turn * (steep / k1))
            }
        }
    }

    /// Center and radius of a ball that holds the shape.
    pub fn bounds(&self) -> (DVec3, f64) {
        match *self {
            Shape::Rod { ends: [a, b], radii } => (0.5 * (a + b), 0.5 * a.distance(b) + radii[0].max(radii[1])),
            Shape::Sheet { from, to, radii } => {
                let center = 0.25 * (from[0] + from[1] + to[0] + to[1]);
                let corners = [from[0], from[1], to[0], to[1]];
                let reach = corners.iter().fold(0.0_f64, |most, corner| most.max(corner.distance(center)));
                (center, reach + radii[0].max(radii[1]))
            }
            Shape::Box { center, half, .. } => (center, half.length()),
            Shape::Cylinder { center, radius, half, .. } => (center, (radius * radius + half * half).sqrt()),
            Shape::Ellipsoid { center, semi, .. } => (center, semi.max_element()),
        }
    }

    /// A rod inside the shape, from which links to other shapes start.
    pub fn axis(&self) -> Axis {
        let along = |center: DVec3, turn: DQuat, axis: DVec3, half: f64, radius: f64| {
            let way = turn * (axis * (half - radius).max(0.0));
            Axis { ends: [center - way, center + way], radius }
        };
        match *self {
            Shape::Rod { ends, radii } => Axis { ends, radius: radii[0].min(radii[1]) },
            Shape::Sheet { from, to, radii } => {
                let ends = [0.5 * (from[0] + from[1]), 0.5 * (to[0] + to[1])];
                Axis { ends, radius: radii[0].min(radii[1]) }
            }
            Shape::Box { center, turn, half, .. } => {
                along(center, turn, largest(half), half.max_element(), half.min_element())
            }
            Shape::Cylinder { center, turn, radius, half, .. } => along(center, turn, DVec3::Z, half, radius.min(half)),
            Shape::Ellipsoid { center, turn, semi } => {
                along(center, turn, largest(semi), semi.max_element(), semi.min_element())
            }
        }
    }

    /// Surface, m2, roughly: for the size of the grid.
    pub fn area(&self) -> f64 {
        let round = |r: f64| 12.6 * r * r;
        match *self {
            Shape::Rod { ends: [a, b], radii } => {
                let r = 0.5 * (radii[0] + radii[1]);
                6.3 * r * a.distance(b) + round(r)
            }
            Shape::Sheet { from, to, .. } => 2.0 * from[0].distance(from[1]) * from[0].distance(to[0]),
            Shape::Box { half: h, .. } => 8.0 * (h.x * h.y + h.y * h.z + h.z * h.x),
            Shape::Cylinder { radius, half, .. } => 6.3 * radius * (radius + 2.0 * half),
            Shape::Ellipsoid { semi: s, .. } => 4.2 * (s.x * s.y + s.y * s.z + s.z * s.x),
        }
    }

    /// The same shape, at least this thick, m.
    pub fn thickened(self, least: f64) -> Self {
        match self {
            Shape::Rod { ends, radii } => Shape::Rod { ends, radii: radii.map(|r| r.max(least)) },
            Shape::Sheet { from, to, radii } => Shape::Sheet { from, to, radii: radii.map(|r| r.max(least)) },
            Shape::Box { center, turn, half, round } => {
                let half = half.max(DVec3::splat(least));
                Shape::Box { center, turn, half, round: round.max(0.35 * least).min(half.min_element()) }
            }
            Shape::Cylinder { center, turn, radius, half, round } => {
                let (radius, half) = (radius.max(least), half.max(least));
                Shape::Cylinder { center, turn, radius, half, round: round.max(0.35 * least).min(radius.min(half)) }
            }
            Shape::Ellipsoid { center, turn, semi } => {
                Shape::Ellipsoid { center, turn, semi: semi.max(DVec3::splat(least)) }
            }
        }
    }
}

fn sample(distance: f64, gradient: DVec3) -> Sample {
    Sample { distance, gradient, along: 0.5 }
}

/// Distance to a ball of radius `r` about `q`, which lies at `along` of a rod.
fn tube(p: DVec3, q: DVec3, r: f64, along: f64) -> Sample {
    let way = p - q;
    let length = way.length();
    let gradient = if length > 1e-12 { way / length } else { DVec3::Z };
    Sample { distance: length - r, gradient, along }
}

/// Place of the point of a segment that is nearest to `p`, from 0 to 1.
pub(crate) fn nearest_on(a: DVec3, b: DVec3, p: DVec3) -> f64 {
    let way = b - a;
    let square = way.length_squared();
    if square > 1e-18 { ((p - a).dot(way) / square).clamp(0.0, 1.0) } else { 0.0 }
}

/// The axis of the largest entry.
fn largest(v: DVec3) -> DVec3 {
    match (v.x >= v.y && v.x >= v.z, v.y >= v.z) {
        (true, _) => DVec3::X,
        (false, true) => DVec3::Y,
        (false, false) => DVec3::Z,
    }
}

fn sign(x: f64) -> f64 {
    if x < 0.0 { -1.0 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> Vec<Shape> {
        let turn = DQuat::from_xyzw(0.2, -0.4, 0.1, 0.8).normalize();
        let center = DVec3::new(0.3, -0.1, 0.2);
        let at = |x, y, z| center + DVec3::new(x, y, z);
        vec![
            Shape::ball(center, 0.2),
            Shape::Rod { ends: [at(0.0, 0.0, 0.0), at(0.3, 0.1, 0.4)], radii: [0.1, 0.1] },
            Shape::Sheet {
                from: [at(0.0, -0.2, 0.0), at(0.0, 0.2, 0.0)],
                to: [at(0.0, -0.1, 0.3), at(0.0, 0.1, 0.3)],
                radii: [0.1, 0.1],
            },
            Shape::Box { center, turn, half: DVec3::new(0.1, 0.2, 0.3), round: 0.04 },
            Shape::Cylinder { center, turn, radius: 0.2, half: 0.3, round: 0.05 },
        ]
    }

    fn points() -> impl Iterator<Item = DVec3> {
        (0..343).map(|i| DVec3::new((i % 7) as f64, (i / 7 % 7) as f64, (i / 49) as f64) * 0.23 - 0.6)
    }

    /// From outside, a step of the distance against the gradient ends on the surface. Only a real distance does so.
    #[test]
    fn a_step_of_the_distance_ends_on_the_surface() {
        for shape in shapes() {
            for p in points() {
                let Sample { distance, gradient, .. } = shape.sample(p);
                assert!((gradient.length() - 1.0).abs() < 1e-9);
                if distance > 0.0 {
                    let left = shape.sample(p - distance * gradient).distance;
                    assert!(left.abs() < 1e-6, "{shape:?}: {left} m left from {p}");
                }
            }
        }
    }

    #[test]
    fn known_points_have_known_distances() {
        let box_ =
            Shape::Box { center: DVec3::ZERO, turn: DQuat::IDENTITY, half: DVec3::new(1.0, 2.0, 3.0), round: 0.1 };
        assert!((box_.sample(DVec3::new(1.5, 0.0, 0.0)).distance - 0.5).abs() < 1e-12);
        assert!((box_.sample(DVec3::new(0.5, 0.0, 0.0)).distance + 0.5).abs() < 1e-12);
        let rod = Shape::Rod { ends: [DVec3::ZERO, 2.0 * DVec3::Z], radii: [0.5, 0.3] };
        let side = rod.sample(DVec3::new(1.0, 0.0, 1.0));
        assert!((side.distance - 0.6).abs() < 1e-12 && (side.along - 0.5).abs() < 1e-12);
        let egg = Shape::Ellipsoid { center: DVec3::ZERO, turn: DQuat::IDENTITY, semi: DVec3::new(1.0, 2.0, 3.0) };
        for p in [DVec3::X, 2.0 * DVec3::Y, -3.0 * DVec3::Z] {
            assert!(egg.sample(p).distance.abs() < 1e-12);
        }
        assert!(egg.sample(DVec3::ZERO).distance < -0.9 && egg.sample(DVec3::splat(3.0)).distance > 0.5);
    }

    #[test]
    fn every_inside_point_lies_in_the_bounds() {
        for shape in shapes() {
            let (center, radius) = shape.bounds();
            for p in points().filter(|p| shape.sample(*p).distance < 0.0) {
                assert!(p.distance(center) <= radius + 1e-12, "{shape:?}");
            }
        }
    }
}
