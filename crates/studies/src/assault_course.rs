//! Assault courses: characters learn on ground that is level, random, increasingly difficult, made of pieces that teach,
//! or built by an adversary, with and without seeing it. Their policies are evaluated on courses that are new to all of them.

use crate::args::{FRESH, Options};
use crate::error::StudyError;
use crate::fresh_courses::{self, Fresh, Outcome};
use crate::kept;
use crate::record::Record;
use crate::statistics::{cell, median};
use crate::training::EPISODES;
use marathon_config::{against, default_for};
use marathon_envs::options::Value;
use marathon_learn::{EvalOptions, Evaluation, Policy, evaluate};
use marathon_physics::hint::{did_you_mean, nearest};
use marathon_physics::lanes::Isa;
use marathon_runs::report::chart::Chart;
use marathon_runs::terminal::interrupt;
use marathon_runs::text::thousands;
use marathon_runs::{PolicySource, RunFile, RunFolder, Summary, TaskConfig, TaskOptions};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Default folder of the kept runs.
const KEEP: &str = "runs/assault-course";
/// The characters.
const TASKS: [&str; 3] = ["TerrainHopper", "TerrainWalker2d", "TerrainAnt"];

/// Characters that see the ground, and characters that do not.
const SIGHTS: [&str; 2] = ["heights", "blind"];

/// Training ground: its name and its options.
type Ground = (&'static str, &'static [(&'static str, &'static str)]);

/// Training grounds.
const GROUNDS: [Ground; 10] = [
    ("flat", &[("course", "flat"), ("levels", "fixed")]),
    ("random", &[("course", "mixed"), ("levels", "random"), ("difficulty", "1")]),
    ("distance", &[("course", "mixed"), ("levels", "distance"), ("difficulty", "1")]),
    ("sfl", &[("course", "mixed"), ("levels", "sfl"), ("difficulty", "1")]),
    ("plr", &[("course", "mixed"), ("levels", "plr"), ("difficulty", "1")]),
    ("accel", &[("course", "mixed"), ("levels", "accel"), ("difficulty", "1")]),
    ("adversary", &[("course", "adversary"), ("levels", "fixed"), ("difficulty", "1")]),
    ("bounded", &[("course", "adversary"), ("levels", "fixed"), ("difficulty", "0.5")]),
    ("rising", &[("course", "adversary"), ("levels", "distance"), ("difficulty", "1")]),
    ("regret", &[("course", "adversary"), ("levels", "fixed"), ("difficulty", "1"), REGRET]),
];

/// The reward of the builder. With it, two characters take turns, so a run has twice the decisions.
const REGRET: (&str, &str) = ("builder", "regret");

/// Courses of the evaluation: name in the table, kind, difficulty.
const COURSES: [(&str, &str, &str); 5] = [
    ("flat", "flat", "0"),
    ("bumps", "bumps", "1"),
    ("blocks", "blocks", "1"),
    ("mixed", "mixed", "1"),
    ("meters", "meters", "0.5"),
];

/// Ground that a character's own adversary may build.
const ADVERSARY: [(&str, &str); 3] = [("course", "adversary"), ("levels", "fixed"), ("difficulty", "0.5")];
/// Characters against which an adversary can learn.
const HAVE_ADVERSARIES: [&str; 2] = ["TerrainHopper", "TerrainWalker2d"];
/// Decisions of the character for which its own adversary learns.
const ADVERSARY_STEPS: u64 = 4_000_000;

/// Results of a finished run.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Found {
    /// The run.
    run: RunFile,
    /// Agent-steps done.
    steps: u64,
    /// Processor seconds of the training.
    cpu_seconds: f64,
    /// The evaluation on each course.
    courses: Vec<Judged>,
    /// The evaluation on fresh random courses. Older files have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fresh: Option<Fresh>,
    /// The evaluation on the ground of its own adversary, which learned against the fixed policy. Older files have
    /// none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    adversary: Option<Judged>,
}

/// Evaluation of a policy on a course.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Judged {
    course: String,
    difficulty: f64,
    /// Mean distance per episode, m.
    distance: f64,
    /// Episodes that ended with a fall.
    falls: u64,
}

impl Judged {
    fn of(course: &str, difficulty: &str, result: &Evaluation) -> Self {
        let difficulty = difficulty.parse().unwrap_or_default();
        Judged { course: course.into(), difficulty, distance: result.distance_mean, falls: result.falls }
    }
}

/// How to evaluate the runners.
#[derive(Clone, Copy)]
pub struct Evaluations {
    /// Use the kept runs without training.
    pub kept_only: bool,
    /// Train an adversary against each runner.
    pub adversary: bool,
    /// Number of fresh random courses.
    pub fresh: usize,
}

/// Trains and evaluates. `only` names tasks, grounds and sights; an empty list means all.
///
/// # Errors
/// If a name is unknown, or a run cannot be trained or read, or has another configuration.
pub fn run(options: &Options, only: [&[String]; 3], evaluations: Evaluations) -> Result<Record, StudyError> {
    let [tasks, grounds, sights] = only;
    let tasks = chosen("--tasks", tasks, &TASKS)?;
    let grounds = chosen("--grounds", grounds, &GROUNDS.map(|(name, _)| name))?;
    let sights = chosen("--sights", sights, &SIGHTS)?;
    interrupt::install("finishing this iteration; the same command continues")?;
    let keep = options.keep.clone().unwrap_or_else(|| PathBuf::from(KEEP));
    let (mut rows, mut bars) = (Vec::new(), Vec::new());
    for task in &tasks {
        for (ground, arguments) in GROUNDS.iter().filter(|(name, _)| grounds.contains(name)) {
            for sight in &sights {
                let heights = *sight == SIGHTS[0];
                let mut found = Vec::new();
                for seed in 1..=options.seeds {
                    let folder = keep.join(format!("{task}-{ground}-{sight}-{seed}"));
                    found.extend(one(task, arguments, heights, seed, &folder, options, evaluations)?);
                }
                if found.is_empty() {
                    continue;
                }
                let held_out = |f: &Found| f.courses[1..3].iter().map(|c| 0.5 * c.distance).sum();
                let name = format!("{}, {ground}{}", &task["Terrain".len()..], if heights { "" } else { ", blind" });
                bars.push((name, median(found.iter().map(held_out).collect()).unwrap_or(0.0)));
                rows.push(row(task, ground, heights, &found));
            }
        }
    }
    if rows.is_empty() {
        return Err(StudyError::file(&keep, "runs", "none of these", "what an earlier study has kept"));
    }
    let mut columns = vec!["figure", "learned on", "sees the ground", "seeds", "decisions", "processor seconds"];
    columns.extend(COURSES.iter().map(|(name, ..)| *name));
    columns.extend(["fresh courses", "worst tenth of them", "its own adversary"]);
    let list = |flag: &str, given: &[&str], all: usize| {
        if given.len() == all { String::new() } else { format!(" {flag} {}", given.join(",")) }
    };
    let mut words = list("--tasks", &tasks, TASKS.len()) + &list("--grounds", &grounds, GROUNDS.len());
    words.push_str(&list("--sights", &sights, SIGHTS.len()));
    if !evaluations.adversary {
        words.push_str(" --no-adversary");
    }
    if evaluations.fresh != FRESH {
        words.push_str(&format!(" --fresh {}", evaluations.fresh));
    }
    if evaluations.kept_only {
        words.push_str(" --kept-only");
    }
    Ok(Record {
        name: "assault-course",
        title: "Assault courses",
        about: about(),
        columns,
        rows,
        words,
        versions: Vec::new(),
        chart: Chart::Bars("mean way on the two courses made by hand, m, median of the seeds", bars),
    })
}

fn about() -> String {
    format!(
        "Figures learn to run by PPO with `terrain-fast.yaml` on ten kinds of [ground](../reference/environments/terrain.md):\n\n\
         * *flat*\n\
         * *random*: mixed courses of any difficulty\n\
         * *distance*: mixed courses that become harder after long runs\n\
         * *sfl*, *plr*, *accel*: courses of pieces that each agent chooses by learnability, by regret, or by learnability with edits\n\
         * *adversary*: built ahead by a second learner that earns what the runner loses\n\
         * *bounded*: the same with steps of at most half a meter\n\
         * *rising*: the same with steps whose bound rises with the runner's way, from level ground on\n\
         * *regret*: built by a learner that earns what a reference runner, a third learner, earns more on the same ground, with \
         as many decisions for each of the two\n\n\
         The policy's best actions are judged over {EPISODES} episodes on level ground, on the two courses made by hand at full size, on mixed \
         courses of full difficulty, and on the original's meters, of up to 0.5 m. No runner was trained on the courses \
         made by hand or on the meters. A cell is the mean way of an episode in m, and how many of {EPISODES} episodes ended with a \
         fall: medians over the seeds, and each seed's number in brackets if they differ. The picture has the mean of both \
         courses made by hand.\n\n\
         *Fresh courses* are random mixed courses of full difficulty, the same for all runners, each run six times. The first three \
         runs find the worst tenth of the courses for a runner, the others measure it on all courses and on these. A cell is the \
         mean way and the share of the runs that lasted to the end without a fall.\n\n\
         *Its own adversary* has learned against the finished runner for {} decisions, with steps of at most half \
         a meter, while the runner stayed as it was; some runs have not met one.",
        thousands(ADVERSARY_STEPS)
    )
}

/// The names of `all` that are in `asked`; all if `asked` is empty.
fn chosen(flag: &str, asked: &[String], all: &[&'static str]) -> Result<Vec<&'static str>, StudyError> {
    for name in asked {
        if !all.contains(&name.as_str()) {
            let (near, known) = (did_you_mean(nearest(name, all.iter().copied())), all.join(", "));
            return Err(StudyError::Usage(format!("{flag}: found '{name}', expected some of {known}{near}")));
        }
    }
    Ok(all.iter().copied().filter(|name| asked.is_empty() || asked.iter().any(|a| a == name)).collect())
}

/// Results of a run. `None` if it is not kept and `kept_only` forbids training.
fn one(
    task: &str,
    ground: &[(&str, &str)],
    heights: bool,
    seed: u64,
    folder: &Path,
    options: &Options,
    Evaluations { kept_only, adversary, fresh }: Evaluations,
) -> Result<Option<Found>, StudyError> {
    let sight = ("heights".into(), Value::Bool(heights));
    let with_sight = |list| TaskOptions { given: [arguments(list).given, vec![sight.clone()]].concat() };
    let mut loaded = default_for(task);
    if ground.contains(&REGRET) {
        loaded.config.run.total_steps *= 2;
    }
    let job = kept::Job { task: task.into(), arguments: with_sight(ground), seed, loaded, initialize_from: None };
    let (file, expected) = (kept::file(folder), job.expected(options)?);
    if let Some(found) = kept::read::<Found>(&file)? {
        kept::check(&file, &found.run, &expected)?;
        return Ok(Some(found));
    }
    if kept_only {
        return Ok(None);
    }
    job.train(folder, options)?;
    let mut found = judged(folder, options, fresh)?;
    if adversary && HAVE_ADVERSARIES.contains(&task) {
        found.adversary = meets_adversary(job, with_sight(&ADVERSARY), folder, options)?;
    }
    kept::write(&file, &found)?;
    Ok(Some(found))
}

/// Trains an adversary against the finished runner of a folder, and evaluates the runner on its ground.
fn meets_adversary(
    job: kept::Job,
    arguments: TaskOptions,
    folder: &Path,
    options: &Options,
) -> Result<Option<Judged>, StudyError> {
    let loaded = against(&job.task)?;
    let against = kept::Job { arguments, loaded, initialize_from: Some(folder.into()), ..job };
    let path = folder.join("adversary");
    let steps = options.steps.map_or(ADVERSARY_STEPS, |steps| steps.min(ADVERSARY_STEPS));
    against.train(&path, &Options { steps: Some(steps), ..options.clone() })?;
    let [course, _, difficulty] = ADVERSARY.map(|(_, value)| value);
    let (folder, _): (_, RunFile) = RunFolder::open(&path)?;
    Ok(kept::summary(&folder)?.eval.map(|met| Judged::of(course, difficulty, &met)))
}

/// Options of a task, from names and values.
fn arguments(list: &[(&str, &str)]) -> TaskOptions {
    let read = |text: &str| text.parse().unwrap_or_else(|never| match never {});
    TaskOptions { given: list.iter().map(|(name, value)| ((*name).into(), read(value))).collect() }
}

/// Evaluates the policy of a finished run on all courses, and on a number of fresh ones.
fn judged(path: &Path, options: &Options, fresh: usize) -> Result<Found, StudyError> {
    let (folder, run): (_, RunFile) = RunFolder::open(path)?;
    let judge = EvalOptions { episodes: EPISODES, threads: options.threads, ..EvalOptions::default() };
    let mut courses = Vec::new();
    for (_, course, difficulty) in COURSES {
        let task = arguments(&[("course", course), ("difficulty", difficulty), ("levels", "fixed")]);
        let (policy, factory) = PolicySource { policy: folder.policy(), agent: None, task }.load()?;
        let result = evaluate(&*factory, Isa::best(), &policy, &judge)?;
        courses.push(Judged::of(course, difficulty, &result));
    }
    let fresh = match fresh {
        0 => None,
        fresh => {
            let policy = Policy::load(&folder.policy())?;
            let task = TaskConfig { agent: run.agent.clone(), options: run.options.clone() };
            Some(fresh_courses::measure(&policy, &task, fresh, options.threads)?)
        }
    };
    let Summary { steps, cpu_seconds, .. } = kept::summary(&folder)?;
    Ok(Found { run, steps, cpu_seconds, courses, fresh, adversary: None })
}

/// A row of the table.
fn row(task: &str, ground: &str, heights: bool, found: &[Found]) -> Vec<String> {
    let of = |value: &dyn Fn(&Found) -> f64, text: &dyn Fn(f64) -> String| {
        let values: Vec<Option<f64>> = found.iter().map(|f| Some(value(f))).collect();
        cell(&values, text)
    };
    let whole = |x: f64| thousands(x.round() as u64);
    let mut out = vec![
        task["Terrain".len()..].to_string(),
        ground.into(),
        if heights { "yes" } else { "no" }.into(),
        found.len().to_string(),
        of(&|f| f.steps as f64, &whole),
        of(&|f| f.cpu_seconds, &whole),
    ];
    let judged = |on: &dyn Fn(&Found) -> Option<&Judged>| {
        let known: Vec<&Judged> = found.iter().filter_map(on).collect();
        let of = |value: &dyn Fn(&Judged) -> f64, text: &dyn Fn(f64) -> String| {
            cell(&known.iter().map(|judged| Some(value(judged))).collect::<Vec<_>>(), text)
        };
        let (way, falls) = (of(&|j| j.distance, &|x| format!("{x:.1}")), of(&|j| j.falls as f64, &whole));
        if known.is_empty() { "-".into() } else { format!("{way} m; {falls} fall") }
    };
    out.extend((0..COURSES.len()).map(|i| judged(&|f| f.courses.get(i))));
    let fresh = |of: &dyn Fn(&Fresh) -> Outcome| {
        let known: Vec<_> = found.iter().filter_map(|f| f.fresh.as_ref()).map(of).collect();
        let cell = |value: &dyn Fn(&Outcome) -> f64, text: &dyn Fn(f64) -> String| {
            cell(&known.iter().map(|result| Some(value(result))).collect::<Vec<_>>(), text)
        };
        let (way, finished) = (cell(&|r| r.distance, &|x| format!("{x:.1}")), cell(&|r| 100.0 * r.finished, &whole));
        if known.is_empty() { "-".into() } else { format!("{way} m; {finished} %") }
    };
    out.extend([fresh(&|f| f.all), fresh(&|f| f.worst)]);
    out.push(judged(&|f| f.adversary.as_ref()));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_envs::registry;

    #[test]
    fn grounds_and_courses_are_arguments_of_the_tasks() {
        let all = COURSES.map(|(_, course, difficulty)| vec![("course", course), ("difficulty", difficulty)]);
        let all = all.into_iter().chain(GROUNDS.map(|(_, list)| list.to_vec()));
        for list in all {
            for task in TASKS {
                let options = arguments(&list).given.into_iter().collect();
                registry::agent(task).unwrap().with_options(&options).unwrap();
            }
        }
    }

    #[test]
    fn unknown_names_are_refused() {
        assert_eq!(chosen("--tasks", &[], &TASKS).unwrap(), TASKS);
        assert_eq!(chosen("--tasks", &["TerrainHopper".into()], &TASKS).unwrap(), ["TerrainHopper"]);
        let error = chosen("--tasks", &["TerrainHoper".into()], &TASKS).unwrap_err().to_string();
        assert!(error.contains("did you mean 'TerrainHopper'?"), "{error}");
    }
}
