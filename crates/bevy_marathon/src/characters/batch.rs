//! Sixteen lanes that are stepped together by the physics and the task.

use super::detector::{Decided, Detector};
use super::{CharacterKind, Event, PoseSample, Slot};
use crate::error::RagdollError;
use crate::limbs::Limbs;
use crate::messages::End;
use crate::pose;
use crate::ragdoll::{Character, Controls, Held, Restart};
use bevy::platform::cell::SyncCell;
use bevy::prelude::*;
use marathon_envs::{AgentState, Autoreset, BLOCK, Role, Step, VecEnv, VecEnvOptions};
use marathon_learn::{BlockPolicy, Policy};
use marathon_physics::lanes::Isa;
use marathon_physics::{Batch, BatchOptions, Model, Obstacle, Variation};
use std::sync::Arc;
use std::time::Duration;

/// Steps sixteen ragdolls.
pub(super) enum Engine {
    /// With a task.
    Env(Box<VecEnv>),
    /// Without.
    Free(Box<Batch>, usize),
}

/// Sixteen lanes.
pub(crate) struct CharacterBatch {
    pub(super) engine: SyncCell<Engine>,
    pub lanes: Vec<Option<Slot>>,
    pub(super) model: Arc<Model>,
    pub(super) limbs: Arc<Limbs>,
    detector: Detector,
    pub(super) n_act: usize,
    pub(super) dt: f64,
    roles: Vec<Role>,
    pub(super) obs: Vec<f32>,
    pub(super) action: Vec<f32>,
    /// Their last actions, with which roles go on that do not decide now.
    last: Vec<f32>,
    /// Buffers for a role's observations and actions.
    seen: Vec<f32>,
    scratch: Vec<f32>,
    /// Buffer for the factors of a ragdoll's strength.
    pub(super) factors: Vec<f64>,
    /// The policies of the lanes, each with the number of its role.
    policies: Vec<(usize, BlockPolicy<Arc<Policy>>)>,
    out: Step,
}

impl CharacterBatch {
    /// With sixteen free lanes.
    pub(super) fn new(kind: &CharacterKind) -> Result<Self, RagdollError> {
        let (engine, n_obs, out) = match &kind.character {
            Character::Agent(name) => {
                let (task_config, id) = (&kind.task_config, kind.spec.as_ref().map_or(name, |spec| &spec.id));
                let (registry, options) = kind.ground.registry(id, &task_config.options, kind.collides)?;
                let options = VecEnvOptions { agents: BLOCK, autoreset: Autoreset::Disabled, options, ..default() };
                let mut env = VecEnv::from_registry(&registry, id, &options)?;
                let (n_obs, out) = (env.spec().obs, env.buffers());
                env.reset(None, &mut vec![0.0; n_obs * BLOCK])?;
                (Engine::Env(Box::new(env)), n_obs, out)
            }
            Character::Prefab(_) => {
                let options = BatchOptions { agents: BLOCK, ..default() };
                (Engine::Free(Box::new(Batch::new(&kind.model, &options)?), kind.substeps), 0, Step::default())
            }
        };
        Ok(CharacterBatch {
            engine: SyncCell::new(engine),
            lanes: (0..BLOCK).map(|_| None).collect(),
            model: kind.model.clone(),
            limbs: kind.limbs.clone(),
            detector: Detector::new(&kind.model, kind.spec.as_deref(), &kind.feet, kind.dt),
            n_act: kind.model.nu,
            dt: kind.dt,
            obs: vec![0.0; n_obs * BLOCK],
            action: vec![0.0; kind.model.nu * BLOCK],
            last: vec![0.0; kind.model.nu * BLOCK],
            roles: kind.spec.as_ref().map(|spec| spec.deciders()).unwrap_or_default(),
            seen: Vec::new(),
            scratch: vec![0.0; kind.model.nu * BLOCK],
            factors: vec![1.0; kind.model.nu],
            policies: Vec::new(),
            out,
        })
    }

    /// Whether all lanes are free.
    pub fn is_empty(&self) -> bool {
        self.lanes.iter().all(Option::is_none)
    }

    /// Gives a ragdoll a lane that is free.
    pub(super) fn admit(&mut self, lane: usize, mut slot: Slot, time: Duration) {
        // a free lane has the strength of the model
        slot.factors = vec![1.0; self.n_act];
        if let Engine::Env(env) = self.engine.get() {
            // the lane exists, and so does its agent
            let _ = env.reseed_agent(lane, slot.seed, slot.number as usize);
        }
        slot.begin();
        self.lanes[lane] = Some(slot);
        self.reset(lane);
        self.record(lane, time, true);
    }

    /// Frees a lane.
    pub fn dismiss(&mut self, lane: usize) {
        self.lanes[lane] = None;
        if let (Engine::Env(env), Some(field)) = (self.engine.get(), self.model.hfields.first()) {
            let own: Vec<f32> = field.data.iter().map(|z| (field.size[2] * f64::from(*z)) as f32).collect();
            // the field exists, and so do its points
            let _ = env.set_ground(lane, 0, &own);
        }
        self.vary(lane, &Variation::none(&self.model.clone()));
        self.feel(lane, &[]);
        if let Engine::Env(env) = self.engine.get() {
            // any agent can be given back to its schedule
            let _ = env.set_command(lane, None);
        }
        self.reset(lane);
    }

    /// Sets the command of a ragdoll, or gives it back to its own schedule. A body without a task takes no command.
    pub fn command(&mut self, lane: usize, command: Option<Vec<f64>>) -> Result<(), RagdollError> {
        let told = match self.engine.get() {
            Engine::Env(env) => env.set_command(lane, command.as_deref()).map_err(RagdollError::from),
            Engine::Free(..) if command.is_some() => Err(RagdollError::NoCommand),
            Engine::Free(..) => Ok(()),
        };
        if let Some(slot) = &mut self.lanes[lane] {
            slot.command = command;
        }
        told
    }

    /// Gives a ragdoll ground of its own, over all episodes.
    pub fn lay(&mut self, lane: usize, elevations: &[f32]) -> Result<(), RagdollError> {
        let Engine::Env(env) = self.engine.get() else { return Err(RagdollError::NoGround) };
        env.set_ground(lane, 0, elevations)?;
        if let Some(slot) = &mut self.lanes[lane] {
            slot.grounds = Arc::new(vec![elevations.to_vec()]);
            if let Some(newest) = slot.history.back_mut() {
                newest.grounds = slot.grounds.clone();
            }
        }
        Ok(())
    }

    /// Sets what is around a ragdoll.
    pub fn feel(&mut self, lane: usize, obstacles: &[Obstacle]) {
        if self.model.obstacles.is_none() {
            return;
        }
        match self.engine.get() {
            // the lane exists, and the numbers are checked
            Engine::Env(env) => drop(env.set_obstacles(lane, obstacles)),
            Engine::Free(batch, _) => batch.set_obstacles(lane, obstacles),
        }
    }

    /// Puts a ragdoll into a state.
    pub fn put(&mut self, lane: usize, qpos: &[f64], qvel: &[f64], time: Duration) {
        match self.engine.get() {
            Engine::Env(env) => {
                let state = AgentState { qpos: qpos.to_vec(), qvel: qvel.to_vec() };
                if env.set_state(lane, &state).is_ok() {
                    let mask: [bool; BLOCK] = std::array::from_fn(|i| i == lane);
                    let _ = env.observe(&mask, &mut self.obs);
                }
            }
            Engine::Free(batch, _) => batch.reset(lane, qpos, qvel),
        }
        let sleeps = self.lanes[lane].as_ref().is_some_and(|slot| slot.asleep.is_some());
        let asleep = sleeps.then(|| self.lane_state(lane));
        // what was before it is not on the way there
        if let Some(slot) = &mut self.lanes[lane] {
            slot.history.clear();
            slot.asleep = asleep;
        }
        self.record(lane, time, true);
    }

    /// Starts an episode in a lane.
    fn reset(&mut self, lane: usize) {
        match self.engine.get() {
            Engine::Env(env) => {
                let mask: [bool; BLOCK] = std::array::from_fn(|i| i == lane);
                // lengths are right by construction
                let _ = env.reset_agents(&mask, &mut self.obs);
            }
            Engine::Free(batch, _) => match self.model.keyframes.first() {
                Some(key) => batch.reset(lane, &key.qpos, &key.qvel),
                None => batch.reset(lane, &self.model.qpos0, &vec![0.0; self.model.nv]),
            },
        }
    }

    /// Appends the state of a lane and its command to its history.
    fn record(&mut self, lane: usize, time: Duration, fresh: bool) {
        let grounds = self.grounds(lane);
        let (qpos, qvel, command, reference) = match self.engine.get() {
            Engine::Env(env) => {
                let command = env.context(lane).map(|context| context.command()).unwrap_or_default();
                let reference = env.reference(lane).unwrap_or_default();
                env.state(lane).map(|s| (s.qpos, s.qvel, command, reference)).unwrap_or_default()
            }
            Engine::Free(batch, _) => (batch.qpos(lane), batch.qvel(lane), Vec::new(), None),
        };
        if let Some(slot) = &mut self.lanes[lane] {
            let before = slot.history.back().filter(|_| !fresh);
            let own = before.and_then(|before| pose::own_velocity(&self.model, &before.qpos, &qpos, self.dt));
            slot.episode.own_velocity = own.unwrap_or_default();
            slot.episode.command.clone_from(&command);
            if *slot.grounds != grounds {
                slot.grounds = Arc::new(grounds);
            }
            let action = if fresh { vec![0.0; self.n_act] } else { slot.episode.action.clone() };
            let grounds = slot.grounds.clone();
            slot.history.push_back(PoseSample { time, qpos, qvel, reference, fresh, action, command, grounds });
        }
    }

    /// Makes one decision for all sixteen; `time` is that of the state it leads to.
    pub fn decide(&mut self, time: Duration) {
        self.choose();
        self.strengthen();
        self.shove();
        match self.engine.get() {
            Engine::Env(env) => {
                // lengths are right by construction
                let _ = env.step(&self.action, &mut self.out);
                self.obs.copy_from_slice(&self.out.obs);
            }
            Engine::Free(batch, substeps) => {
                let ctrl: Vec<f64> = self.action.iter().map(|x| f64::from(*x)).collect();
                batch.step(&ctrl, *substeps);
            }
        }
        for lane in 0..BLOCK {
            if self.lanes[lane].as_ref().is_some_and(|slot| slot.asleep.is_some()) {
                continue;
            }
            if self.animate(lane) {
                self.record(lane, time, false);
                continue;
            }
            let fresh = self.judge(lane);
            if fresh {
                self.reset(lane);
            }
            self.record(lane, time, fresh);
        }
    }

    /// Fills in the actions.
    fn choose(&mut self) {
        std::mem::swap(&mut self.action, &mut self.last);
        self.action.fill(0.0);
        let n = self.n_act;
        let CharacterBatch { engine, lanes, roles, policies, obs, seen, action, last, scratch, .. } = self;
        let n_obs = obs.len() / BLOCK;
        let has = |lane: &Option<Slot>, role: usize, policy: &Arc<Policy>| {
            lane.as_ref().and_then(|r| r.policies[role].as_ref()).is_some_and(|own| Arc::ptr_eq(own, policy))
        };
        policies.retain(|(role, acting)| lanes.iter().any(|lane| has(lane, *role, acting.policy())));
        for (role, policy) in lanes.iter().flatten().flat_map(|slot| slot.policies.iter().enumerate()) {
            let Some(policy) = policy else { continue };
            if !policies.iter().any(|(known, acting)| *known == role && Arc::ptr_eq(acting.policy(), policy)) {
                policies.push((role, BlockPolicy::new(policy.clone(), Isa::best())));
            }
        }
        for (number, acting) in policies {
            let Some(role) = roles.get(*number) else { continue };
            seen.clear();
            for row in obs.chunks_exact(n_obs.max(1)) {
                seen.extend_from_slice(&row[role.obs.clone()]);
            }
            // the whole batch at once: most often its lanes share one policy
            let own = role.act.len();
            let mut decides = [true; BLOCK];
            if let Engine::Env(env) = engine.get() {
                // one of its roles, and a place for each of its agents
                let _ = env.decides(*number, &mut decides);
            }
            for (decides, slot) in decides.iter_mut().zip(lanes.iter()) {
                *decides &= !slot.as_ref().is_some_and(Slot::holds);
            }
            if (0..BLOCK).any(|lane| decides[lane] && has(&lanes[lane], *number, acting.policy())) {
                acting.act_rows(seen, None, &mut scratch[..own * BLOCK]);
            }
            for lane in (0..BLOCK).filter(|lane| has(&lanes[*lane], *number, acting.policy())) {
                let of_role = lane * n + role.act.start..lane * n + role.act.end;
                action[of_role.clone()].copy_from_slice(match decides[lane] {
                    true => &scratch[lane * own..(lane + 1) * own],
                    false => &last[of_role],
                });
            }
        }
        for (row, slot) in self.action.chunks_exact_mut(n.max(1)).zip(&mut self.lanes) {
            let Some(slot) = slot else { continue };
            if let Some(Controls(given)) = &slot.controls {
                row.fill(0.0);
                for (a, x) in row.iter_mut().zip(given).filter(|(_, x)| x.is_finite()) {
                    *a = *x;
                }
            }
            if let Some(Held(given)) = &slot.held {
                for (a, x) in row.iter_mut().zip(given) {
                    *a = x.filter(|x| x.is_finite()).unwrap_or(*a);
                }
            }
            if slot.is_limp() {
                row.fill(0.0);
            }
            slot.episode.action.clear();
            slot.episode.action.extend_from_slice(row);
        }
    }

    /// Applies the pushes, or takes away those that are over.
    fn shove(&mut self) {
        let engine = self.engine.get();
        let mut push = |lane, body, force, torque| match engine {
            Engine::Env(env) => drop(env.push(lane, body, force, torque)),
            Engine::Free(batch, _) => batch.push(lane, body, force, torque),
        };
        for (lane, slot) in self.lanes.iter_mut().enumerate() {
            let Some(slot) = slot else { continue };
            let mut bodies: Vec<usize> = slot.pushes.iter().map(|p| p.body).collect();
            bodies.sort_unstable();
            bodies.dedup();
            for body in bodies {
                let (mut force, mut torque) = ([0.0; 3], [0.0; 3]);
                for p in slot.pushes.iter().filter(|p| p.body == body && p.decisions > 0) {
                    (0..3).for_each(|k| {
                        force[k] += p.force[k];
                        torque[k] += p.torque[k];
                    });
                }
                push(lane, body, force, torque);
            }
            slot.pushes.retain_mut(|p| {
                let lasts = p.decisions > 0;
                p.decisions = p.decisions.saturating_sub(1);
                lasts
            });
        }
    }

    /// Finds the events of a decision after which these feet are on the ground.
    fn detect(&mut self, lane: usize, feet: u32, failed: bool) {
        let engine = self.engine.get();
        let Some(slot) = &mut self.lanes[lane] else { return };
        let acts = !slot.is_limp();
        let Some(before) = slot.history.back() else { return };
        let after = || match &engine {
            Engine::Env(env) => env.state(lane).unwrap_or_else(|_| AgentState { qpos: Vec::new(), qvel: Vec::new() }),
            Engine::Free(batch, _) => AgentState { qpos: batch.qpos(lane), qvel: batch.qvel(lane) },
        };
        let n = self.out.info.len() / BLOCK;
        let gravity = slot.physique.as_ref().map_or(self.model.opt.gravity, |own| own.gravity);
        let decided = Decided {
            before: [&before.qpos, &before.qvel],
            after: &after,
            feet: [slot.episode.feet, feet],
            info: &self.out.info[lane * n..(lane + 1) * n],
            command: &slot.episode.command,
            gravity: gravity[2],
            acts,
            first: slot.episode.decisions == 0 || slot.revived,
            failed,
        };
        self.detector.detect(&mut slot.progress, &decided, &mut slot.events);
        slot.revived = false;
    }

    /// Takes in what a decision led to. Returns whether a new episode begins.
    fn judge(&mut self, lane: usize) -> bool {
        let agent = matches!(self.engine.get(), Engine::Env(_));
        let feet = match self.engine.get() {
            Engine::Env(env) => env.feet(lane).unwrap_or_default(),
            Engine::Free(..) => 0,
        };
        let (terminated, truncated, diverged) = match agent {
            true => (self.out.terminated[lane], self.out.truncated[lane], self.out.diverged[lane]),
            false => (false, false, false),
        };
        if !diverged {
            self.detect(lane, feet, terminated);
        }
        let out = &self.out;
        let Some(slot) = &mut self.lanes[lane] else { return terminated || truncated || diverged };
        let asked = slot.begin_now;
        slot.episode.feet = feet;
        if let Some(rest) = &mut slot.lying {
            *rest = rest.saturating_sub(1);
        }
        if slot.is_limp() {
            let up = slot.lying == Some(0) || diverged || asked;
            if up {
                slot.begin();
            }
            return up;
        }
        let Restart { after_fall, on_time_up } = slot.restart;
        let episode = &mut slot.episode;
        episode.untimed |= !on_time_up;
        episode.decisions += 1;
        episode.seconds = episode.decisions as f64 * self.dt;
        if agent {
            let n = out.terms.len() / BLOCK;
            episode.reward = out.reward[lane];
            episode.total += f64::from(out.reward[lane]);
            episode.terms.clear();
            episode.terms.extend_from_slice(&out.terms[lane * n..(lane + 1) * n]);
            let n = out.info.len() / BLOCK;
            episode.info.clear();
            episode.info.extend_from_slice(&out.info[lane * n..(lane + 1) * n]);
            episode.distance += f64::from(out.forward[lane]);
            episode.farthest = episode.farthest.max(episode.distance);
            episode.speed = out.forward[lane] / self.dt as f32;
        }
        let end = match () {
            () if diverged => End::Broke,
            () if terminated => End::Fell,
            () if truncated && !episode.untimed => End::TimeUp,
            () if asked => End::Asked,
            () => return false,
        };
        slot.events.push(Event::Ended(end, slot.episode.clone()));
        if end == End::Fell && after_fall > 0.0 {
            slot.episode.down = true;
            // an infinite time is the longest there is
            slot.lying = Some((after_fall / self.dt).ceil() as u64);
            return false;
        }
        slot.begin();
        true
    }
}
