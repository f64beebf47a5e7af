//! `marathon-studies reproduce`: makes the shipped policies, images and tables again, and reports what changed.
//!
//! Every recipe starts from the files of the repository, so recipes do not depend on each other. Results and notes of what is
//! done stay in a folder, and the same command continues.

mod compare;
mod recipe;

use crate::args::ReproduceOptions;
use crate::error::StudyError;
use compare::Change;
use marathon_learn::write_atomic;
use marathon_physics::hint::nearest;
use marathon_runs::terminal::{interrupt, note, print_json, say};
use marathon_runs::text::path_word;
use recipe::{Program, Recipe, Step};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Exit code of an interrupted program.
const INTERRUPTED: i32 = 130;

/// One line of the report.
#[derive(Serialize)]
struct Row {
    /// Recipe.
    name: String,
    /// Path of the result in the repository.
    product: String,
    /// `same`, `changed` or `failed`.
    result: &'static str,
    /// Differences, or the error.
    details: String,
}

/// Makes the chosen recipes again and reports.
///
/// # Errors
/// If a name is unknown, the current folder is not the repository, a recipe failed, or after Ctrl-C.
pub fn run(options: &ReproduceOptions, json: bool) -> Result<(), StudyError> {
    let recipes = chosen(&options.names)?;
    if options.list {
        let plan = recipes.iter().map(|recipe| {
            let commands = recipe.steps.iter().map(|step| format!("  {}", step.words.join(" ")));
            format!("{}\n{}", recipe.name, commands.collect::<Vec<_>>().join("\n"))
        });
        say(plan.collect::<Vec<_>>().join("\n"));
        return Ok(());
    }
    let place = Place::new(&options.keep)?;
    interrupt::install("finishing what can be continued")?;
    let (mut rows, mut failed) = (Vec::new(), 0);
    for recipe in &recipes {
        match place.make(recipe) {
            Ok(()) => rows.extend(place.compare(recipe, options.update)?),
            Err(error @ StudyError::Interrupted(_)) => return Err(error),
            Err(error) => {
                failed += 1;
                note(format!("{}: {error}", recipe.name));
                let (product, details) = (String::new(), error.to_string());
                rows.push(Row { name: recipe.name.clone(), product, result: "failed", details });
            }
        }
        write_atomic(&options.keep.join("report.md"), page(&rows).as_bytes())?;
    }
    if json {
        print_json(&serde_json::json!({ "results": rows }));
    } else {
        say(page(&rows).trim_end());
    }
    match failed {
        0 => Ok(()),
        n => Err(StudyError::Recipe(format!("{n} of {} could not be reproduced", recipes.len()))),
    }
}

/// The recipes with the given names, or all.
fn chosen(names: &[String]) -> Result<Vec<Recipe>, StudyError> {
    let all = Recipe::all();
    for name in names {
        if !all.iter().any(|recipe| recipe.name == *name) {
            let near = nearest(name, all.iter().map(|recipe| recipe.name.as_str()));
            let hint = near.map_or(String::new(), |near| format!("; did you mean {near}?"));
            let known = all.iter().map(|recipe| recipe.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(StudyError::Usage(format!("{name:?} is not made here, expected one of {known}{hint}")));
        }
    }
    Ok(all.into_iter().filter(|recipe| names.is_empty() || names.contains(&recipe.name)).collect())
}

/// The report.
fn page(rows: &[Row]) -> String {
    let mut text = String::from("| recipe | file | result | details |\n| --- | --- | --- | --- |\n");
    for Row { name, product, result, details } in rows {
        text += &format!("| {name} | {product} | {result} | {} |\n", details.replace(['\n', '|'], " "));
    }
    text
}

/// Where recipes are carried out.
struct Place<'a> {
    keep: &'a Path,
    marathon: PathBuf,
    this: PathBuf,
}

impl<'a> Place<'a> {
    fn new(keep: &'a Path) -> Result<Self, StudyError> {
        if !Path::new("assets/policies/hopper.safetensors").exists() {
            let text = "assets/policies is not here: `reproduce` runs in a clone of the repository";
            return Err(StudyError::Usage(text.into()));
        }
        let this = std::env::current_exe().map_err(StudyError::io(Path::new("marathon-studies"), "find"))?;
        let marathon = this.with_file_name(format!("marathon{}", std::env::consts::EXE_SUFFIX));
        if !marathon.exists() {
            let text = format!("{} is missing; `cargo build --release` makes it", path_word(&marathon));
            return Err(StudyError::Usage(text));
        }
        std::fs::create_dir_all(keep).map_err(StudyError::io(keep, "create folder"))?;
        Ok(Self { keep, marathon, this })
    }

    fn folder(&self, recipe: &Recipe) -> PathBuf {
        self.keep.join(&recipe.name)
    }

    /// Runs the commands that are not done.
    fn make(&self, recipe: &Recipe) -> Result<(), StudyError> {
        let folder = self.folder(recipe);
        let marks = folder.join("done");
        std::fs::create_dir_all(&marks).map_err(StudyError::io(&marks, "create folder"))?;
        let mut made: Vec<&str> = Vec::new();
        for (number, step) in recipe.steps.iter().enumerate() {
            let mark = marks.join(format!("{number:02}"));
            let command = step.words.join(" ");
            if std::fs::read_to_string(&mark).is_ok_and(|text| text == command) {
                made.extend(step.out());
                continue;
            }
            note(format!("{}, {} of {}: {command}", recipe.name, number + 1, recipe.steps.len()));
            let words = step.words.iter().map(|word| resolve(word, &folder, &made, step.out()));
            self.carry_out(step, words.collect::<Result<_, _>>()?, &folder)?;
            write_atomic(&mark, command.as_bytes())?;
            made.extend(step.out());
        }
        Ok(())
    }

    /// Runs one command.
    fn carry_out(&self, step: &Step, mut words: Vec<String>, folder: &Path) -> Result<(), StudyError> {
        let (program, log) = match step.program {
            Program::Copy => {
                let [from, to] = [&words[0], &words[1]].map(Path::new);
                std::fs::copy(from, to).map_err(StudyError::io(from, "copy"))?;
                return Ok(());
            }
            Program::Study => {
                // the study continues from the runs that it keeps
                let runs = folder.join("runs").to_string_lossy().into_owned();
                let pages = folder.to_string_lossy().into_owned();
                words.extend(["--keep".into(), runs, "--out".into(), pages]);
                (&self.this, "study.log")
            }
            Program::Marathon => {
                let out = step.out().map(|out| folder.join(out));
                if let Some(out) = out.filter(|out| words[0] == "train" && out.join("run.json").exists()) {
                    words = vec!["train".into(), "--resume".into(), out.to_string_lossy().into_owned()];
                }
                (&self.marathon, "marathon.log")
            }
        };
        let path = folder.join(log);
        let log = std::fs::OpenOptions::new().append(true).create(true).open(&path);
        let log = log.map_err(StudyError::io(&path, "write"))?;
        let mut command = Command::new(program);
        command.args(&words).stdout(log);
        let status = command.status().map_err(StudyError::io(program, "run"))?;
        if interrupt::requested() || status.code() == Some(INTERRUPTED) {
            return Err(StudyError::Interrupted("what is done is kept; the same command continues".into()));
        }
        if !status.success() {
            let text = format!("`{} {}` failed ({status})", path_word(program), words.join(" "));
            return Err(StudyError::Recipe(text));
        }
        Ok(())
    }

    /// Compares what a recipe made with the repository, and replaces it there if `update` is set.
    fn compare(&self, recipe: &Recipe, update: bool) -> Result<Vec<Row>, StudyError> {
        let folder = self.folder(recipe);
        let mut rows = Vec::new();
        let mut add = |new: PathBuf, old: PathBuf, change: Change| {
            let (result, details) = match change {
                Change::None => ("same", String::new()),
                Change::Some(details) => ("changed", details),
            };
            if update && result == "changed" {
                std::fs::copy(&new, &old).map_err(StudyError::io(&old, "write"))?;
            }
            let product = old.to_string_lossy().into_owned();
            rows.push(Row { name: recipe.name.clone(), product, result, details });
            Ok::<(), StudyError>(())
        };
        if recipe.study().is_some() {
            let files = |ending: &str| {
                let name = format!("{}.{ending}", recipe.name);
                (folder.join(&name), Path::new("docs/studies").join(name))
            };
            let (new, old) = files("csv");
            let change = compare::tables(&new, &old)?;
            add(new, old, change.clone())?;
            // the page and the picture show the table
            for (new, old) in ["md", "png"].map(files).into_iter().filter(|_| update) {
                add(new, old, change.clone())?;
            }
            return Ok(rows);
        }
        if let Some(policy) = recipe.policy() {
            let made = folder.join(policy);
            let new = if made.is_dir() { made.join("policy.safetensors") } else { made };
            let old = Path::new("assets/policies").join(format!("{}.safetensors", recipe.name));
            let change = compare::policies(&new, &old)?;
            add(new, old, change)?;
        }
        for image in recipe.images() {
            let (new, old) = (folder.join(image), Path::new("docs/images").join(image));
            let change = compare::images(&new, &old)?;
            add(new, old, change)?;
        }
        Ok(rows)
    }
}

/// A word of a command with paths in place of names.
fn resolve(word: &str, folder: &Path, made: &[&str], out: Option<&str>) -> Result<String, StudyError> {
    let (option, name) = match word.strip_prefix("--teacher=") {
        Some(name) => ("--teacher=", name),
        None => ("", word),
    };
    if let Some(policy) = name.strip_prefix('@') {
        return Ok(format!("{option}assets/policies/{policy}.safetensors"));
    }
    let first = name.split('/').next().unwrap_or(name);
    if !made.contains(&first) && out != Some(name) {
        return Ok(word.into());
    }
    let path = folder.join(name);
    let path = if name.ends_with('*') { only(&path)? } else { path };
    Ok(format!("{option}{}", path.to_string_lossy()))
}

/// The only file whose name begins as `pattern` does before its `*`.
fn only(pattern: &Path) -> Result<PathBuf, StudyError> {
    let (folder, name) = (pattern.parent().unwrap_or(Path::new(".")), pattern.file_name().unwrap_or_default());
    let start = name.to_string_lossy().trim_end_matches('*').to_string();
    let entries = std::fs::read_dir(folder).map_err(StudyError::io(folder, "list"))?;
    let paths = entries.filter_map(|entry| entry.ok()).map(|entry| entry.path());
    let mut found: Vec<PathBuf> =
        paths.filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&start))).collect();
    match (found.pop(), found.is_empty()) {
        (Some(path), true) => Ok(path),
        (path, _) => {
            let count = found.len() + usize::from(path.is_some());
            Err(StudyError::file(pattern, "name", format!("{count} files"), "one file that begins like this"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_paths() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path();
        std::fs::create_dir_all(place.join("goes/policies")).unwrap();
        std::fs::write(place.join("goes/policies/policy-80M.safetensors"), "").unwrap();
        let made = ["goes", "one.safetensors"];
        let resolved = |word: &str| resolve(word, place, &made, Some("two")).unwrap();
        let path = |name: &str| place.join(name).to_string_lossy().into_owned();
        assert_eq!(resolved("@hopper"), "assets/policies/hopper.safetensors");
        assert_eq!(resolved("--teacher=one.safetensors"), format!("--teacher={}", path("one.safetensors")));
        assert_eq!(resolved("goes/policies/policy-80*"), path("goes/policies/policy-80M.safetensors"));
        assert_eq!(resolved("two"), path("two"));
        assert_eq!([resolved("train"), resolved("go")], ["train", "go"]);
        std::fs::write(place.join("goes/policies/policy-81M.safetensors"), "").unwrap();
        let error = resolve("goes/policies/policy-8*", place, &made, None).unwrap_err().to_string();
        assert!(error.contains("2 files"), "{error}");
    }

    #[test]
    fn unknown_names_are_refused() {
        let error = chosen(&["hoper".into()]).unwrap_err().to_string();
        assert!(error.contains("did you mean hopper?"), "{error}");
        assert_eq!(chosen(&["hopper".into()]).unwrap().len(), 1);
    }
}
