//! Ground that changes during an episode, the argument of [`Agent::build`](crate::Agent::build).

/// An agent's ground, and the data for its next change.
pub struct Site<'a> {
    /// The action to be executed on the changed ground, with the numbers of all roles.
    pub action: &'a [f64],
    /// The agent's memory, see [`Agent::remember`](crate::Agent::remember).
    pub memory: &'a mut [f64],
    /// Heights by height field, as in [`Start::set_ground`](crate::Start::set_ground). Numbers that are not finite are
    /// ignored.
    pub grounds: &'a mut [Vec<f32>],
    /// Whether to move the agent's body back to its spawn state before the decision is executed.
    pub restart: bool,
}
