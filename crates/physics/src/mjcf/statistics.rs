//! Statistics of a model in its reference configuration, as MuJoCo computes them.

use super::math::*;
use super::pose::Pose;
use super::settings::GivenStatistics;
use crate::model::{Geom, GeomType, Model, Vec3};

/// Sets the statistics; `diagonal` is that of the mass matrix. Values from the file take precedence.
pub(crate) fn compute(model: &mut Model, pose: &Pose, diagonal: &[f64], given: &GivenStatistics) {
    let mut bounds = Bounds { low: [1e10; 3], high: [-1e10; 3] };
    for b in 1..model.bodies.len() {
        bounds.include(pose.body[b].pos, 0.0);
        bounds.include(pose.com[b], 0.0);
    }
    for joint in 0..model.joints.len() {
        bounds.include(pose.anchor(model, joint), 0.0);
    }
    for (i, site) in model.sites.iter().enumerate() {
        bounds.include(pose.body[site.body].point(model.site_frame(i).0), 0.0);
    }
    let radii: Vec<f64> = model.geoms.iter().map(|g| bounding_radius(model, g)).collect();
    for (i, (geom, &radius)) in model.geoms.iter().zip(&radii).enumerate() {
        // a plane counts with a tenth of the size that is drawn, an infinite one with a centimeter
        let drawn = geom.size[0].max(geom.size[1]);
        let radius = if radius > 0.0 {
            radius
        } else if drawn > 0.0 {
            0.1 * drawn
        } else {
            0.01
        };
        bounds.include(pose.body[geom.body].point(model.geom_frame(i).0), radius);
    }
    let stat = &mut model.stat;
    stat.center = scale(add(bounds.low, bounds.high), 0.5);
    if bounds.high[0] > bounds.low[0] {
        let size = sub(bounds.high, bounds.low);
        stat.extent = size[0].max(size[1]).max(size[2]).max(1e-5);
    }

    // length of a body: the farthest joint or geom from its center of mass
    let distance = |a: Vec3, b: Vec3| norm(sub(a, b));
    let mut length = vec![0.0f64; model.bodies.len()];
    for (i, joint) in model.joints.iter().enumerate() {
        let anchor = pose.body[joint.body].point(model.joints[i].pos);
        for b in [joint.body, model.bodies[joint.body].parent] {
            length[b] = length[b].max(distance(pose.com[b], anchor));
        }
    }
    for (i, (geom, radius)) in model.geoms.iter().zip(&radii).enumerate().filter(|(_, (g, r))| g.body > 0 && **r > 0.0)
    {
        let center = pose.body[geom.body].point(model.geom_frame(i).0);
        length[geom.body] = length[geom.body].max(radius + distance(pose.com[geom.body], center));
    }
    let moving = model.bodies.len() - 1;
    let stat = &mut model.stat;
    let mut mean_size = 0.2;
    if moving > 0 {
        mean_size = length[1..].iter().map(|l| l.max(1e-5)).sum::<f64>() / moving as f64;
        stat.mean_mass = model.bodies[1..].iter().map(|b| b.mass).sum::<f64>() / moving as f64;
    }
    stat.extent = stat.extent.max(2.0 * mean_size);
    if !diagonal.is_empty() {
        stat.mean_inertia = diagonal.iter().sum::<f64>() / diagonal.len() as f64;
    }

    stat.mean_inertia = given.mean_inertia.unwrap_or(stat.mean_inertia);
    stat.mean_mass = given.mean_mass.unwrap_or(stat.mean_mass);
    stat.extent = given.extent.unwrap_or(stat.extent);
    stat.center = given.center.unwrap_or(stat.center);
}

/// Radius of the sphere about a geom's center that contains it; 0 for a plane, and for a mesh without its file.
fn bounding_radius(model: &Model, geom: &Geom) -> f64 {
    let [a, b, c] = geom.size;
    match geom.kind {
        GeomType::Sphere => a,
        GeomType::Capsule => a + b,
        GeomType::Cylinder => (a * a + b * b).sqrt(),
        GeomType::Ellipsoid => a.max(b).max(c),
        GeomType::Box | GeomType::Mesh => norm(geom.size),
        GeomType::Hfield => geom.hfield.map_or(0.0, |h| {
            let [x, y, top, base] = model.hfields[h].size;
            norm([x, y, top.max(base)])
        }),
        GeomType::Plane => 0.0,
    }
}

/// Axis-aligned box that grows.
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    fn include(&mut self, pos: Vec3, radius: f64) {
        for k in 0..3 {
            self.low[k] = self.low[k].min(pos[k] - radius);
            self.high[k] = self.high[k].max(pos[k] + radius);
        }
    }
}
