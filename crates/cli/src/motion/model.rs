//! The character of a clip.

use crate::error::CliError;
use crate::program;
use marathon_envs::agents::marathon::marathon_man::clips as known;
use marathon_envs::registry;
use marathon_motion::Clip;
use marathon_motion::import::ENDINGS;
use marathon_physics::Model;
use marathon_physics::budget::{self, CLIP_FILE};
use marathon_physics::hint::nearest;
use marathon_runs::clips::missing;
use marathon_runs::text::{nearest_path, path_word};
use std::path::Path;

/// Loads a model by the name of an agent, or from an MJCF file.
pub fn load(name: &str) -> Result<Model, CliError> {
    match Path::new(name).extension() {
        Some(extension) if extension.eq_ignore_ascii_case("xml") => Ok(Model::from_xml_file(name)?),
        _ => Ok(registry::agent(name)?.model()?),
    }
}

/// The requested model, or the one that the clip names.
pub fn of_clip(path: &Path, clip: &Clip, asked: Option<&str>) -> Result<Model, CliError> {
    let model = match asked {
        Some(name) => load(name)?,
        None => named(path, clip)?,
    };
    clip.check_model(path, &model)?;
    Ok(model)
}

/// The model of the first agent with the joints and the model name of the clip. Those on flat ground go first: terrain takes
/// long to draw.
fn named(path: &Path, clip: &Clip) -> Result<Model, CliError> {
    let name = &clip.about().model;
    let mut on_terrain = None;
    for id in registry::ids() {
        let model = registry::agent(&id)?.model()?;
        if model.name == *name && clip.check_model(path, &model).is_ok() {
            if model.hfields.is_empty() {
                return Ok(model);
            }
            on_terrain.get_or_insert(model);
        }
    }
    on_terrain.ok_or_else(|| {
        let text = format!("{} is for the model {name:?}, which no agent has; pass --model", path_word(path));
        CliError::Usage(text)
    })
}

/// Reads a clip: a file, or one of Marathon's clips by its name.
pub fn clip(path: &Path) -> Result<Clip, CliError> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    if ENDINGS.contains(&ending.as_str()) && ending != "json" {
        let name = path_word(path);
        return Err(CliError::Usage(format!(
            "{name} is a recording, expected a clip; `{} motion import {name} --model MarathonMan --out {}` makes one",
            program::name(),
            path_word(&path.with_extension("motion"))
        )));
    }
    if !path.exists() {
        let name = path.to_str().unwrap_or_default();
        if let Some(clip) = known::shipped(name) {
            return Ok((*clip).clone());
        }
        let file = nearest_path(path, &[], |file| file.extension().is_some_and(|ending| ending == "motion"));
        let near = file.or_else(|| nearest(name, known::names()).map(Into::into));
        return Err(missing(path, "a clip (.motion)", near).into());
    }
    let bytes = budget::read(path, &CLIP_FILE).map_err(CliError::io(path, "read"))?;
    Ok(Clip::parse(path, &bytes)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_of_a_clip_stands_on_flat_ground() -> Result<(), CliError> {
        let path = Path::new("walk");
        let model = of_clip(path, &clip(path)?, None)?;
        assert_eq!(model.name, "marathon_man");
        assert!(model.hfields.is_empty());
        Ok(())
    }
}
