//! The color of a point: sun, sky, bounce from the floor, occlusion by near objects, and some gloss.

use glam::DVec3;

use crate::ground::Footprint;
use crate::light::SUN_COLOR;
use crate::shape::Solid;
use crate::view::{OCCLUSION_REACH, View};

const SKY_POWER: f64 = 0.42;
/// Distance at which the haze replaces half of a surface's color, m per meter of ground cell.
const HAZE: f64 = 34.0;

/// Lambert's cosine with a rounded corner at the terminator.
fn soft_cosine(x: f64) -> f64 {
    const ROUND: f64 = 0.25;
    if x > ROUND { x } else { (x + ROUND).max(0.0) * (x + ROUND).max(0.0) / (4.0 * ROUND) }
}

impl View<'_> {
    /// Fraction of the sun that reaches `p`. `own` is the solid that `p` lies on.
    fn sun_at(&self, p: DVec3, own: Option<usize>) -> f64 {
        let mut visible = 1.0_f64;
        for &index in self.shadow_candidates(p) {
            let index = index as usize;
            let solid = &self.frame.solids[index];
            if Some(index) != own && !solid.ghost {
                let open = self.light.visible(solid, p);
                // parts of one body overlap: use the darkest, because a product would double the penumbra at joints
                visible = visible.min(1.0 - solid.alpha * (1.0 - open));
            }
        }
        visible
    }

    /// Fraction of the ambient light that reaches `p`, from balls at the nearest points of nearby rods.
    fn ambient_at(&self, p: DVec3, normal: DVec3, own: Option<usize>) -> f64 {
        let mut open = 1.0;
        for &index in self.nearby(p) {
            if Some(index as usize) == own || self.frame.solids[index as usize].ghost {
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

    /// Color of a plane at distance `t` along `d`, and the sun's fraction there.
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
        let Solid { color: albedo, ghost, .. } = self.frame.solids[index];
        let facing = normal.dot(light.sun);
        let lit = soft_cosine(facing);
        // a ghost lies within the character's shadow, which would hide it
        let (sun, open) = match ghost {
            true => (1.0, 1.0),
            false if lit > 0.0 => (self.sun_at(p, Some(index)), self.ambient_at(p, normal, Some(index))),
            false => (0.0, self.ambient_at(p, normal, Some(index))),
        };

        // close to the floor, bounced light comes from the character's own shadow
        let height = self.frame.planes.iter().map(|plane| plane.normal().dot(p - plane.pos).max(0.0));
        let height = height.fold(f64::INFINITY, f64::min) / self.frame.marks.cell;
        let grounded = if height.is_finite() { (height / (height + 0.12)).min(1.0) } else { 1.0 };
        let down = 0.5 - 0.5 * normal.z;
        let ambient = open * (1.0 - down * (1.0 - grounded)) * SKY_POWER * self.ambient_color(normal);
        let mut color = albedo * (sun * lit * light.sun_color + ambient);

        // gloss of the sun, and a rim of sky light that separates the character from the floor
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
