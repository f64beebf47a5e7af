//! Policy files.

use super::{FORMAT, Policy, PolicyMeta, VERSION};
use crate::error::Error;
use crate::files::{TensorReader, TensorWriter, write_atomic};
use marathon_envs::Spec;
use marathon_physics::budget;
use std::path::Path;

impl Policy {
    /// Writes the policy to a file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), Error> {
        write_atomic(path, &self.to_bytes())
    }

    /// The policy as the bytes of a file. [`Policy::from_bytes`] is the inverse.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut file = TensorWriter::default();
        file.list("obs_mean", self.normalizer.mean());
        file.list("obs_std", self.normalizer.std());
        file.list("log_std", &self.log_std);
        for (l, (weights, biases)) in self.net.layers().enumerate() {
            let shape = [self.net.sizes()[l + 1], self.net.sizes()[l]];
            file.add(format!("layer.{l}.weight"), &shape, self.params[weights].iter().copied());
            file.list(&format!("layer.{l}.bias"), &self.params[biases]);
        }
        file.sealed_bytes(&self.meta)
    }

    /// Reads a policy.
    ///
    /// # Errors
    /// If the file cannot be read, has changed since it was written, is incomplete, or has numbers that are not finite.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::from_bytes(path, &read(path)?)
    }

    /// Reads a policy from the bytes of a file. Messages name the file `path`.
    ///
    /// # Errors
    /// If the bytes have no checksum or a wrong one, are incomplete, or have numbers that are not finite.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        let file = TensorReader::new(path, bytes)?;
        if file.seal(bytes)?.is_none() {
            // reports other kinds of files first
            Self::of_file(path, &file)?;
            let expected = format!("one; `marathon import {} --out NEW.safetensors` writes it", path.display());
            return Err(Error::file(path, "checksum", "none", expected));
        }
        Self::of_file(path, &file)
    }

    /// Reads a policy that another program may have written without a checksum. Checks an existing checksum.
    ///
    /// # Errors
    /// As [`Policy::load`], except for a missing checksum.
    pub fn load_unsealed(path: &Path) -> Result<Self, Error> {
        let bytes = read(path)?;
        let file = TensorReader::new(path, &bytes)?;
        file.seal(&bytes)?;
        Self::of_file(path, &file)
    }

    fn of_file(path: &Path, file: &TensorReader<'_>) -> Result<Self, Error> {
        let meta: PolicyMeta = file.document(FORMAT, VERSION)?;
        let positive = |x: f32| x.is_finite() && x > 0.0;
        if !positive(meta.observation_clip) || !positive(meta.action_clip) {
            let found = format!("{} and {}", meta.observation_clip, meta.action_clip);
            return Err(Error::file(path, "observation_clip and action_clip", found, "positive numbers"));
        }
        let sound = |[low, high]: &[f32; 2]| low.is_finite() && high.is_finite() && low < high;
        if !(meta.action_range.is_empty() || meta.action_range.len() == meta.act)
            || !meta.action_range.iter().all(sound)
        {
            let found = format!("{:?}", meta.action_range);
            return Err(Error::file(path, "action_range", found, "a low and a higher number per action, or nothing"));
        }
        let mean = file.finite("obs_mean", &[meta.obs])?;
        let std = file.finite("obs_std", &[meta.obs])?;
        if let Some(i) = std.iter().position(|s| !positive(*s)) {
            return Err(Error::file(path, format!("tensor 'obs_std', number {i}"), std[i], "a positive number"));
        }
        let log_std = file.finite("log_std", &[meta.act])?;
        let sizes = [&[meta.obs], &meta.hidden[..], &[meta.act]].concat();
        let mut params = Vec::new();
        for (l, pair) in sizes.windows(2).enumerate() {
            params.extend(file.finite(&format!("layer.{l}.weight"), &[pair[1], pair[0]])?);
            params.extend(file.finite(&format!("layer.{l}.bias"), &[pair[1]])?);
        }
        Self::from_parts(meta, params, (mean, std), log_std)
            .map_err(|e| Error::file(path, "network", e, "tensors that fit the widths"))
    }

    /// Reads a policy for a given task.
    ///
    /// # Errors
    /// As [`Policy::load`], or if the policy is for another agent.
    pub fn load_for(path: &Path, spec: &Spec) -> Result<Self, Error> {
        let policy = Self::load(path)?;
        policy.check(spec).map_err(|e| e.of_file(path))?;
        Ok(policy)
    }
}

fn read(path: &Path) -> Result<Vec<u8>, Error> {
    budget::read(path, &budget::POLICY_FILE).map_err(Error::io(path, "read"))
}
