//! A model with its controls, and one repetition of its simulation.

use super::plan::{Counts, Plan, Which};
use super::scene::{self, Scene};
use crate::error::CliError;
use marathon_envs::{EnvError, ModelSource, registry};
use marathon_physics::lanes::Isa;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::workload::{Report, Workload};
use marathon_physics::{Model, SimError, SimOptions};
use marathon_runs::PolicySource;
use marathon_runs::speed::{Sample, on_threads, thread_cpu};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Timed steps of a repetition.
pub const STEPS: usize = 400;

/// A model to measure.
pub struct Subject {
    pub name: String,
    pub model: Model,
    pub source: Source,
    /// Recorded controls of a policy; without any, torques are random.
    pub scenes: Vec<Scene>,
}

/// Source of a model.
pub enum Source {
    /// Text in MJCF.
    Text(String),
    /// A file in MJCF.
    File(PathBuf),
}

impl TryFrom<ModelSource> for Source {
    type Error = MjcfError;

    fn try_from(source: ModelSource) -> Result<Self, MjcfError> {
        match source {
            ModelSource::Text(text) => Ok(Source::Text(text.into())),
            ModelSource::File(path) => Ok(Source::File(path)),
            ModelSource::Edited { spec, .. } => Ok(Source::Text(spec.to_xml())),
            ModelSource::Broken(error) => Err(*error),
        }
    }
}

impl Subject {
    /// The model of an agent, under random torques.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn agent(id: String) -> Result<Self, CliError> {
        let agent = registry::agent(&id)?;
        let source = agent.facts().model.try_into()?;
        Ok(Subject { name: id, model: agent.model()?, source, scenes: Vec::new() })
    }

    /// A model file, under random torques.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn file(file: &Path) -> Result<Self, CliError> {
        let name = file.file_stem().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
        let (model, source) = (Model::from_xml_file(file)?, Source::File(file.into()));
        Ok(Subject { name, model, source, scenes: Vec::new() })
    }

    /// The model of a policy's task, with recorded scenes of `agents` agents.
    ///
    /// # Errors
    /// If there is no such policy.
    pub fn policy(file: &Path, agents: usize) -> Result<Self, CliError> {
        let (policy, factory) = PolicySource { policy: file.into(), ..Default::default() }.load()?;
        let spec = factory.spec();
        let agent = registry::global().agent_with(&spec.id, &spec.options)?;
        let (model, source) = (agent.model()?, agent.facts().model.try_into()?);
        let scenes = scene::record(&policy, agents, spec.frame_skip)?;
        Ok(Subject { name: spec.id.clone(), model, source, scenes })
    }

    /// The error of a model that cannot be simulated.
    pub fn refused(&self, source: SimError) -> CliError {
        EnvError::Sim { id: self.name.clone(), source }.into()
    }
}

/// Describes the controls, for the heading of a table.
pub fn controls(plan: &Plan, subjects: &[Subject]) -> &'static str {
    let replayed = subjects.iter().filter(|subject| !subject.scenes.is_empty()).count();
    match (plan.limp, replayed) {
        (true, _) => "without actuators",
        (false, 0) => "under random controls",
        (false, n) if n == subjects.len() => "under the controls of its policy",
        (false, _) => "under random controls or those of its policy",
    }
}

/// Runs one repetition on every thread and adds its counts to `counts`.
///
/// # Errors
/// If the model cannot be simulated.
pub fn repeat(plan: &Plan, subject: &Subject, isa: Isa, seed: u64, counts: &mut Counts) -> Result<Sample, SimError> {
    let Subject { model, scenes, .. } = subject;
    if !scenes.is_empty() {
        return scene::replay(plan, model, scenes, isa, counts);
    }
    let work = |thread: usize, _: &mut ()| {
        let sim = SimOptions { ground_contacts_only: plan.contacts == Which::Ground, ..Default::default() };
        let seed = seed * plan.threads as u64 + thread as u64;
        let workload = Workload { isa, agents: plan.agents, warmup: plan.warmup, steps: STEPS, seed, sim };
        let ticks = RefCell::new(Vec::new());
        let clock = || {
            ticks.borrow_mut().push(Instant::now());
            thread_cpu()
        };
        let report = workload.run(model, &clock)?;
        let ticks = ticks.into_inner();
        let wall = ticks.last().zip(ticks.first()).map_or(0.0, |(last, first)| (*last - *first).as_secs_f64());
        Ok((report, wall))
    };
    let (reports, _) = on_threads(&mut vec![(); plan.threads], work);
    let reports: Vec<(Report, f64)> = reports.into_iter().collect::<Result<_, SimError>>()?;
    let mut sample = Sample::default();
    for (report, wall) in &reports {
        sample.steps += (report.agents * STEPS) as u64;
        sample.cpu += report.seconds;
        // threads run side by side, each with its own warm-up outside the clock
        sample.wall = sample.wall.max(*wall);
        counts.stats.add(&report.stats);
        counts.non_finite += report.non_finite as u64;
    }
    Ok(sample)
}
