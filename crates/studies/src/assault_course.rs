//! Assault courses: characters learn on level, random, increasingly difficult and adversarial ground, with and without
//! seeing it. Their policies are evaluated on courses that are new to all of them.

use crate::args::Options;
use crate::error::StudyError;
use crate::kept;
use crate::record::Record;
use crate::statistics::{cell, median};
use crate::training::EPISODES;
use marathon_config::{against, default_for};
use marathon_envs::options::Value;
use marathon_learn::{EvalOptions, Evaluation, evaluate};
use marathon_physics::hint::{did_you_mean, nearest};
use marathon_physics::lanes::Isa;
use marathon_runs::report::chart::Chart;
use marathon_runs::terminal::interrupt;
use marathon_runs::text::thousands;
use marathon_runs::{PolicySource, RunFile, RunFolder, Summary, TaskOptions};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Default folder of the kept runs.
const KEEP: &str = "runs/assault-course";
/// The characters.
const TASKS: [&str; 2] = ["TerrainHopper", "TerrainWalker2d"];

/// Characters that see the ground, and characters that do not.
const SIGHTS: [&str; 2] = ["heights", "blind"];

/// Training ground: its name and its options.
type Ground = (&'static str, &'static [(&'static str, &'static str)]);

/// Training grounds.
const GROUNDS: [Ground; 7] = [
    ("flat", &[("course", "flat"), ("levels", "fixed")]),
    ("random", &[("course", "mixed"), ("levels", "random"), ("difficulty", "1")]),
    ("curriculum", &[("course", "mixed"), ("levels", "curriculum"), ("difficulty", "1")]),
    ("adversary", &[("course", "adversary"), ("levels", "fixed"), ("difficulty", "1")]),
    ("bounded", &[("course", "adversary"), ("levels", "fixed"), ("difficulty", "0.5")]),
    ("rising", &[("course", "adversary"), ("levels", "curriculum"), ("difficulty", "1")]),
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

/// Trains and evaluates. `only` names tasks, grounds and sights; an empty list means all. With `kept_only`, uses the
/// kept runs without training.
///
/// # Errors
/// If a name is unknown, or a run cannot be trained or read, or has another configuration.
pub fn run(options: &Options, only: [&[String]; 3], kept_only: bool) -> Result<Record, StudyError> {
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
                    found.extend(one(task, arguments, heights, seed, &folder, options, kept_only)?);
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
    columns.push("its own adversary");
    let list = |flag: &str, given: &[&str], all: usize| {
        if given.len() == all { String::new() } else { format!(" {flag} {}", given.join(",")) }
    };
    let mut words = list("--tasks", &tasks, TASKS.len()) + &list("--grounds", &grounds, GROUNDS.len());
    words.push_str(&list("--sights", &sights, SIGHTS.len()));
    if kept_only {
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
        "Figures learn to run by PPO with `terrain-fast.yaml` on seven kinds of [ground](../reference/environments/terrain.md): *flat*; *random*, \
         mixed courses of any difficulty; *curriculum*, mixed courses that become harder; *adversary*, built ahead by a second \
         learner that earns what the runner loses; *bounded*, the same with steps of at most half a meter; *rising*, the same \
         with steps whose bound rises with the runner's way, from level ground on; *regret*, built by one that earns what a reference \
         runner, a third learner, earns more on the same ground, with as many decisions for each of the two. Each learns with and without \
         seeing the ground ahead.\n\n\
         The policy's best actions are judged over {EPISODES} episodes on level ground, on the two courses made by hand at full size, on mixed \
         courses of full difficulty, and on the original's meters, of up to 0.5 m. No runner was trained on the courses \
         made by hand or on the meters. *Its own adversary* has learned against the finished runner for {} decisions, with steps of at most half \
         a meter, while the runner stayed as it was; some runs have not met one. A cell is the mean way of an episode in m, and how many of {EPISODES} episodes ended with a \
         fall: medians over the seeds, and each seed's number in brackets if they differ. The picture has the mean of both \
         courses made by hand.",
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
    kept_only: bool,
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
    let against = kept::Job {
        arguments: with_sight(&ADVERSARY),
        loaded: against(task)?,
        initialize_from: Some(folder.into()),
        ..job
    };
    let path = folder.join("adversary");
    let steps = options.steps.map_or(ADVERSARY_STEPS, |steps| steps.min(ADVERSARY_STEPS));
    against.train(&path, &Options { steps: Some(steps), ..options.clone() })?;
    let mut found = judged(folder, options)?;
    let [course, _, difficulty] = ADVERSARY.map(|(_, value)| value);
    let (folder, _): (_, RunFile) = RunFolder::open(&path)?;
    found.adversary = kept::summary(&folder)?.eval.map(|met| Judged::of(course, difficulty, &met));
    kept::write(&file, &found)?;
    Ok(Some(found))
}

/// Options of a task, from names and values.
fn arguments(list: &[(&str, &str)]) -> TaskOptions {
    let read = |text: &str| text.parse().unwrap_or_else(|never| match never {});
    TaskOptions { given: list.iter().map(|(name, value)| ((*name).into(), read(value))).collect() }
}

/// Evaluates the policy of a finished run on all courses.
fn judged(path: &Path, options: &Options) -> Result<Found, StudyError> {
    let (folder, run): (_, RunFile) = RunFolder::open(path)?;
    let judge = EvalOptions { episodes: EPISODES, threads: options.threads, ..EvalOptions::default() };
    let mut courses = Vec::new();
    for (_, course, difficulty) in COURSES {
        let task = arguments(&[("course", course), ("difficulty", difficulty), ("levels", "fixed")]);
        let (policy, factory) = PolicySource { policy: folder.policy(), agent: None, task }.load()?;
        let result = evaluate(&*factory, Isa::best(), &policy, &judge)?;
        courses.push(Judged::of(course, difficulty, &result));
    }
    let Summary { steps, cpu_seconds, .. } = kept::summary(&folder)?;
    Ok(Found { run, steps, cpu_seconds, courses, adversary: None })
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
