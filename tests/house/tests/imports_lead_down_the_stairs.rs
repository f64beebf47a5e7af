//! The house stands as `docs/project/architecture.md` says:
//!
//! 1. The page names every crate and every room, and no other.
//! 2. A crate depends only on crates below it.
//! 3. A room imports only from rooms below it. So there is no ring of rooms that import each other.
//! 4. Files do not import each other in circles, inside the rooms either.
//! 5. The picture on the page shows the house of today.
//! 6. The tests of a crate are one program, and no file is left out of it.

use house::{Crate, House, Order, Step, picture};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn today() -> (House, Order) {
    let order = Order::read(&root().join("docs/project/architecture.md")).expect("the page is there");
    (House::read(&root()).expect("the sources can be read"), order)
}

/// Names that only one of the two lists has.
fn differences<'a>(said: &'a [Step], found: impl Iterator<Item = &'a String>) -> Vec<&'a str> {
    let said: BTreeSet<&str> = said.iter().map(|step| step.name.as_str()).collect();
    let found: BTreeSet<&str> = found.map(String::as_str).collect();
    said.symmetric_difference(&found).copied().collect()
}

/// Faults of a crate whose rooms have a declared order.
fn faults(found: &Crate, steps: &[Step]) -> Vec<String> {
    let level = |room: &str| steps.iter().position(|step| step.name == room);
    let wrong = |import: &&house::Import| level(&import.to) >= level(&import.from);
    let fault = |i: &house::Import| {
        format!("crates/{}/src/{}:{}: {} imports {}", found.name, i.file.display(), i.line, i.from, i.to)
    };
    found.between_rooms().filter(wrong).map(fault).collect()
}

#[test]
fn the_page_names_every_crate_and_room() {
    let (house, order) = today();
    assert_eq!(differences(&order.crates, house.crates.iter().map(|c| &c.name)), [""; 0], "on the page or in crates/");
    for found in &house.crates {
        let steps = order.rooms.iter().find(|(name, _)| *name == found.name).map_or(&[][..], |(_, steps)| steps);
        let differ = differences(steps, found.rooms.iter().map(|r| &r.name));
        assert_eq!(differ, [""; 0], "on the page or in crates/{}/src", found.name);
    }
}

#[test]
fn crates_depend_on_crates_below() {
    let (house, order) = today();
    let level = |name: &str| order.crates.iter().position(|step| step.name == name);
    for found in &house.crates {
        for needed in &found.depends_on {
            assert!(level(needed) < level(&found.name), "{} depends on {needed}, which stands above it", found.name);
        }
    }
}

#[test]
fn rooms_import_from_rooms_below() {
    let (house, order) = today();
    let mut wrong = Vec::new();
    for found in &house.crates {
        if let Some(ring) = found.ring() {
            wrong.push(format!("crates/{}: a ring of imports: {}", found.name, ring.join(", ")));
        }
        let steps = order.rooms.iter().find(|(name, _)| *name == found.name).map_or(&[][..], |(_, steps)| steps);
        wrong.extend(faults(found, steps));
    }
    assert!(wrong.is_empty(), "imports against the order of docs/project/architecture.md:\n{}", wrong.join("\n"));
}

#[test]
fn files_do_not_import_each_other_in_circles() {
    let (house, _) = today();
    let mut wrong = Vec::new();
    for found in &house.crates {
        let circles = found.circles();
        for circle in &circles {
            wrong.push(format!("crates/{}/src:", found.name));
            wrong.extend(
                found
                    .imports_within(circle)
                    .map(|i| format!("  {}:{} imports {}", i.file.display(), i.line, i.target.display())),
            );
        }
    }
    assert!(wrong.is_empty(), "files that import each other in circles:\n{}", wrong.join("\n"));
}

#[test]
fn the_picture_shows_the_house_of_today() {
    let (house, order) = today();
    let drawn = std::fs::read_to_string(root().join("docs/images/house.svg")).expect("the picture is there");
    // a few lines more or less do not matter, rooms and dependencies do
    let words = |svg: &str| -> Vec<String> {
        let texts = svg.lines().filter(|l| l.starts_with("<text") && !l.contains(" lines</text>"));
        texts.filter_map(|l| Some(l.split_once('>')?.1.strip_suffix("</text>")?.to_string())).collect()
    };
    assert_eq!(words(&drawn), words(&picture::svg(&house, &order)), "run cargo run -p house to draw it again");
}

/// Writes a crate of some files into a folder of its own and reads it.
fn crate_of(files: &[(&str, &str)]) -> Crate {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
    Crate::read("test".into(), folder.path(), BTreeSet::new()).expect("a crate")
}

fn pairs(found: &Crate) -> Vec<(&str, &str, usize)> {
    found.between_rooms().map(|i| (i.from.as_str(), i.to.as_str(), i.line)).collect()
}

#[test]
fn imports_are_found_wherever_they_hide() {
    let found = crate_of(&[
        (
            "lib.rs",
            "mod a;\nmod b;\nmod c;\nmod d;\npub use b::deep::Thing;\npub use crate::c::Other as Door;\npub struct Own;",
        ),
        (
            "a.rs",
            "use crate::{\n    Thing,\n    Door,\n};\nfn f() { crate::c::g(); }\nfn h() { println!(\"{}\", [crate::d::x(1)]); }",
        ),
        ("b/mod.rs", "mod deep;\nuse super::Own;\nuse self::deep::Thing;"),
        ("b/deep.rs", "use super::super::c::Other;\nuse super::other;\n#[cfg(test)]\nmod tests { use crate::a::f; }"),
        ("c.rs", "pub struct Other;\nuse std::fmt;"),
        ("d/mod.rs", "pub fn x(n: u32) {}\n#[cfg(test)]\nmod tests;"),
        ("d/tests.rs", "use crate::a::f;"),
    ]);
    let expected = [("a", "b", 2), ("a", "c", 3), ("a", "c", 5), ("a", "d", 6), ("b", "c", 1), ("b", "lib", 2)];
    let mut all = pairs(&found);
    all.sort();
    assert_eq!(all, expected);
    assert_eq!(found.ring(), None);
}

#[test]
fn rings_and_wrong_ways_are_found() {
    let found = crate_of(&[
        ("lib.rs", "mod a;\nmod b;\nmod c;"),
        ("a.rs", "use crate::b;"),
        ("b.rs", "use crate::c;"),
        ("c.rs", "use super::a;"),
    ]);
    assert_eq!(found.ring().map(|ring| ring.len()), Some(3));
    let step = |name: &str| Step { name: name.into(), about: String::new() };
    assert_eq!(faults(&found, &[step("c"), step("b"), step("a")]), ["crates/test/src/c.rs:1: c imports a"]);
}

#[test]
fn circles_of_files_are_found() {
    let circles = |files: &[(&str, &str)]| -> Vec<String> {
        let found = crate_of(files);
        let names = |circle: &Vec<&Path>| circle.iter().map(|file| file.display().to_string()).collect::<Vec<_>>();
        found.circles().iter().map(|circle| names(circle).join(" ")).collect()
    };
    // through names that a folder and the crate pass on, macros included
    let passed_on = [
        ("lib.rs", "mod f;\npub use f::{A, B};"),
        ("f/mod.rs", "mod a;\nmod b;\nmod c;\npub use a::A;\npub use b::B;"),
        ("f/a.rs", "use super::B;\npub struct A;"),
        ("f/b.rs", "pub struct B;\nfn f() { use_it!(crate::f::c::C); }"),
        ("f/c.rs", "pub use super::b;\npub struct C(b::B, crate::A);"),
    ];
    assert_eq!(circles(&passed_on), ["f/a.rs f/b.rs f/c.rs"]);
    // a module may use the files below it, and they what it shares with them
    let module = [
        ("lib.rs", "mod f;\nfn g() { f::call() }\npub struct Shared;"),
        ("f/mod.rs", "mod a;\nuse a::A;\npub struct B;\npub fn call() { a::f() }"),
        ("f/a.rs", "use super::B;\nuse crate::Shared;\npub struct A;\npub fn f() {}"),
    ];
    assert_eq!(circles(&module), [""; 0]);
    // but folders must not use each other, whichever of their files does
    let folders = [
        ("lib.rs", "mod f;\nmod g;"),
        ("f/mod.rs", "mod a;\npub struct F(a::A);"),
        ("f/a.rs", "use crate::g::G;\npub struct A;"),
        ("g/mod.rs", "mod b;\npub use b::G;"),
        ("g/b.rs", "use crate::f::F;\npub struct G;"),
    ];
    assert_eq!(circles(&folders), ["f/a.rs f/mod.rs g/b.rs"]);
    // neither unit tests nor names of other crates and functions count
    let none = [
        ("lib.rs", "mod a;\nmod b;"),
        ("a.rs", "use crate::b::B;\npub struct A;"),
        (
            "b.rs",
            "use other::a::A;\npub struct B;\nfn f(a: u32) -> u32 { a }\n#[cfg(test)]\nmod tests { use crate::a::A; }",
        ),
    ];
    assert_eq!(circles(&none), [""; 0]);
}

#[test]
fn the_page_is_read_by_its_tables() {
    let page = "# House\n| `no` | x |\n## Crates\n| | |\n|---|---|\n| [`one`](a/b.rs) | first |\n| `two/` | second |\n\
                ## `one`\n| `lanes/` | numbers |\n## A walk\n| `not` | this |\n";
    let order = Order::parse(page);
    let names = |steps: &[Step]| steps.iter().map(|s| format!("{}: {}", s.name, s.about)).collect::<Vec<_>>();
    assert_eq!(names(&order.crates), ["one: first", "two: second"]);
    assert_eq!(
        order.rooms.iter().map(|(n, s)| (n.as_str(), names(s))).collect::<Vec<_>>(),
        [("one", vec!["lanes: numbers".to_string()])]
    );
}

/// Names of the Rust files of a folder, without their ending.
fn rust_files(folder: &Path) -> BTreeSet<String> {
    let names = std::fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("a file").file_name());
    names.filter_map(|name| name.to_str()?.strip_suffix(".rs").map(str::to_owned)).collect()
}

#[test]
fn no_test_is_left_out() {
    for folder in std::fs::read_dir(root().join("crates")).expect("the crates").map(|e| e.expect("a folder").path()) {
        let tests = folder.join("tests");
        let Ok(program) = std::fs::read_to_string(tests.join("main.rs")) else { continue };
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).expect("the manifest");
        let listed = |file: &String| {
            file == "main"
                || program.lines().any(|line| line == format!("mod {file};"))
                || manifest.lines().any(|line| line == format!("name = \"{file}\""))
        };
        let left_out: Vec<_> = rust_files(&tests).into_iter().filter(|file| !listed(file)).collect();
        assert_eq!(left_out, [""; 0], "in {}, but not in its main.rs", tests.display());
    }
}
