//! Advantage actor-critic (Mnih et al., "Asynchronous methods for deep reinforcement learning", 2016), synchronous, as in
//! the paper's comparison: one step of RMSProp on each short rollout.
//!
//! Minimized per sample, with `A` the advantage as it is (not normalized) and `R` the return:
//!
//! ```text
//! -A log pi(a|s) - entropy_coef H + value_coef (V - R)^2
//! ```
//!
//! The rollout was drawn from the policy that is updated, so the gradient of the clipped ratio at ratio 1 is that of
//! `A log pi`: the gradient comes from the same code as PPO's. The bound of its norm is for both networks together.

use crate::algorithms::loss::{LossSums, Objective};
use crate::lanes::f32_lanes;
use crate::trainer::NETWORKS;
use crate::trainer::config::Ratio;
use crate::trainer::workers::Update;
use marathon_physics::lanes::{Isa, Kernel, Real};
use serde::{Deserialize, Serialize};

/// Far outside of what the ratio of a policy to itself can reach by rounding.
const NO_CLIP: f64 = 1e9;

/// What only A2C has; the defaults are those of the paper's comparison (OpenAI Baselines with the weight of the value
/// loss and the rate that its authors chose).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct A2c {
    /// Weight of the value function's squared error.
    pub value_coef: f64,
    /// Decay of RMSProp's mean square.
    pub rms_decay: f64,
    /// Added to the mean square under the root.
    pub rms_epsilon: f64,
}

impl Default for A2c {
    fn default() -> Self {
        Self { value_coef: 0.25, rms_decay: 0.99, rms_epsilon: 1e-5 }
    }
}

/// One step on one rollout.
pub fn update(mut update: Update<'_>, settings: &A2c) {
    let items: Vec<u32> = (0..update.run.items() as u32).collect();
    let objective = objective(&update);
    let sums = update.gradient(&items, 0, objective);
    update.learner.lr = update.run.config.lr * update.run.linear(update.learner);
    step(&mut update, settings, &sums);
}

/// The objective of an actor-critic method without a bound of the ratio.
pub fn objective(update: &Update<'_>) -> Objective {
    let config = update.run.config;
    Objective {
        ratio: Ratio::Joint,
        clip: NO_CLIP,
        value_clip: None,
        entropy_coef: update.run.moved(update.learner, config.entropy_coef, config.final_entropy_coef),
        advantage_mean: 0.0,
        advantage_scale: 1.0,
    }
}

fn step(update: &mut Update<'_>, settings: &A2c, sums: &LossSums) {
    let (run, learner) = (update.run, &mut *update.learner);
    // the gradient at hand is that of (V - R)^2 / 2
    let weight = [1.0, 2.0 * settings.value_coef];
    let [policy, value, ..] = run.squares();
    let norm = (policy + weight[1] * weight[1] * value).sqrt() / sums.samples;
    if !norm.is_finite() {
        learner.skipped += 1;
        return;
    }
    let bound = (run.config.max_grad_norm / norm).min(1.0) / sums.samples;
    // each signal has a rate of its own, and its gradient is not bounded
    let mut lr = [learner.lr; NETWORKS];
    lr[2..].iter_mut().zip(&run.config.signals).for_each(|(lr, signal)| *lr = signal.lr);
    run.pieces(|range, gradient| {
        let net = run.layout.network(&range);
        let rms = RmsProp {
            params: &mut learner.params[range.clone()],
            mean_square: &mut learner.adam.v[range.clone()],
            gradient,
            scale: (if net < 2 { bound * weight[net] } else { 1.0 / sums.samples }) as f32,
            lr: lr[net] as f32,
            decay: settings.rms_decay,
            epsilon: settings.rms_epsilon,
        };
        rms.step(run.isa);
    });
    run.bound_std(learner);
}

/// RMSProp as TensorFlow has it: the constant is under the root, and the mean square starts at 1.
struct RmsProp<'a> {
    params: &'a mut [f32],
    mean_square: &'a mut [f32],
    gradient: &'a [f32],
    scale: f32,
    lr: f32,
    decay: f64,
    epsilon: f64,
}

impl RmsProp<'_> {
    fn step(self, isa: Isa) {
        f32_lanes!(isa, T => <T as Real>::enter(self))
    }
}

impl<T: Real<Scalar = f32>> Kernel<T> for RmsProp<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (scale, lr, epsilon) = (T::splat(self.scale), T::splat(self.lr), T::lit(self.epsilon));
        let (decay, rest) = (T::lit(self.decay), T::lit(1.0 - self.decay));
        let squares = self.mean_square.chunks_exact_mut(T::LANES).zip(self.gradient.chunks_exact(T::LANES));
        for (p, (s, g)) in self.params.chunks_exact_mut(T::LANES).zip(squares) {
            let g = T::load(g) * scale;
            let square = decay.mul_add(T::load(s), rest * g * g);
            square.store(s);
            (T::load(p) - (lr * g).div((square + epsilon).sqrt())).store(p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rms_prop_is_its_formula_on_every_width() {
        let gradient: Vec<f32> = (0..48).map(|i| (i as f32 - 20.0) * 0.1).collect();
        for isa in [Isa::F32, Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|isa| isa.supported()) {
            let (mut params, mut mean_square) = (vec![0.5f32; 48], vec![1.0f32; 48]);
            let (scale, lr) = (0.5, 0.01);
            let step = RmsProp {
                params: &mut params,
                mean_square: &mut mean_square,
                gradient: &gradient,
                scale,
                lr,
                decay: 0.9,
                epsilon: 1e-5,
            };
            step.step(isa);
            for i in 0..48 {
                let g = gradient[i] as f64 * 0.5;
                let square = 0.9 + 0.1 * g * g;
                let want = 0.5 - 0.01 * g / (square + 1e-5).sqrt();
                assert!((params[i] as f64 - want).abs() < 1e-6 && (mean_square[i] as f64 - square).abs() < 1e-6);
            }
        }
    }
}
