//! The model as the kernels see it: links, joints, contact candidates and actuators with constants in lane precision.
//!
//! Bodies without joints are merged into the body they are welded to, so the kernels only meet bodies that move
//! ("links"). What this engine does not simulate is refused here by name, never ignored.

use crate::collision::{Candidate, floor_candidates};
use crate::lanes::Real;
use crate::model::{Cone, Integrator, JointType, Model};
use crate::rigid;
use thiserror::Error;

/// Why a model cannot be simulated.
#[derive(Debug, Error, PartialEq)]
pub enum SimError {
    /// The model uses something that this engine does not simulate.
    #[error("model '{model}': {what} is not supported by the simulator; {remedy}")]
    Unsupported {
        /// Model name.
        model: String,
        /// The offending element by name.
        what: String,
        /// What to do about it.
        remedy: String,
    },
}

/// Choices a user makes when building a [`Sim`].
#[derive(Clone, Debug, Default)]
pub struct SimOptions {
    /// Simulate contacts with the static floor alone even if the model's moving geoms could collide with each other
    /// (by their contype and conaffinity). Without it such a model is refused.
    pub ground_contacts_only: bool,
    /// Overrides the model's cap on Newton iterations.
    pub max_newton: Option<usize>,
}

/// Solver parameters of one constraint: impedance and reference acceleration as functions of the violation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Softness<C> {
    /// Stiffness and damping of the reference acceleration, divided by `dmax` as MuJoCo does.
    pub k: C,
    pub b: C,
    pub d0: C,
    pub span: C,
    pub inv_width: C,
    pub midpoint: C,
    pub power: C,
    /// Normalizations of the two halves of the power curve.
    pub low_scale: C,
    pub high_scale: C,
    /// `power` is 2 and the midpoint 1/2: the default, which needs no exponential.
    pub quadratic: bool,
    /// Violation is measured from here.
    pub margin: C,
    /// Approximate inverse inertia seen by the constraint.
    pub diag: C,
}

/// A body that moves.
#[derive(Clone, Debug)]
pub(crate) struct Link<C> {
    /// Index of the parent link; `None` for the root of a tree.
    pub parent: Option<usize>,
    /// Tree that it belongs to.
    pub tree: usize,
    pub pos: [C; 3],
    pub rot: [[C; 3]; 3],
    pub rot_is_identity: bool,
    pub mass: C,
    pub com: [C; 3],
    /// Inertia about the center of mass in the link's frame: xx yy zz xy xz yz.
    pub inertia: [C; 6],
    pub inertia_is_diagonal: bool,
    pub joints: std::ops::Range<usize>,
    pub dofs: std::ops::Range<usize>,
    pub has_children: bool,
    /// In a backward pass over the links this one is the first to reach its parent.
    pub first_to_parent: bool,
    /// A free joint whose six diagonal entries are equal in pairs: solved as one 6x6 block.
    pub free_block: bool,
}

/// A joint.
#[derive(Clone, Debug)]
pub(crate) struct LinkJoint<C> {
    pub kind: JointType,
    pub qpos: usize,
    pub dof: usize,
    pub pos: [C; 3],
    pub centered: bool,
    pub axis: [C; 3],
    /// The axis is +-x, +-y or +-z of the link: rotation touches two columns only.
    pub aligned: Option<(usize, bool)>,
    pub q0: C,
    pub stiffness: C,
    pub spring: [C; 4],
    pub has_spring: bool,
}

/// A joint limit.
#[derive(Clone, Debug)]
pub(crate) struct LimitSpec<C> {
    pub qpos: usize,
    pub dof: usize,
    /// Limits as sums of two numbers each: what rounding takes from a limit would be a large part of a small violation.
    pub low: [C; 2],
    pub high: [C; 2],
    /// Both sides can be violated at once: two rows instead of one.
    pub two_sided: bool,
    pub soft: Softness<C>,
}

/// Dry friction of a degree of freedom.
#[derive(Clone, Debug)]
pub(crate) struct DryFriction<C> {
    pub dof: usize,
    pub loss: C,
    pub soft: Softness<C>,
}

/// An actuator.
#[derive(Clone, Debug)]
pub(crate) struct Motor<C> {
    /// Degrees of freedom and gears.
    pub dofs: std::ops::Range<usize>,
    pub gear: [C; 6],
    /// Coordinate of the scalar joint it reads, for affine gains and biases.
    pub qpos: usize,
    pub ctrl: Option<(C, C)>,
    pub force: Option<(C, C)>,
    pub gain: [C; 3],
    pub bias: [C; 3],
    /// Plain motor: force = gain * ctrl.
    pub plain: bool,
}

/// Where a body sits on its link: for reading poses of welded bodies.
#[derive(Clone, Debug)]
pub(crate) struct Mount<C> {
    /// Link, or `None` for static bodies.
    pub link: Option<usize>,
    pub pos: [C; 3],
    pub rot: [[C; 3]; 3],
}

/// Everything constant about a simulation in lane precision.
#[derive(Clone, Debug)]
pub struct Sim<T: Real> {
    pub(crate) model: Model,
    pub(crate) links: Vec<Link<T::Scalar>>,
    pub(crate) trees: usize,
    pub(crate) joints: Vec<LinkJoint<T::Scalar>>,
    pub(crate) armature: Vec<T::Scalar>,
    pub(crate) damping: Vec<T::Scalar>,
    pub(crate) implicit_damping: bool,
    pub(crate) limits: Vec<LimitSpec<T::Scalar>>,
    pub(crate) dry: Vec<DryFriction<T::Scalar>>,
    pub(crate) motors: Vec<Motor<T::Scalar>>,
    pub(crate) floor: Vec<Candidate<T::Scalar>>,
    /// Frames, centers of mass (inertial frames), geoms and sites as seen from the links they move with.
    pub(crate) bodies: Vec<Mount<T::Scalar>>,
    pub(crate) coms: Vec<Mount<T::Scalar>>,
    pub(crate) geoms: Vec<Mount<T::Scalar>>,
    pub(crate) sites: Vec<Mount<T::Scalar>>,
    /// Floor candidates of each geom.
    pub(crate) geom_candidates: Vec<std::ops::Range<usize>>,
    pub(crate) dt: T::Scalar,
    pub(crate) gravity: [T::Scalar; 3],
    pub(crate) rk4: bool,
    pub(crate) warmstart: bool,
    pub(crate) max_newton: usize,
    pub(crate) max_line_search: usize,
    /// Newton decrement at which a lane counts as converged.
    pub(crate) tolerance: T::Scalar,
}

impl<T: Real> Sim<T> {
    /// Prepares a model for stepping.
    ///
    /// # Errors
    /// If the model uses something this engine does not simulate.
    pub fn new(model: &Model, options: SimOptions) -> Result<Sim<T>, SimError> {
        refuse_unsupported(model)?;
        let c = T::scalar;
        let c3 = |v: &[f64; 3]| [c(v[0]), c(v[1]), c(v[2])];
        let flags = model.opt.flags;

        // link numbers of the bodies that move, and where every other body sits on them
        let mut link_of = vec![None; model.bodies.len()];
        let mut order = Vec::new();
        for (i, body) in model.bodies.iter().enumerate().skip(1) {
            if body.dof_count > 0 {
                link_of[i] = Some(order.len());
                order.push(i);
            }
        }
        let mounts = rigid::mounts(model);
        // a frame fixed to a body, as seen from the link that the body moves with
        let mount = |body: usize, pos: &[f64; 3], quat: &[f64; 4]| {
            let m = &mounts[body];
            let (pos, rot) = rigid::compose(&(m.pos, m.rot), &(*pos, rigid::quat_to_rot(quat)));
            Mount { link: link_of[m.body], pos: c3(&pos), rot: rot.map(|r| c3(&r)) }
        };
        let bodies = (0..model.bodies.len()).map(|b| mount(b, &[0.0; 3], &[1.0, 0.0, 0.0, 0.0])).collect();
        let coms = model.bodies.iter().enumerate().map(|(b, x)| mount(b, &x.ipos, &x.iquat)).collect();
        let geoms = model.geoms.iter().map(|g| mount(g.body, &g.pos, &g.quat)).collect();
        let sites = model.sites.iter().map(|s| mount(s.body, &s.pos, &s.quat)).collect();

        let mut trees = 0;
        let mut links: Vec<Link<T::Scalar>> = Vec::new();
        for &b in &order {
            let body = &model.bodies[b];
            let parent = link_of[model.bodies[body.parent].weld_id];
            let (pos, rot) = rigid::compose(
                &(mounts[body.parent].pos, mounts[body.parent].rot),
                &(body.pos, rigid::quat_to_rot(&body.quat)),
            );
            let lump = rigid::lump(model, &mounts, b);
            let tree = match parent {
                Some(p) => links[p].tree,
                None => {
                    trees += 1;
                    trees - 1
                }
            };
            let joints = body.joint_start..body.joint_start + body.joint_count;
            let dofs = body.dof_start..body.dof_start + body.dof_count;
            let free = model.joints[joints.start].kind == JointType::Free;
            let lossless = model.dofs[dofs.clone()].iter().all(|d| d.frictionloss == 0.0);
            links.push(Link {
                parent,
                tree,
                pos: c3(&pos),
                rot: rot.map(|r| c3(&r)),
                rot_is_identity: rigid::is_identity(&rot),
                mass: c(lump.mass),
                com: c3(&lump.com),
                inertia: lump.inertia.map(c),
                inertia_is_diagonal: lump.inertia[3..].iter().all(|x| x.abs() < 1e-12 * lump.inertia[0].abs()),
                joints,
                dofs,
                has_children: false,
                first_to_parent: false,
                free_block: free && lossless,
            });
            if let Some(p) = parent {
                links[p].has_children = true;
            }
        }
        for i in 0..links.len() {
            let later_sibling = links[i + 1..].iter().any(|l| l.parent == links[i].parent);
            links[i].first_to_parent = links[i].parent.is_some() && !later_sibling;
        }

        let joints = model
            .joints
            .iter()
            .map(|j| {
                let aligned = (0..3).find(|&a| j.axis[a].abs() > 1.0 - 1e-12).map(|a| (a, j.axis[a] < 0.0));
                let width = if j.kind == JointType::Ball { 4 } else { 1 };
                let mut spring = [c(0.0); 4];
                let offset = if j.kind == JointType::Free { 3 } else { 0 };
                for (s, q) in spring.iter_mut().zip(&model.qpos_spring[j.qpos_adr + offset..]).take(width.max(1)) {
                    *s = c(*q);
                }
                LinkJoint {
                    kind: j.kind,
                    qpos: j.qpos_adr,
                    dof: j.dof_adr,
                    pos: c3(&j.pos),
                    centered: j.pos == [0.0; 3],
                    axis: c3(&j.axis),
                    aligned,
                    q0: c(model.qpos0[j.qpos_adr]),
                    stiffness: c(j.stiffness),
                    spring,
                    has_spring: j.stiffness != 0.0 && flags.spring,
                }
            })
            .collect();

        let mut limits = Vec::new();
        if flags.limit && flags.constraint {
            for j in model.joints.iter().filter(|j| j.limited) {
                limits.push(LimitSpec {
                    qpos: j.qpos_adr,
                    dof: j.dof_adr,
                    low: split::<T>(j.range[0]),
                    high: split::<T>(j.range[1]),
                    two_sided: j.range[1] - j.range[0] <= 2.0 * j.margin,
                    soft: softness::<T>(
                        model,
                        &j.solref_limit,
                        &j.solimp_limit,
                        j.margin,
                        model.dofs[j.dof_adr].invweight0,
                    ),
                });
            }
        }
        let mut dry = Vec::new();
        if flags.frictionloss && flags.constraint {
            for (dof, d) in model.dofs.iter().enumerate().filter(|(_, d)| d.frictionloss > 0.0) {
                let soft = softness::<T>(model, &d.solref_friction, &d.solimp_friction, 0.0, d.invweight0);
                dry.push(DryFriction { dof, loss: c(d.frictionloss), soft });
            }
        }
        let mut motors = Vec::new();
        if flags.actuation {
            for a in &model.actuators {
                let joint = &model.joints[a.joint];
                let dofs = match joint.kind {
                    JointType::Free => 6,
                    JointType::Ball => 3,
                    _ => 1,
                };
                let range = |on: bool, r: &[f64; 2]| on.then(|| (c(r[0]), c(r[1])));
                motors.push(Motor {
                    dofs: joint.dof_adr..joint.dof_adr + dofs,
                    gear: a.gear.map(c),
                    qpos: joint.qpos_adr,
                    ctrl: range(a.ctrl_limited && flags.clampctrl, &a.ctrl_range),
                    force: range(a.force_limited, &a.force_range),
                    gain: a.gain.map(c),
                    bias: a.bias.map(c),
                    plain: a.gain[1..] == [0.0; 2] && a.bias == [0.0; 3],
                });
            }
        }
        let floor = if flags.contact && flags.constraint {
            floor_candidates::<T>(model, &mounts, &link_of, &options)?
        } else {
            Vec::new()
        };
        let geom_candidates = (0..model.geoms.len())
            .map(|g| {
                let first = floor.iter().position(|c| c.geom == g).unwrap_or(0);
                first..first + floor.iter().filter(|c| c.geom == g).count()
            })
            .collect();
        let damping: Vec<_> = model.dofs.iter().map(|d| c(if flags.damper { d.damping } else { 0.0 })).collect();
        let damped = flags.damper && model.dofs.iter().any(|d| d.damping != 0.0);
        let rk4 = model.opt.integrator == Integrator::Rk4;
        let gravity = if flags.gravity { model.opt.gravity } else { [0.0; 3] };
        // MuJoCo scales cost changes by 1 / (meaninertia * nv); a Newton decrement is twice the predicted change
        let tolerance = 2.0 * model.opt.tolerance * model.stat.mean_inertia * model.nv.max(1) as f64;
        Ok(Sim {
            links,
            trees,
            joints,
            armature: model.dofs.iter().map(|d| c(d.armature)).collect(),
            implicit_damping: damped && flags.eulerdamp && !rk4,
            damping,
            limits,
            dry,
            motors,
            floor,
            bodies,
            coms,
            geoms,
            sites,
            geom_candidates,
            dt: c(model.opt.timestep),
            gravity: c3(&gravity),
            rk4,
            warmstart: flags.warmstart,
            max_newton: options.max_newton.unwrap_or(model.opt.iterations),
            max_line_search: model.opt.ls_iterations,
            tolerance: c(tolerance),
            model: model.clone(),
        })
    }

    /// The compiled model that this was made from.
    pub fn model(&self) -> &Model {
        &self.model
    }
}

/// A number as the sum of its rounded value and the rest.
fn split<T: Real>(x: f64) -> [T::Scalar; 2] {
    let rounded = T::scalar(x);
    [rounded, T::scalar(x - T::widen(rounded))]
}

/// Refuses what the kernels do not simulate.
fn refuse_unsupported(model: &Model) -> Result<(), SimError> {
    let refuse = |what: String, remedy: &str| {
        Err(SimError::Unsupported { model: model.name.clone(), what, remedy: remedy.into() })
    };
    match model.opt.integrator {
        Integrator::Euler | Integrator::Rk4 => {}
        other => return refuse(format!("integrator {other:?}"), "use Euler or RK4"),
    }
    if model.opt.cone == Cone::Elliptic && model.geoms.iter().any(|g| g.condim > 1) {
        return refuse("the elliptic friction cone".into(), "use cone=\"pyramidal\"");
    }
    for body in &model.bodies {
        if body.gravcomp != 0.0 {
            return refuse(format!("gravcomp of body '{}'", body.name), "remove the attribute");
        }
        let joints = &model.joints[body.joint_start..body.joint_start + body.joint_count];
        for (i, joint) in joints.iter().enumerate() {
            match joint.kind {
                JointType::Free if joints.len() > 1 || body.parent != 0 => {
                    return refuse(
                        format!("free joint '{}' below another joint", joint.name),
                        "free joints belong on top-level bodies",
                    );
                }
                JointType::Ball if i + 1 < joints.len() => {
                    return refuse(
                        format!("ball joint '{}' followed by another joint of its body", joint.name),
                        "list the ball joint last",
                    );
                }
                JointType::Ball if joint.limited => {
                    return refuse(format!("the limit of ball joint '{}'", joint.name), "use three hinges with limits");
                }
                _ => {}
            }
            if joint.actuator_force_range.is_some() {
                return refuse(format!("actuatorfrcrange of joint '{}'", joint.name), "use the actuators' forcerange");
            }
        }
    }
    for a in &model.actuators {
        let joint = &model.joints[a.joint];
        let scalar = matches!(joint.kind, JointType::Hinge | JointType::Slide);
        let affine = a.gain[1..] != [0.0; 2] || a.bias[1..] != [0.0; 2];
        if !scalar && affine {
            return refuse(
                format!("actuator '{}' with position or velocity feedback on joint '{}'", a.name, joint.name),
                "only hinge and slide joints can be fed back",
            );
        }
    }
    Ok(())
}

/// Constants of MuJoCo's impedance and reference acceleration (documentation, "Solver parameters").
pub(crate) fn softness<T: Real>(
    model: &Model,
    solref: &[f64; 2],
    solimp: &[f64; 5],
    margin: f64,
    diag: f64,
) -> Softness<T::Scalar> {
    let c = T::scalar;
    let (min, max) = (1e-4, 0.9999);
    let (dmin, dmax) = (solimp[0].clamp(min, max), solimp[1].clamp(min, max));
    let width = solimp[2].max(0.0);
    let (midpoint, power) = (solimp[3].clamp(min, max), solimp[4].max(1.0));
    let (k, b) = if solref[0] > 0.0 && solref[1] > 0.0 {
        let floor = if model.opt.flags.refsafe { 2.0 * model.opt.timestep } else { 0.0 };
        let time = solref[0].max(floor);
        let ratio = solref[1];
        (1.0 / (dmax * dmax * time * time * ratio * ratio).max(1e-15), 2.0 / (dmax * time).max(1e-15))
    } else {
        (-solref[0] / (dmax * dmax), -solref[1] / dmax)
    };
    // a flat curve is the mean impedance everywhere
    let flat = dmin == dmax || width <= 1e-15;
    let (d0, span) = if flat { (0.5 * (dmin + dmax), 0.0) } else { (dmin, dmax - dmin) };
    Softness {
        k: c(k),
        b: c(b),
        d0: c(d0),
        span: c(span),
        inv_width: c(1.0 / width.max(1e-15)),
        midpoint: c(midpoint),
        power: c(power),
        low_scale: c(1.0 / midpoint.powf(power - 1.0)),
        high_scale: c(1.0 / (1.0 - midpoint).powf(power - 1.0)),
        quadratic: power == 2.0 && midpoint == 0.5,
        margin: c(margin),
        diag: c(diag.max(1e-15)),
    }
}
