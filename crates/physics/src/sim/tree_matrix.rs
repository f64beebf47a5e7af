//! The layout of a symmetric matrix with entries only between degrees of freedom of which one carries the other, like
//! the mass matrix.

use crate::model::{Integrator, Model, Transmission};

/// Row `d` has the entry of `d` itself, then those of the degrees of freedom that carry it, nearest first.
#[derive(Clone, Debug)]
pub(crate) struct TreeMatrix {
    /// Start of each row.
    pub start: Vec<usize>,
    /// The nearest degree of freedom that carries each.
    pub parent: Vec<Option<usize>>,
    pub len: usize,
    /// Tendons whose forces depend on their velocities.
    pub tendons: Vec<usize>,
}

impl TreeMatrix {
    /// The matrix that `implicitfast` solves with, for models in which tendons have a share in it.
    pub fn of_damped_tendons(model: &Model) -> Option<TreeMatrix> {
        if model.opt.integrator != Integrator::ImplicitFast {
            return None;
        }
        let flags = &model.opt.flags;
        let damped = |t: usize| flags.damper && model.tendons[t].damping != 0.0;
        let fed_back = |t: usize| {
            let mut pulls = model.actuators.iter().filter(|a| a.transmission == Transmission::Tendon(t));
            flags.actuation && pulls.any(|a| a.gain[2] != 0.0 || a.bias[2] != 0.0)
        };
        let tendons: Vec<usize> = (0..model.tendons.len()).filter(|t| damped(*t) || fed_back(*t)).collect();
        if tendons.is_empty() {
            return None;
        }
        let parent: Vec<Option<usize>> = model.dofs.iter().map(|d| d.parent).collect();
        let (mut start, mut depth, mut len) = (Vec::new(), Vec::new(), 0);
        for p in &parent {
            start.push(len);
            let own: usize = 1 + p.map_or(0, |p: usize| depth[p]);
            depth.push(own);
            len += own;
        }
        Some(TreeMatrix { start, parent, len, tendons })
    }
}
