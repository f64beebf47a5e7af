//! Mass matrix and inverse weights in the reference configuration.
//!
//! In the reference configuration every joint is at rest, so the world poses are the bodies' own frames chained, and
//! the mass matrix falls into one dense block per kinematic tree.

use super::factor::Factor;
use super::math::*;
use super::pose::{Motion, Pose, motion};
use super::room::Room;
use super::tendon::Moments;
use crate::budget::OverBudget;
use crate::model::same_frame::small;
use crate::model::{JointType, Model, Tendon, Vec3};
use std::collections::{BTreeMap, BTreeSet};

/// A tree with more degrees of freedom than this is refused: its dense mass matrix would not fit.
const MAX_TREE_DOFS: usize = 4096;

/// Why the reference quantities do not exist.
#[derive(Debug)]
pub(crate) enum MassMatrixError {
    /// The tree of this body has too many degrees of freedom.
    TooLarge(usize),
    /// The mass matrix of the tree of this body is not positive definite.
    Singular(usize),
    /// The mass matrices take too much memory with that of the tree of this body.
    OverBudget(usize, OverBudget),
}

impl MassMatrixError {
    pub fn body(&self) -> usize {
        let (MassMatrixError::TooLarge(body) | MassMatrixError::Singular(body) | MassMatrixError::OverBudget(body, _)) =
            self;
        *body
    }
}

impl std::fmt::Display for MassMatrixError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            MassMatrixError::TooLarge(_) => write!(f, "its tree has more than {MAX_TREE_DOFS} degrees of freedom"),
            MassMatrixError::Singular(_) => write!(f, "the mass matrix of its tree is not positive definite"),
            MassMatrixError::OverBudget(_, over) => write!(f, "the model {over}"),
        }
    }
}

/// The mass matrix in the reference configuration.
pub(crate) struct MassMatrix {
    /// Its diagonal, armature included.
    pub diagonal: Vec<f64>,
    /// First dof, number of dofs and factor of each tree's block.
    blocks: Vec<(usize, usize, Factor)>,
}

impl MassMatrix {
    /// `v inv(M) v'` for a vector that is zero except for some dofs, given as `(dof, value)`.
    pub fn inverse_form(&self, values: &[(usize, f64)]) -> f64 {
        // from 0: a sum over nothing is -0
        self.by_block(values).into_iter().fold(0.0, |sum, (block, rhs)| sum + self.blocks[block].2.inverse_form(rhs))
    }

    /// Length of `inv(M) v`, for such a vector.
    pub fn inverse_norm(&self, values: &[(usize, f64)]) -> f64 {
        let blocks = self.by_block(values).into_iter();
        let squares = blocks.flat_map(|(block, rhs)| self.blocks[block].2.solve(rhs)).map(|x| x * x);
        squares.sum::<f64>().sqrt()
    }

    /// The parts of such a vector that are not zero, by block.
    fn by_block(&self, values: &[(usize, f64)]) -> BTreeMap<usize, Vec<f64>> {
        let of_dof = |dof: usize| self.blocks.partition_point(|(start, ..)| *start <= dof) - 1;
        let mut touched: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for (dof, value) in values {
            let block = of_dof(*dof);
            let (start, n, _) = &self.blocks[block];
            touched.entry(block).or_insert_with(|| vec![0.0; *n])[dof - start] += value;
        }
        touched
    }
}

/// Sets the inverse weights of bodies and dofs, and returns the mass matrix.
///
/// `simple` says for each body whether it may be treated as a lone slider.
pub(crate) fn inverse_weights(
    model: &mut Model,
    pose: &Pose,
    simple: &[bool],
    moments: &Moments,
    room: &Room,
) -> Result<MassMatrix, MassMatrixError> {
    let mut mass_matrix = MassMatrix { diagonal: vec![0.0; model.nv], blocks: Vec::new() };
    let heavy = HeavyTendons::new(model, moments);
    let mut first = 0;
    while first < model.nv {
        let root = model.bodies[model.dofs[first].body].root_id;
        let in_tree = |d: &crate::model::Dof| model.bodies[d.body].root_id == root;
        let count = model.dofs[first..].iter().take_while(|d| in_tree(d)).count();
        if count > MAX_TREE_DOFS {
            return Err(MassMatrixError::TooLarge(root));
        }
        room.take(count * count, size_of::<f64>()).map_err(|over| MassMatrixError::OverBudget(root, over))?;
        let tree = Tree::new(model, pose, root, first, count);
        let mass = tree.mass_matrix(model, pose, &heavy);
        for i in 0..count {
            mass_matrix.diagonal[first + i] = mass[i * count + i];
        }
        let within = |dof: usize| model.dofs[dof].parent.map(|parent| parent - first);
        let parents: Vec<Option<usize>> = (first..first + count).map(within).collect();
        let factor = Factor::new(mass, &parents).ok_or(MassMatrixError::Singular(root))?;
        tree.set_weights(model, pose, &factor);
        mass_matrix.blocks.push((first, count, factor));
        first += count;
    }
    // MuJoCo takes the mass alone for a lone slider: no armature, no mean over the three directions
    for body in 1..model.bodies.len() {
        if simple[body] && is_lone_slider(model, body, &heavy) {
            let weight = 1.0 / model.bodies[body].mass.max(MIN_VAL);
            model.bodies[body].invweight0 = [weight, 0.0];
            let first = model.bodies[body].dof_start;
            let count = model.bodies[body].dof_count;
            model.dofs[first..first + count].iter_mut().for_each(|d| d.invweight0 = weight);
        }
    }
    Ok(mass_matrix)
}

/// Sets the inverse weights of tendons.
pub(crate) fn tendon_inverse_weights(model: &mut Model, mass: &MassMatrix, moments: &Moments) {
    for (tendon, arms) in model.tendons.iter_mut().zip(moments) {
        tendon.invweight0 = mass.inverse_form(arms);
    }
}

/// A body without children that only slides, along its own axes, on the world or on a child of the world without joints.
///
/// MuJoCo does not look further up: on a static body that is deeper, or on one that is welded to it, the rule does not hold.
fn is_lone_slider(model: &Model, index: usize, heavy: &HeavyTendons) -> bool {
    let body = &model.bodies[index];
    let aligned = |axis: Vec3| axis.iter().filter(|x| x.abs() > EPS).count() == 1;
    let joints = &model.joints[body.joint_start..body.joint_start + body.joint_count];
    !joints.is_empty()
        && !joints.iter().any(|j| heavy.by_dof.contains_key(&j.dof_adr))
        && joints.iter().all(|j| j.kind == JointType::Slide && small(j.pos) && aligned(j.axis))
        && model.stands_alone(index)
}

/// Tendons with inertia, by the dofs that they pull.
struct HeavyTendons<'a> {
    by_dof: BTreeMap<usize, Vec<usize>>,
    moments: &'a Moments,
}

impl<'a> HeavyTendons<'a> {
    fn new(model: &Model, moments: &'a Moments) -> Self {
        let mut by_dof: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (i, _) in model.tendons.iter().enumerate().filter(|(_, t)| t.armature != 0.0) {
            for (dof, _) in &moments[i] {
                by_dof.entry(*dof).or_default().push(i);
            }
        }
        HeavyTendons { by_dof, moments }
    }

    /// Tendons that pull any of these dofs, in the model's order.
    fn of(&self, dofs: std::ops::Range<usize>) -> BTreeSet<usize> {
        self.by_dof.range(dofs).flat_map(|(_, tendons)| tendons.iter().copied()).collect()
    }
}

/// Spatial inertia about the tree's reference point: mass, first moment, second moment by rows.
#[derive(Clone, Copy)]
struct SpatialInertia {
    mass: f64,
    first: Vec3,
    second: [Vec3; 3],
}

/// One kinematic tree and its dofs `first..first + motions.len()`.
struct Tree {
    /// Bodies of the tree; they are numbered depth first.
    bodies: std::ops::Range<usize>,
    first: usize,
    /// Reference point: the tree's center of mass, for accuracy.
    origin: Vec3,
    motions: Vec<Motion>,
}

impl Tree {
    fn new(model: &Model, pose: &Pose, root: usize, first: usize, count: usize) -> Self {
        let size = model.bodies[root..].iter().take_while(|b| b.root_id == root).count();
        let bodies = root..root + size;
        let (mass, moment) = bodies.clone().fold((0.0, [0.0; 3]), |(mass, moment), b| {
            let m = model.bodies[b].mass;
            (mass + m, add(moment, scale(pose.com[b], m)))
        });
        let origin = if mass >= MIN_VAL { scale(moment, 1.0 / mass) } else { pose.com[root] };
        let motions = (first..first + count).map(|dof| motion(model, pose, dof, origin)).collect();
        Tree { bodies, first, origin, motions }
    }

    /// Lower triangle of the mass matrix by rows, armature included.
    fn mass_matrix(&self, model: &Model, pose: &Pose, heavy: &HeavyTendons) -> Vec<f64> {
        let n = self.motions.len();
        let mut composite: Vec<SpatialInertia> =
            self.bodies.clone().map(|b| spatial_inertia(model, pose, b, self.origin)).collect();
        let root = self.bodies.start;
        for b in (1..composite.len()).rev() {
            let child = composite[b];
            composite[model.bodies[root + b].parent - root].accumulate(&child);
        }
        let mut mass = vec![0.0; n * n];
        for i in 0..n {
            let (linear, angular) = composite[model.dofs[self.first + i].body - root].momentum(&self.motions[i]);
            let mut ancestor = Some(self.first + i);
            while let Some(j) = ancestor {
                let m = &self.motions[j - self.first];
                mass[i * n + j - self.first] = dot(m.angular, angular) + dot(m.linear, linear);
                ancestor = model.dofs[j].parent;
            }
            mass[i * n + i] += model.dofs[self.first + i].armature;
        }
        for tendon in heavy.of(self.first..self.first + n) {
            self.add_armature(model, &model.tendons[tendon], &heavy.moments[tendon], &mut mass);
        }
        mass
    }

    /// Adds the inertia of a tendon. As in MuJoCo it couples only dofs of which one is an ancestor of the other: the
    /// mass matrix has no other entries.
    fn add_armature(&self, model: &Model, tendon: &Tendon, moments: &[(usize, f64)], mass: &mut [f64]) {
        let n = self.motions.len();
        let own = self.first..self.first + n;
        // a tendon names a joint once
        let arms: Vec<(usize, f64)> = moments.iter().copied().filter(|(dof, _)| own.contains(dof)).collect();
        let by_dof: BTreeMap<usize, f64> = arms.iter().copied().collect();
        for (i, at_i) in &arms {
            let mut ancestor = Some(*i);
            while let Some(j) = ancestor {
                if let Some(at_j) = by_dof.get(&j) {
                    mass[(i - self.first) * n + j - self.first] += tendon.armature * at_i * at_j;
                }
                ancestor = model.dofs[j].parent;
            }
        }
    }

    /// Mean diagonals of `J inv(M) J'`, for each joint and for the center of mass of each body.
    fn set_weights(&self, model: &mut Model, pose: &Pose, factor: &Factor) {
        let n = self.motions.len();

        let single: Vec<f64> = (0..n)
            .map(|i| {
                let mut rhs = vec![0.0; n];
                rhs[i] = 1.0;
                factor.inverse_form(rhs)
            })
            .collect();
        let joints = self.bodies.clone().flat_map(|b| {
            let body = &model.bodies[b];
            body.joint_start..body.joint_start + body.joint_count
        });
        for joint in joints.map(|j| &model.joints[j]) {
            let start = joint.dof_adr - self.first;
            // number of groups of dofs that share a mean, and their size
            let (groups, size) = match joint.kind {
                JointType::Free => (2, 3),
                JointType::Ball => (1, 3),
                JointType::Slide | JointType::Hinge => (1, 1),
            };
            for group in 0..groups {
                let range = start + group * size..start + (group + 1) * size;
                let mean = single[range.clone()].iter().sum::<f64>() / size as f64;
                for i in range {
                    model.dofs[self.first + i].invweight0 = mean;
                }
            }
        }

        for b in self.bodies.clone() {
            let body = &model.bodies[b];
            if body.weld_id == 0 {
                continue;
            }
            // the dofs that move this body: those of the body it is welded to, and their ancestors
            let weld = &model.bodies[body.weld_id];
            let mut rows = vec![vec![0.0; n]; 6];
            let mut dof = (weld.dof_count > 0).then(|| weld.dof_start + weld.dof_count - 1);
            while let Some(j) = dof {
                let motion = &self.motions[j - self.first];
                let linear = motion.at(sub(pose.com[b], self.origin));
                for k in 0..3 {
                    rows[k][j - self.first] = linear[k];
                    rows[k + 3][j - self.first] = motion.angular[k];
                }
                dof = model.dofs[j].parent;
            }
            let diagonal: Vec<f64> = rows.into_iter().map(|row| factor.inverse_form(row)).collect();
            let translation = diagonal[..3].iter().sum::<f64>() / 3.0;
            let rotation = diagonal[3..].iter().sum::<f64>() / 3.0;
            model.bodies[b].invweight0 = [translation, rotation];
        }
    }
}

impl SpatialInertia {
    fn accumulate(&mut self, other: &SpatialInertia) {
        self.mass += other.mass;
        self.first = add(self.first, other.first);
        for (row, own) in self.second.iter_mut().zip(other.second) {
            *row = add(*row, own);
        }
    }

    /// Linear and angular momentum about the reference point.
    fn momentum(&self, motion: &Motion) -> (Vec3, Vec3) {
        let linear = add(scale(motion.linear, self.mass), cross(motion.angular, self.first));
        let angular = add(self.second.map(|row| dot(row, motion.angular)), cross(self.first, motion.linear));
        (linear, angular)
    }
}

fn spatial_inertia(model: &Model, pose: &Pose, b: usize, origin: Vec3) -> SpatialInertia {
    let body = &model.bodies[b];
    let r = sub(pose.com[b], origin);
    let [xx, yy, zz, xy, xz, yz] =
        rotate_diagonal(mul_quat(pose.body[b].quat, model.inertial_frame(b).1), body.inertia);
    let mut second = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    for (i, row) in second.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            *entry += body.mass * (if i == j { dot(r, r) } else { 0.0 } - r[i] * r[j]);
        }
    }
    SpatialInertia { mass: body.mass, first: scale(r, body.mass), second }
}
