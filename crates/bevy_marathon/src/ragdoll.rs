//! Components and messages of ragdolls.

use crate::asset::{PolicyAsset, RagdollPrefab};
use crate::error::RagdollError;
use crate::ground::Ground;
use crate::lod::Lod;
use crate::mode::RagdollMode;
use crate::obstacle::Collides;
use crate::strength::LimbStrength;
use bevy::prelude::*;
use bevy::reflect::reflect_remote;
use marathon_envs::Spec;
use marathon_physics::{Model, Variation};
use marathon_runs::TaskConfig;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A physical character. Its [`Transform`] is where it is and where it faces: below its root body, on the plane of its
/// [`Track`](crate::Track). It is spawned at the start of the track, and set by the plugin in every frame; set it yourself to move the character.
/// The simulated bodies are children, see [`Anatomy`].
///
/// Its life depends on the character, `seed`, `number` and what acts on it: not on the frame rate, and not on the other
/// ragdolls of the world.
#[derive(Component, Clone, Debug, Reflect)]
#[reflect(Component, Clone, Debug)]
#[require(Transform, Episode, Restart, OwnGround, Lod, RagdollMode, LimbStrength, Collides)]
pub struct Ragdoll {
    /// Kind of the ragdoll.
    pub character: Character,
    /// Seed of its random starts.
    pub seed: u64,
    /// Which of the seed's agents it is: `marathon eval --seed S` plays the agents 0, 1, 2 ... of seed S.
    pub number: u64,
    /// Ground under an agent; a prefab brings its own.
    pub ground: Ground,
    /// An agent's task with its arguments and clips. `None`: what its [`CharacterPolicy`] notes when the ragdoll enters the simulation,
    /// which waits for a policy that is still being loaded; without a policy, the defaults. Scenes do not keep it.
    #[reflect(ignore)]
    pub task_config: Option<TaskConfig>,
}

/// Kind of a [`Ragdoll`].
#[derive(Clone, Debug, PartialEq, Eq, Hash, Reflect)]
pub enum Character {
    /// An agent of the registry, such as `hopper` or `Humanoid-v1`, with its task: it observes, earns rewards and fails. A
    /// [`CharacterPolicy`] moves it.
    Agent(String),
    /// A body without a task. [`Controls`] move it.
    Prefab(Handle<RagdollPrefab>),
}

impl Ragdoll {
    fn new(character: Character) -> Self {
        Ragdoll { character, seed: 0, number: 0, ground: Ground::Level, task_config: None }
    }

    /// An agent of the registry; to add one's own, see [`marathon_envs::register`].
    pub fn agent(name: impl Into<String>) -> Self {
        Self::new(Character::Agent(name.into()))
    }

    /// A body loaded from MJCF.
    pub fn prefab(prefab: Handle<RagdollPrefab>) -> Self {
        Self::new(Character::Prefab(prefab))
    }

    /// The same as agent `number` of another seed.
    pub fn with_seed(mut self, seed: u64, number: u64) -> Self {
        (self.seed, self.number) = (seed, number);
        self
    }

    /// The same with a task of these arguments, whatever its policy notes.
    pub fn with_task_config(mut self, task_config: TaskConfig) -> Self {
        self.task_config = Some(task_config);
        self
    }

    /// The same on another ground.
    pub fn on(mut self, ground: Ground) -> Self {
        self.ground = ground;
        self
    }
}

/// Policy of a [`Ragdoll`] that is an agent. When the asset changes, the new policy computes the next action.
#[derive(Component, Clone, Debug, PartialEq, Eq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
pub struct CharacterPolicy(pub Handle<PolicyAsset>);

/// The actions of a [`Ragdoll`] that something else decides for: one number per actuator, in the units of
/// [`Spec::action_low`] for an agent, in the actuator's own for a prefab. It goes before a [`CharacterPolicy`].
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct Controls(pub Vec<f32>);

/// The policy of the second role of a [`Ragdoll`]'s task, if it has [roles](marathon_envs::RoleFacts); [`CharacterPolicy`] is then that of
/// the first.
#[derive(Component, Clone, Debug, PartialEq, Eq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
pub struct Opponent(pub Handle<PolicyAsset>);

/// Some of a [`Ragdoll`]'s actions, by actuator, that something decides in place of its policies; `None` leaves one to them.
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct Held(pub Vec<Option<f32>>);

/// Ground that is laid below a [`Ragdoll`]: elevations of its model's first height field, as [`OwnGround`] has them. It stays over
/// all episodes, unless the task draws ground of its own.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
pub struct LaidGround(pub Vec<f32>);

/// A place to run to. At the start of every episode the ragdoll is turned towards it; [`TargetReached`](crate::TargetReached) tells of the
/// arrival.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
pub struct Target {
    /// The place, in the world's axes; its height does not matter.
    pub place: Vec3,
    /// Distance at which it counts as reached, m.
    pub radius: f32,
}

/// Physical constants of this ragdoll: masses, friction, strength of the actuators, gravity. Start from
/// [`Variation::none`] of [`Anatomy::model`] and change it.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
pub struct Physique(#[reflect(remote = VariationFields)] pub Variation);

/// The fields of [`Variation`] for reflection.
#[reflect_remote(Variation)]
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VariationFields {
    pub mass: Vec<f64>,
    pub friction: f64,
    pub strength: Vec<f64>,
    pub gravity: [f64; 3],
}

/// Behavior after the end of an episode.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct Restart {
    /// Seconds that it lies limp after a fall; infinity: for good. 0 is what training and evaluation do.
    pub after_fall: f64,
    /// Whether the episode also restarts at the task's time limit. If not, it continues. Once off, it stays off to the
    /// end of the episode.
    pub on_time_up: bool,
}

impl Default for Restart {
    /// At once, as in training.
    fn default() -> Self {
        Restart { after_fall: 0.0, on_time_up: true }
    }
}

/// The ground that a [`Ragdoll`] stands on: elevations of each height field of its model, m above the field's zero, by rows. Written
/// by the plugin whenever it changes; empty without height fields.
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct OwnGround(#[reflect(ignore)] pub Arc<Vec<Vec<f32>>>);

/// The present episode of a [`Ragdoll`]. Written by the plugin after every decision.
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect, Serialize, Deserialize)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct Episode {
    /// Number of the episode, the first being 1; 0 before it has begun.
    pub number: u64,
    /// Decisions made.
    pub decisions: u64,
    /// Simulated seconds.
    pub seconds: f64,
    /// Sum of the rewards.
    pub total: f64,
    /// Reward of the last decision.
    pub reward: f32,
    /// Its terms, in the order of [`Spec::reward_terms`].
    pub terms: Vec<f32>,
    /// The agent's metrics of the state reached, in the order of [`Spec::info`].
    pub info: Vec<f32>,
    /// Distance run along the track, m.
    pub distance: f64,
    /// Farthest that it has come along the track, m.
    pub farthest: f64,
    /// Speed along the track in the last decision, m/s.
    pub speed: f32,
    /// Velocity of the free body along its forward axis and to its left in the last decision, m/s; 0 for planar
    /// characters.
    pub own_velocity: [f32; 2],
    /// Actions of the last decision.
    pub action: Vec<f32>,
    /// The command that it observes, in the order of [`Spec::command`]: of its [`AgentCommand`](crate::AgentCommand), or of its own schedule.
    pub command: Vec<f64>,
    /// Feet on the ground in the last decision: a bit each, in the order of [`Anatomy::feet`].
    pub feet: u32,
    /// It has fallen and lies limp, see [`Restart`].
    pub down: bool,
    /// The episode has no time limit, because [`Restart::on_time_up`] was off in one of its decisions.
    pub untimed: bool,
}

/// Model and parts of a [`Ragdoll`]. The plugin adds it when the ragdoll has entered the simulation.
#[derive(Component, Clone, Debug)]
pub struct Anatomy {
    /// The compiled model.
    pub model: Arc<Model>,
    /// The task, if the ragdoll is an agent.
    pub spec: Option<Arc<Spec>>,
    /// The bodies, one entity per body of the model; the first is the world, which does not move. Each has a [`Part`].
    pub parts: Vec<Entity>,
    /// Names of the geoms that may touch the ground.
    pub feet: Vec<Arc<str>>,
    /// Seconds between decisions.
    pub dt: f64,
}

impl Anatomy {
    /// The entity of a body by name.
    pub fn part(&self, name: &str) -> Option<Entity> {
        self.model.bodies.iter().position(|b| b.name == name).and_then(|i| self.parts.get(i).copied())
    }
}

/// A body of a [`Ragdoll`]: a child whose [`Transform`] the plugin writes every frame. Its children move along with it.
/// [`crate::Marathon::places`] returns its position in a tick between frames.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
pub struct Part {
    /// Whose it is.
    #[entities]
    pub ragdoll: Entity,
    /// Index in the model's bodies.
    pub body: usize,
}

/// A [`Ragdoll`] that cannot be simulated, and why. Added by the plugin. Remove it to try again.
#[derive(Component, Clone, Debug)]
pub struct Unfit(pub Arc<RagdollError>);
