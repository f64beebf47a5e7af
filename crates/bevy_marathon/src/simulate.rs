//! The systems between Bevy's world and the simulation.

use crate::asset::{PolicyAsset, RagdollPrefab};
use crate::axes::{to_game, to_physics, yaw_of};
use crate::characters::{CharacterBatch, CharacterKind, Shove, Slot, spec_of_role};
use crate::command::AgentCommand;
use crate::error::RagdollError;
use crate::ground::Ground;
use crate::lod::Lod;
use crate::marathon::{Marathon, RagdollState};
use crate::messages::{EpisodeBegan, Push, RestartNow, TargetReached};
use crate::obstacle::Collides;
use crate::place::CharacterPose;
use crate::pose;
use crate::ragdoll::{
    Anatomy, Character, CharacterPolicy, Controls, Episode, Held, LaidGround, Opponent, Part, Physique, Ragdoll,
    Restart, Target, Unfit,
};
use crate::strength::LimbStrength;
use crate::track::{Track, Tracks};
use bevy::asset::LoadState;
use bevy::ecs::lifecycle::Remove;
use bevy::prelude::*;
use bevy::tasks::ComputeTaskPool;
use marathon_learn::PolicyMeta;
use marathon_physics::{Model, Variation};
use marathon_render::Scene;
use marathon_runs::{RunError, TaskConfig};
use std::sync::Arc;
use std::time::Instant;

/// New ragdolls enter the simulation.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
pub(crate) fn admit(
    mut commands: Commands,
    mut marathon: ResMut<Marathon>,
    time: Res<Time<Fixed>>,
    prefabs: Res<Assets<RagdollPrefab>>,
    (policies, server): (Res<Assets<PolicyAsset>>, Res<AssetServer>),
    new: Query<
        (
            Entity,
            &Ragdoll,
            (&Restart, &Collides, &Transform),
            &LimbStrength,
            Option<&CharacterPolicy>,
            Option<&AgentCommand>,
        ),
        (Without<RagdollState>, Without<Unfit>),
    >,
) {
    // the tick that begins here shows times from `now` on; its elapsed time is that of its end
    marathon.now = time.elapsed();
    for (entity, ragdoll, (restart, collides, transform), strength, policy, command) in &new {
        let meta = policy.and_then(|policy| policies.get(&policy.0)).map(|asset| asset.0.meta());
        let loads = |policy: &CharacterPolicy| matches!(server.load_state(&policy.0), LoadState::Loading);
        if ragdoll.task_config.is_none() && meta.is_none() && policy.is_some_and(loads) {
            continue;
        }
        match enter(&mut marathon, &prefabs, ragdoll, meta, (*restart, collides.any())) {
            Ok(Some(key)) => {
                let kind = &marathon.kinds[key.kind];
                let mut entity = commands.entity(entity);
                entity.insert((strength.with_limbs(&kind.limbs), Track::at(*transform)));
                build(&mut entity, kind, key, command);
            }
            // a prefab that is still being loaded
            Ok(None) => {}
            Err(error) => {
                error!("a ragdoll cannot be simulated: {error}");
                commands.entity(entity).insert(Unfit(Arc::new(error)));
            }
        }
    }
}

fn enter(
    marathon: &mut Marathon,
    prefabs: &Assets<RagdollPrefab>,
    ragdoll: &Ragdoll,
    policy: Option<&PolicyMeta>,
    (restart, collides): (Restart, bool),
) -> Result<Option<RagdollState>, RagdollError> {
    let now = marathon.now;
    let ground = match ragdoll.character {
        Character::Agent(_) => ragdoll.ground,
        Character::Prefab(_) => Ground::Level,
    };
    let task_config = task_config(ragdoll, policy)?;
    let same = |h: &CharacterKind| {
        (&h.character, h.ground, h.collides) == (&ragdoll.character, ground, collides) && h.task_config == task_config
    };
    let number = match marathon.kinds.iter().position(same) {
        Some(number) => number,
        None => {
            let kind = match &ragdoll.character {
                Character::Agent(name) => CharacterKind::of_agent(name, &task_config, (ground, collides), now)?,
                Character::Prefab(handle) => match prefabs.get(handle) {
                    Some(prefab) => CharacterKind::of_prefab(handle, prefab.model.clone(), collides, now)?,
                    None => return Ok(None),
                },
            };
            marathon.kinds.push(kind);
            marathon.kinds.len() - 1
        }
    };
    let kind = &mut marathon.kinds[number];
    // the clock of a kind without characters has stopped
    if kind.batches.iter().all(CharacterBatch::is_empty) {
        kind.time = now;
    }
    let slot = Slot::new((ragdoll.seed, ragdoll.number), restart);
    let (batch, lane) = kind.admit(slot)?;
    Ok(Some(RagdollState { kind: number, batch, lane }))
}

/// The task of a ragdoll: its own, or else that of its policy, or else that of its agent's defaults.
fn task_config(ragdoll: &Ragdoll, policy: Option<&PolicyMeta>) -> Result<TaskConfig, RunError> {
    let Character::Agent(name) = &ragdoll.character else { return Ok(TaskConfig::default()) };
    if let Some(task_config) = &ragdoll.task_config {
        return Ok(task_config.clone());
    }
    let named = TaskConfig::named(name)?;
    // a policy for another agent is refused later
    Ok(policy.map(TaskConfig::of_policy).filter(|noted| noted.agent == named.agent).unwrap_or(named))
}

/// Makes the entities of a ragdoll's bodies, and its command if its agent takes one.
fn build(entity: &mut EntityCommands, kind: &CharacterKind, key: RagdollState, command: Option<&AgentCommand>) {
    let ragdoll = entity.id();
    let parts = pose::spawn_parts(entity.commands_mut(), &kind.model, ragdoll);
    let anatomy =
        Anatomy { model: kind.model.clone(), spec: kind.spec.clone(), parts, feet: kind.feet.clone(), dt: kind.dt };
    entity.insert((key, anatomy, CharacterPose::default()));
    let ranges = kind.spec.as_ref().map_or(&[][..], |spec| &spec.command);
    // a command that was spawned with the ragdoll is kept if it is one of this task
    if !ranges.is_empty() && command.is_none_or(|command| command.ranges() != ranges) {
        if command.is_some_and(|command| command.values().is_some()) {
            error!("an AgentCommand has other ranges than the task of its ragdoll, which follows its own schedule");
        }
        entity.insert(AgentCommand::new(ranges));
    }
}

/// A ragdoll that is despawned leaves its lane.
pub(crate) fn dismiss(left: On<Remove, RagdollState>, keys: Query<&RagdollState>, mut marathon: ResMut<Marathon>) {
    if let Ok(key) = keys.get(left.entity)
        && let Some(batch) = marathon.batch(*key)
    {
        batch.dismiss(key.lane);
    }
}

/// Takes in what has changed about the ragdolls.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
pub(crate) fn take_in(
    mut marathon: ResMut<Marathon>,
    policies: Res<Assets<PolicyAsset>>,
    ragdolls: Query<(
        &RagdollState,
        &Anatomy,
        (Option<&CharacterPolicy>, Option<&Opponent>),
        (Option<&Controls>, Option<&Held>),
        Option<&AgentCommand>,
        (Ref<Restart>, &Lod),
        Option<Ref<Physique>>,
        Option<Ref<LaidGround>>,
    )>,
) {
    for (key, anatomy, (policy, opponent), (controls, held), command, (restart, lod), physique, laid) in &ragdolls {
        let woken = marathon.kinds.get_mut(key.kind).is_some_and(|kind| kind.set_lod((key.batch, key.lane), *lod));
        // what changes meanwhile is taken in when it wakes up
        if *lod == Lod::Asleep {
            continue;
        }
        let Some(batch) = marathon.batch(*key) else { continue };
        if let Some(LaidGround(elevations)) = laid.filter(|laid| woken || laid.is_changed()).as_deref()
            && let Err(error) = batch.lay(key.lane, elevations)
        {
            error!("a LaidGround cannot be laid: {error}");
        }
        let wanted = command.and_then(AgentCommand::values);
        if batch.lanes[key.lane].as_ref().is_some_and(|slot| slot.command.as_deref() != wanted)
            && let Err(error) = batch.command(key.lane, wanted.map(<[f64]>::to_vec))
        {
            error!("an AgentCommand cannot be followed: {error}");
        }
        let Some(slot) = &mut batch.lanes[key.lane] else { continue };
        if let Some(physique) = physique.filter(|p| woken || p.is_changed())
            && fits_model(&physique.0, &anatomy.model)
        {
            (slot.physique, slot.physique_changed) = (Some(physique.0.clone()), true);
        }
        slot.restart = *restart;
        slot.controls = controls.cloned();
        slot.held = held.cloned();
        let handles = [policy.map(|policy| &policy.0), opponent.map(|opponent| &opponent.0)];
        for (role, handle) in handles.into_iter().enumerate() {
            let wanted = handle.and_then(|handle| policies.get(handle));
            let same = match (&slot.policies[role], wanted) {
                (Some(old), Some(new)) => Arc::ptr_eq(old, &new.0),
                (None, None) => true,
                _ => false,
            };
            if !same {
                let fitting = wanted.map(|p| p.0.clone()).filter(|policy| fits(policy, anatomy, role));
                slot.policies[role] = fitting;
            }
        }
    }
}

fn fits(policy: &marathon_learn::Policy, anatomy: &Anatomy, role: usize) -> bool {
    let Some(spec) = &anatomy.spec else {
        error_once!(
            "a CharacterPolicy was given to a ragdoll that is no agent; it observes nothing that a policy could act on"
        );
        return false;
    };
    let Some(part) = spec_of_role(spec, role) else {
        error_once!("an Opponent was given to '{}', whose task has one role alone", spec.id);
        return false;
    };
    match policy.check(&part) {
        Ok(()) => true,
        Err(error) => {
            error_once!("a policy does not fit '{}': {error}", part.id);
            false
        }
    }
}

/// Whether a ragdoll of a model can have these constants.
fn fits_model(v: &Variation, model: &Model) -> bool {
    let (masses, strengths) = (v.mass.len(), v.strength.len());
    if masses != model.bodies.len() || strengths != model.nu {
        let (bodies, motors) = (model.bodies.len(), model.nu);
        error!("a Physique has {masses} masses and {strengths} strengths, expected {bodies} and {motors}");
        return false;
    }
    if let Some((name, found, expected)) = v.out_of_range() {
        error!("a Physique has a {name} of {found}, expected {expected}");
        return false;
    }
    true
}

/// Takes in pushes and restarts.
pub(crate) fn push(
    mut marathon: ResMut<Marathon>,
    mut pushes: MessageReader<Push>,
    mut restarts: MessageReader<RestartNow>,
    ragdolls: Query<(&RagdollState, &Anatomy)>,
    tracks: Tracks,
) {
    for push in pushes.read() {
        let Ok((key, anatomy)) = ragdolls.get(push.ragdoll) else { continue };
        let Some(track) = tracks.get(push.ragdoll) else { continue };
        if push.body == 0 || push.body >= anatomy.model.bodies.len() || !push.force.is_finite() {
            continue;
        }
        let inverse = track.affine().inverse();
        let force = to_physics(inverse.transform_vector3(push.force));
        let torque = match push.at.filter(|at| at.is_finite()) {
            Some(at) => {
                let at = to_physics(inverse.transform_point3(at));
                let Some(com) = center_of_mass(&marathon, *key, anatomy, push.body) else { continue };
                let arm: [f64; 3] = std::array::from_fn(|k| at[k] - com[k]);
                std::array::from_fn(|k| arm[(k + 1) % 3] * force[(k + 2) % 3] - arm[(k + 2) % 3] * force[(k + 1) % 3])
            }
            None => [0.0; 3],
        };
        let decisions = (push.seconds / anatomy.dt).round().max(1.0) as u64;
        let impulse = force.map(|x| x * decisions as f64 * anatomy.dt);
        let limbs = marathon.kinds[key.kind].limbs.clone();
        if let Some(slot) = marathon.slot_mut(*key).filter(|slot| slot.asleep.is_none()) {
            slot.push(Shove { body: push.body, force, torque, decisions, impulse }, &limbs, anatomy.dt);
        }
    }
    for restart in restarts.read() {
        if let Ok((key, ..)) = ragdolls.get(restart.ragdoll)
            && let Some(slot) = marathon.slot_mut(*key)
        {
            slot.begin_now();
        }
    }
}

/// Center of mass of a body in the axes of the physics.
fn center_of_mass(marathon: &Marathon, key: RagdollState, anatomy: &Anatomy, body: usize) -> Option<[f64; 3]> {
    let sample = marathon.slot(key)?.history.back()?;
    let frame = *pose::places(&anatomy.model, &sample.qpos)?.get(body)?;
    Some(to_physics(frame.transform_point(to_game(anatomy.model.bodies[body].ipos))))
}

/// Makes the decisions that are due, so that every state that a frame of this tick can show is there.
pub(crate) fn simulate(mut marathon: ResMut<Marathon>, time: Res<Time<Fixed>>) {
    let (now, began) = (marathon.now, Instant::now());
    let until = now + time.timestep();
    let mut decisions = 0;
    let pool = ComputeTaskPool::get();
    pool.scope(|scope| {
        for kind in &mut marathon.kinds {
            let (first, period) = (kind.time, kind.period);
            if period.is_zero() || kind.batches.iter().all(CharacterBatch::is_empty) {
                continue;
            }
            let due = until.saturating_sub(first).as_nanos().div_ceil(period.as_nanos()) as u32;
            kind.time += period * due;
            let lanes = kind.batches.iter().flat_map(|batch| &batch.lanes).flatten();
            let lanes = lanes.filter(|slot| slot.asleep.is_none()).count();
            decisions += u64::from(due) * lanes as u64;
            for batch in kind.batches.iter_mut().filter(|batch| batch.has_awake()) {
                scope.spawn(async move {
                    for decision in 1..=due {
                        batch.decide(first + period * decision);
                    }
                    batch.lanes.iter_mut().flatten().for_each(|slot| slot.forget(now));
                });
            }
        }
    });
    marathon.decisions += decisions;
    marathon.spent += began.elapsed();
}

/// Turns ragdolls towards their targets as they begin, and tells who has arrived.
pub(crate) fn face_targets(
    marathon: Res<Marathon>,
    mut began: MessageReader<EpisodeBegan>,
    mut reached: MessageWriter<TargetReached>,
    mut arrived: Local<Vec<(Entity, u64)>>,
    mut ragdolls: Query<(Entity, &RagdollState, &Anatomy, &Target, &Episode, &mut Track)>,
) {
    for event in began.read() {
        if let Ok((.., target, _, mut track)) = ragdolls.get_mut(event.ragdoll) {
            let way = (target.place - track.place().translation) * Vec3::new(1.0, 0.0, 1.0);
            if let Some(way) = way.try_normalize() {
                track.face(Quat::from_rotation_y(yaw_of(way)));
            }
        }
    }
    for (entity, key, anatomy, target, episode, track) in &ragdolls {
        if arrived.contains(&(entity, episode.number)) {
            continue;
        }
        let Some(sample) = marathon.slot(*key).and_then(|r| r.history.back()) else { continue };
        let Ok(pose) = Scene::pose_from_qpos(&anatomy.model, &sample.qpos) else { continue };
        let place = track.place().transform_point(to_game(pose.com));
        if (place - target.place).xz().length() <= target.radius {
            arrived.retain(|(known, _)| *known != entity);
            arrived.push((entity, episode.number));
            reached.write(TargetReached { ragdoll: entity, target: *target });
        }
    }
}

/// Writes the transforms of all parts at the time that a frame shows.
pub(crate) fn show(
    marathon: Res<Marathon>,
    time: Res<Time<Fixed>>,
    ragdolls: Query<(&RagdollState, &Anatomy, &Track)>,
    mut parts: Query<&mut Transform, With<Part>>,
) {
    let now = time.elapsed() + time.overstep();
    for (ragdoll, anatomy, track) in &ragdolls {
        pose::put(anatomy, track, marathon.places(ragdoll, now), &mut parts);
    }
}
