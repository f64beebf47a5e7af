//! Speed with and without pictures.

use crate::args::Options;
use crate::error::StudyError;
use crate::record::Record;
use crate::statistics::{Spread, plus_minus, spread};
use marathon_envs::{VecEnv, VecEnvOptions, registry};
use marathon_render::{Follow, Renderer, Scene};
use marathon_runs::report::chart::Chart;
use marathon_runs::text::thousands;
use std::time::Instant;

const AGENTS: [&str; 2] = ["Hopper-v0", "Humanoid-v0"];
/// Agents in a scene.
const COUNT: usize = 16;
/// Decisions of a measurement without pictures.
const STRETCH: usize = 2000;
/// Pictures of a measurement.
const PICTURES: usize = 40;

/// Pictures of a row: a name, the size, and pictures per simulated second, or none for a picture after every decision.
type Case = (&'static str, [usize; 2], Option<f64>);
const CASES: [Case; 3] = [
    ("84 x 84 after every decision, ML-Agents' size", [84, 84], None),
    ("480 x 270 after every decision", [480, 270], None),
    ("480 x 270, 25 per simulated second", [480, 270], Some(25.0)),
];

/// Plays sixteen agents without pictures and with pictures of different sizes.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options) -> Result<Record, StudyError> {
    let (mut rows, mut bars) = (Vec::new(), Vec::new());
    for agent in AGENTS {
        let none = measure(options, |seed| World::new(agent, seed)?.play(STRETCH, None))?;
        rows.push(row(agent, "none", none, none.0));
        for (name, size, rate) in CASES {
            let speed = measure(options, |seed| {
                let mut world = World::new(agent, seed)?;
                let every = rate.map_or(1, |rate| (1.0 / (rate * world.env.spec().dt)).round().max(1.0) as usize);
                world.play(PICTURES * every, Some((size, every)))
            })?;
            rows.push(row(agent, name, speed, none.0));
            bars.push((format!("{agent}, {name}"), speed.0));
        }
    }
    Ok(Record {
        name: "headless",
        title: "With and without pictures",
        about: "Sixteen agents with random actions on one thread, and pictures of all of them by the ray caster of \
                `marathon render`, which draws on the processor. Training never draws; a picture is what watching costs. The \
                paper's `--no-graphics` and physics-only steps together brought it 50%; the window of the game draws on a \
                GPU and is not measured here."
            .into(),
        columns: vec!["agent", "pictures", "agent-steps per second", "times slower than without"],
        rows,
        words: String::new(),
        versions: Vec::new(),
        chart: Chart::Bars("agent-steps per second with pictures of sixteen agents", bars),
    })
}

fn measure(options: &Options, one: impl FnMut(u64) -> Result<f64, StudyError>) -> Result<Spread, StudyError> {
    let speeds: Vec<f64> = (1..=options.seeds).map(one).collect::<Result<_, _>>()?;
    Ok(spread(speeds.iter().copied()))
}

fn row(agent: &str, pictures: &str, speed: Spread, none: f64) -> Vec<String> {
    vec![agent.into(), pictures.into(), plus_minus(speed, 0), thousands((none / speed.0).round() as u64)]
}

/// Agents and their scene.
struct World {
    env: VecEnv,
    scene: Scene,
}

impl World {
    fn new(agent: &str, seed: u64) -> Result<Self, StudyError> {
        let env = VecEnv::new(agent, &VecEnvOptions { agents: COUNT, seed, threads: 1, ..Default::default() })?;
        Ok(World { env, scene: Scene::new(&registry::agent(agent)?.model()?) })
    }

    /// Plays and returns the agent-steps per second. `pictures`: the size, and the decisions between two pictures.
    fn play(&mut self, decisions: usize, pictures: Option<([usize; 2], usize)>) -> Result<f64, StudyError> {
        let World { env, scene } = self;
        let dt = env.spec().dt;
        let mut step = env.buffers();
        env.reset(None, &mut step.obs)?;
        let mut view = match pictures {
            Some(([width, height], every)) => {
                Some((Renderer::new(width, height)?, Follow::new(scene, COUNT, width, height), every))
            }
            None => None,
        };
        let mut actions = vec![0.0f32; COUNT * env.spec().act];
        let mut noise = 1u32;
        let start = Instant::now();
        for decision in 1..=decisions {
            for action in &mut actions {
                noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *action = (noise >> 8) as f32 / (1 << 23) as f32 - 1.0;
            }
            env.step(&actions, &mut step)?;
            if let Some((renderer, camera, every)) = view.as_mut().filter(|(_, _, every)| decision % every == 0) {
                let poses: Vec<Vec<f64>> =
                    (0..COUNT).map(|i| Ok(env.state(i)?.qpos)).collect::<Result<_, StudyError>>()?;
                let frame = scene.frame(&poses)?;
                renderer.render(&frame, &camera.update(&frame, dt * *every as f64));
            }
        }
        Ok((decisions * COUNT) as f64 / start.elapsed().as_secs_f64())
    }
}
