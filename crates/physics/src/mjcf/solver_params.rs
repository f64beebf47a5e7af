//! Defaults of the solver parameters that all constraints have.

use crate::model::{SolImp, SolRef};

/// Default `solref` of every constraint.
pub(crate) const SOLREF: SolRef = [0.02, 1.0];
/// Default `solimp` of every constraint.
pub(crate) const SOLIMP: SolImp = [0.9, 0.95, 0.001, 0.5, 2.0];
