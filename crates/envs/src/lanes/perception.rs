//! What an agent's code is run for, and what comes of it.

/// What an agent perceives for.
pub(crate) enum Occasion<'a> {
    /// A decision that has been carried out; with it the time of the episodes in the lanes `last` is over, a bit each.
    Decision { last: u32 },
    /// The start of episodes in these lanes, a bit each; the reward is then not used.
    Start(u32),
    /// A start in all lanes, to see what the agent names.
    Rehearsal(&'a mut Named),
}

/// What an agent gives names to.
#[derive(Default)]
pub(crate) struct Named {
    /// Terms of the reward.
    pub terms: Vec<&'static str>,
    /// Parts of the observation, and where they begin.
    pub groups: Vec<(&'static str, usize)>,
}

/// What an agent perceived.
pub(crate) struct Perceived {
    /// How many numbers it observed.
    pub observed: usize,
    /// How many numbers it reported.
    pub reported: usize,
    /// Lanes that failed, a bit each.
    pub failed: u32,
    /// Lanes whose episode is over all the same.
    pub over: u32,
}

/// What an agent did when it was let do everything once.
pub(crate) struct Rehearsal {
    /// How many numbers it observed.
    pub observed: usize,
    /// How many numbers it reported.
    pub reported: usize,
    /// What it named.
    pub named: Named,
}

/// Lanes whose episode ended in this decision, a bit each.
#[derive(Clone, Copy, Default)]
pub(crate) struct Ended {
    pub terminated: u32,
    pub truncated: u32,
    pub diverged: u32,
}
