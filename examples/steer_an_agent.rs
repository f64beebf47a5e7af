//! An agent that is told what to do: a rover that drives at a commanded velocity.
//!
//! [`Facts::command`] names what it can be told, [`Agent::command`] is its own schedule: a new velocity every one to three
//! seconds, from random numbers that belong to the agent, its episode and its step alone. Observation and reward read it
//! with [`Senses::command`]. A caller's [`VecEnv::set_command`] goes before the schedule: a player's gamepad, another
//! learner, a planner.
//!
//! Here the rovers are driven by two lines of control instead of a network; they find what they need in the observation by
//! its names.
//!
//! ```sh
//! cargo run --release -p marathon-examples --bin steer_an_agent
//! ```

use std::error::Error;
use std::sync::Arc;

use marathon_envs::{
    Agent, CommandRange, EpisodeRng, Facts, Motors, Obs, Part, Senses, Spec, Step, Terms, Tolerance, VecEnv,
    VecEnvOptions, names, register,
};
use marathon_physics::lanes::Real;

const MODEL: &str = include_str!("rover.xml");

const PARTS: [&str; 1] = ["chassis"];
const CHASSIS: Part = Part::named(&PARTS, "chassis");

/// Fastest velocity that it can be told, m/s.
const FASTEST: f64 = 2.0;
/// Price of the squared actions.
const EFFORT: f64 = -0.01;

struct Rover;

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

/// Drives for some decisions, and returns the mean of the rovers' velocity errors, m/s.
fn drive(env: &mut VecEnv, out: &mut Step, decisions: usize) -> Result<f64, Box<dyn Error>> {
    let spec = env.spec().clone();
    let [command, velocity] = ["command", "velocity"].map(|name| first(&spec, name));
    let mut actions = vec![0.0; env.agents() * spec.act];
    let mut sum = 0.0;
    for _ in 0..decisions {
        for (obs, action) in out.obs.chunks(spec.obs).zip(actions.chunks_mut(spec.act)) {
            // the motors push towards the command, and hold against the friction of the wheels
            action.fill((2.0 * (obs[command] - obs[velocity]) + 0.1 * obs[command]).clamp(-1.0, 1.0));
        }
        env.step(&actions, &mut out.as_mut())?;
        sum += out.info.iter().map(|error| f64::from(*error)).sum::<f64>() / env.agents() as f64;
    }
    Ok(sum / decisions as f64)
}

/// Index of a part's first number in the observation.
fn first(spec: &Spec, name: &str) -> usize {
    spec.observations.iter().find(|group| group.name == name).map_or(0, |group| group.range.start)
}

/// Mean velocity of the rovers, m/s.
fn mean_velocity(env: &VecEnv, out: &Step) -> f64 {
    let (spec, n) = (env.spec(), env.agents() as f64);
    let velocity = first(spec, "velocity");
    out.obs.chunks(spec.obs).map(|obs| f64::from(obs[velocity])).sum::<f64>() / n
}

fn main() -> Result<(), Box<dyn Error>> {
    register(Arc::new(Rover))?;
    let mut env = VecEnv::new("rover", &VecEnvOptions { agents: 32, threads: 2, ..Default::default() })?;
    let command = &env.spec().command[0];
    println!("command: {} from {} to {} {}", command.name, command.low, command.high, command.unit);

    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs)?;
    let error = drive(&mut env, &mut out, 450)?;
    println!("on their own schedule for 9 s: {error:.2} m/s off on average");

    for velocity in [1.5, -1.5] {
        for agent in 0..env.agents() {
            env.set_command(agent, Some(&[velocity]))?;
        }
        drive(&mut env, &mut out, 100)?;
        println!("told {velocity} m/s: {:.2} m/s after 2 s", mean_velocity(&env, &out));
    }

    for agent in 0..env.agents() {
        env.set_command(agent, None)?;
    }
    let error = drive(&mut env, &mut out, 450)?;
    println!("on their schedule again: {error:.2} m/s off on average");
    Ok(())
}
