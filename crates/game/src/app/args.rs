//! The command line of `marathon-game`.

use crate::app::course::Part;
use crate::app::cues::Cue;
use crate::app::hands::Hold;
use crate::app::steer::{Mapping, Mappings};
use crate::ground::Ground;
use crate::look::{CameraMode, Quality};
use clap::{Parser, ValueEnum};
use marathon_learn::EvalOptions;
use marathon_runs::{FilmOptions, LearnOptions, TaskOptions};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  marathon-game                                  a trained hopper; everything else is in the menu (Esc)
  marathon-game humanoid --agents 16             a row of them
  marathon-game runs/hopper-1                    the policy of a run, which is read again whenever training saves it
  marathon-game hopper --mode learn              from random weights to a run, before your eyes
  marathon-game --mode imitate                   a person walks, beside the clip that it follows; N: runs, flips
  marathon-game MarathonMan --mode imitate --option clip=my.bvh   a clip of your own; L learns it
  marathon-game walker --mode push               click to push, B to throw balls, sliders for gravity and friction
  marathon-game --mode course                    an assault course, and the table of the longest runs (T)
  marathon-game --mode course --part run         you lead the runner, by arrow keys or gamepad
  marathon-game --mode course --part build       you build the ground ahead of it, with the mouse
  marathon-game --mode testbed my-robot.xml      a slider per motor
  marathon-game ant --ground stairs              or hills, or boards
  marathon-game MarathonManRun --skin marathon_man   with the skin of a person; or with that of hero.glb
  marathon-game hopper --record hop.mp4          a film, without a window (needs ffmpeg)
  marathon-game hopper --mode push --press 1.5:throw --record ball.mp4   the same with a ball thrown at it
  marathon-game --replay run.replay              what R recorded, with a time line
  marathon-game hopper --agents 16 --mlagents-port 5004   mlagents-learn trains, and one watches

Keys are shown on the screen (F1) and can be changed in the menu.";

/// Watch, push, teach and film physical characters.
#[derive(Clone, Debug, Parser)]
#[command(name = "marathon-game", version, about, after_help = EXAMPLES)]
pub struct Args {
    /// Agent (such as hopper, walker, humanoid, MarathonManRun), policy file, folder of a run, or MJCF file (.xml) [with
    /// --mode imitate: MarathonManWalk; with --mode course: TerrainWalker2d, or with --part run AntController].
    #[arg(default_value = "hopper", default_value_ifs([
        ("mode", "imitate", "MarathonManWalk"),
        ("part", "run", "AntController"),
        ("mode", "course", "TerrainWalker2d"),
    ]))]
    pub what: String,
    /// What to do.
    #[arg(long, value_enum, default_value_t = Mode::Watch)]
    pub mode: Mode,
    /// Policy file, or folder of a run [default: the one that comes with the agent].
    #[arg(long, value_name = "FILE")]
    pub policy: Option<PathBuf>,
    /// Agents side by side.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    pub agents: u16,
    /// What they run on.
    #[arg(long, value_enum, default_value_t = GroundArg::Level)]
    pub ground: GroundArg,
    /// Arguments of the task; the others are those that the policy was trained with.
    #[command(flatten)]
    pub task: TaskOptions,
    /// Recording to show, as R makes them.
    #[arg(long, value_name = "FILE")]
    pub replay: Option<PathBuf>,
    /// Character that they wear: a .glb file with a skeleton, or marathon_man, which comes with Marathon.
    #[arg(long, value_name = "FILE")]
    pub skin: Option<PathBuf>,
    /// Which of its bones follows which body, for a skeleton whose names are not known [default: the mapping that comes with
    /// Marathon for the model].
    #[arg(long, value_name = "F.json", requires = "skin")]
    pub mapping: Option<PathBuf>,
    /// How --mode learn learns; the seed is that of everything random.
    #[command(flatten)]
    pub learn: LearnOptions,

    /// What --mode course runs over: flat, slopes, steps, stairs, gaps, rubble, boxes, mixed, meters, bumps, blocks or adversary
    /// [default: mixed].
    #[arg(long, value_name = "KIND")]
    pub course: Option<String>,
    /// How difficult that is, from 0 to 1 [default: 0.5].
    #[arg(long, value_name = "D")]
    pub difficulty: Option<f64>,
    /// What you do there [default: watch].
    #[arg(long, value_enum)]
    pub part: Option<Part>,
    /// What you are called in the table of the longest runs [default: your user name].
    #[arg(long, value_name = "NAME")]
    pub player: Option<String>,
    /// Table of the longest runs, an SQLite file [default: marathon/runs.sqlite in the folder for your data].
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,
    /// Print that table.
    #[arg(long)]
    pub runs: bool,

    /// Port on which mlagents-learn listens (5004 by default): it trains the agents, and one watches.
    #[arg(long, value_name = "N", conflicts_with_all = ["mode", "policy", "replay", "record", "watch_stream"])]
    pub mlagents_port: Option<u16>,
    /// Show what comes through the standard input; the Python package does so for render_mode="human".
    #[arg(long, conflicts_with_all = ["mode", "policy", "replay", "record"])]
    pub watch_stream: bool,

    /// Deflection up to which sticks and triggers that steer count as released, from 0 to below 1.
    #[arg(long, value_name = "SHARE", default_value_t = Mappings::default().pad.dead_zone, value_parser = dead_zone)]
    pub dead_zone: f32,
    /// Power that the rest of a deflection is raised to: above 1, a small deflection says less.
    #[arg(long, value_name = "POWER", default_value_t = Mappings::default().pad.curve, value_parser = curve)]
    pub curve: f32,
    /// Time in which what sticks and triggers say arrives but for a third, s.
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = smoothing)]
    pub smoothing: f32,
    /// The same of the keys that steer.
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = smoothing)]
    pub key_smoothing: f32,

    /// Do at a time what a key does, such as 2.5:throw or 4:next-agent; may be given again.
    #[arg(long, value_name = "S:DEED")]
    pub press: Vec<Cue>,
    /// Hold a key, a stick, a trigger or a button of a gamepad from a time to another, such as 1-2.5:key:up, 1-3:pad:left-y=0.5 or
    /// 2-2.2:pad2:a; may be given again.
    #[arg(long, value_name = "S-S:DEVICE:WHAT")]
    pub hold: Vec<Hold>,

    /// How much a frame may cost; [default: medium, and low where a processor draws the window].
    #[arg(long, value_enum)]
    pub quality: Option<QualityArg>,
    /// Size of the window or the film, pixels [default: 1280x720].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,
    /// Where the camera stands.
    #[arg(long, value_enum, default_value_t = CameraArg::Side)]
    pub camera: CameraArg,
    /// Most frames per second of the window; 0: as many as the screen shows.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub max_fps: u32,
    /// Draw contacts and their forces.
    #[arg(long)]
    pub contacts: bool,
    /// Draw joints and their limits.
    #[arg(long)]
    pub joints: bool,

    /// Film to write instead of opening a window: .mp4 (needs ffmpeg), .png (one picture, of the last frame), or a folder for
    /// a sequence of .png.
    #[arg(long, value_name = "OUT")]
    pub record: Option<PathBuf>,
    /// Its time.
    #[command(flatten)]
    pub film: FilmOptions,
    /// Film without text and bars.
    #[arg(long)]
    pub no_hud: bool,
}

/// Size of a window or film when nobody has chosen one, pixels.
const SIZE: (u32, u32) = (1280, 720);
/// Length of a film and its frames per second, likewise.
const SECONDS: f64 = 8.0;
const FPS: f64 = 30.0;

/// A number of the command line within a range.
fn within(text: &str, fits: impl Fn(f32) -> bool, expected: &str) -> Result<f32, String> {
    text.parse().ok().filter(|x| fits(*x)).ok_or_else(|| format!("expected {expected}"))
}

fn dead_zone(text: &str) -> Result<f32, String> {
    within(text, |x| (0.0..1.0).contains(&x), "a number from 0 to below 1")
}

fn curve(text: &str) -> Result<f32, String> {
    within(text, |x| x > 0.0 && x <= 10.0, "a number above 0, up to 10")
}

fn smoothing(text: &str) -> Result<f32, String> {
    within(text, |x| (0.0..=10.0).contains(&x), "seconds from 0 to 10")
}

impl Args {
    /// What becomes of what gamepads and keys say.
    pub fn mappings(&self) -> Mappings {
        let Args { dead_zone, curve, smoothing, key_smoothing, .. } = *self;
        let keys = Mapping { smoothing: key_smoothing, ..Mappings::default().keys };
        Mappings { pad: Mapping { dead_zone, curve, smoothing }, keys }
    }

    /// Size of the window or film, pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size.unwrap_or(SIZE)
    }

    /// Seed of everything random.
    pub fn seed(&self) -> u64 {
        self.learn.seed.unwrap_or(EvalOptions::default().seed)
    }

    /// Length of the film, seconds.
    pub fn seconds(&self) -> f64 {
        self.film.seconds.unwrap_or(SECONDS)
    }

    /// Frames per second of the film.
    pub fn fps(&self) -> f64 {
        self.film.fps.unwrap_or(FPS)
    }

    /// How much a frame may cost.
    pub fn quality(&self) -> Quality {
        self.quality.map_or(Quality::Medium, Quality::from)
    }
}

/// What to do with the characters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// Look at a policy.
    #[default]
    Watch,
    /// Try to make it fall.
    Push,
    /// See how near one is to the motion clip that it follows.
    Imitate,
    /// Run over an assault course.
    Course,
    /// Train from random weights and look on.
    Learn,
    /// Move the motors of any MJCF model.
    Testbed,
    /// Look at a recording.
    Replay,
    /// Look at what another program moves.
    #[value(skip)]
    Outside,
}

impl Mode {
    /// What it is called on the screen.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Watch => "watch",
            Mode::Push => "push",
            Mode::Imitate => "imitate",
            Mode::Course => "assault course",
            Mode::Learn => "learn live",
            Mode::Testbed => "test bed",
            Mode::Replay => "replay",
            Mode::Outside => "from outside",
        }
    }
}

/// [`Ground`] on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum GroundArg {
    /// Level, as in training.
    Level,
    /// Waves that grow to 60 cm.
    Hills,
    /// Flights of five steps, up and down.
    Stairs,
    /// Low boards across the track.
    Boards,
}

impl From<GroundArg> for Ground {
    fn from(ground: GroundArg) -> Self {
        match ground {
            GroundArg::Level => Ground::Level,
            GroundArg::Hills => Ground::Hills,
            GroundArg::Stairs => Ground::Stairs,
            GroundArg::Boards => Ground::Boards,
        }
    }
}

/// [`Quality`] on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum QualityArg {
    /// No shadows, no smoothed edges.
    Low,
    /// Shadows, edges smoothed.
    Medium,
    /// Larger shadow maps.
    High,
}

impl From<QualityArg> for Quality {
    fn from(quality: QualityArg) -> Self {
        match quality {
            QualityArg::Low => Quality::Low,
            QualityArg::Medium => Quality::Medium,
            QualityArg::High => Quality::High,
        }
    }
}

/// [`CameraMode`] on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CameraArg {
    /// Beside the runner.
    Side,
    /// Behind it.
    Chase,
    /// Around it.
    Orbit,
}

impl From<CameraArg> for CameraMode {
    fn from(camera: CameraArg) -> Self {
        match camera {
            CameraArg::Side => CameraMode::Side,
            CameraArg::Chase => CameraMode::Chase,
            CameraArg::Orbit => CameraMode::Orbit,
        }
    }
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let number = |s: &str| s.parse::<u32>().ok().filter(|n| (16..=8192).contains(n));
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some((number(w)?, number(h)?)));
    sides.ok_or_else(|| "expected a width and a height from 16 to 8192, such as 1280x720".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn sizes_are_read() {
        assert_eq!(parse_size("320x192"), Ok((320, 192)));
        for text in ["320", "x", "0x10", "-5x100", "99999x99"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }
}
