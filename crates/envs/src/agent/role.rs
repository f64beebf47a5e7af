//! Roles: several deciders of one task, each with a learner of its own.

/// One who decides in a task: a runner, or the opponent that pushes it. Each role sees some parts of the observation, moves
/// some of the actuators, and earns some terms of the reward; a trainer gives it a policy of its own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RoleFacts {
    /// Name, such as `runner`.
    pub name: String,
    /// Parts of the observation that it sees, by the names that [`Obs::group`](crate::Obs::group) gives them: neighbors, in
    /// their order. Roles may see the same parts.
    pub observations: Vec<String>,
    /// Actuators that it moves: neighbors, in their order. Each actuator has one role.
    pub actions: Vec<String>,
    /// Terms of the reward that it earns. [`Facts::reward_terms`](crate::Facts::reward_terms) has those of the first role, then
    /// those of the second, and so on; failures are priced by terms alone.
    pub reward_terms: Vec<String>,
    /// Whether it does not decide every time, see [`Agent::decides`](crate::Agent::decides).
    pub intermittent: bool,
}
