//! The configurations that come with the tasks. Each file names its tasks.

use super::error::ConfigError;
use super::layer::File;
use super::loaded::Loaded;
use super::{document, names};
use std::path::Path;
use std::sync::LazyLock;

macro_rules! preset {
    ($name:literal) => {
        ($name, marathon_configs::text($name))
    };
}

const FILES: [(&str, &str); 15] = [
    preset!("hopper-fast.yaml"),
    preset!("walker2d-fast.yaml"),
    preset!("humanoid-fast.yaml"),
    preset!("ant-fast.yaml"),
    preset!("gymnasium-fast.yaml"),
    preset!("dm_control-fast.yaml"),
    preset!("controller-fast.yaml"),
    preset!("ant_controller-fast.yaml"),
    preset!("robot-fast.yaml"),
    preset!("terrain-fast.yaml"),
    preset!("in_style-fast.yaml"),
    preset!("marathon_man-fast.yaml"),
    preset!("marathon_man_steer-fast.yaml"),
    preset!("marathon_man_controller-fast.yaml"),
    preset!("marathon_man_terrain-fast.yaml"),
];

/// For an adversary that builds the ground of a runner that does not learn.
const ADVERSARY: (&str, &str) = preset!("terrain-adversary.yaml");

static PRESETS: LazyLock<Vec<(&Path, File)>> = LazyLock::new(|| {
    let read = |(name, text): (&'static str, &str)| (Path::new(name), native(name, text));
    FILES.into_iter().map(read).collect()
});

/// A file of the program.
fn native(name: &str, text: &str) -> File {
    let path = Path::new(name);
    let map = document::parse_text(path, text);
    map.and_then(|map| File::read(path, &map)).expect("the program's own configurations are right")
}

/// The configuration that trains an adversary against a runner of a course, which does not learn.
///
/// # Errors
/// If there is none for the task.
pub fn against(task: &str) -> Result<Loaded, ConfigError> {
    let (name, text) = ADVERSARY;
    let (layer, _) = native(name, text).of_task(&names::id(task));
    default_for(task).with(&layer, name.as_ref())
}

/// The preset of a task; the trainer's own defaults for tasks that have none.
///
/// # Panics
/// If a configuration that is part of the program is wrong, which a test rules out.
pub fn default_for(task: &str) -> Loaded {
    let id = names::id(task);
    let names = [id.as_str(), names::base(&id)];
    let found = names.iter().find_map(|name| PRESETS.iter().find(|(_, file)| file.has_task(name)));
    match found {
        Some((path, file)) => {
            let (layer, _) = file.of_task(&id);
            Loaded::default().with(&layer, path).expect("the program's own configurations are right")
        }
        None => Loaded::default(),
    }
}
