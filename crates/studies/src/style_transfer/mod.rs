//! Style transfer: Marathon Man learns each motion clip with its default configuration.

mod findings;

use crate::args::Options;
use crate::error::StudyError;
use crate::kept;
use crate::record::Record;
use crate::statistics::{self, median};
use findings::Found;
use marathon_config::{Loaded, default_for};
use marathon_envs::registry;
use marathon_learn::EvalOptions;
use marathon_physics::hint::{did_you_mean, nearest};
use marathon_physics::lanes::Isa;
use marathon_runs::report::chart::Chart;
use marathon_runs::report::csv::History;
use marathon_runs::terminal::interrupt;
use marathon_runs::text::thousands;
use marathon_runs::{PolicySource, RunFile, RunFolder, Summary, TaskOptions, imitation};
use std::path::{Path, PathBuf};

/// Default folder of the kept runs.
const KEEP: &str = "runs/style-transfer";
/// Episodes of the evaluation of an intermediate policy.
const EPISODES: usize = 16;
/// Smallest ratio of the steps of two evaluated intermediate policies.
const APART: f64 = 1.1;
/// Maximum number of lines in the picture, so that they can be distinguished.
const LINES: usize = 16;

/// A clip and its task.
struct Job {
    /// The clip's name; for characters other than Marathon Man, the name of the task.
    clip: String,
    task: String,
    /// The clip's file.
    motion: Vec<u8>,
    /// Duration of the clip, s.
    duration: f64,
    /// Longest episode from the clip's beginning, s.
    longest: f64,
}

impl Job {
    /// Its training with a seed. It keeps all intermediate policies for the evaluation.
    fn training(&self, seed: u64) -> kept::Job {
        let loaded = Loaded { keep_checkpoints: usize::MAX, ..default_for(&self.task) };
        let (task, arguments) = (self.task.clone(), TaskOptions::default());
        kept::Job { task, arguments, seed, loaded, initialize_from: None }
    }
}

/// Trains and evaluates. With `kept_only`, uses the kept runs without training.
///
/// # Errors
/// If a clip is unknown, or a run cannot be trained or read, or has another configuration.
pub fn run(options: &Options, clips: &[String], kept_only: bool) -> Result<Record, StudyError> {
    let jobs = jobs(clips)?;
    interrupt::install("finishing this iteration; the same command continues")?;
    let keep = options.keep.clone().unwrap_or_else(|| PathBuf::from(KEEP));
    let (mut rows, mut lines) = (Vec::new(), Vec::new());
    for job in &jobs {
        let mut found = Vec::new();
        for seed in 1..=options.seeds {
            let folder = keep.join(format!("{}-{seed}", job.task));
            let file = kept::file(&folder);
            let training = job.training(seed);
            match Found::read(&file, job, &training.expected(options)?)? {
                Some(kept) => found.push(kept),
                None if kept_only => {}
                None => {
                    training.train(&folder, options)?;
                    let made = measured(job, &folder)?;
                    kept::write(&file, &made)?;
                    found.push(made);
                }
            }
        }
        if found.is_empty() {
            continue;
        }
        rows.push(row(job, &found));
        lines.push((job.clip.clone(), middle(&found)));
    }
    lines.truncate(LINES);
    if rows.is_empty() {
        return Err(StudyError::file(&keep, "runs", "none of these clips", "what an earlier study has kept"));
    }
    let mut words = match clips {
        [] => String::new(),
        clips => format!(" --clips {}", clips.join(",")),
    };
    if kept_only {
        words.push_str(" --kept-only");
    }
    Ok(Record {
        name: "style-transfer",
        title: "Style transfer",
        about: about(),
        columns: vec![
            "clip",
            "seeds",
            "decisions",
            "processor seconds",
            "of 100 from the beginning",
            "of 100 from anywhere",
            "joint error, rad",
            "pose error, m",
            "flips in a row (fewest)",
            "slide, cm",
            "once through: decisions",
            "once through: processor seconds",
        ],
        rows,
        words,
        versions: Vec::new(),
        chart: Chart::Lines("share of the longest time that is followed from the clip's beginning", lines),
    })
}

fn about() -> String {
    format!(
        "Marathon Man learns each clip by PPO with the configuration that comes with him, `marathon_man-fast.yaml`; the paper's \
         Humanoid and Walker learn theirs with `in_style-fast.yaml`. Each run \
         has one seed; the table has medians over the seeds, and each seed's number in brackets if they differ. The \
         policy's best actions are judged over 100 episodes from the clip's first frame and 100 from random ones, each up to \
         20 s or to the end of a clip that does not loop. An episode is completed if it has no fall and the parts stay within \
         0.5 m of the clip in the mean. Joint errors, pose errors and slides are those of episodes from the beginning; \
         the pose error is that of table 3 of the AMP paper (Peng et al., 2021), with dynamic time warping. *Once through* is \
         the first policy kept on the way that follows the whole clip, or one cycle of it, in the mean of {EPISODES} episodes \
         from the beginning.\n\n\
         The paper (Booth and Booth, 2019, section 4.1 and figure 3) trained its backflip for 50 to 128 million steps, 25 hours \
         on six cores, and its walk and run likewise for each clip by itself. DeepMimic (Peng et al., 2018) took 60 million \
         samples for a backflip; its pose error is 0.076 m in table 3 of the AMP paper."
    )
}

/// The tasks of the named clips; of all if `clips` is empty.
fn jobs(clips: &[String]) -> Result<Vec<Job>, StudyError> {
    let mut all = Vec::new();
    for id in registry::ids() {
        let agent = registry::agent(&id)?;
        let facts = agent.facts();
        let own = facts.follows_clips && facts.clips.len() == 1 && !agent.has_option("clip");
        if let Some(clip) = facts.clips.first().filter(|_| own) {
            let limit = facts.max_episode_steps as f64 * registry::factory(&id, Isa::best())?.spec().dt;
            let duration = clip.duration();
            let longest = if clip.cycle().is_some() { limit } else { limit.min(duration) };
            let name = match id.starts_with("MarathonMan") {
                true => clip.about().name.clone(),
                false => id.rsplit_once('-').map_or(id.clone(), |(name, _)| name.to_string()),
            };
            all.push(Job { clip: name, task: id, motion: clip.to_bytes(), duration, longest });
        }
    }
    for clip in clips {
        let known = || all.iter().map(|job| job.clip.as_str());
        if known().all(|name| name != clip) {
            let near = did_you_mean(nearest(clip, known()));
            let known: Vec<&str> = known().collect();
            return Err(StudyError::Usage(format!(
                "--clips: found '{clip}', expected some of {}{near}",
                known.join(", ")
            )));
        }
    }
    all.retain(|job| clips.is_empty() || clips.contains(&job.clip));
    Ok(all)
}

/// Reads a finished run and evaluates its intermediate policies.
fn measured(job: &Job, path: &Path) -> Result<Found, StudyError> {
    let (folder, run): (_, RunFile) = RunFolder::open(path)?;
    let summary = kept::summary(&folder)?;
    let Some(imitation) = summary.imitation.first().cloned() else {
        return Err(StudyError::file(
            &folder.summary(),
            "imitation",
            "nothing",
            "the results of a finished run for its clip",
        ));
    };
    let history = History::read(&folder.progress())?;
    let column = |name: &str| history.column(name).into_iter().map(|cell| cell.unwrap_or(0.0));
    let clock: Vec<(f64, f64)> = column("steps").zip(column("cpu_seconds")).collect();
    let mut policies: Vec<(u64, PathBuf)> = vec![(summary.steps, folder.policy())];
    let kept = folder.policies();
    // a short run has no intermediate policies
    for entry in std::fs::read_dir(&kept).into_iter().flatten() {
        let path = entry.map_err(StudyError::io(&kept, "read"))?.path();
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        policies.extend(name.rsplit('-').next().and_then(|steps| steps.parse().ok()).map(|steps| (steps, path)));
    }
    policies.sort();
    policies.dedup_by_key(|(steps, _)| *steps);
    let judge = EvalOptions { episodes: EPISODES, ..EvalOptions::default() };
    let (mut curve, mut judged, last) = (Vec::new(), 0.0, summary.steps);
    for (steps, policy) in policies {
        if steps != last && (steps as f64) < APART * judged {
            continue;
        }
        judged = steps as f64;
        let (policy, _) = PolicySource { policy, agent: None, task: TaskOptions::default() }.load()?;
        let seconds = clock.iter().rfind(|(done, _)| *done <= steps as f64).map_or(0.0, |(_, seconds)| *seconds);
        let followed = imitation::from_beginning(&policy, &judge)?;
        curve.extend(followed.first().map(|clip| [steps as f64, seconds, clip.seconds / job.longest]));
    }
    let Summary { steps, cpu_seconds, .. } = summary;
    Ok(Found { run, clip: findings::clip(job), steps, cpu_seconds, imitation, curve })
}

/// A row of the table.
fn row(job: &Job, found: &[Found]) -> Vec<String> {
    let cell = |text: &dyn Fn(f64) -> String, of: &dyn Fn(&Found) -> Option<f64>| {
        let values: Vec<Option<f64>> = found.iter().map(of).collect();
        statistics::cell(&values, text)
    };
    let whole = |x: f64| thousands(x.round() as u64);
    let once = |found: &Found, i: usize| {
        let share = job.duration / job.longest;
        // an episode ends one decision before the end of the clip
        found.curve.iter().find(|point| point[2] >= 0.98 * share).map(|point| point[i])
    };
    vec![
        job.clip.clone(),
        found.len().to_string(),
        cell(&whole, &|f| Some(f.steps as f64)),
        cell(&whole, &|f| Some(f.cpu_seconds)),
        cell(&whole, &|f| Some(f.imitation.first.completed as f64)),
        cell(&whole, &|f| Some(f.imitation.random.completed as f64)),
        cell(&|x| format!("{x:.3}"), &|f| Some(f.imitation.first.joint_error)),
        cell(&|x| format!("{x:.3}"), &|f| Some(f.imitation.first.pose_error)),
        match found.iter().all(|f| f.imitation.first.flips == 0.0) {
            true => String::new(),
            false => {
                let fewest = found.iter().map(|f| f.imitation.first.flips_least).min().unwrap_or(0);
                format!("{} ({fewest})", cell(&|x| format!("{x:.1}"), &|f| Some(f.imitation.first.flips)))
            }
        },
        cell(&|x| format!("{:.1}", 1e2 * x), &|f| Some(f.imitation.first.slide)),
        cell(&whole, &|f| once(f, 0)),
        cell(&whole, &|f| once(f, 1)),
    ]
}

/// Medians of the seeds at the steps of the first curve.
fn middle(found: &[Found]) -> Vec<(f64, f64)> {
    let Some(first) = found.first() else { return Vec::new() };
    let at = |steps: f64| {
        let of_run = |f: &Found| f.curve.iter().find(|point| point[0] == steps).map(|point| point[2]);
        median(found.iter().filter_map(of_run).collect())
    };
    first.curve.iter().filter_map(|point| Some((point[0], at(point[0])?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_clip_has_a_task_and_unknown_ones_are_refused() {
        let all = jobs(&[]).unwrap();
        let mut names: Vec<&str> = all.iter().map(|job| job.clip.as_str()).collect();
        assert!(names.len() >= 20 && names.contains(&"Walker2dStyleRun"), "{names:?}");
        names.dedup();
        assert_eq!(names.len(), all.len(), "a name has one task");
        let some = jobs(&["run".into(), "kick".into()]).unwrap();
        let names: Vec<&str> = some.iter().map(|job| job.task.as_str()).collect();
        assert_eq!(names, ["MarathonManRun-v0", "MarathonManKick-v0"]);
        assert_eq!(some[0].longest, 20.0);
        assert!(some[1].longest < 3.0 && some[1].longest == some[1].duration);
        let error = jobs(&["rum".into()]).err().unwrap().to_string();
        assert!(error.contains("'rum'") && error.contains("did you mean 'run'?"), "{error}");
    }
}
