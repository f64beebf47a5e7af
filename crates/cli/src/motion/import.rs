//! `marathon motion import` and `retarget`.

use super::{Edits, ImportArgs, Looping, RetargetArgs, model, show};
use crate::console::{print_json, say};
use crate::error::CliError;
use marathon_learn::write_atomic;
use marathon_motion::{About, Animation, Mapping, import as read};
use marathon_physics::Model;
use marathon_runs::text::path_word;
use serde_json::json;
use std::path::Path;

/// A recording as a clip.
pub fn import(args: &ImportArgs, json: bool) -> Result<(), CliError> {
    check_edits(&args.edits)?;
    let model = model::load(&args.model)?;
    let path = &args.recording;
    let bytes = std::fs::read(path).map_err(CliError::io(path, "read"))?;
    let animation = read::any(path, &bytes)?;
    write(path, animation, &model, &args.edits, json)
}

/// A clip of one model as a clip of another.
pub fn retarget(args: &RetargetArgs, json: bool) -> Result<(), CliError> {
    check_edits(&args.edits)?;
    let clip = model::clip(&args.clip)?;
    let from = model::of_clip(&args.clip, &clip, args.from.as_deref())?;
    let animation = Animation::of_clip(&args.clip, &from, &clip)?;
    write(&args.clip, animation, &model::load(&args.model)?, &args.edits, json)
}

/// What can be told to be wrong before anything is read.
fn check_edits(edits: &Edits) -> Result<(), CliError> {
    if edits.out.extension().is_none_or(|extension| extension != "motion") {
        let found = path_word(&edits.out);
        return Err(CliError::Usage(format!("--out is {found}, expected a name that ends with .motion")));
    }
    if !(1.0..=1000.0).contains(&edits.fps) {
        return Err(CliError::Usage(format!("--fps is {}, expected 1 to 1000", edits.fps)));
    }
    if !(0.0..=10.0).contains(&edits.smooth) {
        return Err(CliError::Usage(format!("--smooth is {}, expected 0 to 10 seconds", edits.smooth)));
    }
    if !(0.0..=100.0).contains(&edits.balance) {
        return Err(CliError::Usage(format!("--balance is {}, expected a factor from 0 to 100", edits.balance)));
    }
    if let Some(&[from, to]) = edits.trim.as_deref()
        && !(from >= 0.0 && to > from)
    {
        return Err(CliError::Usage(format!("--trim is {from} {to}, expected two times, the later one second")));
    }
    Ok(())
}

/// Edits, retargets, writes and checks.
fn write(path: &Path, animation: Animation, model: &Model, edits: &Edits, json: bool) -> Result<(), CliError> {
    let mut recording = animation.clip().clone();
    if let Some(&[from, to]) = edits.trim.as_deref() {
        recording = recording.trim(path, from, to)?;
    }
    let mut animation = animation.with_clip(recording);
    let wraps = match edits.looping {
        Looping::Auto => animation.wraps() && edits.trim.is_none(),
        Looping::Wrap => true,
        Looping::None => false,
    };
    if wraps && animation.cycle().is_none() {
        animation = animation.looped();
    }
    let recording = animation.clip().resample(path, 1.0 / edits.fps)?.smooth(edits.smooth);
    let animation = animation.with_clip(recording);

    let mapping = match &edits.mapping {
        Some(file) => {
            let bytes = std::fs::read(file).map_err(CliError::io(file, "read"))?;
            Mapping::parse(file, &bytes, animation.skeleton(), model)?
        }
        None => Mapping::built_in(path, animation.skeleton(), model)?,
    };
    let mapping = mapping.balanced(edits.balance);
    let mut clip = marathon_motion::retarget(path, &animation, model, &mapping)?;
    let fit = marathon_motion::fit(path, &animation, model, &mapping, &clip)?;
    if edits.mirror {
        clip = clip.mirror(path, model)?;
    }
    if edits.forward {
        clip = clip.at_origin();
    }
    let known = clip.about();
    let stem = edits.out.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let or = |given: &Option<String>, known: &str, default: &str| {
        given.clone().unwrap_or_else(|| if known.is_empty() { default.into() } else { known.into() })
    };
    let about = About {
        name: edits.name.clone().unwrap_or(stem),
        model: model.name.clone(),
        source: or(&edits.source, &known.source, "unknown"),
        license: or(&edits.license, &known.license, "unknown"),
    };
    let clip = clip.with_about(about).rounded();
    write_atomic(&edits.out, &clip.to_bytes())?;

    let report = marathon_motion::check(&edits.out, &clip, model, mapping.soles())?;
    if json {
        let mut document = show::document(&edits.out, &report);
        document["fit"] = json!(fit);
        print_json(&document);
    } else {
        say(format!("wrote {}: {}", path_word(&edits.out), show::line(&report)));
        say(format!("  {}", show::fit_line(&fit)));
        report.warnings().iter().for_each(|warning| say(format!("  {warning}")));
    }
    Ok(())
}
