//! Soft actor-critic (Haarnoja et al., "Soft actor-critic algorithms and applications", 2018): learns from everything that
//! was experienced, not from the last rollout alone.
//!
//! Each rollout of all agents goes into a [`Replay`]. Then, `updates` times, a batch is drawn from it:
//!
//! ```text
//! a' ~ pi(s')     y = r + gamma^n (min(Q1', Q2')(s', a') - alpha ln pi(a'|s'))       r: n rewards; no value after a failure
//! Q1, Q2:  (Q(s, a) - y)^2 / 2
//! pi:      alpha ln pi(a|s) - min(Q1, Q2)(s, a),  a ~ pi(s)
//! alpha:   -ln alpha (ln pi(a|s) - number of actions),  so that the entropy becomes minus the number of actions
//! ```
//!
//! `Q'` are slow copies of the value networks: `Q' <- Q' + tau (Q - Q')`. All parts take a step of Adam at once. A batch
//! is made of blocks: sixteen agents at one moment, moments and blocks by chance. The parameters are `policy, Q1, Q2, ln alpha`.

use crate::algorithms::loss::LossSums;
use crate::algorithms::parameters::Learner;
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::noise::{Noise, SAMPLES, SplitMix};
use crate::nets::mlp::{CHUNK, Tape};
use crate::nets::normalize::{Normalize, Normalizer};
use crate::nets::squash::{Draw, LOG_STD, Normals, Objective};
use crate::optim::adam;
use crate::rollout::replay::{Batch, Replay};
use crate::trainer::workers::Update;
use crate::trainer::{NETWORKS, Run};
use marathon_physics::lanes::{Isa, Real};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::sync::RwLock;

/// What only SAC has.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sac {
    /// Agent-steps that are kept, rounded down to whole decisions of all agents.
    pub replay: usize,
    /// Agent-steps before the first update.
    pub warmup: u64,
    /// Samples of an update, a multiple of 16.
    pub batch: usize,
    /// Updates after each rollout.
    pub updates: usize,
    /// Part of the way that the slow value networks go in an update.
    pub tau: f64,
    /// Rewards that count before the value of the state that they lead to.
    pub n_step: usize,
    /// Weight of the entropy at the start.
    pub init_alpha: f64,
}

impl Default for Sac {
    fn default() -> Self {
        Self { replay: 1_000_000, warmup: 10_000, batch: 256, updates: 32, tau: 0.005, n_step: 1, init_alpha: 0.2 }
    }
}

/// What the workers share.
pub struct Shared {
    /// Of each worker's blocks.
    pub replays: Vec<RwLock<Replay>>,
}

impl Shared {
    /// For workers with so many blocks each.
    pub fn new(settings: &Sac, agents: usize, blocks: &[usize], sizes: (usize, usize)) -> Self {
        let slots = (settings.replay / agents).max(1);
        Self { replays: blocks.iter().map(|n| RwLock::new(Replay::new(*n, slots, sizes))).collect() }
    }
}

/// Work space of a worker.
pub struct Space {
    batch: Batch,
    obs: Blocks<f32>,
    joined: Blocks<f32>,
    actor: Tape<f32>,
    critics: [Tape<f32>; 2],
    inputs: [Blocks<f32>; 2],
    z: Vec<f32>,
    action: Vec<f32>,
    log_prob: Vec<f32>,
    target: Vec<f32>,
    gradient: Vec<f32>,
}

impl Space {
    /// For a run.
    pub fn new(run: &Run<'_>) -> Self {
        let (layout, act) = (&run.layout, run.spec.act);
        let row = |n: usize| vec![0.0; n * CHUNK * BLOCK];
        Self {
            batch: Batch::default(),
            obs: layout.actor.input(),
            joined: layout.critic.input(),
            actor: layout.actor.tape(),
            critics: [layout.critic.tape(), layout.critic.tape()],
            inputs: [layout.critic.input(), layout.critic.input()],
            z: row(act),
            action: row(act),
            log_prob: row(1),
            target: row(1),
            gradient: vec![0.0; layout.len],
        }
    }
}

/// Takes the rollout in and makes the updates.
pub fn update(mut update: Update<'_>, settings: &Sac) {
    let run = update.run;
    let shared = run.sac.as_ref().expect("a run with SAC has replays");
    shared.replays[update.id].write().expect("no worker has panicked").push(update.own_rollout());
    update.wait();
    let experienced = update.learner.steps + run.config.rollout_steps();
    if update.learner.iteration == 0 || experienced < settings.warmup {
        return;
    }
    let replays: Vec<_> = shared.replays.iter().map(|r| r.read().expect("no worker has panicked")).collect();
    let filled = replays[0].filled();
    if filled < settings.n_step {
        return;
    }
    let normalizer = update.learner.normalizer(run.config);
    update.learner.lr = run.config.lr * run.linear(update.learner);
    let place = update.place.clone();
    for u in 0..settings.updates {
        let draw = update.learner.iteration * settings.updates as u64 + u as u64;
        let mut random = SplitMix::new(run.config.seed, draw | SAMPLES);
        let ages = filled - settings.n_step + 1;
        let pick =
            |random: &mut SplitMix| (random.below(run.config.blocks()), settings.n_step - 1 + random.below(ages));
        let picks: Vec<(usize, usize)> = (0..settings.batch / BLOCK).map(|_| pick(&mut random)).collect();
        let sums = update.share_out(u, picks.len(), |group, learner, partial, space| {
            let space = space.sac.as_mut().expect("a worker of SAC has space for it");
            partial.sums = LossSums::default();
            for (i, chunk) in picks[group.clone()].chunks(CHUNK).enumerate() {
                fill(&mut space.batch);
                for (block, age) in chunk {
                    let (worker, local) = place[*block];
                    replays[worker].sample(local, *age, settings.n_step, run.config.gamma, &mut space.batch);
                }
                // noise belongs to the update and the place in the batch
                let first = group.start + i * CHUNK;
                let noise = |b: usize| Noise::of(run.config.seed, draw, (first + b) as u64);
                let mut noise: Vec<Noise> = (0..chunk.len()).map(noise).collect();
                let whole =
                    if i == 0 { std::mem::take(&mut partial.gradient) } else { std::mem::take(&mut space.gradient) };
                let (gradient, sums) = gradient(run, learner, &normalizer, &mut noise, space, whole);
                partial.sums += sums;
                if i == 0 {
                    partial.gradient = gradient;
                } else {
                    adam::add(run.isa, &mut partial.gradient, &gradient);
                    space.gradient = gradient;
                }
            }
        });
        step(&mut update, settings, &sums);
    }
}

fn fill(batch: &mut Batch) {
    let Batch { obs, next, action, reward, discount } = batch;
    [obs, next, action, reward, discount].into_iter().for_each(Vec::clear);
}

/// Gradient of all parts over a chunk of samples, in `gradient`, which is returned with the sums of the losses.
fn gradient(
    run: &Run<'_>,
    learner: &Learner,
    normalizer: &Normalizer,
    noise: &mut [Noise],
    space: &mut Space,
    mut gradient: Vec<f32>,
) -> (Vec<f32>, LossSums) {
    let (layout, isa, act, n) = (&run.layout, run.isa, run.spec.act, noise.len());
    let twin = layout.twin.as_ref().expect("a layout of SAC has two value networks");
    let params = &learner.params;
    let (actor, critics) = (layout.actor_params(params), layout.critics(params));
    let alpha = Real::exp(params[twin.alpha] as f64);
    let Space { batch, obs, joined, actor: tape, critics: tapes, inputs, z, action, log_prob, target, .. } = space;
    let (z, action) = (&mut z[..n * act * BLOCK], &mut action[..n * act * BLOCK]);
    let log_prob = &mut log_prob[..n * BLOCK];

    // what the value networks should say
    normalize(isa, normalizer, &batch.next, obs);
    layout.actor.forward(isa, actor, obs, tape, n);
    draw(isa, tape.output(), noise, (z, action, log_prob), act);
    join(obs, action, act, joined, n);
    for (tape, slow) in tapes.iter_mut().zip(layout.critics_of_targets(&learner.targets)) {
        layout.critic.forward(isa, slow, joined, tape, n);
    }
    for i in 0..n * BLOCK {
        let of = |tape: &Tape<f32>| tape.output().block(i / BLOCK)[i % BLOCK];
        let soft = Real::min(of(&tapes[0]), of(&tapes[1])) - alpha as f32 * log_prob[i];
        let discount = batch.discount[i];
        target[i] = batch.reward[i] + if discount > 0.0 { discount * soft } else { 0.0 };
    }

    // value networks
    let mut sums = LossSums { samples: (n * BLOCK) as f64, ..LossSums::default() };
    normalize(isa, normalizer, &batch.obs, obs);
    join(obs, &batch.action, act, joined, n);
    let starts = [layout.critic_start, twin.second];
    for ((tape, params), start) in tapes.iter_mut().zip(critics).zip(starts) {
        layout.critic.forward(isa, params, joined, tape, n);
        let (output, delta) = tape.output_and_delta();
        for b in 0..n {
            for (lane, (d, q)) in delta.block_mut(b).iter_mut().zip(output.block(b)).enumerate() {
                *d = q - target[b * BLOCK + lane];
                sums.value += 0.5 * (*d as f64) * (*d as f64);
            }
        }
        let part = &mut gradient[start..start + layout.critic.len()];
        layout.critic.backward(isa, params, joined, tape, part, n);
    }

    // policy: the derivative of the smaller value with respect to the action
    layout.actor.forward(isa, actor, obs, tape, n);
    draw(isa, tape.output(), noise, (z, action, log_prob), act);
    join(obs, action, act, joined, n);
    for (tape, params) in tapes.iter_mut().zip(critics) {
        layout.critic.forward(isa, params, joined, tape, n);
    }
    let [one, two] = tapes;
    for b in 0..n {
        let (q1, d1) = one.output_and_delta();
        let (q2, d2) = two.output_and_delta();
        let rows = q1.block(b).iter().zip(q2.block(b)).zip(d1.block_mut(b).iter_mut().zip(d2.block_mut(b)));
        for (lane, ((q1, q2), (d1, d2))) in rows.enumerate() {
            let first = q1 <= q2;
            (*d1, *d2) = (if first { -1.0 } else { 0.0 }, if first { 0.0 } else { -1.0 });
            let lp = log_prob[b * BLOCK + lane] as f64;
            sums.policy += alpha * lp - if first { *q1 } else { *q2 } as f64;
            sums.entropy -= lp;
        }
    }
    for ((tape, params), input) in [one, two].into_iter().zip(critics).zip(inputs.iter_mut()) {
        layout.critic.input_gradient(isa, params, tape, input, n);
    }
    let minus_q = [&inputs[0], &inputs[1]];
    f32_lanes!(isa, T => <T as Real>::enter(Objective::<T> {
        output: tape.output_and_delta(), z, action, minus_q, first: run.spec.obs, alpha, act, blocks: n, lanes: PhantomData,
    }));
    let (part, rest) = gradient.split_at_mut(layout.actor.len());
    layout.actor.backward(isa, actor, obs, tape, part, n);
    rest[..act].fill(0.0);

    // weight of the entropy, and the mean deviation
    gradient[twin.alpha] = log_prob.iter().map(|lp| act as f64 - *lp as f64).sum::<f64>() as f32;
    for b in 0..n {
        let logs = &tape.output().block(b)[act * BLOCK..];
        let std = |l: &f32| Real::exp((*l as f64).clamp(LOG_STD[0], LOG_STD[1]));
        sums.std += logs.iter().map(std).sum::<f64>() / act as f64;
    }
    (gradient, sums)
}

fn normalize(isa: Isa, normalizer: &Normalizer, raw: &[f32], input: &mut Blocks<f32>) {
    f32_lanes!(isa, T => <T as Real>::enter(Normalize::<T> {
        normalizer, raw, input, copy: None, sums: None, lanes: PhantomData,
    }));
}

/// Draws actions with the next numbers of each block's noise.
fn draw(
    isa: Isa,
    output: &Blocks<f32>,
    noise: &mut [Noise],
    (z, action, log_prob): (&mut [f32], &mut [f32], &mut [f32]),
    act: usize,
) {
    let blocks = noise.len();
    f32_lanes!(isa, T => {
        <T as Real>::enter(Normals::<T> { noise, z: &mut *z, act, lanes: PhantomData });
        <T as Real>::enter(Draw::<T> { output, z, act, action, log_prob, blocks, lanes: PhantomData });
    });
}

/// Observations and actions side by side.
fn join(obs: &Blocks<f32>, action: &[f32], act: usize, joined: &mut Blocks<f32>, n: usize) {
    for (b, action) in action.chunks_exact(act * BLOCK).take(n).enumerate() {
        let (first, second) = joined.block_mut(b).split_at_mut(obs.features() * BLOCK);
        first.copy_from_slice(obs.block(b));
        second.copy_from_slice(action);
    }
}

/// One step of Adam of all parts, and of the slow value networks.
fn step(update: &mut Update<'_>, settings: &Sac, sums: &LossSums) {
    let (run, learner) = (update.run, &mut *update.learner);
    if !run.squares().iter().all(|s| s.is_finite()) {
        learner.skipped += 1;
        return;
    }
    learner.adam.advance();
    let value_lr = run.config.value_lr * run.linear(learner);
    let lr: [f64; NETWORKS] = [learner.lr, value_lr, value_lr, learner.lr];
    run.pieces(|range, gradient| {
        let net = run.layout.network(&range);
        learner.adam.update(run.isa, &mut learner.params, range, gradient, 1.0 / sums.samples, lr[net]);
    });
    let (tau, start) = (settings.tau as f32, run.layout.critic_start);
    for (slow, fast) in learner.targets.iter_mut().zip(&learner.params[start..]) {
        *slow += tau * (fast - *slow);
    }
}
