//! A creature of one's own: an inchworm, from two files to an environment.
//!
//! An agent is an MJCF file (`inchworm.xml` beside this one) and a type that implements [`Agent`]: constant [`Facts`],
//! what it observes, what it is rewarded for, when it has failed. Nothing in the engine has to know about it:
//! [`register`] makes it available by name to [`VecEnv`], to the trainer and to the renderer, in this program.
//!
//! The functions are generic over [`Real`]: the same text is compiled for one agent in double precision and for sixteen
//! agents in one vector register. They are marked `#[inline(always)]` for that reason, and compare and select by
//! methods (`lt`, `select`, `max`) instead of `if`. [`Senses`] has the perceptions and the helper library of bonuses and
//! penalties, and the physics itself behind [`Senses::readings`].
//!
//! The worm here has no policy: it bends its two joints in a fixed rhythm and creeps forward.
//!
//! ```sh
//! cargo run --release -p marathon-examples --bin custom_agent
//! ```

use marathon_rl::envs::{Agent, Facts, Motors, Obs, Part, Senses, Terms, VecEnv, VecEnvOptions, names, register};
use marathon_rl::physics::lanes::Real;
use std::error::Error;
use std::sync::Arc;

/// Motors in the order of the model: the action.
const ACTIONS: [&str; 2] = ["neck", "hip"];
/// Geoms that the agent speaks of. A misspelled name below is a compile error.
const PARTS: [&str; 3] = ["middle", "head", "tail"];
const MIDDLE: Part = Part::named(&PARTS, "middle");
const HEAD: Part = Part::named(&PARTS, "head");

/// Price of the effort.
const EFFORT: f64 = -0.05;

struct Inchworm;

impl Agent for Inchworm {
    fn facts(&self) -> Facts {
        Facts {
            id: "Inchworm-v0".into(),
            summary: "two motors, no legs: creep forward".into(),
            model: include_str!("inchworm.xml").into(),
            frame_skip: 4,
            max_episode_steps: 500,
            observation: Some(3 + 3 + 2 + 8 + 2 + 1),
            actions: names(ACTIONS),
            reward_terms: names(["velocity", "effort"]),
            parts: names(PARTS),
            // a worm lies on the ground
            feet: names(PARTS),
            touch: names(["head", "tail"]),
            ..Facts::default()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.group("velocity");
        out.vector(s.linear_velocity(MIDDLE));
        out.group("forward");
        out.vector(s.forward(MIDDLE));
        out.group("touch");
        out.touch_sensors(s);
        out.group("joint_rotations");
        out.joint_rotations(s);
        out.group("joint_velocities");
        out.joint_velocities(s);
        out.group("head_height");
        out.scalar(s.height(HEAD));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("velocity", 1.0, s.velocity(MIDDLE));
        terms.add("effort", EFFORT, s.effort(Motors::NONE));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        // on its back: the up axis of the middle points down
        s.up(MIDDLE)[2].lt(T::zero())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    // a model and facts that contradict each other are refused here, with a message that names what does not fit
    register(Arc::new(Inchworm))?;
    let mut env = VecEnv::new("inchworm", &VecEnvOptions { agents: 32, threads: 2, ..Default::default() })?;
    let spec = env.spec().clone();
    println!("{}: {} observations, {} actions, {} decisions/s", spec.id, spec.obs, spec.act, (1.0 / spec.dt).round());

    let mut step = env.buffers();
    env.reset(Some(1), &mut step.obs)?;
    let mut actions = vec![0.0; env.agents() * spec.act];
    let (mut distance, mut reward, mut falls) = (0.0, 0.0, 0);
    let decisions = spec.max_episode_steps;
    for decision in 0..decisions {
        // an arch that grows and flattens twice per second
        let phase = (decision as f64 * spec.dt * 2.0).fract();
        let bend = if phase < 0.5 { 1.0 } else { -1.0 };
        for action in actions.chunks_exact_mut(2) {
            action.copy_from_slice(&[bend, -bend]);
        }
        env.step(&actions, &mut step)?;
        distance += step.forward.iter().map(|x| f64::from(*x)).sum::<f64>();
        reward += step.reward.iter().map(|x| f64::from(*x)).sum::<f64>();
        falls += step.terminated.iter().filter(|t| **t).count();
    }
    let agents = env.agents() as f64;
    println!(
        "after {:.0} s: {:.2} m, return {:.2} (mean of {} worms), {falls} on their backs",
        decisions as f64 * spec.dt,
        distance / agents,
        reward / agents,
        env.agents()
    );
    Ok(())
}
