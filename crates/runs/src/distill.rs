//! One policy that does what several do: it plays, its teachers say what they would do where it gets to, and it learns that.
//!
//! Each teacher has agents of its own in the student's task. If the task takes a `clip` and a teacher follows one, the
//! teacher's agents follow that. Teachers may observe less than the student, never more: the named parts of a teacher's
//! observation are looked up in the student's.

use crate::error::RunError;
#[cfg(feature = "clap")]
use crate::options::parse_steps;
use crate::policy_file;
use crate::setting::{CLIP, Setting, TaskOptions};
use marathon_envs::options::Value;
use marathon_envs::{Step, VecEnv, VecEnvOptions, registry};
use marathon_learn::{Activation, BlockPolicy, Control, Distiller, Lessons, Policy, PolicyMeta};
use marathon_physics::lanes::Isa;
use std::path::PathBuf;

/// Decisions of each agent between two rounds of learning.
const HORIZON: usize = 32;
/// Rounds at the start in which the teachers play alone, and nobody learns: what they see makes the statistics.
const SHOWN: u64 = 4;
/// Share of the run after which the student plays alone.
const ALONE: f64 = 0.1;
/// Rounds whose lessons are kept.
const KEPT: usize = 16;
/// Rows of an update.
const ROWS: usize = 2048;
/// How often a row is learned from, on average.
const PASSES: usize = 4;

/// How to learn from others.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct DistillOptions {
    /// Widths of the policy's hidden layers.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = Self::default().hidden))]
    pub hidden: Vec<usize>,
    /// Policy to start from in place of random weights, with no wider layers: a file or the folder of a run.
    #[cfg_attr(feature = "clap", arg(long, value_name = "POLICY"))]
    pub initialize_from: Option<PathBuf>,
    /// Decisions of all agents together.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = Self::default().steps, value_parser = parse_steps))]
    pub steps: u64,
    /// Agents of each teacher.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = Self::default().agents))]
    pub agents: usize,
    /// Learning rate at the start; it falls to zero.
    #[cfg_attr(feature = "clap", arg(long, value_name = "RATE", default_value_t = Self::default().lr))]
    pub lr: f64,
    /// Seed of everything random.
    #[cfg_attr(feature = "clap", arg(long, value_name = "S", default_value_t = Self::default().seed))]
    pub seed: u64,
    /// Threads that play. The result does not depend on it.
    #[cfg_attr(feature = "clap", arg(long, value_name = "T", default_value_t = Self::default().threads))]
    pub threads: usize,
}

impl Default for DistillOptions {
    fn default() -> Self {
        Self {
            hidden: vec![256, 256],
            steps: 20_000_000,
            agents: 32,
            lr: 1e-3,
            seed: 1,
            threads: 1,
            initialize_from: None,
        }
    }
}

/// How far it is.
#[derive(Clone, Copy, Debug)]
pub struct Distilled {
    /// Decisions that have been made.
    pub steps: u64,
    /// Mean squared distance of an action's numbers from the teachers', in the last round.
    pub loss: f64,
    /// Share of the student's decisions that ended an episode by failure, in the last round.
    pub failures: f64,
}

/// A teacher with its agents.
struct Class {
    env: VecEnv,
    step: Step,
    teacher: Policy,
    /// Where the numbers that the teacher observes are in the student's observation.
    sees: Vec<usize>,
}

/// Learns from the policies in files; returns the student's. `watch` is told of each round and may end it all.
///
/// # Errors
/// If there is no teacher, a file is no policy, a teacher observes what the student does not, decides otherwise, or the task
/// cannot be made.
pub fn distill(
    task: Setting,
    teachers: &[PathBuf],
    options: &DistillOptions,
    watch: &mut dyn FnMut(&Distilled) -> Control,
) -> Result<Policy, RunError> {
    let teachers: Vec<(PathBuf, Policy)> = teachers
        .iter()
        .map(|path| Ok((path.clone(), policy_file::read(path, None)?)))
        .collect::<Result<_, RunError>>()?;
    if teachers.is_empty() {
        return Err(RunError::option("teacher", "is not given, expected at least one policy"));
    }
    let mut lessons_of = Vec::new();
    for (_, teacher) in &teachers {
        lessons_of.push(clips_of(&task, teacher)?);
    }
    // what the student is for: all that its teachers do
    let mut all: Vec<&str> = Vec::new();
    for clip in lessons_of.iter().flatten().flat_map(|clips| clips.split(',')) {
        // a teacher may be named twice, so that it counts for more
        if !all.contains(&clip) {
            all.push(clip);
        }
    }
    let whole = if all.is_empty() { task.clone() } else { follow(&task, &all.join(","))? };
    let spec = whole.factory()?.spec().clone();
    let mut classes = Vec::new();
    for (i, ((path, teacher), clips)) in teachers.into_iter().zip(&lessons_of).enumerate() {
        let own = clips.as_ref().map_or(Ok(task.clone()), |clips| follow(&task, clips))?;
        let seed = options.seed.wrapping_add(1_000_003 * (1 + i as u64));
        let make = VecEnvOptions { agents: options.agents, threads: options.threads, seed, ..Default::default() };
        let mut env = own.vec_env(&make)?;
        let sees = policy_file::seen_by(&teacher, &path, &spec)?;
        let mut step = env.buffers();
        env.reset(None, &mut step.obs)?;
        classes.push(Class { env, step, teacher, sees });
    }

    let mut meta = PolicyMeta::of(&spec, options.hidden.clone(), Activation::Tanh);
    (meta.options, meta.clips) = (spec.options.clone(), whole.clips.clone());
    let log_std = (0..spec.act).map(|i| mean(classes.iter().map(|class| class.teacher.log_std()[i]))).collect();
    let mut student = Distiller::new(meta, log_std, options.seed, Isa::best())?;
    if let Some(path) = &options.initialize_from {
        let known = policy_file::read(path, None)?;
        student.start_from(&known, &policy_file::seen_by(&known, path, &spec)?)?;
    }
    let round = (classes.len() * options.agents * HORIZON) as u64;
    let mut lessons = Lessons::new(KEPT * round as usize, spec.obs, spec.act);
    let total = options.steps.max(round);
    for number in 0.. {
        let done = number * round;
        if done >= total {
            break;
        }
        let progress = done as f64 / total as f64;
        let led = if number < SHOWN { 1.0 } else { (1.0 - progress / ALONE).max(0.0) };
        let policy = student.policy();
        let (mut failed, mut decided) = (0, 0);
        for class in &mut classes {
            let leads = (led * options.agents as f64).ceil() as usize;
            let [bad, all] = class.play(&policy, leads, &mut student, &mut lessons)?;
            (failed, decided) = (failed + bad, decided + all);
        }
        let mut loss = 0.0;
        if number < SHOWN {
            student.see(lessons.latest(round as usize));
        } else {
            let updates = (PASSES * round as usize).div_ceil(ROWS);
            let lr = options.lr * (1.0 - progress);
            for _ in 0..updates {
                loss += student.learn(&lessons, ROWS, lr) / updates as f64;
            }
        }
        let failures = failed as f64 / (decided as f64).max(1.0);
        if watch(&Distilled { steps: done + round, loss, failures }) == Control::Stop {
            break;
        }
    }
    Ok(student.policy())
}

impl Class {
    /// A round: the teacher moves the first agents, the student the others, and all that is seen is a lesson. Returns how often
    /// the student failed, and how often it decided.
    fn play(
        &mut self,
        student: &Policy,
        leads: usize,
        noise: &mut Distiller,
        lessons: &mut Lessons,
    ) -> Result<[usize; 2], RunError> {
        let Class { env, step, teacher, sees } = self;
        let (n, act, obs_len) = (env.agents(), teacher.meta().act, student.meta().obs);
        let (mut teacher, mut student) =
            (BlockPolicy::new(&*teacher, Isa::best()), BlockPolicy::new(student, Isa::best()));
        let (mut best, mut actions, mut drawn) = (vec![0.0; n * act], vec![0.0; n * act], vec![0.0; n * act]);
        let mut counts = [0; 2];
        for _ in 0..HORIZON {
            let rows = step.obs.chunks_exact(obs_len);
            let seen: Vec<f32> = rows.flat_map(|row| sees.iter().map(|i| row[*i])).collect();
            teacher.act_rows(&seen, None, &mut best);
            lessons.push(&step.obs, &best);
            noise.draw(&mut drawn);
            student.act_rows(&step.obs, Some(&drawn), &mut actions);
            // those who are shown the way need to see what is beside it, too
            let mut shown = vec![0.0; leads * act];
            teacher.act_rows(&seen[..leads * sees.len()], Some(&drawn[..leads * act]), &mut shown);
            actions[..leads * act].copy_from_slice(&shown);
            env.step(&actions, &mut step.as_mut())?;
            counts[0] += step.terminated[leads..].iter().filter(|ended| **ended).count();
            counts[1] += n - leads;
        }
        Ok(counts)
    }
}

/// The clips that a teacher follows, if the student's task takes some.
fn clips_of(task: &Setting, teacher: &Policy) -> Result<Option<String>, RunError> {
    if !registry::agent(&task.agent)?.has_option(CLIP) {
        return Ok(None);
    }
    let of_teacher = Setting::of(teacher.meta());
    if let Some(Value::Text(names)) = of_teacher.factory()?.spec().options.get(CLIP) {
        return Ok(Some(names.clone()));
    }
    let clips = registry::agent(&of_teacher.agent)?.facts().clips;
    let names: Vec<&str> = clips.iter().map(|clip| clip.about().name.as_str()).collect();
    Ok((!names.is_empty()).then(|| names.join(",")))
}

/// A task whose agents follow these clips.
fn follow(task: &Setting, clips: &str) -> Result<Setting, RunError> {
    task.clone().with(&TaskOptions { given: vec![(CLIP.into(), Value::Text(clips.into()))] })
}

fn mean(of: impl ExactSizeIterator<Item = f32>) -> f32 {
    let n = of.len() as f32;
    of.sum::<f32>() / n
}
