//! MuJoCo's conjugate gradients (`solver="CG"`): the mass matrix preconditions the gradient, and Hager and Zhang's
//! formula gives the direction.

use super::islands;
use super::line::LEAST;
use crate::algebra::planar::Space;
use crate::dynamics::{accelerate, bring_inward};
use crate::lanes::Real;
use crate::sim::Sim;
use crate::solver::coupled;
use crate::state::{Capped, Work};

/// Lower bound on the previous direction's share in the next one.
const ETA: f64 = 0.01;

/// Computes `inv(M)` times the gradient into `solution`, with the factors of the unconstrained acceleration.
#[inline(always)]
pub(super) fn precondition<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, c: &Capped<T>) {
    for (dof, gradient) in work.dofs.iter_mut().zip(&c.gradient) {
        dof.rhs = *gradient;
    }
    work.solver.link_force.fill([T::zero(); 6]);
    bring_inward::<T, S>(sim, work);
    if sim.inertia_blocks > 0 {
        coupled::correct(sim, work, false);
    }
    accelerate::<T, S>(sim, work);
}

/// The next direction.
#[inline(always)]
pub(super) fn direction<T: Real>(sim: &Sim<T>, work: &Work<T>, c: &mut Capped<T>, iteration: usize) {
    if iteration > 0 {
        shares(sim, work, c);
    }
    for link in &sim.links {
        let beta = if iteration > 0 { c.alpha[link.tree] } else { T::zero() };
        for d in link.dofs.clone() {
            let descent = -work.solver.solution[d];
            c.direction[d] = if iteration > 0 { beta.mul_add(c.direction[d], descent) } else { descent };
        }
    }
    c.old_gradient.copy_from_slice(&c.gradient);
    c.old_descent.copy_from_slice(&work.solver.solution);
}

/// The share of the previous direction that each island keeps, stored in `alpha`.
#[inline(always)]
fn shares<T: Real>(sim: &Sim<T>, work: &Work<T>, c: &mut Capped<T>) {
    let mut others = vec![[T::zero(); 3]; sim.trees];
    c.sums.fill([T::zero(); 3]);
    for link in &sim.links {
        let (sums, others) = (&mut c.sums[link.tree], &mut others[link.tree]);
        for d in link.dofs.clone() {
            let (g, descent, former) = (c.gradient[d], work.solver.solution[d], c.direction[d]);
            let (y, my) = (g - c.old_gradient[d], descent - c.old_descent[d]);
            sums[0] = former.mul_add(y, sums[0]);
            sums[1] = y.mul_add(my, sums[1]);
            sums[2] = y.mul_add(descent, sums[2]);
            others[0] = former.mul_add(g, others[0]);
            others[1] = former.mul_add(former, others[1]);
            others[2] = g.mul_add(g, others[2]);
        }
    }
    islands::gather(&c.island, &mut c.sums);
    islands::gather(&c.island, &mut others);
    for tree in 0..sim.trees {
        for lane in 0..T::LANES {
            let root = c.island[tree * T::LANES + lane];
            let [dy, ymy, yd] = c.sums[root].map(|x| T::widen(x.get(lane)));
            let [dg, dd, gg] = others[root].map(|x| T::widen(x.get(lane)));
            let beta = if dy < LEAST {
                0.0
            } else {
                let lowest = -1.0 / LEAST.max(dd.sqrt() * ETA.min(gg.sqrt()));
                lowest.max((yd - 2.0 * (ymy / dy) * dg) / dy)
            };
            c.alpha[tree].set(lane, T::scalar(beta));
        }
    }
}
