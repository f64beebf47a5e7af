//! An agent that takes commands: a rover that drives at a commanded velocity.
//!
//! [`Facts::command`] declares the command. [`Agent::command`] is the agent's own schedule: a new velocity every one to
//! three seconds, from random numbers that depend only on the agent, its episode and its step. Observation and reward
//! read it with [`Senses::command`].
//!
//! Other sources can replace the schedule: a program (`steer_an_agent.rs`), a trainer in Python (`own_player.rs`), or a
//! gamepad (`crates/bevy_marathon/examples/steer.rs`).

use marathon_rl::envs::{Agent, CommandRange, EpisodeRng, Facts, Motors, Obs, Part, Senses, Terms, Tolerance, names};
use marathon_rl::physics::lanes::Real;

const MODEL: &str = include_str!("rover.xml");

const PARTS: [&str; 1] = ["chassis"];
const CHASSIS: Part = Part::named(&PARTS, "chassis");

/// Fastest velocity that it can be told, m/s.
const FASTEST: f64 = 2.0;
/// Price of the squared actions.
const EFFORT: f64 = -0.01;

/// Two wheels under a chassis.
pub struct Rover;

impl Agent for Rover {
    fn facts(&self) -> Facts {
        Facts {
            id: "Rover-v0".into(),
            summary: "two wheels: drive at the commanded velocity".into(),
            model: MODEL.into(),
            frame_skip: 4,
            max_episode_steps: 500,
            observation: Some(9),
            actions: names(["rear", "front"]),
            command: vec![CommandRange::new("velocity", -FASTEST..=FASTEST, "m/s")],
            reward_terms: names(["tracking", "effort"]),
            info: names(["velocity_error"]),
            metrics: names(["velocity_error"]),
            parts: names(PARTS),
            ..Facts::default()
        }
    }

    fn command(&self, random: &mut EpisodeRng, _step: usize, out: &mut [f64]) -> usize {
        out[0] = random.uniform(-FASTEST, FASTEST);
        // decisions for which it holds, fifty a second
        random.whole(50, 150)
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.group("command");
        out.scalar(s.command(0));
        out.group("velocity");
        out.vector(s.linear_velocity(CHASSIS));
        out.group("up");
        out.vector(s.up(CHASSIS));
        out.group("wheels");
        out.joint_velocities(s);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("tracking", 1.0, Tolerance::around_zero(1.0).of(error(s)));
        terms.add("effort", EFFORT, s.effort(Motors::NONE));
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(error(s).abs());
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.up(CHASSIS)[2].lt(T::zero())
    }
}

/// How much too fast it is, m/s.
#[inline(always)]
fn error<T: Real>(s: &Senses<T>) -> T {
    s.linear_velocity(CHASSIS)[0] - s.command(0)
}
