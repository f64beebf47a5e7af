//! The recipes that come with the tasks.

use super::stages::Recipe;
use crate::names;
use std::path::Path;
use std::sync::LazyLock;

macro_rules! file {
    ($name:literal) => {
        ($name, marathon_configs::text($name))
    };
}

/// Recipes of tasks. `marathon train TASK` runs them.
const RECIPES: [(&str, &str); 5] = [
    file!("hopper_controller-recipe.yaml"),
    file!("walker_controller-recipe.yaml"),
    file!("ant_controller-recipe.yaml"),
    file!("marathon_man_steer-recipe.yaml"),
    file!("marathon_man_controller-recipe.yaml"),
];

/// Configurations that their stages name.
const CONFIGS: [(&str, &str); 4] = [
    file!("controller-steady.yaml"),
    file!("ant_controller-steady.yaml"),
    file!("marathon_man_steer-steady.yaml"),
    file!("marathon_man_controller-steady.yaml"),
];

static READ: LazyLock<Vec<Recipe>> = LazyLock::new(|| {
    let read = |(name, text): (&str, &str)| Recipe::parse_text(Path::new(name), text);
    RECIPES.into_iter().map(|file| read(file).expect("the program's own recipes are right")).collect()
});

/// The recipe of a task, if it has one.
///
/// # Panics
/// If a recipe that is part of the program is wrong, which a test rules out.
pub fn recipe_for(task: &str) -> Option<Recipe> {
    let id = names::id(task);
    READ.iter().find(|recipe| recipe.task == id).cloned()
}

/// The text of a recipe that comes with the program, or of a configuration that it names.
pub fn shipped(name: &str) -> Option<&'static str> {
    let mut all = RECIPES.into_iter().chain(CONFIGS);
    all.find(|(known, _)| *known == name).map(|(_, text)| text)
}
