//! The recipes of `recipes.txt`.

use std::collections::HashMap;

/// How one policy or one table is made.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Name of the policy or of the study.
    pub name: String,
    /// The commands, in order.
    pub steps: Vec<Step>,
}

/// One command.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Program that runs it.
    pub program: Program,
    /// Words of the command, with names of the recipe.
    pub words: Vec<String>,
}

/// A program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Program {
    /// The command `marathon`.
    Marathon,
    /// This program.
    Study,
    /// A copy of a file.
    Copy,
}

impl Recipe {
    /// All recipes.
    pub fn all() -> Vec<Recipe> {
        parse(include_str!("recipes.txt")).expect("the program's own recipes are right")
    }

    /// The study of the recipe, if it is of one.
    pub fn study(&self) -> Option<&Step> {
        self.steps.iter().find(|step| step.program == Program::Study)
    }

    /// The file or folder of the policy.
    pub fn policy(&self) -> Option<&str> {
        let makes = |step: &&Step| matches!(step.words[0].as_str(), "train" | "average" | "distill");
        let last = self.steps.iter().rev().filter(|step| step.program == Program::Marathon).find(makes)?;
        last.out()
    }

    /// The images for the documentation.
    pub fn images(&self) -> impl Iterator<Item = &str> {
        self.steps.iter().filter_map(Step::out).filter(|out| out.ends_with(".png"))
    }
}

impl Step {
    /// The file or folder that the command writes.
    pub fn out(&self) -> Option<&str> {
        if self.program == Program::Copy {
            return self.words.last().map(String::as_str);
        }
        let at = self.words.iter().position(|word| word == "--out")?;
        self.words.get(at + 1).map(String::as_str)
    }
}

/// Reads recipes.
fn parse(text: &str) -> Result<Vec<Recipe>, String> {
    let mut recipes: Vec<Recipe> = Vec::new();
    // definitions above the first recipe are for all
    let (mut common, mut own) = (HashMap::new(), HashMap::new());
    let joined = text.replace("\\\n", " ");
    for line in joined.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')) {
        if let Some(name) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            recipes.push(Recipe { name: name.into(), steps: Vec::new() });
            own = common.clone();
            continue;
        }
        let mut words: Vec<String> = Vec::new();
        for word in line.split_whitespace() {
            match word.strip_prefix('$') {
                None => words.push(word.into()),
                Some(name) => {
                    let found: &Vec<String> = own.get(name).ok_or_else(|| format!("{line}: ${name} is not defined"))?;
                    words.extend(found.iter().cloned());
                }
            }
        }
        if words.get(1).is_some_and(|word| word == "=") {
            own.insert(words[0].clone(), words[2..].to_vec());
            if recipes.is_empty() {
                common.clone_from(&own);
            }
            continue;
        }
        let program = match words[0].as_str() {
            "marathon" => Program::Marathon,
            "study" => Program::Study,
            "copy" => Program::Copy,
            other => return Err(format!("{line}: {other:?} is no program, expected marathon, study or copy")),
        };
        let recipe = recipes.last_mut().ok_or_else(|| format!("{line}: no recipe has begun"))?;
        recipe.steps.push(Step { program, words: words.split_off(1) });
    }
    Ok(recipes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::Path;

    #[test]
    fn definitions_and_long_lines_are_expanded() {
        let text = "a = --x 1\n[one]\nb = $a -y\nmarathon train t $b \\\n  --out run\ncopy run/c.png d.png\n[two]\nstudy s $a\n";
        let recipes = parse(text).unwrap();
        assert_eq!(recipes[0].steps[0].words.join(" "), "train t --x 1 -y --out run");
        assert_eq!((recipes[0].policy(), recipes[0].images().collect()), (Some("run"), vec!["d.png"]));
        assert_eq!(recipes[1].study().unwrap().words.join(" "), "s --x 1");
        assert!(parse("[one]\n[two]\nmarathon $b\n").unwrap_err().contains("$b is not defined"));
        assert!(parse("[one]\nrm x\n").unwrap_err().contains("expected marathon, study or copy"));
    }

    /// Names of the files of a folder with an ending.
    fn files(folder: &str, ending: &str) -> BTreeSet<String> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder);
        let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let with_it = paths.filter(|path| path.extension().is_some_and(|found| found == ending));
        with_it.map(|path| path.file_stem().unwrap().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn every_shipped_policy_and_every_study_has_a_recipe() {
        let recipes = Recipe::all();
        let names = |study: bool| {
            let of_kind = recipes.iter().filter(|recipe| recipe.study().is_some() == study);
            of_kind.map(|recipe| recipe.name.clone()).collect::<BTreeSet<_>>()
        };
        assert_eq!(names(false), files("assets/policies", "safetensors"));
        let mut tables = files("docs/studies", "csv");
        // python/bench/returns.py makes this one
        tables.remove("gymnasium-returns");
        assert_eq!(names(true), tables);
    }

    #[test]
    fn commands_use_what_earlier_ones_made() {
        let policies = files("assets/policies", "safetensors");
        for recipe in Recipe::all() {
            let mut made: Vec<&str> = Vec::new();
            for step in &recipe.steps {
                let values = step.words.iter().map(|word| word.strip_prefix("--teacher=").unwrap_or(word));
                for (i, word) in values.clone().enumerate() {
                    if let Some(name) = word.strip_prefix('@') {
                        assert!(policies.contains(name), "{}: {word}", recipe.name);
                    }
                    let teaches = step.words[i].starts_with("--teacher=");
                    let starts = i > 0 && step.words[i - 1] == "--initialize-from";
                    if (teaches || starts) && !word.starts_with('@') {
                        let first = word.split('/').next().unwrap();
                        assert!(made.contains(&first), "{}: nothing has made {word}", recipe.name);
                    }
                }
                made.extend(step.out());
            }
            assert!(recipe.study().is_some() || recipe.policy().is_some(), "{} makes nothing", recipe.name);
        }
    }
}
