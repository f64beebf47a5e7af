//! Crates and rooms, read from the workspace.

use crate::Error;
use crate::imports::{Import, imports};
use crate::sources::Sources;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// All crates under `crates`.
#[derive(Clone, Debug)]
pub struct House {
    /// Folder of the workspace.
    pub root: PathBuf,
    /// In the order of their names.
    pub crates: Vec<Crate>,
}

/// A crate.
#[derive(Clone, Debug)]
pub struct Crate {
    /// The name of its folder.
    pub name: String,
    /// Crates of the house that it depends on, tests and optional dependencies excepted.
    pub depends_on: BTreeSet<String>,
    /// In the order of their names.
    pub rooms: Vec<Room>,
    /// Imports from one file to another.
    pub imports: Vec<Import>,
}

/// A top-level module.
#[derive(Clone, Debug)]
pub struct Room {
    /// The module's name.
    pub name: String,
    /// Lines of all its files.
    pub lines: usize,
    /// Number of files.
    pub files: usize,
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
    workspace_root: PathBuf,
}

#[derive(Deserialize)]
struct Package {
    manifest_path: PathBuf,
    dependencies: Vec<Dependency>,
}

#[derive(Deserialize)]
struct Dependency {
    path: Option<PathBuf>,
    kind: Option<String>,
}

impl House {
    /// Reads the crates under `crates` of the workspace that holds `folder`.
    ///
    /// # Errors
    /// If Cargo does not know the workspace, or a source cannot be read.
    pub fn read(folder: &Path) -> Result<House, Error> {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let output = Command::new(cargo)
            .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
            .current_dir(folder)
            .output()
            .map_err(|e| Error::Cargo(e.to_string()))?;
        if !output.status.success() {
            return Err(Error::Cargo(String::from_utf8_lossy(&output.stderr).trim().to_string()));
        }
        let metadata: Metadata = serde_json::from_slice(&output.stdout).map_err(|e| Error::Cargo(e.to_string()))?;
        let crates = metadata.workspace_root.join("crates");
        let mut found = BTreeMap::new();
        for package in &metadata.packages {
            let folder = package.manifest_path.parent().expect("a manifest is in a folder");
            let Some(name) = name_in(&crates, folder) else { continue };
            let normal = package.dependencies.iter().filter(|d| d.kind.is_none());
            let depends_on = normal.filter_map(|d| name_in(&crates, d.path.as_deref()?)).collect();
            found.insert(name.clone(), Crate::read(name, &folder.join("src"), depends_on)?);
        }
        Ok(House { root: metadata.workspace_root, crates: found.into_values().collect() })
    }

    /// A crate by its name.
    pub fn find(&self, name: &str) -> Option<&Crate> {
        self.crates.iter().find(|c| c.name == name)
    }
}

/// The name of a folder that lies in `crates` itself.
fn name_in(crates: &Path, folder: &Path) -> Option<String> {
    (folder.parent()? == crates).then(|| folder.file_name().unwrap_or_default().to_string_lossy().into_owned())
}

impl Crate {
    /// Reads the sources of a crate.
    ///
    /// # Errors
    /// If a source cannot be read or is not Rust.
    pub fn read(name: String, src: &Path, depends_on: BTreeSet<String>) -> Result<Crate, Error> {
        let sources = Sources::read(src)?;
        let mut rooms: BTreeMap<&str, Room> = BTreeMap::new();
        for file in sources.files.iter().filter(|f| !f.module.is_empty()) {
            let name = &file.module[0];
            let room = rooms.entry(name).or_insert(Room { name: name.clone(), lines: 0, files: 0 });
            room.lines += file.lines;
            room.files += 1;
        }
        let rooms: Vec<Room> = rooms.into_values().collect();
        let imports = imports(&sources);
        Ok(Crate { name, depends_on, rooms, imports })
    }

    /// Imports from one room to another.
    pub fn between_rooms(&self) -> impl Iterator<Item = &Import> {
        self.imports.iter().filter(|import| import.leaves_room())
    }

    /// Groups of files that import each other in circles, the largest first.
    ///
    /// The file of a module (`mod.rs`, `lib.rs`) and a file below it may use each other: it may call the file, and the file may
    /// use what the module shares. So a circle needs at most one of these two directions.
    pub fn circles(&self) -> Vec<Vec<&Path>> {
        let mut circles = self.circles_without(Import::leads_inside);
        for circle in self.circles_without(Import::leads_to_own_module) {
            if !circles.iter().any(|known| circle.iter().all(|file| known.contains(file))) {
                circles.push(circle);
            }
        }
        circles.sort_by_key(|circle| std::cmp::Reverse(circle.len()));
        circles
    }

    /// The circles of all imports but some.
    fn circles_without(&self, left_out: fn(&Import) -> bool) -> Vec<Vec<&Path>> {
        let mut next: BTreeMap<&Path, BTreeSet<&Path>> = BTreeMap::new();
        for import in self.imports.iter().filter(|import| !left_out(import)) {
            next.entry(&import.file).or_default().insert(&import.target);
        }
        let reach: BTreeMap<&Path, BTreeSet<&Path>> = next.keys().map(|file| (*file, reached(file, &next))).collect();
        let mut circles: Vec<Vec<&Path>> = Vec::new();
        for (&file, there) in &reach {
            if !there.contains(file) || circles.iter().any(|circle| circle.contains(&file)) {
                continue;
            }
            let back = |other: &&Path| reach.get(other).is_some_and(|from_there| from_there.contains(file));
            circles.push(there.iter().copied().filter(back).collect());
        }
        circles
    }

    /// Imports between files of a circle.
    pub fn imports_within(&self, circle: &[&Path]) -> impl Iterator<Item = &Import> {
        let inside = |path: &Path| circle.contains(&path);
        self.imports.iter().filter(move |i| inside(&i.file) && inside(&i.target))
    }

    /// The rooms in an order in which each imports only from those before it; those of a ring are left out, and all that
    /// stand on them.
    pub fn order(&self) -> Vec<&str> {
        let mut order: Vec<&str> = Vec::new();
        loop {
            let stands = |room: &&Room| {
                let mut needed = self.between_rooms().filter(|i| i.from == room.name);
                !order.contains(&room.name.as_str()) && needed.all(|i| order.contains(&i.to.as_str()))
            };
            match self.rooms.iter().find(stands) {
                Some(room) => order.push(&room.name),
                None => return order,
            }
        }
    }

    /// Rooms that import each other in a ring, if there are any: each imports the next, the last the first.
    pub fn ring(&self) -> Option<Vec<String>> {
        let mut next: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for import in self.between_rooms() {
            next.entry(&import.from).or_default().insert(&import.to);
        }
        let (mut done, mut way) = (BTreeSet::new(), Vec::new());
        self.rooms.iter().find_map(|room| walk(&room.name, &next, &mut done, &mut way))
    }
}

/// The files that are imported by `file`, by those that it imports, and so on.
fn reached<'a>(file: &'a Path, next: &BTreeMap<&'a Path, BTreeSet<&'a Path>>) -> BTreeSet<&'a Path> {
    let (mut reached, mut open) = (BTreeSet::new(), vec![file]);
    while let Some(file) = open.pop() {
        for target in next.get(file).into_iter().flatten() {
            if reached.insert(*target) {
                open.push(target);
            }
        }
    }
    reached
}

/// Follows imports from `room` until the way meets itself.
fn walk<'a>(
    room: &'a str,
    next: &BTreeMap<&'a str, BTreeSet<&'a str>>,
    done: &mut BTreeSet<&'a str>,
    way: &mut Vec<&'a str>,
) -> Option<Vec<String>> {
    if let Some(start) = way.iter().position(|r| *r == room) {
        return Some(way[start..].iter().map(|r| r.to_string()).collect());
    }
    if !done.insert(room) {
        return None;
    }
    way.push(room);
    let ring = next.get(room).and_then(|rooms| rooms.iter().find_map(|r| walk(r, next, done, way)));
    way.pop();
    ring
}
