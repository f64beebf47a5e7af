//! Where an episode starts: what [`Agent::reset`](crate::Agent::reset) writes to.

use std::ops::Range;

use marathon_physics::Model;

use super::ResetNoise;
use super::bindings::Blueprint;
use super::reference::{Following, Timeline};
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
    /// The agent's own variables, [`Facts::memory`](crate::Facts::memory) of them, zero to begin with: what they are when
    /// [`Agent::begin`](crate::Agent::begin) is called. For what is drawn here and has to be known later, such as the phase of
    /// a motion.
    pub memory: &'a mut [f64],
    /// The agent's own variables at the end of its last episode, zeros if there has been none since it was given its seed.
    pub previous: &'a [f64],
    /// What the agent's own schedule tells it at the start, [`Facts::command`](crate::Facts::command); a caller may tell it
    /// something else.
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

    /// The rows of each clip among those of all: decisions, several cycles of a clip that loops. None without clips.
    pub fn clips(&self) -> impl ExactSizeIterator<Item = Range<usize>> {
        self.timeline.map_or(&[][..], |timeline| &timeline.clips).iter().map(|lap| lap.rows.clone())
    }

    /// The row that is some decisions before another one: in the same clip, and no earlier than its beginning, unless it
    /// loops.
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

    /// Share of the clip, or of its cycle, that is over in a row: 0 to 1.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn phase(&self, row: usize) -> f64 {
        self.timeline.expect("the facts name clips").phase[row]
    }

    /// Puts the agent into a row of the clips, with its velocities.
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

    /// Gives the agent ground of its own: elevations, m above the zero of the model's height field `field`, row by row, the
    /// first of which has the smallest y. It lasts until changed, by another start or by a caller.
    ///
    /// # Panics
    /// If there is no such field, or the elevations are not finite numbers for each point of its grid.
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
