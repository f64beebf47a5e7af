//! Rows of single degrees of freedom: joint limits and dry friction.

use crate::lanes::Real;
use crate::rows::{DryRow, LimitRow, former};
use crate::sim::{LimitSpec, Sim, impedance};
use crate::state::{Group, Work};

/// Writes the rows of violated joint limits and of dry friction.
#[inline(always)]
pub(crate) fn joint_rows<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let one = T::lit(1.0);
    let mut past = 0;
    for (i, limit) in sim.limits.iter().enumerate() {
        let q = group.qpos[limit.qpos];
        let low = (q - T::splat(limit.low[0])) - T::splat(limit.low[1]);
        let high = (T::splat(limit.high[0]) - q) + T::splat(limit.high[1]);
        let [first, second] = [2 * i, 2 * i + 1];
        if limit.two_sided {
            push_limit(limit, first, low, one, group, work, &mut past);
            push_limit(limit, second, high, -one, group, work, &mut past);
        } else {
            // at most one side is violated: one row serves both
            let lower = low.lt(high);
            let (dist, sign) = (T::select(lower, low, high), T::select(lower, one, -one));
            push_limit(limit, first, dist, sign, group, work, &mut past);
        }
    }
    for (i, dry) in sim.dry.iter().enumerate() {
        let (_, mut d) = impedance(&dry.soft, T::zero());
        if let Some(weights) = group.weights() {
            d *= weights.dofs[dry.dof];
        }
        let u0 = T::splat(dry.soft.b) * group.qvel[dry.dof];
        let (mut sticking, mut positive) = (T::none(), T::none());
        let recalled = i < work.past.dry.len();
        if recalled {
            (sticking, positive) = (work.past.dry[i].sticking, work.past.dry[i].positive);
        }
        work.rows.dry.push(DryRow {
            dof: dry.dof,
            link: dry.link,
            loss: dry.loss,
            d,
            u0,
            u: u0,
            next: u0,
            force: T::zero(),
            sticking,
            positive,
            recalled,
        });
    }
}

/// Writes row `number` of the joint limits. `past` advances along the rows of the previous evaluation.
#[inline(always)]
fn push_limit<T: Real>(
    limit: &LimitSpec<T::Scalar>,
    number: usize,
    dist: T,
    sign: T,
    group: &Group<T>,
    work: &mut Work<T>,
    past: &mut usize,
) {
    let (dof, link, soft) = (limit.dof, limit.link, &limit.soft);
    let on = dist.lt(T::splat(soft.margin));
    if !T::any(on) {
        return;
    }
    let violation = dist - T::splat(soft.margin);
    let (imp, mut d) = impedance(soft, violation);
    if let Some(weights) = group.weights() {
        d *= weights.dofs[dof];
    }
    let u0 = (sign * group.qvel[dof]).mul_add(T::splat(soft.b), imp * violation * T::splat(soft.k));
    let d = T::masked(on, d);
    let (mut active, mut recalled) = (T::none(), T::none());
    if let Some(row) = former(&work.past.limits, past, number, |row| row.number) {
        recalled = T::and(on, row.on);
        active = T::and(recalled, row.active);
    }
    let force = T::zero();
    work.rows.limits.push(LimitRow { dof, link, number, sign, d, u0, u: u0, next: u0, force, active, on, recalled });
}
