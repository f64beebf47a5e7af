//! The command line of `marathon-game`.

use crate::app::input::response::{Mapping, Mappings};
use crate::app::input::scripted::{ScriptedAction, ScriptedInput};
use crate::app::input::steering::SteeringFrame;
use crate::app::mode::Mode;
use crate::app::pacing::FixedSettings;
use crate::app::stage::course::{BUILT_AGAINST, LED, PlayerRole};
use crate::app::stage::selection::HERO;
use bevy_marathon::Ground;
use bevy_marathon::look::{CameraMode, Quality};
use clap::Parser;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use marathon_learn::EvalOptions;
use marathon_runs::{LearnOptions, TaskOptions, VideoOptions};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  marathon-game                                  the main menu
  marathon-game hopper                           a trained hopper; everything else is in the menu (Esc)
  marathon-game humanoid --agents 16             a row of them
  marathon-game runs/hopper-1                    the policy of a run, which is read again whenever training saves it
  marathon-game hopper --mode learn              from random weights to a run, before your eyes
  marathon-game my-robot.xml --mode learn        the same for the robot of a file
  marathon-game --mode imitate                   a person walks, beside the clip that it follows; N: runs, flips
  marathon-game MarathonMan --mode imitate --option clip=my.bvh   a clip of your own; L learns it
  marathon-game walker --mode push               click to push, B to throw balls, sliders for gravity and friction
  marathon-game --mode course                    an assault course, and the table of the longest runs (T)
  marathon-game --mode course --role run         you steer the runner, by arrow keys or gamepad
  marathon-game --mode course --role build       you build the ground ahead of it, with the mouse
  marathon-game --mode testbed my-robot.xml      a slider per motor
  marathon-game ant --ground stairs              or hills, or boards
  marathon-game MarathonManRun --skin hero.glb   in the skin of a glTF character; --skin none shows the shapes
  marathon-game hopper --record hop.mp4          a video, without a window (needs ffmpeg)
  marathon-game hopper --mode push --action 1.5:throw --record ball.mp4   the same with a ball thrown at it
  marathon-game --replay run.replay              what R recorded, with a time line
  marathon-game hopper --agents 16 --mlagents-port 5004   mlagents-learn trains while you watch

Keys are shown on the screen (F1) and can be changed in the menu.";

/// Watch, push, teach and record physical characters.
#[derive(Clone, Debug, Parser)]
#[command(name = "marathon-game", version, about, after_help = EXAMPLES)]
pub struct Args {
    /// Agent (such as hopper, walker, humanoid, MarathonManRun), policy file, folder of a run, or MJCF file (.xml) [with
    /// --mode imitate: MarathonManWalk; with --mode course: TerrainWalker2d, or with --role run AntController; with --record or
    /// other options of a scene: hopper; otherwise the main menu].
    pub what: Option<String>,
    /// Mode of the game.
    #[arg(long, value_enum, default_value_t = Mode::Watch)]
    pub mode: Mode,
    /// Policy file, or folder of a run [default: the one that comes with the agent].
    #[arg(long, value_name = "FILE")]
    pub policy: Option<PathBuf>,
    /// Agents side by side.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    pub agents: u16,
    /// Ground.
    #[arg(long, default_value = GROUNDS[0].0, value_parser = one_of(GROUNDS))]
    pub ground: Ground,
    /// Options of the task [default: those that the policy was trained with].
    #[command(flatten)]
    pub task: TaskOptions,
    /// Recording to replay; the key R makes one.
    #[arg(long, value_name = "FILE")]
    pub replay: Option<PathBuf>,
    /// Skin of the characters: marathon_man, generated (from the shapes of the model), none (bare shapes), or a .glb file with a
    /// skeleton [default: marathon_man for Marathon Man, generated for others, none in the test bed].
    #[arg(long, value_name = "FILE")]
    pub skin: Option<PathBuf>,
    /// Mapping from bones to bodies, for a skeleton with unknown names [default: the mapping that comes with Marathon for the
    /// model].
    #[arg(long, value_name = "F.json", requires = "skin")]
    pub mapping: Option<PathBuf>,
    /// Options of the trainer in --mode learn. The seed is that of everything random.
    #[command(flatten)]
    pub learn: LearnOptions,

    /// Kind of the course of --mode course: flat, slopes, steps, stairs, gaps, rubble, boxes, mixed, meters, bumps, blocks or adversary
    /// [default: mixed].
    #[arg(long, value_name = "KIND")]
    pub course: Option<String>,
    /// Difficulty of the course, from 0 to 1 [default: 0.5].
    #[arg(long, value_name = "D")]
    pub difficulty: Option<f64>,
    /// Your role on the course [default: watch].
    #[arg(long, value_enum)]
    pub role: Option<PlayerRole>,
    /// Your name in the table of the longest runs [default: your user name].
    #[arg(long, value_name = "NAME")]
    pub player: Option<String>,
    /// Table of the longest runs, an SQLite file [default: marathon/runs.sqlite in the folder for your data].
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,
    /// Print the table of the longest runs.
    #[arg(long)]
    pub runs: bool,

    /// Port of mlagents-learn, which trains the agents while you watch; its default is 5004.
    #[arg(long, value_name = "N", conflicts_with_all = ["mode", "policy", "replay", "record", "watch_stream"])]
    pub mlagents_port: Option<u16>,
    /// Show the states that arrive on the standard input; the Python package uses it for render_mode="human".
    #[arg(long, conflicts_with_all = ["mode", "policy", "replay", "record"])]
    pub watch_stream: bool,

    /// Deflection below which sticks and triggers count as released, from 0 to below 1.
    #[arg(long, value_name = "SHARE", default_value_t = Mappings::default().pad.dead_zone, value_parser = dead_zone)]
    pub dead_zone: f32,
    /// Response exponent of sticks and triggers; above 1 gives finer control near the center.
    #[arg(long, value_name = "POWER", default_value_t = Mappings::default().pad.curve, value_parser = curve)]
    pub curve: f32,
    /// Smoothing time constant of sticks and triggers, s (63 % of a change).
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = smoothing)]
    pub smoothing: f32,
    /// Smoothing time constant of the keys that steer, s.
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = smoothing)]
    pub key_smoothing: f32,

    /// Run the action of a key at a time, s, such as 2.5:throw or 4:next-agent; repeatable.
    #[arg(long, value_name = "S:ACTION")]
    pub action: Vec<ScriptedAction>,
    /// Frame of the left stick and of the keys that steer, for a character that turns.
    #[arg(long, value_enum, default_value_t)]
    pub steering: SteeringFrame,
    /// Hold a key, or a stick, trigger or button of a gamepad, from one time to another, s, such as 1-2.5:key:up,
    /// 1-3:pad:left-y=0.5 or 2-2.2:pad2:a; repeatable.
    #[arg(long, value_name = "S-S:DEVICE:CONTROL")]
    pub input: Vec<ScriptedInput>,

    /// Quality of the picture [default: medium, or low if a processor draws the window].
    #[arg(long, value_parser = one_of(QUALITIES))]
    pub quality: Option<Quality>,
    /// Size of the window or the video, pixels [default: 1280x720].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,
    /// Place of the camera [default: behind a character that turns, beside others].
    #[arg(long, value_parser = one_of(CAMERAS))]
    pub camera: Option<CameraMode>,
    /// Move the camera only as the character and the player move it. It does not turn by itself, and keeps its distance and
    /// its field of view at every speed.
    #[arg(long)]
    pub reduced_motion: bool,
    /// Limit on the frames per second of the window; 0 for the rate of the screen.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub max_fps: u32,
    /// Draw contacts and their forces.
    #[arg(long)]
    pub contacts: bool,
    /// Draw joints and their limits.
    #[arg(long)]
    pub joints: bool,

    /// Video to write instead of opening a window: .mp4 (needs ffmpeg), .gif, .png (one picture, of the last frame), or a folder
    /// for a sequence of .png.
    #[arg(long, value_name = "OUT")]
    pub record: Option<PathBuf>,
    /// Times of the video.
    #[command(flatten)]
    pub video: VideoOptions,
    /// Video without text and bars.
    #[arg(long)]
    pub no_hud: bool,
    /// Video with the prompts of the controls.
    #[arg(long)]
    pub prompts: bool,
}

/// Default size of a window or video, pixels.
const SIZE: (u32, u32) = (1280, 720);
/// Default length of a video, s, and its frames per second.
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
    /// The response to gamepads and keys.
    pub fn mappings(&self) -> Mappings {
        let Args { dead_zone, curve, smoothing, key_smoothing, .. } = *self;
        let keys = Mapping { smoothing: key_smoothing, ..Mappings::default().keys };
        Mappings { pad: Mapping { dead_zone, curve, smoothing }, keys }
    }

    /// The agent, file or folder, or the default of the mode.
    pub fn what(&self) -> &str {
        let default = match (self.mode, self.role) {
            (Mode::Imitate, _) => "MarathonManWalk",
            (_, Some(PlayerRole::Run)) => LED,
            (Mode::Course, _) => BUILT_AGAINST,
            _ if self.opens_menu() => HERO,
            _ => "hopper",
        };
        self.what.as_deref().unwrap_or(default)
    }

    /// Whether the command line leaves the scene to the main menu. Options of the window and of the controls do not set a scene.
    pub fn opens_menu(&self) -> bool {
        let Args { what, mode, policy, agents, ground, replay, record, role, course, .. } = self;
        let named = what.is_some() || policy.is_some() || replay.is_some() || record.is_some();
        let set = *mode != Mode::Watch || *agents > 1 || *ground != Ground::Level || !self.task.given.is_empty();
        let remote = self.mlagents_port.is_some() || self.watch_stream;
        !(named || set || remote || role.is_some() || course.is_some() || self.difficulty.is_some())
    }

    /// Size of the window or video, pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size.unwrap_or(SIZE)
    }

    /// Seed of everything random.
    pub fn seed(&self) -> u64 {
        self.learn.seed.unwrap_or(EvalOptions::default().seed)
    }

    /// Length of the video, seconds.
    pub fn seconds(&self) -> f64 {
        self.video.seconds.unwrap_or(SECONDS)
    }

    /// Frames per second of the video.
    pub fn fps(&self) -> f64 {
        self.video.fps.unwrap_or(FPS)
    }

    /// The settings that other programs must not change.
    pub fn fixed_settings(&self) -> FixedSettings {
        FixedSettings { quality: self.quality.is_some(), size: self.size.is_some(), rate: self.max_fps > 0 }
    }

    /// Quality of the picture.
    pub fn quality(&self) -> Quality {
        self.quality.unwrap_or_default()
    }
}

/// A value of an option: its name on the command line, and its help.
type Choice<T> = (&'static str, T, &'static str);

const GROUNDS: [Choice<Ground>; 4] = [
    (Ground::Level.name(), Ground::Level, "Level, as in training"),
    (Ground::Hills.name(), Ground::Hills, "Waves that grow to 60 cm"),
    (Ground::Stairs.name(), Ground::Stairs, "Flights of five steps, up and down"),
    (Ground::Boards.name(), Ground::Boards, "Low boards across the track"),
];

const QUALITIES: [Choice<Quality>; 3] = [
    ("low", Quality::Low, "Soft discs in place of shadows, no smoothed edges"),
    ("medium", Quality::Medium, "Shadows, edges smoothed"),
    ("high", Quality::High, "Larger shadow maps"),
];

const CAMERAS: [Choice<CameraMode>; 4] = [
    (CameraMode::Side.name(), CameraMode::Side, "Beside the runner"),
    (CameraMode::Chase.name(), CameraMode::Chase, "Behind it"),
    (CameraMode::Orbit.name(), CameraMode::Orbit, "Around it"),
    (CameraMode::Free.name(), CameraMode::Free, "Anywhere: W A S D, E and Q fly it"),
];

/// Reads one of the choices by its name.
fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    choices: [Choice<T>; N],
) -> impl TypedValueParser<Value = T> {
    let values = choices.map(|(name, _, help)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(values).map(move |text| {
        let chosen = choices.iter().find(|(name, ..)| *name == text);
        // the parser lets only these names through
        chosen.unwrap_or(&choices[0]).1
    })
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
    fn choices_are_read_by_their_names() {
        let read = |words: &[&str]| Args::try_parse_from([&["marathon-game"], words].concat());
        let args = read(&["--ground", "stairs", "--quality", "high", "--camera", "orbit"]).expect("they exist");
        assert_eq!(
            (args.ground, args.quality, args.camera),
            (Ground::Stairs, Some(Quality::High), Some(CameraMode::Orbit))
        );
        let args = read(&[]).expect("there are defaults");
        assert_eq!((args.ground, args.quality, args.camera), (Ground::Level, None, None));
        let error = read(&["--ground", "hils"]).expect_err("there is no such ground").to_string();
        assert!(
            error.contains("level, hills, stairs, boards") && error.contains("similar value exists: 'hills'"),
            "{error}"
        );
    }

    #[test]
    fn sizes_are_read() {
        assert_eq!(parse_size("320x192"), Ok((320, 192)));
        for text in ["320", "x", "0x10", "-5x100", "99999x99"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }
}
