//! The model for the kernels: links, joints, contact candidates and actuators with constants in lane precision.
//!
//! Bodies without joints are merged into the body they are welded to, so the kernels only see moving bodies ("links").
//! The simulator refuses unsupported elements by name ([`unsupported`], [`contacts`]) and ignores nothing.
//!
//! Each file prepares one kind of constant. The kernels that read it are in the folders above.

mod actuator;
mod adhesion;
mod broad;
mod caps;
mod contact_params;
mod contacts;
mod drive;
mod equality;
mod floor_points;
mod limit;
mod link;
mod medium;
mod muscle;
mod no_slip;
mod options;
mod pairs;
mod softness;
mod string;
mod tendon;
mod tree_matrix;
mod unsupported;
mod weights;
mod weld;

pub(crate) use actuator::{Activation, ActuatorSpec, TendonForceRange, TransmissionSpec};
pub(crate) use adhesion::AdhesionSpec;
pub(crate) use broad::Broad;
pub(crate) use caps::Caps;
pub(crate) use contact_params::least_sliding;
pub(crate) use contacts::{Contacts, rank};
pub(crate) use drive::{DriveKind, DriveSpec};
pub(crate) use equality::{EqualitySpec, Frames, Length, Tie};
pub(crate) use limit::{BallLimit, DryFriction, LimitSpec};
pub(crate) use link::{Link, LinkJoint, Mount};
pub(crate) use medium::{Drag, EllipsoidDrag, GravComp};
pub(crate) use muscle::{MuscleActivation, MuscleSpec};
pub(crate) use no_slip::NoSlip;
pub(crate) use options::MOST_COUPLED_ROWS;
pub use options::{SimError, SimOptions};
pub(crate) use pairs::{Cull, GeomPair, GeomPairOf, PairSpec, ShapePair};
pub(crate) use softness::{Cost, Softness, impedance, impedance_at};
pub(crate) use string::{Around, Lever, Span, Spot, StringSpec};
pub(crate) use tendon::TendonSpec;
pub(crate) use tree_matrix::TreeMatrix;
pub(crate) use weights::{inverse_weights, tendon_weight, translational_weight, weights_of_body};
pub(crate) use weld::mounts;

use crate::geometry::convex::{MOST_ITERATIONS, Polyhedron, Search};
use crate::geometry::height::HeightField;
use crate::lanes::Real;
use crate::mjcf::reweigh::Reweigher;
use crate::model::{Cone, Integrator, Model};
use std::sync::{Arc, OnceLock};

/// All constants of a simulation in lane precision.
#[derive(Clone, Debug)]
pub struct Sim<T: Real> {
    pub(crate) model: Model,
    /// Finds the inverse weights of agents with masses of their own. Made when the first one appears.
    pub(crate) reweigher: OnceLock<Arc<Reweigher>>,
    pub(crate) links: Vec<Link<T::Scalar>>,
    pub(crate) trees: usize,
    /// Number of mocap bodies.
    pub(crate) mocaps: usize,
    /// Link of every degree of freedom.
    pub(crate) dof_link: Vec<usize>,
    pub(crate) joints: Vec<LinkJoint<T::Scalar>>,
    pub(crate) armature: Vec<T::Scalar>,
    pub(crate) damping: Vec<T::Scalar>,
    /// Whether damping is taken at the end of the step.
    pub(crate) implicit_damping: bool,
    /// Whether velocity-dependent actuator forces are, too.
    pub(crate) implicit_fast: bool,
    /// Whether some rows are so hard that single precision resolves their accelerations but not their forces. The
    /// velocities then follow from the accelerations.
    pub(crate) hard: bool,
    pub(crate) limits: Vec<LimitSpec<T::Scalar>>,
    pub(crate) dry: Vec<DryFriction<T::Scalar>>,
    pub(crate) actuators: Vec<ActuatorSpec<T::Scalar>>,
    /// Bounds of the total actuator force on a degree of freedom.
    pub(crate) joint_force_ranges: Vec<(usize, T::Scalar, T::Scalar)>,
    /// Bounds of the total actuator force on a tendon.
    pub(crate) tendon_force_ranges: Vec<TendonForceRange<T::Scalar>>,
    pub(crate) equalities: Vec<EqualitySpec<T::Scalar>>,
    pub(crate) tendons: Vec<TendonSpec<T::Scalar>>,
    /// Number of blocks of tendons with armature.
    pub(crate) inertia_blocks: usize,
    /// The paths of spatial tendons.
    pub(crate) strings: Vec<StringSpec<T::Scalar>>,
    pub(crate) adhesions: Vec<AdhesionSpec>,
    /// Transmissions through sites.
    pub(crate) drives: Vec<DriveSpec<T::Scalar>>,
    /// The matrix that the integrator solves with, if it does not fit the recursion over the tree.
    pub(crate) tree_matrix: Option<TreeMatrix>,
    pub(crate) ball_limits: Vec<BallLimit<T::Scalar>>,
    pub(crate) gravcomp: Vec<GravComp<T::Scalar>>,
    /// By degree of freedom: whether gravity compensation counts as an actuator force on it. Empty if none does.
    pub(crate) actuated_gravcomp: Vec<bool>,
    pub(crate) drags: Vec<Drag<T::Scalar>>,
    pub(crate) ellipsoid_drags: Vec<EllipsoidDrag<T::Scalar>>,
    pub(crate) wind: [T::Scalar; 3],
    pub(crate) contacts: Contacts<T::Scalar>,
    pub(crate) fields: Vec<HeightField<T::Scalar>>,
    pub(crate) hulls: Vec<Polyhedron<T::Scalar>>,
    /// Settings of the search for contacts of convex shapes.
    pub(crate) search: Search<T::Scalar>,
    /// Frames, centers of mass (inertial frames), geoms and sites relative to the links they move with.
    pub(crate) bodies: Vec<Mount<T::Scalar>>,
    pub(crate) coms: Vec<Mount<T::Scalar>>,
    pub(crate) geoms: Vec<Mount<T::Scalar>>,
    pub(crate) sites: Vec<Mount<T::Scalar>>,
    pub(crate) dt: T::Scalar,
    pub(crate) gravity: [T::Scalar; 3],
    pub(crate) rk4: bool,
    /// Whether all motion is in the x-z plane: see [`Planar`](crate::algebra::planar::Planar).
    pub(crate) planar: bool,
    /// Whether contacts have elliptic cones.
    pub(crate) elliptic: bool,
    pub(crate) warmstart: bool,
    /// Solver settings of models whose iteration cap stops the solver before it converges.
    pub(crate) capped: Option<Caps>,
    /// Settings of the second solver for friction, of models that have it.
    pub(crate) no_slip: Option<NoSlip>,
    pub(crate) max_newton: usize,
    /// Number of rows between moving bodies above which an agent is factorized separately.
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
    // not inlined, and so compiled once for all crates
    #[inline(never)]
    pub fn new(model: &Model, options: SimOptions) -> Result<Sim<T>, SimError> {
        unsupported::check(model)?;
        let c = T::scalar;
        let flags = &model.opt.flags;
        let (link_of, mounts) = (link::number_links(model), weld::mounts(model));
        let (links, trees) = link::links::<T>(model, &mounts, &link_of);
        let bodies = || 0..model.bodies.len();
        let mount =
            |body: usize, (pos, quat): ([f64; 3], [f64; 4])| Mount::new::<T>(&mounts, &link_of, body, &pos, &quat);
        let tendons = tendon::tendons::<T>(model);
        let equalities = equality::equalities::<T>(model, &mounts, &link_of, &tendons);
        let dof_link: Vec<usize> =
            model.dofs.iter().map(|d| link_of[d.body].expect("dofs belong to moving bodies")).collect();
        let tree_of: Vec<usize> = links.iter().map(|l| l.tree).collect();
        let geoms: Vec<_> = model.geoms.iter().enumerate().map(|(i, g)| mount(g.body, model.geom_frame(i))).collect();
        let sites: Vec<_> = model.sites.iter().enumerate().map(|(i, s)| mount(s.body, model.site_frame(i))).collect();
        let places = string::Mounts { sites: &sites, geoms: &geoms, trees: &tree_of };
        let (strings, drives) = (string::strings::<T>(model, &places), drive::drives::<T>(model, &places));
        let contacts = contacts::contacts::<T>(model, &mounts, &link_of, &tree_of, &options)?;
        let capped = Caps::new(model, &options);
        let damped = flags.damper && model.dofs.iter().any(|d| d.damping != 0.0 || capped.is_some() && d.geared);
        let implicit_fast = matches!(model.opt.integrator, Integrator::Implicit | Integrator::ImplicitFast);
        let gravcomp = medium::gravity_compensation::<T>(model, &mounts, &link_of);
        let drags = medium::drags::<T>(model, &mounts, &link_of);
        let ellipsoid_drags = medium::ellipsoid_drags::<T>(model, &mounts, &link_of, |l| links[l].alone);
        let medium = !(drags.is_empty() && ellipsoid_drags.is_empty());
        let rk4 = model.opt.integrator == Integrator::Rk4;
        let implicit_damping = implicit_fast || (damped && flags.eulerdamp && !rk4);
        let gravity = if flags.gravity { model.opt.gravity } else { [0.0; 3] };
        // MuJoCo scales cost changes by 1 / (meaninertia * nv); a Newton decrement is twice the predicted change
        let tolerance = 2.0 * model.opt.tolerance * model.stat.mean_inertia * model.nv.max(1) as f64;
        Ok(Sim {
            trees,
            mocaps: model.mocap_bodies().count(),
            joints: link::joints::<T>(model),
            armature: model.dofs.iter().map(|d| c(d.armature)).collect(),
            damping: model.dofs.iter().map(|d| c(if flags.damper { d.damping } else { 0.0 })).collect(),
            implicit_damping,
            implicit_fast,
            hard: contacts.hard || equalities.iter().any(|e| e.hard),
            limits: limit::limits::<T>(model, &dof_link),
            dry: limit::dry_friction::<T>(model, &dof_link),
            ball_limits: limit::ball_limits::<T>(model),
            actuators: actuator::actuators::<T>(model),
            joint_force_ranges: actuator::joint_force_ranges::<T>(model),
            tendon_force_ranges: actuator::tendon_force_ranges::<T>(model),
            equalities,
            inertia_blocks: tendons.iter().map(|t| t.chains.len()).sum(),
            tendons,
            strings,
            adhesions: adhesion::adhesions(model),
            drives,
            tree_matrix: TreeMatrix::new(model, implicit_damping, medium),
            actuated_gravcomp: medium::actuated_gravity_compensation(model, &gravcomp),
            gravcomp,
            drags,
            ellipsoid_drags,
            wind: model.opt.wind.map(c),
            contacts,
            fields: model.hfields.iter().map(HeightField::new).collect(),
            hulls: model.hulls.iter().map(Polyhedron::new).collect(),
            search: Search {
                tolerance: c(model.opt.ccd_tolerance),
                iterations: model.opt.ccd_iterations.min(MOST_ITERATIONS),
                several: flags.multiccd,
            },
            bodies: bodies().map(|b| mount(b, ([0.0; 3], [1.0, 0.0, 0.0, 0.0]))).collect(),
            coms: bodies().map(|b| mount(b, model.inertial_frame(b))).collect(),
            geoms,
            sites,
            dt: c(model.opt.timestep),
            gravity: gravity.map(c),
            rk4,
            planar: link::is_planar(model, &links),
            elliptic: model.opt.cone == Cone::Elliptic,
            warmstart: flags.warmstart,
            capped,
            no_slip: NoSlip::new(model),
            max_newton: caps::cap(model, &options),
            most_rows: options.most_coupled_rows.unwrap_or(MOST_COUPLED_ROWS),
            max_line_search: model.opt.ls_iterations,
            tolerance: c(tolerance),
            dof_link,
            links,
            reweigher: OnceLock::new(),
            model: model.clone(),
        })
    }

    /// The compiled model of this simulation.
    pub fn model(&self) -> &Model {
        &self.model
    }
}
