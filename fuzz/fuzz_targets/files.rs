//! Any bytes are a file of a run, or give an error that names the file. The readers cover policies, networks,
//! configurations, demonstrations, tables, events and descriptions. The target also uses what it has read.

#![no_main]

use libfuzzer_sys::fuzz_target;
use marathon_config::parse;
use marathon_learn::{Checkpoint, Policy};
use marathon_mlagents::read_demonstrations;
use marathon_runs::report::csv::{CsvLog, History};
use marathon_runs::report::tensorboard::EventLog;
use marathon_runs::{RunFolder, RunOptions, Session, TaskConfig};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Number of readers.
const READERS: u8 = 8;

fuzz_target!(|data: &[u8]| {
    let Some((kind, bytes)) = data.split_first() else { return };
    read(chosen().unwrap_or(*kind) % READERS, bytes);
});

/// The reader whose number is in `FILE_READER`, to fuzz only that one.
fn chosen() -> Option<u8> {
    static CHOSEN: OnceLock<Option<u8>> = OnceLock::new();
    *CHOSEN.get_or_init(|| std::env::var("FILE_READER").ok()?.parse().ok())
}

fn read(kind: u8, bytes: &[u8]) {
    let path = Path::new("fuzzed.any");
    let names_it = |error: String| assert!(error.contains("fuzzed"), "an error names the file: {error}");
    match kind {
        0 => match Policy::load_unsealed(&written("fuzzed.safetensors", bytes)) {
            Ok(policy) => used(&policy),
            Err(error) => names_it(error.to_string()),
        },
        1 => match Policy::from_onnx(path, bytes, None) {
            Ok(policy) => used(&policy),
            Err(error) => names_it(error.to_string()),
        },
        2 => match parse(path, bytes, "hopper") {
            Ok(loaded) => loaded.config.validate().expect("what is accepted is valid"),
            Err(error) => names_it(error.to_string()),
        },
        3 => {
            let spec = TaskConfig::named("hopper").unwrap().factory().unwrap().spec().clone();
            if let Err(error) = read_demonstrations(path, bytes, &spec) {
                names_it(error.to_string());
            }
        }
        4 => {
            let file = written("fuzzed.csv", bytes);
            let _ = CsvLog::open(&file, 3).map(|mut log| log.push(&[("iteration".into(), Some(4.0))]));
            if let Ok(history) = History::read(&file) {
                let _ = ["steps", "return_mean", "iteration"].map(|name| history.column(name));
            }
        }
        5 => {
            let run = run();
            for old in std::fs::read_dir(&run).unwrap().flatten() {
                if old.file_name().to_string_lossy().contains("tfevents") {
                    std::fs::remove_file(old.path()).unwrap();
                }
            }
            std::fs::write(run.join("events.out.tfevents.0000000001.marathon.0000"), bytes).unwrap();
            let (folder, _) = RunFolder::open(&run).unwrap();
            EventLog::open(&folder, 5).unwrap();
        }
        6 => {
            let run = folder().join("fuzzed");
            std::fs::create_dir_all(&run).unwrap();
            std::fs::write(run.join("run.json"), bytes).unwrap();
            let options = RunOptions { resume: Some(run), ..RunOptions::default() };
            let _ = Session::open(None, &options, None, true);
        }
        _ => {
            let checkpoint = folder().join("checkpoint-fuzzed");
            std::fs::create_dir_all(&checkpoint).unwrap();
            std::fs::write(checkpoint.join("checkpoint.json"), bytes).unwrap();
            if let Err(error) = Checkpoint::load(&checkpoint) {
                names_it(error.to_string());
            }
        }
    }
}

/// Acts with the policy, and creates its task if there is one.
fn used(policy: &Policy) {
    let action = policy.act(&vec![0.5; policy.meta().obs]);
    assert_eq!(action.len(), policy.meta().act);
    let _ = TaskConfig::of_policy(policy.meta()).factory();
}

/// A folder for this process.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("marathon-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    })
}

fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// The folder of a run.
fn run() -> PathBuf {
    static RUN: OnceLock<PathBuf> = OnceLock::new();
    RUN.get_or_init(|| {
        let run = folder().join("run");
        let task = TaskConfig::named("hopper").unwrap();
        let file = marathon_runs::RunFile::new(&task, &marathon_config::default_for("hopper"));
        let made = RunFolder::create(Some(&run), "hopper").unwrap();
        made.begin(&file).unwrap();
        run
    })
    .clone()
}
