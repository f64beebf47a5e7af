//! Forces on links that do not come from joints: compensation of gravity, a medium, and pushes from outside.

use crate::lanes::{Real, kernel_fn};
use crate::model::Model;
use crate::sim::{Link, Sim};
use crate::spatial::*;
use crate::work::{Group, Work};

/// Upward force that carries part of a link's weight.
#[derive(Clone, Debug)]
pub(crate) struct Lift<C> {
    link: usize,
    /// Where it acts, in the link's frame.
    at: [C; 3],
    /// Mass that it carries, kg.
    mass: C,
}

/// A body in a medium: a box of the same mass and inertia (MuJoCo documentation, "Passive forces", inertia model).
#[derive(Clone, Debug)]
pub(crate) struct Drag<C> {
    link: usize,
    body: usize,
    /// Viscous torque and force per unit of velocity.
    viscous: [C; 2],
    /// Torque and force per squared velocity, along the principal axes.
    angular: [C; 3],
    linear: [C; 3],
}

/// Whether there are passive forces at all: as in MuJoCo, none where both springs and dampers are off.
fn passive(model: &Model) -> bool {
    model.opt.flags.spring || model.opt.flags.damper
}

/// Prepares the compensation of gravity: one force per link, and another for bodies that are made heavier. As in MuJoCo,
/// those count only in a model that makes some body lighter.
pub(crate) fn lifts<T: Real>(
    model: &Model,
    mounts: &[crate::rigid::BodyMount],
    links: &[Link<T::Scalar>],
    link_of: &[Option<usize>],
) -> Vec<Lift<T::Scalar>> {
    let mut out = Vec::new();
    if !passive(model) || !model.opt.flags.gravity || !model.bodies.iter().any(|b| b.gravcomp > 0.0) {
        return out;
    }
    for (link, sign) in (0..links.len()).flat_map(|l| [(l, 1.0), (l, -1.0)]) {
        let (mut weight, mut moment) = (0.0, [0.0; 3]);
        for (b, body) in model.bodies.iter().enumerate() {
            if link_of[mounts[b].body] != Some(link) || !(body.gravcomp * sign > 0.0) {
                continue;
            }
            let w = body.mass * body.gravcomp;
            let m = &mounts[b];
            let at = crate::rigid::rotate(&m.rot, &body.ipos);
            weight += w;
            for i in 0..3 {
                moment[i] += w * (at[i] + m.pos[i]);
            }
        }
        if weight != 0.0 {
            out.push(Lift { link, at: moment.map(|x| T::scalar(x / weight)), mass: T::scalar(weight) });
        }
    }
    out
}

/// Prepares the bodies that move through a medium.
pub(crate) fn drags<T: Real>(
    model: &Model,
    mounts: &[crate::rigid::BodyMount],
    link_of: &[Option<usize>],
) -> Vec<Drag<T::Scalar>> {
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

kernel_fn! {
    /// Wrenches on links from outside, into `external`, and off the bias forces.
    pub(crate) fn external_forces<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        let z = T::zero();
        let gravity = group.gravity(sim);
        work.external.resize(sim.links.len(), [z; 6]);
        for lift in &sim.lifts {
            let r = rotate_add(&work.rot[lift.link], &splat3(&lift.at), &work.pos[lift.link]);
            let mut weight = T::splat(lift.mass);
            if let Some(varied) = &group.varied {
                weight *= varied.mass[lift.link];
            }
            push(
                work,
                lift.link,
                &r,
                &[-(gravity[0] * weight), -(gravity[1] * weight), -(gravity[2] * weight)],
                &[z; 3],
            );
        }
        for drag in &sim.drags {
            let m = &sim.coms[drag.body];
            let axes = work.axes(m);
            let r = work.arm(m, drag.link);
            let v = &work.vel[drag.link];
            let through = sub3(&cross_add(&ang(v), &r, &lin(v)), &splat3(&sim.wind));
            let (mut force, mut torque) = ([z; 3], [z; 3]);
            for k in 0..3 {
                let (w, u) = (dot(&axes[k], &ang(v)), dot(&axes[k], &through));
                let t = -(w * T::splat(drag.angular[k]).mul_add(w.abs(), T::splat(drag.viscous[0])));
                let f = -(u * T::splat(drag.linear[k]).mul_add(u.abs(), T::splat(drag.viscous[1])));
                for i in 0..3 {
                    torque[i] = axes[k][i].mul_add(t, torque[i]);
                    force[i] = axes[k][i].mul_add(f, force[i]);
                }
            }
            push(work, drag.link, &r, &force, &torque);
        }
        for (body, x) in group.external.iter().enumerate() {
            let m = &sim.coms[body];
            let Some(link) = m.link else { continue };
            let r = work.arm(m, link);
            push(work, link, &r, &lin(x), &ang(x));
        }
        for l in 0..sim.links.len() {
            for i in 0..6 {
                work.bias_force[l][i] -= work.external[l][i];
            }
        }
    }
}

/// Adds a force at a point of a link, and a torque.
#[inline(always)]
fn push<T: Real>(work: &mut Work<T>, link: usize, r: &V3<T>, force: &V3<T>, torque: &V3<T>) {
    let t = cross_add(r, force, torque);
    for i in 0..3 {
        work.external[link][i] += t[i];
        work.external[link][3 + i] += force[i];
    }
}
