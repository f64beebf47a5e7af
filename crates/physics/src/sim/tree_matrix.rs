//! The layout of a matrix with entries only between degrees of freedom of which one carries the other, like the mass
//! matrix.

use super::{drive, tendon};
use crate::model::same_frame::small;
use crate::model::{Integrator, JointType, Model, Tendon, Transmission};
use std::ops::Range;

/// Row `d` has the entry of `d` itself, then those of the degrees of freedom that carry it, nearest first.
#[derive(Clone, Debug)]
pub(crate) struct TreeMatrix {
    /// Start of each row.
    pub start: Vec<usize>,
    /// The nearest degree of freedom that carries each.
    pub parent: Vec<Option<usize>>,
    pub len: usize,
    /// Entries of rows that MuJoCo keeps diagonal, see [`is_simple`].
    pub dropped: Vec<Range<usize>>,
    /// Tendons whose forces depend on their velocities.
    pub tendons: Vec<usize>,
    /// Drives whose forces do.
    pub drives: Vec<usize>,
    /// Tendons with armature.
    pub heavy: Vec<usize>,
    /// Whether it is not symmetric.
    pub full: bool,
    /// Whether it has the derivatives of the bias forces of all links, not only of free bodies that stand alone.
    pub bias: bool,
}

impl TreeMatrix {
    /// The matrix that the integrator solves with, if it does not fit the recursion over the tree. `implicit`: whether the
    /// integrator takes any force at the end of the step; `medium`: whether there are forces of a medium.
    pub fn new(model: &Model, implicit: bool, medium: bool) -> Option<TreeMatrix> {
        if !implicit {
            return None;
        }
        let heavy: Vec<usize> = (0..model.tendons.len()).filter(|t| model.tendons[*t].armature != 0.0).collect();
        let (mut tendons, mut drives) = (Vec::new(), Vec::new());
        let (fast, bias) =
            (model.opt.integrator == Integrator::ImplicitFast, model.opt.integrator == Integrator::Implicit);
        if fast || bias {
            (tendons, drives) = damped(model);
        }
        let full = bias || (fast && medium);
        if tendons.is_empty() && drives.is_empty() && heavy.is_empty() && !full {
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
        let of_simple = |d: &usize| !bias && is_simple(model, model.dofs[*d].body);
        let dropped = (0..parent.len()).filter(of_simple).map(|d| start[d] + 1..start[d] + depth[d]).collect();
        Some(TreeMatrix { start, parent, len, dropped, tendons, drives, heavy, full, bias })
    }
}

/// Tendons and drives whose forces depend on their velocities.
fn damped(model: &Model) -> (Vec<usize>, Vec<usize>) {
    let flags = &model.opt.flags;
    let damped = |t: usize| flags.damper && model.tendons[t].damping != 0.0;
    let fed_back = |t: usize| {
        let mut pulls = model.actuators.iter().filter(|a| a.transmission == Transmission::Tendon(t));
        flags.actuation && pulls.any(|a| a.damps())
    };
    let tendons = (0..model.tendons.len()).filter(|t| damped(*t) || fed_back(*t)).collect();
    let driving = drive::actuators(model).enumerate();
    let drives = driving.filter(|(_, (_, a))| flags.actuation && a.damps()).map(|(i, _)| i).collect();
    (tendons, drives)
}

/// Whether the mass matrix of a body is diagonal by its structure (MuJoCo's `body_simple`). Such a body stands alone, and its
/// joints are at its center of mass along its principal axes. No tendon with armature pulls it. Free bodies are solved
/// separately.
fn is_simple(model: &Model, index: usize) -> bool {
    let body = &model.bodies[index];
    let aligned = |axis: [f64; 3]| axis.iter().filter(|x| x.abs() > 1e-14).count() == 1;
    let joints = &model.joints[body.joint_start..body.joint_start + body.joint_count];
    let turns = |kind: JointType| kind != JointType::Slide;
    let last = joints.len().saturating_sub(1);
    let fits = joints.iter().enumerate().all(|(i, j)| {
        let straight = matches!(j.kind, JointType::Ball | JointType::Free) || aligned(j.axis);
        small(j.pos) && straight && (i == last || !turns(j.kind))
    });
    let heavy = || {
        let own = body.dof_start..body.dof_start + body.dof_count;
        let pulls = |t: &Tendon| t.armature != 0.0 && tendon::dofs(model, &t.kind).iter().any(|d| own.contains(d));
        model.tendons.iter().any(pulls)
    };
    fits && joints.iter().all(|j| j.kind != JointType::Free) && model.stands_alone(index) && !heavy()
}
