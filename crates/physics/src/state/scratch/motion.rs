//! Quantities that depend on positions and velocities only.

use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::sim::{Mount, Sim};

/// Quantities that depend on positions and velocities only.
#[derive(Clone, Debug)]
pub(crate) struct Motion<T: Real> {
    /// Position of each tree's reference point (the origin of its root link) in the world.
    pub reference: Vec<V3<T>>,
    /// Link frames: rotation, and position relative to the tree's reference point. Then those of the mocap bodies in the world.
    pub rot: Vec<Rot<T>>,
    pub pos: Vec<V3<T>>,
    /// Anchor of every joint, relative to the reference point (absolute while a root link is being computed).
    pub anchor: Vec<V3<T>>,
    pub inertia: Vec<Inertia<T>>,
    /// Spatial velocity of each link.
    pub vel: Vec<V6<T>>,
    /// Velocity-dependent acceleration of each link, gravity included.
    pub bias_acc: Vec<V6<T>>,
    /// Force that the current motion and gravity would need: `I a + v x I v`.
    pub bias_force: Vec<V6<T>>,
}

impl<T: Real> Motion<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        let (nl, nj) = (sim.links.len(), sim.joints.len());
        Motion {
            reference: vec![[z; 3]; sim.trees],
            rot: vec![[[z; 3]; 3]; nl + sim.mocaps],
            pos: vec![[z; 3]; nl + sim.mocaps],
            anchor: vec![[z; 3]; nj],
            inertia: vec![[z; 10]; nl],
            vel: vec![[z; 6]; nl],
            bias_acc: vec![[z; 6]; nl],
            bias_force: vec![[z; 6]; nl],
        }
    }

    /// Origin of a frame on a link, relative to the tree's reference point.
    #[inline(always)]
    pub fn arm(&self, m: &Mount<T::Scalar>, link: usize) -> V3<T> {
        rotate_add(&self.rot[link], &splat3(&m.pos), &self.pos[link])
    }

    /// Axes of a frame in the world.
    #[inline(always)]
    pub fn axes(&self, m: &Mount<T::Scalar>) -> Rot<T> {
        match self.frame(m) {
            None => [splat3(&m.rot[0]), splat3(&m.rot[1]), splat3(&m.rot[2])],
            Some(l) => compose(&self.rot[l], &m.rot),
        }
    }

    /// Position of a frame that no joint moves, in the world.
    #[inline(always)]
    pub fn still(&self, m: &Mount<T::Scalar>) -> V3<T> {
        match self.frame(m) {
            None => splat3(&m.pos),
            Some(mocap) => self.arm(m, mocap),
        }
    }

    /// Index of the link or mocap body that carries a mount, in `rot` and `pos`.
    #[inline(always)]
    pub fn frame(&self, m: &Mount<T::Scalar>) -> Option<usize> {
        m.link.or(m.mocap.map(|k| self.vel.len() + k))
    }
}
