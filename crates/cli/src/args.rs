//! The command line.

use crate::bench::BenchArgs;
use crate::film::Ghost;
use crate::motion::MotionArgs;
use clap::{Parser, Subcommand};
use marathon_learn::Algorithm;
use marathon_runs::distill::DistillOptions;
use marathon_runs::{FilmOptions, PolicySource, RunOptions, TaskOptions};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  marathon train hopper                         learn to hop; results go to runs/hopper-1
  marathon train MarathonMan --option clip=my.bvh   learn to move as in a recording
  marathon train hopper --set ppo.lr=3e-4       the same with another task_config; `marathon config show hopper` has all
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
    /// Command to run.
    #[command(subcommand)]
    pub command: Command,
}

/// Command to run.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Learn a policy and evaluate it.
    Train(TrainArgs),
    /// Learn from policies: one that does what several do.
    Distill(DistillArgs),
    /// Average policies that a run has kept: the mean can be better than each of them.
    Average(AverageArgs),
    /// Play whole episodes with a policy's best actions and report how it did.
    Eval(EvalArgs),
    /// Draw a policy in action: a strip of frames, an animation or a film.
    Render(RenderArgs),
    /// Write a policy as ONNX, for Unity ML-Agents, ONNX Runtime and others.
    Export(ExportArgs),
    /// Turn an ONNX network of another trainer into a policy, or a policy into one for other options.
    Import(ImportArgs),
    /// Record a policy's decisions for ML-Agents' imitation learning: a .demo file.
    RecordDemo(RecordDemoArgs),
    /// Open the game: watch, push and teach characters in a window.
    Play(PlayArgs),
    /// List the agents, or tell all about one.
    List {
        /// Agent to tell about: the parts of its observation, its rewards, commands and options.
        agent: Option<String>,
    },
    /// Show the settings that a task is trained with, or convert a file of ML-Agents.
    #[command(subcommand)]
    Config(ConfigCommand),
    /// Make motion capture a character's own: read, retarget, check and draw clips.
    Motion(MotionArgs),
    /// Measure the speed of the physics, the environments or the training.
    Bench(BenchArgs),
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
    #[command(flatten)]
    pub run: RunOptions,
}

/// Subcommands of `config`.
#[derive(Debug, Subcommand)]
pub enum ConfigCommand {
    /// Print all settings of a task as YAML: its preset, or what a file and `--set` make of it.
    Show(ShowArgs),
    /// Print a file of ML-Agents as one of Marathon's, with notes on what differs.
    Convert(ConvertArgs),
}

/// Options of `config show`.
#[derive(Debug, clap::Args)]
pub struct ShowArgs {
    /// Task, such as hopper; see `marathon list`.
    pub task: String,
    /// Configuration, Marathon's own or ML-Agents' [default: the task's preset].
    #[arg(long, value_name = "F.yaml", conflicts_with = "algo")]
    pub config: Option<PathBuf>,
    /// Algorithm, with the settings that it starts from in place of the task's preset.
    #[arg(long, value_name = "NAME", value_parser = Algorithm::NAMES)]
    pub algo: Option<String>,
    /// TaskConfig that differs, such as `ppo.lr=3e-4`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// Options of `config convert`.
#[derive(Debug, clap::Args)]
pub struct ConvertArgs {
    /// Configuration of ML-Agents: today's (`behaviors:`) or one of ML-Agents 0.x.
    #[arg(value_name = "IN.yaml")]
    pub file: PathBuf,
    /// File to write, .yaml [default: print it].
    #[arg(long, value_name = "OUT.yaml")]
    pub out: Option<PathBuf>,
}

const DISTILL_HELP: &str = "\
Each teacher has agents of its own. The student plays, the teachers say what they would do where it gets to, and it
learns that. If the agent takes a clip, a teacher's agents follow the clip that the teacher follows. A teacher may observe
less than the student: the parts of its observation are looked up by their names.

Ctrl-C finishes the round and writes the policy as it is. The same command goes on from FILE.unfinished, which is also
written every minute, with the bits of a distillation that was never interrupted.

  marathon distill MarathonMan --option future=3 --out all.safetensors \\
      --teacher runs/marathon_man_walk-1 --teacher runs/marathon_man_jump-1";

/// Options of `distill`.
#[derive(Debug, clap::Args)]
#[command(after_help = DISTILL_HELP)]
pub struct DistillArgs {
    /// Agent that the policy is for; see `marathon list`.
    pub agent: String,
    #[command(flatten)]
    pub task: TaskOptions,
    /// Policy to learn from, a file or the folder of a run; may be repeated. One that is named twice has twice the agents.
    #[arg(long = "teacher", value_name = "POLICY", required = true)]
    pub teachers: Vec<PathBuf>,
    /// File to write, .safetensors or .onnx.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    #[command(flatten)]
    pub options: DistillOptions,
}

const AVERAGE_HELP: &str = "\
Steps of learning are noisy to the end, and the mean of what they lead to is less so. Policies must be near each other, as
those that one run has kept in policies/. Policies of runs with different beginnings have no useful mean.

  marathon average runs/marathon_man_steer-1 --out mean.safetensors";

/// Options of `average`.
#[derive(Debug, clap::Args)]
#[command(after_help = AVERAGE_HELP)]
pub struct AverageArgs {
    /// Policy files; the folder of a run stands for all policies that the run has kept.
    #[arg(value_name = "POLICY", required = true)]
    pub policies: Vec<PathBuf>,
    #[command(flatten)]
    pub task: TaskOptions,
    /// File to write, .safetensors or .onnx.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

/// Options of `eval`.
#[derive(Debug, clap::Args)]
pub struct EvalArgs {
    #[command(flatten)]
    pub source: PolicySource,
    /// Episodes to play.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub episodes: u64,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = marathon_learn::EvalOptions::default().seed)]
    pub seed: u64,
    /// Threads; 0 means one per processor. The result does not depend on it.
    #[arg(long, value_name = "T", default_value_t = 0)]
    pub threads: usize,
}

/// Options of `render`.
#[derive(Debug, clap::Args)]
pub struct RenderArgs {
    #[command(flatten)]
    pub source: PolicySource,
    /// Picture to write: .png is a strip of frames, .gif an animation, .mp4 a film (needs ffmpeg).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    #[command(flatten)]
    pub film: FilmOptions,
    /// Frames of a .png strip [default: 8].
    #[arg(long, value_name = "N")]
    pub frames: Option<usize>,
    /// Width of a frame, pixels [default: 240 for .png, 480 for .gif, 960 for .mp4].
    #[arg(long, value_name = "PIXELS")]
    pub width: Option<usize>,
    /// Height of a frame, pixels [default: 4/3 of the width for .png, 9/16 otherwise].
    #[arg(long, value_name = "PIXELS")]
    pub height: Option<usize>,
    /// Agents side by side.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub agents: usize,
    /// The clip that the agents follow, drawn as their ghost: inside them, or beside.
    #[arg(long, value_name = "WHERE", num_args = 0..=1, default_missing_value = "inside")]
    pub ghost: Option<Ghost>,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = marathon_learn::EvalOptions::default().seed)]
    pub seed: u64,
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
`eval` and `render` take such files as they are.

A policy of Marathon is written again for the options that are given, and with a checksum if it has none:

  marathon import runs/marathon_man_steer-1 --option start=first --out steer.safetensors
  marathon import old.safetensors --out new.safetensors";

/// Options of `import`.
#[derive(Debug, clap::Args)]
#[command(after_help = IMPORT_HELP)]
pub struct ImportArgs {
    /// Network to read, or a policy file, or the folder of a run.
    #[arg(value_name = "NETWORK")]
    pub network: PathBuf,
    /// Agent that it is for [default: the one that the file names, if Marathon has written it].
    #[arg(long, value_name = "AGENT")]
    pub agent: Option<String>,
    #[command(flatten)]
    pub task: TaskOptions,
    /// File to write [default: beside a network, .safetensors].
    #[arg(long, value_name = "F.safetensors")]
    pub out: Option<PathBuf>,
}

/// Options of `record-demo`.
#[derive(Debug, clap::Args)]
pub struct RecordDemoArgs {
    #[command(flatten)]
    pub source: PolicySource,
    /// File to write; its name ends in .demo.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Episodes to record.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub episodes: u64,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = marathon_learn::EvalOptions::default().seed)]
    pub seed: u64,
}

/// Options of `play`.
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
pub struct PlayArgs {
    /// Arguments for the game, such as `humanoid --agents 16`; `marathon play --help` prints the game's help.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "WORDS")]
    pub words: Vec<std::ffi::OsString>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }
}
