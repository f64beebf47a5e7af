//! Scratch memory of a step.

use super::clearance::Clearances;
use super::coupling::Coupling;
use super::group::Group;
use super::stats::SolverStats;
use super::sweep::Sweep;
use crate::algebra::spatial::*;
use crate::geometry::field_capsule::Gaps;
use crate::geometry::{Touch, Touches};
use crate::lanes::Real;
use crate::multifrontal::Crowd;
use crate::rows::{Blocks, ConstraintRows, DryRow, FloorRow, LimitRow};
use crate::sim::{Mount, Sim};

/// Scratch memory of a step; holds the readings of the group stepped last. One per thread.
#[derive(Clone, Debug)]
pub struct Work<T: Real> {
    /// Position of each tree's reference point (the origin of its root link) in the world.
    pub(crate) reference: Vec<V3<T>>,
    /// Link frames: rotation, and position relative to the tree's reference point.
    pub(crate) rot: Vec<Rot<T>>,
    pub(crate) pos: Vec<V3<T>>,
    /// Motion axis of every degree of freedom.
    pub(crate) axis: Vec<V6<T>>,
    /// Anchor of every joint, relative to the reference point (absolute while a root link is being computed).
    pub(crate) anchor: Vec<V3<T>>,
    pub(crate) inertia: Vec<Inertia<T>>,
    /// Spatial velocity of each link.
    pub(crate) vel: Vec<V6<T>>,
    /// Velocity-dependent acceleration of each link, gravity included.
    pub(crate) bias_acc: Vec<V6<T>>,
    /// Force that the present motion and gravity would need: `I a + v x I v`.
    pub(crate) bias_force: Vec<V6<T>>,
    /// Applied joint forces: springs, dampers, actuators.
    pub(crate) tau: Vec<T>,
    /// Derivative of the damping forces, negative: what `implicitfast` takes at the end of the step.
    pub(crate) rate: Vec<T>,
    /// Rate of change of the activations.
    pub(crate) act_dot: Vec<T>,
    pub(crate) tendon_length: Vec<T>,
    pub(crate) tendon_velocity: Vec<T>,
    /// Forces on links from outside; empty: none.
    pub(crate) external: Vec<V6<T>>,
    /// They have been taken off `bias_force`.
    pub(crate) bias_is_net: bool,
    /// Force of each actuator.
    pub(crate) actuator_force: Vec<T>,
    /// Joint accelerations, after a solve.
    pub(crate) acc: Vec<T>,
    /// Candidate accelerations of the present Newton iteration.
    pub(crate) next: Vec<T>,
    /// Spatial acceleration (without bias) of each link for `next`.
    pub(crate) link_acc: Vec<V6<T>>,
    /// Contact stiffness and wrench of each link.
    pub(crate) stiffness: Vec<Sym6<T>>,
    pub(crate) wrench: Vec<V6<T>>,
    pub(crate) in_contact: Vec<bool>,
    /// Diagonal added to the mass matrix: armature, limit stiffness, implicit damping.
    pub(crate) diag: Vec<T>,
    /// Joint forces of the present right-hand side.
    pub(crate) rhs: Vec<T>,
    /// Articulated inertias and forces.
    pub(crate) art: Vec<Sym6<T>>,
    pub(crate) art_force: Vec<V6<T>>,
    /// Per degree of freedom: articulated momentum times the inverse pivot, and the inverse pivot.
    pub(crate) gain: Vec<V6<T>>,
    pub(crate) pivot: Vec<T>,
    /// Acceleration of every degree of freedom if its link's parent did not accelerate.
    pub(crate) drive: Vec<T>,
    /// The same before the coupled blocks' correction.
    pub(crate) tree_drive: Vec<T>,
    /// Links whose matrix or forces changed since they were factorized.
    pub(crate) stale: Vec<bool>,
    /// Per tree with a free root: triangular factor, inverse pivots on the diagonal.
    pub(crate) root_factor: Vec<[[T; 6]; 6]>,
    /// Forces on links for `bring_inward`.
    pub(crate) link_force: Vec<V6<T>>,
    /// The last evaluation of the forces was of the same group, a fraction of a step ago. That holds within a call of
    /// [`Sim::advance`], and there is much that one can keep from it.
    pub(crate) continues: bool,
    pub(crate) contacts: Vec<FloorRow<T>>,
    pub(crate) limits: Vec<LimitRow<T>>,
    pub(crate) dry: Vec<DryRow<T>>,
    pub(crate) blocks: Blocks<T>,
    /// Rows of the last evaluation, if the present one [continues](Work::continues) it; else none.
    pub(crate) past: ConstraintRows<T>,
    pub(crate) coupling: Coupling<T>,
    /// Per lane, once one has had a crowd: its factorization.
    pub(crate) crowds: Vec<Crowd<T::Scalar>>,
    /// Lanes that are solved by it in the present step.
    pub(crate) crowded: T::Mask,
    /// Per geom: lanes that touch the static world at the last physics step, and at any step of the last `step` call.
    pub(crate) touching: Vec<T::Mask>,
    pub(crate) touched: Vec<T::Mask>,
    /// Per geom: number of contacts with the static world, and their normal force, N, at the last physics step.
    pub(crate) ground_contacts: Vec<T>,
    pub(crate) normal_force: Vec<T>,
    /// Per geom: lanes that touch another moving geom at the last physics step.
    pub(crate) touching_bodies: Vec<T::Mask>,
    /// Centers of the geoms that meet others, relative to their trees' reference points; of static ones, in the world.
    pub(crate) centers: Vec<V3<T>>,
    /// Their third axes: of a plane its normal, of a capsule its direction.
    pub(crate) directions: Vec<V3<T>>,
    pub(crate) clearances: Clearances<T>,
    /// Pairs that may touch, if there are so many that a broad phase chooses them.
    pub(crate) sweep: Sweep<T::Scalar>,
    /// Per body without a moving parent: from its center of mass to that of all that hangs from it.
    pub(crate) tree_com: Vec<V3<T>>,
    /// Per body: torque and force from outside, about the center of mass of its tree.
    pub(crate) body_force: Vec<V6<T>>,
    /// Per degree of freedom: forces of actuators and constraints.
    pub(crate) actuation: Vec<T>,
    pub(crate) constraint: Vec<T>,
    /// Contacts of one pair of geoms, and of one lane of them.
    pub(crate) touches: Vec<Touch<T>>,
    pub(crate) lane_touches: Touches<T::Scalar>,
    /// Gaps between one pair of a height field and another geom.
    pub(crate) gaps: Gaps<T>,
    /// States of the Runge-Kutta stages.
    pub(crate) stages: Vec<Group<T>>,
    pub(crate) stats: SolverStats,
}

impl<T: Real> Work<T> {
    /// Scratch memory for a model.
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        let (nl, nv, nj) = (sim.links.len(), sim.model.nv, sim.joints.len());
        Work {
            reference: vec![[z; 3]; sim.trees],
            rot: vec![[[z; 3]; 3]; nl],
            pos: vec![[z; 3]; nl],
            axis: vec![[z; 6]; nv],
            anchor: vec![[z; 3]; nj],
            inertia: vec![[z; 10]; nl],
            vel: vec![[z; 6]; nl],
            bias_acc: vec![[z; 6]; nl],
            bias_force: vec![[z; 6]; nl],
            tau: vec![z; nv],
            rate: vec![z; nv],
            act_dot: vec![z; sim.model.na],
            tendon_length: vec![z; sim.tendons.len()],
            tendon_velocity: vec![z; sim.tendons.len()],
            external: Vec::with_capacity(nl),
            bias_is_net: false,
            actuator_force: vec![z; sim.model.nu],
            acc: vec![z; nv],
            next: vec![z; nv],
            link_acc: vec![[z; 6]; nl],
            stiffness: vec![[z; 21]; nl],
            wrench: vec![[z; 6]; nl],
            in_contact: vec![false; nl],
            diag: vec![z; nv],
            rhs: vec![z; nv],
            art: vec![[z; 21]; nl],
            art_force: vec![[z; 6]; nl],
            gain: vec![[z; 6]; nv],
            pivot: vec![z; nv],
            drive: vec![z; nv],
            tree_drive: vec![z; nv],
            stale: vec![true; nl],
            root_factor: vec![[[z; 6]; 6]; sim.trees],
            link_force: vec![[z; 6]; nl],
            contacts: Vec::with_capacity(sim.contacts.floor.len()),
            limits: Vec::with_capacity(2 * sim.limits.len()),
            dry: Vec::with_capacity(sim.dry.len()),
            continues: false,
            blocks: Blocks::new(),
            past: ConstraintRows { contacts: Vec::new(), limits: Vec::new(), dry: Vec::new(), blocks: Blocks::new() },
            coupling: Coupling::new(nl, nv),
            crowds: Vec::new(),
            crowded: T::none(),
            touching: vec![T::none(); sim.geoms.len()],
            touched: vec![T::none(); sim.geoms.len()],
            ground_contacts: vec![z; sim.geoms.len()],
            normal_force: vec![z; sim.geoms.len()],
            touching_bodies: vec![T::none(); sim.geoms.len()],
            centers: vec![[z; 3]; sim.geoms.len()],
            directions: vec![[z; 3]; sim.geoms.len()],
            clearances: match sim.contacts.broad {
                None => Clearances::new(sim.geoms.len(), sim.contacts.pairs.len()),
                Some(_) => Clearances::new(0, 0),
            },
            sweep: Sweep::new(if sim.contacts.broad.is_some() { sim.geoms.len() } else { 0 }),
            tree_com: vec![[z; 3]; sim.model.bodies.len()],
            body_force: vec![[z; 6]; sim.model.bodies.len()],
            actuation: vec![z; nv],
            constraint: vec![z; nv],
            touches: Vec::new(),
            lane_touches: Touches::new(),
            gaps: Gaps::new(),
            stages: if sim.rk4 { vec![Group::new(sim); 2] } else { Vec::new() },
            stats: SolverStats::default(),
        }
    }

    /// Makes room for new rows; those of before become the [past](Work::past).
    #[inline(always)]
    pub(crate) fn put_rows_aside(&mut self) {
        let Work { contacts, limits, dry, blocks, past, continues, .. } = self;
        std::mem::swap(contacts, &mut past.contacts);
        std::mem::swap(limits, &mut past.limits);
        std::mem::swap(dry, &mut past.dry);
        std::mem::swap(blocks, &mut past.blocks);
        contacts.clear();
        limits.clear();
        dry.clear();
        blocks.clear();
        if !*continues {
            past.contacts.clear();
            past.limits.clear();
            past.dry.clear();
            past.blocks.clear();
        }
    }

    /// Origin of a frame on a link, relative to the tree's reference point.
    #[inline(always)]
    pub(crate) fn arm(&self, m: &Mount<T::Scalar>, link: usize) -> V3<T> {
        rotate_add(&self.rot[link], &splat3(&m.pos), &self.pos[link])
    }

    /// Axes of a frame in the world.
    #[inline(always)]
    pub(crate) fn axes(&self, m: &Mount<T::Scalar>) -> Rot<T> {
        match m.link {
            None => [splat3(&m.rot[0]), splat3(&m.rot[1]), splat3(&m.rot[2])],
            Some(l) => compose(&self.rot[l], &m.rot),
        }
    }

    /// A geom touches the static world in the lanes `on`.
    #[inline(always)]
    pub(crate) fn touch_ground(&mut self, geom: usize, on: T::Mask) {
        self.touching[geom] = T::or(self.touching[geom], on);
        self.touched[geom] = T::or(self.touched[geom], on);
        self.ground_contacts[geom] += T::masked(on, T::lit(1.0));
    }

    /// Counts of the constraint solver's work.
    pub fn stats(&self) -> SolverStats {
        self.stats
    }
}
