//! `marathon motion import` and `retarget`.

use super::{Edits, ImportArgs, Looping, RetargetArgs, model, show};
use crate::error::CliError;
use crate::program;
use marathon_learn::write_atomic;
use marathon_motion::import::{self as read, Reading, Recording};
use marathon_motion::{About, Animation, Clip, Mapping};
use marathon_physics::Model;
use marathon_physics::budget::{self, CLIP_FILE, CONFIG_FILE, RECORDING_FILE};
use marathon_runs::clips;
use marathon_runs::terminal::{print_json, say};
use marathon_runs::text::path_word;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;

/// Converts a recording to a clip.
pub fn import(args: &ImportArgs, json: bool) -> Result<(), CliError> {
    check_edits(&args.edits)?;
    let path = &args.recording;
    check_out(path, &args.edits.out)?;
    if path.extension().is_some_and(|ending| ending == "motion") {
        return again(args, json);
    }
    let Some(name) = &args.model else {
        return Err(CliError::Usage("--model is missing, expected a character: an agent or an MJCF file".into()));
    };
    let model = model::load(name)?;
    let known_as = match &args.edits.mapping {
        Some(file) => Mapping::known_as(file, &mapping(file)?)?,
        None => BTreeMap::new(),
    };
    let bytes = budget::read(path, &RECORDING_FILE).map_err(CliError::io(path, "read"))?;
    let beside = |name: &str| clips::beside(path, name);
    let reading =
        Reading { up: args.up, floor: args.floor, animation: args.animation.clone(), known_as, beside: Some(&beside) };
    let Recording { animation, notes } = read::read(path, &bytes, &reading)?;
    write(path, animation, &model, &args.edits, notes, json)
}

/// Rewrites a clip with a checksum, or with new descriptive texts.
fn again(args: &ImportArgs, json: bool) -> Result<(), CliError> {
    let (path, edits) = (&args.recording, &args.edits);
    let bytes = budget::read(path, &CLIP_FILE).map_err(CliError::io(path, "read"))?;
    let clip = Clip::parse_without_checksum(path, &bytes)?;
    let changes =
        edits.mapping.is_some() || edits.trim.is_some() || edits.mirror || edits.forward || edits.smooth > 0.0;
    if changes
        || edits.looping != Looping::Auto
        || args.up.is_some()
        || args.floor.is_some()
        || args.animation.is_some()
    {
        return Err(CliError::Usage(format!(
            "{} is a clip already: `import` only writes its checksum; `{} motion retarget` edits clips",
            path_word(path),
            program::name()
        )));
    }
    if let Some(name) = &args.model {
        clip.check_model(path, &model::load(name)?)?;
    }
    let known = clip.about().clone();
    let about = About {
        name: edits.name.clone().unwrap_or(known.name),
        source: edits.source.clone().unwrap_or(known.source),
        license: edits.license.clone().unwrap_or(known.license),
        ..known
    };
    let clip = clip.with_about(about);
    write_atomic(&edits.out, &clip.to_bytes())?;
    if json {
        print_json(&json!({ "clip": edits.out.to_string_lossy(), "frames": clip.frames() }));
    } else {
        say(format!("wrote {}: {} frames, {:.2} s", path_word(&edits.out), clip.frames(), clip.duration()));
    }
    Ok(())
}

/// Converts a clip of one model to a clip of another.
pub fn retarget(args: &RetargetArgs, json: bool) -> Result<(), CliError> {
    check_edits(&args.edits)?;
    check_out(&args.clip, &args.edits.out)?;
    let clip = model::clip(&args.clip)?;
    let from = model::of_clip(&args.clip, &clip, args.from.as_deref())?;
    let animation = Animation::of_clip(&args.clip, &from, &clip)?;
    write(&args.clip, animation, &model::load(&args.model)?, &args.edits, Vec::new(), json)
}

/// Reads a mapping file.
fn mapping(file: &Path) -> Result<Vec<u8>, CliError> {
    budget::read(file, &CONFIG_FILE).map_err(CliError::io(file, "read"))
}

/// Refuses an output that would overwrite the input.
fn check_out(input: &Path, out: &Path) -> Result<(), CliError> {
    let same = input.canonicalize().ok().zip(out.canonicalize().ok()).is_some_and(|(input, out)| input == out);
    if input == out || same {
        let found = path_word(out);
        return Err(CliError::Usage(format!("--out is {found}, which is also the input; expected another file")));
    }
    Ok(())
}

/// Checks of the options that need no file.
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
fn write(
    path: &Path,
    animation: Animation,
    model: &Model,
    edits: &Edits,
    mut notes: Vec<String>,
    json: bool,
) -> Result<(), CliError> {
    // one function: a list of edits in the order in which they apply
    let mut recording = animation.clip().clone();
    if let Some(&[from, to]) = edits.trim.as_deref() {
        recording = recording.trim(path, from, to)?;
    }
    if edits.looping == Looping::Find {
        let [from, to] = recording.best_loop(path)?;
        recording = recording.trim(path, from, to)?;
        let before = edits.trim.as_deref().map_or(0.0, |trim| trim[0]);
        notes.push(format!("loops from {:.3} to {:.3} s of the recording", before + from, before + to));
    }
    let mut animation = animation.with_clip(recording);
    let wraps = match edits.looping {
        Looping::Auto => animation.wraps() && edits.trim.is_none(),
        Looping::Wrap | Looping::Find => true,
        Looping::None => false,
    };
    if wraps && animation.cycle().is_none() {
        let seam = animation.seam();
        let differ = || {
            format!(
                "its ends differ by {:.2} m in height, {:.0} degrees in the trunk and {:.0} degrees in the joints",
                seam.height.abs(),
                seam.tilt.to_degrees(),
                seam.joints.to_degrees()
            )
        };
        if seam.gapes() && edits.looping != Looping::Auto {
            let how = if edits.looping == Looping::Find { "find" } else { "wrap" };
            return Err(CliError::Usage(format!(
                "--loop {how}: {}: {}, expected two similar poses; --trim FROM TO selects them",
                path_word(path),
                differ()
            )));
        }
        if seam.shows() {
            notes.push(format!("{}; a loop spreads this over the cycle: select other ends with --trim", differ()));
        }
        animation = animation.looped(path)?;
    }
    let recording = animation.clip().resample(path, 1.0 / edits.fps)?.smooth(path, edits.smooth)?;
    let animation = animation.with_clip(recording);

    let mapping = match &edits.mapping {
        Some(file) => Mapping::parse(file, &mapping(file)?, animation.skeleton(), model)?,
        None => Mapping::built_in(path, animation.skeleton(), model)?,
    };
    let mapping = mapping.balanced(edits.balance);
    let mut clip = marathon_motion::retarget(path, &animation, model, &mapping)?;
    let fit = marathon_motion::fit(path, &animation, model, &mapping, &clip)?;
    if edits.mirror {
        clip = clip.mirror(path, model)?;
    }
    if edits.forward {
        clip = clip.at_origin(path)?;
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
        fit: Some(fit.nearness()),
    };
    let clip = clip.with_about(about).rounded(path)?;
    write_atomic(&edits.out, &clip.to_bytes())?;

    let mut report = marathon_motion::check(&edits.out, &clip, model, mapping.soles())?;
    // the warning of the fit has more detail
    report.fit = None;
    let mut warnings = fit.warnings();
    warnings.extend(report.warnings());
    if json {
        let mut document = show::document(&edits.out, &report);
        document["fit"] = json!(fit);
        document["warnings"] = json!(warnings);
        document["found"] = json!(notes);
        print_json(&document);
    } else {
        say(format!("wrote {}: {}", path_word(&edits.out), show::line(&report)));
        say(format!("  {}", show::fit_line(&fit)));
        notes.iter().for_each(|note| say(format!("  note: {note}")));
        warnings.iter().for_each(|warning| say(format!("  {warning}")));
    }
    Ok(())
}
