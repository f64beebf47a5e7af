//! Gauss-Seidel sweeps over the friction rows of a lane, in MuJoCo's order and with its rule to stop.

use super::ellipsoid::{dot, minimize};
use crate::model::vector::MIN_VAL;
use crate::sim::NoSlip;
use crate::state::{Law, MOST_ROWS, Patch, SlipLane};

/// Least response of a row of an ellipsoid, and the largest increase of the cost that is not taken back.
const TINY: f64 = 1e-10;

/// Sweeps until every island stops. The patches are sorted.
pub(super) fn run(settings: &NoSlip, lane: &mut SlipLane) {
    let mut patches = std::mem::take(&mut lane.patches);
    lane.live.fill(false);
    for p in &patches {
        lane.live[p.tree] = true;
    }
    for sweep in 0..settings.iterations {
        // the first sweep also counts the cost of the softness that these rows no longer have
        for (improvement, softness) in lane.improvement.iter_mut().zip(&lane.softness) {
            *improvement = if sweep == 0 { *softness } else { 0.0 };
        }
        let mut moved = false;
        for p in patches.iter_mut() {
            if !lane.live[p.tree] {
                continue;
            }
            let before = p.force;
            let improvement = match p.law {
                Law::Dry => dry(p, lane),
                Law::Pyramid => pyramid(p, lane),
                Law::Ellipsoid => ellipsoid(p, lane),
            };
            lane.improvement[p.tree] += improvement;
            moved |= p.force != before;
        }
        for ((live, improvement), mass) in lane.live.iter_mut().zip(&lane.improvement).zip(&lane.mass) {
            let scale = if settings.islands { 1.0 / mass } else { settings.scale };
            *live &= improvement * scale >= settings.tolerance;
        }
        // a sweep without a change repeats forever
        if !moved || !lane.live.contains(&true) {
            break;
        }
    }
    lane.patches = patches;
}

/// Acceleration of row `k` relative to its reference, with the current forces.
fn residual(p: &Patch, lane: &SlipLane, k: usize) -> f64 {
    let dofs = &lane.dofs[p.dof..p.dof + p.dofs];
    let columns = lane.columns[p.column + k..].iter().step_by(p.dim);
    let response = dofs.iter().zip(columns).map(|(d, c)| c * (lane.pivots[*d] * lane.change[*d]));
    p.residual[k] + response.sum::<f64>()
}

/// Adds `by` to the force along row `k`.
fn push(p: &Patch, lane: &mut SlipLane, k: usize, by: f64) {
    let columns = lane.columns[p.column + k..].iter().step_by(p.dim);
    for (d, c) in lane.dofs[p.dof..p.dof + p.dofs].iter().zip(columns) {
        lane.change[*d] += c * by;
    }
}

/// Updates dry friction. Returns the improvement of the cost.
fn dry(p: &mut Patch, lane: &mut SlipLane) -> f64 {
    let (r, response, old) = (residual(p, lane, 0), p.matrix[0][0].max(MIN_VAL), p.force[0]);
    p.force[0] = (old - r / response).max(-p.bound[0]).min(p.bound[0]);
    let by = p.force[0] - old;
    push(p, lane, 0, by);
    -(0.5 * by * by * response + by * r)
}

/// Updates each pair of opposing edges, whose total stays. With half their difference y, the force along the tangent is
/// `2 mu y`.
fn pyramid(p: &mut Patch, lane: &mut SlipLane) -> f64 {
    let mut improvement = 0.0;
    for k in 0..p.dim {
        let (old, lever) = (p.force[k], 2.0 * p.mu[k]);
        let (slope, curvature) = (lever * residual(p, lane, k), lever * lever * p.matrix[k][k]);
        let least = old - slope / curvature;
        // nothing moves along this tangent
        let new = if curvature < MIN_VAL { 0.0 } else { least.max(-p.bound[k]).min(p.bound[k]) };
        let by = new - old;
        let rise = 0.5 * by * by * curvature + by * slope;
        if rise > TINY {
            continue;
        }
        p.force[k] = new;
        push(p, lane, k, lever * by);
        improvement -= rise;
    }
    improvement
}

/// Updates all friction forces of a contact with an elliptic cone.
fn ellipsoid(p: &mut Patch, lane: &mut SlipLane) -> f64 {
    let (n, mut r, mut matrix) = (p.dim, [0.0; MOST_ROWS], p.matrix);
    for k in 0..n {
        r[k] = residual(p, lane, k);
        matrix[k][k] = matrix[k][k].max(TINY);
    }
    let mut rest = r;
    for k in 0..n {
        rest[k] -= dot(&matrix[k], &p.force, n);
    }
    let normal = p.bound[0];
    let new = if normal < MIN_VAL { [0.0; MOST_ROWS] } else { minimize(&matrix, &rest, &p.mu, normal, n) };
    let mut by = [0.0; MOST_ROWS];
    for k in 0..n {
        by[k] = new[k] - p.force[k];
    }
    let mut rise = dot(&by, &r, n);
    for k in 0..n {
        rise += 0.5 * by[k] * dot(&matrix[k], &by, n);
    }
    if rise > TINY {
        return 0.0;
    }
    p.force = new;
    for k in 0..n {
        push(p, lane, k, by[k]);
    }
    -rise
}
