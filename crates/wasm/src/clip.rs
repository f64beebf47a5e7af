//! Motion clips from recordings.

use crate::abi::respond;
use crate::answer::{Answer, Failure, Request};
use crate::objects::{Kind, ask, keep, with};
use marathon_motion::Clip;
#[cfg(feature = "full")]
use marathon_motion::{
    About, Mapping, check, fit,
    import::{Reading, Recording, read},
    retarget,
};
use marathon_physics::Model;
use marathon_viewer::Poses;
use serde::Deserialize;
use serde_json::json;
use std::path::Path;
use std::ptr::null;

/// Frames per second of a clip.
#[cfg(feature = "full")]
const FPS: f64 = 60.0;

/// A clip with the model of its character.
pub struct MotionClip {
    clip: Clip,
    model: Model,
    warnings: Vec<String>,
    poses: Poses,
}

impl Kind for MotionClip {
    const NAME: &'static str = "clip";
}

impl MotionClip {
    fn new(mut request: Request) -> Result<Self, Failure> {
        #[derive(Deserialize)]
        struct Fields {
            character: String,
            name: String,
        }
        let Fields { character, name } = request.fields()?;
        let bytes = request.take_file("recording").unwrap_or_default();
        let model = marathon_envs::agent(&character)?.model()?;
        let path = Path::new(&name);
        let (clip, warnings) = match path.extension().is_some_and(|ending| ending == "motion") {
            true => {
                let clip = Clip::parse(path, &bytes)?;
                clip.check_model(path, &model)?;
                (clip, Vec::new())
            }
            false => import(path, &bytes, &model, &request)?,
        };
        Ok(MotionClip { poses: Poses::new(&model, 1), clip, model, warnings })
    }

    fn pose(&mut self, time: f64) {
        let mut qpos = vec![0.0; self.model.nq];
        self.clip.qpos(time, &mut qpos);
        self.poses.set(&self.model, 0, &qpos);
    }
}

#[cfg(not(feature = "full"))]
fn import(path: &Path, _: &[u8], _: &Model, _: &Request) -> Result<(Clip, Vec<String>), Failure> {
    Err(format!("{}: this module reads only .motion files; the full one imports recordings", path.display()).into())
}

/// A recording as a clip, with warnings, by the defaults of `marathon motion import`.
#[cfg(feature = "full")]
fn import(path: &Path, bytes: &[u8], model: &Model, request: &Request) -> Result<(Clip, Vec<String>), Failure> {
    let beside = |name: &str| request.files().get(name).cloned().ok_or_else(|| "this file was not given".to_string());
    let Recording { mut animation, notes } =
        read(path, bytes, &Reading { beside: Some(&beside), ..Reading::default() })?;
    if animation.wraps() && animation.cycle().is_none() {
        animation = animation.looped(path)?;
    }
    let resampled = animation.clip().resample(path, 1.0 / FPS)?;
    let animation = animation.with_clip(resampled);
    let mapping = Mapping::built_in(path, animation.skeleton(), model)?;
    let clip = retarget(path, &animation, model, &mapping)?;
    let fitted = fit(path, &animation, model, &mapping, &clip)?;
    let stem = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let known = clip.about();
    let or = |known: &str| if known.is_empty() { "unknown".to_string() } else { known.into() };
    let about = About {
        name: stem,
        model: model.name.clone(),
        source: or(&known.source),
        license: or(&known.license),
        fit: Some(fitted.nearness()),
    };
    let clip = clip.with_about(about).rounded(path)?;
    let mut report = check(path, &clip, model, mapping.soles())?;
    report.fit = None;
    Ok((clip, [notes, fitted.warnings(), report.warnings()].concat()))
}

/// Makes a clip of the file `recording` for a character; the answer has its facts.
#[unsafe(no_mangle)]
pub extern "C" fn clip_new() -> i32 {
    respond(|request| {
        let clip = MotionClip::new(request)?;
        let answer = Answer::json(&json!({
            "info": {
                "name": clip.clip.about().name,
                "duration": clip.clip.duration(),
                "frames": clip.clip.frames(),
                "loop": clip.clip.cycle().is_some(),
            },
            "model": marathon_viewer::facts(&clip.model),
            "warnings": clip.warnings,
        }))?;
        Ok(answer.about(keep(clip)))
    })
}

/// Place of the poses at a time: 6 of the geoms, 7 of the bodies.
#[unsafe(no_mangle)]
pub extern "C" fn clip_array(clip: usize, which: u32, time: f64) -> *const u8 {
    let place = with::<MotionClip, _>(clip, |clip| {
        clip.pose(time);
        Ok(match which {
            6 => clip.poses.geoms().as_ptr().cast(),
            7 => clip.poses.bodies().as_ptr().cast(),
            _ => null(),
        })
    });
    place.unwrap_or(null())
}

/// The clip as a file.
#[unsafe(no_mangle)]
pub extern "C" fn clip_bytes(clip: usize) -> i32 {
    ask::<MotionClip>(clip, |clip, _| Ok(Answer::bytes(clip.clip.to_bytes())))
}
