//! `marathon render`: records a policy.

use crate::args::RenderArgs;
use crate::error::CliError;
use crate::video::{Cast, Shot, shoot};
use marathon_physics::budget::MEMORY;
use marathon_render::{Format, MAX_SIDE};
use marathon_runs::terminal::{self, interrupt, print_json, say};
use marathon_runs::{PolicySource, output};
use std::path::Path;

/// Memory per pixel while a frame is drawn, bytes.
const PIXEL: f64 = 4.0;
/// Maximum number of agents side by side.
const MAX_AGENTS: usize = 64;

/// Plays a policy with its best actions and records it.
///
/// # Errors
/// If there is no such policy, an option is invalid, or the picture cannot be written.
pub fn run(args: &RenderArgs, json: bool) -> Result<(), CliError> {
    let shot = shot(args)?;
    output::check(&args.out, &["png", "gif", "mp4"], &[&args.source.policy])?;
    let (policies, factory) = args.source.load_all()?;
    terminal::notes(args.source.note());
    let cast = Cast { agents: args.agents, seed: args.seed, start: args.video.start, ghost: args.ghost };
    interrupt::install("leaving without a picture")?;
    let report = shoot(&policies, factory.spec(), &shot, &cast, &args.out)?;
    if json {
        print_json(&report);
    } else {
        say(report.line());
    }
    Ok(())
}

/// Records a short video of the policy in a run's folder. Returns a line about it.
///
/// # Errors
/// If the policy cannot be read or the video cannot be written.
pub fn preview(folder: &Path, out: &Path) -> Result<String, CliError> {
    let source = PolicySource { policy: folder.into(), ..PolicySource::default() };
    let (policies, factory) = source.load_all()?;
    let shot = Shot { format: Format::Gif, width: 400, height: 224, length: 6.0, frames: 1, fps: 25.0 };
    let seed = marathon_learn::EvalOptions::default().seed;
    let cast = Cast { agents: 1, seed, start: 0.0, ghost: None };
    Ok(shoot(&policies, factory.spec(), &shot, &cast, out)?.line())
}

fn shot(args: &RenderArgs) -> Result<Shot, CliError> {
    let format = Format::of(&args.out)?;
    let (seconds, fps, width) = match format {
        Format::Png => (2.0, 25.0, 240),
        Format::Gif => (8.0, 25.0, 480),
        Format::Mp4 => (8.0, 50.0, 960),
    };
    let width = args.width.unwrap_or(width);
    let height = args.height.unwrap_or(match format {
        Format::Png => width.saturating_mul(4) / 3,
        // video encoders need even sides
        _ => width.saturating_mul(9) / 16 / 2 * 2,
    });
    let (length, fps) = (args.video.seconds.unwrap_or(seconds), args.video.fps.unwrap_or(fps));
    let frames = args.frames.unwrap_or(8);
    let usage = |text: String| Err(CliError::Usage(text));
    args.video.validate()?;
    for (name, pixels) in [("width", width), ("height", height)] {
        if !(1..=MAX_SIDE).contains(&pixels) {
            return usage(format!("--{name} is {pixels}, expected 1 to {MAX_SIDE} pixels"));
        }
    }
    if !(1..=1000).contains(&frames) {
        return usage(format!("--frames is {frames}, expected 1 to 1000"));
    }
    if !(1..=MAX_AGENTS).contains(&args.agents) {
        return usage(format!("--agents is {}, expected 1 to {MAX_AGENTS}", args.agents));
    }
    match format {
        Format::Png if args.video.fps.is_some() => usage("--fps is for .gif and .mp4; a .png has --frames".into()),
        Format::Gif | Format::Mp4 if args.frames.is_some() => {
            usage("--frames is for .png; a video has --seconds and --fps".into())
        }
        _ => {
            // pixels of all frames in memory, and of the picture made from them
            let pixels = width as f64 * height as f64 * if format == Format::Png { 2.0 * frames as f64 } else { 2.0 };
            let asked = MEMORY.check(PIXEL * pixels);
            asked.map_err(|error| CliError::Usage(format!("--width and --height: the picture {error}")))?;
            Ok(Shot { format, width, height, length, frames, fps })
        }
    }
}
