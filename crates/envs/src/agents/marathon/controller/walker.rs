//! The Walker told how fast to go, and to jump.

use marathon_physics::lanes::Real;

use super::super::walker2d::{LEFT_FOOT, RIGHT_FOOT, TORSO, Walker2dV1};
use super::{ControllerArguments, Input, MEMORY, begin, mean_velocity, remember};
use crate::agent::{Agent, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Part, Senses, Terms, names};
use crate::episode_rng::EpisodeRng;

/// Those of the Walker's own task, then the others.
const PARTS: [&str; 7] = ["torso", "left_foot", "right_foot", "left_thigh", "left_leg", "right_thigh", "right_leg"];
/// Price of the effort.
const EFFORT: f64 = -0.3;

/// The Walker told how fast to go.
#[derive(Clone, Debug, Default)]
pub struct WalkerController {
    arguments: ControllerArguments,
}

impl Agent for WalkerController {
    fn facts(&self) -> Facts {
        Facts {
            id: "WalkerController-v0".into(),
            summary: "two legs in a plane: go left and right as told, jump, stand still".into(),
            observation: Some(if self.arguments.input == Input::Discrete { 46 } else { 45 }),
            reward_terms: names(["velocity", "uprightness", "jump", "still", "effort"]),
            info: names(["velocity_error"]),
            metrics: names(["forward", "velocity_error"]),
            parts: names(PARTS),
            command: self.arguments.command(),
            memory: MEMORY,
            ..Walker2dV1.facts()
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(WalkerController { arguments: self.arguments.with(options) })
    }

    fn command(&self, random: &mut EpisodeRng, step: usize, out: &mut [f64]) -> usize {
        self.arguments.schedule.draw(self.arguments.input, random, step, out)
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        begin(s, TORSO, memory);
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        remember(s, TORSO, memory);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        Walker2dV1.observe(s, out);
        self.arguments.observe(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let height = s.height(LEFT_FOOT).min(s.height(RIGHT_FOOT));
        let leap = T::select(T::or(s.touch(0), s.touch(1)), T::zero(), T::lit(1.0) + height);
        self.arguments.reward(s, TORSO, PARTS.into_iter().map(|name| Part::named(&PARTS, name)), leap, terms);
        terms.add("effort", EFFORT, s.effort(Motors::NONE));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        Walker2dV1.terminated(s)
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar((s.command(0) - mean_velocity(s)).abs());
    }
}
