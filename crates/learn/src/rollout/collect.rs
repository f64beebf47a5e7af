//! Acting: a worker's agents play one horizon, and what happened is kept for learning.
//!
//! A worker owns a run of consecutive blocks and goes through the whole rollout without waiting for anyone. Everything
//! it adds up is kept per block, so that the totals, taken in the order of the blocks, do not depend on how blocks are
//! spread over workers.

use crate::algorithms::loss::Samples;
use crate::algorithms::parameters::Layout;
use crate::lanes::BLOCK;
use crate::lanes::buffer::{Aligned, Blocks};
use crate::lanes::f32_lanes;
use crate::lanes::mirror;
use crate::lanes::noise::Noise;
use crate::nets::gaussian::{Gaussian, Sample};
use crate::nets::mlp::{CHUNK, Mlp, Tape};
use crate::nets::normalize::{Normalize, Normalizer};
use crate::nets::squash::{Draw, Normals};
use crate::rewards::{SignalNets, SignalSpace, Step};
use crate::rollout::advantage::{self, Discounts};
use crate::rollout::sums::BlockSums;
use crate::trainer::clock;
use crate::trainer::config::Ratio;
use marathon_envs::{BlockStep, Shard, ShardFactory};
use marathon_physics::lanes::{Isa, Real};
use std::marker::PhantomData;

/// What the agents act with in a rollout; the same for all workers.
pub struct Acting<'a> {
    pub isa: Isa,
    pub actor: (&'a Mlp, &'a [f32]),
    pub critic: (&'a Mlp, &'a [f32]),
    pub gaussian: &'a Gaussian<f32>,
    pub normalizer: &'a Normalizer,
    /// Networks of the reward signals with their parameters, and the factors of their rewards.
    pub signals: Vec<(&'a SignalNets, &'a [f32], f64)>,
    /// Whether each action has a probability ratio of its own.
    pub ratio: Ratio,
    /// Multiplies the actions drawn before they are clipped.
    pub action_scale: f32,
    /// Whether the policy is SAC's, and observations are kept as they are.
    pub squash: bool,
    pub discounts: Discounts,
    /// Divides the rewards.
    pub reward_scale: f64,
    /// Center of the statistics of discounted returns.
    pub return_center: f32,
}

impl Acting<'_> {
    /// Streams of rewards.
    fn streams(&self) -> usize {
        1 + self.signals.len()
    }
}

/// What a worker's agents experienced in one horizon; item `t * blocks + b` is block `b` at decision `t`.
pub struct Rollout {
    blocks: usize,
    obs_len: usize,
    act_len: usize,
    /// Normalized, `[item][obs][16]`.
    obs: Aligned<f32>,
    /// `[item][act][16]`.
    action: Aligned<f32>,
    /// What was observed next, normalized, where a reward signal asks for it; else nothing.
    next_obs: Aligned<f32>,
    /// `[item][16]`, or with a ratio for each action `[item][act][16]`.
    log_prob: Aligned<f32>,
    /// `[item][16]`.
    advantage: Aligned<f32>,
    /// `[item][stream][16]`.
    reward: Aligned<f32>,
    value: Aligned<f32>,
    target: Aligned<f32>,
    /// Streams of rewards.
    streams: usize,
    /// Agents in a block, which the other lanes mirror.
    pub lanes: usize,
    /// Agents whose episode ended with the item, and whose episode failed.
    done: Vec<u16>,
    failed: Vec<u16>,
    /// Ended episodes whose last observation has a value: item, agents that were truncated, agents whose simulation did not
    /// break, and the observation that they ended at. Without signals, truncated ones alone.
    cut: Vec<(usize, [u16; 2])>,
    cut_obs: Vec<f32>,
    /// Value of the observation after the last decision, `[block][stream][16]`.
    last_value: Aligned<f32>,
    /// Per block.
    pub sums: Vec<BlockSums>,
}

impl Rollout {
    /// Room for `horizon` decisions of `blocks` blocks.
    pub fn new(blocks: usize, horizon: usize, (obs_len, act_len): (usize, usize), layout: &Layout) -> Self {
        let streams = layout.streams();
        let items = blocks * horizon;
        let (row, stream_rows) = (|| Aligned::rows(items), || Aligned::rows(items * streams));
        let next_items = if streams > 1 || layout.twin.is_some() { items } else { 0 };
        Self {
            blocks,
            obs_len,
            act_len,
            obs: Aligned::rows(items * obs_len),
            action: Aligned::rows(items * act_len),
            next_obs: Aligned::rows(next_items * obs_len),
            log_prob: Aligned::rows(items * layout.ratio.rows(act_len)),
            advantage: row(),
            reward: stream_rows(),
            value: stream_rows(),
            target: stream_rows(),
            streams,
            lanes: layout.lanes,
            done: vec![0; items],
            failed: vec![0; items],
            cut: Vec::new(),
            cut_obs: Vec::new(),
            last_value: Aligned::rows(blocks * streams),
            sums: Vec::new(),
        }
    }

    fn items(&self) -> usize {
        self.done.len()
    }
    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.blocks
    }
    /// Normalized observations of an item, `[obs][16]`.
    pub fn obs(&self, item: usize) -> &[f32] {
        &self.obs[item * self.obs_len * BLOCK..][..self.obs_len * BLOCK]
    }
    /// What a learner needs to know, `[item][..][16]`, by name.
    pub fn rows(&self) -> [(&'static str, &[f32]); 7] {
        [
            ("normalized_obs", &self.obs),
            ("next_normalized_obs", &self.next_obs),
            ("action", &self.action),
            ("log_prob", &self.log_prob),
            ("value", &self.value),
            ("advantage", &self.advantage),
            ("target", &self.target),
        ]
    }
    /// The same, to be filled.
    pub fn rows_mut(&mut self) -> [(&'static str, &mut [f32]); 7] {
        [
            ("normalized_obs", &mut self.obs),
            ("next_normalized_obs", &mut self.next_obs),
            ("action", &mut self.action),
            ("log_prob", &mut self.log_prob),
            ("value", &mut self.value),
            ("advantage", &mut self.advantage),
            ("target", &mut self.target),
        ]
    }
    /// Copies what a learner needs to know about a block, and adds its sums to the list of sums.
    pub fn copy_block(&mut self, block: usize, from: &Rollout, its: usize) {
        let (blocks, items) = (self.blocks, self.items());
        for ((_, to), (_, rows)) in self.rows_mut().into_iter().zip(from.rows()) {
            let row = to.len() / items;
            for t in 0..items / blocks {
                let (to_item, item) = (t * blocks + block, t * from.blocks + its);
                to[to_item * row..(to_item + 1) * row].copy_from_slice(&rows[item * row..(item + 1) * row]);
            }
        }
        self.sums.push(from.sums[its].clone());
    }
    /// What the objective needs to know about an item.
    pub fn samples(&self, item: usize) -> Samples<'_, f32> {
        let row = item * BLOCK..(item + 1) * BLOCK;
        let log_prob = self.log_prob.len() / self.items();
        let rows = item * self.streams * BLOCK..(item + 1) * self.streams * BLOCK;
        Samples {
            action: &self.action[item * self.act_len * BLOCK..][..self.act_len * BLOCK],
            log_prob: &self.log_prob[item * log_prob..(item + 1) * log_prob],
            advantage: &self.advantage[row],
            value: &self.value[rows.clone()],
            target: &self.target[rows],
        }
    }
    /// Rewards of an item, scaled, of the task alone.
    pub fn reward(&self, item: usize) -> &[f32] {
        &self.reward[item * self.streams * BLOCK..][..BLOCK]
    }
    /// Agents whose episode ended with each item, and whose episode failed.
    pub fn ends(&self) -> impl Iterator<Item = (u16, u16)> + '_ {
        self.done.iter().copied().zip(self.failed.iter().copied())
    }
    /// What the reward signals need to know about an item.
    pub fn step(&self, item: usize) -> Step<'_, f32> {
        Step {
            obs: self.obs(item),
            action: &self.action[item * self.act_len * BLOCK..][..self.act_len * BLOCK],
            next: &self.next_obs[item * self.obs_len * BLOCK..][..self.obs_len * BLOCK],
        }
    }
}

/// A worker's agents.
pub struct Actor {
    shard: Box<dyn Shard>,
    first_block: usize,
    noise: Vec<Noise>,
    /// Current raw observations, `[block][obs][16]`.
    obs: Aligned<f32>,
    /// Per agent, `[block][16]`: discounted return, and return, length and distance of the episode so far.
    pub(crate) tallies: [Vec<[f32; BLOCK]>; 4],
    /// Work space.
    obs_sums: [Aligned<f32>; 2],
    input: Blocks<f32>,
    tape: Tape<f32>,
    critic_tape: Tape<f32>,
    signal_spaces: Vec<SignalSpace>,
    eps: Vec<[f32; BLOCK]>,
    z: Vec<f32>,
    /// The actions in the environment's units, `[block][act][16]`.
    action: Vec<f32>,
    out: BlockStep,
}

impl Actor {
    /// Agents of `blocks` blocks from `first_block`, each at the start of its first episode.
    pub fn new(factory: &dyn ShardFactory, (first_block, blocks): (usize, usize), seed: u64, layout: &Layout) -> Self {
        let n = factory.spec().obs * BLOCK;
        let mut shard = factory.shard(first_block, blocks, seed);
        let mut obs = Aligned::new(blocks * n);
        for b in 0..blocks {
            shard.reset(b, !0, &mut obs[b * n..(b + 1) * n]);
        }
        mirror::rows(&mut obs, layout.lanes);
        let noise = |b| Noise::new(seed, first_block + b).mirrored(layout.lanes);
        Self {
            shard,
            first_block,
            noise: (0..blocks).map(noise).collect(),
            obs,
            tallies: [(); 4].map(|()| vec![[0.0; BLOCK]; blocks]),
            obs_sums: [Aligned::new(blocks * n), Aligned::new(blocks * n)],
            input: layout.actor.input(),
            tape: layout.actor.inference_tape(),
            critic_tape: layout.critic.inference_tape(),
            signal_spaces: layout.signals.iter().map(|(nets, _)| nets.space()).collect(),
            eps: vec![[0.0; BLOCK]; factory.spec().act],
            z: vec![0.0; CHUNK * factory.spec().act * BLOCK],
            action: vec![0.0; blocks * factory.spec().act * BLOCK],
            out: BlockStep::default(),
        }
    }

    /// First block of the whole environment that this worker owns.
    pub fn first_block(&self) -> usize {
        self.first_block
    }
    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.noise.len()
    }
    /// The environments.
    pub fn shard(&self) -> &dyn Shard {
        &*self.shard
    }
    /// The environments.
    pub fn shard_mut(&mut self) -> &mut dyn Shard {
        &mut *self.shard
    }
    /// Current observations of a block, `[obs][16]`.
    pub fn obs(&self, block: usize) -> &[f32] {
        let n = self.obs.len() / self.noise.len();
        &self.obs[block * n..(block + 1) * n]
    }
    /// Current observations of a block, `[obs][16]`.
    pub fn obs_mut(&mut self, block: usize) -> &mut [f32] {
        let n = self.obs.len() / self.noise.len();
        &mut self.obs[block * n..(block + 1) * n]
    }
    /// Random streams, one per block.
    pub fn noise(&self) -> &[Noise] {
        &self.noise
    }
    /// Random streams, one per block.
    pub fn noise_mut(&mut self) -> &mut [Noise] {
        &mut self.noise
    }

    /// Plays one horizon and fills `rollout`, advantages included. Returns the seconds spent in the environments.
    pub fn collect(&mut self, acting: &Acting<'_>, rollout: &mut Rollout) -> f64 {
        let blocks = self.blocks();
        let terms = self.shard.spec().reward_terms.len();
        let signals = vec![0.0; acting.signals.len()];
        rollout.sums = vec![BlockSums { terms: vec![0.0; terms], signals, ..Default::default() }; blocks];
        rollout.cut.clear();
        rollout.cut_obs.clear();
        self.obs_sums.iter_mut().for_each(|s| s.fill(0.0));
        let mut env_seconds = 0.0;
        for t in 0..rollout.items() / blocks {
            for first in (0..blocks).step_by(CHUNK) {
                self.act(acting, rollout, t * blocks, first, CHUNK.min(blocks - first));
            }
            let start = clock::wall();
            let row = blocks * rollout.act_len * BLOCK;
            self.announce(&rollout.action[t * row..(t + 1) * row], acting.action_scale);
            for b in 0..blocks {
                self.step(acting, rollout, t * blocks + b, b);
            }
            env_seconds += clock::wall() - start;
        }
        self.add_up_observations(rollout);
        if acting.squash {
            return env_seconds;
        }
        self.reward_novelty(acting, rollout);
        self.evaluate(acting, rollout);
        advantage::estimate(acting, rollout);
        // exact, since the number of agents is a power of two
        let part = rollout.lanes as f64 / BLOCK as f64;
        rollout.sums.iter_mut().for_each(|sums| sums.scale(part));
        env_seconds
    }

    /// Normalizes the observations of `n` blocks, and draws and stores their actions.
    fn act(&mut self, acting: &Acting<'_>, rollout: &mut Rollout, item: usize, first: usize, n: usize) {
        let (obs_row, act_row) = (rollout.obs_len * BLOCK, rollout.act_len * BLOCK);
        let of = |row: usize| first * row..(first + n) * row;
        let at = |row: usize| (item + first) * row..(item + first + n) * row;
        let [sum, square] = &mut self.obs_sums;
        f32_lanes!(acting.isa, T => <T as Real>::enter(Normalize::<T> {
            normalizer: acting.normalizer,
            raw: &self.obs[of(obs_row)],
            input: &mut self.input,
            copy: if acting.squash { None } else { Some(&mut rollout.obs[at(obs_row)]) },
            sums: Some((&mut sum[of(obs_row)], &mut square[of(obs_row)])),
            lanes: PhantomData,
        }));
        acting.actor.0.forward(acting.isa, acting.actor.1, &self.input, &mut self.tape, n);
        if acting.squash {
            rollout.obs[at(obs_row)].copy_from_slice(&self.obs[of(obs_row)]);
            let (act, action) = (rollout.act_len, &mut rollout.action[at(act_row)]);
            let (z, output, log_prob) =
                (&mut self.z[..n * act_row], self.tape.output(), &mut rollout.log_prob[at(BLOCK)]);
            let noise = &mut self.noise[first..first + n];
            f32_lanes!(acting.isa, T => {
                <T as Real>::enter(Normals::<T> { noise, z: &mut *z, act, lanes: PhantomData });
                <T as Real>::enter(Draw::<T> { output, z, act, action, log_prob, blocks: n, lanes: PhantomData });
            });
            return;
        }
        f32_lanes!(acting.isa, T => <T as Real>::enter(Sample::<T> {
            gaussian: acting.gaussian,
            mean: self.tape.output(),
            noise: &mut self.noise[first..first + n],
            action: &mut rollout.action[at(act_row)],
            log_prob: &mut rollout.log_prob[at(acting.ratio.rows(rollout.act_len) * BLOCK)],
            ratio: acting.ratio,
            eps: &mut self.eps,
            lanes: PhantomData,
        }));
    }

    /// Tells the environments the actions of all blocks, in their own units.
    fn announce(&mut self, drawn: &[f32], scale: f32) {
        let spec = self.shard.spec();
        for (i, (action, drawn)) in self.action.iter_mut().zip(drawn).enumerate() {
            *action = spec.action_of(i / BLOCK % spec.act, *drawn * scale);
        }
        self.shard.announce(&self.action);
    }

    /// One decision of one block, with all bookkeeping.
    fn step(&mut self, acting: &Acting<'_>, rollout: &mut Rollout, item: usize, b: usize) {
        let (obs_row, act_row) = (rollout.obs_len * BLOCK, rollout.act_len * BLOCK);
        let out = &mut self.out;
        let obs = &mut self.obs[b * obs_row..(b + 1) * obs_row];
        self.shard.step(b, &self.action[b * act_row..(b + 1) * act_row], obs, out);
        let ended = out.terminated | out.truncated | out.diverged;
        if rollout.lanes < BLOCK {
            mirror::step(out, obs, rollout.lanes);
        }

        // running sums of the agents
        let sums = &mut rollout.sums[b];
        let [discounted, returns, lengths, distances] = &mut self.tallies;
        let (discounted, returns) = (&mut discounted[b], &mut returns[b]);
        let (lengths, distances) = (&mut lengths[b], &mut distances[b]);
        let (gamma, center) = (acting.discounts.gamma[0] as f32, acting.return_center);
        let scale = acting.reward_scale as f32;
        let reward = &mut rollout.reward[item * rollout.streams * BLOCK..][..BLOCK];
        let (mut first, mut second) = (0.0, 0.0);
        for i in 0..BLOCK {
            discounted[i] = discounted[i] * gamma + out.reward[i];
            returns[i] += out.reward[i];
            lengths[i] += 1.0;
            distances[i] += out.forward[i];
            reward[i] = out.reward[i] * scale;
            let d = (discounted[i] - center) as f64;
            first += d;
            second += d * d;
        }
        sums.discounted.0 += first;
        sums.discounted.1 += second;
        for (sum, term) in sums.terms.iter_mut().zip(out.terms.chunks_exact(BLOCK)) {
            *sum += term.iter().map(|x| *x as f64).sum::<f64>();
        }

        if acting.squash {
            rollout.next_obs[item * obs_row..(item + 1) * obs_row].copy_from_slice(obs);
        } else if !acting.signals.is_empty() {
            f32_lanes!(acting.isa, T => <T as Real>::enter(Normalize::<T> {
                normalizer: acting.normalizer,
                raw: obs,
                input: &mut self.input,
                copy: Some(&mut rollout.next_obs[item * obs_row..(item + 1) * obs_row]),
                sums: None,
                lanes: PhantomData,
            }));
        }

        // ended episodes
        let done = out.terminated | out.truncated | out.diverged;
        (rollout.done[item], rollout.failed[item]) = (done, out.terminated | out.diverged);
        if done | ended == 0 {
            return;
        }
        let cut = out.truncated & !(out.terminated | out.diverged);
        let whole = if acting.signals.is_empty() { cut } else { done & !out.diverged };
        if whole != 0 {
            rollout.cut.push((item, [cut, whole]));
            rollout.cut_obs.extend_from_slice(obs);
        }
        for i in (0..BLOCK).filter(|i| done >> i & 1 == 1) {
            sums.episodes += 1.0;
            sums.returns += returns[i] as f64;
            sums.lengths += lengths[i] as f64;
            sums.speeds += distances[i] as f64 / lengths[i] as f64;
            sums.falls += (out.terminated >> i & 1) as f64;
            sums.diverged += (out.diverged >> i & 1) as f64;
            (discounted[i], returns[i], lengths[i], distances[i]) = (0.0, 0.0, 0.0, 0.0);
        }
        // lanes without an agent live on too
        self.shard.reset(b, done | ended, obs);
        mirror::rows(obs, rollout.lanes);
    }

    /// Sums of the observations per block.
    fn add_up_observations(&self, rollout: &mut Rollout) {
        let [sum, square] = &self.obs_sums;
        let total = |row: &[f32]| row.iter().map(|x| *x as f64).sum::<f64>();
        let rows = sum.chunks_exact(BLOCK).zip(square.chunks_exact(BLOCK));
        let all: Vec<(f64, f64)> = rows.map(|(s, q)| (total(s), total(q))).collect();
        for (b, sums) in rollout.sums.iter_mut().enumerate() {
            sums.observations = all[b * rollout.obs_len..(b + 1) * rollout.obs_len].to_vec();
        }
    }

    /// Rewards of the signals.
    fn reward_novelty(&mut self, acting: &Acting<'_>, rollout: &mut Rollout) {
        let (items, streams, blocks) = (rollout.items(), rollout.streams, self.blocks());
        let mut rows = vec![0.0; CHUNK * BLOCK];
        for (s, ((nets, params, strength), space)) in acting.signals.iter().zip(&mut self.signal_spaces).enumerate() {
            // ML-Agents' bound: what a step gives is not worth more than 1
            let (strength, most) = (*strength as f32, (1.0 / strength) as f32);
            for first in (0..items).step_by(CHUNK) {
                let n = CHUNK.min(items - first);
                let steps: Vec<Step<'_, f32>> = (first..first + n).map(|item| rollout.step(item)).collect();
                nets.reward(acting.isa, params, &steps, space, &mut rows);
                for (item, row) in (first..first + n).zip(rows.chunks_exact(BLOCK)) {
                    let out = &mut rollout.reward[(item * streams + 1 + s) * BLOCK..][..BLOCK];
                    for (out, x) in out.iter_mut().zip(row) {
                        *out = strength * Real::min(*x, most);
                    }
                    rollout.sums[item % blocks].signals[s] += out.iter().map(|x| *x as f64).sum::<f64>();
                }
            }
        }
    }

    /// Values of all observations; adds the discounted value of what would have come to the rewards of truncated
    /// episodes, and in the streams of signals to those of all.
    fn evaluate(&mut self, acting: &Acting<'_>, rollout: &mut Rollout) {
        let Rollout { obs, obs_len, value, last_value, cut, cut_obs, reward, .. } = rollout;
        let (row, streams) = (*obs_len * BLOCK, acting.streams());
        // values of normalized observations
        for (obs, value) in obs.chunks(CHUNK * row).zip(value.chunks_mut(CHUNK * streams * BLOCK)) {
            for (b, obs) in obs.chunks_exact(row).enumerate() {
                self.input.block_mut(b).copy_from_slice(obs);
            }
            value_of_input(acting, &self.input, &mut self.critic_tape, value);
        }
        // values of raw ones
        let mut cut_value = vec![0.0; cut.len() * streams * BLOCK];
        for (raw, value) in [(&self.obs[..], &mut last_value[..]), (&cut_obs[..], &mut cut_value[..])] {
            for (raw, value) in raw.chunks(CHUNK * row).zip(value.chunks_mut(CHUNK * streams * BLOCK)) {
                f32_lanes!(acting.isa, T => <T as Real>::enter(Normalize::<T> {
                    normalizer: acting.normalizer,
                    raw,
                    input: &mut self.input,
                    copy: None,
                    sums: None,
                    lanes: PhantomData,
                }));
                value_of_input(acting, &self.input, &mut self.critic_tape, value);
            }
        }
        for ((item, [truncated, whole]), values) in cut.iter().zip(cut_value.chunks_exact(streams * BLOCK)) {
            let rewards = reward[item * streams * BLOCK..].chunks_exact_mut(BLOCK);
            for (s, (reward, value)) in rewards.zip(values.chunks_exact(BLOCK)).enumerate() {
                let (gamma, agents) = (acting.discounts.gamma[s] as f32, if s == 0 { truncated } else { whole });
                for i in (0..BLOCK).filter(|i| agents >> i & 1 == 1) {
                    reward[i] += gamma * value[i];
                }
            }
        }
    }
}

/// Values of the first blocks of `input`, as many as `out` has rows for.
fn value_of_input(acting: &Acting<'_>, input: &Blocks<f32>, tape: &mut Tape<f32>, out: &mut [f32]) {
    let row = acting.streams() * BLOCK;
    acting.critic.0.forward(acting.isa, acting.critic.1, input, tape, out.len() / row);
    for (b, out) in out.chunks_exact_mut(row).enumerate() {
        out.copy_from_slice(tape.output().block(b));
    }
}

/// Rows that the advantage estimator works on, as in [`Rollout`].
pub struct Rewards<'a> {
    pub streams: usize,
    pub reward: &'a [f32],
    pub value: &'a [f32],
    pub last_value: &'a [f32],
    pub done: &'a [u16],
    pub advantage: &'a mut [f32],
    pub target: &'a mut [f32],
    pub sums: &'a mut [BlockSums],
}

impl Rollout {
    /// What the advantage estimator reads and writes.
    pub fn rewards(&mut self) -> Rewards<'_> {
        Rewards {
            streams: self.streams,
            reward: &self.reward,
            value: &self.value,
            last_value: &self.last_value,
            done: &self.done,
            advantage: &mut self.advantage,
            target: &mut self.target,
            sums: &mut self.sums,
        }
    }
}
