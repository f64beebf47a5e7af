//! Light: sun with soft shadows, sky, bounce from the floor, occlusion where things come close, a little gloss.

use glam::DVec3;

use crate::bins::Rect;
use crate::ground::Footprint;
use crate::palette::{self, linear};
use crate::shape::{Shape, Solid};
use crate::view::{OCCLUSION_REACH, View};

/// Direction to the sun, not yet normalized: from the camera's side, behind the runner, high.
const SUN: [f64; 3] = [-0.55, -0.62, 1.25];
/// Tangent of the sun's angular radius; larger than the real one, for soft shadows.
const SUN_SIZE: f64 = 0.035;
const SUN_COLOR: [f64; 3] = [1.00, 0.93, 0.82];
const SUN_POWER: f64 = 0.98;
const SKY_POWER: f64 = 0.42;
/// Light rays toward the sun's disk for shapes without a closed form.
const SUN_RAYS: usize = 16;
/// Distance at which half of a surface's color has given way to the haze, m per meter of ground cell.
const HAZE: f64 = 34.0;

/// The lights of a picture.
pub(crate) struct Light {
    sun: DVec3,
    across: [DVec3; 2],
    disk: [DVec3; SUN_RAYS],
    sun_color: DVec3,
    horizon: DVec3,
    zenith: DVec3,
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

    /// Color of the sky; below the horizon it is the haze.
    #[inline]
    pub fn sky(&self, d: DVec3) -> DVec3 {
        let height = d.z.max(0.0);
        // quick near the horizon, slow toward the zenith, without a power function
        self.horizon.lerp(self.zenith, 1.0 - 1.0 / (1.0 + 5.0 * height))
    }

    /// Coordinates across the sun's direction.
    #[inline]
    pub fn project(&self, p: DVec3) -> [f64; 2] {
        [p.dot(self.across[0]), p.dot(self.across[1])]
    }

    /// Bounds, across the sun's direction, of what a solid can shade down to `floor`.
    pub fn shadow_rect(&self, solid: &Solid, floor: f64) -> Rect {
        let (a, b, radius) = solid.hull_rod();
        let drop = if floor.is_finite() { (a.z.max(b.z) + radius - floor).max(0.0) } else { 20.0 * radius };
        let margin = radius + SUN_SIZE * (drop / self.sun.z + radius);
        let (p, q) = (self.project(a), self.project(b));
        [[p[0].min(q[0]) - margin, p[1].min(q[1]) - margin], [p[0].max(q[0]) + margin, p[1].max(q[1]) + margin]]
    }

    /// Share of the sun's disk that `solid` leaves visible from `p`.
    fn visible(&self, solid: &Solid, p: DVec3) -> f64 {
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
        let blocked = self.disk.iter().filter(|&&d| solid.enter(p, d).is_some()).count();
        1.0 - blocked as f64 / SUN_RAYS as f64
    }
}

/// Share of the sun's disk left visible by a capsule, from the angular distance between its edge and the disk's center.
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
    // share of a disk on one side of a line, to within 2 percent
    x * x * (3.0 - 2.0 * x)
}

/// Lambert's cosine with its corner at the terminator rounded off.
fn soft_cosine(x: f64) -> f64 {
    const ROUND: f64 = 0.25;
    if x > ROUND { x } else { (x + ROUND).max(0.0) * (x + ROUND).max(0.0) / (4.0 * ROUND) }
}

impl View<'_> {
    /// Share of the sun that reaches `p`; `own` is the solid that `p` lies on.
    fn sun_at(&self, p: DVec3, own: Option<usize>) -> f64 {
        let mut visible = 1.0_f64;
        for &index in self.shadow_candidates(p) {
            let index = index as usize;
            if Some(index) != own {
                let solid = &self.frame.solids[index];
                let open = self.light.visible(solid, p);
                // parts of one body overlap: the darkest counts, a product would double the penumbra at joints
                visible = visible.min(1.0 - solid.alpha * (1.0 - open));
            }
        }
        visible
    }

    /// Share of the ambient light that reaches `p`, from balls at the nearest points of nearby rods.
    fn ambient_at(&self, p: DVec3, normal: DVec3, own: Option<usize>) -> f64 {
        let mut open = 1.0;
        for &index in self.nearby(p) {
            if Some(index as usize) == own {
                continue;
            }
            let rod = &self.rods[index as usize];
            let v = rod.b - rod.a;
            let length = v.length_squared();
            let s = if length > 0.0 { ((p - rod.a).dot(v) / length).clamp(0.0, 1.0) } else { 0.0 };
            let to = rod.a + s * v - p;
            let square = to.length_squared().max(rod.radius * rod.radius);
            let reach = OCCLUSION_REACH * OCCLUSION_REACH;
            // a ball of radius r at distance d hides cos * (r/d)^2; shifted so that it ends at the reach
            let ratio = (rod.radius * rod.radius / square - 1.0 / reach) / (1.0 - 1.0 / reach);
            if ratio > 0.0 {
                let cosine = (normal.dot(to) / square.sqrt()).max(0.0);
                open *= 1.0 - 0.85 * ratio * cosine * self.frame.solids[index as usize].alpha;
            }
        }
        open
    }

    /// Color of a plane at distance `t` along `d`, and the sun's share there.
    pub(crate) fn plane_color(&self, index: usize, t: f64, d: DVec3, ray: DVec3, pixel: f64) -> (DVec3, f32) {
        let plane = &self.frame.planes[index];
        let normal = plane.normal();
        let p = self.basis.eye + t * d;

        // derivatives of the hit point per pixel; k is the ray parameter of `ray`
        let slope = ray.dot(normal);
        let k = t / ray.length();
        let derivative = |axis: DVec3| pixel * k * (axis - ray * (axis.dot(normal) / slope));
        let (dx, dy) = (derivative(self.basis.right), derivative(self.basis.up));

        let level = normal.z > 0.999;
        let (u, v, local) = match level {
            true => (DVec3::X, DVec3::Y, p),
            false => (plane.rot.x_axis, plane.rot.y_axis, p - plane.pos),
        };
        let size = |axis: DVec3| dx.dot(axis).abs().max(dy.dot(axis).abs());
        let footprint = Footprint { at: [local.dot(u), local.dot(v)], size: [size(u), size(v)] };

        let albedo = self.ground.albedo(footprint, level);
        let sun = self.sun_at(p, None);
        let open = self.ambient_at(p, normal, None);
        let direct = sun * normal.dot(self.light.sun).max(0.0) * self.light.sun_color;
        let color = albedo * (direct + open * SKY_POWER * self.ambient_color(normal));
        (self.haze(color, t), sun as f32)
    }

    /// Color of a solid at `p`, seen along `d` from distance `t`.
    pub(crate) fn solid_color(&self, index: usize, p: DVec3, normal: DVec3, d: DVec3, t: f64) -> DVec3 {
        let light = &self.light;
        let albedo = self.frame.solids[index].color;
        let facing = normal.dot(light.sun);
        let lit = soft_cosine(facing);
        let sun = if lit > 0.0 { self.sun_at(p, Some(index)) } else { 0.0 };
        let open = self.ambient_at(p, normal, Some(index));

        // close to the floor its light comes from the runner's own shade
        let height = self.frame.planes.iter().map(|plane| plane.normal().dot(p - plane.pos).max(0.0));
        let height = height.fold(f64::INFINITY, f64::min) / self.frame.marks.cell;
        let grounded = if height.is_finite() { (height / (height + 0.12)).min(1.0) } else { 1.0 };
        let down = 0.5 - 0.5 * normal.z;
        let ambient = open * (1.0 - down * (1.0 - grounded)) * SKY_POWER * self.ambient_color(normal);
        let mut color = albedo * (sun * lit * light.sun_color + ambient);

        // gloss of the sun, and the sky's rim that sets the figure off against the floor
        let half = (light.sun - d).normalize();
        let gloss = normal.dot(half).max(0.0);
        let gloss = (0..5).fold(gloss, |power, _| power * power);
        color += 0.22 * sun * gloss * light.sun_color;
        let rim = 1.0 + normal.dot(d).min(0.0);
        color += 0.22 * open * rim * rim * rim * (0.4 + 0.6 * (1.0 - down)) * light.horizon;
        self.haze(color, t)
    }

    /// Sky from above, bounce from the floor below, without occlusion.
    fn ambient_color(&self, normal: DVec3) -> DVec3 {
        let sky = self.light.horizon.lerp(self.light.zenith, 0.45);
        let bounce = 0.9 * self.ground.mean() * DVec3::from_array(SUN_COLOR);
        bounce.lerp(sky, 0.5 + 0.5 * normal.z)
    }

    fn haze(&self, color: DVec3, t: f64) -> DVec3 {
        let x = t / (HAZE * self.frame.marks.cell);
        self.light.horizon.lerp(color, 1.0 / (1.0 + x * x))
    }
}
