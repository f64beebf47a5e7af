//! `marathon record-demo`: a policy's decisions as a demonstration for ML-Agents' imitation learning.

use crate::args::RecordDemoArgs;
use crate::console::{print_json, say};
use crate::error::CliError;
use marathon_envs::VecEnvOptions;
use marathon_learn::{Policy, write_atomic};
use marathon_mlagents::{Demonstration, Episode};
use marathon_runs::{Play, Setting, text};
use serde::Serialize;
use std::path::PathBuf;

/// Most agents that play side by side.
const MAX_AGENTS: usize = 64;

/// What was recorded.
#[derive(Serialize)]
struct Report {
    #[serde(serialize_with = "text::path_json")]
    out: PathBuf,
    agent: String,
    episodes: usize,
    decisions: usize,
    return_mean: f64,
}

/// Plays whole episodes with the policy's best actions and writes them down.
///
/// # Errors
/// If there is no such policy, or the file has another ending or cannot be written.
pub fn run(args: &RecordDemoArgs, json: bool) -> Result<(), CliError> {
    let ending = args.out.extension().unwrap_or_default();
    if !ending.eq_ignore_ascii_case("demo") {
        let out = text::path_word(&args.out);
        return Err(CliError::Usage(format!(
            "--out is {out}, expected a name that ends in .demo: ML-Agents looks for it"
        )));
    }
    let (policy, factory) = args.source.load()?;
    let name = args.out.file_stem().unwrap_or_default().to_string_lossy();
    let mut demo = Demonstration::new(&name, factory.spec());
    let episodes = play(&policy, args.episodes as usize, args.seed)?;
    for episode in &episodes {
        demo.push(episode);
    }
    write_atomic(&args.out, &demo.bytes())?;
    let report = Report {
        out: args.out.clone(),
        agent: factory.spec().id.clone(),
        episodes: episodes.len(),
        decisions: episodes.iter().map(|episode| episode.rewards.len()).sum(),
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

/// Agents play side by side, and each plays a number of episodes that is fixed before the start: taking whatever ends first
/// would favor short episodes.
fn play(policy: &Policy, episodes: usize, seed: u64) -> Result<Vec<Episode>, CliError> {
    let (n, meta) = (episodes.min(MAX_AGENTS), policy.meta());
    let options = VecEnvOptions { agents: n, seed, ..Default::default() };
    let mut play = Play::of(&Setting::asked(meta), &[policy], &options)?;
    let quota = |agent: usize| (episodes - agent).div_ceil(n);
    let mut done: Vec<Vec<Episode>> = vec![Vec::new(); n];
    let mut now = vec![Episode::default(); n];
    while (0..n).any(|agent| done[agent].len() < quota(agent)) {
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
                if done[agent].len() < quota(agent) {
                    done[agent].push(whole);
                }
            }
        }
    }
    Ok(done.into_iter().flatten().collect())
}
