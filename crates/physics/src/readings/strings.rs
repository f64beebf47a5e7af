//! Forces of strings on bodies, from all that pulls along them.

use super::Readings;
use crate::algebra::spatial::*;
use crate::dynamics::straights;
use crate::lanes::Real;
use crate::model::EqualityKind;
use crate::rows::Source;
use crate::sim::TransmissionSpec;

/// Force of a straight piece of a string, in some lanes.
pub(super) struct StringForce<T: Real> {
    pub on: T::Mask,
    /// The force acts on the second body, its opposite on the first, each at its own point.
    pub bodies: [usize; 2],
    /// The points, relative to the references of these trees; in the world without a tree.
    pub trees: [Option<usize>; 2],
    pub points: [V3<T>; 2],
    pub force: V3<T>,
}

impl<T: Real> Readings<'_, T> {
    /// The forces of all strings of the last physics step, along their present paths.
    #[inline(always)]
    pub(super) fn string_forces(&self) -> Vec<StringForce<T>> {
        let m = &self.sim.model;
        let mut out = Vec::new();
        for string in &self.sim.strings {
            let tension = self.tension(string.tendon);
            for (span, path) in string.spans.iter().zip(m.tendons[string.tendon].kind.spans()) {
                let sites = path.sites.map(|s| m.sites[s].body);
                let middle = path.wrap.map_or(0, |(geom, _)| m.geoms[geom].body);
                let tree = span.around.as_ref().and_then(|around| around.center.tree);
                let (first, last) = (span.ends[0].tree, span.ends[1].tree);
                let ends =
                    [(sites, [first, last]), ([sites[0], middle], [first, tree]), ([middle, sites[1]], [tree, last])];
                let force = tension * T::splat(span.share);
                for (piece, (bodies, trees)) in straights(&self.work.motion, span).into_iter().zip(ends) {
                    let Some(piece) = piece else { continue };
                    let along = piece.along;
                    let force = [along[0] * force, along[1] * force, along[2] * force];
                    out.push(StringForce { on: piece.on, bodies, trees, points: piece.arms, force });
                }
            }
        }
        out
    }

    /// The total force that lengthens a tendon: inertia, springs, dampers, actuators and constraints.
    #[inline(always)]
    fn tension(&self, tendon: usize) -> T {
        let (t, forces) = (&self.sim.tendons[tendon], &self.work.forces);
        let length = forces.tendon_length[tendon];
        let below = (T::splat(t.slack[0]) - length).max(T::zero());
        let above = (T::splat(t.slack[1]) - length).min(T::zero());
        let mut sum = (below + above) * T::splat(t.stiffness) - T::splat(t.damping) * forces.tendon_velocity[tendon];
        if t.is_heavy() {
            let mut acc = self.work.strings.drift[tendon];
            for (dof, arm) in t.arms(&forces.tendon_moments) {
                acc = arm.mul_add(self.work.solver.qacc[dof], acc);
            }
            sum = T::splat(t.armature).neg_mul_add(acc, sum);
        }
        for (actuator, force) in self.sim.actuators.iter().zip(&forces.actuator_force) {
            if let TransmissionSpec::Tendon { index, gear } = &actuator.transmission
                && *index == tendon
            {
                sum = force.mul_add(T::splat(*gear), sum);
            }
        }
        for block in self.work.rows.blocks.iter() {
            let force = block.force[0];
            match block.source {
                Source::TendonLimit { tendon: t, upper } if t == tendon => sum += if upper { -force } else { force },
                Source::TendonFriction(t) if t == tendon => sum += force,
                Source::Equality(e) => {
                    let EqualityKind::Tendon { tendon1, tendon2, polycoef } = &self.sim.model.equalities[e].kind else {
                        continue;
                    };
                    if *tendon1 == tendon {
                        sum += force;
                    }
                    if *tendon2 == Some(tendon) {
                        // the slope of the polynomial that the first tendon follows
                        let x = length - T::lit(self.sim.model.tendons[tendon].length0);
                        let mut slope = T::zero();
                        for k in (1..5).rev() {
                            slope = slope.mul_add(x, T::lit(k as f64 * polycoef[k]));
                        }
                        sum = slope.neg_mul_add(force, sum);
                    }
                }
                _ => {}
            }
        }
        sum
    }
}
