//! The systems between the game's world and the simulation.

use crate::asset::{PolicyAsset, RagdollPrefab};
use crate::axes::{to_game, to_physics};
use crate::ground::Ground;
use crate::herd::{Event, Herd, Pen, Resident, Shove, part_of};
use crate::ragdoll::Episode;
use crate::ragdoll::{
    AgentCommand, Anatomy, Character, Controls, EpisodeBegan, EpisodeEnded, FootContact, Held, LaidGround, Opponent,
    OwnGround, Part, Physique, Policy, Push, Ragdoll, Restart, RestartNow, Target, TargetReached, Unfit,
};
use crate::stage;
use bevy::asset::LoadState;
use bevy::ecs::lifecycle::Remove;
use bevy::prelude::*;
use bevy::tasks::ComputeTaskPool;
use marathon_envs::AgentState;
use marathon_learn::PolicyMeta;
use marathon_render::Scene;
use marathon_runs::{RunError, Setting};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The simulation of all ragdolls.
#[derive(Resource, Default)]
pub struct Marathon {
    pub(crate) herds: Vec<Herd>,
    /// Start of the present tick.
    now: Duration,
    decisions: u64,
    spent: Duration,
}

/// Where a ragdoll lives in [`Marathon`].
#[derive(Component, Clone, Copy, Debug)]
pub(crate) struct Seat {
    pub herd: usize,
    pub pen: usize,
    pub lane: usize,
}

impl Marathon {
    /// Decisions that all ragdolls together have made.
    pub fn decisions(&self) -> u64 {
        self.decisions
    }

    /// Time that deciding and stepping have taken.
    pub fn spent(&self) -> Duration {
        self.spent
    }

    /// The newest state of a ragdoll, which is ahead of what a frame shows by up to a decision.
    pub fn state(&self, ragdoll: &RagdollState) -> Option<AgentState> {
        let still = self.resident(ragdoll.0)?.trail.back()?;
        Some(AgentState { qpos: still.qpos.clone(), qvel: still.qvel.clone() })
    }

    /// Where the bodies of a ragdoll are at a time, in the order of its model, relative to the ragdoll. Known are the times
    /// that a frame of the present tick can show: from `Time<Fixed>::elapsed` on, for a timestep.
    ///
    /// Systems in [`FixedUpdate`] that follow a ragdoll ask here: the transforms of its [`crate::Part`]s are those of the last
    /// frame, in which there may have been many ticks or none.
    pub fn places(&self, ragdoll: &RagdollState, at: Duration) -> Option<Vec<Transform>> {
        let Seat { herd, .. } = ragdoll.0;
        let model = &self.herds.get(herd)?.model;
        let (a, b, share) = self.resident(ragdoll.0)?.between(at)?;
        stage::places(model, &stage::mix(model, &a.qpos, &b.qpos, share))
    }

    /// Where the clip that a ragdoll follows has the bodies at a time, as [`Marathon::places`] has them. `None` if its task
    /// follows no clip.
    pub fn clip_places(&self, ragdoll: &RagdollState, at: Duration) -> Option<Vec<Transform>> {
        let Seat { herd, .. } = ragdoll.0;
        let model = &self.herds.get(herd)?.model;
        let (a, b, share) = self.resident(ragdoll.0)?.between(at)?;
        stage::places(model, &stage::mix(model, a.reference.as_ref()?, b.reference.as_ref()?, share))
    }

    /// Puts a ragdoll into a state.
    ///
    /// # Errors
    /// If lengths or numbers do not fit its model; the text says which.
    pub fn set_state(&mut self, ragdoll: &RagdollState, state: &AgentState) -> Result<(), String> {
        let Seat { herd, pen, lane } = ragdoll.0;
        let Some(herd) = self.herds.get_mut(herd) else { return Ok(()) };
        for (what, given, expected) in [("qpos", &state.qpos, herd.model.nq), ("qvel", &state.qvel, herd.model.nv)] {
            if given.len() != expected {
                return Err(format!("{what} has {} numbers, expected {expected}", given.len()));
            }
            if let Some(x) = given.iter().find(|x| !x.is_finite()) {
                return Err(format!("{what} has a number that is {x}, expected finite ones"));
            }
        }
        let time = herd.time;
        if let Some(pen) = herd.pens.get_mut(pen) {
            pen.put(lane, &state.qpos, &state.qvel, time);
        }
        Ok(())
    }

    pub(crate) fn resident(&self, seat: Seat) -> Option<&Resident> {
        self.herds.get(seat.herd)?.pens.get(seat.pen)?.lanes.get(seat.lane)?.as_ref()
    }

    fn pen(&mut self, seat: Seat) -> Option<&mut Pen> {
        self.herds.get_mut(seat.herd)?.pens.get_mut(seat.pen)
    }

    fn resident_mut(&mut self, seat: Seat) -> Option<&mut Resident> {
        self.pen(seat)?.lanes.get_mut(seat.lane)?.as_mut()
    }
}

/// Key to a ragdoll's state in [`Marathon`]. Added to every ragdoll that has entered the simulation.
#[derive(Component, Clone, Copy, Debug)]
pub struct RagdollState(pub(crate) Seat);

/// New ragdolls enter the simulation.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
pub(crate) fn admit(
    mut commands: Commands,
    mut marathon: ResMut<Marathon>,
    time: Res<Time<Fixed>>,
    prefabs: Res<Assets<RagdollPrefab>>,
    (policies, server): (Res<Assets<PolicyAsset>>, Res<AssetServer>),
    new: Query<(Entity, &Ragdoll, &Restart, Option<&Policy>), (Without<Seat>, Without<Unfit>)>,
) {
    // the tick that begins here shows times from `now` on; its elapsed time is that of its end
    marathon.now = time.elapsed();
    for (entity, ragdoll, restart, policy) in &new {
        let meta = policy.and_then(|policy| policies.get(&policy.0)).map(|asset| asset.0.meta());
        let loads = |policy: &Policy| matches!(server.load_state(&policy.0), LoadState::Loading);
        if ragdoll.setting.is_none() && meta.is_none() && policy.is_some_and(loads) {
            continue;
        }
        match enter(&mut marathon, &prefabs, ragdoll, meta, *restart) {
            Ok(Some(seat)) => build(&mut commands, &marathon.herds[seat.herd], entity, seat),
            // a prefab that is still being loaded
            Ok(None) => {}
            Err(error) => {
                error!("a ragdoll cannot be simulated: {error}");
                commands.entity(entity).insert(Unfit(error));
            }
        }
    }
}

fn enter(
    marathon: &mut Marathon,
    prefabs: &Assets<RagdollPrefab>,
    ragdoll: &Ragdoll,
    policy: Option<&PolicyMeta>,
    restart: Restart,
) -> Result<Option<Seat>, String> {
    let now = marathon.now;
    let ground = match ragdoll.character {
        Character::Agent(_) => ragdoll.ground,
        Character::Prefab(_) => Ground::Level,
    };
    let setting = setting(ragdoll, policy).map_err(|e| e.to_string())?;
    let same = |h: &Herd| h.character == ragdoll.character && h.ground == ground && h.setting == setting;
    let herd = match marathon.herds.iter().position(same) {
        Some(herd) => herd,
        None => {
            let herd = match &ragdoll.character {
                Character::Agent(name) => Herd::of_agent(name, &setting, ground, now).map_err(|e| e.to_string())?,
                Character::Prefab(handle) => match prefabs.get(handle) {
                    Some(prefab) => Herd::of_prefab(handle, prefab.model.clone(), now),
                    None => return Ok(None),
                },
            };
            marathon.herds.push(herd);
            marathon.herds.len() - 1
        }
    };
    let kind = &mut marathon.herds[herd];
    // a herd that nobody lived in has stood still
    if kind.pens.iter().all(Pen::is_empty) {
        kind.time = now;
    }
    let resident = Resident::new((ragdoll.seed, ragdoll.number), restart);
    let (pen, lane) = kind.admit(resident).map_err(|e| e.to_string())?;
    Ok(Some(Seat { herd, pen, lane }))
}

/// The task of a ragdoll: its own, or else that of its policy, or else that of its agent's defaults.
fn setting(ragdoll: &Ragdoll, policy: Option<&PolicyMeta>) -> Result<Setting, RunError> {
    let Character::Agent(name) = &ragdoll.character else { return Ok(Setting::default()) };
    if let Some(setting) = &ragdoll.setting {
        return Ok(setting.clone());
    }
    let named = Setting::named(name)?;
    // a policy for another agent is refused later
    Ok(policy.map(Setting::of).filter(|noted| noted.agent == named.agent).unwrap_or(named))
}

/// Makes the entities of a ragdoll's bodies.
fn build(commands: &mut Commands, herd: &Herd, entity: Entity, seat: Seat) {
    let parts = stage::parts(commands, &herd.model, entity);
    let anatomy =
        Anatomy { model: herd.model.clone(), spec: herd.spec.clone(), parts, feet: herd.feet.clone(), dt: herd.dt };
    commands.entity(entity).insert((seat, RagdollState(seat), anatomy));
}

/// A ragdoll that is despawned leaves its lane.
pub(crate) fn dismiss(left: On<Remove, Seat>, seats: Query<&Seat>, mut marathon: ResMut<Marathon>) {
    if let Ok(seat) = seats.get(left.entity)
        && let Some(pen) = marathon.pen(*seat)
    {
        pen.dismiss(seat.lane);
    }
}

/// Takes in what has changed about the ragdolls.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
pub(crate) fn take_in(
    mut marathon: ResMut<Marathon>,
    policies: Res<Assets<PolicyAsset>>,
    ragdolls: Query<(
        &Seat,
        &Anatomy,
        (Option<&Policy>, Option<&Opponent>),
        (Option<&Controls>, Option<&Held>),
        Option<&AgentCommand>,
        Ref<Restart>,
        Option<Ref<Physique>>,
        Option<Ref<LaidGround>>,
    )>,
) {
    for (seat, anatomy, (policy, opponent), (controls, held), command, restart, physique, laid) in &ragdolls {
        let Some(pen) = marathon.pen(*seat) else { continue };
        if let Some(LaidGround(elevations)) = laid.filter(|laid| laid.is_changed()).as_deref()
            && let Err(error) = pen.lay(seat.lane, elevations)
        {
            error!("a LaidGround cannot be laid: {error}");
        }
        let wanted = command.and_then(|command| command.0.as_ref());
        if pen.lanes[seat.lane].as_ref().is_some_and(|resident| resident.command.as_ref() != wanted)
            && let Err(error) = pen.command(seat.lane, wanted.cloned())
        {
            error!("an AgentCommand cannot be followed: {error}");
        }
        if let Some(physique) = physique.filter(|p| p.is_changed()) {
            let (v, model) = (&physique.0, &anatomy.model);
            if v.mass.len() == model.bodies.len() && v.strength.len() == model.nu {
                pen.vary(seat.lane, v);
            } else {
                let (masses, strengths) = (v.mass.len(), v.strength.len());
                error!(
                    "a Physique has {masses} masses and {strengths} strengths, expected {} and {}",
                    model.bodies.len(),
                    model.nu
                );
            }
        }
        let Some(resident) = &mut pen.lanes[seat.lane] else { continue };
        resident.restart = *restart;
        resident.controls = controls.cloned();
        resident.held = held.cloned();
        let handles = [policy.map(|policy| &policy.0), opponent.map(|opponent| &opponent.0)];
        for (role, handle) in handles.into_iter().enumerate() {
            let wanted = handle.and_then(|handle| policies.get(handle));
            let same = match (&resident.policies[role], wanted) {
                (Some(old), Some(new)) => Arc::ptr_eq(old, &new.0),
                (None, None) => true,
                _ => false,
            };
            if !same {
                let fitting = wanted.map(|p| p.0.clone()).filter(|policy| fits(policy, anatomy, role));
                resident.policies[role] = fitting;
            }
        }
    }
}

fn fits(policy: &marathon_learn::Policy, anatomy: &Anatomy, role: usize) -> bool {
    let Some(spec) = &anatomy.spec else {
        error_once!("a Policy was given to a ragdoll that is no agent; it observes nothing that a policy could act on");
        return false;
    };
    let Some(part) = part_of(spec, role) else {
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

/// Takes in pushes and restarts.
pub(crate) fn push(
    mut marathon: ResMut<Marathon>,
    mut pushes: MessageReader<Push>,
    mut restarts: MessageReader<RestartNow>,
    ragdolls: Query<(&Seat, &Anatomy, &GlobalTransform)>,
) {
    for push in pushes.read() {
        let Ok((seat, anatomy, track)) = ragdolls.get(push.ragdoll) else { continue };
        if push.body == 0 || push.body >= anatomy.model.bodies.len() || !push.force.is_finite() {
            continue;
        }
        let inverse = track.affine().inverse();
        let force = to_physics(inverse.transform_vector3(push.force));
        let torque = match push.at.filter(|at| at.is_finite()) {
            Some(at) => {
                let at = to_physics(inverse.transform_point3(at));
                let Some(com) = center_of_mass(&marathon, *seat, anatomy, push.body) else { continue };
                let arm: [f64; 3] = std::array::from_fn(|k| at[k] - com[k]);
                std::array::from_fn(|k| arm[(k + 1) % 3] * force[(k + 2) % 3] - arm[(k + 2) % 3] * force[(k + 1) % 3])
            }
            None => [0.0; 3],
        };
        let decisions = (push.seconds / anatomy.dt).round().max(1.0) as u64;
        if let Some(resident) = marathon.resident_mut(*seat) {
            resident.push(Shove { body: push.body, force, torque, decisions });
        }
    }
    for restart in restarts.read() {
        if let Ok((seat, ..)) = ragdolls.get(restart.ragdoll)
            && let Some(resident) = marathon.resident_mut(*seat)
        {
            resident.begin_now();
        }
    }
}

/// Center of mass of a body in the axes of the physics.
fn center_of_mass(marathon: &Marathon, seat: Seat, anatomy: &Anatomy, body: usize) -> Option<[f64; 3]> {
    let still = marathon.resident(seat)?.trail.back()?;
    let frame = *stage::places(&anatomy.model, &still.qpos)?.get(body)?;
    Some(to_physics(frame.transform_point(to_game(anatomy.model.bodies[body].ipos))))
}

/// Makes the decisions that are due, so that every state that a frame of this tick can show is there.
pub(crate) fn simulate(mut marathon: ResMut<Marathon>, time: Res<Time<Fixed>>) {
    let (now, began) = (marathon.now, Instant::now());
    let until = now + time.timestep();
    let mut decisions = 0;
    let pool = ComputeTaskPool::get();
    pool.scope(|scope| {
        for herd in &mut marathon.herds {
            let (first, period) = (herd.time, herd.period);
            if period.is_zero() || herd.pens.iter().all(Pen::is_empty) {
                continue;
            }
            let due = until.saturating_sub(first).as_nanos().div_ceil(period.as_nanos()) as u32;
            herd.time += period * due;
            let lanes = herd.pens.iter().flat_map(|pen| &pen.lanes).flatten().count();
            decisions += u64::from(due) * lanes as u64;
            for pen in herd.pens.iter_mut().filter(|pen| !pen.is_empty()) {
                scope.spawn(async move {
                    for decision in 1..=due {
                        pen.decide(first + period * decision);
                    }
                    pen.lanes.iter_mut().flatten().for_each(|resident| resident.forget(now));
                });
            }
        }
    });
    marathon.decisions += decisions;
    marathon.spent += began.elapsed();
}

/// Tells the world what has happened.
pub(crate) fn report(
    mut marathon: ResMut<Marathon>,
    mut ragdolls: Query<(Entity, &Seat, &mut Episode, &mut OwnGround)>,
    mut contacts: MessageWriter<FootContact>,
    mut ended: MessageWriter<EpisodeEnded>,
    mut began: MessageWriter<EpisodeBegan>,
) {
    for (ragdoll, seat, mut episode, mut ground) in &mut ragdolls {
        let Some(resident) = marathon.resident_mut(*seat) else { continue };
        for event in resident.events.drain(..) {
            match event {
                Event::Foot { foot, down } => {
                    contacts.write(FootContact { ragdoll, foot, down });
                }
                Event::Ended(end, episode) => {
                    ended.write(EpisodeEnded { ragdoll, end, episode });
                }
                Event::Began(number) => {
                    began.write(EpisodeBegan { ragdoll, number });
                }
            }
        }
        if *episode != resident.episode {
            episode.clone_from(&resident.episode);
        }
        if !Arc::ptr_eq(&ground.0, &resident.grounds) {
            ground.0 = resident.grounds.clone();
        }
    }
}

/// Turns ragdolls towards their targets as they begin, and tells who has arrived.
pub(crate) fn face_targets(
    marathon: Res<Marathon>,
    mut began: MessageReader<EpisodeBegan>,
    mut reached: MessageWriter<TargetReached>,
    mut arrived: Local<Vec<(Entity, u64)>>,
    mut ragdolls: Query<(Entity, &Seat, &Anatomy, &Target, &Episode, &mut Transform)>,
) {
    for event in began.read() {
        if let Ok((.., target, _, mut track)) = ragdolls.get_mut(event.ragdoll) {
            let way = (target.place - track.translation) * Vec3::new(1.0, 0.0, 1.0);
            if let Some(way) = way.try_normalize() {
                // +x onto the way, about the vertical
                track.rotation = Quat::from_rotation_y((-way.z).atan2(way.x));
            }
        }
    }
    for (entity, seat, anatomy, target, episode, track) in &ragdolls {
        if arrived.contains(&(entity, episode.number)) {
            continue;
        }
        let Some(still) = marathon.resident(*seat).and_then(|r| r.trail.back()) else { continue };
        let Ok(pose) = Scene::pose_from_qpos(&anatomy.model, &still.qpos) else { continue };
        let place = track.transform_point(to_game(pose.com));
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
    ragdolls: Query<(&RagdollState, &Anatomy)>,
    mut parts: Query<&mut Transform, With<Part>>,
) {
    let now = time.elapsed() + time.overstep();
    for (ragdoll, anatomy) in &ragdolls {
        stage::put(anatomy, marathon.places(ragdoll, now), &mut parts);
    }
}
