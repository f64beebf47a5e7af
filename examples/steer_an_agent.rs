//! Agents that take commands: rovers, whose agent is [`rover.rs`](rover.rs).
//!
//! [`VecEnv::set_command`] takes precedence over the agent's own schedule. The caller may be a gamepad, another learner
//! or a planner. Here, two lines of control code drive the rovers instead of a network. They find their inputs in the
//! observation by name.
//!
//! ```sh
//! cargo run --release -p marathon-examples --bin steer_an_agent
//! ```

mod rover;

use std::error::Error;
use std::sync::Arc;

use marathon_rl::envs::{Spec, Step, VecEnv, VecEnvOptions, register};
use rover::Rover;

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
        env.step(&actions, &mut *out)?;
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
