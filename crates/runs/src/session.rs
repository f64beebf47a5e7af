//! A training run: begun or gone on with, carried out, written to its folder. The command and the Python package share it.

pub use crate::args::TrainArgs;
pub use crate::config::Loaded;
pub use crate::error::CliError;
pub use crate::folder::{RunFile, RunFolder};
pub use crate::policy_file::{read as read_policy, save as save_policy};
pub use crate::report::Watch;
pub use crate::report::csv::columns as metrics;
pub use crate::report::summary::Summary;
pub use crate::task::Task;

use crate::config;
use crate::folder::write_json;
use crate::processes::Processes;
use crate::report::csv::History;
use crate::report::summary::EPISODES;
use crate::report::{Reporter, curve, save};
use crate::text;
use marathon_envs::ShardFactory;
use marathon_learn::{
    Checkpoint, EvalOptions, Evaluation, IterationStats, Observer, Players, Policy, Snapshot, TrainOutput, evaluate,
    train_with,
};
use marathon_physics::lanes::Isa;
use std::path::Path;
use std::sync::Arc;

/// What the text of a configuration file says about a task; the path is for messages.
///
/// # Errors
/// If it is no configuration for the task; the text names the line and the key.
pub fn configuration(path: &Path, text: &[u8], task: &Task<'_>) -> Result<Loaded, CliError> {
    Ok(config::parse(path, text, task.id())?)
}

/// A run about to begin or to go on.
pub struct Session {
    /// What the run is.
    pub run: RunFile,
    /// Its folder; without one, nothing is written.
    pub folder: Option<RunFolder>,
    /// Its task.
    pub factory: Arc<dyn ShardFactory>,
    /// Where it goes on from.
    pub checkpoint: Option<Checkpoint>,
}

/// What a run has led to.
pub struct Outcome {
    /// The policy, which knows its evaluation.
    pub policy: Policy,
    /// Agent-steps done.
    pub steps: u64,
    /// How its best actions do; none if the run was stopped before its last step.
    pub evaluation: Option<Evaluation>,
    /// The run in numbers.
    pub summary: Summary,
    /// The folder, which stays locked as long as this lives.
    pub folder: Option<RunFolder>,
}

impl Session {
    /// The run that a command line asks for: with the configuration given, or the one of its file, or the agent's own fast
    /// one; with a folder of its own unless `dry`.
    ///
    /// # Errors
    /// If there is no such agent, its configuration is not usable, or the folder cannot be made.
    pub fn begin(args: &TrainArgs, loaded: Option<Loaded>, dry: bool) -> Result<(Self, Vec<String>), CliError> {
        // the command line requires it unless resuming
        Self::begin_with(Task::named(args.agent.as_deref().unwrap_or_default())?, args, loaded, dry)
    }

    /// The same for a given task.
    ///
    /// # Errors
    /// The same, or if the task cannot be made.
    pub fn begin_with(
        task: Task<'_>,
        args: &TrainArgs,
        loaded: Option<Loaded>,
        dry: bool,
    ) -> Result<(Self, Vec<String>), CliError> {
        let agent = task.id().to_string();
        let mut loaded = match (loaded, &args.config) {
            (Some(loaded), _) => loaded,
            (None, Some(path)) => config::load(path, &agent)?,
            (None, None) => match &args.algo {
                Some(name) => config::default_of(name),
                None => config::default_for(&agent),
            },
        };
        let ppo = &mut loaded.ppo;
        if let Some(agents) = args.agents {
            ppo.agents = agents;
            if let Some(buffer) = loaded.buffer {
                ppo.horizon = (buffer as usize).div_ceil(agents.max(1));
            }
        }
        ppo.total_steps = args.steps.unwrap_or(ppo.total_steps);
        ppo.seed = args.seed.unwrap_or(ppo.seed);
        ppo.threads = args.threads.unwrap_or(ppo.threads);
        ppo.validate()?;
        Processes::check(ppo, args.processes)?;
        let factory = task.factory(ppo.agents)?;
        loaded.summary_freq = loaded.summary_freq.max(1);
        loaded.checkpoint_interval = loaded.checkpoint_interval.max(1);
        let run = RunFile::new(&agent, &loaded);
        let mut folder = None;
        if !dry {
            let made = RunFolder::create(args.out.as_deref(), &agent)?;
            if let Err(error) = made.write_run(&run) {
                made.discard();
                return Err(error);
            }
            folder = Some(made);
        }
        Ok((Session { run, folder, factory, checkpoint: None }, loaded.notes))
    }

    /// The run in a folder, from its last checkpoint.
    ///
    /// # Errors
    /// If it is complete, or not the run that the command line means, or cannot be read.
    pub fn resume(args: &TrainArgs, path: &Path) -> Result<Self, CliError> {
        Self::resume_with(args.agent.as_deref().map(Task::named).transpose()?, args, path)
    }

    /// The same for a given task.
    ///
    /// # Errors
    /// The same, or if the task cannot be made.
    pub fn resume_with(task: Option<Task<'_>>, args: &TrainArgs, path: &Path) -> Result<Self, CliError> {
        let (folder, mut run) = RunFolder::open(path)?;
        let task = match task {
            Some(task) if task.id() != run.agent => {
                return Err(CliError::file(path, "agent", &run.agent, task.id()));
            }
            Some(task) => task,
            None => Task::named(&run.agent)?,
        };
        Processes::check(&run.config, args.processes)?;
        // a run that ended before its first checkpoint begins again, which gives the same bits
        let checkpoint = folder.last_checkpoint(&run)?;
        let done = checkpoint.as_ref().map_or(0, Checkpoint::steps);

        if let Some(steps) = args.steps {
            if steps < done {
                let done = text::thousands(done);
                return Err(CliError::Usage(format!(
                    "--steps is {}, but {done} steps are done",
                    text::thousands(steps)
                )));
            }
            run.config.total_steps = steps;
        }
        run.config.validate()?;
        if done >= run.config.total_steps && is_finished(&folder, done)? {
            let (done, more) = (text::thousands(done), text::thousands(done * 2));
            return Err(CliError::Usage(format!(
                "{}: the run is complete with {done} steps; to let it learn on, give it more, such as --steps {more}",
                path.display()
            )));
        }
        run.config.threads = args.threads.unwrap_or(run.config.threads);
        let factory = task.factory(run.config.agents)?;
        folder.write_run(&run)?;
        Ok(Session { folder: Some(folder), run, factory, checkpoint })
    }

    /// Agent-steps done before.
    pub fn steps(&self) -> u64 {
        self.checkpoint.as_ref().map_or(0, Checkpoint::steps)
    }

    /// Takes back a run that could not begin: nothing is left of its folder, unless there was a run before.
    pub fn abandon(self) {
        if let Some(folder) = self.folder {
            folder.discard();
        }
    }

    /// Trains to the last step, or until `watch` wants to stop, evaluates, and writes everything to the folder.
    /// `show`: with a bar or lines on stderr.
    ///
    /// # Errors
    /// If files cannot be written; the text says what is left and how to go on.
    pub fn carry_out(self, show: bool, watch: &mut Watch) -> Result<Outcome, CliError> {
        self.carry_out_with(None, show, watch)
    }

    /// The same with rollouts that `players` play.
    ///
    /// # Errors
    /// The same.
    pub fn carry_out_with(
        mut self,
        players: Option<&mut dyn Players>,
        show: bool,
        watch: &mut Watch,
    ) -> Result<Outcome, CliError> {
        let resume = self.checkpoint.take();
        let TrainOutput { mut policy, checkpoint, .. } = match self.learn(players, resume, show, watch) {
            Ok(output) => output,
            // it says how to go on
            Err(error @ CliError::Stopped { .. }) => return Err(error),
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
                // the run is not complete without its curve
                let _ = std::fs::remove_file(folder.curve());
            }
            drawn = result;
        }

        let steps = checkpoint.steps();
        let mut evaluation = None;
        if steps >= run.config.total_steps {
            let options = EvalOptions { episodes: EPISODES, threads: run.config.threads, ..Default::default() };
            let eval = evaluate(&*factory, Isa::best(), &policy, &options)?;
            policy.set_evaluation(eval);
            evaluation = Some(eval);
        }
        let path = folder.as_ref().map(|folder| folder.path().into()).unwrap_or_default();
        let summary = Summary::new(path, &checkpoint, &history, evaluation);
        if let Some(folder) = &folder {
            policy.save(&folder.policy())?;
            write_json(&folder.summary(), &summary)?;
        }
        drawn?;
        Ok(Outcome { policy, steps, evaluation, summary, folder })
    }

    /// Trains and saves what was learned.
    fn learn(
        &self,
        players: Option<&mut dyn Players>,
        resume: Option<Checkpoint>,
        show: bool,
        watch: &mut Watch,
    ) -> Result<TrainOutput, CliError> {
        let Session { run, factory, .. } = self;
        let train = |resume, observer: &mut dyn Observer| {
            train_with(players, &**factory, Isa::best(), &run.config, resume, observer)
        };
        let Some(folder) = &self.folder else {
            let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| watch(stats);
            return Ok(train(resume, &mut observer)?);
        };
        let terms = &factory.spec().reward_terms;
        let mut reporter = Reporter::new(folder, run, terms, resume.as_ref(), (show, watch))?;
        let result = train(resume, &mut reporter);
        reporter.finish();
        let (error, told) = (reporter.error.take(), reporter.told);
        let output = result?;
        let steps = output.checkpoint.steps();
        // what was learned is safe before anything else happens; an iteration that is not told of is to come again
        let saved = if told { save(folder, &output.policy, &output.checkpoint).map(|()| true) } else { Ok(false) };
        match (error, saved) {
            (Some(cause), saved) => Err(stopped(folder, cause, saved.unwrap_or(false), steps)),
            (None, Err(cause)) => Err(stopped(folder, cause, false, steps)),
            (None, Ok(_)) => Ok(output),
        }
    }
}

/// Whether a run has done the last thing that it does with so many steps: its summary has an evaluation, and its curve is
/// there.
fn is_finished(folder: &RunFolder, steps: u64) -> Result<bool, CliError> {
    let path = folder.summary();
    if !path.exists() || !folder.curve().exists() {
        return Ok(false);
    }
    let text = std::fs::read_to_string(&path).map_err(CliError::io(&path, "read"))?;
    Ok(serde_json::from_str::<Summary>(&text).is_ok_and(|s| s.eval.is_some() && s.steps == steps))
}

/// The error of a run whose files could no longer be written.
fn stopped(folder: &RunFolder, cause: CliError, saved: bool, steps: u64) -> CliError {
    let command = resume_command(folder.path());
    let advice = if saved {
        format!("training stopped; its {} steps are saved: mend that and go on by `{command}`", text::thousands(steps))
    } else {
        match Checkpoint::load(&folder.checkpoint()) {
            Ok(old) => format!(
                "training stopped; the last whole checkpoint has {} of {} steps: mend that and go on by `{command}`",
                text::thousands(old.steps()),
                text::thousands(steps)
            ),
            Err(_) => format!("training stopped before its first checkpoint: mend that and start again by `{command}`"),
        }
    };
    CliError::Stopped { cause: Box::new(cause), advice }
}

/// How to go on with a run.
pub fn resume_command(folder: &Path) -> String {
    format!("{} train --resume {}", text::program(), text::path_word(folder))
}
