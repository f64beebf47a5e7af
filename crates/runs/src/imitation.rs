//! Measures how well a policy follows motion clips, from their first frame and from random frames.

use crate::error::RunError;
use crate::play::Play;
use crate::task_config::{CLIP, FIRST, START, TaskConfig};
use marathon_envs::agents::marathon::marathon_man::clips;
use marathon_envs::options::OptionValue;
use marathon_envs::{Autoreset, Clips, NamedClip, VecEnvOptions, registry};
use marathon_learn::{EvalOptions, Policy};
use marathon_motion::{Places, Tracking};
use marathon_physics::Model;
use marathon_physics::model::JointType;
use serde::{Deserialize, Serialize};

/// Episodes whose pose errors are averaged, as in table 3 of the AMP paper.
const WARPED: usize = 32;

/// Results for one clip.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Imitation {
    /// The clip. Empty if the task has no choice.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub clip: String,
    /// Episodes per kind of start.
    pub episodes: u64,
    /// Starts at the clip's first frame.
    pub first: Followed,
    /// Starts anywhere in the clip.
    pub random: Followed,
}

/// Episodes with the same kind of start, up to the longest time or the end of a clip that does not loop.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Followed {
    /// Episodes that followed the clip to the end, without a fall and without losing the clip.
    pub completed: u64,
    /// Mean length of the episodes, s.
    pub seconds: f64,
    /// Mean absolute difference of the joint angles, averaged over the decisions, rad.
    pub joint_error: f64,
    /// Mean distance of joints, hands and feet from those of the clip, relative to the pelvis, after dynamic time
    /// warping, m. This is the measure of table 3 of the AMP paper (Peng et al., 2021), over the first 32 episodes.
    pub pose_error: f64,
    /// Number of times that the pelvis was upside down and upright again before a fall: mean over the episodes.
    pub flips: f64,
    /// Smallest number of flips in an episode.
    pub flips_least: u64,
    /// Mean distance that a part of a sole slides per ground contact, m.
    pub slide: f64,
}

/// Measures how well a policy follows each clip of its task, with its own options except for the starts. Empty for
/// tasks that follow no clip.
///
/// # Errors
/// If the task cannot be created.
pub fn measure(policy: &Policy, options: &EvalOptions) -> Result<Vec<Imitation>, RunError> {
    let (task_config, clips) = clips_of(policy)?;
    let of_clip = |clip: Option<NamedClip>| {
        let first = follow_from(FIRST, clip.as_ref(), policy, &task_config, options)?;
        let random = follow_from("random", clip.as_ref(), policy, &task_config, options)?;
        let clip = clip.map_or(String::new(), |clip| clip.name().into());
        Ok(Imitation { clip, episodes: options.episodes as u64, first, random })
    };
    clips.into_iter().map(of_clip).collect()
}

/// The part of [`measure`] that starts at each clip's first frame.
///
/// # Errors
/// If the task cannot be created.
pub fn from_beginning(policy: &Policy, options: &EvalOptions) -> Result<Vec<Followed>, RunError> {
    let (task_config, clips) = clips_of(policy)?;
    clips.iter().map(|clip| follow_from(FIRST, clip.as_ref(), policy, &task_config, options)).collect()
}

/// A policy's task and the clips that it follows. `None` if the task has no choice.
fn clips_of(policy: &Policy) -> Result<(TaskConfig, Vec<Option<NamedClip>>), RunError> {
    let task_config = TaskConfig::of_policy(policy.meta());
    let Ok(agent) = registry::agent(&task_config.agent) else { return Ok((task_config, Vec::new())) };
    if !agent.facts().follows_clips || !agent.has_option(START) {
        return Ok((task_config, Vec::new()));
    }
    let clips = task_config.factory()?.spec().options.get(CLIP).and_then(Clips::read);
    let clips = clips.map_or(vec![None], |clips| clips::each(&clips).into_iter().map(Some).collect());
    Ok((task_config, clips))
}

fn follow_from(
    start: &str,
    clip: Option<&NamedClip>,
    policy: &Policy,
    task_config: &TaskConfig,
    options: &EvalOptions,
) -> Result<Followed, RunError> {
    let mut task_config = task_config.clone();
    task_config.options.set(START, start);
    if let Some(clip) = clip {
        task_config.options.set(CLIP, clip.clone());
    }
    follow(policy, &task_config, options)
}

/// Plays one episode per agent.
fn follow(policy: &Policy, task_config: &TaskConfig, options: &EvalOptions) -> Result<Followed, RunError> {
    let vec_options = VecEnvOptions {
        agents: options.episodes,
        seed: options.seed,
        threads: options.threads,
        autoreset: Autoreset::Disabled,
        ..VecEnvOptions::default()
    };
    let mut play = Play::of(task_config, &[policy], &vec_options)?;
    let model = registry::agent(&task_config.agent)?.model()?;
    let tracking = Tracking::new(&model);
    let dt = policy.meta().control_dt;
    let mut episodes: Vec<Episode> = (0..options.episodes).map(|_| Episode::default()).collect();
    while episodes.iter().any(|episode| !episode.over) {
        play.decide();
        let step = play.step()?;
        let ends: Vec<[bool; 2]> =
            step.terminated.iter().zip(&step.truncated).map(|(fell, over)| [*fell, *over]).collect();
        for (agent, episode) in episodes.iter_mut().enumerate().filter(|(_, episode)| !episode.over) {
            let qpos = play.qpos(agent)?;
            let clip = play.reference(agent)?.unwrap_or_else(|| qpos.clone());
            episode.angles += joint_error(&model, &qpos, &clip);
            if agent < WARPED {
                episode.places.push(tracking.places(&qpos));
                episode.clip.push(tracking.places(&clip));
            }
            episode.frames.push(qpos);
            let [fell, over] = ends[agent];
            episode.over = fell || over;
            episode.completed = over && !fell;
        }
    }
    Ok(summarize(&episodes, &tracking, dt))
}

/// Results of one agent.
#[derive(Default)]
struct Episode {
    frames: Vec<Vec<f64>>,
    places: Vec<Places>,
    clip: Vec<Places>,
    /// Sum of the joint errors over the decisions.
    angles: f64,
    over: bool,
    completed: bool,
}

fn summarize(episodes: &[Episode], tracking: &Tracking<'_>, dt: f64) -> Followed {
    let count = episodes.len() as f64;
    let decisions: usize = episodes.iter().map(|episode| episode.frames.len()).sum();
    let flips: Vec<usize> = episodes.iter().map(|episode| tracking.flips(&episode.frames)).collect();
    let slides: Vec<f64> = episodes.iter().flat_map(|episode| tracking.slides(&episode.frames, dt)).collect();
    let errors: Vec<f64> = episodes.iter().filter_map(|e| tracking.pose_error(&e.places, &e.clip)).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    Followed {
        completed: episodes.iter().filter(|episode| episode.completed).count() as u64,
        seconds: decisions as f64 * dt / count,
        joint_error: episodes.iter().map(|episode| episode.angles).sum::<f64>() / decisions as f64,
        pose_error: mean(&errors),
        flips: flips.iter().sum::<usize>() as f64 / count,
        flips_least: flips.iter().min().copied().unwrap_or(0) as u64,
        slide: mean(&slides),
    }
}

/// Mean absolute difference of the angles of two poses, rad.
fn joint_error(model: &Model, qpos: &[f64], clip: &[f64]) -> f64 {
    let hinges = model.joints.iter().filter(|joint| joint.kind == JointType::Hinge);
    let errors: Vec<f64> = hinges.map(|joint| (qpos[joint.qpos_adr] - clip[joint.qpos_adr]).abs()).collect();
    errors.iter().sum::<f64>() / errors.len().max(1) as f64
}

impl Imitation {
    /// The results as a few lines of text.
    pub fn table(&self) -> String {
        let clip = if self.clip.is_empty() { String::new() } else { format!(" {}", self.clip) };
        let row = |from: &str, f: &Followed| {
            let flips = match f.flips > 0.0 {
                true => format!(", {:.1} flips (at least {})", f.flips, f.flips_least),
                false => String::new(),
            };
            format!(
                "\n  from {from:13} {} of {} completed, {:.1} s; joints {:.3} rad off, pose {:.3} m, soles slide {:.1} cm{flips}",
                f.completed,
                self.episodes,
                f.seconds,
                f.joint_error,
                f.pose_error,
                1e2 * f.slide
            )
        };
        format!("the clip{clip}:{}{}", row("its beginning", &self.first), row("anywhere", &self.random))
    }
}
