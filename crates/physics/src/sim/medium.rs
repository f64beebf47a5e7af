//! Gravity compensation, and bodies in a fluid.

use super::weld::BodyMount;
use crate::algebra::rigid::rotate;
use crate::lanes::Real;
use crate::model::{Geom, Model};

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

/// A geom that is like an ellipsoid to the medium (MuJoCo documentation, "Fluid forces", ellipsoid model).
#[derive(Clone, Debug)]
pub(crate) struct EllipsoidDrag<C> {
    pub link: usize,
    pub geom: usize,
    /// Whether its link is a free body that stands alone: `implicitfast` then takes derivatives that are not symmetric.
    pub alone: bool,
    /// Mass and inertia of the medium that moves along.
    pub mass: [C; 3],
    pub inertia: [C; 3],
    /// Squared products of the other two half lengths, relative to the largest one.
    pub squares: [C; 3],
    /// Area of the cross section that belongs to that one, and area of the largest cross section, m^2.
    pub section: C,
    pub area: C,
    /// Viscous torque and force per unit of velocity.
    pub viscous: [C; 2],
    /// Density of the medium times the coefficients of blunt and slender drag, of Kutta's and of Magnus' lift.
    pub blunt: C,
    pub slender: C,
    pub kutta: C,
    pub magnus: C,
    /// Drag against rotations, before the density of the medium.
    pub moments: [C; 3],
    pub density: C,
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

/// By degree of freedom: whether gravity compensation counts as an actuator force (`actuatorgravcomp`); empty if none does.
pub(super) fn actuated_gravity_compensation<C>(model: &Model, gravcomp: &[GravComp<C>]) -> Vec<bool> {
    let by_dof: Vec<bool> = model.dofs.iter().map(|d| model.joints[d.joint].actuator_gravcomp).collect();
    if gravcomp.is_empty() || !by_dof.contains(&true) { Vec::new() } else { by_dof }
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
        if b.mass < 1e-15 || own_geoms(model, body).any(|(_, g)| g.fluid.is_some()) {
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

/// The geoms of a body.
fn own_geoms(model: &Model, body: usize) -> impl Iterator<Item = (usize, &Geom)> {
    let b = &model.bodies[body];
    (b.geom_start..b.geom_start + b.geom_count).map(|g| (g, &model.geoms[g]))
}

/// Prepares the geoms that are like ellipsoids to the medium.
pub(super) fn ellipsoid_drags<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    link_of: &[Option<usize>],
    alone: impl Fn(usize) -> bool,
) -> Vec<EllipsoidDrag<T::Scalar>> {
    let c = T::scalar;
    let (density, viscosity) = (model.opt.density, model.opt.viscosity);
    let mut out = Vec::new();
    if !passive(model) || (density == 0.0 && viscosity == 0.0) {
        return out;
    }
    for (body, b) in model.bodies.iter().enumerate() {
        let Some(link) = link_of[mounts[body].body].filter(|_| b.mass >= 1e-15) else { continue };
        for (geom, fluid) in own_geoms(model, body).filter_map(|(i, g)| g.fluid.map(|fluid| (i, fluid))) {
            let pi = std::f64::consts::PI;
            let s = fluid.semiaxes;
            let others = |k: usize| (s[(k + 1) % 3], s[(k + 2) % 3]);
            let square = |x: f64| x * x;
            let mut sorted = s;
            sorted.sort_by(f64::total_cmp);
            let [_, middle, largest] = sorted;
            let ([blunt, slender, angular], [kutta, magnus]) = (fluid.drag, fluid.lift);
            let products = [0, 1, 2].map(|k| others(k).0 * others(k).1);
            let widest = products.into_iter().fold(0.0, f64::max);
            let moment = |length: f64, across: f64| 8.0 / 15.0 * pi * length * square(square(across));
            let most = moment(middle, largest);
            // of the sphere with the mean of the half lengths
            let diameter = 2.0 / 3.0 * (s[0] + s[1] + s[2]);
            out.push(EllipsoidDrag {
                link,
                geom,
                alone: alone(link),
                mass: fluid.virtual_mass.map(|m| c(density * m)),
                inertia: fluid.virtual_inertia.map(|i| c(density * i)),
                squares: products.map(|x| c(square(x / widest))),
                section: c(pi * widest),
                area: c(pi * largest * middle),
                viscous: [c(viscosity * pi * diameter * diameter * diameter), c(viscosity * 3.0 * pi * diameter)],
                blunt: c(density * blunt),
                slender: c(density * slender),
                kutta: c(density * kutta),
                magnus: c(density * magnus * (4.0 / 3.0 * pi * s[0] * s[1] * s[2])),
                moments: [0, 1, 2].map(|k| {
                    let own = moment(s[k], f64::max(others(k).0, others(k).1));
                    c(angular * own + slender * (most - own))
                }),
                density: c(density),
            });
        }
    }
    out
}
