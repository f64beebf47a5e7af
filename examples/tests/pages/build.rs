//! Writes the blocks of Rust in the pages of the documentation as modules of documentation tests.
//!
//! Each page becomes a source file of comments with the page's line numbers, so that messages name them. Pages with
//! blocks for Bevy are left out: the crate `bevy_marathon` compiles them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// Comments above a block that is not tested begin so.
const SKIP: &str = "<!-- test: skip";

fn main() -> io::Result<()> {
    let examples = PathBuf::from(env::var("CARGO_MANIFEST_DIR").expect("Cargo sets it"));
    let out = PathBuf::from(env::var("OUT_DIR").expect("Cargo sets it"));
    let root = examples.parent().expect("the folder of the repository");
    println!("cargo:rerun-if-changed=tests/pages/build.rs");
    let mut pages = Vec::new();
    for name in ["README.md", "docs"] {
        println!("cargo:rerun-if-changed={}", root.join(name).display());
        collect(&root.join(name), &mut pages)?;
    }
    pages.sort();
    let mut modules = String::new();
    for page in pages {
        let name = page.strip_prefix(root).expect("a page of the repository").with_extension("");
        let Some(comments) = tests(&fs::read_to_string(&page)?) else { continue };
        let file = out.join(&name).with_extension("rs");
        fs::create_dir_all(file.parent().expect("a folder"))?;
        fs::write(&file, comments)?;
        let module = name.to_string_lossy().to_lowercase().replace(|c: char| !c.is_ascii_alphanumeric(), "_");
        writeln!(modules, "#[path = {file:?}]\nmod {module};").expect("text grows");
    }
    fs::write(out.join("pages.rs"), modules)
}

/// Pages below a path.
fn collect(path: &Path, pages: &mut Vec<PathBuf>) -> io::Result<()> {
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            collect(&entry?.path(), pages)?;
        }
    } else if path.extension().is_some_and(|extension| extension == "md") {
        pages.push(path.into());
    }
    Ok(())
}

/// The page's blocks of Rust as comments of a module, every other line empty; `None` without such blocks, or if
/// one of them is for Bevy.
fn tests(page: &str) -> Option<String> {
    let mut lines: Vec<&str> = Vec::new();
    let mut rest = page.lines();
    let (mut skipped, mut found) = (false, false);
    while let Some(line) = rest.next() {
        let fence = line.trim_start();
        lines.push("");
        if !fence.starts_with("```") {
            skipped = fence.starts_with(SKIP) || skipped && fence.starts_with("<!-- test:");
            continue;
        }
        let ticks = fence.len() - fence.trim_start_matches('`').len();
        let indent = line.len() - fence.len();
        let start = lines.len();
        for code in rest.by_ref() {
            lines.push(code.get(indent..).unwrap_or_default());
            if code.trim() == &fence[..ticks] {
                break;
            }
        }
        if fence[ticks..].split([',', ' ']).next() == Some("rust") && !skipped {
            if lines[start..].iter().any(|code| code.contains("bevy")) {
                return None;
            }
            lines[start - 1] = fence;
            found = true;
        } else {
            lines[start..].fill("");
        }
        skipped = false;
    }
    let comments = lines.iter().map(|line| format!("//! {line}\n").replace("//! \n", "//!\n"));
    found.then(|| comments.collect())
}
