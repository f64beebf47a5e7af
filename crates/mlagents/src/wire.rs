//! The messages of ML-Agents' protocol, communication version 1.5. Names and field numbers are fixed.
//!
//! Only the fields that a player needs are declared. Readers of protocol buffers skip the rest. Numbers and shapes
//! follow the released `mlagents-envs` 1.1.0.

use prost::Message;
use std::collections::BTreeMap;

/// A message in either direction.
#[derive(Clone, PartialEq, Message)]
pub struct UnityMessage {
    /// Whether to continue.
    #[prost(message, optional, tag = "1")]
    pub header: Option<Header>,
    /// From the player.
    #[prost(message, optional, tag = "2")]
    pub output: Option<UnityOutput>,
    /// From the trainer.
    #[prost(message, optional, tag = "3")]
    pub input: Option<UnityInput>,
}

/// Whether to continue.
#[derive(Clone, PartialEq, Message)]
pub struct Header {
    /// [`Header::OK`], or something else when the sender closes.
    #[prost(int32, tag = "1")]
    pub status: i32,
}

impl Header {
    /// The conversation continues.
    pub const OK: i32 = 200;
}

/// From the player.
#[derive(Clone, PartialEq, Message)]
pub struct UnityOutput {
    /// Once per decision.
    #[prost(message, optional, tag = "1")]
    pub rl: Option<RlOutput>,
    /// At the beginning.
    #[prost(message, optional, tag = "2")]
    pub initialization: Option<RlInitializationOutput>,
}

/// From the trainer.
#[derive(Clone, PartialEq, Message)]
pub struct UnityInput {
    /// Once per decision.
    #[prost(message, optional, tag = "1")]
    pub rl: Option<RlInput>,
    /// At the beginning.
    #[prost(message, optional, tag = "2")]
    pub initialization: Option<RlInitializationInput>,
}

/// The player and its behaviors.
#[derive(Clone, PartialEq, Message)]
pub struct RlInitializationOutput {
    /// Name of the player.
    #[prost(string, tag = "1")]
    pub name: String,
    /// Version of this protocol.
    #[prost(string, tag = "2")]
    pub communication_version: String,
    /// Behaviors that appear for the first time in this message.
    #[prost(message, repeated, tag = "5")]
    pub brain_parameters: Vec<BrainParameters>,
    /// Version of Unity's package that the player corresponds to.
    #[prost(string, tag = "7")]
    pub package_version: String,
    /// Capabilities of the player.
    #[prost(message, optional, tag = "8")]
    pub capabilities: Option<Capabilities>,
}

/// The trainer's request.
#[derive(Clone, PartialEq, Message)]
pub struct RlInitializationInput {
    /// Seed of everything random.
    #[prost(int32, tag = "1")]
    pub seed: i32,
    /// Version of this protocol.
    #[prost(string, tag = "2")]
    pub communication_version: String,
    /// Version of the Python package.
    #[prost(string, tag = "3")]
    pub package_version: String,
    /// Copies of the scene.
    #[prost(int32, tag = "5")]
    pub num_areas: i32,
}

/// Capabilities of a player or trainer.
#[derive(Clone, PartialEq, Message)]
pub struct Capabilities {
    /// Reinforcement learning as such.
    #[prost(bool, tag = "1")]
    pub base_rl: bool,
    /// Several PNG images in one observation.
    #[prost(bool, tag = "2")]
    pub concatenated_png: bool,
    /// Images whose channels are mapped.
    #[prost(bool, tag = "3")]
    pub compressed_channel_mapping: bool,
    /// Continuous and discrete actions of one behavior.
    #[prost(bool, tag = "4")]
    pub hybrid_actions: bool,
    /// Facts about the training for the player.
    #[prost(bool, tag = "5")]
    pub training_analytics: bool,
    /// Observations whose length varies.
    #[prost(bool, tag = "6")]
    pub variable_length_observation: bool,
    /// Groups of agents.
    #[prost(bool, tag = "7")]
    pub multi_agent_groups: bool,
}

/// A behavior: its name and its actions. Agents describe their observations themselves.
#[derive(Clone, PartialEq, Message)]
pub struct BrainParameters {
    /// Such as `Hopper-v0?team=0`.
    #[prost(string, tag = "7")]
    pub brain_name: String,
    /// Whether the trainer acts for it.
    #[prost(bool, tag = "8")]
    pub is_training: bool,
    /// Its actions.
    #[prost(message, optional, tag = "9")]
    pub action_spec: Option<ActionSpec>,
}

/// Actions of a behavior.
#[derive(Clone, PartialEq, Message)]
pub struct ActionSpec {
    /// Number of continuous actions.
    #[prost(int32, tag = "1")]
    pub num_continuous: i32,
}

/// A decision's results.
#[derive(Clone, PartialEq, Message)]
pub struct RlOutput {
    /// Per behavior, an encoded [`AgentInfoList`]. On the wire this equals a message, and it avoids lists of lists.
    #[prost(btree_map = "string, bytes", tag = "2")]
    pub agent_infos: BTreeMap<String, Vec<u8>>,
    /// See [`crate::channels`].
    #[prost(bytes = "vec", tag = "3")]
    pub side_channel: Vec<u8>,
}

/// Agents of a behavior.
#[derive(Clone, PartialEq, Message)]
pub struct AgentInfoList {
    /// One per agent, and one more for each agent whose episode ended.
    #[prost(message, repeated, tag = "1")]
    pub value: Vec<AgentInfo>,
}

/// Observation and reward of an agent.
#[derive(Clone, PartialEq, Message)]
pub struct AgentInfo {
    /// Reward since its last info.
    #[prost(float, tag = "7")]
    pub reward: f32,
    /// The episode ended here.
    #[prost(bool, tag = "8")]
    pub done: bool,
    /// It ended by its time limit.
    #[prost(bool, tag = "9")]
    pub max_step_reached: bool,
    /// Number of the agent.
    #[prost(int32, tag = "10")]
    pub id: i32,
    /// One per sensor, sorted by name.
    #[prost(message, repeated, tag = "13")]
    pub observations: Vec<Observation>,
}

/// Observation of a sensor.
#[derive(Clone, PartialEq, Message)]
pub struct Observation {
    /// Dimensions.
    #[prost(int32, repeated, tag = "1")]
    pub shape: Vec<i32>,
    /// Numbers, row by row.
    #[prost(message, optional, tag = "4")]
    pub float_data: Option<FloatData>,
    /// Per dimension: [`Observation::NO_PROPERTY`].
    #[prost(int32, repeated, tag = "6")]
    pub dimension_properties: Vec<i32>,
    /// Name of the sensor.
    #[prost(string, tag = "8")]
    pub name: String,
}

impl Observation {
    /// A dimension without special properties.
    pub const NO_PROPERTY: i32 = 1;
}

/// Numbers.
#[derive(Clone, PartialEq, Message)]
pub struct FloatData {
    /// The numbers.
    #[prost(float, repeated, tag = "1")]
    pub data: Vec<f32>,
}

/// The next command.
#[derive(Clone, PartialEq, Message)]
pub struct RlInput {
    /// Actions per behavior, in the order of the agents that were not done.
    #[prost(btree_map = "string, message", tag = "1")]
    pub agent_actions: BTreeMap<String, AgentActionList>,
    /// One of [`command`].
    #[prost(int32, tag = "4")]
    pub command: i32,
    /// See [`crate::channels`].
    #[prost(bytes = "vec", tag = "5")]
    pub side_channel: Vec<u8>,
}

/// Values of [`RlInput::command`].
pub mod command {
    /// Act and advance to the next decision.
    pub const STEP: i32 = 0;
    /// Restart all episodes.
    pub const RESET: i32 = 1;
    /// Leave.
    pub const QUIT: i32 = 2;
}

/// Actions of a behavior's agents.
#[derive(Clone, PartialEq, Message)]
pub struct AgentActionList {
    /// One per agent.
    #[prost(message, repeated, tag = "1")]
    pub value: Vec<AgentAction>,
}

/// An action.
#[derive(Clone, PartialEq, Message)]
pub struct AgentAction {
    /// Numbers, nominally in [-1, 1].
    #[prost(float, repeated, tag = "6")]
    pub continuous_actions: Vec<f32>,
}

/// An action in a demonstration file.
#[derive(Clone, PartialEq, Message)]
pub struct RecordedAction {
    /// The same numbers in a deprecated field, from which the previous action is read.
    #[prost(float, repeated, tag = "1")]
    pub vector_actions: Vec<f32>,
    /// In [-1, 1].
    #[prost(float, repeated, tag = "6")]
    pub continuous_actions: Vec<f32>,
}

/// Head of a demonstration file.
#[derive(Clone, PartialEq, Message)]
pub struct DemonstrationMeta {
    /// Version of the format.
    #[prost(int32, tag = "1")]
    pub api_version: i32,
    /// Name of the demonstration.
    #[prost(string, tag = "2")]
    pub name: String,
    /// Number of pairs in the file.
    #[prost(int32, tag = "3")]
    pub number_steps: i32,
    /// Number of episodes.
    #[prost(int32, tag = "4")]
    pub number_episodes: i32,
    /// Mean return.
    #[prost(float, tag = "5")]
    pub mean_reward: f32,
}

/// A decision in a demonstration file.
#[derive(Clone, PartialEq, Message)]
pub struct AgentInfoActionPair {
    /// Observation.
    #[prost(message, optional, tag = "1")]
    pub agent_info: Option<AgentInfo>,
    /// The action taken.
    #[prost(message, optional, tag = "2")]
    pub action_info: Option<RecordedAction>,
}
