//! Training configurations of Marathon, as constants.
//!
//! A program contains only the files that it names.
//!
//! ```
//! const HOPPER: &str = marathon_configs::text("hopper-fast.yaml");
//! assert!(HOPPER.contains("ppo"));
//! ```
#![no_std]
#![forbid(unsafe_code)]

/// All files: path and content.
pub const FILES: &[(&str, &[u8])] = marathon_assets::files![
    "ant-fast.yaml",
    "ant_controller-fast.yaml",
    "ant_controller-recipe.yaml",
    "ant_controller-steady.yaml",
    "controller-adversary.yaml",
    "controller-fast.yaml",
    "controller-steady.yaml",
    "dm_control-fast.yaml",
    "gymnasium-fast.yaml",
    "hopper-fast.yaml",
    "hopper-mlagents.yaml",
    "hopper_controller-recipe.yaml",
    "humanoid-fast.yaml",
    "in_style-fast.yaml",
    "marathon_man-fast.yaml",
    "marathon_man_controller-fast.yaml",
    "marathon_man_controller-recipe.yaml",
    "marathon_man_controller-steady.yaml",
    "marathon_man_steer-fast.yaml",
    "marathon_man_steer-recipe.yaml",
    "marathon_man_steer-steady.yaml",
    "marathon_man_terrain-fast.yaml",
    "paper-appendix-b.yaml",
    "paper-appendix-c.yaml",
    "robot-fast.yaml",
    "terrain-adversary.yaml",
    "terrain-fast.yaml",
    "walker2d-fast.yaml",
    "walker_controller-recipe.yaml",
];

/// The text of a configuration. In a constant, a name that does not exist is an error of the compiler.
///
/// # Panics
/// If there is no such file.
pub const fn text(name: &str) -> &'static str {
    marathon_assets::find_text(FILES, name)
}

#[cfg(test)]
mod tests {
    extern crate std;

    #[test]
    fn every_file_is_listed() {
        let folder = std::fs::read_dir(env!("CARGO_MANIFEST_DIR")).expect("the folder").flatten();
        let mut found = 0;
        for path in folder.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "yaml")) {
            let name = path.file_name().expect("a name").to_string_lossy();
            assert_eq!(std::fs::read(&path).expect("a file"), marathon_assets::find(super::FILES, &name), "{name}");
            found += 1;
        }
        assert_eq!(found, super::FILES.len());
    }
}
