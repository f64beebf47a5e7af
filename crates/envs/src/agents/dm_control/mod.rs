//! dm_control's suite for bodies that run: the same models, observations, rewards in [0, 1] and starts.
//!
//! Everything is dm_control's (1.0), with observations flattened in the order of its dictionaries. No episode is
//! terminated; each is truncated after 1000 decisions. `tests/a_dm_control_return_agrees_with_dm_control.rs` checks all
//! of it.
//!
//! Observations after a decision belong to the present state, except those of touch sensors, which belong to the last
//! physics step (dm_control's default, `legacy_step`).

pub mod cheetah;
pub mod hopper;
pub mod humanoid;
pub mod walker;

use std::f64::consts::PI;
use std::sync::Arc;

use marathon_physics::Model;
use marathon_physics::lanes::Real;
use marathon_physics::model::JointType;

use crate::agent::{Controls, Facts, ModelSource, Obs, Senses, Sigmoid, Start, Terms, Tolerance, names};
use crate::any_agent::AnyAgent;

/// All tasks, in the order of listings.
pub fn all() -> Vec<Arc<dyn AnyAgent>> {
    vec![
        Arc::new(hopper::Hopper::stand()),
        Arc::new(hopper::Hopper::hop()),
        Arc::new(walker::Walker::stand()),
        Arc::new(walker::Walker::walk()),
        Arc::new(walker::Walker::run()),
        Arc::new(humanoid::Humanoid::stand()),
        Arc::new(humanoid::Humanoid::walk()),
        Arc::new(humanoid::Humanoid::run()),
        Arc::new(cheetah::Cheetah::run()),
    ]
}

/// Shimmy's names of the tasks in Gymnasium, `(name, id)`.
pub const ALIASES: [(&str, &str); 9] = [
    ("dm_control/hopper-stand-v0", "hopper-stand-v0"),
    ("dm_control/hopper-hop-v0", "hopper-hop-v0"),
    ("dm_control/walker-stand-v0", "walker-stand-v0"),
    ("dm_control/walker-walk-v0", "walker-walk-v0"),
    ("dm_control/walker-run-v0", "walker-run-v0"),
    ("dm_control/humanoid-stand-v0", "humanoid-stand-v0"),
    ("dm_control/humanoid-walk-v0", "humanoid-walk-v0"),
    ("dm_control/humanoid-run-v0", "humanoid-run-v0"),
    ("dm_control/cheetah-run-v0", "cheetah-run-v0"),
];

/// Name of the reward's only term. Its factors cannot be added.
const REWARD: &str = "reward";

/// A body with several tasks.
struct Domain {
    /// Name of the model among the arguments.
    file: &'static str,
    /// The model.
    text: &'static str,
    /// Physics steps per decision.
    frame_skip: usize,
    /// Names of [`info`](crate::Agent::info).
    info: &'static [&'static str],
}

impl Domain {
    /// Facts that the tasks share.
    fn facts(&self, id: &str, summary: &str, xml_file: &str) -> Facts {
        let own = xml_file == self.file;
        Facts {
            id: id.into(),
            summary: summary.into(),
            model: if own { self.text.into() } else { ModelSource::File(xml_file.into()) },
            frame_skip: self.frame_skip,
            max_episode_steps: 1000,
            controls: Controls::Raw,
            reward_terms: names([REWARD]),
            info: names(self.info),
            metrics: names(["forward", "speed"]),
            termination_reward: None,
            ..Facts::default()
        }
    }
}

/// Rejects a model with fewer coordinates than the task uses, or with joints that starts do not randomize.
fn fits(model: &Model, nq: usize) -> Result<(), String> {
    if model.nq < nq {
        return Err(format!("its model has {} coordinates, expected at least {nq}", model.nq));
    }
    match model.joints.iter().find(|joint| joint.kind == JointType::Ball) {
        Some(joint) => {
            Err(format!("its model has a ball joint, '{}', expected a free root, slides and hinges", joint.name))
        }
        None => Ok(()),
    }
}

/// Rejects an invalid target speed.
fn goal(move_speed: f64) -> Result<(), String> {
    if (0.0..=1e3).contains(&move_speed) {
        return Ok(());
    }
    Err(format!("option move_speed is {move_speed}, expected a speed from 0 to 1000 m/s"))
}

/// Draws every joint uniformly from its range, and a joint without a range from the full circle. The quaternion of a
/// free root is four uniform numbers from 0 to 1, so directions are not equally likely. Slides without a range stay.
fn randomize_joints(start: &mut Start) {
    let joints: Vec<_> =
        start.model().joints.iter().map(|j| (j.kind, j.qpos_adr, j.limited.then_some(j.range))).collect();
    for (kind, at, range) in joints {
        match (kind, range) {
            (JointType::Hinge | JointType::Slide, Some([low, high])) => {
                start.qpos[at] = start.random.uniform(low, high)
            }
            (JointType::Hinge, None) => start.qpos[at] = start.random.uniform(-PI, PI),
            (JointType::Free, _) => {
                for q in &mut start.qpos[at + 3..at + 7] {
                    *q = start.random.uniform(0.0, 1.0);
                }
            }
            (JointType::Slide, None) | (JointType::Ball, _) => {}
        }
    }
}

/// Writes the coordinates from `skip` on, under dm_control's name.
#[inline(always)]
fn observe_positions<T: Real>(s: &Senses<T>, out: &mut Obs<T>, skip: usize) {
    out.group("position");
    super::observe_positions(s, out, skip);
}

/// Writes all velocities.
#[inline(always)]
fn observe_velocities<T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
    out.group("velocity");
    super::observe_velocities(s, out);
}

/// Reward of a speed: 1 from `goal` upward, `value` at `goal - margin`, linear in between.
#[inline(always)]
fn fast<T: Real>(speed: T, goal: f64, margin: f64, value: f64) -> T {
    let tolerance = Tolerance { sigmoid: Sigmoid::Linear, value_at_margin: value, ..Tolerance::at_least(goal, margin) };
    tolerance.of(speed)
}

/// Mean over the motors of 1 minus the squared action, at least 0.
#[inline(always)]
fn small_control<T: Real>(s: &Senses<T>) -> T {
    let one = Tolerance { sigmoid: Sigmoid::Quadratic, value_at_margin: 0.0, ..Tolerance::around_zero(1.0) };
    let mut sum = T::zero();
    for i in 0..s.action_count() {
        sum += one.of(s.action(i));
    }
    sum * T::lit(1.0 / s.action_count() as f64)
}

/// `(a x + b) / (a + b)`: a factor that is `b / (a + b)` where `x` is 0.
#[inline(always)]
fn weighted<T: Real>(a: f64, x: T, b: f64) -> T {
    x.mul_add(T::lit(a / (a + b)), T::lit(b / (a + b)))
}

/// Adds the reward.
#[inline(always)]
fn pay<T: Real>(terms: &mut Terms<T>, reward: T) {
    terms.add(REWARD, 1.0, reward);
}
