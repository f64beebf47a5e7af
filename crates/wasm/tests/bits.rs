//! States and weights natively, to which the tests of the module in Node and in browsers compare theirs: `bits.json`.

use fnv::FnvHasher;
use marathon_config::parse_object;
use marathon_envs::{VecEnv, VecEnvOptions};
use marathon_learn::TrainLoop;
use marathon_physics::{Batch, BatchOptions, Isa, Model};
use marathon_wasm::hash;
use serde_json::Value;
use std::hash::Hasher;

const EXPECTED: &str = include_str!("bits.json");
const AGENTS: usize = 16;
const STEPS: usize = 1000;

fn expected() -> Value {
    serde_json::from_str(EXPECTED).expect("JSON")
}

/// A whole number from -8 to 8, divided by 8: the same in all languages.
fn action(step: usize, i: usize) -> f32 {
    ((step * 7 + i * 13) % 17) as f32 / 8.0 - 1.0
}

fn states(task: &str, isa: Isa) -> String {
    let options = VecEnvOptions { agents: AGENTS, seed: 1, threads: 1, isa: Some(isa), ..Default::default() };
    let mut env = VecEnv::new(task, &options).expect("a task");
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).expect("a start");
    let actions = AGENTS * env.spec().act;
    for step in 0..STEPS {
        let actions: Vec<f32> = (0..actions).map(|i| action(step, i)).collect();
        env.step(&actions, &mut out).expect("a step");
    }
    let numbers = (0..AGENTS).flat_map(|agent| {
        let state = env.state(agent).expect("an agent");
        [state.qpos, state.qvel].concat()
    });
    format!("{:016x}", hash(numbers))
}

#[test]
fn states_have_the_bits_of_all_instruction_sets() {
    for (task, expected) in expected()["states"].as_object().expect("tasks") {
        for isa in Isa::ALL.into_iter().filter(|isa| *isa != Isa::F64 && isa.supported()) {
            assert_eq!(states(task, isa), *expected, "{task} with {}", isa.name());
        }
    }
}

/// The same for a model by itself.
fn states_of_model(file: &str, isa: Isa) -> String {
    let path = format!("{}/../../assets/{file}", env!("CARGO_MANIFEST_DIR"));
    let model = Model::from_xml_file(path).expect("a model");
    // more agents than one, which would be simulated in one lane
    let mut batch = Batch::new(&model, &BatchOptions { agents: 2, isa, ..Default::default() }).expect("a batch");
    for step in 0..STEPS {
        let ctrl: Vec<f64> = (0..2 * model.nu).map(|i| f64::from(action(step, i % model.nu))).collect();
        batch.step(&ctrl, 1);
    }
    format!("{:016x}", hash([batch.qpos(0), batch.qvel(0)].concat()))
}

#[test]
fn states_of_models_have_the_bits_of_all_instruction_sets() {
    for (file, expected) in expected()["models"].as_object().expect("files") {
        for isa in Isa::ALL.into_iter().filter(|isa| *isa != Isa::F64 && isa.supported()) {
            assert_eq!(states_of_model(file, isa), *expected, "{file} with {}", isa.name());
        }
    }
}

#[test]
fn a_short_training_has_the_bits_of_all_instruction_sets() {
    let expected = &expected()["training"];
    let (task, config) = (expected["task"].as_str().expect("a task"), expected["config"].to_string());
    let mut loaded = parse_object("config", &config, task).expect("a configuration");
    loaded.config.run.threads = 1;
    for isa in Isa::ALL.into_iter().filter(|isa| *isa != Isa::F64 && isa.supported()) {
        let factory = marathon_envs::factory(task, isa).expect("a task");
        let mut run = TrainLoop::new(&*factory, isa, &loaded.config).expect("a run");
        while !run.is_done() {
            run.iterate().expect("an iteration");
        }
        let mut hasher = FnvHasher::default();
        hasher.write(&run.policy().to_bytes());
        assert_eq!(format!("{:016x}", hasher.finish()), expected["policy"], "with {}", isa.name());
    }
}
