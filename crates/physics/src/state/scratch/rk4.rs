//! Memory of the Runge-Kutta integrator.

use crate::lanes::Real;
use crate::sim::Sim;

/// Memory of the Runge-Kutta integrator. Empty for models with another integrator.
#[derive(Clone, Debug)]
pub(crate) struct Rk4<T: Real> {
    /// State at the beginning of the step.
    pub qpos: Vec<T>,
    pub qvel: Vec<T>,
    pub act: Vec<T>,
    /// Velocities of the current stage in the tangent space of the start, and those of the previous stage.
    pub rate: Vec<T>,
    pub rate_before: Vec<T>,
    /// Weighted sums over the stages.
    pub qvel_sum: Vec<T>,
    pub qacc_sum: Vec<T>,
    pub act_dot_sum: Vec<T>,
}

impl<T: Real> Rk4<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let zeros = |n: usize| vec![T::zero(); if sim.rk4 { n } else { 0 }];
        let (nq, nv, na) = (sim.model.nq, sim.model.nv, sim.model.na);
        Rk4 {
            qpos: zeros(nq),
            qvel: zeros(nv),
            act: zeros(na),
            rate: zeros(nv),
            rate_before: zeros(nv),
            qvel_sum: zeros(nv),
            qacc_sum: zeros(nv),
            act_dot_sum: zeros(na),
        }
    }
}
