//! Trained policies of Marathon, as constants.
//!
//! A program contains only the files that it names. `marathon-learn` reads and runs them.
//!
//! ```
//! const HOPPER: &[u8] = marathon_policies::bytes("hopper.safetensors");
//! assert!(!HOPPER.is_empty());
//! ```
#![no_std]
#![forbid(unsafe_code)]

/// All files: path and content.
pub const FILES: &[(&str, &[u8])] = marathon_assets::files![
    "ant.safetensors",
    "AntController.safetensors",
    "hopper.safetensors",
    "HopperController.safetensors",
    "humanoid.safetensors",
    "HumanoidStyleRun.safetensors",
    "HumanoidStyleWalk.safetensors",
    "MarathonMan.safetensors",
    "MarathonManBackflip.safetensors",
    "MarathonManController.safetensors",
    "MarathonManRun.safetensors",
    "MarathonManSteer.safetensors",
    "MarathonManWalk.safetensors",
    "TerrainMarathonMan.safetensors",
    "TerrainWalker2d.safetensors",
    "walker2d.safetensors",
    "WalkerController.safetensors",
];

/// The bytes of a policy. In a constant, a name that does not exist is an error of the compiler.
///
/// # Panics
/// If there is no such file.
pub const fn bytes(name: &str) -> &'static [u8] {
    marathon_assets::find(FILES, name)
}

#[cfg(test)]
mod tests {
    extern crate std;

    #[test]
    fn every_file_is_listed() {
        let folder = std::fs::read_dir(env!("CARGO_MANIFEST_DIR")).expect("the folder").flatten();
        let mut found = 0;
        for path in folder.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "safetensors"))
        {
            let name = path.file_name().expect("a name").to_string_lossy();
            assert_eq!(std::fs::read(&path).expect("a file"), marathon_assets::find(super::FILES, &name), "{name}");
            found += 1;
        }
        assert_eq!(found, super::FILES.len());
    }
}
