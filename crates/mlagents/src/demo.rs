//! Demonstrations: `.demo` files of recorded decisions for ML-Agents' imitation learning.
//!
//! A file starts with the length of a head and the head, padded to 33 bytes, then the length of the behavior's
//! description and the description. An entry per decision follows in the same way: observation, reward of the previous
//! decision, action. Lengths are protocol buffers' variable integers. The last entry of an episode is the state in
//! which it ended, with a dummy action.

use crate::face::{TEAM, observation};
use crate::wire::{ActionSpec, AgentInfo, AgentInfoActionPair, BrainParameters, DemonstrationMeta, RecordedAction};
use marathon_envs::{Demonstrations, Spec};
use prost::Message;
use prost::bytes::Buf;
use std::path::{Path, PathBuf};

/// Bytes before the behavior's description.
const HEAD: usize = 33;
/// Version of the format.
const API_VERSION: i32 = 1;
/// Limit on the length of an entry, bytes. It allows for the entry's numbers, names and unused fields. A longer entry
/// could take much memory, for example with empty messages.
const ENTRY: usize = 1 << 16;
const ENTRY_NUMBER: usize = 16;

/// A recorded episode, from its first observation to its last.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Episode {
    /// Observations, `[steps + 1][obs]`. The last one is that of the state in which the episode ended.
    pub obs: Vec<f32>,
    /// Actions in the environment's units, `[steps][act]`.
    pub actions: Vec<f32>,
    /// Rewards, `[steps]`.
    pub rewards: Vec<f32>,
    /// Whether it ended by its time limit.
    pub truncated: bool,
}

/// A demonstration file under construction.
#[derive(Clone, Debug)]
pub struct Demonstration {
    name: String,
    behavior: String,
    spec: Spec,
    pairs: Vec<u8>,
    steps: usize,
    episodes: usize,
    total: f64,
}

impl Demonstration {
    /// Creates an empty demonstration of a task.
    pub fn new(name: &str, spec: &Spec) -> Self {
        Demonstration {
            name: name.into(),
            behavior: format!("{}{TEAM}", spec.id),
            spec: spec.clone(),
            pairs: Vec::new(),
            steps: 0,
            episodes: 0,
            total: 0.0,
        }
    }

    /// Adds an episode.
    ///
    /// # Panics
    /// If the lengths of the episode do not fit each other or the task.
    pub fn push(&mut self, episode: &Episode) {
        let (obs, act, steps) = (self.spec.obs, self.spec.act, episode.rewards.len());
        assert_eq!(episode.obs.len(), (steps + 1) * obs, "one observation per decision and one for the end");
        assert_eq!(episode.actions.len(), steps * act, "one action per decision");
        for i in 0..=steps {
            let done = i == steps;
            let info = AgentInfo {
                reward: if i == 0 { 0.0 } else { episode.rewards[i - 1] },
                done,
                max_step_reached: done && episode.truncated,
                id: self.episodes as i32,
                observations: vec![observation(&episode.obs[i * obs..(i + 1) * obs])],
            };
            let action: Vec<f32> = match episode.actions.get(i * act..(i + 1) * act) {
                Some(row) => row.iter().enumerate().map(|(i, a)| nominal(self.spec.action_range(i), *a)).collect(),
                None => vec![0.0; act],
            };
            let action = RecordedAction { vector_actions: action.clone(), continuous_actions: action };
            let pair = AgentInfoActionPair { agent_info: Some(info), action_info: Some(action) };
            self.pairs.extend(pair.encode_length_delimited_to_vec());
        }
        self.steps += steps + 1;
        self.episodes += 1;
        self.total += episode.rewards.iter().map(|r| f64::from(*r)).sum::<f64>();
    }

    /// Number of episodes.
    pub fn episodes(&self) -> usize {
        self.episodes
    }

    /// Mean return.
    pub fn mean_return(&self) -> f64 {
        self.total / self.episodes.max(1) as f64
    }

    /// The whole file, if no bytes have been [taken](Self::take) yet.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.front();
        bytes.extend(&self.pairs);
        bytes
    }

    /// Takes the bytes of the episodes added since the last call. When a file is written during play, these bytes
    /// follow [`Demonstration::front`], whose content is complete at the end.
    pub fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.pairs)
    }

    /// The start of the file. It contains the number of episodes, but its length does not change.
    pub fn front(&self) -> Vec<u8> {
        let mut meta = DemonstrationMeta {
            api_version: API_VERSION,
            // Unity's editor keeps only letters and digits, too
            name: self.name.chars().filter(char::is_ascii_alphanumeric).collect(),
            number_steps: self.steps.try_into().unwrap_or(i32::MAX),
            number_episodes: self.episodes.try_into().unwrap_or(i32::MAX),
            mean_reward: self.mean_return() as f32,
        };
        // the head has a fixed length, and only the name can be shortened
        while meta.encode_length_delimited_to_vec().len() > HEAD && meta.name.pop().is_some() {}
        let action_spec = ActionSpec { num_continuous: self.spec.act as i32 };
        let behavior =
            BrainParameters { brain_name: self.behavior.clone(), is_training: true, action_spec: Some(action_spec) };
        let mut bytes = meta.encode_length_delimited_to_vec();
        bytes.resize(HEAD, 0);
        bytes.extend(behavior.encode_length_delimited_to_vec());
        bytes
    }
}

/// An error in a demonstration file.
#[derive(Debug, thiserror::Error)]
#[error("{}: {place}: found {found}, expected {expected}", path.display())]
pub struct DemoError {
    /// The file.
    pub path: PathBuf,
    /// Place in the file.
    pub place: String,
    /// Contents at that place.
    pub found: String,
    /// Valid contents.
    pub expected: String,
}

/// Reads the decisions of a demonstration file by Marathon or Unity's recorder.
///
/// # Errors
/// If the file is not a demonstration, or its observations or actions do not fit the task.
pub fn read_demonstrations(path: &Path, bytes: &[u8], spec: &Spec) -> Result<Demonstrations, DemoError> {
    let wrong = |place: &str, found: String, expected: &str| DemoError {
        path: path.into(),
        place: place.into(),
        found,
        expected: expected.into(),
    };
    let meta = DemonstrationMeta::decode_length_delimited(bytes)
        .map_err(|error| wrong("head", error.to_string(), "a demonstration file (.demo)"))?;
    if meta.api_version != API_VERSION {
        return Err(wrong("api_version", meta.api_version.to_string(), &API_VERSION.to_string()));
    }
    let mut rest =
        bytes.get(HEAD..).ok_or_else(|| wrong("length", format!("{} bytes", bytes.len()), "a head of 33"))?;
    BrainParameters::decode_length_delimited(&mut rest)
        .map_err(|error| wrong("behavior", error.to_string(), "a behavior's description"))?;
    let source = Some(path.to_string_lossy().into_owned());
    let mut out = Demonstrations { obs_len: spec.obs, act_len: spec.act, source, ..Demonstrations::default() };
    // the action whose result the next entry holds
    let mut before: Option<Vec<f32>> = None;
    let mut entry = 0;
    while rest.has_remaining() {
        let place = format!("entry {entry}");
        let most = ENTRY + ENTRY_NUMBER * (spec.obs + spec.act);
        let length =
            prost::decode_length_delimiter(rest).map_err(|error| wrong(&place, error.to_string(), "a length"))?;
        if length > most {
            return Err(wrong(&place, format!("{length} bytes"), &format!("at most {most}, as {} needs", spec.id)));
        }
        let pair = AgentInfoActionPair::decode_length_delimited(&mut rest)
            .map_err(|error| wrong(&place, error.to_string(), "an observation with an action"))?;
        let (info, action) = (pair.agent_info.unwrap_or_default(), pair.action_info.unwrap_or_default());
        let obs: Vec<f32> = info.observations.into_iter().flat_map(|o| o.float_data.unwrap_or_default().data).collect();
        let RecordedAction { vector_actions, continuous_actions } = action;
        let action = if continuous_actions.is_empty() { vector_actions } else { continuous_actions };
        for (what, found, expected) in [("observed numbers", obs.len(), spec.obs), ("actions", action.len(), spec.act)]
        {
            if found != expected {
                let of = format!("{expected}, as {} has", spec.id);
                return Err(wrong(&place, format!("{found} {what}"), &of));
            }
        }
        if let Some(x) = obs.iter().chain(&action).find(|x| !x.is_finite()) {
            return Err(wrong(&place, x.to_string(), "finite numbers"));
        }
        if let Some(action) = before.take() {
            out.decisions.push([entry - 1, entry]);
            out.actions.extend(action);
        }
        out.obs.extend(obs);
        // the last entry of an episode has a dummy action
        before = (!info.done).then_some(action);
        entry += 1;
    }
    if out.decisions.is_empty() {
        return Err(wrong("entries", format!("{entry}, no two of one episode"), "decisions with their outcomes"));
    }
    out.motions.push(0..out.decisions.len());
    Ok(out)
}

/// Maps an action in an actuator's own units to [-1, 1].
fn nominal([low, high]: [f32; 2], action: f32) -> f32 {
    // the same bits if there is nothing to map
    let x = if low == -1.0 && high == 1.0 { action } else { (action - 0.5 * (low + high)) / (0.5 * (high - low)) };
    x.clamp(-1.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Observation;

    #[test]
    fn a_file_is_head_behavior_and_pairs() {
        let spec = marathon_envs::factory("Hopper-v5", marathon_physics::lanes::Isa::best()).unwrap().spec().clone();
        let mut demo = Demonstration::new("a name that is too long for the head", &spec);
        let episode = Episode {
            obs: (0..3 * spec.obs).map(|i| i as f32).collect(),
            actions: vec![0.5; 2 * spec.act],
            rewards: vec![1.0, 2.0],
            truncated: true,
        };
        demo.push(&episode);
        demo.push(&episode);
        let bytes = demo.bytes();
        let meta = DemonstrationMeta::decode_length_delimited(&bytes[..]).unwrap();
        assert_eq!((meta.number_steps, meta.number_episodes, meta.mean_reward), (6, 2, 3.0));
        assert!("anamethatistoolongforthehead".starts_with(&meta.name) && meta.name.len() > 10);
        let mut rest = &bytes[HEAD..];
        let behavior = BrainParameters::decode_length_delimited(&mut rest).unwrap();
        assert_eq!(
            (behavior.brain_name.as_str(), behavior.action_spec.unwrap().num_continuous),
            ("Hopper-v5?team=0", 3)
        );
        let mut pairs = Vec::new();
        while !rest.is_empty() {
            pairs.push(AgentInfoActionPair::decode_length_delimited(&mut rest).unwrap());
        }
        let facts = |p: &AgentInfoActionPair| {
            let info = p.agent_info.as_ref().unwrap();
            (info.reward, info.done, info.max_step_reached)
        };
        let once = [(0.0, false, false), (1.0, false, false), (2.0, true, true)];
        assert_eq!(pairs.iter().map(facts).collect::<Vec<_>>(), [once, once].concat());
        assert_eq!(pairs[0].action_info.as_ref().unwrap().continuous_actions, [0.5; 3]);
    }

    #[test]
    fn what_was_written_is_read() {
        let spec = marathon_envs::factory("Hopper-v5", marathon_physics::lanes::Isa::best()).unwrap().spec().clone();
        let mut demo = Demonstration::new("hop", &spec);
        let obs: Vec<f32> = (0..3 * spec.obs).map(|i| i as f32).collect();
        let actions: Vec<f32> = (0..2 * spec.act).map(|i| 0.1 * i as f32).collect();
        let episode = Episode { obs: obs.clone(), actions: actions.clone(), rewards: vec![1.0, 2.0], truncated: true };
        demo.push(&episode);
        demo.push(&episode);
        let bytes = demo.bytes();
        let path = Path::new("hop.demo");
        let read = read_demonstrations(path, &bytes, &spec).unwrap();
        assert_eq!(read.obs, [&obs[..], &obs].concat());
        assert_eq!(read.decisions, [[0, 1], [1, 2], [3, 4], [4, 5]]);
        assert_eq!(read.actions, [&actions[..], &actions].concat());
        assert_eq!((read.motions.len(), &read.motions[0], read.source), (1, &(0..4), Some("hop.demo".into())));
        // no truncation or change causes a panic
        for n in 0..bytes.len() {
            let _ = read_demonstrations(path, &bytes[..n], &spec);
            let mut changed = bytes.clone();
            changed[n] ^= 0x55;
            let _ = read_demonstrations(path, &changed, &spec);
        }
        let error = read_demonstrations(path, b"behaviors:", &spec).unwrap_err().to_string();
        assert!(error.starts_with("hop.demo: head: found") && error.ends_with("expected a demonstration file (.demo)"));
        // an entry that consists of empty messages
        let info = AgentInfo { observations: vec![Observation::default(); 1 << 18], ..AgentInfo::default() };
        let pair = AgentInfoActionPair { agent_info: Some(info), action_info: None };
        let long = [&bytes[..HEAD], &[0], &pair.encode_length_delimited_to_vec()[..]].concat();
        let error = read_demonstrations(path, &long, &spec).unwrap_err().to_string();
        assert!(error.contains("entry 0: found") && error.contains("as Hopper-v5 needs"), "{error}");
        let other = Spec { obs: 7, ..spec.clone() };
        let error = read_demonstrations(path, &bytes, &other).unwrap_err().to_string();
        assert_eq!(error, "hop.demo: entry 0: found 11 observed numbers, expected 7, as Hopper-v5 has");
    }

    #[test]
    fn actions_are_nominal() {
        assert_eq!(nominal([-1.0, 1.0], 0.3), 0.3);
        assert_eq!(nominal([0.0, 4.0], 3.0), 0.5);
        assert_eq!(nominal([0.0, 4.0], 30.0), 1.0);
    }
}
