//! From a policy file to a picture, by hand.
//!
//! This example connects three independent parts: a [`Policy`] maps an observation to an action, a [`VecEnv`] maps an
//! action to the next state, and a [`Renderer`] draws a state. The renderer needs only `qpos`, the model's
//! configuration, so it can draw anything that yields `qpos`.
//!
//! The command `marathon render` does the same with more options. There is no GPU in it: the renderer is a ray caster of
//! spheres, capsules, boxes and a checkered floor.
//!
//! ```sh
//! cargo run --release -p marathon-examples --bin render_a_policy -- walker2d.safetensors strip.png
//! ```

use marathon_rl::envs::{Autoreset, VecEnv, VecEnvOptions, agent};
use marathon_rl::learn::Policy;
use marathon_rl::render::{Corner, Follow, Renderer, Scene, status_line, strip};
use std::error::Error;
use std::path::Path;

const WIDTH: usize = 240;
const HEIGHT: usize = 320;
/// Pictures in the strip.
const FRAMES: usize = 6;
/// Simulated seconds between two of them.
const GAP: f64 = 0.2;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(from), Some(to)) = (args.next(), args.next()) else {
        return Err("usage: render_a_policy <policy.safetensors> <out.png>".into());
    };
    // a policy file knows its agent; `check` also compares lengths and rates
    let policy = Policy::load(Path::new(&from))?;
    let options = VecEnvOptions { autoreset: Autoreset::Disabled, ..Default::default() };
    let mut env = VecEnv::new(&policy.meta().agent, &options)?;
    policy.check(env.spec())?;
    let mut step = env.buffers();
    env.reset(Some(3), &mut step.obs)?;

    let scene = Scene::new(&agent(&policy.meta().agent)?.model()?);
    let renderer = Renderer::new(WIDTH, HEIGHT)?;
    let mut camera = Follow::new(&scene, 1, WIDTH, HEIGHT);
    let dt = env.spec().dt;
    let decisions_between = (GAP / dt).round() as usize;

    let mut frames = Vec::new();
    let (mut seconds, mut distance) = (0.0, 0.0);
    for picture in 0..FRAMES {
        for _ in 0..if picture == 0 { 0 } else { decisions_between } {
            let action = policy.act(&step.obs);
            env.step(&action, &mut step)?;
            seconds += dt;
            distance += f64::from(step.forward[0]);
        }
        let frame = scene.frame(&[env.state(0)?.qpos])?;
        let mut image = renderer.render(&frame, &camera.update(&frame, GAP));
        image.caption(Corner::TopLeft, &[status_line(seconds, distance, distance / f64::max(seconds, dt))]);
        frames.push(image);
    }
    strip(&frames, FRAMES)?.save_png(&to)?;
    println!("wrote {to}: {FRAMES} frames, {distance:.1} m in {seconds:.1} s");
    Ok(())
}
