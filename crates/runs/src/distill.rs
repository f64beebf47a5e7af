//! Distillation of several policies into one. The student plays, its teachers give their actions for its observations,
//! and it learns these.
//!
//! Each teacher has its own agents in the student's task. If the task takes a `clip` and a teacher follows one, the
//! teacher's agents follow that clip. Teachers may observe less than the student, but not more: each named part of a
//! teacher's observation is found in the student's.
//!
//! [`resumable`] saves its state regularly, so that it can resume with the same bits.

use crate::error::RunError;
#[cfg(feature = "clap")]
use crate::options::parse_steps;
use crate::policy_file;
use crate::task_config::{CLIP, TaskConfig};
use marathon_envs::options::OptionValue;
use marathon_envs::{Clips, NamedClip, Step, VecEnv, VecEnvOptions, registry};
use marathon_learn::{
    Activation, BlockPolicy, Control, Distiller, Error, Halfway, Lessons, Policy, PolicyMeta, can_be_had, checksum,
};
use marathon_physics::budget::AGENTS_MEMORY;
use marathon_physics::lanes::Isa;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Options of a task that say what an action means.
const OF_ACTIONS: [&str; 3] = ["control", "action_scale", "max_target"];
/// Decisions of each agent between two rounds of learning.
const HORIZON: usize = 32;
/// First rounds, in which the teachers play alone and the student does not learn. They provide the normalization
/// statistics.
const SHOWN: u64 = 4;
/// Fraction of the run after which the student plays alone.
const ALONE: f64 = 0.1;
/// Rounds whose data is kept.
const KEPT: usize = 16;
/// Rows per update.
const ROWS: usize = 2048;
/// Average number of updates per row.
const PASSES: usize = 4;
/// Time between two saves of the state.
const NOTED: Duration = Duration::from_secs(60);
/// Memory of environments and the rest, relative to the lessons. This is the largest ratio measured.
const REST: f64 = 1.0;

/// Options of a distillation.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct DistillOptions {
    /// Widths of the policy's hidden layers.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = Self::default().hidden))]
    pub hidden: Vec<usize>,
    /// Policy to start from instead of random weights: a file or the folder of a run. Its layers must not be wider.
    #[cfg_attr(feature = "clap", arg(long, value_name = "POLICY"))]
    pub initialize_from: Option<PathBuf>,
    /// Decisions of all agents in total.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = Self::default().steps, value_parser = parse_steps))]
    pub steps: u64,
    /// Agents per teacher.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = Self::default().agents))]
    pub agents: usize,
    /// Learning rate at the start; it falls to zero.
    #[cfg_attr(feature = "clap", arg(long, value_name = "RATE", default_value_t = Self::default().lr))]
    pub lr: f64,
    /// Seed of all random numbers.
    #[cfg_attr(feature = "clap", arg(long, value_name = "S", default_value_t = Self::default().seed))]
    pub seed: u64,
    /// Threads that simulate. The result does not depend on it.
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

/// Progress of a distillation.
#[derive(Clone, Copy, Debug)]
pub struct Distilled {
    /// Number of decisions.
    pub steps: u64,
    /// Mean squared distance of an action's numbers from the teachers', in the last round.
    pub loss: f64,
    /// Fraction of the student's decisions that ended an episode by failure, in the last round.
    pub failures: f64,
}

impl DistillOptions {
    /// Refuses invalid options.
    ///
    /// # Errors
    /// Names the option, its value and the valid values.
    pub fn validate(&self) -> Result<(), RunError> {
        let wrong = |name, found: String, expected: &str| {
            Err(RunError::option(name, format!("is {found}, expected {expected}")))
        };
        let lr = self.lr as f32;
        if !(lr.is_finite() && lr > 0.0) {
            return wrong("lr", self.lr.to_string(), "a positive number, such as 0.001");
        }
        if self.agents == 0 {
            return wrong("agents", "0".into(), "at least 1");
        }
        if self.steps == 0 {
            return wrong("steps", "0".into(), "at least 1");
        }
        if self.hidden.is_empty() || self.hidden.contains(&0) {
            return wrong("hidden", format!("{:?}", self.hidden), "positive widths, such as 256,256");
        }
        Ok(())
    }

    /// Refuses a student or data that do not fit into memory.
    fn check_memory(&self, teachers: usize, meta: &PolicyMeta) -> Result<(), RunError> {
        let refused = |name, problem: String| Err(RunError::option(name, problem));
        let student = Distiller::memory(meta);
        let rows = (KEPT * HORIZON) as f64 * teachers as f64 * self.agents as f64;
        let lessons = (1.0 + REST) * Lessons::memory(rows, meta.obs, meta.act);
        for (name, bytes) in [("hidden", student), ("agents", lessons)] {
            if let Err(error) = AGENTS_MEMORY.check(bytes) {
                return refused(name, error.to_string());
            }
        }
        match can_be_had((student + lessons) as u64) {
            true => Ok(()),
            false => {
                let (gigabytes, less) = ((student + lessons) / 1e9, "narrower layers or fewer teachers need less");
                let (n, hidden) = (self.agents, &self.hidden);
                let what = format!("is {n} and the hidden layers {hidden:?}: that needs about {gigabytes:.1} GB of");
                refused("agents", format!("{what} memory, more than is available; fewer agents, {less}"))
            }
        }
    }
}

/// A teacher with its agents.
struct Class {
    env: VecEnv,
    step: Step,
    teacher: Policy,
    /// Index of each number of the teacher's observation in the student's.
    sees: Vec<usize>,
}

/// Distills the policies in files and returns the student's. `watch` sees each round and may stop the distillation.
///
/// # Errors
/// If there is no teacher, an option is invalid, or a file is not a policy. If a teacher has observations that the
/// student lacks, or differs in actions or decision interval. If the task cannot be created, or the learning rate is so
/// large that numbers become infinite.
pub fn distill(
    task: TaskConfig,
    teachers: &[PathBuf],
    options: &DistillOptions,
    watch: &mut dyn FnMut(&Distilled) -> Control,
) -> Result<Policy, RunError> {
    resumable(task, teachers, options, None, watch)
}

/// Like [`distill`], with a file `notes` for the state. It is saved every minute and when `watch` ends the
/// distillation. If the file exists, the distillation resumes from it, with the same bits as without an interruption.
/// The caller removes the file after saving the policy.
///
/// # Errors
/// Like [`distill`], and if the file cannot be written, is damaged, or belongs to another distillation.
pub fn resumable(
    task: TaskConfig,
    teachers: &[PathBuf],
    options: &DistillOptions,
    notes: Option<&Path>,
    watch: &mut dyn FnMut(&Distilled) -> Control,
) -> Result<Policy, RunError> {
    options.validate()?;
    let mut school = School::open(task, teachers, options)?;
    let School { classes, student, lessons, about } = &mut school;
    let round = (classes.len() * options.agents * HORIZON) as u64;
    let total = options.steps.max(round);
    let mut first = 0;
    if let Some(path) = notes.filter(|path| path.exists()) {
        let halfway = student.resume(path, about, lessons)?;
        first = halfway.rounds;
        for (i, class) in classes.iter_mut().enumerate() {
            let saved = halfway.classes.get(i).filter(|(_, obs)| obs.len() == class.step.obs.len());
            let Some((snapshot, obs)) = saved else {
                return Err(RunError::file(path, "classes", halfway.classes.len(), "one for each teacher"));
            };
            class.env.load(snapshot)?;
            class.step.obs.copy_from_slice(obs);
        }
    }
    let mut noted = Instant::now();
    for number in first.. {
        let done = number * round;
        if done >= total {
            break;
        }
        let progress = done as f64 / total as f64;
        let led = if number < SHOWN { 1.0 } else { (1.0 - progress / ALONE).max(0.0) };
        let policy = student.policy();
        let (mut failed, mut decided) = (0, 0);
        for class in classes.iter_mut() {
            let leads = (led * options.agents as f64).ceil() as usize;
            let [bad, all] = class.play(&policy, leads, student, lessons)?;
            (failed, decided) = (failed + bad, decided + all);
        }
        let mut loss = 0.0;
        if number < SHOWN {
            student.see(lessons.latest(round as usize));
        } else {
            let updates = (PASSES * round as usize).div_ceil(ROWS);
            let lr = options.lr * (1.0 - progress);
            for _ in 0..updates {
                loss += student.learn(lessons, ROWS, lr) / updates as f64;
            }
            if !loss.is_finite() || student.lost() > 0 {
                let found = format!("is {}, with which numbers do not stay finite", options.lr);
                return Err(RunError::option("lr", format!("{found}; expected a smaller one, such as 0.001")));
            }
        }
        let failures = failed as f64 / (decided as f64).max(1.0);
        let stop = watch(&Distilled { steps: done + round, loss, failures }) == Control::Stop;
        if let Some(path) = notes.filter(|_| stop || noted.elapsed() >= NOTED) {
            let of_class = |class: &Class| (class.env.save(), class.step.obs.clone());
            let classes = classes.iter().map(of_class).collect();
            student.save(path, &Halfway { rounds: number + 1, about: about.clone(), classes }, lessons)?;
            noted = Instant::now();
        }
        if stop {
            break;
        }
    }
    Ok(student.policy())
}

/// Teachers and student at the start.
struct School {
    classes: Vec<Class>,
    student: Distiller,
    lessons: Lessons,
    /// Everything that affects the result, by name.
    about: BTreeMap<String, String>,
}

impl School {
    fn open(task: TaskConfig, paths: &[PathBuf], options: &DistillOptions) -> Result<Self, RunError> {
        let teachers: Vec<(&PathBuf, Policy)> =
            paths.iter().map(|path| Ok((path, policy_file::read(path, None)?))).collect::<Result<_, RunError>>()?;
        if teachers.is_empty() {
            return Err(RunError::option("teacher", "is not given, expected at least one policy"));
        }
        let task = acting_alike(task, &teachers)?;
        let mut lessons_of = Vec::new();
        for (_, teacher) in &teachers {
            lessons_of.push(clips_of(&task, teacher)?);
        }
        // the student's task: all clips of its teachers
        let whole = together(&lessons_of).map_or(task.clone(), |clips| follow(&task, clips));
        let spec = whole.factory()?.spec().clone();
        let mut meta = PolicyMeta::of(&spec, options.hidden.clone(), Activation::Tanh);
        meta.options = spec.options.clone();
        options.check_memory(teachers.len(), &meta)?;
        let known = options.initialize_from.as_ref().map(|path| policy_file::read(path, None)).transpose()?;
        let about = about(&whole, &teachers, known.as_ref(), options);

        let mut classes = Vec::new();
        for (i, ((path, teacher), clips)) in teachers.into_iter().zip(lessons_of).enumerate() {
            let own = clips.map_or(task.clone(), |clips| follow(&task, clips));
            let seed = options.seed.wrapping_add(1_000_003 * (1 + i as u64));
            let make = VecEnvOptions { agents: options.agents, threads: options.threads, seed, ..Default::default() };
            let mut env = own.vec_env(&make)?;
            let sees = policy_file::seen_by(&teacher, path, &spec)?;
            let mut step = env.buffers();
            env.reset(None, &mut step.obs)?;
            classes.push(Class { env, step, teacher, sees });
        }
        let log_std = (0..spec.act).map(|i| mean(classes.iter().map(|class| class.teacher.log_std()[i]))).collect();
        let mut student = Distiller::new(meta, log_std, options.seed, Isa::best()).map_err(|error| match error {
            Error::Mismatch { found, expected, .. } => {
                RunError::option("hidden", format!("makes a network of {found}, expected {expected}"))
            }
            other => other.into(),
        })?;
        if let Some((known, path)) = known.zip(options.initialize_from.as_ref()) {
            student.start_from(&known, &policy_file::seen_by(&known, path, &spec)?)?;
        }
        let rows = KEPT * classes.len() * options.agents * HORIZON;
        Ok(School { classes, student, lessons: Lessons::new(rows, spec.obs, spec.act), about })
    }
}

/// Everything that affects the result of a distillation, by name.
fn about(
    task: &TaskConfig,
    teachers: &[(&PathBuf, Policy)],
    known: Option<&Policy>,
    options: &DistillOptions,
) -> BTreeMap<String, String> {
    let sum = |policy: &Policy| checksum(&policy.to_bytes());
    let DistillOptions { hidden, steps, agents, lr, seed, .. } = options;
    let mut about: BTreeMap<String, String> = [
        ("task", checksum(serde_json::to_string(task).unwrap_or_default().as_bytes())),
        ("initialize_from", known.map(sum).unwrap_or_default()),
        ("hidden", format!("{hidden:?}")),
        ("steps", steps.to_string()),
        ("agents", agents.to_string()),
        ("lr", lr.to_string()),
        ("seed", seed.to_string()),
        ("teachers", teachers.len().to_string()),
    ]
    .map(|(name, value)| (name.to_string(), value))
    .into();
    about.extend(teachers.iter().enumerate().map(|(i, (_, teacher))| (format!("teacher {}", i + 1), sum(teacher))));
    about
}

impl Class {
    /// Plays a round: the teacher controls the first agents, the student the others, and all observations become
    /// training data. Returns the number of the student's failures and decisions.
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
            // noise on the teacher's actions also shows the states next to its own
            let mut shown = vec![0.0; leads * act];
            teacher.act_rows(&seen[..leads * sees.len()], Some(&drawn[..leads * act]), &mut shown);
            actions[..leads * act].copy_from_slice(&shown);
            env.step(&actions, &mut *step)?;
            counts[0] += step.terminated[leads..].iter().filter(|ended| **ended).count();
            counts[1] += n - leads;
        }
        Ok(counts)
    }
}

/// The task with the meaning of an action that it has for the teachers, unless the caller has set it. A teacher's actions are right
/// with that meaning only.
fn acting_alike(mut task: TaskConfig, teachers: &[(&PathBuf, Policy)]) -> Result<TaskConfig, RunError> {
    let agent = registry::agent(&task.agent)?;
    for name in OF_ACTIONS.into_iter().filter(|name| agent.has_option(name)) {
        let known = teachers.iter().filter_map(|(path, teacher)| Some((path, teacher.meta().options.get(name)?)));
        let mut known = known.filter(|_| task.options.get(name).is_none());
        let Some((path, value)) = known.next() else { continue };
        if let Some((other, found)) = known.find(|(_, found)| *found != value) {
            let (path, other) = (path.display(), other.display());
            let problem = format!(
                "{path} has {name}={value} and {other} {name}={found}, expected teachers whose actions mean the same"
            );
            return Err(RunError::option("teacher", problem));
        }
        let value = value.clone();
        task.options.set(name, value);
    }
    Ok(task)
}

/// The clips that a teacher follows, if the student's task takes clips.
fn clips_of(task: &TaskConfig, teacher: &Policy) -> Result<Option<Clips>, RunError> {
    if !registry::agent(&task.agent)?.has_option(CLIP) {
        return Ok(None);
    }
    let of_teacher = TaskConfig::of_policy(teacher.meta());
    if let Some(clips) = of_teacher.factory()?.spec().options.get(CLIP).and_then(Clips::read) {
        return Ok(Some(clips));
    }
    let clips = registry::agent(&of_teacher.agent)?.facts().clips;
    let clips: Clips = clips.iter().map(|clip| NamedClip::shipped(&clip.about().name)).collect();
    Ok(clips.iter().next().is_some().then_some(clips))
}

/// The clips of all teachers, each once: a teacher may be listed twice to give it more weight.
fn together(lessons: &[Option<Clips>]) -> Option<Clips> {
    let mut all: Vec<&NamedClip> = Vec::new();
    for clip in lessons.iter().flatten().flat_map(Clips::iter) {
        if !all.contains(&clip) {
            all.push(clip);
        }
    }
    (!all.is_empty()).then(|| all.into_iter().cloned().collect())
}

/// The task with agents that follow these clips.
fn follow(task: &TaskConfig, clips: Clips) -> TaskConfig {
    let mut task = task.clone();
    task.options.set(CLIP, clips);
    task
}

fn mean(of: impl ExactSizeIterator<Item = f32>) -> f32 {
    let n = of.len() as f32;
    of.sum::<f32>() / n
}
