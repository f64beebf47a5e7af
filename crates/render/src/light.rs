//! The lights of a picture: the sun, whose disk is wide enough for soft shadows, and the sky.

use glam::DVec3;

use crate::bins::Rect;
use crate::palette::{self, linear};
use crate::shape::{Shape, Solid};

/// Direction to the sun, not yet normalized: from the camera's side, behind the character, high.
const SUN: [f64; 3] = [-0.55, -0.62, 1.25];
/// Tangent of the sun's angular radius; larger than the real one, for soft shadows.
const SUN_SIZE: f64 = 0.035;
pub(crate) const SUN_COLOR: [f64; 3] = [1.00, 0.93, 0.82];
const SUN_POWER: f64 = 0.98;
/// Light rays toward the sun's disk for shapes without a closed form.
const SUN_RAYS: usize = 16;
/// The last of these, which are at the edge of the disk.
const EDGE_RAYS: usize = 5;

/// The lights of a picture.
pub(crate) struct Light {
    pub sun: DVec3,
    across: [DVec3; 2],
    disk: [DVec3; SUN_RAYS],
    pub sun_color: DVec3,
    pub horizon: DVec3,
    pub zenith: DVec3,
}

impl Light {
    pub fn new() -> Self {
        let sun = DVec3::from_array(SUN).normalize();
        let side = sun.cross(DVec3::Z).normalize();
        let across = [side, sun.cross(side)];
        // a sunflower of directions fills the disk evenly (Vogel 1979)
        let disk = std::array::from_fn(|i| {
            let radius = SUN_SIZE * ((i as f64 + 0.5) / SUN_RAYS as f64).sqrt();
            let angle = i as f64 * 2.399_963_229_728_653;
            (sun + radius * (libm::cos(angle) * across[0] + libm::sin(angle) * across[1])).normalize()
        });
        let [horizon, zenith] = palette::SKY.map(linear);
        Self { sun, across, disk, sun_color: SUN_POWER * DVec3::from_array(SUN_COLOR), horizon, zenith }
    }

    /// Color of the sky. Below the horizon it is the haze.
    #[inline]
    pub fn sky(&self, d: DVec3) -> DVec3 {
        let height = d.z.max(0.0);
        // a fast change near the horizon, a slow one toward the zenith, without a power function
        self.horizon.lerp(self.zenith, 1.0 - 1.0 / (1.0 + 5.0 * height))
    }

    /// Coordinates perpendicular to the sun's direction.
    #[inline]
    pub fn project(&self, p: DVec3) -> [f64; 2] {
        [p.dot(self.across[0]), p.dot(self.across[1])]
    }

    /// Bounds, perpendicular to the sun's direction, of the area that a solid can shade down to `floor`.
    pub fn shadow_rect(&self, solid: &Solid, floor: f64) -> Rect {
        let (a, b, radius) = solid.hull_rod();
        let drop = if floor.is_finite() { (a.z.max(b.z) + radius - floor).max(0.0) } else { 20.0 * radius };
        let margin = radius + SUN_SIZE * (drop / self.sun.z + radius);
        let (p, q) = (self.project(a), self.project(b));
        [[p[0].min(q[0]) - margin, p[1].min(q[1]) - margin], [p[0].max(q[0]) + margin, p[1].max(q[1]) + margin]]
    }

    /// Fraction of the sun's disk that `solid` leaves visible from `p`.
    pub fn visible(&self, solid: &Solid, p: DVec3) -> f64 {
        if let Shape::Sphere { .. } | Shape::Capsule { .. } = solid.shape {
            let (a, b, radius) = solid.hull_rod();
            return rod_visibility(p, self.sun, a, b, radius);
        }
        // far from the beam: nothing to test
        let to = solid.pos - p;
        let along = to.dot(self.sun);
        let reach = solid.shape.bounding_radius() + SUN_SIZE * along.max(0.0);
        if along < -reach || (to - along * self.sun).length_squared() > reach * reach {
            return 1.0;
        }
        let stopped = |rays: &[DVec3]| rays.iter().filter(|d| solid.stops(p, **d)).count();
        let (inner, edge) = self.disk.split_at(SUN_RAYS - EDGE_RAYS);
        if solid.mesh.is_some() {
            let (a, b, radius) = solid.hull_rod();
            if rod_visibility(p, self.sun, a, b, radius) >= 1.0 {
                return 1.0;
            }
        }
        let mut blocked = stopped(edge);
        // where the edge of the disk sees all or nothing of a mesh, so does the rest
        if solid.mesh.is_none() || (1..EDGE_RAYS).contains(&blocked) {
            blocked += stopped(inner);
        } else if blocked == EDGE_RAYS {
            return 0.0;
        }
        1.0 - blocked as f64 / SUN_RAYS as f64
    }
}

/// Fraction of the sun's disk left visible by a capsule, from the angular distance between its edge and the disk's
/// center.
fn rod_visibility(p: DVec3, sun: DVec3, a: DVec3, b: DVec3, radius: f64) -> f64 {
    // closest points of the half line p + t * sun and the segment a-b
    let (w, v) = (p - a, b - a);
    let (bb, c, d, e) = (sun.dot(v), v.dot(v), w.dot(sun), w.dot(v));
    let free = c - bb * bb;
    let mut s = if free > 1e-12 { ((e - bb * d) / free).clamp(0.0, 1.0) } else { 0.0 };
    let mut t = s * bb - d;
    if t < 0.0 {
        t = 0.0;
        s = if c > 0.0 { (e / c).clamp(0.0, 1.0) } else { 0.0 };
    }
    let gap = (w + t * sun - s * v).length() - radius;
    let x = (0.5 + 0.5 * gap / (SUN_SIZE * t).max(1e-6)).clamp(0.0, 1.0);
    // fraction of a disk on one side of a line, with an error below 2 percent
    x * x * (3.0 - 2.0 * x)
}
