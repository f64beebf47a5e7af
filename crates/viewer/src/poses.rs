//! Poses of geoms and bodies as matrices that WebGL takes.

use glam::{DMat4, DQuat, DVec3};
use marathon_motion::kinematics::Pose;
use marathon_physics::Model;

/// Numbers of a matrix.
const MATRIX: usize = 16;

/// Matrices of all geoms and bodies of some agents, `[geom][agent][16]` and `[body][agent][16]`: four columns, in meters,
/// z up.
pub struct Poses {
    agents: usize,
    geoms: Vec<f32>,
    bodies: Vec<f32>,
}

impl Poses {
    /// Room for the matrices of a number of agents.
    pub fn new(model: &Model, agents: usize) -> Self {
        let room = |count: usize| vec![0.0; count * agents * MATRIX];
        Poses { agents, geoms: room(model.geoms.len()), bodies: room(model.bodies.len()) }
    }

    /// Computes the matrices of an agent.
    pub fn set(&mut self, model: &Model, agent: usize, qpos: &[f64]) {
        let pose = Pose::of(model, qpos);
        let agents = self.agents;
        let place = move |index: usize| (index * agents + agent) * MATRIX..(index * agents + agent + 1) * MATRIX;
        for (i, geom) in model.geoms.iter().enumerate() {
            let [w, x, y, z] = geom.quat;
            let pos = pose.point(geom.body, DVec3::from_array(geom.pos));
            write(&mut self.geoms[place(i)], pose.quat[geom.body] * DQuat::from_xyzw(x, y, z, w), pos);
        }
        for i in 0..model.bodies.len() {
            write(&mut self.bodies[place(i)], pose.quat[i], pose.pos[i]);
        }
    }

    /// Matrices of the geoms.
    pub fn geoms(&self) -> &[f32] {
        &self.geoms
    }

    /// Matrices of the bodies.
    pub fn bodies(&self) -> &[f32] {
        &self.bodies
    }
}

fn write(out: &mut [f32], quat: DQuat, pos: DVec3) {
    let matrix = DMat4::from_rotation_translation(quat, pos).to_cols_array();
    out.iter_mut().zip(matrix).for_each(|(out, x)| *out = x as f32);
}
