//! A training run: started or resumed, executed, and written to its folder.

use crate::configuration;
use crate::demonstrations::with_demonstrations;
use crate::error::RunError;
use crate::folder::{RunFolder, write_json};
use crate::imitation;
use crate::inputs;
use crate::options::RunOptions;
use crate::policy_file;
use crate::processes::Processes;
use crate::report::csv::History;
use crate::report::summary::{EPISODES, Summary};
use crate::report::{Reporter, Watch, curve, save, save_policies};
use crate::run_file::RunFile;
use crate::task::Task;
use crate::task_config::{TaskConfig, TaskOptions};
use crate::text::{counted, thousands, whole};
use marathon_config::Loaded;
use marathon_envs::ShardFactory;
use marathon_learn::{
    Checkpoint, EvalOptions, Evaluation, IterationStats, Observer, Players, Policy, Progress, Schedule, Snapshot,
    TrainConfig, TrainOutput, check_demonstrations, evaluate_roles, initialized, train_with,
};
use marathon_physics::budget;
use marathon_physics::lanes::Isa;
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;

/// A run before it starts or resumes.
pub struct Session {
    /// Description of the run.
    pub run: RunFile,
    /// Its folder. Without one, nothing is written.
    pub folder: Option<RunFolder>,
    /// Its task.
    pub factory: Arc<dyn ShardFactory>,
    /// Recreates the task, if it is registered.
    pub task_config: TaskConfig,
    /// The checkpoint that it resumes from.
    pub checkpoint: Option<Checkpoint>,
}

/// Results of a run.
pub struct Outcome {
    /// The policy with its evaluation. With several roles, the first one's.
    pub policy: Policy,
    /// The other roles' policies, by the roles' names.
    pub others: Vec<(String, Policy)>,
    /// Agent-steps done.
    pub steps: u64,
    /// Evaluation of its best actions. `None` if the run was stopped before its last step.
    pub evaluation: Option<Evaluation>,
    /// Summary of the run.
    pub summary: Summary,
    /// The folder, which stays locked as long as this value lives.
    pub folder: Option<RunFolder>,
}

/// The start of a new run that starts from a policy.
fn start_from(run: &RunFile, factory: &dyn ShardFactory) -> Result<Option<Checkpoint>, RunError> {
    let Some(path) = &run.initialize_from else { return Ok(None) };
    let policy = policy_file::read(path, None)?;
    // with several roles, the first one starts from the policy
    let spec = factory.spec();
    let [role, ..] = &spec.deciders()[..] else { return Ok(None) };
    let sees = policy_file::seen_by(&policy, path, &spec.of_role(role))?;
    Ok(Some(initialized(factory, Isa::best(), &run.config, &policy, &sees)?))
}

impl Session {
    /// Starts a new run, or resumes the run in the folder that `resume` names from its last checkpoint. A new run uses
    /// the configuration `loaded`, the one in the options' file, or the task's preset. It has its own folder
    /// unless `dry`. A resumed run has its task and arguments from `run.json`; pass the task only if a front end
    /// created it. Also returns notes on the configuration for the user.
    ///
    /// # Errors
    /// If the options or the configuration are invalid, the task or the folder cannot be created, or there is no such
    /// run, or the run has another task, is complete or is damaged.
    pub fn open(
        task: Option<Task<'_>>,
        options: &RunOptions,
        loaded: Option<Loaded>,
        dry: bool,
    ) -> Result<(Self, Vec<String>), RunError> {
        options.validate()?;
        match (&options.resume, task) {
            (Some(_), _) if loaded.is_some() => Err(RunError::NewRunOnly { name: "config" }),
            (Some(path), task) => Self::resume(task, options, path),
            (None, Some(task)) => Self::begin(task, options, loaded, dry),
            (None, None) => Err(RunError::option("task", "is missing, expected a task or a run to resume")),
        }
    }

    fn begin(
        task: Task<'_>,
        options: &RunOptions,
        loaded: Option<Loaded>,
        dry: bool,
    ) -> Result<(Self, Vec<String>), RunError> {
        let learn = &options.learn;
        let agent = task.id().to_string();
        let mut loaded = match loaded {
            Some(loaded) => configuration::with(loaded, &learn.set)?,
            None => configuration::of(&agent, learn.config.as_deref(), learn.algo.as_deref(), &learn.set)?,
        };
        let run = &mut loaded.config.run;
        if let Some(agents) = options.agents {
            run.agents = agents;
            if let Some(buffer) = loaded.buffer {
                run.horizon = (buffer as usize).div_ceil(agents.max(1));
            }
        }
        run.total_steps = learn.steps.unwrap_or(run.total_steps);
        run.seed = learn.seed.unwrap_or(run.seed);
        run.threads = learn.threads.unwrap_or(run.threads);
        loaded.config.validate()?;
        Processes::check(&loaded.config, options.processes)?;
        // the user's options come later and have precedence
        let given = loaded.options.iter().chain(&options.task.given).cloned().collect();
        let (factory, task_config) = task.with(&TaskOptions { given })?.factory(loaded.config.run.agents)?;
        loaded.config.check_roles(factory.spec())?;
        inputs::name_wholly(&mut loaded.config);
        let factory = with_demonstrations(factory, &loaded.config)?;
        check_demonstrations(&loaded.config, &*factory)?;
        loaded.summary_freq = loaded.summary_freq.max(1);
        loaded.checkpoint_interval = loaded.checkpoint_interval.max(1);
        let mut run = RunFile::new(&task_config, &loaded);
        run.files = inputs::of(&task_config, &run.config)?;
        run.initialize_from = options.initialize_from.as_deref().map(whole);
        run.initialize_from_checksum = run.initialize_from.as_deref().map(inputs::of_start).transpose()?;
        let checkpoint = start_from(&run, &*factory)?;
        let mut folder = None;
        if !dry {
            let made = RunFolder::create(options.out.as_deref(), &agent)?;
            if let Err(error) = made.begin(&run) {
                made.discard();
                return Err(error);
            }
            folder = Some(made);
        }
        Ok((Session { run, folder, factory, task_config, checkpoint }, loaded.notes))
    }

    fn resume(task: Option<Task<'_>>, options: &RunOptions, path: &Path) -> Result<(Self, Vec<String>), RunError> {
        let learn = &options.learn;
        let (folder, mut run) = RunFolder::open(path)?;
        let task = match task {
            Some(task) if task.id() != run.agent => {
                return Err(RunError::file(path, "agent", &run.agent, task.id()));
            }
            Some(task) if task.is_made() => task,
            _ => Task::set(folder.task_config(&run)?),
        };
        inputs::check(&run.files)?;
        Processes::check(&run.config, options.processes)?;
        // a run that ended before its first checkpoint starts again, which gives the same bits
        let checkpoint = folder.last_checkpoint(&run)?;
        if let (None, Some(policy), Some(sum)) = (&checkpoint, &run.initialize_from, &run.initialize_from_checksum) {
            inputs::check_start(policy, sum)?;
        }
        let done = checkpoint.as_ref().map_or(0, Checkpoint::steps);

        let mut notes = Vec::new();
        if let Some(steps) = learn.steps {
            if steps < done {
                let problem = format!("is {}, but {} steps are done", thousands(steps), thousands(done));
                return Err(RunError::option("steps", problem));
            }
            notes.extend(stretched(&run.config, done, steps));
            run.config.run.total_steps = steps;
        }
        run.config.validate()?;
        if done >= run.config.run.total_steps && is_finished(&folder, done)? {
            return Err(RunError::Complete { folder: path.into(), steps: done });
        }
        run.config.run.threads = learn.threads.unwrap_or(run.config.run.threads);
        let (factory, task_config) = task.factory(run.config.run.agents)?;
        let factory = with_demonstrations(factory, &run.config)?;
        folder.write_run(&run)?;
        let checkpoint = checkpoint.map_or_else(|| start_from(&run, &*factory), |last| Ok(Some(last)))?;
        Ok((Session { folder: Some(folder), run, factory, task_config, checkpoint }, notes))
    }

    /// Number of agent-steps done before.
    pub fn steps(&self) -> u64 {
        self.checkpoint.as_ref().map_or(0, Checkpoint::steps)
    }

    /// Lines that say what will be trained, for the user.
    pub fn announcement(&self) -> Vec<String> {
        let (run, done) = (&self.run, self.steps());
        let config = &run.config;
        let (verb, from) = match done {
            0 => ("training", String::new()),
            _ => ("going on with", format!(" from step {}", thousands(done))),
        };
        let findings = self.task_config.findings().unwrap_or_default();
        let mut lines: Vec<String> = findings.lines().map(String::from).collect();
        lines.push(format!(
            "{verb} {}{from} to {}: {}, {}, {}, seed {}; results in {}",
            run.agent,
            thousands(config.run.total_steps),
            counted(config.run.agents, "agent"),
            counted(config.run.worker_count(), "thread"),
            Isa::best().name(),
            config.run.seed,
            self.folder.as_ref().map(|folder| folder.path().display().to_string()).unwrap_or_default()
        ));
        lines
    }

    /// Removes the folder of a run that could not start, unless there was a run before.
    pub fn abandon(self) {
        if let Some(folder) = self.folder {
            folder.discard();
        }
    }

    /// Trains to the last step or until `watch` stops the run, evaluates, and writes everything to the folder. `show`:
    /// show a bar or lines on stderr.
    ///
    /// # Errors
    /// If files cannot be written. The text says what is left and how to continue.
    pub fn carry_out(self, show: bool, watch: &mut Watch) -> Result<Outcome, RunError> {
        self.carry_out_with(None, show, watch)
    }

    /// Like [`Session::carry_out`], with rollouts that `players` play.
    ///
    /// # Errors
    /// Like [`Session::carry_out`].
    pub fn carry_out_with(
        mut self,
        players: Option<&mut dyn Players>,
        show: bool,
        watch: &mut Watch,
    ) -> Result<Outcome, RunError> {
        let resume = self.checkpoint.take();
        let TrainOutput { mut policy, mut others, checkpoint, .. } = match self.learn(players, resume, show, watch) {
            Ok(output) => output,
            // this error says how to continue
            Err(error @ RunError::Stopped { .. }) => return Err(error),
            Err(error) => {
                self.abandon();
                return Err(error);
            }
        };
        let Session { run, folder, factory, .. } = self;
        let mut history = History::default();
        let mut drawn = Ok(());
        if let Some(folder) = &folder {
            let result = History::read(&folder.progress()).and_then(|read| {
                history = read;
                curve::draw(folder, &run, &history)
            });
            if result.is_err() {
                // a run without its curve counts as incomplete
                let _ = std::fs::remove_file(folder.curve());
            }
            drawn = result;
        }

        let steps = checkpoint.steps();
        let (mut evaluation, mut imitation) = (None, Vec::new());
        if steps >= run.config.run.total_steps {
            let options = EvalOptions { episodes: EPISODES, threads: run.config.run.threads, ..Default::default() };
            let all: Vec<&Policy> = [&policy].into_iter().chain(others.iter().map(|(_, policy)| policy)).collect();
            let evaluations = evaluate_roles(&*factory, Isa::best(), &all, &options)?;
            let policies = [&mut policy].into_iter().chain(others.iter_mut().map(|(_, policy)| policy));
            policies.zip(&evaluations).for_each(|(policy, evaluation)| policy.set_evaluation(evaluation.clone()));
            evaluation = evaluations.into_iter().next();
            imitation = imitation::measure(&policy, &options)?;
        }
        let path = folder.as_ref().map(|folder| folder.path().into()).unwrap_or_default();
        let mut summary = Summary::new(path, &checkpoint, &history, evaluation.clone());
        summary.options = run.options.clone();
        summary.imitation = imitation;
        if let Some(folder) = &folder {
            save_policies(folder, &policy, &others)?;
            write_json(&folder.summary(), &summary)?;
        }
        drawn?;
        Ok(Outcome { policy, others, steps, evaluation, summary, folder })
    }

    /// Trains and saves the results.
    fn learn(
        &self,
        players: Option<&mut dyn Players>,
        resume: Option<Checkpoint>,
        show: bool,
        watch: &mut Watch,
    ) -> Result<TrainOutput, RunError> {
        let Session { run, factory, .. } = self;
        let train = |resume, observer: &mut dyn Observer| {
            train_with(players, &**factory, Isa::best(), &run.config, resume, observer)
        };
        let Some(folder) = &self.folder else {
            let (total, done) = (run.config.run.total_steps, resume.as_ref().map_or(0, Checkpoint::steps));
            let mut shown = show.then(|| crate::report::Progress::new(total, done, run.summary_freq));
            let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
                if let Some(shown) = &mut shown {
                    shown.update(stats);
                }
                watch(stats)
            };
            let output = train(resume, &mut observer);
            if let Some(shown) = &shown {
                shown.finish();
            }
            return Ok(output?);
        };
        let terms = &factory.spec().reward_terms;
        let mut reporter = Reporter::new(folder, run, terms, resume.as_ref(), (show, watch))?;
        let result = train(resume, &mut reporter);
        reporter.finish();
        let (error, told) = (reporter.error.take(), reporter.told);
        let output = result?;
        let steps = output.checkpoint.steps();
        // save the results first; an iteration that was not reported is repeated on resume
        let saved = if told { save(folder, &output).map(|()| true) } else { Ok(false) };
        match (error, saved) {
            (Some(cause), saved) => Err(stopped(folder, cause, saved.unwrap_or(false), steps)),
            (None, Err(cause)) => Err(stopped(folder, cause, false, steps)),
            (None, Ok(_)) => Ok(output),
        }
    }
}

/// Whether a run has completed its last action for this number of steps: its summary has an evaluation, and its curve
/// exists.
fn is_finished(folder: &RunFolder, steps: u64) -> Result<bool, RunError> {
    let path = folder.summary();
    if !path.exists() || !folder.curve().exists() {
        return Ok(false);
    }
    let text = budget::read_to_string(&path, &budget::CONFIG_FILE).map_err(RunError::io(&path, "read"))?;
    Ok(serde_json::from_str::<Summary>(&text).is_ok_and(|s| s.eval.is_some() && s.steps == steps))
}

/// The error of a run whose files could no longer be written.
fn stopped(folder: &RunFolder, cause: RunError, saved: bool, steps: u64) -> RunError {
    let saved = match saved {
        true => Some(steps),
        false => Checkpoint::load(&folder.checkpoint()).ok().map(|old| old.steps()),
    };
    RunError::Stopped { cause: Box::new(cause), folder: folder.path().into(), steps, saved }
}

/// Schedules that jump when a run that has made some of its steps gets another length: they span the whole run.
fn stretched(config: &TrainConfig, done: u64, steps: u64) -> Option<String> {
    let mut moves = Vec::new();
    let progress = |total_steps| Progress { iteration: 0, steps: done, total_steps };
    let [before, after] = [config.run.total_steps, steps].map(progress);
    let value = serde_json::to_value(config).unwrap_or_default();
    walk(&value, "", &mut |key, schedule| {
        let (was, is) = (before.at(schedule), after.at(schedule));
        if (was - is).abs() > 1e-3 * was.abs() {
            moves.push(format!("{key} from {} to {}", rounded(was), rounded(is)));
        }
    });
    (!moves.is_empty()).then(|| {
        let list = moves.join(", ");
        format!("the schedules span the new length, so they change now: {list}; the return may drop at first")
    })
}

fn rounded(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

/// Calls `each` with the key and value of every schedule in a configuration.
fn walk(value: &Value, key: &str, each: &mut impl FnMut(&str, Schedule)) {
    let Value::Object(map) = value else { return };
    if let (2, Some(from), Some(to)) =
        (map.len(), map.get("from").and_then(Value::as_f64), map.get("to").and_then(Value::as_f64))
    {
        return each(key, Schedule { from, to });
    }
    for (name, inner) in map {
        walk(inner, &if key.is_empty() { name.clone() } else { format!("{key}.{name}") }, each);
    }
}
