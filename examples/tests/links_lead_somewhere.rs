//! Relative links in the documentation lead somewhere: to a file, and to a heading where one is named. Every page is in
//! the book's summary, and every example that a command names exists.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the repository")
}

/// All Markdown files that belong to the repository.
fn pages() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a readable folder") {
            let path = entry.expect("a readable entry").path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() && !name.starts_with('.') && !["target", "runs", "node_modules"].contains(&&*name) {
                folders.push(path);
            } else if name.ends_with(".md") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Text outside of code blocks. A block ends where a line has as many ticks as the first one, and nothing else.
fn prose(text: &str) -> String {
    let mut ticks = 0;
    let lines = text.lines().filter(|line| {
        let line = line.trim();
        let found = line.len() - line.trim_start_matches('`').len();
        let inside = ticks > 0;
        if inside && found >= ticks && found == line.len() {
            ticks = 0;
        } else if !inside && found >= 3 {
            ticks = found;
        }
        !inside && ticks == 0
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Targets of `[text](target)`, `![text](target)`, and of `src`, `href` and `poster` in HTML.
fn links(text: &str) -> Vec<String> {
    let markdown = text.split("](").skip(1).filter_map(|rest| rest.split([')', ' ']).next());
    let html = [" src=\"", " href=\"", " poster=\""].map(|start| text.split(start).skip(1));
    let html = html.into_iter().flatten().filter_map(|rest| rest.split('"').next());
    markdown.chain(html).map(str::to_owned).collect()
}

/// Anchors of the headings, as GitHub and mdBook make them. Headings of the same text have numbers.
fn anchors(text: &str) -> BTreeSet<String> {
    let text = prose(text);
    let headings = text.lines().filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    let mut count = BTreeMap::new();
    let slug = |heading: &str| {
        let kept = heading.to_lowercase().replace(' ', "-");
        let slug: String = kept.chars().filter(|c| c.is_alphanumeric() || "-_".contains(*c)).collect();
        let number = count.entry(slug.clone()).or_insert(0);
        *number += 1;
        if *number == 1 { slug } else { format!("{slug}-{}", *number - 1) }
    };
    headings.map(slug).collect()
}

#[test]
fn relative_links_lead_somewhere() {
    let mut broken = Vec::new();
    let mut count = 0;
    for page in pages() {
        let text = std::fs::read_to_string(&page).expect("a readable page");
        for link in links(&prose(&text)) {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            count += 1;
            let (file, anchor) = link.split_once('#').map_or((&*link, None), |(file, anchor)| (file, Some(anchor)));
            let target = if file.is_empty() { page.clone() } else { page.with_file_name("").join(file) };
            let problem = if !target.exists() {
                "there is no such file"
            } else if anchor
                .is_some_and(|a| !anchors(&std::fs::read_to_string(&target).unwrap_or_default()).contains(a))
            {
                "there is no such heading"
            } else {
                continue;
            };
            broken.push(format!("{}: '{link}': {problem}", page.display()));
        }
    }
    assert!(count > 50, "only {count} links found");
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn every_page_is_in_the_summary() {
    let docs = root().join("docs");
    let summary = std::fs::read_to_string(docs.join("SUMMARY.md")).expect("the summary");
    let mut listed = BTreeSet::new();
    for link in links(&summary) {
        assert!(listed.insert(docs.join(&link)), "docs/SUMMARY.md has '{link}' twice");
    }
    let missing: Vec<PathBuf> = pages().into_iter().filter(|page| page.starts_with(&docs)).collect();
    let missing = missing.iter().filter(|page| !page.ends_with("SUMMARY.md") && !listed.contains(*page));
    let missing: Vec<String> = missing.map(|page| page.display().to_string()).collect();
    assert!(missing.is_empty(), "not in docs/SUMMARY.md:\n{}", missing.join("\n"));
}

#[test]
fn examples_that_commands_name_exist() {
    let mut names = BTreeSet::new();
    for page in pages() {
        let text = std::fs::read_to_string(&page).expect("a readable page");
        let after = text.split("-p marathon-examples --bin ").skip(1);
        names.extend(after.filter_map(|rest| rest.split_ascii_whitespace().next()).map(str::to_owned));
    }
    assert!(!names.is_empty(), "some page runs an example");
    for name in names {
        assert!(root().join(format!("examples/{name}.rs")).exists(), "there is no example '{name}'");
    }
}
