//! Sums over bodies: centers of mass, momenta, energies.

use super::Readings;
use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::model::JointType;

/// Mass properties and motion of a body with all bodies below it.
pub(super) struct Subtree<T> {
    pub com: V3<T>,
    /// Velocity of the center of mass.
    pub velocity: V3<T>,
    /// Angular momentum about the center of mass.
    pub momentum: V3<T>,
}

impl<T: Real> Readings<'_, T> {
    /// Sums over a subtree.
    #[inline(always)]
    pub(super) fn subtree(&self, body: usize) -> Subtree<T> {
        let m = &self.sim.model;
        let own = &self.sim.coms[body];
        let inside = self.subtree_of(body);
        let mut total = T::zero();
        for b in (body..m.bodies.len()).filter(|b| inside[*b]) {
            total += self.own_mass(b);
        }
        // as in MuJoCo, a subtree without mass is not divided by
        let inverse = total.max(T::lit(1e-15)).recip();
        let (mut arm, velocity) = ([T::zero(); 3], self.subtree_velocity(body));
        for b in (body..m.bodies.len()).filter(|b| inside[*b]) {
            let (r, part) = (self.separation(own, &self.sim.coms[b]), self.own_mass(b) * inverse);
            for k in 0..3 {
                arm[k] = r[k].mul_add(part, arm[k]);
            }
        }
        let mut momentum = [T::zero(); 3];
        for b in (body..m.bodies.len()).filter(|b| inside[*b]) {
            let mass = self.own_mass(b);
            let r = sub3(&self.separation(own, &self.sim.coms[b]), &arm);
            let v = sub3(&self.body_com_velocity(b), &velocity);
            let p = [v[0] * mass, v[1] * mass, v[2] * mass];
            momentum = cross_add(&r, &p, &add3(&momentum, &self.spin_momentum(b)));
        }
        Subtree { com: add3(&self.mount_pos(own), &arm), velocity, momentum }
    }

    /// Velocity of the center of mass of a body and all bodies below it, m/s.
    #[inline(always)]
    pub fn subtree_velocity(&self, body: usize) -> V3<T> {
        let bodies = &self.sim.model.bodies;
        let (mut mass, mut momentum) = (T::zero(), [T::zero(); 3]);
        for b in body..bodies.len() {
            // the bodies below a body follow it without gaps
            if b > body && bodies[b].parent < body {
                break;
            }
            let (m, v) = (self.own_mass(b), self.body_com_velocity(b));
            mass += m;
            for k in 0..3 {
                momentum[k] = v[k].mul_add(m, momentum[k]);
            }
        }
        let inverse = mass.max(T::lit(1e-15)).recip();
        [momentum[0] * inverse, momentum[1] * inverse, momentum[2] * inverse]
    }

    /// Energy of gravity and springs. A spring whose stiffness is a polynomial of its displacement `x` has the energy
    /// `k x^2 / 2 + p0 x^3 / 3 + p1 x^4 / 4`.
    #[inline(always)]
    pub(super) fn potential_energy(&self) -> T {
        let m = &self.sim.model;
        let mut sum = T::zero();
        let g: V3<T> = self.group.gravity(self.sim);
        for b in 1..m.bodies.len() {
            sum = self.own_mass(b).neg_mul_add(dot(&g, &self.body_com(b)), sum);
        }
        if !m.opt.flags.spring {
            return sum;
        }
        for joint in &m.joints {
            let (q, rest) = (joint.qpos_adr, &m.qpos_spring[joint.qpos_adr..]);
            let away = |i: usize| self.group.qpos[q + i] - T::lit(rest[i]);
            let k = (joint.stiffness, &joint.stiffness_poly);
            if *k.1 == [0.0; 2] && k.0 == 0.0 {
                continue;
            }
            match joint.kind {
                JointType::Hinge | JointType::Slide => sum += spring(away(0), k),
                JointType::Ball => sum += spring(self.angle_from(q, &rest[..4]), k),
                JointType::Free => {
                    let r = [away(0), away(1), away(2)];
                    sum += spring(dot(&r, &r).sqrt(), k) + spring(self.angle_from(q + 3, &rest[3..7]), k);
                }
            }
        }
        for (t, tendon) in m.tendons.iter().enumerate() {
            // slack between the two lengths
            let length = self.tendon_length(t);
            let [low, high] = tendon.spring_length;
            let stretch = (length - T::lit(high)).max(T::zero()) + (length - T::lit(low)).min(T::zero());
            sum += spring(stretch, (tendon.stiffness, &tendon.stiffness_poly));
        }
        sum
    }

    /// Angle between the quaternion at an address of `qpos` and a constant one.
    #[inline(always)]
    fn angle_from(&self, at: usize, rest: &[f64]) -> T {
        let r = [T::lit(rest[0]), T::lit(rest[1]), T::lit(rest[2]), T::lit(rest[3])];
        let turn = quat_mul(&quat_conjugate(&r), &self.joint_quat(at));
        let v = quat_to_rotvec(&turn);
        dot(&v, &v).sqrt()
    }

    /// Kinetic energy, including that of the armature of joints and tendons.
    #[inline(always)]
    pub(super) fn kinetic_energy(&self) -> T {
        let mut twice = T::zero();
        for (inertia, v) in self.work.motion.inertia.iter().zip(&self.work.motion.vel) {
            twice += dot6(v, &inertia_mul(inertia, v));
        }
        for (armature, v) in self.sim.armature.iter().zip(&self.group.qvel) {
            twice = (T::splat(*armature) * *v).mul_add(*v, twice);
        }
        for tendon in self.sim.tendons.iter().filter(|t| t.is_heavy()) {
            for chain in &tendon.chains {
                let mut rate = T::zero();
                for place in chain {
                    let (dof, arm) = tendon.arm(*place, &self.work.strings.moments);
                    rate = arm.mul_add(self.group.qvel[dof], rate);
                }
                twice = (T::splat(tendon.armature) * rate).mul_add(rate, twice);
            }
        }
        T::lit(0.5) * twice
    }
}

/// Energy of a spring with a constant and a polynomial stiffness.
#[inline(always)]
fn spring<T: Real>(x: T, (stiffness, poly): (f64, &[f64; 2])) -> T {
    let c = T::lit(poly[1] / 4.0).mul_add(x, T::lit(poly[0] / 3.0));
    c.mul_add(x, T::lit(stiffness / 2.0)) * (x * x)
}
