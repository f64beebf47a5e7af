//! Clips by name: those that come with the crate, and those of a caller.

use std::path::Path;
use std::sync::{Arc, LazyLock, PoisonError, RwLock};

use marathon_motion::Clip;
use marathon_physics::hint::among;

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

static SHIPPED: [Shipped; 17] = shipped![
    "walk",
    "walk_left",
    "walk_right",
    "run",
    "backflip",
    "spinkick",
    "spin",
    "cartwheel",
    "roll",
    "jump",
    "kick",
    "punch",
    "dance",
    "crawl",
    "getup_facedown",
    "getup_faceup",
    "stand",
];

/// Limit on the numbers in all clips that callers register, 256 MB. Beyond it, older clips are dropped.
const MOST_NUMBERS: usize = 32_000_000;

/// Clips registered by callers, the latest last.
static ADDED: RwLock<Vec<(String, Arc<Clip>)>> = RwLock::new(Vec::new());

/// Registers a clip under a name and replaces an earlier clip of that name. Environments made with the earlier clip
/// keep it. If all registered clips exceed 256 MB, the oldest ones are dropped.
pub fn add(name: &str, clip: Clip) {
    let mut added = ADDED.write().unwrap_or_else(PoisonError::into_inner);
    added.retain(|(known, _)| known != name);
    added.push((name.into(), Arc::new(clip)));
    forget(&mut added, MOST_NUMBERS);
}

/// Drops the oldest clips until the rest fit the limit. The latest one stays.
fn forget(clips: &mut Vec<(String, Arc<Clip>)>, most: usize) {
    let numbers = |clip: &Clip| clip.frames() * (clip.layout().nq() + clip.layout().nv());
    let mut sum = 0;
    let kept = clips.iter().rev().take_while(|(_, clip)| {
        sum += numbers(clip);
        sum <= most
    });
    let kept = kept.count().max(1).min(clips.len());
    clips.drain(..clips.len() - kept);
}

/// The clip of a name.
pub fn find(name: &str) -> Option<Arc<Clip>> {
    let added = ADDED.read().unwrap_or_else(PoisonError::into_inner);
    let of_callers = added.iter().find(|(known, _)| known == name).map(|(_, clip)| clip.clone());
    of_callers.or_else(|| shipped(name))
}

/// The clip of a name that comes with the crate, whatever callers have added.
pub(super) fn shipped(name: &str) -> Option<Arc<Clip>> {
    SHIPPED.iter().find(|shipped| shipped.name == name).map(|shipped| (*shipped.clip).clone())
}

/// Names of all clips that are known, those that come with the crate first.
pub fn all_names() -> Vec<String> {
    let added = ADDED.read().unwrap_or_else(PoisonError::into_inner);
    let of_callers = added.iter().map(|(name, _)| name.clone());
    SHIPPED.iter().map(|shipped| shipped.name.to_string()).chain(of_callers).collect()
}

/// Clips as an argument: their names with commas between them, or [`ALL`].
#[derive(Clone, Debug, PartialEq)]
pub struct ClipNames(pub String);

/// What stands for all clips that come with the crate, but for the one that does not move.
pub const ALL: &str = "all";

/// Most clips of a task. A clip may be named several times.
pub const MOST: usize = 1000;

/// The clip that does not move.
pub const STAND: &str = "stand";

impl OptionValue for ClipNames {
    const EXPECTED: &'static str = "the name of a clip, several with commas between them, or all";
    fn value(&self) -> Value {
        Value::Text(self.0.clone())
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Text(name) => Some(ClipNames(name.clone())),
            _ => None,
        }
    }
}

impl ClipNames {
    /// Each name.
    pub fn names(&self) -> Vec<&str> {
        match self.0.as_str() {
            ALL => SHIPPED.iter().map(|shipped| shipped.name).filter(|name| *name != STAND).collect(),
            names => names.split(',').map(str::trim).collect(),
        }
    }

    /// The clips, as far as they are known.
    pub fn find(&self) -> Vec<Arc<Clip>> {
        self.names().into_iter().filter_map(find).collect()
    }

    /// Whether there are such clips.
    ///
    /// # Errors
    /// If one is missing; the text names the nearest.
    pub fn check(&self) -> Result<(), String> {
        self.check_among(&all_names())
    }

    /// Whether they are `all`, or among some.
    ///
    /// # Errors
    /// If one is not; the text names the nearest.
    pub fn check_among<S: AsRef<str>>(&self, known: &[S]) -> Result<(), String> {
        let count = self.names().len();
        if count > MOST {
            return Err(format!("option clip has {count} clips, expected at most {MOST}"));
        }
        let known: Vec<&str> = known.iter().map(AsRef::as_ref).collect();
        let missing = self.names().into_iter().find(|name| self.0 != ALL && !known.contains(name));
        let Some(missing) = missing else { return Ok(()) };
        Err(format!("option clip is '{missing}', expected a clip that is known{}", among(missing, &known)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_has_a_bounded_number_of_clips() {
        let named = |count: usize| ClipNames(vec!["walk"; count].join(",")).check();
        assert_eq!(named(MOST), Ok(()));
        assert_eq!(named(MOST + 1), Err("option clip has 1001 clips, expected at most 1000".into()));
    }

    #[test]
    fn the_oldest_clips_are_forgotten() {
        let clip = shipped("stand").unwrap();
        let one = clip.frames() * (clip.layout().nq() + clip.layout().nv());
        let mut clips: Vec<_> = ["a", "b", "c"].into_iter().map(|name| (name.to_string(), clip.clone())).collect();
        let names = |clips: &[(String, Arc<Clip>)]| clips.iter().map(|(name, _)| name.clone()).collect::<String>();
        forget(&mut clips, 3 * one);
        assert_eq!(names(&clips), "abc");
        forget(&mut clips, 2 * one);
        assert_eq!(names(&clips), "bc");
        forget(&mut clips, 0);
        assert_eq!(names(&clips), "c");
    }
}
