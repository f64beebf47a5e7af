//! Recipes: stages that are trained one after the other into a folder.
//!
//! The folder of a recipe has a folder for each stage, such as `02-steady`. A stage that trains is a run like any other. Its
//! folder also has `stage.json`, everything that the stage is made from. The last file is `done`, its result. The same command
//! skips stages that are done, and resumes the one that is not.

mod front;
mod lineage;
mod plan;
mod stage;
mod state;
mod until;

pub use front::Front;
pub use lineage::{RecipeSummary, StageSummary};

use crate::error::RunError;
use crate::folder::{self, RECIPE, RUNS};
use crate::text::{path_word, short_name, whole};
use marathon_config::{Recipe, recipe_for};
use marathon_learn::{read_description, write_description};
use marathon_physics::budget;
use marathon_physics::hint::{did_you_mean, nearest};
use plan::Plan;
use serde::{Deserialize, Serialize};
use stage::Work;
use state::{Changed, Done, State};
use std::fs::{self, File};
use std::path::{Path, PathBuf};

const FORMAT: &str = "marathon-recipe";
const VERSION: u32 = 1;

/// Options of a recipe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecipeOptions {
    /// Folder of the recipe.
    pub out: Option<PathBuf>,
    /// Seed in place of 1. The seed of every stage moves by the difference.
    pub seed: Option<u64>,
    /// Threads of every stage.
    pub threads: Option<usize>,
    /// Stages whose results may be discarded because they have changed.
    pub redo: Vec<String>,
}

/// The end of a recipe's command.
pub enum End {
    /// All stages are done.
    Complete(Box<RecipeSummary>),
    /// The user stopped it in a stage.
    Stopped {
        /// Number of the stage, counted from 1.
        number: usize,
        /// Number of stages.
        of: usize,
        /// Name of the stage.
        stage: String,
    },
}

/// A stage in a list.
#[derive(Clone, Debug, Serialize)]
pub struct Listed {
    /// Number, counted from 1.
    pub number: usize,
    /// Name.
    pub stage: String,
    /// Kind: `train`, `distill` or `average`.
    pub kind: &'static str,
    /// Task.
    pub agent: String,
    /// `waiting`, `begun`, `done` or `changed`.
    pub state: &'static str,
    /// Agent-steps of the run that the policy is from.
    pub steps: Option<u64>,
    /// Processor seconds.
    pub cpu_seconds: Option<f64>,
    /// Commands that do the same without the recipe.
    pub commands: Vec<String>,
}

/// The description of a recipe's folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecipeFile {
    format: String,
    version: u32,
    /// The task whose recipe it is, or the file.
    recipe: String,
    /// The seed in place of 1.
    seed: u64,
}

/// A recipe in its folder.
pub struct RecipeRun {
    plan: Plan,
    name: String,
    seed: u64,
    redo: Vec<usize>,
}

/// The recipe of a task that has one, by any of the task's names.
pub fn of_task(name: &str) -> Option<Recipe> {
    recipe_for(name)
}

/// Whether a name is that of a file with stages, not of a task.
pub fn is_file(name: &str) -> bool {
    let ending = Path::new(name).extension().unwrap_or_default();
    ["yaml", "yml"].iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// Reads a file with stages.
///
/// # Errors
/// If it cannot be read, or has no stages or wrong ones.
pub fn read(path: &Path) -> Result<Recipe, RunError> {
    let bytes = budget::read(path, &budget::CONFIG_FILE).map_err(RunError::io(path, "read"))?;
    Ok(Recipe::parse(path, &bytes)?)
}

/// The recipe and the seed of a folder that holds one. `None` for other folders.
///
/// # Errors
/// If the description is damaged, or the recipe no longer exists.
pub fn of_folder(path: &Path) -> Result<Option<(Recipe, u64)>, RunError> {
    let file = path.join(RECIPE);
    if !file.exists() {
        return Ok(None);
    }
    let about: RecipeFile = read_description(&file, FORMAT, VERSION)?;
    let recipe = match is_file(&about.recipe) {
        true => read(Path::new(&about.recipe))?,
        false => of_task(&about.recipe).ok_or_else(|| {
            RunError::file(&file, "recipe", format!("'{}'", about.recipe), "a task that has a recipe")
        })?,
    };
    Ok(Some((recipe, about.seed)))
}

impl RecipeRun {
    /// Checks all stages of a recipe. Nothing is written.
    ///
    /// # Errors
    /// If a stage has settings that its task does not have, names a file that does not exist, or the folder holds something
    /// else.
    pub fn new(recipe: Recipe, options: &RecipeOptions) -> Result<Self, RunError> {
        // the recipes of tasks have a name without a folder
        let of_task = of_task(&recipe.task).filter(|known| known.path == recipe.path && known.text == recipe.text);
        let name = match &of_task {
            Some(recipe) => recipe.task.clone(),
            None => whole(&recipe.path).to_string_lossy().into_owned(),
        };
        let usual = || match &of_task {
            Some(recipe) => Path::new(RUNS).join(short_name(&recipe.task)),
            None => Path::new(RUNS).join(recipe.path.file_stem().unwrap_or_default()),
        };
        let folder = options.out.clone().unwrap_or_else(usual);
        let seed = options.seed.unwrap_or(1);
        let plan = Plan::new(recipe, &folder, seed, options.threads)?;
        let names: Vec<&str> = plan.recipe.stages.iter().map(|stage| stage.name.as_str()).collect();
        let redo = options.redo.iter().map(|name| {
            names.iter().position(|known| known == name).ok_or_else(|| {
                let near = did_you_mean(nearest(name, names.iter().copied()));
                RunError::option("redo", format!("is '{name}', expected a stage: {}{near}", names.join(", ")))
            })
        });
        let redo = redo.collect::<Result<_, _>>()?;
        let run = RecipeRun { plan, name, seed, redo };
        run.check_folder()?;
        Ok(run)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.plan.folder
    }

    /// Refuses a folder that holds something else, or the stages of another recipe or seed.
    fn check_folder(&self) -> Result<(), RunError> {
        let folder = self.folder();
        folder::refuse_file(folder)?;
        let file = folder.join(RECIPE);
        if file.exists() {
            let known: RecipeFile = read_description(&file, FORMAT, VERSION)?;
            let pairs =
                [("recipe", self.name.clone(), known.recipe), ("seed", self.seed.to_string(), known.seed.to_string())];
            for (place, found, expected) in pairs {
                if found != expected {
                    let expected = format!("{expected}, whose stages the folder holds; choose another folder by 'out'");
                    return Err(RunError::file(&file, place, found, expected));
                }
            }
            return Ok(());
        }
        if folder.join("run.json").exists() {
            return Err(RunError::HoldsRun(folder.into()));
        }
        let others = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
        let first = others.filter(|name| name.to_str().is_none_or(|name| !name.starts_with('.'))).min();
        match first {
            None => Ok(()),
            Some(name) => {
                let (folder, name) = (path_word(folder), name.to_string_lossy());
                let problem = format!("{folder} holds '{name}', expected a new or empty folder, or that of the recipe");
                Err(RunError::option("out", problem))
            }
        }
    }

    fn lock(&self) -> Result<File, RunError> {
        let folder = self.folder();
        fs::create_dir_all(folder).map_err(RunError::io(folder, "create folder"))?;
        folder::lock(folder)
    }

    /// The stages with their states.
    ///
    /// # Errors
    /// If a file of a stage is damaged.
    pub fn list(&self) -> Result<Vec<Listed>, RunError> {
        let mut done: Vec<Option<Done>> = Vec::new();
        let mut all = Vec::new();
        for (i, stage) in self.plan.recipe.stages.iter().enumerate() {
            let state = match self.plan.describe(i, &done)? {
                Some(about) => state::state(&self.plan.steps[i].folder, &about)?,
                None => State::Waiting,
            };
            done.push(match &state {
                State::Done(done) => Some(done.clone()),
                _ => None,
            });
            let result = done[i].as_ref();
            all.push(Listed {
                number: i + 1,
                stage: stage.name.clone(),
                kind: stage.kind.name(),
                agent: stage.task.clone(),
                state: match state {
                    State::Waiting => "waiting",
                    State::Begun => "begun",
                    State::Done(_) => "done",
                    State::Changed(_) => "changed",
                },
                steps: result.map(|done| done.steps),
                cpu_seconds: result.map(|done| done.cpu_seconds),
                commands: self.plan.commands(i, &done),
            });
        }
        Ok(all)
    }

    /// Whether the results of a stage may be discarded: the user has named it, or a stage that it uses.
    fn may_redo(&self, i: usize) -> bool {
        self.plan.ancestors(i).iter().any(|i| self.redo.contains(i))
    }

    /// Carries out the stages that are not done, and writes the policy with its lineage.
    ///
    /// # Errors
    /// If a stage has changed and may not be made again, a stage fails, or a file cannot be written.
    pub fn carry_out(&self, front: &mut Front<'_>) -> Result<End, RunError> {
        let _lock = self.lock()?;
        // another process may have used the folder in between
        self.check_folder()?;
        let about = RecipeFile { format: FORMAT.into(), version: VERSION, recipe: self.name.clone(), seed: self.seed };
        if !self.folder().join(RECIPE).exists() {
            write_description(&self.folder().join(RECIPE), &about)?;
        }
        let of = self.plan.steps.len();
        let mut done: Vec<Option<Done>> = Vec::new();
        let mut hashes = Vec::new();
        for (i, stage) in self.plan.recipe.stages.iter().enumerate() {
            let folder = &self.plan.steps[i].folder;
            state::refuse_link(folder)?;
            let about = self.plan.describe(i, &done)?;
            let about = about.ok_or_else(|| RunError::option("stage", format!("{} comes too early", stage.name)))?;
            let title = format!("stage {} of {of}, {}", i + 1, stage.name);
            let begun = match state::state(folder, &about)? {
                State::Done(result) => {
                    front.note(format!("{title}: done before"));
                    done.push(Some(result));
                    hashes.push(about.hash());
                    continue;
                }
                State::Begun => true,
                State::Waiting => false,
                State::Changed(_) if self.may_redo(i) => {
                    front.note(format!("{title}: discarding its results in {}", folder.display()));
                    state::remove(folder)?;
                    false
                }
                State::Changed(Changed { place, made, now }) => {
                    let (stage, folder) = (stage.name.clone(), folder.clone());
                    return Err(RunError::StageChanged { stage, folder, place, made, now });
                }
            };
            front.note(format!("{title}: {} {}", verb(stage.kind.name()), stage.task));
            let stopped = || End::Stopped { number: i + 1, of, stage: stage.name.clone() };
            if front.stops() {
                return Ok(stopped());
            }
            match Work::new(&self.plan, i, &done, &about, begun).carry_out(front)? {
                Some(result) => done.push(Some(result)),
                None => return Ok(stopped()),
            }
            hashes.push(about.hash());
        }
        let done: Vec<Done> = done.into_iter().flatten().collect();
        let summary = lineage::finish(&self.plan, &done, &hashes, self.seed)?;
        Ok(End::Complete(Box::new(summary)))
    }
}

/// Work of a kind of stage, in a word.
fn verb(kind: &str) -> &'static str {
    match kind {
        "distill" => "distilling",
        "average" => "averaging policies of",
        _ => "training",
    }
}
