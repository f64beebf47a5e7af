//! The start state of an episode, which [`Agent::reset`](crate::Agent::reset) writes.

use std::ops::Range;

use marathon_physics::Model;

use super::ResetNoise;
use super::bindings::Blueprint;
use super::reference::{Following, Timeline};
use crate::episode_rng::EpisodeRng;

/// The start state of an episode under construction.
pub struct Start<'a> {
    /// Configuration in MuJoCo's layout, initially the spawn pose.
    pub qpos: &'a mut [f64],
    /// Velocity in MuJoCo's layout, initially the spawn velocity.
    pub qvel: &'a mut [f64],
    /// Random numbers of this episode.
    pub random: &'a mut EpisodeRng,
    /// Whether to normalize quaternions before the first observation (default: true).
    pub normalize: bool,
    /// Whether to reject a start with contacts (default: false). A rejected start is drawn again, from the spawn pose
    /// and with the next random numbers.
    pub free_of_contacts: bool,
    /// Physics steps without controls between this state and the start of the episode (default: 0).
    pub settle: usize,
    /// The agent's memory, [`Facts::memory`](crate::Facts::memory) numbers, initially zero.
    /// [`Agent::begin`](crate::Agent::begin) receives it. Store random draws here that are needed later, such as the
    /// phase of a motion.
    pub memory: &'a mut [f64],
    /// The agent's memory at the end of its last episode. It is zero if there has been none since the seed was set.
    pub previous: &'a [f64],
    /// The first command of the agent's schedule, [`Facts::command`](crate::Facts::command). A caller may override it.
    pub scheduled: &'a [f64],
    pub(crate) grounds: &'a mut Vec<(usize, Vec<f32>)>,
    pub(crate) timeline: Option<&'a Timeline>,
    pub(crate) blueprint: &'a Blueprint,
}

impl Start<'_> {
    /// The model.
    pub fn model(&self) -> &Model {
        &self.blueprint.model
    }

    /// The row range of each clip in the table of all clips. A row is one decision; a looping clip may cover several
    /// cycles. Empty without clips.
    pub fn clips(&self) -> impl ExactSizeIterator<Item = Range<usize>> {
        self.timeline.map_or(&[][..], |timeline| &timeline.clips).iter().map(|lap| lap.rows.clone())
    }

    /// The row a number of decisions before another one, in the same clip. A looping clip wraps around; otherwise the
    /// first row is the limit.
    ///
    /// # Panics
    /// If the facts name no clips.
    pub fn row_before(&self, row: usize, decisions: usize) -> usize {
        let lap = self.timeline.expect("the facts name clips").clip_of(row);
        let (at, count) = (row.min(lap.rows.end - 1) - lap.rows.start, lap.rows.len());
        let earlier = match lap.cycle {
            Some(_) => (at + count - decisions % count) % count,
            None => at.saturating_sub(decisions),
        };
        lap.rows.start + earlier
    }

    /// Phase of a row: the completed fraction of the clip, or of its cycle, 0 to 1.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn phase(&self, row: usize) -> f64 {
        self.timeline.expect("the facts name clips").phase[row]
    }

    /// Sets the pose and the velocities of a row of the clips.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn start_in_clip(&mut self, row: usize) {
        let timeline = self.timeline.expect("the facts name clips");
        self.qpos.copy_from_slice(&timeline.qpos[row]);
        self.qvel.copy_from_slice(&timeline.qvel[row]);
        self.memory[..Following::SLOTS].fill(0.0);
        self.memory[Following::ROW] = row as f64;
    }

    /// Sets the agent's ground: heights above the zero of the model's height field `field`, m, in rows of increasing y.
    /// It lasts until another start or a caller changes it.
    ///
    /// # Panics
    /// If there is no such field, or the heights are not finite numbers for each point of its grid.
    pub fn set_ground(&mut self, field: usize, elevations: Vec<f32>) {
        let grid = &self.blueprint.model.hfields[field];
        assert_eq!(elevations.len(), grid.nrow * grid.ncol, "one elevation per point of the grid");
        assert!(elevations.iter().all(|z| z.is_finite()), "elevations are finite");
        self.grounds.retain(|(known, _)| *known != field);
        self.grounds.push((field, elevations));
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
