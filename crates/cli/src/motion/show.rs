//! `marathon motion check` and `render`.

use super::{CheckArgs, RenderArgs, model};
use crate::error::CliError;
use crate::video::Shot;
use marathon_motion::{Fit, Report, soles};
use marathon_render::{Corner, Follow, Format, Recorder, Renderer, Scene};
use marathon_runs::terminal::{interrupt, print_json, say};
use marathon_runs::text::path_word;
use serde_json::{Value, json};
use std::path::Path;

/// Measures clips.
pub fn check(args: &CheckArgs, json: bool) -> Result<(), CliError> {
    let (mut documents, mut found) = (Vec::new(), 0);
    for path in &args.clips {
        let clip = model::clip(path)?;
        let model = model::of_clip(path, &clip, args.model.as_deref())?;
        let report = marathon_motion::check(path, &clip, &model, &soles(&model))?;
        if json {
            documents.push(document(path, &report));
        } else {
            say(format!("{}: {}", path_word(path), line(&report)));
            report.warnings().iter().for_each(|warning| say(format!("  {warning}")));
            report.notes().iter().for_each(|note| say(format!("  note: {note}")));
        }
        found += usize::from(!report.warnings().is_empty());
    }
    if json {
        print_json(&json!({ "clips": documents }));
    }
    match found {
        0 => Ok(()),
        n => Err(CliError::Found(format!("{n} of {} clips have something wrong", args.clips.len()))),
    }
}

/// A report with its file and its warnings.
pub fn document(path: &Path, report: &Report) -> Value {
    json!({ "clip": path.to_string_lossy(), "report": report, "warnings": report.warnings(), "notes": report.notes() })
}

/// A report in one line.
pub fn line(report: &Report) -> String {
    format!(
        "{} frames, {:.2} s; stands in {:.0} % of it, slides {:.1} cm at most and {:.1} cm/s on average; \
         joints turn at {:.0} rad/s at most",
        report.frames,
        report.seconds,
        1e2 * report.standing,
        1e2 * report.slide.value,
        1e2 * report.slide_speed,
        report.speed.value
    )
}

/// The difference between a clip and its recording in one line.
pub fn fit_line(fit: &Fit) -> String {
    format!(
        "its parts are {:.1} cm and {:.0} degrees from the recording's on average; {} is {:.0} cm away in frame {}",
        1e2 * fit.position,
        fit.rotation.to_degrees(),
        fit.furthest.name,
        1e2 * fit.furthest.value,
        fit.furthest.frame
    )
}

/// The requested picture of a clip. `seconds` is the default of `--seconds`.
pub fn shot(args: &RenderArgs, seconds: f64) -> Result<Shot, CliError> {
    let length = args.seconds.unwrap_or(seconds);
    if !(length > 0.0 && length <= 3600.0) {
        return Err(CliError::Usage(format!("--seconds is {length}, expected up to 3600")));
    }
    if !(1.0..=240.0).contains(&args.fps) {
        return Err(CliError::Usage(format!("--fps is {}, expected 1 to 240", args.fps)));
    }
    let format = Format::of(&args.out)?;
    let still = format == Format::Png;
    let width = args.width.unwrap_or(if still { 240 } else { 480 });
    // video encoders need even sides
    let height = if still { width * 4 / 3 } else { width * 9 / 16 / 2 * 2 };
    Ok(Shot { format, width, height, length, frames: args.frames as usize, fps: args.fps })
}

/// Draws a clip.
pub fn render(args: &RenderArgs, json: bool) -> Result<(), CliError> {
    if let Some((name, _)) = args.task.given.first() {
        return Err(CliError::Usage(format!("--option {name} is for the task of a policy; it requires --policy")));
    }
    let clip = model::clip(&args.clip)?;
    let model = model::of_clip(&args.clip, &clip, args.model.as_deref())?;
    let shot = shot(args, clip.duration())?;

    interrupt::install("leaving without a picture")?;
    let scene = Scene::new(&model);
    let renderer = Renderer::new(shot.width, shot.height)?;
    let mut camera = Follow::new(&scene, 1, shot.width, shot.height);
    let mut recorder = Recorder::create(&args.out, shot.fps, shot.columns())?;
    let mut qpos = vec![0.0; model.nq];
    let (times, mut before) = (shot.times(), 0.0);
    for time in &times {
        clip.qpos(*time, &mut qpos);
        let frame = scene.frame(&[&qpos])?;
        let mut image = renderer.render(&frame, &camera.update(&frame, time - before));
        image.caption(Corner::TopLeft, &[format!("{} {time:.2} s", clip.about().name)]);
        recorder.push(&image)?;
        before = *time;
        if interrupt::requested() {
            return Err(CliError::Interrupted("nothing was written".into()));
        }
    }
    recorder.finish()?;
    let (count, Shot { width, height, .. }) = (times.len(), shot);
    if json {
        print_json(&json!({ "out": args.out.to_string_lossy(), "frames": count, "width": width, "height": height }));
    } else {
        say(format!("wrote {} ({count} frames of {width}x{height})", path_word(&args.out)));
    }
    Ok(())
}
