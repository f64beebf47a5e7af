//! Options of all benchmarks, and properties of the computer.

use crate::error::CliError;
use crate::number::count;
use marathon_envs::registry;
use marathon_physics::lanes::Isa;
use serde::Serialize;

/// Agents and threads.
#[derive(Debug, clap::Args)]
pub struct Common {
    /// Agent to measure; may be repeated [default: all; without tasks, one agent per model].
    #[arg(long, value_name = "AGENT")]
    pub agent: Vec<String>,
    /// Threads; 0 means one per processor.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = count::<u64>(0..=4096))]
    pub threads: u64,
}

impl Common {
    /// Ids of the named agents, or of all. Unless `tasks_count`, agents with the same model are measured once.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn agents(&self, tasks_count: bool) -> Result<Vec<String>, CliError> {
        if !self.agent.is_empty() {
            // the file of a robot is its name
            let id = |name: &String| match registry::robot_options(name) {
                Some(_) => registry::agent(name).map(|_| name.clone()).map_err(CliError::from),
                None => Ok(registry::agent(name)?.facts().id),
            };
            return self.agent.iter().map(id).collect();
        }
        let mut ids: Vec<String> = Vec::new();
        let mut models = Vec::new();
        for id in registry::ids() {
            let model = registry::agent(&id)?.facts().model;
            if tasks_count || !models.contains(&model) {
                models.push(model);
                ids.push(id);
            }
        }
        Ok(ids)
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        if self.threads == 0 { cores() } else { self.threads as usize }
    }
}

/// Properties of the computer.
#[derive(Serialize)]
pub struct Machine {
    pub arch: &'static str,
    pub os: &'static str,
    /// Processors that this program may use.
    pub cores: usize,
    /// Instruction sets of the processor, narrowest first.
    pub isas: Vec<&'static str>,
    /// The instruction set of all other commands.
    pub best_isa: &'static str,
}

/// The first fields of every `--json` document.
#[derive(Serialize)]
pub struct Head {
    pub bench: &'static str,
    pub version: &'static str,
    pub machine: Machine,
    pub threads: usize,
}

impl Head {
    /// The fields of a benchmark on this computer.
    pub fn new(bench: &'static str, threads: usize) -> Self {
        let machine = Machine {
            arch: std::env::consts::ARCH,
            os: std::env::consts::OS,
            cores: cores(),
            isas: isas(&[]).into_iter().map(Isa::name).collect(),
            best_isa: Isa::best().name(),
        };
        Self { bench, version: env!("CARGO_PKG_VERSION"), machine, threads }
    }
}

/// Processors that this program may use.
pub fn cores() -> usize {
    marathon_physics::threads(0)
}

/// The chosen instruction sets, or all of the processor.
pub fn isas(chosen: &[Isa]) -> Vec<Isa> {
    match chosen {
        [] => Isa::ALL.into_iter().filter(|isa| isa.supported()).collect(),
        chosen => chosen.to_vec(),
    }
}

/// Reads an instruction set of this processor.
pub fn supported(text: &str) -> Result<Isa, String> {
    let isa: Isa = text.parse()?;
    match isa.obstacle() {
        None => Ok(isa),
        Some(obstacle) => Err(format!("cannot run '{}': {obstacle}; the best is '{}'", isa.name(), Isa::best().name())),
    }
}

/// Reads an instruction set that can train networks.
pub fn for_networks(text: &str) -> Result<Isa, String> {
    match supported(text)? {
        Isa::F64 => Err("networks train in single precision; expected f32, baseline, avx2 or avx512".into()),
        isa => Ok(isa),
    }
}

/// Reads a duration in seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    let x: f64 = text.parse().map_err(|_| "expected a number of seconds".to_string())?;
    if x > 0.0 && x <= 86_400.0 { Ok(x) } else { Err("expected a positive number of seconds, at most a day".into()) }
}
