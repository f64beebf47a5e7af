//! The evaluation of a runner on obstacles of one kind and size: which stairs, gaps and boxes it passes, at which speed.

use crate::args::Options;
use crate::error::StudyError;
use crate::fresh_courses::{Outcome, load, rollout};
use crate::record::Record;
use crate::statistics::spread;
use marathon_envs::agents::marathon::terrain::course::{CELL, FROM, LEVEL_TO, POINTS};
use marathon_envs::options::Value;
use marathon_envs::{Autoreset, VecEnv, VecEnvOptions};
use marathon_learn::{BlockPolicy, Policy};
use marathon_physics::lanes::Isa;
use marathon_runs::TaskConfig;
use marathon_runs::report::chart::Chart;
use std::path::PathBuf;

/// Seed of the starts. No training has it.
const SEED: u64 = 1_000_037;
/// Runs over each kind of obstacle, and the length over which their first obstacles are spread, m. A fixed distance would suit one gait.
const RUNS: usize = 100;
const SPREAD: f64 = 2.0;
/// Commanded speeds, m/s. Tasks without a commanded speed have one row.
const SPEEDS: [f64; 3] = [1.0, 2.0, 3.0];

/// Kind of obstacle.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Flights of eight stairs, 0.3 m deep, up and down.
    Stairs,
    /// Gaps 0.6 m deep.
    Gaps,
    /// Boxes 1 m long.
    Boxes,
}

/// The obstacles: kind, unit of the size, and sizes, m.
const OBSTACLES: [(Kind, &str, &[f64]); 3] = [
    (Kind::Stairs, "high", &[0.1, 0.15, 0.2, 0.25]),
    (Kind::Gaps, "wide", &[0.3, 0.6, 0.9]),
    (Kind::Boxes, "high", &[0.2, 0.35, 0.5, 0.8]),
];

impl Kind {
    /// Heights along a course whose obstacles begin `shift` m later than usual.
    fn course(self, size: f64, shift: f64) -> Vec<f32> {
        // length and height of each piece of level ground in the order of the course
        let pieces = match self {
            Kind::Stairs => {
                let flights = (1..=8).chain((0..8).rev());
                let landing = |stair| if stair % 8 == 0 { 2.0 } else { 0.3 };
                flights.map(|stair| (landing(stair), size * f64::from(stair))).collect()
            }
            Kind::Gaps => vec![(size, -0.6), (3.0, 0.0)],
            Kind::Boxes => vec![(1.0, size), (3.0, 0.0)],
        };
        let level = |(length, height): (f64, f64)| vec![height as f32; (length / CELL).round() as usize];
        let mut points = level((LEVEL_TO + shift - FROM, 0.0));
        for piece in pieces.iter().cycle() {
            if points.len() >= POINTS {
                break;
            }
            points.extend(level(*piece));
        }
        points.truncate(POINTS);
        points
    }
}

/// Measures policies of files.
///
/// # Errors
/// If a policy cannot be read, or is not for a task on courses.
pub fn run(options: &Options, policies: &[PathBuf]) -> Result<Record, StudyError> {
    let (mut rows, mut bars, mut words) = (Vec::new(), Vec::new(), String::new());
    for path in policies {
        let (name, policy, task) = load(path)?;
        for (kind, unit, sizes) in OBSTACLES {
            for size in sizes {
                let obstacle = format!("{} {size} m {unit}", format!("{kind:?}").to_lowercase());
                for speed in SPEEDS {
                    let (commanded, of) = measure(&policy, &task, kind, *size, speed, options.threads)?;
                    let (way, _) = spread(of.iter().map(|o| o.distance));
                    let (passed, _) = spread(of.iter().map(|o| 100.0 * o.finished));
                    let speed = if commanded { format!("{speed}") } else { "its own".into() };
                    rows.push(vec![
                        name.clone(),
                        obstacle.clone(),
                        speed.clone(),
                        format!("{way:.1}"),
                        format!("{passed:.0}"),
                    ]);
                    bars.push((format!("{name}, {obstacle}, {speed}"), passed));
                    if !commanded {
                        break;
                    }
                }
            }
        }
        words.push_str(&format!(" {}", path.display()));
    }
    Ok(Record {
        name: "obstacles",
        title: "Obstacles",
        about: format!(
            "Policies run over courses with obstacles of one kind and size, {RUNS} times each: flights of eight stairs, 0.3 m deep, up \
             and down; gaps, 0.6 m deep; boxes, 1 m long. Between obstacles are 2 m (stairs) or 3 m of level ground. The speed is \
             commanded. A run is finished if it lasted to the time limit, or to the end of the course, without a fall and without \
             5 s of standing still."
        ),
        columns: vec!["policy", "obstacles", "speed, m/s", "way, m", "finished, %"],
        rows,
        words,
        versions: Vec::new(),
        chart: Chart::Bars("finished runs, %", bars),
    })
}

/// Runs a policy over obstacles. Also tells whether the speed was commanded. The environment is new, since the starts after a reset
/// depend on earlier commands.
fn measure(
    policy: &Policy,
    task: &TaskConfig,
    kind: Kind,
    size: f64,
    speed: f64,
    threads: usize,
) -> Result<(bool, Vec<Outcome>), StudyError> {
    let mut task = task.clone();
    for (name, value) in [("course", "flat".into()), ("levels", "fixed".into()), ("difficulty", Value::Number(0.0))] {
        task.options.set(name, value);
    }
    let made = VecEnvOptions { agents: RUNS, threads, autoreset: Autoreset::Disabled, ..Default::default() };
    let mut env: VecEnv = task.vec_env(&made)?;
    policy.check(env.spec())?;
    let commands = &env.spec().command;
    let command = commands
        .iter()
        .any(|range| range.name == "speed")
        .then(|| commands.iter().map(|range| if range.name == "speed" { speed } else { 0.0 }).collect::<Vec<f64>>());
    let mut out = env.buffers();
    env.reset(Some(SEED), &mut out.obs)?;
    let rows = env.ground(0, 0)?.len() / POINTS;
    let grounds: Vec<Vec<f32>> =
        (0..RUNS).map(|run| kind.course(size, SPREAD * run as f64 / RUNS as f64).repeat(rows)).collect();
    let mut policy = BlockPolicy::new(policy, Isa::best());
    let outcomes = rollout(&mut env, &mut policy, &grounds, command.as_deref(), SEED)?;
    Ok((command.is_some(), outcomes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn courses_have_obstacles_of_the_size_all_along() {
        for (kind, _, sizes) in OBSTACLES {
            for size in sizes {
                let course = kind.course(*size, 0.5);
                assert_eq!(course.len(), POINTS);
                let level = ((LEVEL_TO + 0.5 - FROM) / CELL).round() as usize;
                assert!(course[..level].iter().all(|z| *z == 0.0) && course[level] != 0.0, "{kind:?}");
                let steps = course.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
                let expected = if matches!(kind, Kind::Gaps) { 0.6 } else { *size as f32 };
                assert!((steps - expected).abs() < 1e-6, "{kind:?}: {steps}");
                assert!(course[POINTS - 100..].iter().any(|z| *z != 0.0), "{kind:?}");
            }
        }
    }
}
