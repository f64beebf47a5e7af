//! An unfinished distillation as one file. It holds all the state that resuming with the same bits needs.

use super::{Distiller, Lessons};
use crate::error::Error;
use crate::files::{TensorReader, TensorWriter, write_atomic};
use crate::lanes::noise::SplitMix;
use crate::nets::normalize::Normalizer;
use marathon_physics::budget;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

const FORMAT: &str = "marathon-distillation";
const VERSION: u32 = 1;

/// The saved state besides the student and its lessons.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Halfway {
    /// Number of finished rounds.
    pub rounds: u64,
    /// Description of the distillation by name. A resumed distillation must agree on every entry.
    pub about: BTreeMap<String, String>,
    /// One entry per teacher: a snapshot of its agents' environment, and their observations.
    pub classes: Vec<(Vec<u8>, Vec<f32>)>,
}

/// The document in the file's header.
#[derive(Serialize, Deserialize)]
struct Document {
    format: String,
    version: u32,
    about: BTreeMap<String, String>,
    classes: usize,
    started: bool,
}

impl Distiller {
    /// Writes a file from which the distillation can resume.
    ///
    /// # Errors
    /// If the file cannot be written. The older file then stays.
    pub fn save(&self, path: &Path, halfway: &Halfway, lessons: &Lessons) -> Result<(), Error> {
        let mut file = TensorWriter::default();
        file.list("params", &self.params);
        file.list("adam_m", &self.adam.m);
        file.list("adam_v", &self.adam.v);
        file.list("numbers", &[self.adam.powers[0], self.adam.powers[1], self.moments.count]);
        file.list("obs_mean", &self.moments.mean);
        file.list("obs_var", &self.moments.var);
        file.list("normalizer_mean", self.normalizer.mean());
        file.list("normalizer_std", self.normalizer.std());
        file.list("words", &[halfway.rounds, self.updates, self.noise.state(), lessons.next as u64]);
        file.list("lessons_obs", &lessons.obs);
        file.list("lessons_actions", &lessons.actions);
        for (i, (snapshot, obs)) in halfway.classes.iter().enumerate() {
            file.list(&format!("class.{i}.snapshot"), snapshot);
            file.list(&format!("class.{i}.obs"), obs);
        }
        let document = Document {
            format: FORMAT.into(),
            version: VERSION,
            about: halfway.about.clone(),
            classes: halfway.classes.len(),
            started: self.started,
        };
        write_atomic(path, &file.sealed_bytes(&document))
    }

    /// Resumes from a file of the same distillation: restores the student and its lessons.
    ///
    /// # Errors
    /// If the file cannot be read, has changed since it was written, or belongs to another distillation.
    pub fn resume(
        &mut self,
        path: &Path,
        about: &BTreeMap<String, String>,
        lessons: &mut Lessons,
    ) -> Result<Halfway, Error> {
        let bytes = budget::read(path, &budget::AGENTS_MEMORY).map_err(Error::io(path, "read"))?;
        let file = TensorReader::new(path, &bytes)?;
        if file.seal(&bytes)?.is_none() {
            return Err(Error::file(path, "checksum", "none", "that of a distillation"));
        }
        let document: Document = file.document(FORMAT, VERSION)?;
        let none = String::new();
        let names = about.keys().chain(document.about.keys());
        for name in names {
            let [found, expected] = [&document.about, about].map(|about| about.get(name).unwrap_or(&none));
            if found != expected {
                let expected =
                    format!("{expected}; the file belongs to another distillation: delete it to start again");
                return Err(Error::file(path, name, found, expected));
            }
        }
        let n = self.params.len();
        let obs = [self.meta.obs];
        self.params = file.finite("params", &[n])?;
        (self.adam.m, self.adam.v) = (file.finite("adam_m", &[n])?, file.finite("adam_v", &[n])?);
        let numbers: Vec<f64> = file.get("numbers", &[3])?;
        self.adam.powers = [numbers[0], numbers[1]];
        self.moments.count = numbers[2];
        (self.moments.mean, self.moments.var) = (file.get("obs_mean", &obs)?, file.get("obs_var", &obs)?);
        let (mean, std) = (file.finite("normalizer_mean", &obs)?, file.finite("normalizer_std", &obs)?);
        self.normalizer = Normalizer::new(mean, std, self.normalizer.clip());
        let words: Vec<u64> = file.get("words", &[4])?;
        (self.updates, self.noise, self.started) = (words[1], SplitMix::from_state(words[2]), document.started);
        (lessons.obs, lessons.actions) = (file.list("lessons_obs")?, file.list("lessons_actions")?);
        lessons.next = words[3] as usize;
        let rows = lessons.len();
        let whole = lessons.obs.len() == rows * lessons.obs_len && lessons.actions.len() == rows * lessons.act_len;
        if !whole || rows > lessons.room || lessons.next >= lessons.room {
            return Err(Error::file(path, "lessons", rows, format!("whole rows, at most {}", lessons.room)));
        }
        let of_class =
            |i: usize| Ok((file.list(&format!("class.{i}.snapshot"))?, file.list(&format!("class.{i}.obs"))?));
        let classes = (0..document.classes).map(of_class).collect::<Result<_, Error>>()?;
        Ok(Halfway { rounds: words[0], about: document.about, classes })
    }
}
