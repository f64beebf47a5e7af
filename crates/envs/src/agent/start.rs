//! Where an episode starts: what [`Agent::reset`](crate::Agent::reset) writes to.

use marathon_physics::Model;

use super::ResetNoise;
use super::bindings::Blueprint;
use crate::episode_rng::EpisodeRng;

/// The state in which an episode starts, in the making.
pub struct Start<'a> {
    /// Configuration, MuJoCo's layout; the spawn pose to begin with.
    pub qpos: &'a mut [f64],
    /// Velocity, MuJoCo's layout; the spawn velocity to begin with.
    pub qvel: &'a mut [f64],
    /// The episode's own random numbers.
    pub random: &'a mut EpisodeRng,
    /// Whether quaternions are normalized before anybody observes them; they are unless told otherwise.
    pub normalize: bool,
    /// Whether the start counts only if nothing touches anything; no unless told otherwise. One that does not count is drawn
    /// again, from the spawn pose and with the random numbers that follow.
    pub free_of_contacts: bool,
    /// Physics steps without controls that lead from here to where the episode begins; none unless told otherwise.
    pub settle: usize,
    pub(crate) blueprint: &'a Blueprint,
}

impl Start<'_> {
    /// The model.
    pub fn model(&self) -> &Model {
        &self.blueprint.model
    }

    /// Adds noise to the actuated joints and the root's velocity.
    pub fn add_noise(&mut self, noise: ResetNoise) {
        for joint in &self.blueprint.joints {
            let q = &mut self.qpos[joint.qpos];
            *q += self.random.around_zero(noise.joint_position);
            if let Some([low, high]) = joint.range {
                *q = q.max(low).min(high);
            }
            self.qvel[joint.dof] += self.random.around_zero(noise.joint_velocity);
        }
        for dof in &self.blueprint.root_dofs {
            self.qvel[*dof] += self.random.around_zero(noise.root_velocity);
        }
    }
}
