//! Roles: several policies that act in one task, each with its own learner.

/// One of the roles of a task, for example a runner, or the opponent that pushes it. Each role observes some groups of
/// the observation, controls some actuators and earns some terms of the reward. A trainer learns a policy for each
/// role.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RoleFacts {
    /// Name, such as `runner`.
    pub name: String,
    /// Groups of the observation that it observes, by the names that [`Obs::group`](crate::Obs::group) sets. They are
    /// adjacent and in order. Roles may share groups.
    pub observations: Vec<String>,
    /// Actuators that it controls, adjacent and in order. Each actuator belongs to one role.
    pub actions: Vec<String>,
    /// Terms of the reward that it earns. [`Facts::reward_terms`](crate::Facts::reward_terms) lists those of the first
    /// role, then those of the second, and so on. A failure needs a term of its own:
    /// [`Facts::termination_reward`](crate::Facts::termination_reward) does not apply.
    pub reward_terms: Vec<String>,
    /// Whether it acts in some decisions only, see [`Agent::decides`](crate::Agent::decides).
    pub intermittent: bool,
}
