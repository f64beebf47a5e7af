//! A run that is interrupted between any two iterations and resumed gives the bits of an uninterrupted one. Damaged
//! checkpoints are refused with a reason.

use crate::common::{PuckTask, silent, small_config, small_of};
use marathon_learn::{Checkpoint, Control, Error, IterationStats, Snapshot, TrainConfig, train};
use marathon_physics::lanes::Isa;
use serde_json::json;
use std::path::Path;

const LIMIT: usize = 30;

fn run(config: &TrainConfig, resume: Option<Checkpoint>) -> Result<Checkpoint, Error> {
    let output = train(&PuckTask::with_limit(LIMIT), Isa::best(), config, resume, &mut silent)?;
    Ok(output.checkpoint)
}

/// The files of a checkpoint without the clocks, which differ between runs.
fn contents(folder: &Path) -> (serde_json::Value, Vec<u8>) {
    let json = std::fs::read(folder.join("checkpoint.json")).unwrap();
    let mut about: serde_json::Value = serde_json::from_slice(&json).unwrap();
    for clock in ["wall_seconds", "cpu_seconds"] {
        assert!(about[clock].is_number());
        about[clock] = 0.into();
    }
    about["config"]["run"]["threads"] = 0.into();
    // including the clocks' checksum
    assert!(about["checksum"].take().is_string());
    let state = std::fs::read(folder.join(about["state"]["name"].as_str().unwrap())).unwrap();
    (about, state)
}

#[test]
fn resumed_run_has_the_bits_of_an_uninterrupted_one() {
    resumed_run_is_whole(&small_config().with(|c| c.run.total_steps = 5 * small_config().run.rollout_steps()), 1);
}

#[test]
fn so_have_those_of_the_other_algorithms() {
    for algorithm in ["a2c", "acktr", "sac"] {
        resumed_run_is_whole(&small_of(algorithm), 4);
    }
}

fn resumed_run_is_whole(config: &TrainConfig, rollouts: u64) {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let whole = dir.path().join("whole");
    run(config, None).unwrap().save(&whole).unwrap();
    let iterations = config.run.total_steps / (rollouts * config.run.rollout_steps());
    for stop_at in (1..iterations.min(5)).map(|i| i * rollouts) {
        // interrupted by the observer, saved, loaded, and resumed with another number of threads
        let folder = dir.path().join(format!("part-{stop_at}"));
        let mut observer = |stats: &IterationStats, snapshot: &Snapshot<'_>| {
            if stats.iteration < stop_at {
                return Control::Continue;
            }
            snapshot.checkpoint().save(&folder).unwrap();
            Control::Stop
        };
        train(&PuckTask::with_limit(LIMIT), Isa::best(), config, None, &mut observer).unwrap();
        let checkpoint = Checkpoint::load(&folder).unwrap();
        assert_eq!((checkpoint.iteration(), checkpoint.agent()), (stop_at, "Puck-v0"));
        assert_eq!(checkpoint.config(), config);
        run(&config.clone().with(|c| c.run.threads = 2), Some(checkpoint)).unwrap().save(&folder).unwrap();
        assert_eq!(contents(&folder), contents(&whole), "interrupted after iteration {stop_at}");
        // the old state is gone
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
    }
}

#[test]
fn finished_run_resumes_to_itself() {
    let first = run(&small_config(), None).unwrap();
    assert_eq!(run(&small_config(), Some(first.clone())).unwrap(), first);
}

#[test]
fn checkpoint_of_something_else_is_refused() {
    let checkpoint = run(&small_config(), None).unwrap();
    let refuse = |config: TrainConfig, text: &str| {
        let error = run(&config, Some(checkpoint.clone())).expect_err("an error").to_string();
        assert!(error.contains(text), "{error}");
    };
    refuse(small_config().with(|c| c.run.agents = 96), "checkpoint: agents is for 80, expected 96");
    refuse(small_config().with(|c| c.network.hidden = vec![7]), "hidden is for [13, 8], expected [7]");
    refuse(
        small_of("acktr").with(|c| {
            c.run.agents = 80;
            c.run.horizon = 24;
        }),
        "checkpoint: algorithm is for ppo, expected acktr",
    );
    refuse(small_config().with(|c| c.run.seed = 9), "seed is for 1, expected 9");
    let task = PuckTask::new().renamed("Puck-v1");
    let error = train(&task, Isa::best(), &small_config(), Some(checkpoint.clone()), &mut silent).err().unwrap();
    assert!(error.to_string().contains("agent is for Puck-v0, expected Puck-v1"), "{error}");
}

#[test]
fn damaged_checkpoints_are_refused() {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let folder = dir.path();
    run(&small_config(), None).unwrap().save(folder).unwrap();
    let description = folder.join("checkpoint.json");
    let json = std::fs::read_to_string(&description).unwrap();
    let mut about: serde_json::Value = serde_json::from_str(&json).unwrap();
    let state = folder.join(about["state"]["name"].as_str().unwrap());
    let bytes = std::fs::read(&state).unwrap();
    let error = || Checkpoint::load(folder).expect_err("an error").to_string();

    std::fs::write(&state, &bytes[..bytes.len() / 2]).unwrap();
    assert!(error().contains("length: found"), "{}", error());
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 4;
    std::fs::write(&state, &flipped).unwrap();
    assert!(error().contains("checksum"), "{}", error());
    std::fs::remove_file(&state).unwrap();
    assert!(error().contains("state-"), "{}", error());
    std::fs::write(&state, &bytes).unwrap();
    let whole = Checkpoint::load(folder).unwrap();
    let steps = whole.steps();

    // changes after the file was written
    std::fs::write(&description, json.replacen("\"agents\": 80", "\"agents\": 96", 1)).unwrap();
    assert!(error().contains("checkpoint.json: checksum: found "), "{}", error());

    // a description edited by hand has no checksum, but its values are checked
    about.as_object_mut().unwrap().remove("checksum").expect("a checksum");
    let json = serde_json::to_string_pretty(&about).unwrap();
    std::fs::write(&description, &json).unwrap();
    assert_eq!(Checkpoint::load(folder).unwrap(), whole);
    for (from, to, text) in [
        ("marathon-checkpoint", "marathon-policy", "format: found"),
        (
            "\"version\": 3",
            "\"version\": 1",
            "checkpoint.json: version: found 1, expected 3, which this program supports",
        ),
        (
            "\"version\": 3",
            "\"version\": 7",
            "checkpoint.json: version: found 7, expected 3, which this program supports",
        ),
        ("\"agents\": 80", "\"agents\": 81", "config.run.agents: found 81, expected a multiple of 16, such as 80"),
        ("\"horizon\": 24", "\"horizon\": -24", "config.run.horizon: found 'invalid value: integer `-24`"),
        ("\"lr\"", "\"lrr\"", "lr"),
        ("state-", "../state-", "a file in the same folder"),
        ("{", "[", "JSON"),
    ] {
        assert!(json.contains(from), "{from} in {json}");
        std::fs::write(&description, json.replacen(from, to, 1)).unwrap();
        assert!(error().contains(text), "{}", error());
    }
    for (key, value, text) in [
        ("learner/lr", json!(-1.0), "lr: found -1, expected a number not below 0"),
        ("observation_count", json!(-5.0), "observation_count: found -5, expected a number not below 0"),
        ("return_count", json!(-1e-9), "return_count: found -0.000000001, expected a number not below 0"),
        ("return_var", json!(-2.0), "return_var: found -2, expected a number not below 0"),
        ("wall_seconds", json!(-1.0), "wall_seconds: found -1, expected a number not below 0"),
        ("learner/adam_power_2", json!(1.5), "adam_power_2: found 1.5, expected a number between 0 and 1"),
        ("steps", json!(1_u64 << 63), "steps: found 9223372036854775808, expected"),
        ("steps", json!(steps + 1), "expected a multiple of the 80 agents"),
        ("iteration", json!(0), "steps: found"),
        ("iteration", json!(-3), "iteration: found 'invalid value: integer `-3`"),
        ("obs", json!(1.5), "obs: found 'invalid type"),
    ] {
        let mut changed = about.clone();
        *changed.pointer_mut(&format!("/{key}")).unwrap() = value;
        std::fs::write(&description, changed.to_string()).unwrap();
        assert!(error().contains(&format!("checkpoint.json: {text}")) || error().contains(text), "{key}: {}", error());
    }
    std::fs::write(&description, b"\xff\xfe").unwrap();
    assert!(error().contains("UTF-8"), "{}", error());
    std::fs::remove_file(&description).unwrap();
    assert!(error().contains("checkpoint.json: read"), "{}", error());
}

/// A flipped bit in the description, as from a bad disk, is either detected or has no effect.
#[test]
fn a_flipped_bit_is_refused_or_changes_nothing() {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let folder = dir.path();
    run(&small_config(), None).unwrap().save(folder).unwrap();
    let whole = Checkpoint::load(folder).unwrap();
    let description = folder.join("checkpoint.json");
    let bytes = std::fs::read(&description).unwrap();
    let mut refused = 0;
    // two bits of every byte, covering all eight in turn
    for (place, bit) in (0..bytes.len()).flat_map(|place| [place % 4, place % 4 + 4].map(|bit| (place, bit))) {
        let mut flipped = bytes.clone();
        flipped[place] ^= 1 << bit;
        std::fs::write(&description, &flipped).unwrap();
        match Checkpoint::load(folder) {
            Ok(loaded) => assert_eq!(loaded, whole, "bit {bit} of byte {place}"),
            Err(_) => refused += 1,
        }
    }
    assert!(refused > bytes.len(), "{refused} of {}", 2 * bytes.len());
}

/// Numbers with a wrong length are refused, too, even with a correct checksum.
#[test]
fn truncated_environments_are_refused() {
    struct Shrunk(PuckTask);
    struct ShrunkShard(Box<dyn marathon_envs::Shard>);
    impl marathon_envs::ShardFactory for Shrunk {
        fn spec(&self) -> &marathon_envs::Spec {
            self.0.spec()
        }
        fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn marathon_envs::Shard> {
            Box::new(ShrunkShard(self.0.shard(first, blocks, seed)))
        }
    }
    impl marathon_envs::Shard for ShrunkShard {
        fn spec(&self) -> &marathon_envs::Spec {
            self.0.spec()
        }
        fn blocks(&self) -> usize {
            self.0.blocks()
        }
        fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
            self.0.reset(block, mask, obs)
        }
        fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut marathon_envs::BlockStep) {
            self.0.step(block, action, obs, out)
        }
        fn save(&self, block: usize, bytes: &mut Vec<u8>) {
            self.0.save(block, bytes);
            bytes.pop();
        }
        fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], marathon_envs::EnvError> {
            self.0.load(block, bytes)
        }
    }
    let task = Shrunk(PuckTask::new());
    let saved = train(&task, Isa::best(), &small_config(), None, &mut silent).unwrap().checkpoint;
    let error = train(&task, Isa::best(), &small_config(), Some(saved), &mut silent).err().unwrap();
    assert!(error.to_string().contains("bytes of block 0's environment"), "{error}");
}
