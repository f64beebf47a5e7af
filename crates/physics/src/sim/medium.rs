//! Gravity compensation, and bodies in a fluid.

use super::weld::BodyMount;
use crate::algebra::rigid::rotate;
use crate::lanes::Real;
use crate::model::Model;

/// Upward force that compensates part of a link's weight.
#[derive(Clone, Debug)]
pub(crate) struct GravComp<C> {
    pub link: usize,
    /// Point of application, in the link's frame.
    pub at: [C; 3],
    /// Mass that it compensates, kg.
    pub mass: C,
}

/// A body in a medium: a box of the same mass and inertia (MuJoCo documentation, "Passive forces", inertia model).
#[derive(Clone, Debug)]
pub(crate) struct Drag<C> {
    pub link: usize,
    pub body: usize,
    /// Viscous torque and force per unit of velocity.
    pub viscous: [C; 2],
    /// Torque and force per squared velocity, along the principal axes.
    pub angular: [C; 3],
    pub linear: [C; 3],
}

/// Whether there are passive forces at all. As in MuJoCo, there are none if both springs and dampers are off.
fn passive(model: &Model) -> bool {
    model.opt.flags.spring || model.opt.flags.damper
}

/// Prepares gravity compensation: one force per link, and another for negative compensation, which makes bodies
/// heavier. As in MuJoCo, the latter counts only in a model that also makes some body lighter.
pub(super) fn gravity_compensation<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    link_of: &[Option<usize>],
) -> Vec<GravComp<T::Scalar>> {
    let mut out = Vec::new();
    if !passive(model) || !model.opt.flags.gravity || !model.bodies.iter().any(|b| b.gravcomp > 0.0) {
        return out;
    }
    for (link, sign) in (0..link_of.iter().flatten().count()).flat_map(|l| [(l, 1.0), (l, -1.0)]) {
        let (mut weight, mut moment) = (0.0, [0.0; 3]);
        for (b, body) in model.bodies.iter().enumerate() {
            if link_of[mounts[b].body] != Some(link) || !(body.gravcomp * sign > 0.0) {
                continue;
            }
            let w = body.mass * body.gravcomp;
            let m = &mounts[b];
            let at = rotate(&m.rot, &model.inertial_frame(b).0);
            weight += w;
            for i in 0..3 {
                moment[i] += w * (at[i] + m.pos[i]);
            }
        }
        if weight != 0.0 {
            out.push(GravComp { link, at: moment.map(|x| T::scalar(x / weight)), mass: T::scalar(weight) });
        }
    }
    out
}

/// Prepares the bodies that move through a medium.
pub(super) fn drags<T: Real>(model: &Model, mounts: &[BodyMount], link_of: &[Option<usize>]) -> Vec<Drag<T::Scalar>> {
    let c = T::scalar;
    let (density, viscosity) = (model.opt.density, model.opt.viscosity);
    if !passive(model) || (density == 0.0 && viscosity == 0.0) {
        return Vec::new();
    }
    let mut out = Vec::new();
    for (body, b) in model.bodies.iter().enumerate() {
        let Some(link) = link_of[mounts[body].body] else { continue };
        if b.mass < 1e-15 {
            continue;
        }
        let i = &b.inertia;
        let side = |k: usize| {
            let sum = i[(k + 1) % 3] + i[(k + 2) % 3] - i[k];
            (sum.max(1e-15) / b.mass * 6.0).sqrt()
        };
        let s = [side(0), side(1), side(2)];
        let diameter = (s[0] + s[1] + s[2]) / 3.0;
        let pi = std::f64::consts::PI;
        let pair = |k: usize| (s[(k + 1) % 3], s[(k + 2) % 3]);
        let fourth = |x: f64| x * x * x * x;
        out.push(Drag {
            link,
            body,
            viscous: [c(pi * diameter * diameter * diameter * viscosity), c(3.0 * pi * diameter * viscosity)],
            angular: [0, 1, 2].map(|k| {
                let (x, y) = pair(k);
                c(density * s[k] * (fourth(x) + fourth(y)) / 64.0)
            }),
            linear: [0, 1, 2].map(|k| {
                let (x, y) = pair(k);
                c(0.5 * density * x * y)
            }),
        });
    }
    out
}
