//! The paper's three ways to simulate: one agent, many agents in one world, several processes.

use crate::args::Options;
use crate::error::StudyError;
use crate::record::Record;
use crate::statistics::{Spread, plus_minus, spread};
use crate::training::{Run, each_seed, train_on};
use marathon_config as config;
use marathon_envs::{VecEnv, VecEnvOptions, registry};
use marathon_learn::{BLOCK, Players};
use marathon_physics::lanes::Isa;
use marathon_runs::TaskConfig;
use marathon_runs::processes::Processes;
use marathon_runs::report::chart::Chart;
use std::path::Path;
use std::time::Instant;

const AGENT: &str = "Hopper-v0";
/// Decisions of a measurement without learning.
const DECISIONS: usize = 20_000;

/// Steps one agent and many, and trains with threads and processes.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options) -> Result<Record, StudyError> {
    let (mut rows, mut bars) = (Vec::new(), Vec::new());
    let mut add = |way: &str, agents: usize, learns: &str, speeds: Spread, eval: String| {
        rows.push(vec![
            way.to_string(),
            agents.to_string(),
            learns.to_string(),
            plus_minus(speeds, 0),
            format!("{:.1}", speeds.0 / agents as f64 / 1000.0),
            eval,
        ]);
        bars.push((format!("{way}, {agents}"), speeds.0));
    };
    for (way, agents) in [("solo", 1), ("one world", 16), ("one world", 128)] {
        let speeds: Vec<f64> = (1..=options.seeds).map(|seed| play(agents, seed)).collect::<Result<_, _>>()?;
        add(way, agents, "no", spread(speeds.iter().copied()), String::new());
    }

    let program = std::env::current_exe().map_err(StudyError::io(Path::new("marathon-studies"), "find"))?;
    let factory = registry::factory(AGENT, Isa::best())?;
    let cores = marathon_physics::threads(0);
    let base = config::default_for(AGENT).config.with(|c| c.run.total_steps = options.steps());
    // one agent with rollouts of the same size, for about the same time
    let solo = base.clone().with(|c| {
        c.run.agents = 1;
        c.run.horizon *= base.run.agents;
        c.run.total_steps = options.steps() / BLOCK as u64;
    });
    let ways = [
        ("solo".to_string(), &solo, 1, 0),
        ("one world, one thread".to_string(), &base, 1, 0),
        (format!("one world, {cores} threads"), &base, cores, 0),
        (format!("{cores} processes that play, one thread that learns"), &base, 1, cores),
        (format!("{cores} processes that play, {cores} threads that learn"), &base, cores, cores),
    ];
    for (way, base, threads, processes) in ways {
        let runs = each_seed(options.seeds, |seed| {
            let config = base.clone().with(|c| {
                c.run.seed = seed;
                c.run.threads = threads;
            });
            match processes {
                0 => train_on(&*factory, &config, None),
                n => {
                    let mut players = Processes::start(&program, &TaskConfig::named(AGENT)?, &config, n)?;
                    let run = train_on(&*factory, &config, Some(&mut players as &mut dyn Players))?;
                    players.error.take().map_or(Ok(run), |error| Err(error.into()))
                }
            }
        })?;
        let speed = |r: &Run| r.rate;
        let eval = plus_minus(spread(runs.iter().map(|r| r.eval.return_mean)), 1);
        add(&way, base.run.agents, "yes", spread(runs.iter().map(speed)), eval);
    }
    Ok(Record {
        name: "multi-env",
        title: "One agent, many agents, many processes",
        about: format!(
            "Hopper-v0 in the paper's three ways, on {cores} processors: alone, with others in one world, in several \
             processes (`--agents`, `--threads`, `--processes` of `marathon train`). Without learning, actions are held. A \
             vector carries sixteen agents, so one alone leaves fifteen lanes empty, at the same cost, and learns for a \
             sixteenth of the steps here. Processes copy \
             rollouts and states between each other, threads share them; what is learned is the same to the bit, as the \
             returns show."
        ),
        columns: vec![
            "way",
            "agents",
            "learns",
            "agent-steps per second",
            "thousand steps per second and agent",
            "return",
        ],
        rows,
        words: String::new(),
        versions: Vec::new(),
        chart: Chart::Bars("agent-steps per second", bars),
    })
}

/// Agent-steps per second of `agents` agents on one thread.
fn play(agents: usize, seed: u64) -> Result<f64, StudyError> {
    let mut env = VecEnv::new(AGENT, &VecEnvOptions { agents, seed, threads: 1, ..Default::default() })?;
    let mut step = env.buffers();
    env.reset(None, &mut step.obs)?;
    let actions = vec![0.3f32; agents * env.spec().act];
    let start = Instant::now();
    for _ in 0..DECISIONS {
        env.step(&actions, &mut step)?;
    }
    Ok((DECISIONS * agents) as f64 / start.elapsed().as_secs_f64())
}
