//! The physics alone.

use super::Plan;
use super::row::{More, Row, Sample, on_threads, thread_cpu};
use crate::error::CliError;
use marathon_envs::{EnvError, registry};
use marathon_physics::lanes::Isa;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::workload::{Report, Workload};
use marathon_physics::{Model, SimError, SimOptions};
use std::path::PathBuf;

/// Agents of each thread, and steps of a repetition before and under the clock: those of the oracle.
const AGENTS: usize = 64;
const WARMUP: usize = 200;
const STEPS: usize = 400;

/// Measures the models of the agents and of the files for every instruction set.
///
/// # Errors
/// If a model cannot be read or simulated.
pub fn run(plan: &Plan, files: &[PathBuf], emit: &mut dyn FnMut(Row)) -> Result<(), CliError> {
    let mut models: Vec<(String, Model)> = Vec::new();
    for id in &plan.agents {
        let source = |source: MjcfError| EnvError::Model { id: id.clone(), source: Box::new(source) };
        models.push((id.clone(), Model::from_xml_str(&registry::agent(id)?.facts().model, id).map_err(source)?));
    }
    for file in files {
        let name = file.file_stem().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
        models.push((name, Model::from_xml_file(file)?));
    }
    for (name, model) in &models {
        for isa in &plan.isas {
            let row = measure(plan, name, model, *isa).map_err(|source| EnvError::Sim { id: name.clone(), source })?;
            emit(row);
        }
    }
    Ok(())
}

fn measure(plan: &Plan, name: &str, model: &Model, isa: Isa) -> Result<Row, SimError> {
    let mut samples = Vec::new();
    let (mut contacts, mut newton, mut solves, mut non_finite) = (0, 0, 0, 0);
    let mut threads = vec![(); plan.threads];
    while samples.iter().map(|s: &Sample| s.cpu).sum::<f64>() < plan.seconds * plan.threads as f64 {
        let work = |thread: usize, _: &mut ()| {
            let sim = SimOptions { ground_contacts_only: true, ..Default::default() };
            let seed = (samples.len() * plan.threads + thread) as u64;
            Workload { isa, agents: AGENTS, warmup: WARMUP, steps: STEPS, seed, sim }.run(model, &thread_cpu)
        };
        let (reports, _) = on_threads(&mut threads, work);
        let reports: Vec<Report> = reports.into_iter().collect::<Result<_, _>>()?;
        let mut sample = Sample::default();
        for report in &reports {
            sample.steps += (report.agents * STEPS) as u64;
            sample.cpu += report.seconds;
            // threads run side by side, each with its own warm-up outside the clock
            sample.wall = sample.wall.max(report.seconds);
            contacts += report.stats.contacts;
            newton += report.stats.newton;
            solves += report.stats.solves;
            non_finite += report.non_finite;
        }
        samples.push(sample);
    }
    let steps: u64 = samples.iter().map(|s| s.steps).sum();
    let more = More::Physics {
        contacts: contacts as f64 / steps as f64,
        newton: newton as f64 / solves.max(1) as f64,
        non_finite,
    };
    Ok(Row::new(name, isa, (plan.threads, AGENTS.next_multiple_of(isa.lanes()) * plan.threads), &samples, more))
}
