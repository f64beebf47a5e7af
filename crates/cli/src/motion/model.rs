//! The character of a clip.

use crate::error::CliError;
use marathon_envs::registry;
use marathon_motion::Clip;
use marathon_physics::Model;
use marathon_runs::text::path_word;
use std::path::Path;

/// A model by the name of an agent or an MJCF file.
pub fn load(name: &str) -> Result<Model, CliError> {
    match Path::new(name).extension() {
        Some(extension) if extension.eq_ignore_ascii_case("xml") => Ok(Model::from_xml_file(name)?),
        _ => Ok(registry::agent(name)?.model()?),
    }
}

/// The model that was asked for, or the one that the clip names.
pub fn of_clip(path: &Path, clip: &Clip, asked: Option<&str>) -> Result<Model, CliError> {
    let model = match asked {
        Some(name) => load(name)?,
        None => {
            let name = &clip.about().model;
            let agents = [name.clone(), name.replace('_', "")];
            let found = agents.iter().find_map(|name| registry::agent(name).ok());
            match found {
                Some(agent) => agent.model()?,
                None => {
                    let text = format!("{} is of the model {name:?}, which is no agent; say --model", path_word(path));
                    return Err(CliError::Usage(text));
                }
            }
        }
    };
    clip.check_model(path, &model)?;
    Ok(model)
}

/// Reads a clip.
pub fn clip(path: &Path) -> Result<Clip, CliError> {
    let bytes = std::fs::read(path).map_err(CliError::io(path, "read"))?;
    Ok(Clip::parse(path, &bytes)?)
}
