//! The command line.

use crate::commands::bench::BenchArgs;
use crate::commands::study::StudyArgs;
use clap::{Parser, Subcommand};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  marathon train hopper                         learn to hop; results go to runs/hopper-1
  marathon train hopper --algo acktr            the same by another algorithm: ppo, a2c, acktr
  marathon render runs/hopper-1 --out hop.gif   see it
  marathon eval runs/hopper-1 --episodes 1000   measure it
  marathon train --resume runs/hopper-1 --steps 20000000   let it learn on
  marathon export runs/hopper-1                 for Unity, ONNX Runtime and others
  marathon play runs/hopper-1                   watch it in a window, push it
  marathon list                                 all agents
  marathon bench physics                        how fast this computer is

Everything random comes from the seed: the same command gives the same policy, bit for bit, on any number of threads.";

/// Active-ragdoll locomotion: train, evaluate and show agents that learn to run.
#[derive(Debug, Parser)]
#[command(name = "marathon", version, about, after_help = EXAMPLES, arg_required_else_help = true)]
pub struct Args {
    /// Print one JSON object on stdout and nothing else there.
    #[arg(long, global = true)]
    pub json: bool,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Learn a policy and evaluate it.
    Train(TrainArgs),
    /// Play whole episodes with a policy's best actions and report how it did.
    Eval(EvalArgs),
    /// Draw a policy in action: a strip of frames, an animation or a film.
    Render(RenderArgs),
    /// Write a policy as ONNX, for Unity ML-Agents, ONNX Runtime and others.
    Export(ExportArgs),
    /// Turn an ONNX network of another trainer into a policy.
    Import(ImportArgs),
    /// Record a policy's decisions for ML-Agents' imitation learning: a .demo file.
    RecordDemo(RecordDemoArgs),
    /// Open the game: watch, push and teach characters in a window.
    Play(PlayArgs),
    /// List the agents.
    List,
    /// Measure the speed of the physics, the environments or the training.
    Bench(BenchArgs),
    /// Make the paper's experiments again: a table, a picture and a page each.
    Study(StudyArgs),
    /// Play rollouts for `train --processes`, which starts this.
    #[command(hide = true)]
    RolloutWorker,
}

const TRAIN_HELP: &str = "\
The run's folder holds:
  policy.safetensors      the policy, all that is needed to act
  summary.json            steps, seconds and the evaluation
  progress.csv            one row per iteration
  events.out.tfevents.*   the same for TensorBoard
  curve.png               return and speed against steps
  run.json                agent and configuration
  checkpoint/             what --resume goes on from
  policies/               policies on the way there

Ctrl-C finishes the iteration, writes everything and tells how to resume; the exit code is then 130.
A resumed run gives the same policy, bit for bit, as one that was never interrupted.";

/// Options of `train`.
#[derive(Debug, clap::Args)]
#[command(after_help = TRAIN_HELP)]
pub struct TrainArgs {
    /// Agent to train, such as hopper, walker, humanoid, ant or Hopper-v1; see `marathon list`.
    #[arg(required_unless_present = "resume")]
    pub agent: Option<String>,
    /// Configuration in the YAML schema of ML-Agents; without it, the agent's own fast one.
    #[arg(long, value_name = "F.yaml", conflicts_with = "resume")]
    pub config: Option<PathBuf>,
    /// Algorithm, with the settings that it starts from in place of the agent's own; in a configuration file it is
    /// `trainer_type`.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["resume", "config"], value_parser = marathon_learn::Algorithm::NAMES)]
    pub algo: Option<String>,
    /// Agents that act side by side: a multiple of 16, or 1, 2, 4 or 8, which cost as much as 16.
    #[arg(long, value_name = "N", conflicts_with = "resume")]
    pub agents: Option<usize>,
    /// Agent-steps of the whole run.
    #[arg(long, value_name = "N", value_parser = parse_steps)]
    pub steps: Option<u64>,
    /// Seed of everything random.
    #[arg(long, value_name = "S", conflicts_with = "resume")]
    pub seed: Option<u64>,
    /// Threads; 0 means one per processor. The result does not depend on it.
    #[arg(long, value_name = "T")]
    pub threads: Option<usize>,
    /// Processes that play, each with a share of the agents, while this one learns; 0: it plays itself, on its threads. The
    /// result does not depend on it. Not with sac.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub processes: usize,
    /// Folder for the results, new or empty [default: runs/AGENT-N].
    #[arg(long, value_name = "DIR", conflicts_with = "resume")]
    pub out: Option<PathBuf>,
    /// Go on with the run in this folder; --steps may extend it.
    #[arg(long, value_name = "DIR")]
    pub resume: Option<PathBuf>,
}

/// Options of `eval`.
#[derive(Debug, clap::Args)]
pub struct EvalArgs {
    /// Policy file, or folder of a run.
    pub policy: PathBuf,
    /// Episodes to play.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub episodes: u64,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = marathon_learn::EvalOptions::default().seed)]
    pub seed: u64,
    /// Threads; 0 means one per processor. The result does not depend on it.
    #[arg(long, value_name = "T", default_value_t = 0)]
    pub threads: usize,
    /// Agent that the policy must be for [default: the one it was trained for].
    #[arg(long, value_name = "AGENT")]
    pub agent: Option<String>,
}

/// Options of `render`.
#[derive(Debug, clap::Args)]
pub struct RenderArgs {
    /// Policy file, or folder of a run.
    pub policy: PathBuf,
    /// Picture to write: .png is a strip of frames, .gif an animation, .mp4 a film (needs ffmpeg).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Length of the scene [default: 2 for .png, 8 otherwise].
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub seconds: Option<f64>,
    /// Frames of a .png strip [default: 8].
    #[arg(long, value_name = "N")]
    pub frames: Option<usize>,
    /// Frames per second of a .gif or .mp4 [default: 25 and 50].
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub fps: Option<f64>,
    /// Width of a frame, pixels [default: 240 for .png, 480 for .gif, 960 for .mp4].
    #[arg(long, value_name = "PIXELS")]
    pub width: Option<usize>,
    /// Height of a frame, pixels [default: 4/3 of the width for .png, 9/16 otherwise].
    #[arg(long, value_name = "PIXELS")]
    pub height: Option<usize>,
    /// Agents side by side.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub agents: usize,
    /// Seconds that the agents run before the scene begins.
    #[arg(long, value_name = "S", default_value_t = 0.0, allow_negative_numbers = true)]
    pub start: f64,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = marathon_learn::EvalOptions::default().seed)]
    pub seed: u64,
    /// Agent that the policy must be for [default: the one it was trained for].
    #[arg(long, value_name = "AGENT")]
    pub agent: Option<String>,
}

const EXPORT_HELP: &str = "\
The file follows the contract of ML-Agents' models: input obs_0 [batch, obs], the raw observation; outputs
deterministic_continuous_actions and continuous_actions [batch, act]; version_number, memory_size and
continuous_action_output_shape. Normalization and bounds are inside.";

/// Options of `export`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXPORT_HELP)]
pub struct ExportArgs {
    /// Policy file, or folder of a run.
    pub policy: PathBuf,
    /// File to write [default: beside the policy, .onnx].
    #[arg(long, value_name = "F.onnx")]
    pub out: Option<PathBuf>,
}

const IMPORT_HELP: &str = "\
Reads multi-layer perceptrons with one observation as input and actions as output, as ML-Agents, PyTorch and
Stable-Baselines3 write them: normalization, layers with swish, tanh, elu or relu, a final tanh, bounds.
`eval` and `render` take such files as they are.";

/// Options of `import`.
#[derive(Debug, clap::Args)]
#[command(after_help = IMPORT_HELP)]
pub struct ImportArgs {
    /// Network to read.
    #[arg(value_name = "F.onnx")]
    pub network: PathBuf,
    /// Agent that it is for [default: the one that the file names, if Marathon has written it].
    #[arg(long, value_name = "AGENT")]
    pub agent: Option<String>,
    /// File to write [default: beside the network, .safetensors].
    #[arg(long, value_name = "F.safetensors")]
    pub out: Option<PathBuf>,
}

/// Options of `record-demo`.
#[derive(Debug, clap::Args)]
pub struct RecordDemoArgs {
    /// Policy file, or folder of a run.
    pub policy: PathBuf,
    /// File to write; its name ends in .demo.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Episodes to record.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub episodes: u64,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = marathon_learn::EvalOptions::default().seed)]
    pub seed: u64,
    /// Agent that the policy must be for [default: the one it was trained for].
    #[arg(long, value_name = "AGENT")]
    pub agent: Option<String>,
}

/// Options of `play`.
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
pub struct PlayArgs {
    /// What the game is told, such as `humanoid --agents 16`; `marathon play --help` is the game's own help.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "WORDS")]
    pub words: Vec<std::ffi::OsString>,
}

/// A number of steps, with `_` or `,` between digits, or in the short forms `500k`, `2.5M`, `1e6`.
fn parse_steps(text: &str) -> Result<u64, String> {
    let bad = || "expected a positive number of steps such as 4000000, 4_000_000, 4M, 500k or 4e6".to_string();
    let digits: String = text.chars().filter(|c| !matches!(c, '_' | ',')).collect();
    if let Ok(n) = digits.parse::<u64>() {
        return if n > 0 { Ok(n) } else { Err(bad()) };
    }
    let (number, factor) = match digits.chars().last() {
        Some('k' | 'K') => (&digits[..digits.len() - 1], 1e3),
        Some('m' | 'M') => (&digits[..digits.len() - 1], 1e6),
        Some('g' | 'G') => (&digits[..digits.len() - 1], 1e9),
        _ => (&digits[..], 1.0),
    };
    let steps = number.parse::<f64>().map_err(|_| bad())? * factor;
    if (1.0..=1e15).contains(&steps) { Ok(steps.round() as u64) } else { Err(bad()) }
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
    fn steps_have_short_forms() {
        for (text, steps) in [("4000000", 4_000_000), ("4_000_000", 4_000_000), ("2.5M", 2_500_000), ("1e6", 1_000_000)]
        {
            assert_eq!(parse_steps(text), Ok(steps));
        }
        for text in ["0", "-3", "many", "", "inf", "nan", "k"] {
            assert!(parse_steps(text).is_err(), "{text}");
        }
    }
}
