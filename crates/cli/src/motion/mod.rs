//! `marathon motion`: converts recordings of people to clips of a character, and checks and draws clips.

mod import;
pub mod model;
mod policy;
mod show;

use crate::error::CliError;
use crate::number::count;
use crate::video::Ghost;
use clap::{Subcommand, ValueEnum};
use marathon_motion::import::Up;
use marathon_runs::TaskOptions;
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  marathon motion import walk.bvh --model humanoid --out walk.motion    a recording, as the humanoid would do it
  marathon motion check walk.motion                                     limits, ground, overlaps, jumps, slides
  marathon motion render walk.motion --out walk.png                     see it
  marathon motion render walk.motion --policy runs/MarathonMan-1 --out follow.gif    how a policy follows it
  marathon motion retarget walk.motion --model walker2d --out w.motion  the same by another character";

/// Options of `motion`.
#[derive(Debug, clap::Args)]
#[command(arg_required_else_help = true, after_help = HELP)]
pub struct MotionArgs {
    /// Command.
    #[command(subcommand)]
    pub what: What,
}

/// Command.
#[derive(Debug, Subcommand)]
pub enum What {
    /// Convert a recording (.bvh, .glb, .gltf, .vrm, .vrma, or .txt and .json of DeepMimic) to a clip of a character.
    Import(ImportArgs),
    /// Convert a clip of one character to a clip of another.
    Retarget(RetargetArgs),
    /// Check clips for problems; the exit code is 1 if there are any.
    Check(CheckArgs),
    /// Draw a clip, alone or with a policy that follows it: a strip of frames, an animation or a video.
    Render(RenderArgs),
}

/// Whether a motion loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Looping {
    /// As the recording says; most formats say nothing, which means none.
    Auto,
    /// Loops: the last pose repeats the first, farther on.
    Wrap,
    /// Loops: the part of 0.3 to 4 s whose ends are most alike.
    Find,
    /// Ends.
    None,
}

/// Edits of a motion, and its description.
#[derive(Debug, clap::Args)]
pub struct Edits {
    /// Clip to write; its name ends in .motion.
    #[arg(long, value_name = "F.motion")]
    pub out: PathBuf,
    /// Mapping from skeleton joints to bodies [default: Marathon's built-in one for the model].
    #[arg(long, value_name = "F.json")]
    pub mapping: Option<PathBuf>,
    /// Whether the motion loops.
    #[arg(long = "loop", value_name = "HOW", value_enum, default_value_t = Looping::Auto)]
    pub looping: Looping,
    /// Part of the recording to use, seconds.
    #[arg(long, value_names = ["FROM", "TO"], num_args = 2)]
    pub trim: Option<Vec<f64>>,
    /// Frames per second of the clip.
    #[arg(long, value_name = "HZ", default_value_t = 60.0)]
    pub fps: f64,
    /// Standard deviation of a Gaussian filter over the recording, seconds.
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    pub smooth: f64,
    /// Factor on the balance law: only ground contacts change the angular momentum.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    pub balance: f64,
    /// Exchange left and right.
    #[arg(long)]
    pub mirror: bool,
    /// Begin with the heading +x.
    #[arg(long)]
    pub forward: bool,
    /// Name of the motion [default: that of the output file].
    #[arg(long, value_name = "TEXT")]
    pub name: Option<String>,
    /// Author or source of the recording.
    #[arg(long, value_name = "TEXT")]
    pub source: Option<String>,
    /// License of the recording.
    #[arg(long, value_name = "TEXT")]
    pub license: Option<String>,
}

/// Options of `motion import`.
#[derive(Debug, clap::Args)]
pub struct ImportArgs {
    /// Recording to read. A .motion file is written again with a checksum.
    pub recording: PathBuf,
    /// Character: an agent, or an MJCF file.
    #[arg(long, value_name = "AGENT|F.xml")]
    pub model: Option<String>,
    /// Axis of the recording that points up: x, y, z, -x, -y or -z [default: found from the motion].
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true, value_parser = up)]
    pub up: Option<Up>,
    /// Height of the floor in the recording, meters [default: found from the contacts].
    #[arg(long, value_name = "METERS", allow_hyphen_values = true)]
    pub floor: Option<f64>,
    /// Animation of a glTF file: its name, or its index from 0 [default: the first one].
    #[arg(long, value_name = "NAME|INDEX")]
    pub animation: Option<String>,
    #[command(flatten)]
    pub edits: Edits,
}

fn up(text: &str) -> Result<Up, String> {
    let found = Up::ALL.into_iter().find(|up| up.to_string() == text.trim_start_matches('+').to_ascii_lowercase());
    found.ok_or_else(|| "expected x, y, z, -x, -y or -z".into())
}

/// Options of `motion retarget`.
#[derive(Debug, clap::Args)]
pub struct RetargetArgs {
    /// Clip to read: a .motion file, or the name of one of Marathon's clips.
    pub clip: PathBuf,
    /// Character of the input clip: an agent, or an MJCF file [default: the agent that the clip names].
    #[arg(long, value_name = "AGENT|F.xml")]
    pub from: Option<String>,
    /// Character of the output clip: an agent, or an MJCF file.
    #[arg(long, value_name = "AGENT|F.xml")]
    pub model: String,
    #[command(flatten)]
    pub edits: Edits,
}

/// Options of `motion check`.
#[derive(Debug, clap::Args)]
pub struct CheckArgs {
    /// Clips to read: .motion files, or names of Marathon's clips.
    #[arg(required = true)]
    pub clips: Vec<PathBuf>,
    /// Character: an agent, or an MJCF file [default: the agent that the clip names].
    #[arg(long, value_name = "AGENT|F.xml")]
    pub model: Option<String>,
}

/// Options of `motion render`.
#[derive(Debug, clap::Args)]
pub struct RenderArgs {
    /// Clip to read: a .motion file, or the name of one of Marathon's clips.
    pub clip: PathBuf,
    /// Character: an agent, or an MJCF file [default: the agent that the clip names].
    #[arg(long, value_name = "AGENT|F.xml")]
    pub model: Option<String>,
    /// Picture to write: .png is a strip of frames, .gif an animation, .mp4 a video (needs ffmpeg).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Policy that follows the clip, a file or the folder of a run: draw it, with the clip as its ghost, from the
    /// clip's first frame on.
    #[arg(long, value_name = "RUN|F", conflicts_with = "model")]
    pub policy: Option<PathBuf>,
    /// Place of the ghost: inside the policy's character, or beside it [default: inside].
    #[arg(long, value_name = "WHERE", num_args = 0..=1, default_missing_value = "inside", requires = "policy")]
    pub ghost: Option<Ghost>,
    /// Options of the policy's task.
    #[command(flatten)]
    pub task: TaskOptions,
    /// Length, seconds [default: that of the clip; 8 for a video of a policy whose clip loops].
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,
    /// Frames of a .png strip.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = count::<u64>(1..=1000))]
    pub frames: u64,
    /// Frames per second of a video.
    #[arg(long, value_name = "HZ", default_value_t = 25.0)]
    pub fps: f64,
    /// Width of a frame, pixels [default: 240 for .png, 480 otherwise].
    #[arg(long, value_name = "PIXELS")]
    pub width: Option<usize>,
}

/// Runs one of the commands.
///
/// # Errors
/// If a file cannot be read or written, a model or motion is wrong, or `check` finds something.
pub fn run(args: &MotionArgs, json: bool) -> Result<(), CliError> {
    match &args.what {
        What::Import(import) => import::import(import, json),
        What::Retarget(retarget) => import::retarget(retarget, json),
        What::Check(check) => show::check(check, json),
        What::Render(render) => match &render.policy {
            Some(policy) => policy::render(render, policy, json),
            None => show::render(render, json),
        },
    }
}
