//! Models of the repository.

use marathon_physics::Model;
use std::path::{Path, PathBuf};

/// A file of the repository.
pub fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name)
}

/// All agents' models and the models of the physics' tests, with their paths, in alphabetical order.
pub fn models() -> Vec<(String, Model)> {
    let folders = ["assets/agents", "assets/dm_control", "assets/gymnasium", "crates/physics/tests/models/full"];
    let mut paths: Vec<PathBuf> = Vec::new();
    for folder in folders {
        let entries = std::fs::read_dir(file(folder)).expect("the folder");
        paths.extend(entries.map(|entry| entry.expect("an entry").path()));
    }
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "xml"));
    paths.sort();
    assert!(paths.len() > 30, "{paths:?}");
    let load = |path: PathBuf| (path.display().to_string(), Model::from_xml_file(&path).expect("a model"));
    paths.into_iter().map(load).collect()
}
