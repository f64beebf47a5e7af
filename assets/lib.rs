//! Models (MJCF), motion clips, retargeting maps and skins of Marathon, as constants.
//!
//! A program contains only the files that it names.
//!
//! ```
//! const HOPPER: &str = marathon_assets::text("agents/hopper.xml");
//! assert!(HOPPER.contains("<mujoco"));
//! ```
#![no_std]
#![forbid(unsafe_code)]

/// A list of files, beside the file that names them: path and content.
#[doc(hidden)]
#[macro_export]
macro_rules! files {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_bytes!($path))),*]
    };
}

/// All files: path and content.
pub const FILES: &[(&str, &[u8])] = files![
    "agents/ant.xml",
    "agents/hopper.xml",
    "agents/humanoid.xml",
    "agents/marathon_man.xml",
    "agents/quadruped.xml",
    "agents/walker2d.xml",
    "dm_control/cheetah.xml",
    "dm_control/hopper.xml",
    "dm_control/humanoid.xml",
    "dm_control/walker.xml",
    "gymnasium/ant.xml",
    "gymnasium/half_cheetah.xml",
    "gymnasium/hopper.xml",
    "gymnasium/humanoid.xml",
    "gymnasium/humanoidstandup.xml",
    "gymnasium/inverted_double_pendulum.xml",
    "gymnasium/inverted_pendulum.xml",
    "gymnasium/pusher.xml",
    "gymnasium/reacher.xml",
    "gymnasium/swimmer.xml",
    "gymnasium/walker2d.xml",
    "motions/humanoid/run.motion",
    "motions/humanoid/walk.motion",
    "motions/mappings/humanoid.json",
    "motions/mappings/marathon_man.json",
    "motions/mappings/walker2d.json",
    "motions/marathon_man/backflip.motion",
    "motions/marathon_man/cartwheel.motion",
    "motions/marathon_man/crawl.motion",
    "motions/marathon_man/dance.motion",
    "motions/marathon_man/getup_facedown.motion",
    "motions/marathon_man/getup_faceup.motion",
    "motions/marathon_man/jump.motion",
    "motions/marathon_man/kick.motion",
    "motions/marathon_man/punch.motion",
    "motions/marathon_man/roll.motion",
    "motions/marathon_man/run.motion",
    "motions/marathon_man/spin.motion",
    "motions/marathon_man/spinkick.motion",
    "motions/marathon_man/stand.motion",
    "motions/marathon_man/walk.motion",
    "motions/marathon_man/walk_left.motion",
    "motions/marathon_man/walk_right.motion",
    "motions/walker2d/run.motion",
    "motions/walker2d/walk.motion",
    "props/boxes.xml",
    "skins/marathon_man.glb",
];

/// The text of a file. In a constant, a path that does not exist is an error of the compiler.
///
/// # Panics
/// If there is no such file.
pub const fn text(path: &str) -> &'static str {
    find_text(FILES, path)
}

/// The bytes of a file. In a constant, a path that does not exist is an error of the compiler.
///
/// # Panics
/// If there is no such file.
pub const fn bytes(path: &str) -> &'static [u8] {
    find(FILES, path)
}

/// The content of the file with a path in a list like [`FILES`].
///
/// # Panics
/// If there is no such file.
pub const fn find(files: &[(&str, &'static [u8])], path: &str) -> &'static [u8] {
    let mut i = 0;
    while i < files.len() {
        if equal(files[i].0.as_bytes(), path.as_bytes()) {
            return files[i].1;
        }
        i += 1;
    }
    panic!("no file has this path")
}

/// The same as text.
///
/// # Panics
/// If there is no such file, or it is not text.
pub const fn find_text(files: &[(&str, &'static [u8])], path: &str) -> &'static str {
    match core::str::from_utf8(find(files, path)) {
        Ok(text) => text,
        Err(_) => panic!("this file is not text"),
    }
}

/// `a == b`, for constants.
const fn equal(a: &[u8], b: &[u8]) -> bool {
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::path::Path;
    use std::vec::Vec;

    #[test]
    fn every_file_is_listed() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut folders: Vec<_> =
            ["agents", "dm_control", "gymnasium", "motions", "props", "skins"].map(|f| root.join(f)).into();
        let mut found = 0;
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).expect("the folder").flatten() {
                let path = entry.path();
                if path.is_dir() {
                    folders.push(path);
                } else if ["xml", "json", "motion", "glb"].iter().any(|e| path.extension().is_some_and(|x| x == *e)) {
                    let name = path.strip_prefix(root).expect("below the root").to_string_lossy().replace('\\', "/");
                    assert_eq!(std::fs::read(&path).expect("a file"), super::bytes(&name), "{name}");
                    found += 1;
                }
            }
        }
        assert_eq!(found, super::FILES.len());
    }

    #[test]
    #[should_panic(expected = "no file has this path")]
    fn an_unknown_path_is_refused() {
        super::bytes("agents/hopper.xm");
    }
}
