//! MuJoCo's second solver for friction: `noslip_iterations`.
//!
//! Friction is a soft constraint, so a body on a slope creeps. A model may ask for a second pass after the solver. It
//! keeps the normal forces and all other constraints, and finds the friction forces of rows without softness. They
//! minimize `1/2 f' A f + f' b` within the friction cones, with `A = J inv(M) J'` and `b` such that `A f + b` are the
//! accelerations of the rows relative to their references. Gauss-Seidel sweeps end by their number or by the
//! improvement of a sweep, so the result depends on the order of the rows ([`NoSlip::order`](crate::sim::NoSlip)).
//!
//! A is never formed. The recursion is `inv(M) = P' D P`, where P is the inward pass. So a row needs its inward pass
//! ([`rows`]), and the changes of all forces are one vector, their inward pass. A row's acceleration is a sum over the
//! degrees of freedom that move it. The sweeps themselves ([`sweep`]) run lane by lane, in double precision.

mod ellipsoid;
mod outcome;
mod rows;
mod sweep;

use crate::lanes::Real;
use crate::sim::Sim;
use crate::state::Work;

/// Replaces the friction forces of the solver, and the accelerations, if the model asks for it.
// not inlined: most models do not have this stage
#[inline(never)]
pub(crate) fn prevent_slip<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    let Some(settings) = &sim.no_slip else { return };
    let rows = &work.rows;
    if rows.contacts.is_empty() && rows.limits.is_empty() && rows.dry.is_empty() && rows.blocks.is_empty() {
        return;
    }
    let mut slip = std::mem::take(&mut work.solver.slip);
    rows::prepare(sim, work, &mut slip);
    for lane in slip.lanes.iter_mut() {
        sweep::run(settings, lane);
    }
    outcome::apply(sim, work, &mut slip);
    work.solver.slip = slip;
}
