//! Inputs and results of an agent's code.

/// The reason for which an agent perceives its state.
pub(crate) enum Occasion<'a> {
    /// A decision has been executed. `last` holds one bit per lane, set if the episode reaches its time limit.
    Decision { last: u32 },
    /// The start of episodes in these lanes, one bit each. The reward is not used.
    Start(u32),
    /// A start in all lanes that records the agent's names.
    Rehearsal(&'a mut Named),
}

/// Names that an agent sets.
#[derive(Default)]
pub(crate) struct Named {
    /// Terms of the reward.
    pub terms: Vec<&'static str>,
    /// Groups of the observation, with their start indices.
    pub groups: Vec<(&'static str, usize)>,
}

/// Results of an agent's code.
pub(crate) struct Perceived {
    /// Size of the observation.
    pub observed: usize,
    /// Number of infos.
    pub reported: usize,
    /// Lanes that failed, one bit each.
    pub failed: u32,
    /// Lanes whose episode is truncated by the agent, one bit each.
    pub over: u32,
}

/// Results of one trial call of an agent's code.
pub(crate) struct Rehearsal {
    /// Size of the observation.
    pub observed: usize,
    /// Number of infos.
    pub reported: usize,
    /// Recorded names.
    pub named: Named,
}

/// Lanes whose episode ended in this decision, one bit each.
#[derive(Clone, Copy, Default)]
pub(crate) struct Ended {
    pub terminated: u32,
    pub truncated: u32,
    pub diverged: u32,
}
