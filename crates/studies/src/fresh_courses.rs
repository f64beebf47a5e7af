//! The evaluation of a runner on fresh random courses, above all on those that are hardest for it: the conditional value at
//! risk of Rutherford and others, "No regrets" (2024).
//!
//! A first set of rollouts finds the worst courses, and a second one measures the runner on them. Courses that were only
//! run badly by chance therefore do not count as the worst ones.

use crate::args::Options;
use crate::error::StudyError;
use crate::record::Record;
use marathon_envs::options::Value;
use marathon_envs::{Autoreset, VecEnv, VecEnvOptions};
use marathon_learn::{BlockPolicy, Policy};
use marathon_physics::lanes::Isa;
use marathon_runs::report::chart::Chart;
use marathon_runs::{PolicySource, TaskConfig, TaskOptions};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Seed of the courses, and of the first rollout. No training has it.
const SEED: u64 = 1_000_033;
/// Rollouts on each course in each of the two sets.
const ROLLOUTS: u64 = 3;
/// Share of the courses that are the worst ones.
const WORST: f64 = 0.1;
/// Courses that are run at the same time.
const AT_ONCE: usize = 256;
/// Distance at which a course has been run to its end, m.
const THROUGH: f64 = 104.0;

/// Results on fresh courses.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fresh {
    /// Number of courses.
    pub courses: usize,
    /// On all courses.
    pub all: Outcome,
    /// On the worst tenth of them.
    pub worst: Outcome,
}

/// Means over rollouts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outcome {
    /// Mean distance, m.
    pub distance: f64,
    /// Share of the rollouts that lasted until the time limit or the end of the course, without a fall.
    pub finished: f64,
}

/// Measures policies of files.
///
/// # Errors
/// If a policy cannot be read, or is not for a task on courses.
pub fn run(options: &Options, policies: &[PathBuf], courses: usize) -> Result<Record, StudyError> {
    let (mut rows, mut bars, mut words) = (Vec::new(), Vec::new(), String::new());
    for path in policies {
        let (name, policy, task) = load(path)?;
        let Fresh { all, worst, .. } = measure(&policy, &task, courses, options.threads)?;
        let cells = [all, worst].map(|o| [format!("{:.1}", o.distance), format!("{:.1}", 100.0 * o.finished)]);
        rows.push([vec![name.clone(), courses.to_string()], cells.concat()].concat());
        bars.push((name, worst.distance));
        words.push_str(&format!(" {}", path.display()));
    }
    Ok(Record {
        name: "fresh-courses",
        title: "Fresh courses",
        about: format!(
            "Policies run over random mixed courses of full difficulty, the same for all of them, each {} times. The first half \
             of the runs finds the worst tenth of the courses for a policy, the other half measures the policy on all courses and \
             on these. A run is finished if it lasted to the time limit, or to the end of the course, without a fall.",
            2 * ROLLOUTS
        ),
        columns: vec!["policy", "courses", "way, m", "finished, %", "worst tenth: way, m", "worst tenth: finished, %"],
        rows,
        words: format!("{words} --fresh {courses}"),
        versions: Vec::new(),
        chart: Chart::Bars("mean way on the worst tenth of the courses, m", bars),
    })
}

/// A policy of a file with its name and its task.
///
/// # Errors
/// If the file cannot be read as a policy.
pub fn load(path: &Path) -> Result<(String, Policy, TaskConfig), StudyError> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let source = PolicySource { policy: path.to_path_buf(), agent: None, task: TaskOptions::default() };
    let policy = source.load()?.0;
    let task = TaskConfig { agent: policy.meta().agent.clone(), options: policy.meta().options.clone() };
    Ok((name, policy, task))
}

/// Runs a policy on fresh mixed courses of difficulty 1. `task` has its other options.
///
/// # Errors
/// If the policy is for another task, or the environments cannot be made.
pub fn measure(policy: &Policy, task: &TaskConfig, courses: usize, threads: usize) -> Result<Fresh, StudyError> {
    let mut task = task.clone();
    for (name, value) in [("course", "mixed".into()), ("levels", "fixed".into()), ("difficulty", Value::Number(1.0))] {
        task.options.set(name, value);
    }
    let mut all = Vec::with_capacity(courses);
    for first in (0..courses).step_by(AT_ONCE) {
        let agents = AT_ONCE.min(courses - first);
        let made = VecEnvOptions { agents, threads, autoreset: Autoreset::Disabled, ..Default::default() };
        all.extend(Batch::new(task.vec_env(&made)?, policy, SEED + first as u64)?.run()?);
    }
    Ok(summary(&all))
}

/// Courses that are run at the same time.
struct Batch<'a> {
    env: VecEnv,
    policy: BlockPolicy<&'a Policy>,
    seed: u64,
    grounds: Vec<Vec<f32>>,
}

impl<'a> Batch<'a> {
    /// Draws the courses of a seed: those of the first episodes.
    fn new(mut env: VecEnv, policy: &'a Policy, seed: u64) -> Result<Self, StudyError> {
        policy.check(env.spec())?;
        let mut out = env.buffers();
        env.reset(Some(seed), &mut out.obs)?;
        let grounds = (0..env.agents()).map(|i| env.ground(i, 0)).collect::<Result<_, _>>()?;
        Ok(Batch { env, policy: BlockPolicy::new(policy, Isa::best()), seed, grounds })
    }

    /// Results of each course: in the first set of rollouts and in the second.
    fn run(mut self) -> Result<Vec<[Outcome; 2]>, StudyError> {
        let mut all = vec![[Outcome::default(); 2]; self.grounds.len()];
        let Batch { env, policy, grounds, seed } = &mut self;
        for i in 0..2 * ROLLOUTS {
            let results = rollout(env, policy, grounds, None, *seed + (1 + i) * 1_000_003)?;
            for (course, Outcome { distance, finished }) in all.iter_mut().zip(results) {
                let sum = &mut course[(i / ROLLOUTS) as usize];
                sum.distance += distance / ROLLOUTS as f64;
                sum.finished += finished / ROLLOUTS as f64;
            }
        }
        Ok(all)
    }
}

/// Runs each agent once over its ground, with the starts of a seed, under a command or those that the task draws.
///
/// # Errors
/// If a ground or the command is not for this task.
pub fn rollout(
    env: &mut VecEnv,
    policy: &mut BlockPolicy<&Policy>,
    grounds: &[Vec<f32>],
    command: Option<&[f64]>,
    seed: u64,
) -> Result<Vec<Outcome>, StudyError> {
    let (agents, info, limit) = (env.agents(), env.spec().info.len(), env.spec().max_episode_steps);
    let way = env.spec().info.iter().position(|name| name == "distance").unwrap_or_default();
    let mut out = env.buffers();
    env.reset(Some(seed), &mut out.obs)?;
    for (i, ground) in grounds.iter().enumerate() {
        env.set_ground(i, 0, ground)?;
        if command.is_some() {
            env.set_command(i, command)?;
        }
    }
    env.observe(&vec![true; agents], &mut out.obs)?;
    let mut action = vec![0.0; agents * env.spec().act];
    let mut results: Vec<Option<Outcome>> = vec![None; agents];
    for decision in 1..=limit {
        policy.act_rows(&out.obs, None, &mut action);
        env.step(&action, &mut out)?;
        for (i, result) in results.iter_mut().enumerate().filter(|(_, result)| result.is_none()) {
            let over = out.terminated[i] || out.truncated[i] || out.diverged[i];
            if over || decision == limit {
                let distance = f64::from(out.info[info * i + way]);
                let fell = out.terminated[i] || out.diverged[i];
                let finished = !fell && (decision == limit || distance > THROUGH);
                *result = Some(Outcome { distance, finished: f64::from(u8::from(finished)) });
            }
        }
        if results.iter().all(Option::is_some) {
            break;
        }
    }
    Ok(results.into_iter().flatten().collect())
}

/// Means of all courses, and of those with the shortest distances in the first set, both in the second set.
fn summary(all: &[[Outcome; 2]]) -> Fresh {
    let mut order: Vec<&[Outcome; 2]> = all.iter().collect();
    order.sort_by(|a, b| a[0].distance.total_cmp(&b[0].distance));
    let mean = |some: &[&[Outcome; 2]]| {
        let of = |value: &dyn Fn(&Outcome) -> f64| some.iter().map(|c| value(&c[1])).sum::<f64>() / some.len() as f64;
        Outcome { distance: of(&|r| r.distance), finished: of(&|r| r.finished) }
    };
    let worst = ((WORST * all.len() as f64).ceil() as usize).max(1);
    Fresh { courses: all.len(), all: mean(&order), worst: mean(&order[..worst]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_courses_are_judged_by_other_rollouts() {
        let course = |first: f64, second: f64| {
            [first, second].map(|distance| Outcome { distance, finished: f64::from(u8::from(distance > 15.0)) })
        };
        // 20 courses: the two that were worst at first are not the worst ones afterwards
        let mut all: Vec<_> = (0..18).map(|_| course(20.0, 10.0)).collect();
        all.extend([course(1.0, 20.0), course(2.0, 30.0)]);
        let fresh = summary(&all);
        assert_eq!((fresh.courses, fresh.worst), (20, Outcome { distance: 25.0, finished: 1.0 }));
        assert!((fresh.all.distance - (180.0 + 50.0) / 20.0).abs() < 1e-12 && (fresh.all.finished - 0.1).abs() < 1e-12);
        assert_eq!(summary(&all[..3]).worst.distance, 10.0, "at least one course");
    }
}
