//! State of a lane group and the scratch memory of a step.

use crate::collision::{Clearances, Sweep};
use crate::lanes::Real;
use crate::model::JointType;
use crate::narrow::field_capsule::Gaps;
use crate::narrow::height::HeightField;
use crate::narrow::{Touch, Touches};
use crate::sim::{Mount, Sim};
use crate::solver::block::Block;
use crate::solver::coupled::Coupling;
use crate::solver::crowd::Crowd;
use crate::solver::floor::FloorRow;
use crate::solver::joint::{DryRow, LimitRow};
use crate::spatial::*;
use crate::variation::Varied;
use std::sync::Arc;

/// Largest sound position, velocity or acceleration.
const LARGEST: f64 = 1e10;

/// State of `T::LANES` agents that share a model: everything their future depends on.
#[derive(Clone, Debug)]
pub struct Group<T: Real> {
    /// Configuration in MuJoCo's layout, one entry per coordinate.
    pub qpos: Vec<T>,
    /// Velocity in MuJoCo's layout.
    pub qvel: Vec<T>,
    /// Controls, one per actuator; kept until changed.
    pub ctrl: Vec<T>,
    /// Activations of the actuators that have one.
    pub act: Vec<T>,
    /// Acceleration of the last step: where the constraint solver starts from.
    pub warm: Vec<T>,
    /// Torque and force on every body from outside, world axes, at its center of mass; empty: none. Kept until changed.
    pub external: Vec<V6<T>>,
    /// Constants that differ from the model's.
    pub(crate) varied: Option<Box<Varied<T>>>,
    /// Height fields that differ from the model's: field by field, lane by lane; empty: none.
    pub(crate) grounds: Vec<Option<Arc<HeightField<T::Scalar>>>>,
}

impl<T: Real> Group<T> {
    /// All agents in the reference configuration, at rest.
    pub fn new(sim: &Sim<T>) -> Self {
        let m = &sim.model;
        let zero = T::zero();
        Group {
            qpos: m.qpos0.iter().map(|x| T::lit(*x)).collect(),
            qvel: vec![zero; m.nv],
            ctrl: vec![zero; m.nu],
            act: vec![zero; m.na],
            external: Vec::new(),
            varied: None,
            grounds: Vec::new(),
            warm: vec![zero; m.nv],
        }
    }

    /// Pushes a body of one agent until told otherwise: force, N, and torque, N m, in world axes at its center of mass.
    ///
    /// # Panics
    /// If the body does not exist.
    pub fn push(&mut self, sim: &Sim<T>, lane: usize, body: usize, force: [f64; 3], torque: [f64; 3]) {
        if self.external.is_empty() {
            self.external = vec![[T::zero(); 6]; sim.model.bodies.len()];
        }
        for i in 0..3 {
            self.external[body][i].set(lane, T::scalar(torque[i]));
            self.external[body][3 + i].set(lane, T::scalar(force[i]));
        }
    }

    /// Puts one agent into a state; its controls, activations, pushes and warm start are cleared. Quaternions are normalized.
    ///
    /// # Panics
    /// If a slice's length is not the model's `nq` or `nv`.
    pub fn reset_lane(&mut self, sim: &Sim<T>, lane: usize, qpos: &[f64], qvel: &[f64]) {
        assert_eq!(qpos.len(), self.qpos.len(), "qpos has the model's length");
        assert_eq!(qvel.len(), self.qvel.len(), "qvel has the model's length");
        for (v, x) in self.qpos.iter_mut().zip(qpos) {
            v.set(lane, T::scalar(*x));
        }
        for joint in &sim.model.joints {
            let start = match joint.kind {
                JointType::Free => joint.qpos_adr + 3,
                JointType::Ball => joint.qpos_adr,
                _ => continue,
            };
            let q = &qpos[start..start + 4];
            let n = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            for i in 0..4 {
                let x = if n > 1e-10 { q[i] / n } else { f64::from(i == 0) };
                self.qpos[start + i].set(lane, T::scalar(x));
            }
        }
        for (v, x) in self.qvel.iter_mut().zip(qvel) {
            v.set(lane, T::scalar(*x));
        }
        for v in
            self.warm.iter_mut().chain(&mut self.ctrl).chain(&mut self.act).chain(self.external.iter_mut().flatten())
        {
            v.set(lane, T::scalar(0.0));
        }
    }

    /// Lanes whose state is sound: finite, and with positions, velocities and accelerations below 1e10, MuJoCo's bound
    /// too. Far beyond it products overflow, and then even what a mask makes zero is not.
    pub fn finite(&self) -> T::Mask {
        let mut sum = T::zero();
        for x in &self.act {
            // 0 x is 0, or NaN where x is not finite
            sum += *x * T::zero();
        }
        let mut sound = sum.is_finite();
        for x in self.qpos.iter().chain(&self.qvel).chain(&self.warm) {
            sound = T::and(sound, x.abs().lt(T::lit(LARGEST)));
        }
        sound
    }
}

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
    /// Forces on links for [`crate::articulated::bring_inward`].
    pub(crate) link_force: Vec<V6<T>>,
    /// The last evaluation of the forces was of the same group, a fraction of a step ago. That holds within a call of
    /// [`Sim::advance`], and there is much that one can keep from it.
    pub(crate) continues: bool,
    pub(crate) contacts: Vec<FloorRow<T>>,
    pub(crate) limits: Vec<LimitRow<T>>,
    pub(crate) dry: Vec<DryRow<T>>,
    pub(crate) blocks: Blocks<T>,
    /// Rows of the last evaluation, if the present one [continues](Work::continues) it; else none.
    pub(crate) past: Past<T>,
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

/// Rows of an earlier evaluation of the forces. What pushed then mostly pushes now. (The accelerations of then are a
/// worse guide: a contact that was slowing something down is, by them, about to let go.)
#[derive(Clone, Debug)]
pub(crate) struct Past<T: Real> {
    pub contacts: Vec<FloorRow<T>>,
    pub limits: Vec<LimitRow<T>>,
    pub dry: Vec<DryRow<T>>,
    pub blocks: Blocks<T>,
}

/// The former row with a number, if there is one; both come in ascending order, and `at` walks along the former.
#[inline(always)]
pub(crate) fn former<'a, R>(
    rows: &'a [R],
    at: &mut usize,
    number: usize,
    number_of: impl Fn(&R) -> usize,
) -> Option<&'a R> {
    while *at < rows.len() && number_of(&rows[*at]) < number {
        *at += 1;
    }
    if *at < rows.len() && number_of(&rows[*at]) == number { Some(&rows[*at]) } else { None }
}

/// The blocks of a step; their memory is kept from step to step.
#[derive(Clone, Debug)]
pub(crate) struct Blocks<T: Real> {
    items: Vec<Block<T>>,
    len: usize,
}

impl<T: Real> Blocks<T> {
    fn new() -> Self {
        Blocks { items: Vec::new(), len: 0 }
    }

    /// Forgets all blocks.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds a block, whose contents are those of some earlier one, and returns its index.
    pub fn add(&mut self) -> usize {
        if self.len == self.items.len() {
            self.items.push(Block::new());
        }
        self.len += 1;
        self.len - 1
    }
}

impl<T: Real> std::ops::Deref for Blocks<T> {
    type Target = [Block<T>];
    #[inline(always)]
    fn deref(&self) -> &[Block<T>] {
        &self.items[..self.len]
    }
}

impl<T: Real> std::ops::DerefMut for Blocks<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [Block<T>] {
        &mut self.items[..self.len]
    }
}

/// Counts of the constraint solver's work, summed over steps since the work was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SolverStats {
    /// Solves of a lane group.
    pub solves: u64,
    /// Newton iterations of a lane group (that of its slowest lane).
    pub newton: u64,
    /// Line search iterations.
    pub line_search: u64,
    /// Largest number of Newton iterations in a solve.
    pub max_newton: u64,
    /// Lanes that hit the iteration cap before they converged.
    pub unconverged: u64,
    /// Contacts, summed over lanes.
    pub contacts: u64,
    /// Contacts in the union of a group's lanes.
    pub contact_rows: u64,
    /// Pairs of geoms looked at, of lane groups.
    pub pairs: u64,
    /// Factorizations of single agents in which much touches much, instead of by lane groups.
    pub crowded: u64,
    /// Entries of the factors that they computed: what they cost.
    pub entries: u64,
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
            past: Past { contacts: Vec::new(), limits: Vec::new(), dry: Vec::new(), blocks: Blocks::new() },
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

impl SolverStats {
    /// Adds another thread's counts.
    pub fn add(&mut self, other: &SolverStats) {
        self.solves += other.solves;
        self.newton += other.newton;
        self.line_search += other.line_search;
        self.max_newton = self.max_newton.max(other.max_newton);
        self.unconverged += other.unconverged;
        self.contacts += other.contacts;
        self.contact_rows += other.contact_rows;
        self.pairs += other.pairs;
        self.crowded += other.crowded;
        self.entries += other.entries;
    }

    /// Takes earlier counts away (the largest iteration count stays).
    pub(crate) fn subtract(&mut self, earlier: &SolverStats) {
        self.solves -= earlier.solves;
        self.newton -= earlier.newton;
        self.line_search -= earlier.line_search;
        self.unconverged -= earlier.unconverged;
        self.contacts -= earlier.contacts;
        self.contact_rows -= earlier.contact_rows;
        self.pairs -= earlier.pairs;
        self.crowded -= earlier.crowded;
        self.entries -= earlier.entries;
    }
}
