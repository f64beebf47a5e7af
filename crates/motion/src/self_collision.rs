//! Self-collision: pairs of geoms of a model that must not overlap, and their separation. Supports only spheres and
//! capsules, which ragdolls consist of.

use crate::kinematics::Pose;
use crate::rotation::quat;
use glam::DVec3;
use marathon_physics::model::{GeomType, Model};

/// A sphere or a capsule: all points within `radius` of a line.
#[derive(Clone, Debug)]
struct Capsule {
    body: usize,
    /// Ends in the body's frame.
    ends: [DVec3; 2],
    radius: f64,
}

/// Two geoms that must not overlap.
#[derive(Clone, Debug)]
pub(crate) struct CapsulePair {
    a: Capsule,
    b: Capsule,
}

/// Separation of two geoms.
pub(crate) struct Separation {
    /// Distance between the surfaces, m; negative where they overlap.
    pub distance: f64,
    /// The bodies.
    pub bodies: [usize; 2],
    /// The nearest points of the geoms' lines.
    pub points: [DVec3; 2],
    /// Direction from the second to the first.
    pub normal: DVec3,
}

impl CapsulePair {
    /// All pairs of moving geoms that collide by MuJoCo's rules, except those that overlap in the reference pose.
    pub fn all(model: &Model) -> Vec<CapsulePair> {
        let capsules: Vec<(usize, Capsule)> =
            (0..model.geoms.len()).filter_map(|i| Some((i, capsule(model, i)?))).collect();
        let rest = Pose::of(model, &model.qpos0);
        let mut pairs = Vec::new();
        for (k, (i, a)) in capsules.iter().enumerate() {
            for (j, b) in &capsules[k + 1..] {
                let (g, h) = (&model.geoms[*i], &model.geoms[*j]);
                let [p, q] = [g.body, h.body].map(|body| model.bodies[body].weld_id);
                let parent = |body: usize| model.bodies[model.bodies[body].parent].weld_id;
                let related = p == q || model.opt.flags.filterparent && (parent(p) == q || parent(q) == p);
                let masks = g.contype & h.conaffinity != 0 || h.contype & g.conaffinity != 0;
                let bodies = [g.body.min(h.body), g.body.max(h.body)];
                if related || !masks || model.excludes.contains(&bodies) {
                    continue;
                }
                let pair = CapsulePair { a: a.clone(), b: b.clone() };
                if pair.separation(&rest).distance > 0.0 {
                    pairs.push(pair);
                }
            }
        }
        pairs
    }

    /// Separation of the two geoms in a pose.
    pub fn separation(&self, pose: &Pose) -> Separation {
        let line = |capsule: &Capsule| capsule.ends.map(|end| pose.point(capsule.body, end));
        let points = nearest(line(&self.a), line(&self.b));
        let apart = points[0] - points[1];
        let distance = apart.length();
        // crossing lines have no direction; any direction separates them
        let normal = if distance > 1e-9 { apart / distance } else { DVec3::Z };
        Separation {
            distance: distance - self.a.radius - self.b.radius,
            bodies: [self.a.body, self.b.body],
            points,
            normal,
        }
    }
}

fn capsule(model: &Model, geom: usize) -> Option<Capsule> {
    let geom = &model.geoms[geom];
    let half = match geom.kind {
        GeomType::Sphere => 0.0,
        GeomType::Capsule => geom.size[1],
        _ => return None,
    };
    if model.bodies[geom.body].weld_id == 0 {
        return None;
    }
    let (pos, axis) = (DVec3::from_array(geom.pos), quat(&geom.quat) * DVec3::Z * half);
    Some(Capsule { body: geom.body, ends: [pos + axis, pos - axis], radius: geom.size[0] })
}

/// The nearest points of two line segments (Ericson, Real-Time Collision Detection, 5.1.9).
fn nearest([p1, q1]: [DVec3; 2], [p2, q2]: [DVec3; 2]) -> [DVec3; 2] {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, f) = (d1.dot(d1), d2.dot(d2), d2.dot(r));
    let tiny = 1e-12;
    let (s, t);
    if a <= tiny && e <= tiny {
        (s, t) = (0.0, 0.0);
    } else if a <= tiny {
        (s, t) = (0.0, (f / e).clamp(0.0, 1.0));
    } else {
        let c = d1.dot(r);
        if e <= tiny {
            (s, t) = ((-c / a).clamp(0.0, 1.0), 0.0);
        } else {
            let b = d1.dot(d2);
            let denominator = a * e - b * b;
            let first = if denominator > tiny { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.5 };
            let along = (b * first + f) / e;
            t = along.clamp(0.0, 1.0);
            s = if along == t { first } else { ((b * t - c) / a).clamp(0.0, 1.0) };
        }
    }
    [p1 + d1 * s, p2 + d2 * t]
}

#[cfg(test)]
mod tests {
    use super::nearest;
    use glam::DVec3;

    #[test]
    fn no_points_of_two_lines_are_nearer_than_the_nearest() {
        let v = |k: u64| {
            let part = |k: u64| ((k.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f64) / f64::from(1 << 24) - 0.5;
            DVec3::new(part(k), part(k + 1), part(k + 2))
        };
        for k in 0..200 {
            let ([a, b], [c, d]) = ([v(12 * k), v(12 * k + 3)], [v(12 * k + 6), v(12 * k + 9)]);
            let [p, q] = nearest([a, b], [c, d]);
            let found = (p - q).length();
            for i in 0..=20 {
                for j in 0..=20 {
                    let there = (a.lerp(b, f64::from(i) / 20.0) - c.lerp(d, f64::from(j) / 20.0)).length();
                    assert!(found <= there + 1e-9, "{k}: {found} > {there}");
                }
            }
        }
    }
}
