//! The measure at which a stage ends before its last step.
//!
//! It is checked for every policy that the run keeps, so a resumed run checks the same policies as one that was never
//! interrupted.

use crate::error::RunError;
use crate::measure::{STEPS, measure};
use marathon_config::recipe::Criterion;
use marathon_learn::{EvalOptions, read_description, write_description};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Name of the file with the values.
const FILE: &str = "until.json";
const FORMAT: &str = "marathon-until";
const VERSION: u32 = 1;

/// A measure of a run, with the values so far.
pub struct Until {
    criterion: Criterion,
    options: EvalOptions,
    path: PathBuf,
    file: UntilFile,
    last: Option<f64>,
}

/// The values, by the run's steps.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct UntilFile {
    format: String,
    version: u32,
    until: String,
    measured: BTreeMap<u64, Option<f64>>,
}

impl Until {
    /// The values in the folder of a run, if there are any.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn open(criterion: Criterion, options: EvalOptions, folder: &Path) -> Result<Self, RunError> {
        let (path, until) = (folder.join(FILE), criterion.to_string());
        let file = match path.exists() {
            true => read_description(&path, FORMAT, VERSION)?,
            false => UntilFile { format: FORMAT.into(), version: VERSION, until, measured: BTreeMap::new() },
        };
        Ok(Until { criterion, options, path, file, last: None })
    }

    /// Whether the policy after a number of steps meets the criterion. It is measured once.
    ///
    /// # Errors
    /// If it cannot be measured, or the value cannot be written.
    pub fn is_met(&mut self, steps: u64, policy: &Path) -> Result<bool, RunError> {
        self.last = match self.file.measured.get(&steps) {
            _ if self.criterion.measure == STEPS => Some(steps as f64),
            Some(value) => *value,
            None => {
                let value = measure(&self.criterion.measure, policy, &self.options)?;
                self.file.measured.insert(steps, value);
                write_description(&self.path, &self.file)?;
                value
            }
        };
        Ok(self.criterion.is_met(self.last))
    }

    /// The last value in words.
    pub fn last(&self) -> String {
        let value = self.last.map_or("nothing".into(), |value| value.to_string());
        format!("{} = {value}", self.criterion.measure)
    }
}
