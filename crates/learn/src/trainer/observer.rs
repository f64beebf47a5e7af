//! Lets a caller follow a run and stop it.

use super::checkpoint::Checkpoint;
use super::stats::IterationStats;
use super::{TrainLoop, TrainOutput};
use crate::policy::Policy;

/// An observer's decision about the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    Continue,
    /// End after this iteration.
    Stop,
}

/// Follows a run. Called once per iteration on the thread that called `train`; the workers wait meanwhile, and its time
/// does not count.
pub trait Observer {
    /// An iteration has ended.
    fn iteration(&mut self, stats: &IterationStats, snapshot: &Snapshot<'_>) -> Control;
}

impl<F: FnMut(&IterationStats, &Snapshot<'_>) -> Control> Observer for F {
    fn iteration(&mut self, stats: &IterationStats, snapshot: &Snapshot<'_>) -> Control {
        self(stats, snapshot)
    }
}

/// The state of a run between two iterations.
pub struct Snapshot<'a>(pub(super) &'a TrainLoop);

impl Snapshot<'_> {
    /// The policy as it is now: of a task with several roles, the first one's.
    pub fn policy(&self) -> Policy {
        self.0.policy()
    }
    /// Everything needed to go on from here.
    pub fn checkpoint(&self) -> Checkpoint {
        self.0.checkpoint()
    }
    /// The result if the run ended now, without the statistics.
    pub fn output(&self) -> TrainOutput {
        self.0.output(None)
    }
}
