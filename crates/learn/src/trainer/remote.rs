//! Rollouts that are played elsewhere: by other processes, on other machines.
//!
//! The learner keeps all lasting state. For each rollout it sends its *orders*, which are the networks and the
//! statistics to act with, and to each player the *state* of the agents of its slice. The players return the rollouts
//! of these agents and their new state. A player keeps nothing between rollouts. Any other player can therefore replace
//! a lost one: it gets the same orders and state, and answers with the same bits. All sums are computed per block, so
//! the policy has the bits of [`train`](crate::train)'s for any number of players.
//!
//! All messages are safetensors; nothing in them is code.

use super::config::{RunConfig, TrainConfig};
use super::observer::Control;
use super::roles::{RoleParts, RoleReplica};
use super::{Replica, Shared, clock, states};
use crate::algorithms::share;
use crate::error::Error;
use crate::files::{TensorReader, TensorWriter};
use crate::rollout::collect::Collector;
use crate::rollout::data::Rollout;
use crate::rollout::states::{AgentStates, StatesShape};
use crate::rollout::sums::BlockSums;
use marathon_envs::{ShardFactory, Spec};
use marathon_physics::lanes::Isa;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::Path;

/// Both sides must have the same version.
const VERSION: u32 = 3;

/// Header of a message.
#[derive(Serialize, Deserialize)]
struct About {
    format: String,
    version: u32,
}

/// Kinds of messages: their formats, and what errors call them.
#[derive(Clone, Copy)]
enum Message {
    Orders,
    Agents,
    Rollout,
}

impl Message {
    const fn format(self) -> &'static str {
        match self {
            Message::Orders => "marathon-orders",
            Message::Agents => "marathon-agents",
            Message::Rollout => "marathon-rollout",
        }
    }
    fn close(self, file: &TensorWriter) -> Vec<u8> {
        file.bytes(&About { format: self.format().into(), version: VERSION })
    }
    fn open(self, bytes: &[u8]) -> Result<TensorReader<'_>, Error> {
        let file = TensorReader::new(Path::new(self.format()), bytes)?;
        file.document::<About>(self.format(), VERSION)?;
        Ok(file)
    }
}

/// Takes in the answer of a slice, and refuses one that does not fit.
pub type Deliver<'a> = &'a mut dyn FnMut(usize, &[u8]) -> Result<(), Error>;

/// Players that run the agents in the learner's place; see [`train_with`](crate::train_with).
pub trait Players {
    /// Number of slices that the agents are split into; at most one per block of sixteen agents is used.
    fn slices(&self) -> usize;

    /// Lets `states.len()` players play one horizon: slice `i` gets `orders` and `states[i]`, and its answer, the bytes
    /// that [`Player::play`] returns, is given to `deliver(i, answer)`, in any order. An answer that `deliver` refuses
    /// may be asked for again. [`Control::Stop`] ends the run before this rollout.
    fn play(&mut self, orders: &[u8], states: &[Vec<u8>], deliver: Deliver<'_>) -> Control;
}

/// Plays the agents of one slice of a run.
pub struct Player {
    spec: Spec,
    replica: RoleReplica,
    blocks: Range<usize>,
    collector: Collector,
    rollout: Rollout,
}

impl Player {
    /// For slice `slice` of `slices` of a run.
    ///
    /// # Errors
    /// If the configuration is invalid, or there is no such slice.
    pub fn new(
        factory: &dyn ShardFactory,
        isa: Isa,
        config: &TrainConfig,
        (slice, slices): (usize, usize),
    ) -> Result<Self, Error> {
        config.validate()?;
        check_travels(config, factory.spec())?;
        if slice >= slices || slices > config.run.blocks() {
            let expected = format!("a slice below their number, and at most {} of them", config.run.blocks());
            return Err(Error::Mismatch {
                what: "player".into(),
                found: format!("slice {slice} of {slices}"),
                expected,
            });
        }
        let spec = factory.spec().clone();
        let blocks = share(config.run.blocks(), slices, slice);
        let role = RoleParts::all(config, &spec)?.swap_remove(0);
        let replica = RoleReplica::new(&role, isa, &[blocks.len()]);
        let (shape, place) = (replica.learner.shape(), (blocks.start, blocks.len()));
        let collector = Collector::new(factory, place, config.run.seed, vec![replica.role_setup(&role)]);
        let rollout = Rollout::new(blocks.len(), config.run.horizon, &shape);
        Ok(Self { replica, collector, rollout, spec, blocks })
    }

    /// Plays one horizon with the orders and from the state that a learner sent, and returns the answer. The same
    /// arguments give the same bits, whatever was played before.
    ///
    /// # Errors
    /// If the messages are damaged or belong to another task, network or slice.
    pub fn play(&mut self, orders: &[u8], state: &[u8]) -> Result<Vec<u8>, Error> {
        let cpu = clock::thread_cpu();
        let RoleReplica { learner, statistics, .. } = &mut self.replica;
        let orders = Message::Orders.open(orders)?;
        *learner.params_mut() = orders.finite("params", &[learner.params().len()])?;
        statistics.observations.mean = orders.get("obs_mean", &[self.spec.obs])?;
        statistics.observations.var = orders.get("obs_var", &[self.spec.obs])?;
        let returns: Vec<f64> = orders.get("returns", &[2])?;
        (statistics.returns.mean[0], statistics.returns.var[0]) = (returns[0], returns[1]);

        let what = Message::Agents.format();
        let agents = states::read(&Message::Agents.open(state)?, &ONE_ROLE)?;
        agents.check(what, shape(&self.spec, self.blocks.len()))?;
        agents.put(what, self.blocks.clone(), &mut self.collector)?;

        let env = self.collector.collect(&[learner.collecting(statistics)], &mut [&mut self.rollout], clock::wall);

        let mut file = TensorWriter::default();
        write_rollout(&self.rollout, &mut file);
        states::write(&AgentStates::of([&self.collector], self.blocks.clone()), &ONE_ROLE, &mut file);
        file.list("seconds", &[env, clock::thread_cpu() - cpu]);
        Ok(Message::Rollout.close(&file))
    }
}

/// Prefixes of the lists of a task with one role.
const ONE_ROLE: [String; 1] = [String::new()];

/// Shape of a slice's states, for a task with one role.
fn shape(spec: &Spec, blocks: usize) -> StatesShape<'_> {
    StatesShape { blocks, obs: std::slice::from_ref(&spec.obs), act: spec.act }
}

/// Refuses algorithms that learn from more than the last rollout, and tasks with several roles.
///
/// # Errors
/// If the algorithm is SAC, whose replay stays with the agents, or the task has several roles.
pub fn check_travels(config: &TrainConfig, spec: &Spec) -> Result<(), Error> {
    let refuse = |found: String, expected: &str| {
        Err(Error::Mismatch { what: "rollouts played elsewhere".into(), found, expected: expected.into() })
    };
    if !config.algorithm.travels() {
        return refuse("the trainer sac".into(), "ppo, a2c or acktr");
    }
    match spec.roles.len() {
        0 | 1 => Ok(()),
        n => refuse(format!("{} with its {n} roles", spec.id), "a task with one role"),
    }
}

/// Seconds spent on a rollout.
#[derive(Clone, Copy, Default)]
pub struct Spent {
    /// In the environments, by each worker or player.
    pub env: f64,
    /// Of processor time, elsewhere.
    pub cpu_elsewhere: f64,
}

/// The learner's side.
pub struct Remote<'a> {
    players: &'a mut dyn Players,
    slices: Vec<Range<usize>>,
    /// Why the run cannot go on.
    pub error: Option<Error>,
}

impl<'a> Remote<'a> {
    /// For a run with a configuration.
    pub fn new(players: &'a mut dyn Players, config: &RunConfig) -> Self {
        let n = players.slices().clamp(1, config.blocks());
        let slices = (0..n).map(|i| share(config.blocks(), n, i)).collect();
        Self { players, slices, error: None }
    }

    /// Has one horizon played; fills the rollouts and brings the collectors into the states in which their agents are then.
    /// `None` if the run is to end: nothing has changed then, except after an error.
    pub(super) fn collect(&mut self, run: &Shared, replica: &Replica) -> Option<Spent> {
        let RoleReplica { learner, statistics, .. } = &replica.roles[0];
        let locked = || run.collectors.iter().map(|c| c.lock().expect("no worker has panicked"));
        let mut orders = TensorWriter::default();
        orders.list("params", learner.params());
        orders.list("obs_mean", &statistics.observations.mean);
        orders.list("obs_var", &statistics.observations.var);
        orders.list("returns", &[statistics.returns.mean[0], statistics.returns.var[0]]);
        let orders = Message::Orders.close(&orders);
        let states = self.slices.iter().map(|slice| {
            let mut file = TensorWriter::default();
            states::write(&AgentStates::of(locked(), slice.clone()), &ONE_ROLE, &mut file);
            Message::Agents.close(&file)
        });
        let states: Vec<Vec<u8>> = states.collect();

        let slices = &self.slices;
        let mut answers: Vec<Option<Answer>> = slices.iter().map(|_| None).collect();
        let control = self.players.play(&orders, &states, &mut |i, bytes| {
            let none = || Error::Mismatch {
                what: "rollout".into(),
                found: format!("slice {i}"),
                expected: format!("one below {}", slices.len()),
            };
            let blocks = slices.get(i).ok_or_else(none)?.len();
            answers[i] = Some(Answer::read(bytes, run, replica, blocks)?);
            Ok(())
        });
        if control == Control::Stop {
            return None;
        }
        let arrived = answers.iter().flatten().count();
        if arrived < slices.len() {
            let found = format!("{arrived} slices");
            let expected = format!("those of {}", slices.len());
            self.error = Some(Error::Mismatch { what: "the players' rollout".into(), found, expected });
            return None;
        }

        let mut spent = Spent::default();
        for (answer, slice) in answers.iter().flatten().zip(slices) {
            for mut collector in locked() {
                if let Err(error) = answer.agents.put(Message::Rollout.format(), slice.clone(), &mut collector) {
                    self.error = Some(error);
                    return None;
                }
            }
            spent.env += answer.seconds[0] / slices.len() as f64;
            spent.cpu_elsewhere += answer.seconds[1];
        }
        let mut all = answers.iter().flatten().flat_map(|a| (0..a.rollout.blocks()).map(|b| (&a.rollout, b)));
        for rollout in &run.crews[0].rollouts {
            let mut rollout = rollout.write().expect("no worker has panicked");
            rollout.sums.clear();
            for b in 0..rollout.blocks() {
                let (from, block) = all.next().expect("slices and rollouts have all blocks, in order");
                rollout.copy_block(b, from, block);
            }
        }
        Some(spent)
    }
}

/// A player's reply.
struct Answer {
    rollout: Rollout,
    agents: AgentStates,
    seconds: Vec<f64>,
}

impl Answer {
    fn read(bytes: &[u8], run: &Shared, replica: &Replica, blocks: usize) -> Result<Self, Error> {
        let spec = &run.spec;
        let file = Message::Rollout.open(bytes)?;
        let mut rollout = Rollout::new(blocks, run.config.run.horizon, &replica.roles[0].learner.shape());
        read_rollout(&mut rollout, &file, spec, run.config.rewards.len() - 1)?;
        let agents = states::read(&file, &ONE_ROLE)?;
        agents.check(Message::Rollout.format(), shape(spec, blocks))?;
        Ok(Self { rollout, agents, seconds: file.get("seconds", &[2])? })
    }
}

/// Numbers of a block's sums, except for its observations, reward terms, rewards and metrics.
const SUMS: usize = 15;

/// Writes the parts of a rollout that a learner needs.
fn write_rollout(rollout: &Rollout, file: &mut TensorWriter) {
    for (name, rows) in rollout.rows() {
        file.list(name, rows);
    }
    let sums = rollout.sums.iter().flat_map(|s| {
        let scalars = [s.episodes, s.returns, s.lengths, s.speeds, s.falls, s.diverged, s.decisions];
        let pairs = [s.discounted, s.advantages, s.targets, s.errors].into_iter().chain(s.observations.iter().copied());
        let rest = s.terms.iter().chain(&s.rewards).chain(&s.metrics).copied();
        scalars.into_iter().chain(pairs.flat_map(|(a, b)| [a, b])).chain(rest).collect::<Vec<_>>()
    });
    file.list("sums", &sums.collect::<Vec<f64>>());
}

fn read_rollout(rollout: &mut Rollout, file: &TensorReader<'_>, spec: &Spec, rewards: usize) -> Result<(), Error> {
    for (name, rows) in rollout.rows_mut() {
        rows.copy_from_slice(&file.get::<f32>(name, &[rows.len()])?);
    }
    let row = SUMS + 2 * spec.obs + spec.reward_terms.len() + rewards + spec.own_metrics().count();
    let sums: Vec<f64> = file.get("sums", &[rollout.blocks() * row])?;
    let read = |row: &[f64]| {
        let (scalars, rest) = row.split_at(SUMS + 2 * spec.obs);
        let (terms, rest) = rest.split_at(spec.reward_terms.len());
        let (rewards, metrics) = rest.split_at(rewards);
        let pair = |i: usize| (scalars[i], scalars[i + 1]);
        BlockSums {
            episodes: scalars[0],
            returns: scalars[1],
            lengths: scalars[2],
            speeds: scalars[3],
            falls: scalars[4],
            diverged: scalars[5],
            decisions: scalars[6],
            discounted: pair(7),
            advantages: pair(9),
            targets: pair(11),
            errors: pair(13),
            observations: (0..spec.obs).map(|i| pair(SUMS + 2 * i)).collect(),
            terms: terms.to_vec(),
            rewards: rewards.to_vec(),
            metrics: metrics.to_vec(),
        }
    };
    rollout.sums = sums.chunks_exact(row).map(read).collect();
    Ok(())
}
