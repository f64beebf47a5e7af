//! The command line.

use crate::bench::BenchArgs;
use crate::motion::MotionArgs;
use crate::number::count;
use crate::video::Ghost;
use clap::{Arg, CommandFactory, Parser, Subcommand};
use marathon_learn::Algorithm;
use marathon_runs::distill::DistillOptions;
use marathon_runs::{PolicySource, RunOptions, TaskOptions, VideoOptions};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  marathon train hopper                            train, evaluate and record a hopper; results go to runs/hopper-1
  marathon train hopper --set ppo.lr=3e-4          change a setting; `marathon config show hopper` lists all settings
  marathon train hopper --algo sac                 use another algorithm: ppo, a2c, acktr or sac
  marathon train MarathonMan --option clip=my.bvh  imitate a recording
  marathon train --resume runs/hopper-1 --steps 20M    continue a run
  marathon train WalkerController                  run all stages of a recipe; the same command resumes it
  marathon render runs/hopper-1 --out hop.gif      record a video
  marathon eval runs/hopper-1 --episodes 1000      measure a policy
  marathon export runs/hopper-1                    write an ONNX file
  marathon play runs/hopper-1                      watch it in a window, push it
  marathon serve runs/hopper-1                     watch it in a browser while it learns
  marathon list                                    list all tasks
  marathon doctor                                  check this computer

All random numbers come from the seed: the same command gives the same policy, bit for bit, on any number of threads.";

/// Train, evaluate and show active-ragdoll characters.
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

/// The command line as clap knows it. An option takes a negative number as its value and refuses it by name.
pub fn command() -> clap::Command {
    with_negative_numbers(Args::command())
}

fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let is_value = |arg: &Arg| arg.get_long().is_some() && arg.get_action().takes_values();
    let allowing = |arg: Arg| if is_value(&arg) { arg.allow_negative_numbers(true) } else { arg };
    command.mut_args(allowing).mut_subcommands(with_negative_numbers)
}

/// Command to run.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Train a policy and evaluate it.
    Train(TrainArgs),
    /// Distill several policies into one.
    Distill(DistillArgs),
    /// Average the policies that a run has kept; the average is often better than each of them.
    Average(AverageArgs),
    /// Play whole episodes with a policy's mean actions, and report returns, lengths and falls.
    Eval(EvalArgs),
    /// Record a policy in action: a strip of frames, an animation or a video.
    Render(RenderArgs),
    /// Write a policy as an ONNX file, in the layout of ML-Agents.
    Export(ExportArgs),
    /// Convert an ONNX network of another trainer to a policy, or rewrite a policy for other options.
    Import(ImportArgs),
    /// Record demonstrations for ML-Agents' imitation learning (.demo).
    RecordDemo(RecordDemoArgs),
    /// Open the game: watch, steer, push and train characters in a window.
    Play(PlayArgs),
    /// Show a policy, or a run while it learns, in a browser on this computer.
    Serve(ServeArgs),
    /// List all tasks, or describe one.
    List {
        /// Task to describe: its observation, rewards, commands and options.
        agent: Option<String>,
        #[command(flatten)]
        task: TaskOptions,
    },
    /// Show the training settings of a task, or convert a configuration of ML-Agents.
    #[command(subcommand)]
    Config(ConfigCommand),
    /// Import, retarget, check and render motion clips.
    Motion(MotionArgs),
    /// Generate a skin for a character: a smooth glTF mesh that follows its bodies.
    Skin(SkinArgs),
    /// Measure the speed of physics, environments and training.
    Bench(BenchArgs),
    /// Inspect this computer: processor, instruction set, speed, Python, ffmpeg, game, and what is missing.
    Doctor,
    /// Print a completion script, such as `marathon completions bash > ~/.local/share/bash-completion/completions/marathon`.
    Completions {
        /// Shell.
        shell: clap_complete::Shell,
    },
    /// Collect rollouts for `train --processes`, which starts this command.
    #[command(hide = true)]
    RolloutWorker,
}

const TRAIN_HELP: &str = "\
The run's folder holds:
  policy.safetensors      the policy, complete with normalization and options
  summary.json            steps, seconds and the evaluation
  progress.csv            one row for each iteration
  events.out.tfevents.*   the same for TensorBoard
  curve.png               return and speed over steps
  TASK.gif                a video of the result, such as hopper.gif
  run.json                task and configuration
  checkpoint/             state for --resume
  policies/               policies saved during training

Ctrl-C finishes the iteration, writes everything and prints the command that resumes; the exit code is then 130. \
A resumed run gives the same policy, bit for bit, as an uninterrupted one.

Some tasks have a recipe: several stages, such as other tasks, distillation and averages. `marathon train TASK` runs it, unless \
an option of a single run is given (--config, --algo, --set, --steps, --agents, --option, --processes or --initialize-from). \
`marathon train FILE.yaml` runs a file with stages. A recipe's folder is runs/TASK or runs/FILE unless --out names another; it \
has a folder for each stage. The same command resumes it.";

/// Options of `train`.
#[derive(Debug, clap::Args)]
#[command(after_help = TRAIN_HELP)]
pub struct TrainArgs {
    /// Task to train, such as hopper, walker, ant, humanoid or Hopper-v5; see `marathon list`. Or a file with stages, .yaml.
    #[arg(required_unless_present = "resume")]
    pub agent: Option<String>,
    #[command(flatten)]
    pub run: RunOptions,
    /// Record a video of the result, TASK.gif in the run's folder [default: in a terminal].
    #[arg(long, conflicts_with = "no_video")]
    pub video: bool,
    /// Record no video.
    #[arg(long)]
    pub no_video: bool,
    /// Print the stages of the recipe with their states and commands; train nothing.
    #[arg(long)]
    pub list_stages: bool,
    /// Stage of the recipe to make again if it has changed, with all stages that use it; discards their results. May be
    /// repeated.
    #[arg(long, value_name = "STAGE")]
    pub redo: Vec<String>,
}

/// Subcommands of `config`.
#[derive(Debug, Subcommand)]
pub enum ConfigCommand {
    /// Print all settings of a task as YAML: its preset, changed by a file and by `--set`.
    Show(ShowArgs),
    /// Convert a configuration of ML-Agents to Marathon's format, with notes on differences.
    Convert(ConvertArgs),
}

/// Options of `config show`.
#[derive(Debug, clap::Args)]
pub struct ShowArgs {
    /// Task, such as hopper; see `marathon list`.
    pub task: String,
    /// Configuration file of Marathon or ML-Agents [default: the task's preset].
    #[arg(long, value_name = "F.yaml", conflicts_with = "algo")]
    pub config: Option<PathBuf>,
    /// Algorithm, with its default settings instead of the task's preset.
    #[arg(long, value_name = "NAME", value_parser = Algorithm::NAMES)]
    pub algo: Option<String>,
    /// Setting to change, such as `ppo.lr=3e-4`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// Options of `config convert`.
#[derive(Debug, clap::Args)]
pub struct ConvertArgs {
    /// Configuration of ML-Agents: the present format (`behaviors:`) or that of ML-Agents 0.x.
    #[arg(value_name = "IN.yaml")]
    pub file: PathBuf,
    /// File to write, .yaml [default: print it].
    #[arg(long, value_name = "OUT.yaml")]
    pub out: Option<PathBuf>,
}

const DISTILL_HELP: &str = "\
Each teacher has its own agents. The student acts in them, and learns the actions that the teacher would have taken. If \
the task has clips, the agents of a teacher follow the clip of that teacher. A teacher may observe less than the \
student: parts of the observation are matched by name.

Ctrl-C finishes the round and writes the present policy. The same command continues from FILE.unfinished, which is also \
written every minute. The result is bit-identical to an uninterrupted distillation.

  marathon distill MarathonMan --option future=3 --out all.safetensors \\
      --teacher runs/marathon_man_walk-1 --teacher runs/marathon_man_jump-1";

/// Options of `distill`.
#[derive(Debug, clap::Args)]
#[command(after_help = DISTILL_HELP)]
pub struct DistillArgs {
    /// Task of the new policy; see `marathon list`.
    pub agent: String,
    #[command(flatten)]
    pub task: TaskOptions,
    /// Policy to learn from: a file or the folder of a run. May be repeated; a policy named twice gets twice the agents.
    #[arg(long = "teacher", value_name = "POLICY", required = true)]
    pub teachers: Vec<PathBuf>,
    /// File to write, .safetensors or .onnx.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    #[command(flatten)]
    pub options: DistillOptions,
}

const AVERAGE_HELP: &str = "\
Averaging the last policies of a run reduces the noise of training. The policies must be close to each other, such as \
those in policies/ of one run. The average of independent runs is useless.

  marathon average runs/marathon_man_steer-1 --out mean.safetensors";

/// Options of `average`.
#[derive(Debug, clap::Args)]
#[command(after_help = AVERAGE_HELP)]
pub struct AverageArgs {
    /// Policy files. The folder of a run means all policies that the run has kept.
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
    /// Number of episodes.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = count::<u64>(1..=10_000_000))]
    pub episodes: u64,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = marathon_learn::EvalOptions::default().seed)]
    pub seed: u64,
    /// Number of threads; 0 means one per core. The result does not depend on it.
    #[arg(long, value_name = "T", default_value_t = 0)]
    pub threads: usize,
}

/// Options of `render`.
#[derive(Debug, clap::Args)]
pub struct RenderArgs {
    #[command(flatten)]
    pub source: PolicySource,
    /// File to write: .png for a strip of frames, .gif for an animation, .mp4 for a video (needs ffmpeg).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    #[command(flatten)]
    pub video: VideoOptions,
    /// Number of frames of a .png strip [default: 8].
    #[arg(long, value_name = "N")]
    pub frames: Option<usize>,
    /// Width of a frame, pixels [default: 240 for .png, 480 for .gif, 960 for .mp4].
    #[arg(long, value_name = "PIXELS")]
    pub width: Option<usize>,
    /// Height of a frame, pixels [default: 4/3 of the width for .png, 9/16 otherwise].
    #[arg(long, value_name = "PIXELS")]
    pub height: Option<usize>,
    /// Number of agents, side by side.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub agents: usize,
    /// Draw the reference clip as a ghost: inside the agent, or beside it.
    #[arg(long, value_name = "WHERE", num_args = 0..=1, default_missing_value = "inside")]
    pub ghost: Option<Ghost>,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = marathon_learn::EvalOptions::default().seed)]
    pub seed: u64,
}

const SERVE_HELP: &str = "\
Open the printed address in a browser. Only this computer can, and only with the token in the address. Agents act by the \
newest policy; that of a run in training changes at each checkpoint (run.checkpoint_interval). Tabs that are slow miss \
frames; the run in training does not notice them. Ctrl-C ends the command.";

/// Options of `serve`.
#[derive(Debug, clap::Args)]
#[command(after_help = SERVE_HELP)]
pub struct ServeArgs {
    #[command(flatten)]
    pub source: PolicySource,
    /// Number of agents, side by side.
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub agents: usize,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = marathon_learn::EvalOptions::default().seed)]
    pub seed: u64,
    /// Port on this computer; 0 takes a free one.
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    pub port: u16,
    /// Folder of the page [default: $MARATHON_PAGE, or where the program was installed, or web/dist].
    #[arg(long, value_name = "DIR")]
    pub page: Option<PathBuf>,
}

const EXPORT_HELP: &str = "\
The file has the inputs and outputs of ML-Agents' models: input obs_0 [batch, obs], the raw observation; outputs \
deterministic_continuous_actions and continuous_actions [batch, act]; version_number, memory_size and \
continuous_action_output_shape. It includes normalization and action bounds.";

/// Options of `export`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXPORT_HELP)]
pub struct ExportArgs {
    /// Policy file or folder of a run.
    pub policy: PathBuf,
    /// File to write [default: the policy's name with .onnx].
    #[arg(long, value_name = "F.onnx")]
    pub out: Option<PathBuf>,
}

const IMPORT_HELP: &str = "\
Reads multi-layer perceptrons from one observation to actions, as ML-Agents, PyTorch and Stable-Baselines3 export \
them: normalization, layers with swish, tanh, elu or relu, a final tanh, bounds. `eval` and `render` also take such files.

A policy of Marathon is rewritten for the given options, and gets a checksum if it has none:

  marathon import runs/marathon_man_steer-1 --option start=first --out steer.safetensors
  marathon import old.safetensors --out new.safetensors";

/// Options of `import`.
#[derive(Debug, clap::Args)]
#[command(after_help = IMPORT_HELP)]
pub struct ImportArgs {
    /// ONNX network, policy file or folder of a run.
    #[arg(value_name = "NETWORK")]
    pub network: PathBuf,
    /// Task of the policy [default: the task that the file names].
    #[arg(long, value_name = "AGENT")]
    pub agent: Option<String>,
    #[command(flatten)]
    pub task: TaskOptions,
    /// File to write [default: the network's name with .safetensors].
    #[arg(long, value_name = "F.safetensors")]
    pub out: Option<PathBuf>,
}

/// Options of `record-demo`.
#[derive(Debug, clap::Args)]
pub struct RecordDemoArgs {
    #[command(flatten)]
    pub source: PolicySource,
    /// File to write (.demo).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Number of episodes to record.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = count::<u64>(1..=100_000))]
    pub episodes: u64,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = marathon_learn::EvalOptions::default().seed)]
    pub seed: u64,
}

const SKIN_HELP: &str = "\
The skin is one smooth surface around the geoms of the model's character, with a joint for each body. Its colors are the \
model's, or one for each group of bodies. `marathon play` and the Bevy plugin wear it without a mapping.

  marathon skin ant --out ant.glb
  marathon play ant --skin ant.glb";

/// Options of `skin`.
#[derive(Debug, clap::Args)]
#[command(after_help = SKIN_HELP)]
pub struct SkinArgs {
    /// Character: an agent, such as MarathonMan, or an MJCF file (.xml).
    #[arg(value_name = "MODEL")]
    pub model: String,
    /// File to write (.glb).
    #[arg(long, value_name = "F.glb")]
    pub out: PathBuf,
    /// Largest number of triangles, 500 to 20000.
    #[arg(long, value_name = "N", default_value_t = marathon_skin::Options::default().triangles, value_parser = count::<usize>(0..=u64::MAX))]
    pub triangles: usize,
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

    #[test]
    fn the_command_line_is_consistent() {
        command().debug_assert();
    }
}
