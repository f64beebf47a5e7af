//! Derivatives equal finite differences, in double precision lanes, for every activation, both value losses and both
//! ratios.

use crate::common::numbers::{noise, worst};
use marathon_learn::algorithms::loss::{Loss, LossSums, Objective};
use marathon_learn::lanes::buffer::Blocks;
use marathon_learn::nets::gaussian::Gaussian;
use marathon_learn::nets::mlp::Mlp;
use marathon_learn::rollout::data::Samples;
use marathon_learn::{Activation, BLOCK, Ratio};
use marathon_physics::lanes::Real;
use std::marker::PhantomData;

const BLOCKS: usize = 3;

fn fill(net: &Mlp, salt: u64) -> Blocks<f64> {
    let mut input = net.input();
    for b in 0..BLOCKS {
        let row = noise(net.sizes()[0] * BLOCK, salt + b as u64);
        input.block_mut(b).copy_from_slice(&row);
    }
    input
}

#[test]
fn network_gradients_equal_finite_differences() {
    for activation in Activation::ALL {
        // widths that use every size of tile
        for sizes in [&[5, 11, 9, 3][..], &[7, 4], &[1, 2, 1], &[8, 7, 13, 6, 2]] {
            let net = Mlp::new(sizes, activation);
            let params: Vec<f64> = noise(net.len(), 3).iter().map(|x| x * 1.2).collect();
            let input = fill(&net, 40);
            let targets: Vec<Vec<f64>> =
                (0..BLOCKS).map(|b| noise(sizes[sizes.len() - 1] * BLOCK, 70 + b as u64)).collect();
            let (mut tape, mut gradient) = (net.tape(), vec![0.0; net.len()]);
            // half the squared distance to the targets
            let mut loss = |params: &[f64], gradient: Option<&mut [f64]>| {
                net.forward_on::<f64>(params, &input, &mut tape, BLOCKS);
                let mut total = 0.0;
                for (b, target) in targets.iter().enumerate() {
                    let (output, delta) = tape.output_and_delta();
                    for ((d, y), t) in delta.block_mut(b).iter_mut().zip(output.block(b)).zip(target) {
                        *d = y - t;
                        total += 0.5 * (y - t) * (y - t);
                    }
                }
                if let Some(gradient) = gradient {
                    net.backward_on::<f64>(params, &input, &mut tape, gradient, BLOCKS);
                }
                total
            };
            loss(&params, Some(&mut gradient));
            let error = worst(&gradient, &params, |p| loss(p, None));
            assert!(error < 1e-7, "{} {sizes:?}: {error}", activation.name());
        }
    }
}

/// A whole minibatch: both networks, the log standard deviations, and rollout data in every position to the clip ranges.
struct Case {
    actor: Mlp,
    critic: Mlp,
    input: Blocks<f64>,
    data: Vec<[Vec<f64>; 5]>,
    objective: Objective,
}

impl Case {
    fn new(ratio: Ratio, value_clip: Option<f64>) -> Self {
        let actor = Mlp::new(&[6, 10, 7, 3], Activation::Tanh);
        let critic = Mlp::new(&[6, 9, 1], Activation::Swish);
        let objective =
            Objective { ratio, clip: 0.2, value_clip, entropy_coef: 0.013, advantage_mean: 0.1, advantage_scale: 1.7 };
        let rows = if ratio == Ratio::Joint { 1 } else { 3 };
        let row = |n, salt, scale| noise(n * BLOCK, salt).iter().map(|x| x * scale).collect::<Vec<f64>>();
        let data = (0..BLOCKS as u64).map(|b| {
            // old log-probabilities near the new ones (about -2), so that ratios lie inside and outside the clip range
            let log_prob = row(rows, 30 + b, 1.5).iter().map(|x| x - 1.0 / rows as f64).collect();
            [row(3, 20 + b, 1.0), log_prob, row(1, 50 + b, 2.0), row(1, 60 + b, 1.0), row(1, 80 + b, 2.0)]
        });
        Self { input: fill(&actor, 10), data: data.collect(), actor, critic, objective }
    }

    /// Sums and the gradient with respect to `[actor | log std | critic]`.
    fn evaluate(&self, params: &[f64]) -> (LossSums, Vec<f64>) {
        let (n, m) = (self.actor.len(), self.actor.len() + 3);
        let (mut actor, mut critic) = (self.actor.tape(), self.critic.tape());
        self.actor.forward_on::<f64>(&params[..n], &self.input, &mut actor, BLOCKS);
        self.critic.forward_on::<f64>(&params[m..], &self.input, &mut critic, BLOCKS);
        let samples: Vec<Samples<'_, f64>> = self
            .data
            .iter()
            .map(|[action, log_prob, advantage, value, target]| Samples {
                decided: !0,
                action,
                log_prob,
                advantage,
                value,
                target,
            })
            .collect();
        let mut gradient = vec![0.0; params.len()];
        let sums = f64::enter(Loss::<f64> {
            objective: self.objective,
            gaussian: &Gaussian::new(&params[n..m]),
            samples: &samples,
            mean: actor.output_and_delta(),
            value: critic.output_and_delta(),
            d_log_std: &mut gradient[n..m],
            rows: &mut vec![[0.0; BLOCK]; 3],
            lanes: PhantomData,
        });
        self.actor.backward_on::<f64>(&params[..n], &self.input, &mut actor, &mut gradient[..n], BLOCKS);
        self.critic.backward_on::<f64>(&params[m..], &self.input, &mut critic, &mut gradient[m..], BLOCKS);
        (sums, gradient)
    }

    fn params(&self) -> Vec<f64> {
        noise(self.actor.len() + 3 + self.critic.len(), 5).iter().map(|x| x * 0.8).collect()
    }
}

#[test]
fn objective_gradients_equal_finite_differences() {
    for (ratio, value_clip) in [(Ratio::Joint, None), (Ratio::Joint, Some(0.4)), (Ratio::PerAction, None)] {
        let case = Case::new(ratio, value_clip);
        let params = case.params();
        let (sums, gradient) = case.evaluate(&params);
        let n = sums.samples;
        assert!(sums.clipped > 0.2 * n && sums.clipped < 0.8 * n, "both sides of the clip range: {sums:?}");
        let (net, m) = (case.actor.len(), case.actor.len() + 3);
        // the entropy is not part of the sums: it depends on the log standard deviations alone
        let policy = |p: &[f64]| {
            let entropy = Gaussian::new(&p[net..m]).entropy() / if ratio == Ratio::Joint { 1.0 } else { 3.0 };
            case.evaluate(p).0.policy - case.objective.entropy_coef * entropy * n
        };
        let pad = |f: &dyn Fn(&[f64]) -> f64, part: &[f64], at: usize| {
            let mut whole = params.clone();
            whole[at..at + part.len()].copy_from_slice(part);
            f(&whole)
        };
        let error = worst(&gradient[..m], &params[..m], |p| pad(&policy, p, 0));
        assert!(error < 1e-7, "policy, {ratio:?}: {error}");
        let value = |p: &[f64]| case.evaluate(p).0.value;
        let error = worst(&gradient[m..], &params[m..], |p| pad(&value, p, m));
        assert!(error < 1e-7, "value, clip {value_clip:?}: {error}");
    }
}

/// With unchanged parameters the ratio is one: nothing is clipped, the divergence is zero, and the policy's gradient is
/// that of the plain policy gradient.
#[test]
fn nothing_is_clipped_before_the_first_step() {
    let gradients = [Ratio::Joint, Ratio::PerAction].map(|ratio| {
        let mut case = Case::new(ratio, None);
        case.objective.entropy_coef = 0.0;
        let params = case.params();
        let (net, m) = (case.actor.len(), case.actor.len() + 3);
        let mut tape = case.actor.tape();
        case.actor.forward_on::<f64>(&params[..net], &case.input, &mut tape, BLOCKS);
        let gaussian = Gaussian::new(&params[net..m]);
        for (b, data) in case.data.iter_mut().enumerate() {
            for lane in 0..BLOCK {
                let at = |k: usize| k * BLOCK + lane;
                let z = |k: usize| (data[0][at(k)] - tape.output().block(b)[at(k)]) / gaussian.std[k];
                let lp = [0, 1, 2].map(|k| -0.5 * z(k) * z(k) - gaussian.log_std[k]);
                match ratio {
                    Ratio::Joint => data[1][lane] = lp.iter().sum(),
                    Ratio::PerAction => (0..3).for_each(|k| data[1][at(k)] = lp[k]),
                }
            }
        }
        let (sums, gradient) = case.evaluate(&params);
        let advantage: f64 = case.data.iter().flat_map(|d| &d[2]).map(|a| (a - 0.1) * 1.7).sum();
        assert!(sums.clipped == 0.0 && sums.kl.abs() < 1e-12 && (sums.policy + advantage).abs() < 1e-9, "{sums:?}");
        gradient[..m].to_vec()
    });
    // a ratio per action: the mean over the actions instead of the sum
    for (joint, each) in gradients[0].iter().zip(&gradients[1]) {
        assert!((joint - 3.0 * each).abs() < 1e-9 * (1.0 + joint.abs()), "{joint} {each}");
    }
}
