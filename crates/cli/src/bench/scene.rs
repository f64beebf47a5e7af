//! Recorded states and controls of a policy's agents, replayed by the physics only: `bench physics --policy`.

use super::plan::{Counts, Plan, Which};
use crate::error::CliError;
use marathon_envs::VecEnvOptions;
use marathon_learn::Policy;
use marathon_physics::lanes::Isa;
use marathon_physics::{Batch, BatchOptions, Model, SimError, SimOptions};
use marathon_runs::Play;
use marathon_runs::speed::{Sample, on_threads, thread_cpu};
use serde::Serialize;
use std::time::Instant;

/// Scenes per policy. Each has all agents.
const SCENES: usize = 6;
/// Decisions of a scene. Scenes are short: a character falls soon when controls do not react to its state.
const DECISIONS: usize = 20;
/// Decisions between two scenes.
const BETWEEN: usize = 60;

/// States of the agents at some moment, and the controls that follow.
#[derive(Clone, Debug, Serialize)]
pub struct Scene {
    /// `qpos` and `qvel` of each agent.
    starts: Vec<[Vec<f64>; 2]>,
    /// One entry per decision, `[agents][nu]`, row-major.
    controls: Vec<Vec<f64>>,
    /// Physics steps of a decision.
    hold: usize,
}

/// Plays a policy and records scenes of `agents` agents, with `hold` physics steps per decision.
///
/// # Errors
/// If the task cannot be simulated.
pub fn record(policy: &Policy, agents: usize, hold: usize) -> Result<Vec<Scene>, CliError> {
    let mut play = Play::new(policy, &VecEnvOptions { agents, ..Default::default() })?;
    let mut scenes = Vec::new();
    for _ in 0..SCENES {
        for _ in 0..BETWEEN {
            play.decide();
            play.step()?;
        }
        let starts = (0..agents).map(|i| play.state(i).map(|state| [state.qpos, state.qvel]));
        let mut scene = Scene { starts: starts.collect::<Result<_, _>>()?, controls: Vec::new(), hold };
        for _ in 0..DECISIONS {
            play.decide();
            play.step()?;
            let mut row = Vec::new();
            for i in 0..agents {
                row.extend(play.ctrl(i)?);
            }
            scene.controls.push(row);
        }
        scenes.push(scene);
    }
    Ok(scenes)
}

/// Replays all scenes once on every thread and adds their counts to `counts`.
///
/// # Errors
/// If the model cannot be simulated.
pub fn replay(plan: &Plan, model: &Model, scenes: &[Scene], isa: Isa, counts: &mut Counts) -> Result<Sample, SimError> {
    let sim = SimOptions { ground_contacts_only: plan.contacts == Which::Ground, ..Default::default() };
    let options = BatchOptions { agents: plan.agents, threads: 1, isa, sim, guard: 0 };
    let work = |_: usize, _: &mut ()| -> Result<(Counts, Sample), SimError> {
        let mut batch = Batch::new(model, &options)?;
        let mut sample = Sample::default();
        for scene in scenes {
            for (agent, [qpos, qvel]) in scene.starts.iter().enumerate() {
                batch.reset(agent, qpos, qvel);
            }
            let (cpu, wall) = (thread_cpu(), Instant::now());
            for ctrl in &scene.controls {
                batch.step(ctrl, scene.hold);
            }
            sample.cpu += thread_cpu() - cpu;
            sample.wall += wall.elapsed().as_secs_f64();
            sample.steps += (plan.agents * scene.controls.len() * scene.hold) as u64;
        }
        Ok((Counts { stats: batch.stats(), non_finite: batch.quarantined() }, sample))
    };
    let (threads, _) = on_threads(&mut vec![(); plan.threads], work);
    let mut sum = Sample::default();
    for thread in threads {
        let (own, sample) = thread?;
        sum.steps += sample.steps;
        sum.cpu += sample.cpu;
        sum.wall = sum.wall.max(sample.wall);
        counts.stats.add(&own.stats);
        counts.non_finite += own.non_finite;
    }
    Ok(sum)
}
