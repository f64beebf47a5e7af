//! `marathon study`: the paper's experiments again. Each writes a table (`.csv` and `.md`) and a picture (`.png`), with the
//! command, the version and the processor, so that somebody else can make it again.

mod agreement;
mod assault_course;
mod concurrency;
mod decision_period;
mod headless;
mod kept;
mod multi_env;
mod peers;
mod record;
mod style_transfer;
mod table1;
mod table2;
mod table3;

use crate::console::{print_json, say};
use crate::error::CliError;
use clap::Subcommand;
use marathon_learn::AtomicFile;
use marathon_runs::text::path_word;
use std::path::{Path, PathBuf};

/// Options of `study`.
#[derive(Debug, clap::Args)]
#[command(arg_required_else_help = true)]
pub struct StudyArgs {
    /// What to measure.
    #[command(subcommand)]
    pub what: What,
}

/// What to measure.
#[derive(Debug, Subcommand)]
pub enum What {
    /// Table 1 of the paper: speed of training the four agents with its own settings.
    Table1 {
        #[command(flatten)]
        options: Options,
        #[command(flatten)]
        peers: Peers,
    },
    /// Table 2 of the paper: training on the processor and on a GPU, with Stable-Baselines3 and here.
    Table2(Options),
    /// Table 3 of the paper: PPO, A2C and ACKTR on the hopper, time and score.
    Table3 {
        #[command(flatten)]
        options: Options,
        #[command(flatten)]
        peers: Peers,
    },
    /// The paper's configuration in `mlagents-learn` and here: do they learn the same?
    MlagentsAgreement(Options),
    /// Speed and score with 16, 64, 512 and 4096 agents.
    Concurrency(Options),
    /// A decision every physics step, or every few of them: cost and learning.
    DecisionPeriod(Options),
    /// Speed with and without pictures.
    Headless(Options),
    /// One agent, many agents in one process, threads, several processes.
    MultiEnv(Options),
    /// Figure 3 of the paper: walk, run, backflip and others learned from motion clips. Keeps its runs in
    /// runs/style-transfer, unless --keep names another folder, and a small file beside each, which is enough for the page.
    StyleTransfer {
        #[command(flatten)]
        options: Options,
        /// Clips of Marathon Man to learn, or other tasks such as HumanoidStyleRun, with commas between them [default: all].
        #[arg(long, value_name = "CLIPS", value_delimiter = ',')]
        clips: Vec<String>,
        /// Only what is kept: a page of the runs that are there, without training any.
        #[arg(long)]
        kept_only: bool,
    },
    /// Runners that learned on flat, random, ever harder and adversarial ground, with and without seeing it, on courses that none
    /// of them knows. Keeps its runs in runs/assault-course, unless --keep names another folder, and a small file beside each,
    /// which is enough for the page.
    AssaultCourse {
        #[command(flatten)]
        options: Options,
        /// TerrainHopper, TerrainWalker2d, or both with a comma between them [default: both].
        #[arg(long, value_name = "TASKS", value_delimiter = ',')]
        tasks: Vec<String>,
        /// Ground to learn on: some of flat, random, curriculum, adversary, bounded, rising,
        /// regret [default: all].
        #[arg(long, value_name = "GROUNDS", value_delimiter = ',')]
        grounds: Vec<String>,
        /// Whether runners see the ground: heights, blind, or both with a comma between them [default: both].
        #[arg(long, value_name = "SIGHTS", value_delimiter = ',')]
        sights: Vec<String>,
        /// Only what is kept: a page of the runs that are there, without training any.
        #[arg(long)]
        kept_only: bool,
    },
}

/// What all studies have.
#[derive(Clone, Debug, clap::Args)]
pub struct Options {
    /// Seeds of each row.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    /// Agent-steps of each run [default: 1,000,000; in style-transfer and assault-course what the configuration says]; in table1, of an agent
    /// with a network of the paper's usual size.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub steps: Option<u64>,
    /// Threads; 0 means one per processor.
    #[arg(long, value_name = "T", default_value_t = 1)]
    pub threads: usize,
    /// Folder that the three files go to.
    #[arg(long, value_name = "DIR", default_value = "docs/studies")]
    pub out: PathBuf,
    /// Folder that keeps runs, of other people's trainers or, in style-transfer, of all: one that is found there is not made
    /// again, so that a study that was interrupted goes on.
    #[arg(long, value_name = "DIR")]
    pub keep: Option<PathBuf>,
}

impl Options {
    /// Agent-steps of each run.
    fn steps(&self) -> u64 {
        self.steps.unwrap_or(1_000_000)
    }

    /// A folder in that one, for the runs with one configuration.
    fn keep_for(&self, configuration: &str) -> Option<PathBuf> {
        self.keep.as_ref().map(|folder| folder.join(configuration))
    }
}

/// Other people's trainers.
#[derive(Debug, clap::Args)]
pub struct Peers {
    /// Seeds of ML-Agents and Stable-Baselines3, which are slow; 0 leaves them out. MARATHON_PYTHON and
    /// MARATHON_MLAGENTS_PYTHON name the Pythons that have them.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=1000))]
    pub peer_seeds: u64,
}

impl Peers {
    /// As words of the command.
    fn words(&self) -> String {
        if self.peer_seeds > 0 { format!(" --peer-seeds {}", self.peer_seeds) } else { String::new() }
    }
}

impl What {
    /// The options of all studies.
    fn options(&self) -> &Options {
        match self {
            What::Table1 { options, .. } | What::Table3 { options, .. } => options,
            What::StyleTransfer { options, .. } | What::AssaultCourse { options, .. } => options,
            What::Table2(options) | What::MlagentsAgreement(options) | What::Concurrency(options) => options,
            What::DecisionPeriod(options) | What::Headless(options) | What::MultiEnv(options) => options,
        }
    }
}

/// Refuses a folder that cannot be created or written to, before the study spends hours on it.
fn check_out(options: &Options) -> Result<(), CliError> {
    // the study creates its folder at the end: a study that fails leaves nothing
    let mut there = options.out.ancestors().filter(|folder| folder.exists());
    let there = there.next().unwrap_or(Path::new("."));
    if !there.is_dir() {
        let (out, found) = (path_word(&options.out), path_word(there));
        return Err(CliError::Usage(format!("--out is {out}, but {found} is a file; expected a folder")));
    }
    AtomicFile::create(&there.join("study"))?;
    Ok(())
}

/// Measures and writes the files.
///
/// # Errors
/// If an agent cannot be trained, other people's trainers are missing, or a file cannot be written.
pub fn run(args: &StudyArgs, json: bool) -> Result<(), CliError> {
    check_out(args.what.options())?;
    let (record, options) = match &args.what {
        What::Table1 { options, peers } => (table1::run(options, peers)?, options),
        What::Table2(options) => (table2::run(options)?, options),
        What::Table3 { options, peers } => (table3::run(options, peers)?, options),
        What::MlagentsAgreement(options) => (agreement::run(options)?, options),
        What::Concurrency(options) => (concurrency::run(options)?, options),
        What::DecisionPeriod(options) => (decision_period::run(options)?, options),
        What::Headless(options) => (headless::run(options)?, options),
        What::MultiEnv(options) => (multi_env::run(options)?, options),
        What::StyleTransfer { options, clips, kept_only } => {
            (style_transfer::run(options, clips, *kept_only)?, options)
        }
        What::AssaultCourse { options, tasks, grounds, sights, kept_only } => {
            (assault_course::run(options, [tasks, grounds, sights], *kept_only)?, options)
        }
    };
    let page = record.save(options)?;
    if json {
        print_json(&record)
    } else {
        say(page)
    }
    Ok(())
}
