//! `marathon motion render --policy`: a policy together with the clip that it follows.

use super::{RenderArgs, model, show};
use crate::error::CliError;
use crate::video::{Cast, Ghost, shoot};
use marathon_envs::options::Value;
use marathon_envs::registry;
use marathon_learn::{EvalOptions, PolicyMeta};
use marathon_motion::{About, Clip};
use marathon_render::Format;
use marathon_runs::terminal::{interrupt, print_json, say};
use marathon_runs::text::path_word;
use marathon_runs::{PolicySource, TaskOptions, policy_file};
use std::path::Path;

/// Minimum duration of a video of a looping clip, s.
const LOOP: f64 = 8.0;

/// Draws a policy with the clip as its ghost, from the clip's first frame on.
pub fn render(args: &RenderArgs, policy: &Path, json: bool) -> Result<(), CliError> {
    let clip = model::clip(&args.clip)?;
    let repeats = clip.cycle().is_some() && Format::of(&args.out)? != Format::Png;
    let shot = show::shot(args, if repeats { clip.duration().max(LOOP) } else { clip.duration() })?;
    let task = task(args, &clip, policy_file::read(policy, None)?.meta())?;
    let (policy, factory) = PolicySource { policy: policy.into(), agent: None, task }.load()?;
    let ghost = Some(args.ghost.unwrap_or(Ghost::Inside));
    let cast = Cast { agents: 1, seed: EvalOptions::default().seed, start: 0.0, ghost };
    interrupt::install("leaving without a picture")?;
    let report = shoot(&[policy], factory.spec(), &shot, &cast, &args.out)?;
    if json {
        print_json(&report);
    } else {
        say(report.line());
    }
    Ok(())
}

/// The options with which the policy's task follows the clip from its first frame on, followed by the user's.
fn task(args: &RenderArgs, clip: &Clip, policy: &PolicyMeta) -> Result<TaskOptions, CliError> {
    let agent = registry::agent(&policy.agent)?;
    let mut given = Vec::new();
    if agent.has_option("clip") {
        if args.task.given.iter().any(|(name, _)| name == "clip") {
            let found = path_word(&args.clip);
            return Err(CliError::Usage(format!("--option clip stands beside the clip {found}, expected one of them")));
        }
        let text = args.clip.to_str().ok_or_else(|| {
            CliError::Usage(format!("the path {} is not UTF-8, as required for a task's clip", path_word(&args.clip)))
        })?;
        given.push(("clip".into(), Value::Text(text.into())));
    } else {
        check_own(&args.clip, clip, policy)?;
    }
    if agent.has_option("start") {
        given.push(("start".into(), Value::Text("first".into())));
    }
    // later options have precedence
    given.extend(args.task.given.iter().cloned());
    Ok(TaskOptions { given })
}

/// Checks that a task with its own clip shows this clip.
fn check_own(path: &Path, clip: &Clip, policy: &PolicyMeta) -> Result<(), CliError> {
    let (path, task) = (path_word(path), &policy.agent);
    let motion = |clip: &Clip| clip.clone().with_about(About::default());
    let facts = registry::agent(task)?.facts();
    match &facts.clips[..] {
        clips if clips.is_empty() || !facts.follows_clips => {
            Err(CliError::Usage(format!("{task} follows no clip, expected a policy of a task that does")))
        }
        [own] if motion(own) == motion(clip) => Ok(()),
        [own] => Err(CliError::Usage(format!(
            "{path} is not the clip that {task} follows, {:?}; expected that one, or a policy of MarathonMan-v0, which \
             takes any",
            own.about().name
        ))),
        more => {
            let text = format!("{task} follows one of {} clips, expected a task that follows one alone", more.len());
            Err(CliError::Usage(text))
        }
    }
}
