//! Pages with programs for Bevy are documentation tests of `bevy_marathon`: this crate's own tests know no Bevy.

use std::path::{Path, PathBuf};

fn pages(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a readable folder");
    let paths = entries.map(|entry| entry.expect("a readable entry").path());
    paths.flat_map(|path| if path.is_dir() { pages(&path) } else { vec![path] }).collect()
}

/// Whether a page has a block of Rust that names Bevy.
fn has_bevy(page: &str) -> bool {
    let mut blocks = page.split("```rust").skip(1).filter_map(|rest| rest.split("```").next());
    blocks.any(|block| block.contains("bevy"))
}

#[test]
fn the_plugin_tests_every_page_with_bevy() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let plugin = std::fs::read_to_string(root.join("crates/bevy_marathon/src/lib.rs")).expect("the plugin");
    for page in pages(&root.join("docs")).into_iter().chain([root.join("README.md")]) {
        let name = page.strip_prefix(&root).expect("a page of the repository").display();
        let is_page = page.extension().is_some_and(|extension| extension == "md");
        if is_page && has_bevy(&std::fs::read_to_string(&page).expect("a readable page")) {
            let included = plugin.contains(&format!("include_str!(\"../../../{name}\")"));
            assert!(included, "{name} has programs for Bevy: include it in crates/bevy_marathon/src/lib.rs");
        }
    }
}
