//! Joint-space quantities for inspection and tests: bias, passive, actuator and constraint forces, and the mass matrix.
//!
//! A step never needs them. They are computed from the results of the last [`Sim::forward`](crate::sim::Sim::forward).

use super::Readings;
use crate::algebra::spatial::*;
use crate::dynamics::joint_space;
use crate::lanes::Real;
use crate::rows::Source;
use crate::state::Work;

impl<T: Real> Readings<'_, T> {
    /// Coriolis, centrifugal and gravitational forces, N or N m.
    pub fn qfrc_bias(&self) -> Vec<T> {
        let mut bias = self.joint_space(self.work.motion.bias_force.clone());
        for (i, tendon) in self.sim.tendons.iter().enumerate().filter(|(_, t)| t.is_heavy()) {
            let force = T::splat(tendon.armature) * self.work.strings.drift[i];
            for (dof, arm) in tendon.arms(&self.work.strings.moments) {
                bias[dof] = arm.mul_add(force, bias[dof]);
            }
        }
        bias
    }

    /// Total of springs, dampers, actuators, the medium and pushes (`qfrc_passive + qfrc_actuator` and `xfrc_applied`).
    pub fn applied_forces(&self) -> Vec<T> {
        let mut external = self.work.forces.link_applied.clone();
        external.resize(self.sim.links.len(), [T::zero(); 6]);
        let mut sum = self.joint_space(external);
        for (s, t) in sum.iter_mut().zip(&self.work.forces.qfrc_passive_actuator) {
            *s += *t;
        }
        sum
    }

    /// Contacts, limits and dry friction (`qfrc_constraint`).
    pub fn constraint_forces(&self) -> Vec<T> {
        let mut links = vec![[T::zero(); 6]; self.sim.links.len()];
        let mut joints = vec![T::zero(); self.sim.model.nv];
        constraint_wrenches(self.work, &mut links, &mut joints);
        joint_space(self.sim, &self.work.dofs, &mut links, &mut joints);
        joints
    }

    /// The mass matrix, `nv` rows of `nv`, armature included.
    pub fn mass_matrix(&self) -> Vec<Vec<T>> {
        let nv = self.sim.model.nv;
        let mut rows = Vec::with_capacity(nv);
        for i in 0..nv {
            // inertial forces for a unit acceleration of one degree of freedom
            let mut motion = vec![[T::zero(); 6]; self.sim.links.len()];
            let mut forces = motion.clone();
            for (l, link) in self.sim.links.iter().enumerate() {
                let mut a = link.parent.map_or([T::zero(); 6], |p| motion[p]);
                if link.dofs.contains(&i) {
                    a = axpy6(&self.work.dofs[i].axis, T::lit(1.0), &a);
                }
                motion[l] = a;
                forces[l] = inertia_mul(&self.work.motion.inertia[l], &a);
            }
            let mut row = self.joint_space(forces);
            row[i] += T::splat(self.sim.armature[i]);
            rows.push(row);
        }
        for tendon in self.sim.tendons.iter().filter(|t| t.is_heavy()) {
            for chain in &tendon.chains {
                let arms: Vec<(usize, T)> =
                    chain.iter().map(|place| tendon.arm(*place, &self.work.strings.moments)).collect();
                for (i, a) in &arms {
                    for (j, b) in &arms {
                        rows[*i][*j] = (T::splat(tendon.armature) * *a).mul_add(*b, rows[*i][*j]);
                    }
                }
            }
        }
        rows
    }

    /// Converts forces on links to forces on joints.
    fn joint_space(&self, mut forces: Vec<V6<T>>) -> Vec<T> {
        let mut out = vec![T::zero(); self.sim.model.nv];
        joint_space(self.sim, &self.work.dofs, &mut forces, &mut out);
        out
    }

    /// Number of contacts per lane.
    pub fn contact_count(&self) -> T {
        let mut n = T::zero();
        for c in &self.work.rows.contacts {
            n += T::masked(c.on, T::lit(1.0));
        }
        for b in self.work.rows.blocks.iter().filter(|b| !b.members.is_empty()) {
            n += T::masked(b.on, T::lit(1.0));
        }
        n
    }
}

/// Forces of all constraints, on links and on joints.
#[inline(always)]
pub(crate) fn constraint_wrenches<T: Real>(work: &Work<T>, links: &mut [V6<T>], joints: &mut [T]) {
    links.fill([T::zero(); 6]);
    joints.fill(T::zero());
    for c in &work.rows.contacts {
        let w = c.wrench(&c.force);
        for i in 0..6 {
            links[c.link][i] += w[i];
        }
    }
    for b in work.rows.blocks.iter().filter(|b| b.source != Source::TendonInertia) {
        b.exert_on_links(links);
        for (dof, coefficient) in b.joint_terms() {
            joints[*dof] = coefficient.mul_add(b.force[0], joints[*dof]);
        }
    }
    for l in &work.rows.limits {
        joints[l.dof] += l.sign * l.force;
    }
    for f in &work.rows.dry {
        joints[f.dof] += f.force;
    }
}

#[cfg(test)]
mod tests {
    use crate::model::Model;
    use crate::readings::Readings;
    use crate::sim::{Sim, SimOptions};
    use crate::state::{Group, Work};

    const BALL: &str = r#"<mujoco><worldbody><body><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"#;

    #[test]
    fn pushes_stay_with_their_group() {
        let model = Model::from_xml_str(BALL, "ball").expect("a model");
        let sim = Sim::<f64>::new(&model, SimOptions::default()).expect("a simulation");
        let mut work = Work::new(&sim);
        let (mut pushed, calm) = (Group::new(&sim), Group::new(&sim));
        pushed.push(&sim, 0, 1, [3.0, 0.0, 0.0], [0.0; 3]);
        for (group, force) in [(&pushed, 3.0), (&calm, 0.0)] {
            sim.forward(&mut work, group);
            let readings = Readings::new(&sim, group, &work);
            let bias = readings.qfrc_bias();
            assert_eq!(readings.applied_forces()[0], force);
            assert_eq!(bias[0], 0.0);
            // positions and velocities do not depend on pushes, so the bias stays the same
            sim.refresh(&mut work, group);
            assert_eq!(Readings::new(&sim, group, &work).qfrc_bias(), bias);
        }
    }
}
