//! The command line.

use crate::error::StudyError;
use clap::{Parser, Subcommand};
use marathon_learn::AtomicFile;
use marathon_runs::text::path_word;
use std::path::{Path, PathBuf};

/// Number of fresh random courses, unless the user sets it.
pub const FRESH: usize = 1000;

/// The experiments of Marathon's paper and its own studies: a table, a picture and a page each.
#[derive(Debug, Parser)]
#[command(name = "marathon-studies", version, about, arg_required_else_help = true)]
pub struct Args {
    /// Print one JSON object on stdout and nothing else there.
    #[arg(long, global = true)]
    pub json: bool,
    /// Command.
    #[command(subcommand)]
    pub command: Command,
}

/// Command.
#[derive(Debug, Subcommand)]
pub enum Command {
    #[command(flatten)]
    Study(Study),
    /// Make the shipped policies, their images and the tables of the studies again, and report what changed. All of it
    /// takes days of processor time; results are kept, and the same command continues.
    Reproduce(ReproduceOptions),
    /// Play rollouts for `multi-env`, which starts this.
    #[command(hide = true)]
    RolloutWorker,
}

/// The studies.
#[derive(Debug, Subcommand)]
pub enum Study {
    /// Table 1 of the paper: training speed of the four agents with the paper's settings.
    Table1 {
        #[command(flatten)]
        options: Options,
        #[command(flatten)]
        peers: PeerOptions,
    },
    /// Table 2 of the paper: training on the processor and on a GPU, with Stable-Baselines3 and Marathon.
    Table2(Options),
    /// Table 3 of the paper: PPO, A2C and ACKTR on the hopper, time and score.
    Table3 {
        #[command(flatten)]
        options: Options,
        #[command(flatten)]
        peers: PeerOptions,
    },
    /// The paper's configuration in `mlagents-learn` and in Marathon: do both learn the same?
    MlagentsAgreement(Options),
    /// Speed and score with 16, 64, 512 and 4096 agents.
    Concurrency(Options),
    /// A decision at every physics step, or at every few steps: cost and learning.
    DecisionPeriod(Options),
    /// Speed with and without pictures.
    Headless(Options),
    /// One agent, many agents in one process, threads, several processes.
    MultiEnv(Options),
    /// Figure 3 of the paper: walk, run, backflip and others, learned from motion clips. Runs are kept in runs/style-transfer
    /// or --keep, each with a small file of its results; these files are enough to write the page again.
    StyleTransfer {
        #[command(flatten)]
        options: Options,
        /// Clips of Marathon Man, or other tasks such as HumanoidStyleRun, separated by commas [default: all].
        #[arg(long, value_name = "CLIPS", value_delimiter = ',')]
        clips: Vec<String>,
        /// Write the page from the kept runs without training.
        #[arg(long)]
        kept_only: bool,
    },
    /// Policies on fresh random courses, and on the tenth of these that is worst for each.
    FreshCourses {
        #[command(flatten)]
        options: Options,
        /// Policy files of tasks on courses.
        #[arg(value_name = "POLICY", required = true)]
        policies: Vec<PathBuf>,
        /// Number of courses.
        #[arg(long, value_name = "N", default_value_t = FRESH)]
        fresh: usize,
    },
    /// Policies on stairs, gaps and boxes of growing size, at each of several commanded speeds.
    Obstacles {
        #[command(flatten)]
        options: Options,
        /// Policy files of tasks on courses.
        #[arg(value_name = "POLICY", required = true)]
        policies: Vec<PathBuf>,
    },
    /// Characters that learned on ground of ten kinds, with and without seeing it, on courses that are new to all of them.
    /// Runs are kept in runs/assault-course or --keep, each with a small file of its results; these files are enough to
    /// write the page again.
    AssaultCourse {
        #[command(flatten)]
        options: Options,
        /// Some of TerrainHopper, TerrainWalker2d, TerrainAnt [default: all].
        #[arg(long, value_name = "TASKS", value_delimiter = ',')]
        tasks: Vec<String>,
        /// Ground to learn on: some of flat, random, distance, sfl, plr, accel, adversary, bounded, rising,
        /// regret [default: all].
        #[arg(long, value_name = "GROUNDS", value_delimiter = ',')]
        grounds: Vec<String>,
        /// Whether characters see the ground: heights, blind, or both separated by a comma [default: both].
        #[arg(long, value_name = "SIGHTS", value_delimiter = ',')]
        sights: Vec<String>,
        /// Write the page from the kept runs without training.
        #[arg(long)]
        kept_only: bool,
        /// Train no adversary against the finished runners.
        #[arg(long)]
        no_adversary: bool,
        /// Fresh random courses of the evaluation; 0 leaves it out.
        #[arg(long, value_name = "N", default_value_t = FRESH)]
        fresh: usize,
    },
}

impl Study {
    /// The options that all studies share.
    pub fn options(&self) -> &Options {
        match self {
            Study::Table1 { options, .. } | Study::Table3 { options, .. } => options,
            Study::StyleTransfer { options, .. } | Study::AssaultCourse { options, .. } => options,
            Study::FreshCourses { options, .. } | Study::Obstacles { options, .. } => options,
            Study::Table2(options) | Study::MlagentsAgreement(options) | Study::Concurrency(options) => options,
            Study::DecisionPeriod(options) | Study::Headless(options) | Study::MultiEnv(options) => options,
        }
    }
}

/// The options that all studies share.
#[derive(Clone, Debug, clap::Args)]
pub struct Options {
    /// Seeds of each row.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    /// Agent-steps of each run [default: 1,000,000; in style-transfer and assault-course the steps of the configuration]. In
    /// table1, the humanoid runs a twentieth of them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub steps: Option<u64>,
    /// Threads; 0 means one per processor.
    #[arg(long, value_name = "T", default_value_t = 1)]
    pub threads: usize,
    /// Folder for the three files.
    #[arg(long, value_name = "DIR", default_value = "docs/studies")]
    pub out: PathBuf,
    /// Folder that keeps runs: those of other trainers, and all runs of style-transfer and assault-course. Kept runs
    /// are reused, so that an interrupted study continues.
    #[arg(long, value_name = "DIR")]
    pub keep: Option<PathBuf>,
}

impl Options {
    /// Agent-steps of each run.
    pub fn steps(&self) -> u64 {
        self.steps.unwrap_or(1_000_000)
    }

    /// The subfolder of `keep` for the runs of one configuration.
    pub fn keep_for(&self, configuration: &str) -> Option<PathBuf> {
        self.keep.as_ref().map(|folder| folder.join(configuration))
    }

    /// Refuses an output folder that cannot be created or written to, before the study spends hours.
    ///
    /// # Errors
    /// If a part of the path is a file, or the folder is not writable.
    pub fn check_out(&self) -> Result<(), StudyError> {
        // the study creates its folder at the end, so a failed study leaves none
        let mut there = self.out.ancestors().filter(|folder| folder.exists());
        let there = there.next().unwrap_or(Path::new("."));
        if !there.is_dir() {
            let (out, found) = (path_word(&self.out), path_word(there));
            return Err(StudyError::Usage(format!("--out is {out}, but {found} is a file; expected a folder")));
        }
        AtomicFile::create(&there.join("study"))?;
        Ok(())
    }
}

/// Options of `reproduce`.
#[derive(Debug, clap::Args)]
pub struct ReproduceOptions {
    /// Policies and studies, by name [default: all].
    #[arg(value_name = "NAME")]
    pub names: Vec<String>,
    /// Print the commands, and run nothing.
    #[arg(long)]
    pub list: bool,
    /// Folder for runs, results and report.md.
    #[arg(long, value_name = "DIR", default_value = "runs/reproduce")]
    pub keep: PathBuf,
    /// Replace the files of the repository that changed.
    #[arg(long)]
    pub update: bool,
}

/// Options for the trainers of other projects.
#[derive(Debug, clap::Args)]
pub struct PeerOptions {
    /// Seeds of ML-Agents and Stable-Baselines3, which are slow; 0 skips them. MARATHON_PYTHON and MARATHON_MLAGENTS_PYTHON
    /// name the Pythons that have these packages.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=1000))]
    pub peer_seeds: u64,
}

impl PeerOptions {
    /// The options as words of the command.
    pub fn words(&self) -> String {
        if self.peer_seeds > 0 { format!(" --peer-seeds {}", self.peer_seeds) } else { String::new() }
    }
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
