//! `bevy_marathon` with its default features is a library of at most 200 packages, itself and build scripts included.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

const MOST: usize = 200;

#[test]
fn the_plugin_has_at_most_200_packages() -> Result<(), Box<dyn std::error::Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["tree", "--locked", "--package", "bevy_marathon", "--edges", "normal,build", "--prefix", "none"])
        .current_dir(root)
        .output()?;
    let problem = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cargo tree: {problem}");
    let tree = String::from_utf8(output.stdout)?;
    // a package that was listed before has a mark
    let packages: BTreeSet<&str> = tree.lines().map(|line| line.trim_end_matches(" (*)")).collect();
    assert!(packages.iter().any(|package| package.starts_with("bevy_ecs ")), "{packages:?}");
    assert!(packages.len() <= MOST, "{} packages, expected at most {MOST}: {packages:?}", packages.len());
    for unwanted in ["egui", "clap", "rusqlite", "wgpu", "plotters"] {
        let found = packages.iter().find(|package| package.split(' ').next() == Some(unwanted));
        assert!(found.is_none(), "{found:?} is for features or other crates");
    }
    Ok(())
}
