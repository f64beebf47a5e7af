//! Training runs: their options, folders, reports and policies, and processes that play rollouts for them.
//!
//! The command line, the studies, the game and the Python package are front ends of this crate. [`RunOptions`],
//! [`PolicySource`] and [`VideoOptions`] are plain structs. The feature `clap` turns them into arguments of a command
//! line. The feature `terminal` adds output, Ctrl-C and exit codes for programs in a terminal. A [`RunError`] carries
//! the names of options, and each front end spells them in its own way ([`Spelling`]).

pub mod average;
pub mod clips;
pub mod configuration;
pub mod controller;
pub mod demonstrations;
pub mod distill;
pub mod error;
pub mod folder;
pub mod imitation;
pub mod inputs;
pub mod options;
pub mod output;
pub mod play;
pub mod policy_file;
pub mod processes;
pub mod python;
pub mod report;
pub mod run_file;
pub mod session;
pub mod speed;
pub mod task;
pub mod task_config;
#[cfg(feature = "terminal")]
pub mod terminal;
pub mod text;

pub use controller::CommandTracking;
pub use error::{Flags, Plain, RunError, Spelling};
pub use folder::RunFolder;
pub use imitation::Imitation;
pub use options::{LearnOptions, PolicySource, RunOptions, VideoOptions};
pub use play::Play;
pub use report::Watch;
pub use report::summary::Summary;
pub use run_file::RunFile;
pub use session::{Outcome, Session};
pub use task::Task;
pub use task_config::{TaskConfig, TaskOptions};
