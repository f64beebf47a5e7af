//! `marathon record-demo`: a policy's decisions as a demonstration for ML-Agents' imitation learning.

use crate::args::RecordDemoArgs;
use crate::error::CliError;
use marathon_envs::VecEnvOptions;
use marathon_learn::{AtomicFile, Policy};
use marathon_mlagents::{Demonstration, Episode};
use marathon_runs::terminal::{print_json, say};
use marathon_runs::{Play, TaskConfig, output, text};
use serde::Serialize;
use std::io::{BufWriter, Seek, Write};
use std::path::PathBuf;

/// Maximum number of agents side by side.
const MAX_AGENTS: usize = 64;

/// Output of `--json`.
#[derive(Serialize)]
struct Report {
    #[serde(serialize_with = "text::path_json")]
    out: PathBuf,
    agent: String,
    episodes: usize,
    decisions: usize,
    return_mean: f64,
}

/// Plays whole episodes with the policy's best actions and writes each to the file when it ends.
///
/// # Errors
/// If there is no such policy, or the file has another ending or cannot be written.
pub fn run(args: &RecordDemoArgs, json: bool) -> Result<(), CliError> {
    // ML-Agents requires this ending
    output::check(&args.out, &["demo"], &[&args.source.policy])?;
    let (policy, factory) = args.source.load()?;
    let name = args.out.file_stem().unwrap_or_default().to_string_lossy();
    let mut demo = Demonstration::new(&name, factory.spec());
    let mut file = BufWriter::new(AtomicFile::create(&args.out)?);
    let failed = || CliError::io(&args.out, "write");
    file.write_all(&demo.front()).map_err(failed())?;
    let mut decisions = 0;
    play(&policy, args.episodes as usize, args.seed, &mut |episode| {
        decisions += episode.rewards.len();
        demo.push(episode);
        file.write_all(&demo.take()).map_err(failed())
    })?;
    file.rewind().map_err(failed())?;
    file.write_all(&demo.front()).map_err(failed())?;
    file.into_inner().map_err(|e| failed()(e.into_error()))?.commit()?;
    let report = Report {
        out: args.out.clone(),
        agent: factory.spec().id.clone(),
        episodes: demo.episodes(),
        decisions,
        return_mean: demo.mean_return(),
    };
    if json {
        print_json(&report);
    } else {
        say(format!(
            "wrote {}: {} episodes of {}, {} decisions, mean return {:.1}",
            text::path_word(&args.out),
            text::thousands(report.episodes as u64),
            report.agent,
            text::thousands(report.decisions as u64),
            report.return_mean
        ));
    }
    Ok(())
}

/// Agents play side by side, and the number of episodes of each is fixed before the start. Taking the episodes that end
/// first would favor short ones. `record` takes each episode when it ends.
fn play(
    policy: &Policy,
    episodes: usize,
    seed: u64,
    record: &mut dyn FnMut(&Episode) -> Result<(), CliError>,
) -> Result<(), CliError> {
    let (n, meta) = (episodes.min(MAX_AGENTS), policy.meta());
    let options = VecEnvOptions { agents: n, seed, ..Default::default() };
    let mut play = Play::of(&TaskConfig::with_training_options(meta), &[policy], &options)?;
    let mut left: Vec<usize> = (0..n).map(|agent| (episodes - agent).div_ceil(n)).collect();
    let mut now = vec![Episode::default(); n];
    while left.iter().any(|left| *left > 0) {
        for (episode, obs) in now.iter_mut().zip(play.last().obs.chunks_exact(meta.obs)) {
            episode.obs.extend(obs);
        }
        for (episode, action) in now.iter_mut().zip(play.decide().chunks_exact(meta.act)) {
            episode.actions.extend(action);
        }
        let step = play.step()?;
        for (agent, episode) in now.iter_mut().enumerate() {
            episode.rewards.push(step.reward[agent]);
            if step.terminated[agent] || step.truncated[agent] {
                episode.obs.extend(&step.final_obs[agent * meta.obs..(agent + 1) * meta.obs]);
                episode.truncated = step.truncated[agent];
                let whole = std::mem::take(episode);
                if left[agent] > 0 {
                    left[agent] -= 1;
                    record(&whole)?;
                }
            }
        }
    }
    Ok(())
}
