//! The simulation behind the ragdolls: pens of sixteen, stepped together in the lanes of the physics.
//!
//! A ragdoll sits in a lane of a pen of its kind. Which lane, and who sits beside it, does not touch its bits. Every
//! kind has its own clock, ahead of the game's by at most one decision, so that a frame always lies between two states.

mod pen;
mod resident;

pub(crate) use pen::Pen;
pub(crate) use resident::{Event, Resident, Shove, Still};

use crate::asset::RagdollPrefab;
use crate::ground::Ground;
use crate::ragdoll::Character;
use bevy::prelude::*;
use marathon_envs::{EnvError, Spec};
use marathon_physics::Model;
use marathon_physics::lanes::Isa;
use marathon_runs::{RunError, Setting};
use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;

/// Seconds that a prefab is simulated for at a time, about.
const PREFAB_DT: f64 = 0.01;

/// Why a character cannot be simulated, or told what to do.
#[derive(Debug, Error)]
pub(crate) enum HerdError {
    #[error(transparent)]
    Env(#[from] EnvError),
    #[error(transparent)]
    Setting(#[from] RunError),
    #[error(transparent)]
    Sim(#[from] marathon_physics::SimError),
    #[error("a body without a task takes no command")]
    Command,
    #[error("a body without a task has no ground of its own")]
    Ground,
}

/// A task as the policy of its role number `role` knows it. The first role's may be that of the task in which one has it all.
pub(crate) fn part_of(spec: &Spec, role: usize) -> Option<Spec> {
    let part = spec.of_role(spec.deciders().get(role)?);
    Some(if role == 0 { Spec { id: spec.id.clone(), ..part } } else { part })
}

/// All ragdolls of one kind.
pub(crate) struct Herd {
    pub character: Character,
    /// The task of an agent.
    pub setting: Setting,
    pub ground: Ground,
    pub model: Arc<Model>,
    pub spec: Option<Arc<Spec>>,
    pub feet: Vec<Arc<str>>,
    /// Physics steps per decision.
    substeps: usize,
    pub dt: f64,
    /// Time between decisions.
    pub period: Duration,
    /// Time of the newest states.
    pub time: Duration,
    pub pens: Vec<Pen>,
}

impl Herd {
    /// A herd of an agent of the registry, in a task of its, on a ground, without ragdolls yet.
    pub fn of_agent(name: &str, setting: &Setting, ground: Ground, time: Duration) -> Result<Self, HerdError> {
        setting.with_clips(|| {
            let agent = ground.agent_with(&setting.agent, &setting.options)?;
            let spec = agent.clone().shards(Isa::best())?.spec().clone();
            Ok(Herd {
                character: Character::Agent(name.into()),
                setting: setting.clone(),
                ground,
                model: Arc::new(agent.model()?),
                feet: agent.facts().feet.iter().map(|n| Arc::from(n.as_str())).collect(),
                substeps: spec.frame_skip,
                dt: spec.dt,
                period: Duration::from_secs_f64(spec.dt),
                spec: Some(Arc::new(spec)),
                time,
                pens: Vec::new(),
            })
        })
    }

    /// A herd of a body, without ragdolls yet.
    pub fn of_prefab(prefab: &Handle<RagdollPrefab>, model: Arc<Model>, time: Duration) -> Self {
        let substeps = (PREFAB_DT / model.opt.timestep).round().max(1.0) as usize;
        let dt = substeps as f64 * model.opt.timestep;
        Herd {
            character: Character::Prefab(prefab.clone()),
            setting: Setting::default(),
            ground: Ground::Level,
            model,
            feet: Vec::new(),
            substeps,
            dt,
            period: Duration::from_secs_f64(dt),
            spec: None,
            time,
            pens: Vec::new(),
        }
    }

    /// Gives a ragdoll a free lane.
    pub fn admit(&mut self, resident: Resident) -> Result<(usize, usize), HerdError> {
        let free = |pen: &Pen| pen.lanes.iter().position(Option::is_none);
        let pen = match self.pens.iter().position(|pen| free(pen).is_some()) {
            Some(pen) => pen,
            None => {
                self.pens.push(Pen::new(self)?);
                self.pens.len() - 1
            }
        };
        let lane = free(&self.pens[pen]).unwrap_or_default();
        self.pens[pen].admit(lane, resident, self.time);
        Ok((pen, lane))
    }
}
