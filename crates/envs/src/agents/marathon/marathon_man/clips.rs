//! Clips by name: those that come with the crate, and those of a caller.

use std::path::Path;
use std::sync::{Arc, LazyLock, PoisonError, RwLock};

use marathon_motion::Clip;

use crate::agent::Value;
use crate::agent::options::OptionValue;

/// A clip that comes with the crate.
struct Shipped {
    name: &'static str,
    clip: LazyLock<Arc<Clip>>,
}

macro_rules! shipped {
    ($($name:literal),* $(,)?) => {
        [$(Shipped {
            name: $name,
            clip: LazyLock::new(|| {
                let text = include_str!(concat!("../../../../../../assets/motions/marathon_man/", $name, ".motion"));
                let clip = Clip::parse(Path::new(concat!($name, ".motion")), text.as_bytes());
                Arc::new(clip.unwrap_or_else(|error| panic!("{error}")))
            }),
        }),*]
    };
}

static SHIPPED: [Shipped; 3] = shipped!["walk", "run", "backflip"];

/// Clips of callers.
static ADDED: RwLock<Vec<(String, Arc<Clip>)>> = RwLock::new(Vec::new());

/// Makes a clip known under a name, in place of the one that has it so far. What has been made with that one keeps it.
pub fn add(name: &str, clip: Clip) {
    let mut added = ADDED.write().unwrap_or_else(PoisonError::into_inner);
    added.retain(|(known, _)| known != name);
    added.push((name.into(), Arc::new(clip)));
}

/// The clip of a name.
pub fn find(name: &str) -> Option<Arc<Clip>> {
    let added = ADDED.read().unwrap_or_else(PoisonError::into_inner);
    let of_callers = added.iter().find(|(known, _)| known == name).map(|(_, clip)| clip.clone());
    of_callers.or_else(|| SHIPPED.iter().find(|shipped| shipped.name == name).map(|shipped| (*shipped.clip).clone()))
}

/// Names of the clips that come with the crate.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|shipped| shipped.name)
}

/// A clip as an argument: its name.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipName(pub String);

impl OptionValue for ClipName {
    const EXPECTED: &'static str = "the name of a clip that is known";
    fn value(&self) -> Value {
        Value::Text(self.0.clone())
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Text(name) if find(name).is_some() => Some(ClipName(name.clone())),
            _ => None,
        }
    }
}
