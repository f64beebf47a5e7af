//! The Hopper told how fast to go, and to jump.

use marathon_physics::lanes::Real;

use super::super::hopper::{FOOT, HopperV0, TORSO};
use super::{ControllerArguments, Input, MEMORY, begin, mean_velocity, remember};
use crate::agent::{Agent, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Part, Senses, Terms, names};
use crate::episode_rng::EpisodeRng;

/// Those of the Hopper's own task, then the others.
const PARTS: [&str; 6] = ["torso", "foot", "nose", "pelvis", "thigh", "calf"];
/// Price of the effort.
const EFFORT: f64 = -0.3;

/// The Hopper told how fast to go.
#[derive(Clone, Debug, Default)]
pub struct HopperController {
    arguments: ControllerArguments,
}

impl Agent for HopperController {
    fn facts(&self) -> Facts {
        Facts {
            id: "HopperController-v0".into(),
            summary: "one leg in a plane: go left and right as told, jump, stand still".into(),
            observation: Some(if self.arguments.input == Input::Discrete { 34 } else { 33 }),
            reward_terms: names(["velocity", "uprightness", "jump", "still", "effort"]),
            info: names(["velocity_error"]),
            metrics: names(["forward", "velocity_error"]),
            parts: names(PARTS),
            command: self.arguments.command(),
            memory: MEMORY,
            ..HopperV0.facts()
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(HopperController { arguments: self.arguments.with(options) })
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
        HopperV0.observe(s, out);
        self.arguments.observe(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let leap = T::select(s.touch(0), T::zero(), T::lit(1.0) + s.height(FOOT));
        self.arguments.reward(s, TORSO, PARTS.into_iter().map(|name| Part::named(&PARTS, name)), leap, terms);
        terms.add("effort", EFFORT, s.effort(Motors::NONE));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        HopperV0.terminated(s)
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar((s.command(0) - mean_velocity(s)).abs());
    }
}
