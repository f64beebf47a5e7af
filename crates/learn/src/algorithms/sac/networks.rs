//! The networks of SAC and the gradient of its three losses.

use crate::algorithms::Setup;
use crate::algorithms::loss::LossSums;
use crate::algorithms::parameters::Places;
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::noise::{Noise, PARAMETERS, SplitMix};
use crate::nets::mlp::{CHUNK, Mlp, Tape};
use crate::nets::normalize::{Normalize, Normalizer};
use crate::nets::squash::{Draw, LOG_STD, Normals, Objective};
use crate::rollout::data::Shape;
use crate::rollout::replay::Batch;
use marathon_physics::lanes::{Isa, Real};
use std::marker::PhantomData;

/// The networks without their parameters: `policy, Q1, Q2, ln alpha`.
#[derive(Clone)]
pub(super) struct Layout {
    pub obs: usize,
    pub act: usize,
    /// Outputs means and deviations.
    pub actor: Mlp,
    /// Takes observation and action.
    pub critic: Mlp,
    /// First parameters of the two value networks.
    pub critic_starts: [usize; 2],
    /// Index of the logarithm of the entropy weight.
    pub alpha: usize,
    pub places: Places,
}

impl Layout {
    pub fn new(setup: &Setup<'_>) -> Self {
        let (obs, act, network) = (setup.spec.obs, setup.spec.act, setup.common.network);
        let actor = Mlp::new(&[&[obs], &network.hidden[..], &[2 * act]].concat(), network.activation);
        let critic = Mlp::new(&[&[obs + act], network.critic(), &[1]].concat(), network.activation);
        let mut places = Places::default();
        // space for the deviations of other algorithms: saved files have the networks at these places
        places.add(actor.len() + act);
        let critic_starts = [(); 2].map(|()| places.add(critic.len()).start);
        let alpha = places.add(1).start;
        Self { obs, act, actor, critic, critic_starts, alpha, places }
    }
    pub fn shape(&self, lanes: usize) -> Shape {
        Shape { obs: self.obs, act: self.act, log_probs: 1, streams: 1, next_obs: true, lanes }
    }
    /// Parameters of the two value networks.
    pub fn critics<'a>(&self, params: &'a [f32]) -> [&'a [f32]; 2] {
        self.critic_starts.map(|start| &params[start..start + self.critic.len()])
    }
    /// Parameters of their slow copies.
    pub fn critics_of_targets<'a>(&self, targets: &'a [f32]) -> [&'a [f32]; 2] {
        self.critic_starts.map(|start| &targets[start - self.critic_starts[0]..][..self.critic.len()])
    }
}

/// The networks with their parameters.
#[derive(Clone)]
pub(super) struct Networks {
    pub layout: Layout,
    pub isa: Isa,
    pub params: Vec<f32>,
    /// Slow copies of the value networks.
    pub targets: Vec<f32>,
}

impl Networks {
    /// Creates the networks at the start of a run.
    pub fn new(setup: &Setup<'_>, init_alpha: f64) -> Self {
        let layout = Layout::new(setup);
        let mut params = vec![0.0; layout.places.total()];
        let mut random = SplitMix::new(setup.common.seed, PARAMETERS);
        let init = setup.common.network.initialization;
        init.policy(&layout.actor, &mut params, &mut random);
        for start in layout.critic_starts {
            init.value(&layout.critic, &mut params[start..], &mut random);
        }
        params[layout.alpha] = Real::ln(init_alpha) as f32;
        let targets = params[layout.critic_starts[0]..layout.alpha].to_vec();
        Self { layout, isa: setup.isa, params, targets }
    }
}

/// Work space of a worker.
pub(super) struct Space {
    pub batch: Batch,
    pub obs: Blocks<f32>,
    pub joined: Blocks<f32>,
    pub actor: Tape<f32>,
    pub critics: [Tape<f32>; 2],
    pub inputs: [Blocks<f32>; 2],
    pub z: Vec<f32>,
    pub action: Vec<f32>,
    pub log_prob: Vec<f32>,
    pub target: Vec<f32>,
    pub gradient: Vec<f32>,
}

impl Space {
    pub fn new(layout: &Layout) -> Self {
        let row = |n: usize| vec![0.0; n * CHUNK * BLOCK];
        Self {
            batch: Batch::default(),
            obs: layout.actor.input(),
            joined: layout.critic.input(),
            actor: layout.actor.tape(),
            critics: [layout.critic.tape(), layout.critic.tape()],
            inputs: [layout.critic.input(), layout.critic.input()],
            z: row(layout.act),
            action: row(layout.act),
            log_prob: row(1),
            target: row(1),
            gradient: vec![0.0; layout.places.total()],
        }
    }
}

/// Computes the gradient of all parts over a chunk of samples. Returns it with the sums of the losses.
pub(super) fn gradient(
    nets: &Networks,
    normalizer: &Normalizer,
    noise: &mut [Noise],
    space: &mut Space,
    gradient: &mut [f32],
) -> LossSums {
    // one function: a backward pass in order
    let (layout, isa, act, n) = (&nets.layout, nets.isa, nets.layout.act, noise.len());
    let params = &nets.params;
    let (actor, critics) = (&params[..layout.actor.len()], layout.critics(params));
    let alpha = Real::exp(params[layout.alpha] as f64);
    let Space { batch, obs, joined, actor: tape, critics: tapes, inputs, z, action, log_prob, target, .. } = space;
    let (z, action) = (&mut z[..n * act * BLOCK], &mut action[..n * act * BLOCK]);
    let log_prob = &mut log_prob[..n * BLOCK];

    // targets of the value networks
    normalize(isa, normalizer, &batch.next, obs);
    layout.actor.forward(isa, actor, obs, tape, n);
    draw(isa, tape.output(), noise, (z, action, log_prob), act);
    join(obs, action, act, joined, n);
    for (tape, slow) in tapes.iter_mut().zip(layout.critics_of_targets(&nets.targets)) {
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
    let starts = layout.critic_starts;
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
        output: tape.output_and_delta(), z, action, minus_q, first: layout.obs, alpha, act, blocks: n, lanes: PhantomData,
    }));
    let (part, rest) = gradient.split_at_mut(layout.actor.len());
    layout.actor.backward(isa, actor, obs, tape, part, n);
    rest[..act].fill(0.0);

    // gradient of the entropy weight, and mean deviation
    gradient[layout.alpha] = log_prob.iter().map(|lp| act as f64 - *lp as f64).sum::<f64>() as f32;
    for b in 0..n {
        let logs = &tape.output().block(b)[act * BLOCK..];
        let std = |l: &f32| Real::exp((*l as f64).clamp(LOG_STD[0], LOG_STD[1]));
        sums.std += logs.iter().map(std).sum::<f64>() / act as f64;
    }
    sums
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

/// Writes observations and actions side by side.
fn join(obs: &Blocks<f32>, action: &[f32], act: usize, joined: &mut Blocks<f32>, n: usize) {
    for (b, action) in action.chunks_exact(act * BLOCK).take(n).enumerate() {
        let (first, second) = joined.block_mut(b).split_at_mut(obs.features() * BLOCK);
        first.copy_from_slice(obs.block(b));
        second.copy_from_slice(action);
    }
}
