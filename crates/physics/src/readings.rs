//! What can be read off a group after a step: poses, velocities, contacts and sensors, in world axes.

use crate::lanes::Real;
use crate::model::{GeomType, SensorObject, SensorType};
use crate::sim::{Mount, Sim};
use crate::spatial::*;
use crate::work::{Group, Work};

/// A view of the group that was stepped (or refreshed) last with `work`.
///
/// Positions and velocities belong to the present state. Accelerations, contacts and forces belong to the last physics
/// step, as the dynamics that produced them does. Indices are those of the [`Model`](crate::Model).
#[derive(Clone, Copy)]
pub struct Readings<'a, T: Real> {
    /// Constants.
    pub sim: &'a Sim<T>,
    /// State.
    pub group: &'a Group<T>,
    /// Scratch memory of the last step.
    pub work: &'a Work<T>,
}

impl<'a, T: Real> Readings<'a, T> {
    /// A view; `work` must have been used last for `group`.
    #[inline(always)]
    pub fn new(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a Work<T>) -> Self {
        Readings { sim, group, work }
    }

    /// Coordinate `i` of the configuration.
    #[inline(always)]
    pub fn qpos(&self, i: usize) -> T {
        self.group.qpos[i]
    }

    /// Velocity `i`.
    #[inline(always)]
    pub fn qvel(&self, i: usize) -> T {
        self.group.qvel[i]
    }

    /// Acceleration `i` of the last physics step.
    #[inline(always)]
    pub fn qacc(&self, i: usize) -> T {
        self.work.acc[i]
    }

    /// Force of an actuator in the last physics step (before its gear), N or N m.
    #[inline(always)]
    pub fn actuator_force(&self, i: usize) -> T {
        self.work.actuator_force[i]
    }

    /// Origin of a body's frame, m.
    #[inline(always)]
    pub fn body_pos(&self, body: usize) -> V3<T> {
        self.mount_pos(&self.sim.bodies[body])
    }

    /// Axes of a body's frame (columns x, y, z).
    #[inline(always)]
    pub fn body_axes(&self, body: usize) -> Rot<T> {
        self.mount_axes(&self.sim.bodies[body])
    }

    /// Center of mass of a body, m.
    #[inline(always)]
    pub fn body_com(&self, body: usize) -> V3<T> {
        self.mount_pos(&self.sim.coms[body])
    }

    /// Velocity of the origin of a body's frame, m/s.
    #[inline(always)]
    pub fn body_velocity(&self, body: usize) -> V3<T> {
        self.mount_velocity(&self.sim.bodies[body])
    }

    /// Velocity of a body's center of mass, m/s.
    #[inline(always)]
    pub fn body_com_velocity(&self, body: usize) -> V3<T> {
        self.mount_velocity(&self.sim.coms[body])
    }

    /// Angular velocity of a body, rad/s.
    #[inline(always)]
    pub fn body_angular_velocity(&self, body: usize) -> V3<T> {
        self.mount_spin(&self.sim.bodies[body])
    }

    /// Center of a geom, m.
    #[inline(always)]
    pub fn geom_pos(&self, geom: usize) -> V3<T> {
        self.mount_pos(&self.sim.geoms[geom])
    }

    /// Axes of a geom's frame (columns).
    #[inline(always)]
    pub fn geom_axes(&self, geom: usize) -> Rot<T> {
        self.mount_axes(&self.sim.geoms[geom])
    }

    /// Velocity of a geom's center, m/s.
    #[inline(always)]
    pub fn geom_velocity(&self, geom: usize) -> V3<T> {
        self.mount_velocity(&self.sim.geoms[geom])
    }

    /// Position of a site, m.
    #[inline(always)]
    pub fn site_pos(&self, site: usize) -> V3<T> {
        self.mount_pos(&self.sim.sites[site])
    }

    /// Axes of a site's frame (columns).
    #[inline(always)]
    pub fn site_axes(&self, site: usize) -> Rot<T> {
        self.mount_axes(&self.sim.sites[site])
    }

    /// Lanes in which a geom touches the static world, at the last physics step.
    #[inline(always)]
    pub fn touching(&self, geom: usize) -> T::Mask {
        self.work.touching[geom]
    }

    /// Lanes in which a geom touched the static world at any physics step of the last call of [`Sim::step`].
    #[inline(always)]
    pub fn touched(&self, geom: usize) -> T::Mask {
        self.work.touched[geom]
    }

    /// Lanes in which a geom touches another moving geom, at the last physics step.
    #[inline(always)]
    pub fn touching_bodies(&self, geom: usize) -> T::Mask {
        self.work.touching_bodies[geom]
    }

    /// Number of contacts of a body with the static world at the last physics step.
    pub fn body_contacts(&self, body: usize) -> T {
        let mut n = T::zero();
        for (geom, count) in self.sim.model.geoms.iter().zip(&self.work.ground_contacts) {
            if geom.body == body {
                n += *count;
            }
        }
        n
    }

    /// Normal force of a geom's contacts with the static world at the last physics step, N.
    pub fn normal_force(&self, geom: usize) -> T {
        self.work.normal_force[geom]
    }

    #[inline(always)]
    fn mount_pos(&self, m: &Mount<T::Scalar>) -> V3<T> {
        match m.link {
            None => splat3(&m.pos),
            Some(l) => add3(&self.arm_of(m, l), &self.work.reference[self.sim.links[l].tree]),
        }
    }

    /// Position relative to the tree's reference point.
    #[inline(always)]
    fn arm_of(&self, m: &Mount<T::Scalar>, link: usize) -> V3<T> {
        rotate_add(&self.work.rot[link], &splat3(&m.pos), &self.work.pos[link])
    }

    #[inline(always)]
    fn mount_axes(&self, m: &Mount<T::Scalar>) -> Rot<T> {
        match m.link {
            None => [splat3(&m.rot[0]), splat3(&m.rot[1]), splat3(&m.rot[2])],
            Some(l) => compose(&self.work.rot[l], &m.rot),
        }
    }

    #[inline(always)]
    fn mount_velocity(&self, m: &Mount<T::Scalar>) -> V3<T> {
        match m.link {
            None => [T::zero(); 3],
            Some(l) => {
                let v = &self.work.vel[l];
                cross_add(&ang(v), &self.arm_of(m, l), &lin(v))
            }
        }
    }

    #[inline(always)]
    fn mount_spin(&self, m: &Mount<T::Scalar>) -> V3<T> {
        m.link.map_or([T::zero(); 3], |l| ang(&self.work.vel[l]))
    }

    /// Linear (with gravity as an upward acceleration, as an accelerometer feels it) and angular acceleration.
    fn mount_acceleration(&self, m: &Mount<T::Scalar>) -> (V3<T>, V3<T>) {
        let Some(link) = m.link else {
            let g = &self.sim.gravity;
            return ([-T::splat(g[0]), -T::splat(g[1]), -T::splat(g[2])], [T::zero(); 3]);
        };
        let mut a = self.work.bias_acc[link];
        let mut l = Some(link);
        while let Some(i) = l {
            for d in self.sim.links[i].dofs.clone() {
                a = axpy6(&self.work.axis[d], self.work.acc[d], &a);
            }
            l = self.sim.links[i].parent;
        }
        let r = self.arm_of(m, link);
        let v = self.mount_velocity(m);
        let spin = ang(&self.work.vel[link]);
        let at_point = cross_add(&ang(&a), &r, &lin(&a));
        (cross_add(&spin, &v, &at_point), ang(&a))
    }

    /// Value of a sensor, `dim` numbers, clamped to its cutoff. `None` for a sensor that cannot be evaluated.
    pub fn sensor(&self, sensor: usize) -> Option<Vec<T>> {
        let s = &self.sim.model.sensors[sensor];
        // values relative to another frame are not computed
        if s.reference != SensorObject::None {
            return None;
        }
        let mut out = self.sensor_value(s.kind, s.object)?;
        if s.cutoff > 0.0 {
            let c = T::lit(s.cutoff);
            for x in &mut out {
                *x = x.min(c).max(-c);
            }
        }
        Some(out)
    }

    fn sensor_value(&self, kind: SensorType, object: SensorObject) -> Option<Vec<T>> {
        use SensorType as S;
        let mount = self.mount_of(object);
        let in_frame = |m: &Mount<T::Scalar>, v: &V3<T>| {
            let r = self.mount_axes(m);
            vec![dot(&r[0], v), dot(&r[1], v), dot(&r[2], v)]
        };
        Some(match (kind, object) {
            (S::Touch, SensorObject::Geom(g)) => vec![self.normal_force(g)],
            (S::Touch, SensorObject::Site(site)) => vec![self.touch_in_site(site)],
            (S::JointPos, SensorObject::Joint(j)) => vec![self.group.qpos[self.sim.joints[j].qpos]],
            (S::JointVel, SensorObject::Joint(j)) => vec![self.group.qvel[self.sim.joints[j].dof]],
            (S::ActuatorFrc, SensorObject::Actuator(a)) => vec![self.work.actuator_force[a]],
            (S::SubtreeCom, SensorObject::Body(b) | SensorObject::XBody(b)) => self.subtree(b).0.to_vec(),
            (S::SubtreeLinVel, SensorObject::Body(b) | SensorObject::XBody(b)) => self.subtree(b).1.to_vec(),
            (S::FramePos, _) => self.mount_pos(mount?).to_vec(),
            (S::FrameQuat, _) => rot_to_quat(&self.mount_axes(mount?)).to_vec(),
            (S::FrameXAxis, _) => self.mount_axes(mount?)[0].to_vec(),
            (S::FrameYAxis, _) => self.mount_axes(mount?)[1].to_vec(),
            (S::FrameZAxis, _) => self.mount_axes(mount?)[2].to_vec(),
            (S::FrameLinVel, _) => self.mount_velocity(mount?).to_vec(),
            (S::FrameAngVel, _) => self.mount_spin(mount?).to_vec(),
            (S::FrameLinAcc, _) => self.mount_acceleration(mount?).0.to_vec(),
            (S::FrameAngAcc, _) => self.mount_acceleration(mount?).1.to_vec(),
            (S::Velocimeter, _) => in_frame(mount?, &self.mount_velocity(mount?)),
            (S::Gyro, _) => in_frame(mount?, &self.mount_spin(mount?)),
            (S::Accelerometer, _) => in_frame(mount?, &self.mount_acceleration(mount?).0),
            _ => return None,
        })
    }

    fn mount_of(&self, object: SensorObject) -> Option<&'a Mount<T::Scalar>> {
        match object {
            SensorObject::Body(b) => Some(&self.sim.coms[b]),
            SensorObject::XBody(b) => Some(&self.sim.bodies[b]),
            SensorObject::Geom(g) => Some(&self.sim.geoms[g]),
            SensorObject::Site(s) => Some(&self.sim.sites[s]),
            _ => None,
        }
    }

    /// Center of mass and its velocity for a body and everything below it.
    fn subtree(&self, body: usize) -> (V3<T>, V3<T>) {
        let m = &self.sim.model;
        let (mut com, mut vel) = ([T::zero(); 3], [T::zero(); 3]);
        let mut inside = vec![false; m.bodies.len()];
        for (b, one) in m.bodies.iter().enumerate() {
            inside[b] = b == body || (b > 0 && inside[one.parent]);
            if inside[b] {
                let share = T::lit(one.mass / m.bodies[body].subtree_mass.max(1e-300));
                let (p, v) = (self.body_com(b), self.body_com_velocity(b));
                for k in 0..3 {
                    com[k] = p[k].mul_add(share, com[k]);
                    vel[k] = v[k].mul_add(share, vel[k]);
                }
            }
        }
        (com, vel)
    }

    /// Normal forces of the contacts of a site's body that lie inside the site's volume.
    fn touch_in_site(&self, site: usize) -> T {
        let s = &self.sim.model.sites[site];
        let (center, axes) = (self.site_pos(site), self.site_axes(site));
        let mut total = T::zero();
        for row in &self.work.contacts {
            if self.sim.model.geoms[row.geom].body != s.body {
                continue;
            }
            let tree = self.sim.links[row.link].tree;
            let d = sub3(&add3(&row.r, &self.work.reference[tree]), &center);
            let local = [dot(&axes[0], &d), dot(&axes[1], &d), dot(&axes[2], &d)];
            // the contact's normal ray starts at the point: being inside is what counts for a point in the volume,
            // and MuJoCo also counts points whose ray along the force enters it
            let inside = ray_hits(s.kind, &s.size, &local, &[axes[0][2], axes[1][2], axes[2][2]]);
            total += T::masked(inside, row.force[0]);
        }
        total
    }
}

/// Lanes in which the ray from `p` against `n` (MuJoCo: from the contact, opposite to the force on the site's body)
/// meets a shape of the given size, both in the shape's frame.
fn ray_hits<T: Real>(kind: GeomType, size: &[f64; 3], p: &V3<T>, n: &V3<T>) -> T::Mask {
    let d = [-n[0], -n[1], -n[2]];
    let (z, one) = (T::zero(), T::lit(1.0));
    let none = T::none();
    match kind {
        GeomType::Sphere | GeomType::Ellipsoid => {
            let r = if kind == GeomType::Sphere { [size[0]; 3] } else { *size };
            let inv = r.map(|x| T::lit(1.0 / x.max(1e-15)));
            let (p, d) = ([p[0] * inv[0], p[1] * inv[1], p[2] * inv[2]], [d[0] * inv[0], d[1] * inv[1], d[2] * inv[2]]);
            let (a, b, c) = (dot(&d, &d), dot(&p, &d), dot(&p, &p) - one);
            let det = b.mul_add(b, -(a * c));
            // the farther intersection lies ahead
            let far = det.max(z).sqrt() - b;
            T::and(T::not(det.lt(z)), T::not(far.lt(z)))
        }
        GeomType::Box => {
            // slabs
            let (mut near, mut far) = (T::lit(-1e30), T::lit(1e30));
            for k in 0..3 {
                let tiny = d[k].abs().lt(T::lit(1e-15));
                let inv = one.div(T::select(tiny, T::lit(1e-15), d[k]));
                let (t1, t2) = ((T::lit(-size[k]) - p[k]) * inv, (T::lit(size[k]) - p[k]) * inv);
                near = near.max(t1.min(t2));
                far = far.min(t1.max(t2));
            }
            T::and(T::not(far.lt(near)), T::not(far.lt(z)))
        }
        GeomType::Capsule | GeomType::Cylinder => {
            // a point inside always counts; rays from outside are treated by sampling the segment ahead
            let (r, h) = (size[0], size[1]);
            let mut any = none;
            for i in 0..65 {
                let t = T::lit(i as f64 / 64.0 * 2.0 * (r + h));
                let q = [d[0].mul_add(t, p[0]), d[1].mul_add(t, p[1]), d[2].mul_add(t, p[2])];
                let beyond = (q[2].abs() - T::lit(h)).max(z);
                let side = q[0].mul_add(q[0], q[1] * q[1]);
                let inside = if kind == GeomType::Capsule {
                    beyond.mul_add(beyond, side).lt(T::lit(r * r))
                } else {
                    T::and(side.lt(T::lit(r * r)), beyond.lt(T::lit(1e-30)))
                };
                any = T::or(any, inside);
            }
            any
        }
        _ => none,
    }
}

/// Quaternion of a rotation, `w >= 0`; a fixed sequence of selections, so that every backend agrees.
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
