//! Ground that changes in mid-episode: what [`Agent::build`](crate::Agent::build) works on.

/// An agent's ground, and what decides how it goes on.
pub struct Site<'a> {
    /// The action of the decision that is to be carried out on the changed ground, all roles' numbers.
    pub action: &'a [f64],
    /// The agent's own variables, see [`Agent::remember`](crate::Agent::remember).
    pub memory: &'a mut [f64],
    /// Elevations by height field, as [`Start::set_ground`](crate::Start::set_ground) takes them. What is not a finite number is
    /// not carried out.
    pub grounds: &'a mut [Vec<f32>],
    /// Whether the agent's body is to go back to where it spawns before the decision is carried out.
    pub restart: bool,
}
