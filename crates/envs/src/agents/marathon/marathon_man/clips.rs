//! Clips that come with the crate, and options that take clips.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use marathon_motion::Clip;
use marathon_physics::hint::among;

use crate::agent::{Clips, NamedClip};

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
                let text = const { marathon_assets::text(concat!("motions/marathon_man/", $name, ".motion")) };
                let clip = Clip::shipped(Path::new(concat!($name, ".motion")), text);
                Arc::new(clip.unwrap_or_else(|error| panic!("{error}")))
            }),
        }),*]
    };
}

#[cfg(feature = "suite")]
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

/// Those of the controller: all of them are a tenth of what a visitor of a page would download.
#[cfg(not(feature = "suite"))]
static SHIPPED: [Shipped; 9] =
    shipped!["walk", "walk_left", "walk_right", "run", "backflip", "jump", "getup_facedown", "getup_faceup", "stand",];

/// The clip of a name that comes with the crate.
pub fn shipped(name: &str) -> Option<Arc<Clip>> {
    SHIPPED.iter().find(|shipped| shipped.name == name).map(|shipped| (*shipped.clip).clone())
}

/// Names of all clips that come with the crate.
pub fn names() -> Vec<&'static str> {
    SHIPPED.iter().map(|shipped| shipped.name).collect()
}

/// Name for all clips that come with the crate, except [`STAND`].
pub const ALL: &str = "all";

/// The clip that does not move.
pub const STAND: &str = "stand";

/// Whether an option has [`ALL`] clips.
pub fn is_all(option: &Clips) -> bool {
    option.to_string() == ALL
}

/// The clips of an option, one by one.
pub fn each(option: &Clips) -> Clips {
    match is_all(option) {
        true => names().into_iter().filter(|name| *name != STAND).map(NamedClip::shipped).collect(),
        false => option.clone(),
    }
}

/// The clips of an option, as far as there are any of these names.
pub fn find(option: &Clips) -> Vec<Arc<Clip>> {
    let find = |clip: NamedClip| clip.clip().cloned().or_else(|| shipped(clip.name()));
    each(option).into_iter().filter_map(find).collect()
}

/// Whether the option `name` has clips of these names, and no others but given ones, where they are allowed.
///
/// # Errors
/// If one is missing; the text names the nearest.
pub fn check(name: &str, option: &Clips, known: &[&str], allow_given: bool) -> Result<(), String> {
    let count = option.iter().count();
    if count > Clips::MOST {
        return Err(format!("option {name} has {count} clips, expected at most {}", Clips::MOST));
    }
    let is_known = |clip: &&NamedClip| known.contains(&clip.name()) || (allow_given && clip.clip().is_some());
    match option.iter().find(|clip| !is_known(clip)) {
        Some(missing) if !is_all(option) => {
            let (clip, hint) = (missing.name(), among(missing.name(), known));
            Err(format!("option {name} is '{clip}', expected a clip that is known{hint}"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_has_a_bounded_number_of_clips() {
        let named = |count: usize| check("clip", &Clips::named(&vec!["walk"; count].join(",")), &names(), true);
        assert_eq!(named(Clips::MOST), Ok(()));
        assert_eq!(named(Clips::MOST + 1), Err("option clip has 1001 clips, expected at most 1000".into()));
    }
}
