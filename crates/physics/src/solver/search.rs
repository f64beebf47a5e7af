//! The line search: the minimum of the cost along the segment to the Newton point.

use super::blocks;
use crate::lanes::Real;
use crate::rows::Row;
use crate::sim::Sim;
use crate::state::Work;

/// Maximum length of a line search in Newton steps. The minimum is rarely beyond a few; the next iteration continues if
/// it is.
const LONGEST_SEARCH: f64 = 64.0;

/// Fraction of the initial slope at which the line search stops. In the first iterations a rough search works as well
/// as an exact one: the number of iterations is the same, and the searches are half as long.
const ROUGH: f64 = 0.6;
const EXACT: f64 = 0.01;
/// Iterations with the rough search.
const ROUGH_ITERATIONS: usize = 8;

/// Returns the fraction of the segment, and the lanes whose predicted improvement is below the tolerance (at fraction
/// 1). Lanes in `skip` do not matter.
#[inline(always)]
pub(super) fn line_search<T: Real>(sim: &Sim<T>, work: &mut Work<T>, skip: T::Mask, iteration: usize) -> (T, T::Mask) {
    let (z, one) = (T::zero(), T::lit(1.0));
    // interpolated forces along the negative direction at both ends, and the true forces at the start
    let mut sums = [z; 3];
    for row in &work.rows.contacts {
        add(&mut sums, &row.ends());
    }
    for row in &work.rows.limits {
        add(&mut sums, &row.ends());
    }
    for row in &work.rows.dry {
        add(&mut sums, &row.ends());
    }
    if !work.rows.blocks.is_empty() {
        add(&mut sums, &blocks::ends(work));
    }
    let [g0, g1, f0] = sums;
    let descent = f0 - g0;
    // an improvement below the rounding of its two parts is noise, and a search along it is arbitrary
    let noise = (f0.abs() + g0.abs()) * T::lit(4.0 * T::EPSILON);
    let small = descent.lt(noise.max(T::splat(sim.tolerance)));
    let fraction = if iteration <= ROUGH_ITERATIONS { ROUGH } else { EXACT };
    let enough = descent.abs().mul_add(T::lit(fraction), T::lit(1e-30));
    let curvature = g1 - g0;

    let (mut low, mut high) = (z, T::lit(LONGEST_SEARCH));
    let mut alpha = one;
    let mut settled = T::or(skip, small);
    for step in 0..sim.max_line_search {
        work.stats.line_search += 1;
        // slope of the cost and its derivative at alpha
        let mut sums = [alpha.mul_add(curvature, g0), curvature];
        for row in &work.rows.contacts {
            add(&mut sums, &row.slope(alpha));
        }
        for row in &work.rows.limits {
            add(&mut sums, &row.slope(alpha));
        }
        for row in &work.rows.dry {
            add(&mut sums, &row.slope(alpha));
        }
        if !work.rows.blocks.is_empty() {
            add(&mut sums, &blocks::slope(work, alpha));
        }
        let [slope, second] = sums;
        settled = T::or(settled, slope.abs().lt(enough));
        if T::all(settled) || step + 1 == sim.max_line_search {
            break;
        }
        // one-dimensional Newton step; if it leaves the bracket, doubling up to the first point beyond the minimum and
        // bisection after that
        let short = slope.lt(z);
        low = T::select(short, alpha, low);
        high = T::select(short, high, alpha);
        let newton = slope.div(second.max(T::lit(1e-30))).neg_mul_add(one, alpha);
        let inside = T::and(low.lt(newton), newton.lt(high));
        let middle = (low + high) * T::lit(0.5);
        let middle = middle.min(alpha.max(one) * T::lit(2.0));
        let proposal = T::select(inside, newton, middle);
        alpha = T::select(settled, alpha, proposal);
    }
    (alpha, small)
}

#[inline(always)]
fn add<T: Real, const N: usize>(sums: &mut [T; N], more: &[T; N]) {
    for i in 0..N {
        sums[i] += more[i];
    }
}
