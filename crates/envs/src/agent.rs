//! The paper's `MarathonAgent`: what somebody writes who adds a creature or a task.
//!
//! An agent is a small value (usually a unit struct) that implements [`Agent`]: constant [`Facts`], and three functions
//! over [`Senses`]: what it sees, what it is rewarded for, when it has failed. They are generic over [`Real`], so one text
//! serves a single agent in double precision and sixteen agents in one vector register. Mark them `#[inline(always)]`
//! (everything that runs inside [`Real::enter`] must be) and let no lane look at another: there is no way to.
//!
//! [`AnyAgent`] is the object-safe face of an agent; every [`Agent`] has it by a blanket implementation, so that the
//! [`Registry`](crate::Registry) holds agents of any crate.

use std::borrow::Cow;
use std::sync::Arc;

use marathon_physics::Model;
use marathon_physics::lanes::{Isa, Real};

use crate::anatomy::Blueprint;
use crate::error::EnvError;
use crate::lane_env::{AgentFactory, AgentShards};
use crate::senses::Senses;
use crate::write::{Obs, Terms};

/// Constant facts of an agent.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Registry name with a version, such as `Hopper-v0`.
    pub id: &'static str,
    /// One line for listings.
    pub summary: &'static str,
    /// The model, as MJCF text. A keyframe named `spawn`, if there is one, is the pose and the
    /// velocity with which episodes start.
    pub model: Cow<'static, str>,
    /// Physics steps per decision.
    pub frame_skip: usize,
    /// Decisions after which an episode is truncated.
    pub max_episode_steps: usize,
    /// Length of the observation.
    pub observation: usize,
    /// Names of the model's actuators in their order: the action.
    pub actions: &'static [&'static str],
    /// Names of the reward's terms in the order in which `step_reward` adds them.
    pub reward_terms: &'static [&'static str],
    /// Geoms that the agent speaks of, see [`Part`].
    pub parts: &'static [&'static str],
    /// Geoms that may touch the ground.
    pub feet: &'static [&'static str],
    /// Geoms with a touch sensor, in the order of the observation.
    pub touch: &'static [&'static str],
    /// Number of lane variables that the agent keeps from decision to decision, see [`Agent::remember`].
    pub memory: usize,
    /// Randomness of the start.
    pub reset: ResetNoise,
    /// Reward of a decision in which the agent failed; it replaces all other terms.
    pub termination_reward: f64,
}

/// How far the start of an episode strays from the spawn pose at rest; every number is the half width of a uniform
/// distribution around zero, drawn independently per degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResetNoise {
    /// Actuated joints, rad; the result is clamped to the joint's range.
    pub joint_position: f64,
    /// Actuated joints, rad/s.
    pub joint_velocity: f64,
    /// Linear velocity of the root (a free joint, or unactuated slides), m/s.
    pub root_velocity: f64,
}

impl ResetNoise {
    /// The suite's noise. The original starts from the exact spawn pose with joint spins of up to 25 rad/s that its
    /// engine cut or cancelled at once, and +-0.025 m/s; these are the sane reading of it (0.1 rad/s and 0.025 m/s), plus
    /// 0.01 rad in the joints so that no two episodes look alike to a policy that sees positions only.
    pub const MARATHON: ResetNoise = ResetNoise { joint_position: 0.01, joint_velocity: 0.1, root_velocity: 0.025 };
}

/// A body part, which is a geom by name: the original made every geom a rigid body of its own.
///
/// A part has the position and velocity of the geom's center and the axes of the body that the geom belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part(pub(crate) usize);

impl Part {
    /// The part called `name` among an agent's [`Facts::parts`]. Meant for a `const`, where an unknown name is a compile
    /// error.
    ///
    /// # Panics
    /// If there is no such name.
    pub const fn named(parts: &[&str], name: &str) -> Part {
        Part(find(parts, name))
    }
}

/// A set of motors, used to leave some out of the effort.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motors(u128);

impl Motors {
    /// No motor.
    pub const NONE: Motors = Motors(0);

    /// The motors of these names among an agent's [`Facts::actions`], of which it may have 128. Meant for a `const`,
    /// where an unknown name is a compile error.
    ///
    /// # Panics
    /// If there is no such name.
    pub const fn named(actions: &[&str], names: &[&str]) -> Motors {
        let mut set = 0;
        let mut i = 0;
        while i < names.len() {
            set |= 1 << find(actions, names[i]);
            i += 1;
        }
        Motors(set)
    }

    /// Whether motor `i` belongs to the set.
    #[inline(always)]
    pub fn contains(self, i: usize) -> bool {
        i < 128 && self.0 >> i & 1 == 1
    }
}

/// Index of a name, at compile time.
const fn find(list: &[&str], name: &str) -> usize {
    let mut i = 0;
    while i < list.len() {
        if same(list[i].as_bytes(), name.as_bytes()) {
            return i;
        }
        i += 1;
    }
    panic!("this name is not in the list")
}

const fn same(a: &[u8], b: &[u8]) -> bool {
    if a.len() != b.len() {
        return false;
    }
    let mut i = 0;
    while i < a.len() {
        if a[i] != b[i] {
            return false;
        }
        i += 1;
    }
    true
}

/// A creature with a task.
pub trait Agent: Send + Sync + 'static {
    /// Constant facts; the same at every call.
    fn facts(&self) -> Facts;

    /// Writes the observation, [`Facts::observation`] numbers.
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>);

    /// Adds the terms of the reward of the decision just made, in the order of [`Facts::reward_terms`].
    ///
    /// It is called once per decision, with the state that the decision led to. (The original computed a reward at every
    /// physics step and kept the last.)
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>);

    /// Lanes whose agent has failed.
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask;

    /// Updates the agent's own variables, [`Facts::memory`] of them per lane, once per decision, before `step_reward`
    /// reads them through [`Senses::memory`]. They are zero at the start of an episode and belong to snapshots.
    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let _ = (s, memory);
    }
}

/// An [`Agent`] behind a pointer: what the registry holds. Implemented for every agent; not to be implemented by hand.
pub trait AnyAgent: Send + Sync {
    /// Constant facts.
    fn facts(&self) -> Facts;
    /// The compiled model.
    ///
    /// # Errors
    /// If the model text is not valid MJCF.
    fn model(&self) -> Result<Model, EnvError>;
    /// Checks the agent against its model and prepares it for stepping with an instruction set.
    ///
    /// # Errors
    /// If names or lengths of the facts do not fit the model, the model cannot be simulated, or the processor lacks the
    /// instruction set.
    fn shards(self: Arc<Self>, isa: Isa) -> Result<Arc<dyn AgentShards>, EnvError>;
}

impl<A: Agent> AnyAgent for A {
    fn facts(&self) -> Facts {
        Agent::facts(self)
    }

    fn model(&self) -> Result<Model, EnvError> {
        let facts = Agent::facts(self);
        Blueprint::model(&facts)
    }

    fn shards(self: Arc<Self>, isa: Isa) -> Result<Arc<dyn AgentShards>, EnvError> {
        if !isa.supported() {
            return Err(EnvError::Isa { isa: isa.name(), best: Isa::best().name() });
        }
        marathon_physics::with_lanes!(isa, T => Ok(Arc::new(AgentFactory::<T, A>::new(self)?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_indices() {
        const PARTS: [&str; 3] = ["torso", "foot", "toe"];
        const FOOT: Part = Part::named(&PARTS, "foot");
        assert_eq!(FOOT, Part(1));
        const SOME: Motors = Motors::named(&PARTS, &["torso", "toe"]);
        assert!(SOME.contains(0) && !SOME.contains(1) && SOME.contains(2) && !SOME.contains(200));
    }
}
