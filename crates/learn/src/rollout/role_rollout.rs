//! A role's part in a worker's rollouts: it acts, and stores observations and rewards.

use super::advantage;
use super::context::{RolloutContext, Values};
use super::data::Rollout;
use super::sums::BlockSums;
use crate::lanes::BLOCK;
use crate::lanes::buffer::{Aligned, Blocks};
use crate::lanes::noise::Noise;
use crate::nets::acting::ActingSpace;
use crate::nets::mlp::{CHUNK, Tape};
use crate::rewards::{RewardModel, Step};
use marathon_envs::{BlockStep, Metric, Role};
use marathon_physics::lanes::{Isa, Real};

/// Settings of a role's seat.
pub struct RoleSetup<'a> {
    /// The role.
    pub role: Role,
    /// Seed of its random streams.
    pub seed: u64,
    /// Agents per block.
    pub lanes: usize,
    /// Metrics of the task.
    pub metrics: Vec<Metric>,
    /// Networks of the same shape.
    pub with: RolloutContext<'a>,
}

/// A role's part in the rollouts of consecutive blocks.
pub struct RoleRollout {
    /// The role.
    pub role: Role,
    metrics: Vec<Metric>,
    /// Index of the role.
    number: usize,
    /// Random streams, one per block.
    pub(crate) noise: Vec<Noise>,
    /// Current raw observations, `[block][obs][16]`.
    pub(crate) obs: Aligned<f32>,
    /// Per agent, `[block][16]`: discounted return, and return, length and distance of the episode so far.
    pub(crate) tallies: [Vec<[f32; BLOCK]>; 4],
    /// Agents whose next action it chooses: one mask per block.
    pub(crate) decides: Vec<u16>,
    /// Agents in whose episode the role has finished: one mask per block.
    pub(crate) left: Vec<u16>,
    /// Work space.
    obs_sums: [Aligned<f32>; 2],
    space: ActingSpace,
    tape: Option<Tape<f32>>,
    reward_models: Vec<Option<Box<dyn RewardModel>>>,
}

impl RoleRollout {
    /// Creates the seat of role `number` at `blocks` blocks from `first_block`.
    pub fn new(number: usize, plan: RoleSetup<'_>, (first_block, blocks): (usize, usize)) -> Self {
        let RoleSetup { role, seed, lanes, metrics, with } = plan;
        let n = role.obs.len() * BLOCK;
        let noise = |b| Noise::new(seed, first_block + b).mirrored(lanes);
        Self {
            number,
            // metrics belong to the task, so only role 0 sums them
            metrics: if number == 0 { metrics } else { Vec::new() },
            noise: (0..blocks).map(noise).collect(),
            obs: Aligned::new(blocks * n),
            tallies: [(); 4].map(|()| vec![[0.0; BLOCK]; blocks]),
            decides: vec![!0; blocks],
            left: vec![0; blocks],
            obs_sums: [Aligned::new(blocks * n), Aligned::new(blocks * n)],
            space: with.acting.space(role.act.len()),
            tape: with.values.as_ref().map(|values| values.net.inference_tape()),
            reward_models: with
                .streams
                .iter()
                .map(|s| s.networks.as_ref().map(|nets| nets.reward.reward_model()))
                .collect(),
            role,
        }
    }

    fn blocks(&self) -> usize {
        self.noise.len()
    }
    /// Current observations of a block, `[obs][16]`.
    pub fn obs(&self, block: usize) -> &[f32] {
        let n = self.role.obs.len() * BLOCK;
        &self.obs[block * n..(block + 1) * n]
    }
    /// Current observations of a block, `[obs][16]`.
    pub fn obs_mut(&mut self, block: usize) -> &mut [f32] {
        let n = self.role.obs.len() * BLOCK;
        &mut self.obs[block * n..(block + 1) * n]
    }
    /// Copies its part out of the full observation of a block.
    pub fn see(&mut self, block: usize, whole: &[f32]) {
        let own = self.role.obs.start * BLOCK..self.role.obs.end * BLOCK;
        self.obs_mut(block).copy_from_slice(&whole[own]);
    }

    /// Prepares a rollout for a horizon.
    pub fn begin(&mut self, with: &RolloutContext<'_>, rollout: &mut Rollout) {
        let rewards = vec![0.0; with.streams.len() - 1];
        let terms = vec![0.0; self.role.terms.len()];
        let metrics = vec![0.0; self.metrics.len()];
        rollout.sums = vec![BlockSums { terms, rewards, metrics, ..Default::default() }; self.blocks()];
        rollout.cut.clear();
        rollout.cut_obs.clear();
        self.obs_sums.iter_mut().for_each(|s| s.fill(0.0));
    }

    /// Normalizes the observations of `n` blocks, and draws and stores their actions.
    pub fn act(&mut self, with: &RolloutContext<'_>, rollout: &mut Rollout, item: usize, first: usize, n: usize) {
        let (obs_row, act_row) = (rollout.obs_len * BLOCK, rollout.act_len * BLOCK);
        let log_prob_row = rollout.log_prob.len() / rollout.items();
        let of = |row: usize| first * row..(first + n) * row;
        let at = |row: usize| (item + first) * row..(item + first + n) * row;
        let [sum, square] = &mut self.obs_sums;
        let (raw, kept) = (&self.obs[of(obs_row)], &mut rollout.obs[at(obs_row)]);
        let copy = match with.values {
            Some(_) => Some(kept),
            None => {
                kept.copy_from_slice(raw);
                None
            }
        };
        let sums = (&mut sum[of(obs_row)], &mut square[of(obs_row)]);
        with.acting.normalize(raw, &mut self.space.input, copy, Some(sums));
        let decides = &self.decides[first..first + n];
        rollout.decided[item + first..item + first + n].copy_from_slice(decides);
        let action = &mut rollout.action[at(act_row)];
        let log_prob = &mut rollout.log_prob[at(log_prob_row)];
        with.acting.draw(&mut self.noise[first..first + n], &mut self.space, action, log_prob);
    }

    /// Stores the result of a decision of block `b`.
    pub fn take(&mut self, with: &RolloutContext<'_>, rollout: &mut Rollout, item: usize, b: usize, out: &BlockStep) {
        let obs_row = rollout.obs_len * BLOCK;
        let earned = out.reward_of(self.number, &self.role);

        // running sums of the agents
        let sums = &mut rollout.sums[b];
        let [discounted, returns, lengths, distances] = &mut self.tallies;
        let (discounted, returns) = (&mut discounted[b], &mut returns[b]);
        let (lengths, distances) = (&mut lengths[b], &mut distances[b]);
        let (gamma, center) = (with.streams[0].gamma as f32, with.return_center);
        let scale = with.reward_scale as f32;
        let reward = &mut rollout.reward[item * rollout.streams * BLOCK..][..BLOCK];
        let (mut first, mut second) = (0.0, 0.0);
        for i in 0..BLOCK {
            discounted[i] = discounted[i] * gamma + earned[i];
            returns[i] += earned[i];
            lengths[i] += 1.0;
            distances[i] += out.forward[i];
            reward[i] = earned[i] * scale;
            let d = (discounted[i] - center) as f64;
            first += d;
            second += d * d;
        }
        sums.discounted.0 += first;
        sums.discounted.1 += second;
        sums.decisions += rollout.decided[item].count_ones() as f64;
        let terms = &out.terms[self.role.terms.start * BLOCK..self.role.terms.end * BLOCK];
        for (sum, term) in sums.terms.iter_mut().zip(terms.chunks_exact(BLOCK)) {
            *sum += term.iter().map(|x| *x as f64).sum::<f64>();
        }
        for (sum, metric) in sums.metrics.iter_mut().zip(&self.metrics) {
            *sum += out.metric(metric).iter().map(|x| *x as f64).sum::<f64>();
        }

        let obs = &self.obs[b * obs_row..(b + 1) * obs_row];
        if !rollout.next_obs.is_empty() {
            let next = &mut rollout.next_obs[item * obs_row..(item + 1) * obs_row];
            match with.values {
                Some(_) => with.acting.normalize(obs, &mut self.space.input, Some(next), None),
                None => next.copy_from_slice(obs),
            }
        }
        self.decides[b] = out.deciding(self.number);

        // ended episodes
        let over = out.terminated | out.truncated | out.diverged;
        let [fallen, finished] = out.leaving(self.number);
        // the role may finish before the episode ends
        let left = self.left[b];
        let failed = out.terminated | out.diverged | fallen;
        let done = over | fallen | finished;
        (rollout.done[item], rollout.failed[item]) = (done, failed);
        if done == 0 {
            return;
        }
        self.left[b] = (left | done) & !over;
        let cut = (out.truncated | finished) & !failed & !left;
        let goes_on = with.streams.iter().any(|stream| stream.ignores_done);
        let whole = if goes_on { done & !out.diverged } else { cut };
        if whole != 0 {
            rollout.cut.push((item, [cut, whole]));
            rollout.cut_obs.extend_from_slice(obs);
        }
        for i in (0..BLOCK).filter(|i| done >> i & 1 == 1) {
            if left >> i & 1 == 0 {
                sums.episodes += 1.0;
                sums.returns += returns[i] as f64;
                sums.lengths += lengths[i] as f64;
                sums.speeds += distances[i] as f64 / lengths[i] as f64;
                sums.falls += ((out.terminated | fallen) >> i & 1) as f64;
                sums.diverged += (out.diverged >> i & 1) as f64;
            }
            (discounted[i], returns[i], lengths[i], distances[i]) = (0.0, 0.0, 0.0, 0.0);
        }
        // all roles decide at the start of an episode
        self.decides[b] |= over;
    }

    /// Completes a rollout: values, then advantages.
    pub fn end(&mut self, with: &RolloutContext<'_>, rollout: &mut Rollout) {
        self.add_up_observations(rollout);
        let Some(values) = &with.values else { return };
        self.reward_model(with, rollout);
        self.evaluate(with, values, rollout);
        let gamma: Vec<f64> = with.streams.iter().map(|stream| stream.gamma).collect();
        advantage::estimate(with.acting.isa, &gamma, values.lambda, rollout);
        // exact, because the number of agents is a power of two
        let part = rollout.lanes as f64 / BLOCK as f64;
        rollout.sums.iter_mut().for_each(|sums| sums.scale(part));
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

    /// Computes the rewards that come from networks.
    fn reward_model(&mut self, with: &RolloutContext<'_>, rollout: &mut Rollout) {
        let (items, streams, blocks) = (rollout.items(), rollout.streams, self.blocks());
        let mut rows = vec![0.0; CHUNK * BLOCK];
        for (s, (stream, reward_model)) in with.streams.iter().zip(&mut self.reward_models).enumerate() {
            let (Some(networks), Some(reward_model)) = (&stream.networks, reward_model) else { continue };
            let params = &with.params[networks.place.clone()];
            let (strength, most) = (stream.strength as f32, (networks.reward.bound() / stream.strength) as f32);
            for first in (0..items).step_by(CHUNK) {
                let n = CHUNK.min(items - first);
                let steps: Vec<Step<'_, f32>> = (first..first + n).map(|item| rollout.step(item)).collect();
                reward_model.reward(with.acting.isa, params, &steps, &mut rows);
                for (item, row) in (first..first + n).zip(rows.chunks_exact(BLOCK)) {
                    let out = &mut rollout.reward[(item * streams + s) * BLOCK..][..BLOCK];
                    for (out, x) in out.iter_mut().zip(row) {
                        *out = strength * Real::min(*x, most);
                    }
                    rollout.sums[item % blocks].rewards[s - 1] += out.iter().map(|x| *x as f64).sum::<f64>();
                }
            }
        }
    }

    /// Computes the values of all observations. Adds the discounted value of the last observation to the rewards of
    /// truncated episodes. In streams that continue beyond an episode's end, does so for all episodes.
    fn evaluate(&mut self, with: &RolloutContext<'_>, values: &Values<'_>, rollout: &mut Rollout) {
        let Self { space: ActingSpace { input, .. }, tape: Some(tape), .. } = self else { return };
        let Rollout { obs, obs_len, value, last_value, cut, cut_obs, reward, streams, .. } = rollout;
        let (row, streams) = (*obs_len * BLOCK, *streams);
        let isa = with.acting.isa;
        // values of normalized observations
        for (obs, value) in obs.chunks(CHUNK * row).zip(value.chunks_mut(CHUNK * streams * BLOCK)) {
            for (b, obs) in obs.chunks_exact(row).enumerate() {
                input.block_mut(b).copy_from_slice(obs);
            }
            values.of(isa, input, tape, value);
        }
        // values of raw observations
        let mut cut_value = vec![0.0; cut.len() * streams * BLOCK];
        for (raw, value) in [(&self.obs[..], &mut last_value[..]), (&cut_obs[..], &mut cut_value[..])] {
            for (raw, value) in raw.chunks(CHUNK * row).zip(value.chunks_mut(CHUNK * streams * BLOCK)) {
                with.acting.normalize(raw, input, None, None);
                values.of(isa, input, tape, value);
            }
        }
        for ((item, [truncated, whole]), values) in cut.iter().zip(cut_value.chunks_exact(streams * BLOCK)) {
            let rewards = reward[item * streams * BLOCK..].chunks_exact_mut(BLOCK);
            for ((stream, reward), value) in with.streams.iter().zip(rewards).zip(values.chunks_exact(BLOCK)) {
                let (gamma, agents) = (stream.gamma as f32, if stream.ignores_done { whole } else { truncated });
                for i in (0..BLOCK).filter(|i| agents >> i & 1 == 1) {
                    reward[i] += gamma * value[i];
                }
            }
        }
    }
}

impl Values<'_> {
    /// Values of the first blocks of `input`, as many as `out` has rows for.
    fn of(&self, isa: Isa, input: &Blocks<f32>, tape: &mut Tape<f32>, out: &mut [f32]) {
        let sizes = self.net.sizes();
        let row = sizes[sizes.len() - 1] * BLOCK;
        self.net.forward(isa, self.params, input, tape, out.len() / row);
        for (b, out) in out.chunks_exact_mut(row).enumerate() {
            out.copy_from_slice(tape.output().block(b));
        }
    }
}
