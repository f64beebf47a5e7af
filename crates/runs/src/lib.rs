//! Training runs: their options, folders, reports and policies, and processes that play rollouts for them.
//!
//! The command line, the studies, the game and the Python package are front ends of this crate. [`RunOptions`],
//! [`PolicySource`] and [`VideoOptions`] are plain structs. The feature `clap` turns them into arguments of a command
//! line. The feature `training`, a default, adds what a run needs and writes. The feature `terminal` adds output, Ctrl-C and
//! exit codes for programs in a terminal. A [`RunError`] carries the names of options, and each front end spells them in
//! its own way ([`Spelling`]).

#[cfg(feature = "training")]
pub mod average;
pub mod clips;
pub mod configuration;
#[cfg(feature = "training")]
pub mod controller;
pub mod demonstrations;
#[cfg(feature = "training")]
pub mod distill;
pub mod error;
pub mod folder;
pub mod imitation;
pub mod inputs;
#[cfg(feature = "training")]
pub mod measure;
pub mod options;
pub mod output;
pub mod play;
pub mod policy_file;
#[cfg(feature = "training")]
pub mod processes;
pub mod python;
#[cfg(feature = "training")]
pub mod recipe;
#[cfg(feature = "training")]
pub mod report;
pub mod run_file;
#[cfg(feature = "training")]
pub mod session;
pub mod speed;
pub mod task;
pub mod task_config;
#[cfg(feature = "terminal")]
pub mod terminal;
pub mod text;

#[cfg(feature = "training")]
pub use controller::CommandTracking;
pub use error::{Flags, Plain, RunError, Spelling};
pub use folder::RunFolder;
pub use imitation::Imitation;
pub use options::{LearnOptions, PolicySource, RunOptions, VideoOptions};
pub use play::Play;
#[cfg(feature = "training")]
pub use report::Watch;
#[cfg(feature = "training")]
pub use report::summary::Summary;
pub use run_file::RunFile;
#[cfg(feature = "training")]
pub use session::{Outcome, Session};
pub use task::Task;
pub use task_config::{TaskConfig, TaskOptions};
