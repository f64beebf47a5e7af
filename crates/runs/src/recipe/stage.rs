//! Carries out one stage: the runs of its seeds, and the choice between them.

use super::front::Front;
use super::plan::{Job, Plan, Step};
use super::state::{self, Done, POLICY, StageFile};
use super::until::Until;
use crate::average::average;
use crate::distill::{DistillOptions, Distilled, resumable};
use crate::error::RunError;
use crate::measure::measure;
use crate::options::{LearnOptions, RunOptions};
use crate::policy_file;
use crate::report::progress::Rounds;
use crate::report::summary::Summary;
use crate::report::{kept_policies, kept_policy};
use crate::session::Session;
use crate::task::Task;
use crate::task_config::TaskOptions;
use crate::text::thousands;
use cpu_time::ProcessTime;
use marathon_config::Loaded;
use marathon_config::recipe::{Criterion, Pick, Stage, StageKind};
use marathon_learn::{Control, EvalOptions, IterationStats, write_atomic};
use marathon_physics::budget;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A run of a stage that is complete.
struct Made {
    steps: u64,
    cpu_seconds: f64,
}

/// A stage that is carried out.
pub struct Work<'a> {
    plan: &'a Plan,
    index: usize,
    done: &'a [Option<Done>],
    about: &'a StageFile,
    /// Whether the stage has begun before.
    begun: bool,
}

impl<'a> Work<'a> {
    /// A stage, with the results of earlier ones and its description.
    pub fn new(plan: &'a Plan, index: usize, done: &'a [Option<Done>], about: &'a StageFile, begun: bool) -> Self {
        Work { plan, index, done, about, begun }
    }

    fn stage(&self) -> (&'a Stage, &'a Step) {
        self.plan.stage(self.index)
    }

    /// Carries the stage out and writes its result. `None` if the user has stopped it.
    ///
    /// # Errors
    /// If a run fails, a policy does not fit, or a file cannot be written.
    pub fn carry_out(&self, front: &mut Front<'_>) -> Result<Option<Done>, RunError> {
        let (stage, step) = self.stage();
        let folder = &step.folder;
        fs::create_dir_all(folder).map_err(RunError::io(folder, "create folder"))?;
        let alone = matches!(step.job, Job::Train(_)) && step.seeds.len() == 1;
        // the folder of a single run is new or empty until the run begins
        if !alone && !self.begun {
            self.about.write(folder)?;
        }
        let mut made: BTreeMap<u64, Made> = BTreeMap::new();
        for (n, seed) in step.seeds.iter().enumerate() {
            if step.seeds.len() > 1 {
                front.note(format!("seed {seed}, {} of {}", n + 1, step.seeds.len()));
            }
            let folder = self.plan.run_folder(self.index, Some(*seed));
            state::refuse_link(&folder)?;
            let one = match &step.job {
                Job::Train(loaded) => self.train(loaded, *seed, &folder, alone, front)?,
                Job::Distill(options) => self.distill(options, *seed, &folder, front)?,
                Job::Average => None,
            };
            match one {
                Some(one) => _ = made.insert(*seed, one),
                None => return Ok(None),
            }
        }
        if matches!(step.job, Job::Average) {
            self.average()?;
        }
        let mut measured = BTreeMap::new();
        let mut seed = step.seeds.first().copied();
        if let Some(pick) = &stage.pick {
            measured = self.measured(pick)?;
            let values: Vec<Option<f64>> =
                step.seeds.iter().map(|seed| measured.get(seed).copied().flatten()).collect();
            let best = pick.best(&values).ok_or_else(|| {
                let place = format!("{}.pick", stage.place.key);
                RunError::file(&self.plan.recipe.path, place, format!("no value of {}", pick.measure), "a number")
            })?;
            seed = step.seeds.get(best).copied();
            copy_policies(&self.plan.run_folder(self.index, seed), folder)?;
        }
        let steps = seed.and_then(|seed| made.get(&seed)).map_or(0, |made| made.steps);
        let cpu_seconds = made.values().fold(0.0, |sum, made| sum + made.cpu_seconds);
        let mut done = Done::of(folder, seed, steps, cpu_seconds)?;
        done.measured = measured;
        done.write(folder)?;
        Ok(Some(done))
    }

    /// Trains with a seed. The description of a stage with a single run is written as soon as the run has begun.
    fn train(
        &self,
        loaded: &Loaded,
        seed: u64,
        folder: &Path,
        alone: bool,
        front: &mut Front<'_>,
    ) -> Result<Option<Made>, RunError> {
        let (stage, _) = self.stage();
        let begun = (self.begun || !alone) && folder.join("run.json").exists();
        let opened = if begun { self.resume(loaded, folder) } else { self.begin(loaded, seed, folder) };
        let (session, notes) = match opened {
            Err(RunError::Complete { steps, .. }) => {
                self.check_end(loaded, steps, folder)?;
                return Ok(Some(Made { steps, cpu_seconds: cpu_seconds(folder) }));
            }
            opened => opened?,
        };
        notes.into_iter().for_each(|note| front.note(format!("note: {note}")));
        if alone && !self.begun {
            self.about.write(folder)?;
        }
        let mut until = stage.until.clone().map(|criterion| self.until(criterion, loaded, folder)).transpose()?;
        if let Some(until) = &mut until {
            // a killed process may not have measured the last policy
            for (steps, path) in kept_policies(folder) {
                if steps <= session.steps() && until.is_met(steps, &path)? {
                    let cpu_seconds = session.checkpoint.as_ref().map_or(0.0, |checkpoint| checkpoint.seconds().1);
                    drop(session);
                    copy(&path, &folder.join(POLICY))?;
                    return Ok(Some(Made { steps, cpu_seconds }));
                }
            }
        }
        session.announcement().into_iter().for_each(|line| front.note(line));
        let (mut met, mut failure) = (None, None);
        let outcome = {
            let mut watch = |stats: &IterationStats| {
                let kept = kept_policy(folder, stats.steps);
                if let Some(until) = until.as_mut().filter(|_| kept.exists()) {
                    match until.is_met(stats.steps, &kept) {
                        Ok(false) => {}
                        Ok(true) => met = Some(stats.steps),
                        Err(error) => failure = Some(error),
                    }
                }
                if met.is_some() || failure.is_some() || front.stops() { Control::Stop } else { Control::Continue }
            };
            session.carry_out(front.show, &mut watch)?
        };
        if let Some(error) = failure {
            return Err(error);
        }
        let (steps, complete, cpu_seconds) = (outcome.steps, outcome.evaluation.is_some(), outcome.summary.cpu_seconds);
        // unlocks the folder
        drop(outcome);
        match (met, complete) {
            (Some(steps), _) => {
                let criterion = stage.until.as_ref().map(ToString::to_string).unwrap_or_default();
                front.note(format!("ended after {} steps: {criterion}", thousands(steps)));
                copy(&kept_policy(folder, steps), &folder.join(POLICY))?;
            }
            (None, true) => self.check_end(loaded, steps, folder)?,
            (None, false) => return Ok(None),
        }
        Ok(Some(Made { steps, cpu_seconds }))
    }

    fn begin(&self, loaded: &Loaded, seed: u64, folder: &Path) -> Result<(Session, Vec<String>), RunError> {
        let (stage, _) = self.stage();
        let mut loaded = loaded.clone();
        loaded.config.run.seed = seed;
        let StageKind::Train { initialize_from, .. } = &stage.kind else {
            return Err(RunError::option("stage", "does not train"));
        };
        let initialize_from = initialize_from.as_ref().map(|source| self.plan.policy(source, self.done));
        let options = RunOptions { initialize_from, out: Some(folder.into()), ..Default::default() };
        Session::open(Some(Task::named(&stage.task)?), &options, Some(loaded), false)
    }

    fn resume(&self, loaded: &Loaded, folder: &Path) -> Result<(Session, Vec<String>), RunError> {
        let learn = LearnOptions { threads: Some(loaded.config.run.threads), ..Default::default() };
        let options = RunOptions { learn, resume: Some(folder.into()), ..Default::default() };
        Session::open(None, &options, None, false)
    }

    fn until(&self, criterion: Criterion, loaded: &Loaded, folder: &Path) -> Result<Until, RunError> {
        Until::open(criterion, self.evaluation(loaded.config.run.threads), folder)
    }

    fn evaluation(&self, threads: usize) -> EvalOptions {
        EvalOptions { episodes: self.stage().0.episodes as usize, threads, ..Default::default() }
    }

    /// Fails if a run has ended without reaching what its stage must reach.
    fn check_end(&self, loaded: &Loaded, steps: u64, folder: &Path) -> Result<(), RunError> {
        let (stage, _) = self.stage();
        let Some(criterion) = stage.until.as_ref().filter(|_| stage.or_fail) else { return Ok(()) };
        let mut until = self.until(criterion.clone(), loaded, folder)?;
        if until.is_met(steps, &folder.join(POLICY))? {
            return Ok(());
        }
        let place = format!("{}.until", stage.place.key);
        let found = format!("{} at the end of the stage", until.last());
        Err(RunError::file(&self.plan.recipe.path, place, found, format!("{criterion}, because 'or_fail' is true")))
    }

    /// Distills with a seed.
    fn distill(
        &self,
        options: &DistillOptions,
        seed: u64,
        folder: &Path,
        front: &mut Front<'_>,
    ) -> Result<Option<Made>, RunError> {
        let (stage, step) = self.stage();
        let StageKind::Distill { teachers, initialize_from, .. } = &stage.kind else { return Ok(None) };
        let (out, notes) = (folder.join(POLICY), folder.join(format!("{POLICY}.unfinished")));
        if out.exists() && !notes.exists() {
            return Ok(Some(Made { steps: options.steps, cpu_seconds: 0.0 }));
        }
        fs::create_dir_all(folder).map_err(RunError::io(folder, "create folder"))?;
        let policy = |source| self.plan.policy(source, self.done);
        let initialize_from = initialize_from.as_ref().map(policy);
        let options = DistillOptions { seed, initialize_from, ..options.clone() };
        let teachers: Vec<PathBuf> = teachers.iter().map(policy).collect();
        let start = ProcessTime::try_now().ok();
        let (mut progress, mut stopped) = (front.show.then(|| Rounds::new(options.steps)), false);
        let student = resumable(step.task.clone(), &teachers, &options, Some(&notes), &mut |now: &Distilled| {
            if let Some(progress) = &mut progress {
                progress.update(now.steps, now.loss, now.failures);
            }
            stopped = front.stops();
            if stopped { Control::Stop } else { Control::Continue }
        })?;
        progress.iter().for_each(Rounds::finish);
        if stopped {
            return Ok(None);
        }
        student.save(&out)?;
        fs::remove_file(&notes).or_else(|error| match error.kind() {
            std::io::ErrorKind::NotFound => Ok(()),
            _ => Err(RunError::io(&notes, "remove")(error)),
        })?;
        Ok(Some(Made { steps: options.steps, cpu_seconds: start.map_or(0.0, |start| start.elapsed().as_secs_f64()) }))
    }

    fn average(&self) -> Result<(), RunError> {
        let (stage, step) = self.stage();
        let policies: Vec<PathBuf> =
            stage.kind.sources().into_iter().map(|source| self.plan.policy(source, self.done)).collect();
        let (mean, _) = average(&policies, &TaskOptions { given: stage.options.clone() })?;
        policy_file::save(&mean, &step.folder.join(POLICY))
    }

    /// Measures the policies of all seeds.
    fn measured(&self, pick: &Pick) -> Result<BTreeMap<u64, Option<f64>>, RunError> {
        let (_, step) = self.stage();
        let threads = match &step.job {
            Job::Train(loaded) => loaded.config.run.threads,
            Job::Distill(options) => options.threads,
            Job::Average => 1,
        };
        let of_seed = |seed: &u64| {
            let policy = self.plan.run_folder(self.index, Some(*seed)).join(POLICY);
            Ok((*seed, measure(&pick.measure, &policy, &self.evaluation(threads))?))
        };
        step.seeds.iter().map(of_seed).collect()
    }
}

/// Processor seconds of a complete run.
fn cpu_seconds(folder: &Path) -> f64 {
    let text = budget::read_to_string(&folder.join("summary.json"), &budget::CONFIG_FILE).unwrap_or_default();
    serde_json::from_str::<Summary>(&text).map_or(0.0, |summary| summary.cpu_seconds)
}

/// Copies a policy file.
fn copy(from: &Path, to: &Path) -> Result<(), RunError> {
    let bytes = budget::read(from, &budget::POLICY_FILE).map_err(RunError::io(from, "read"))?;
    Ok(write_atomic(to, &bytes)?)
}

/// Copies the policies of all roles from one folder to another. The first role's comes last, because it is the one that later
/// stages look for.
///
/// # Errors
/// If a file cannot be read or written.
pub fn copy_policies(from: &Path, to: &Path) -> Result<(), RunError> {
    for entry in fs::read_dir(from).map_err(RunError::io(from, "read folder"))? {
        let path = entry.map_err(RunError::io(from, "read folder"))?.path();
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { continue };
        if name.starts_with("policy-") && name.ends_with(".safetensors") {
            copy(&path, &to.join(name))?;
        }
    }
    copy(&from.join(POLICY), &to.join(POLICY))
}
