//! Files with motion clips for agents that follow clips.

use crate::error::RunError;
use crate::text::nearest_path;
use marathon_envs::agents::marathon::marathon_man::clips as known;
use marathon_envs::options::{OptionValue, Value};
use marathon_envs::{Clips, NamedClip};
use marathon_motion::import::{self, Reading};
use marathon_motion::{About, Clip, Mapping, MotionError, fit, retarget};
use marathon_physics::Model;
use marathon_physics::budget::{self, CLIP_FILE, RECORDING_FILE};
use marathon_physics::hint::did_you_mean;
use std::path::{Component, Path};

/// Distance, m, and angle, rad, from a recording above which a clip is unsuitable for training.
const LOST: f64 = 0.15;
const ASTRAY: f64 = 0.6;

/// Extension of a clip's file.
const MOTION: &str = "motion";
/// Extensions of supported files.
const ENDINGS: [&str; 8] = [MOTION, "bvh", "glb", "gltf", "vrm", "vrma", "json", "txt"];
/// Frames per second of a clip from a recording.
const FPS: f64 = 60.0;

/// Reads the clips in an option's value that are files. A name may also be one of the clips in `before`, the option's former
/// value.
///
/// # Errors
/// If a file cannot be read, or is not a clip for the model.
pub fn read_all(value: &Value, before: Option<&Value>, agent: &str, model: &Model) -> Result<Value, RunError> {
    let items = match value {
        // a file name may contain commas
        Value::Text(text) if Path::new(text).is_file() => Clips::from_iter([NamedClip::shipped(text)]),
        // the agent refuses other values
        value => match Clips::read(value) {
            Some(clips) => clips,
            None => return Ok(value.clone()),
        },
    };
    let before: Vec<NamedClip> = before.and_then(Clips::read).into_iter().flatten().collect();
    let mut clips = Clips::default();
    for item in items {
        let path = Path::new(item.name());
        let same = before.iter().find(|clip| clip.name() == item.name() && clip.clip().is_some());
        clips.push(match same {
            _ if item.clip().is_some() => item,
            _ if !is_file_name(path) => item,
            Some(same) if !path.is_file() => same.clone(),
            _ => NamedClip::new(&stem(path), read_one(path, agent, model)?),
        });
    }
    Ok(clips.into())
}

/// Refuses a name that would hide one of Marathon's clips, or lead out of a run's folder.
///
/// # Errors
/// If the name is refused.
pub fn check_name(name: &str) -> Result<(), RunError> {
    match NamedClip::file_name(name) == name {
        true => Ok(()),
        false => Err(RunError::file(name.as_ref(), "name of the clip", name, "a file's name that ends in .motion")),
    }
}

/// A clip from a `.motion` file, or from a recording as `marathon motion import` converts it by default.
fn read_one(path: &Path, agent: &str, model: &Model) -> Result<Clip, RunError> {
    if !path.is_file() {
        let near = nearest_path(path, &[], |file| file.is_file() && is_file_name(file));
        return Err(missing(path, &format!("a motion (.{})", ENDINGS.join(", .")), near));
    }
    let limit = if ending(path) == MOTION { &CLIP_FILE } else { &RECORDING_FILE };
    let bytes = budget::read(path, limit).map_err(RunError::io(path, "read"))?;
    let clip = match ending(path).as_str() {
        MOTION => Clip::parse(path, &bytes)?,
        _ => {
            let failed = |error| RunError::Recording { error, path: path.into(), agent: agent.into() };
            of_recording(path, &bytes, model).map_err(failed)?
        }
    };
    clip.check_model(path, model)?;
    Ok(clip)
}

/// The error for a path that is neither a file of `what` nor the name of a clip. `near` is a suggestion.
pub fn missing(path: &Path, what: &str, near: Option<String>) -> RunError {
    let found = if path.is_dir() { "a folder" } else { "no such file" };
    let (near, names) = (did_you_mean(near), known::names().join(", "));
    RunError::file(path, "clip", found, format!("a file of {what}{near} or the name of a clip: {names}"))
}

/// Retargets a recording to a character, with Marathon's built-in mapping.
fn of_recording(path: &Path, bytes: &[u8], model: &Model) -> Result<Clip, MotionError> {
    let beside = |name: &str| beside(path, name);
    let reading = Reading { beside: Some(&beside), ..Reading::default() };
    let mut animation = import::read(path, bytes, &reading)?.animation;
    if animation.wraps() && animation.cycle().is_none() {
        animation = animation.looped(path)?;
    }
    let animation = animation.with_clip(animation.clip().resample(path, 1.0 / FPS)?);
    let mapping = Mapping::built_in(path, animation.skeleton(), model)?;
    let clip = retarget(path, &animation, model, &mapping)?;
    let fit = fit(path, &animation, model, &mapping, &clip)?;
    if fit.position > LOST || fit.bones > ASTRAY {
        // the user would see a warning only after training
        let problem = fit.warnings().join("; ");
        return Err(MotionError::Model { path: path.into(), model: model.name.clone(), problem });
    }
    let or_unknown = |text: &str| if text.is_empty() { "unknown".into() } else { text.to_string() };
    let about = About {
        name: stem(path),
        model: model.name.clone(),
        source: or_unknown(&clip.about().source),
        license: or_unknown(&clip.about().license),
        fit: Some(fit.nearness()),
    };
    clip.with_about(about).rounded(path)
}

/// Reads a file that a recording names, in the recording's folder or below.
///
/// # Errors
/// If the file is elsewhere, or cannot be read.
pub fn beside(recording: &Path, name: &str) -> Result<Vec<u8>, String> {
    let elsewhere = || "it is not in the folder of the recording".to_string();
    let name = Path::new(name);
    if !name.components().all(|part| matches!(part, Component::Normal(_))) {
        return Err(elsewhere());
    }
    let text = |error: std::io::Error| error.to_string();
    let folder = recording.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (folder, file) = (folder.canonicalize().map_err(text)?, folder.join(name).canonicalize().map_err(text)?);
    // a link may lead out of the folder
    if !file.starts_with(&folder) {
        return Err(elsewhere());
    }
    budget::read(&file, &RECORDING_FILE).map_err(text)
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Whether a text looks like a file name, which names of clips never do.
fn is_file_name(path: &Path) -> bool {
    ENDINGS.contains(&ending(path).as_str()) || path.components().count() > 1
}
