//! The end of a recipe: its policy with the stages that made it, and its summary.

use super::plan::Plan;
use super::stage::copy_policies;
use super::state::{Done, POLICY};
use crate::error::RunError;
use crate::folder::write_json;
use crate::policy_file;
use crate::report::summary::EPISODES;
use crate::task_config::TaskOptions;
use crate::text::path_json;
use marathon_learn::{Ancestor, EvalOptions, Evaluation, Policy, evaluate_roles};
use marathon_physics::lanes::Isa;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Contents of a recipe's `summary.json`, and of the output of `train --json`.
#[derive(Clone, Debug, Serialize)]
pub struct RecipeSummary {
    /// Registry name of the agent.
    pub agent: String,
    /// Folder of the recipe.
    #[serde(serialize_with = "path_json")]
    pub folder: PathBuf,
    /// The seed in place of 1.
    pub seed: u64,
    /// Agent-steps of all stages that the policy comes from.
    pub steps: u64,
    /// Processor seconds of all stages.
    pub cpu_seconds: f64,
    /// The stages, in their order.
    pub stages: Vec<StageSummary>,
    /// Evaluation of the policy.
    pub eval: Option<Evaluation>,
}

/// A stage in a summary.
#[derive(Clone, Debug, Serialize)]
pub struct StageSummary {
    /// Its place in the lineage of the policy.
    #[serde(flatten)]
    pub ancestor: Ancestor,
    /// Processor seconds.
    pub cpu_seconds: f64,
    /// Measured values by seed, if the stage has picked one.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub measured: BTreeMap<u64, Option<f64>>,
}

/// Writes the policy of the last stage with its lineage, and the summary.
///
/// # Errors
/// If a file cannot be read or written.
pub fn finish(plan: &Plan, done: &[Done], hashes: &[String], seed: u64) -> Result<RecipeSummary, RunError> {
    let ancestor = |i: usize| {
        let (stage, step) = plan.stage(i);
        let mut from: Vec<String> = Vec::new();
        for name in stage.kind.sources().into_iter().map(|source| plan.name_of(source)) {
            // a teacher may be named several times
            if !from.contains(&name) {
                from.push(name);
            }
        }
        Ancestor {
            stage: stage.name.clone(),
            kind: stage.kind.name().into(),
            agent: step.task.agent.clone(),
            seed: done[i].seed,
            steps: done[i].steps,
            from,
            hash: hashes[i].clone(),
        }
    };
    let last = done.len() - 1;
    let folder = &plan.steps[last].folder;
    copy_policies(folder, &plan.folder)?;
    let path = plan.folder.join(POLICY);
    let mut policy = Policy::load(&path)?;
    policy.set_lineage(plan.ancestors(last).into_iter().map(ancestor).collect());
    if policy.meta().evaluation.is_none()
        && let Some(evaluation) = evaluated(plan, last)?
    {
        policy.set_evaluation(evaluation);
    }
    policy.save(&path)?;
    let stages: Vec<StageSummary> = (0..done.len())
        .map(|i| StageSummary {
            ancestor: ancestor(i),
            cpu_seconds: done[i].cpu_seconds,
            measured: done[i].measured.clone(),
        })
        .collect();
    let summary = RecipeSummary {
        agent: policy.meta().agent.clone(),
        folder: plan.folder.clone(),
        seed,
        steps: policy.meta().lineage.iter().map(|ancestor| ancestor.steps).sum(),
        cpu_seconds: stages.iter().fold(0.0, |sum, stage| sum + stage.cpu_seconds),
        stages,
        eval: policy.meta().evaluation.clone(),
    };
    write_json(&plan.folder.join("summary.json"), &summary)?;
    Ok(summary)
}

/// Evaluates the policy of a stage. `None` for a task with roles of which the stage has made one.
fn evaluated(plan: &Plan, i: usize) -> Result<Option<Evaluation>, RunError> {
    let path = plan.steps[i].folder.join(POLICY);
    let (_, factory) = policy_file::load(&path, None, &TaskOptions::default())?;
    if factory.spec().deciders().len() > 1 {
        return Ok(None);
    }
    let (policies, factory) = policy_file::load_all(&path, None, &TaskOptions::default())?;
    let all: Vec<&Policy> = policies.iter().collect();
    let options = EvalOptions { episodes: EPISODES, ..Default::default() };
    Ok(evaluate_roles(&*factory, Isa::best(), &all, &options)?.into_iter().next())
}
