//! The simulation behind the ragdolls: batches of sixteen, stepped together in the lanes of the physics.
//!
//! Each ragdoll has a lane in a batch of its kind. Neither the lane nor the other ragdolls of the batch change its bits. Each
//! kind has a clock, ahead of the game's by at most one decision, so that a frame always lies between two states.

mod animated;
mod batch;
mod detector;
mod event;
mod lane_state;
mod playing;
mod power;
mod saved;
mod sleep;
mod slot;

pub(crate) use batch::CharacterBatch;
pub(crate) use event::Event;
pub(crate) use lane_state::{KindIdentity, LaneState};
pub(crate) use playing::Playing;
pub use slot::PoseSample;
pub(crate) use slot::{Shove, Slot};

use crate::asset::RagdollPrefab;
use crate::error::RagdollError;
use crate::ground::Ground;
use crate::limbs::Limbs;
use crate::pose;
use crate::ragdoll::Character;
use bevy::prelude::*;
use marathon_envs::Spec;
use marathon_physics::Model;
use marathon_physics::lanes::Isa;
use marathon_runs::TaskConfig;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// Seconds that a prefab is simulated for at a time, about.
const PREFAB_DT: f64 = 0.01;

/// The task as the policy of role `role` sees it. `None` if the task has fewer roles. The first role keeps the task's id, because a policy
/// for a task of one role can play it.
pub fn spec_of_role(spec: &Spec, role: usize) -> Option<Spec> {
    let part = spec.of_role(spec.deciders().get(role)?);
    Some(if role == 0 { Spec { id: spec.id.clone(), ..part } } else { part })
}

/// All ragdolls of one kind.
pub(crate) struct CharacterKind {
    pub character: Character,
    /// The task of an agent.
    pub task_config: TaskConfig,
    pub ground: Ground,
    /// Whether its ragdolls touch more than their ground.
    pub collides: bool,
    pub model: Arc<Model>,
    pub spec: Option<Arc<Spec>>,
    pub feet: Vec<Arc<str>>,
    pub limbs: Arc<Limbs>,
    /// Radius of a ball around the root that holds a ragdoll in any pose, m. `None` if it has several roots, or one that is not free.
    pub reach: Option<f32>,
    /// Physics steps per decision.
    substeps: usize,
    pub dt: f64,
    /// Time between decisions.
    pub period: Duration,
    /// Time of the newest states.
    pub time: Duration,
    pub batches: Vec<CharacterBatch>,
    /// Ragdolls have fallen asleep or woken up since the lanes were packed.
    pub unpacked: bool,
    /// Ragdolls that have entered so far.
    entered: u64,
    /// Mark of its snapshots, once there is one.
    identity: OnceLock<Arc<KindIdentity>>,
}

impl CharacterKind {
    /// The kind of an agent of the registry in a task and on a ground, without ragdolls yet.
    pub fn of_agent(
        name: &str,
        task_config: &TaskConfig,
        (ground, collides): (Ground, bool),
        time: Duration,
    ) -> Result<Self, RagdollError> {
        let agent = ground.colliding_agent(&task_config.agent, &task_config.options, collides)?;
        let spec = agent.clone().shards(Isa::best())?.spec().clone();
        let model = Arc::new(agent.model()?);
        let feet: Vec<Arc<str>> = agent.facts().feet.iter().map(|n| Arc::from(n.as_str())).collect();
        Ok(CharacterKind {
            character: Character::Agent(name.into()),
            task_config: task_config.clone(),
            ground,
            collides,
            limbs: Arc::new(Limbs::of(&model, &feet)),
            reach: pose::reach(&model),
            model,
            feet,
            substeps: spec.frame_skip,
            dt: spec.dt,
            period: Duration::from_secs_f64(spec.dt),
            spec: Some(Arc::new(spec)),
            time,
            batches: Vec::new(),
            unpacked: false,
            entered: 0,
            identity: OnceLock::new(),
        })
    }

    /// The kind of a body, without ragdolls yet.
    pub fn of_prefab(
        prefab: &Handle<RagdollPrefab>,
        model: Arc<Model>,
        collides: bool,
        time: Duration,
    ) -> Result<Self, RagdollError> {
        if collides && model.obstacles.is_none() {
            return Err(RagdollError::NoObstacles { model: model.name.clone() });
        }
        let substeps = (PREFAB_DT / model.opt.timestep).round().max(1.0) as usize;
        let dt = substeps as f64 * model.opt.timestep;
        Ok(CharacterKind {
            character: Character::Prefab(prefab.clone()),
            task_config: TaskConfig::default(),
            ground: Ground::Level,
            collides,
            limbs: Arc::new(Limbs::of(&model, &[])),
            reach: pose::reach(&model),
            model,
            feet: Vec::new(),
            substeps,
            dt,
            period: Duration::from_secs_f64(dt),
            spec: None,
            time,
            batches: Vec::new(),
            unpacked: false,
            entered: 0,
            identity: OnceLock::new(),
        })
    }

    /// Gives a ragdoll a free lane.
    pub fn admit(&mut self, mut slot: Slot) -> Result<(usize, usize), RagdollError> {
        (slot.entered, self.entered) = (self.entered, self.entered + 1);
        let free = |batch: &CharacterBatch| batch.lanes.iter().position(Option::is_none);
        let batch = match self.batches.iter().position(|batch| free(batch).is_some()) {
            Some(batch) => batch,
            None => {
                self.batches.push(CharacterBatch::new(self)?);
                self.batches.len() - 1
            }
        };
        let lane = free(&self.batches[batch]).unwrap_or_default();
        self.batches[batch].admit(lane, slot, self.time);
        Ok((batch, lane))
    }
}
