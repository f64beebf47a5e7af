//! The model as the kernels see it: links, joints, contact candidates and actuators with constants in lane precision.
//!
//! Bodies without joints are merged into the body they are welded to, so the kernels only meet bodies that move
//! ("links"). What this engine does not simulate is refused here by name, never ignored.

use crate::collision::{Contacts, contacts};
use crate::equality::{EqualitySpec, equalities};
use crate::fluid::{Drag, Lift, drags, lifts};
use crate::forces::{Motor, motors};
use crate::lanes::Real;
use crate::model::{Cone, Integrator, JointType, Model};
use crate::narrow::height::HeightField;
use crate::rigid;
use crate::solver::crowd::MOST_ROWS;
use crate::solver::softness::{Softness, softness};
use crate::support;
use crate::tendon::{BallLimit, TendonSpec, ball_limits, tendons};
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
    /// Simulate contacts with the static world alone even if the model's moving geoms could collide with each other (by
    /// their contype and conaffinity).
    pub ground_contacts_only: bool,
    /// Overrides the model's cap on Newton iterations.
    pub max_newton: Option<usize>,
    /// Overrides the number of rows between moving bodies beyond which an agent is solved as a crowd (24). It changes
    /// the time of a step, and its results to rounding.
    pub most_coupled_rows: Option<usize>,
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
    /// Last child, and the child of the same parent before this one.
    pub last_child: Option<usize>,
    pub sibling: Option<usize>,
    /// A free joint whose six diagonal entries are equal in pairs: solved as one 6x6 block.
    pub free_block: bool,
    /// A free body with nothing that moves on it.
    pub alone: bool,
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
    /// Link of every degree of freedom.
    pub(crate) dof_link: Vec<usize>,
    pub(crate) joints: Vec<LinkJoint<T::Scalar>>,
    pub(crate) armature: Vec<T::Scalar>,
    pub(crate) damping: Vec<T::Scalar>,
    /// Damping is taken at the end of the step.
    pub(crate) implicit_damping: bool,
    /// So are the actuators' forces that depend on velocity.
    pub(crate) implicit_fast: bool,
    /// Some rows are so hard that single precision does not resolve their forces, though it does the accelerations: the
    /// velocities follow from those.
    pub(crate) hard: bool,
    pub(crate) limits: Vec<LimitSpec<T::Scalar>>,
    pub(crate) dry: Vec<DryFriction<T::Scalar>>,
    pub(crate) motors: Vec<Motor<T::Scalar>>,
    /// Bounds of what all actuators together exert on a degree of freedom.
    pub(crate) joint_force_ranges: Vec<(usize, T::Scalar, T::Scalar)>,
    pub(crate) equalities: Vec<EqualitySpec<T::Scalar>>,
    pub(crate) tendons: Vec<TendonSpec<T::Scalar>>,
    pub(crate) ball_limits: Vec<BallLimit<T::Scalar>>,
    pub(crate) lifts: Vec<Lift<T::Scalar>>,
    pub(crate) drags: Vec<Drag<T::Scalar>>,
    pub(crate) wind: [T::Scalar; 3],
    pub(crate) contacts: Contacts<T::Scalar>,
    pub(crate) fields: Vec<HeightField<T::Scalar>>,
    /// Frames, centers of mass (inertial frames), geoms and sites as seen from the links they move with.
    pub(crate) bodies: Vec<Mount<T::Scalar>>,
    pub(crate) coms: Vec<Mount<T::Scalar>>,
    pub(crate) geoms: Vec<Mount<T::Scalar>>,
    pub(crate) sites: Vec<Mount<T::Scalar>>,
    pub(crate) dt: T::Scalar,
    pub(crate) gravity: [T::Scalar; 3],
    pub(crate) rk4: bool,
    /// All motion is in the x-z plane: see [`crate::space::Planar`].
    pub(crate) planar: bool,
    /// Contacts have elliptic cones.
    pub(crate) elliptic: bool,
    pub(crate) warmstart: bool,
    pub(crate) max_newton: usize,
    /// Rows between moving bodies beyond which an agent is solved as a [crowd](crate::solver::crowd).
    pub(crate) most_rows: usize,
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
        support::check(model)?;
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
                last_child: None,
                sibling: None,
                free_block: free && lossless,
                alone: free,
            });
            if let Some(p) = parent {
                let me = links.len() - 1;
                links[me].sibling = links[p].last_child.replace(me);
                links[p].alone = false;
            }
        }

        let dof_link = model.dofs.iter().map(|d| link_of[d.body].expect("it moves")).collect();
        let joints = model
            .joints
            .iter()
            .map(|j| {
                let aligned = (0..3).find(|&a| j.axis[a].abs() > 1.0 - 1e-12).map(|a| (a, j.axis[a] < 0.0));
                let width = if matches!(j.kind, JointType::Ball | JointType::Free) { 4 } else { 1 };
                let mut spring = [c(0.0); 4];
                let offset = if j.kind == JointType::Free { 3 } else { 0 };
                for (s, q) in spring.iter_mut().zip(&model.qpos_spring[j.qpos_adr + offset..]).take(width) {
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
            for j in model.joints.iter().filter(|j| j.limited && j.kind != JointType::Ball) {
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
        let mut joint_force_ranges = Vec::new();
        for j in &model.joints {
            if let Some([low, high]) = j.actuator_force_range {
                joint_force_ranges.push((j.dof_adr, c(low), c(high)));
            }
        }
        let tendons = tendons::<T>(model);
        let equalities = if flags.equality && flags.constraint {
            equalities::<T>(model, &mounts, &link_of, &tendons)
        } else {
            Vec::new()
        };
        let contacts = if flags.contact && flags.constraint {
            let tree_of: Vec<usize> = links.iter().map(|l| l.tree).collect();
            contacts::<T>(model, &mounts, &link_of, &tree_of, &options)?
        } else {
            Contacts::none()
        };
        let damping: Vec<_> = model.dofs.iter().map(|d| c(if flags.damper { d.damping } else { 0.0 })).collect();
        let damped = flags.damper && model.dofs.iter().any(|d| d.damping != 0.0);
        let implicit_fast = model.opt.integrator == Integrator::ImplicitFast;
        let rk4 = model.opt.integrator == Integrator::Rk4;
        let gravity = if flags.gravity { model.opt.gravity } else { [0.0; 3] };
        let planar = is_planar(model, &links);
        let lifts = lifts::<T>(model, &mounts, &links, &link_of);
        // MuJoCo scales cost changes by 1 / (meaninertia * nv); a Newton decrement is twice the predicted change
        let tolerance = 2.0 * model.opt.tolerance * model.stat.mean_inertia * model.nv.max(1) as f64;
        Ok(Sim {
            links,
            trees,
            dof_link,
            joints,
            armature: model.dofs.iter().map(|d| c(d.armature)).collect(),
            implicit_damping: implicit_fast || (damped && flags.eulerdamp && !rk4),
            implicit_fast,
            hard: contacts.hard || equalities.iter().any(|e| e.hard),
            damping,
            limits,
            dry,
            motors: motors::<T>(model),
            joint_force_ranges,
            equalities,
            tendons,
            ball_limits: ball_limits::<T>(model),
            lifts,
            drags: drags::<T>(model, &mounts, &link_of),
            wind: c3(&model.opt.wind),
            contacts,
            fields: model.hfields.iter().map(HeightField::new).collect(),
            bodies,
            coms,
            geoms,
            sites,
            dt: c(model.opt.timestep),
            gravity: c3(&gravity),
            rk4,
            planar,
            elliptic: model.opt.cone == Cone::Elliptic,
            warmstart: flags.warmstart,
            max_newton: options.max_newton.unwrap_or(model.opt.iterations),
            most_rows: options.most_coupled_rows.unwrap_or(MOST_ROWS),
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

/// Whether every joint slides in the x-z plane or turns about y, and no link is turned out of that plane: exactly, as
/// the lanes will see it.
fn is_planar<C: Copy + PartialEq + Default>(model: &Model, links: &[Link<C>]) -> bool {
    let zero = C::default();
    let in_plane = |c: &[C; 3]| c[1] == zero;
    let upright =
        |l: &Link<C>| in_plane(&l.rot[0]) && in_plane(&l.rot[2]) && l.rot[1][0] == zero && l.rot[1][2] == zero;
    links.iter().all(upright)
        && model.joints.iter().all(|j| match j.kind {
            JointType::Hinge => j.axis[0] == 0.0 && j.axis[2] == 0.0,
            JointType::Slide => j.axis[1] == 0.0,
            JointType::Ball | JointType::Free => false,
        })
}

/// A number as the sum of its rounded value and the rest.
pub(crate) fn split<T: Real>(x: f64) -> [T::Scalar; 2] {
    let rounded = T::scalar(x);
    [rounded, T::scalar(x - T::widen(rounded))]
}
