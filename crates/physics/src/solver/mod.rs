//! The constraint solver: MuJoCo's convex problem, solved by Newton's method without a mass matrix.
//!
//! The acceleration minimizes `1/2 (a - a_s)' M (a - a_s) + sum_i s_i(J_i a - aref_i)`, where `s_i` is quadratic while
//! the row pushes and zero otherwise (MuJoCo documentation, "Computation", primal form). Given the set of pushing rows,
//! the minimizer solves `(M + J' D J) a = tau - bias + J' D aref`, where `tau` has all forces except bias and
//! constraint forces. A contact with a static geom only adds to its own link, so this system has the structure of the
//! mass matrix. The articulated-body recursion ([`dynamics`](crate::dynamics)) solves it in linear time. Contacts
//! between moving bodies, equality constraints and tendons are a low-rank correction on top of it ([`coupled`]). Agents
//! with many of those are solved by a sparse factorization instead ([`crowd`]).
//!
//! Two identities keep the iteration in the space of rows, without multiplications by M:
//! * after a solve with active set A the accelerations satisfy `M a - (tau - bias) = J' f`, with the linear forces `f_i
//!   = -D_i (J_i a - aref_i)` on A and 0 elsewhere;
//! * along a segment between two such points the same holds with the interpolated `f`. The derivative of the cost along
//!   the segment is therefore `sum_i dJa_i (f_i - F_i)`, where `F_i` is the row's true force: a sum over rows.
//!
//! So each iteration solves for the full Newton point. Lanes whose active set did not change are done: the point is the
//! exact minimum. The others search along the segment for the point where that sum vanishes. Lanes do not affect each
//! other: a finished lane is frozen. On the curved side of an elliptic cone no point is exact. There a lane is done
//! when the predicted improvement falls below MuJoCo's tolerance, or below rounding.
//!
//! All this applies to models whose solver converges. If the model's cap stops the iteration earlier, the result
//! depends on the path, and the solver takes MuJoCo's path ([`capped`]).

mod blocks;
mod capped;
mod coupled;
mod crowd;
mod newton;
mod noslip;
mod search;

pub(crate) use capped::solve as solve_capped;
pub(crate) use newton::{apply_forces, solve};
pub(crate) use noslip::prevent_slip;
