//! Actor-critic with the natural gradient and a trust region (Wu et al., "Scalable trust-region method for deep
//! reinforcement learning using Kronecker-factored approximation", 2017).
//!
//! The objective is A2C's. What differs is the step: the gradient of each layer is multiplied by the inverse of its block
//! of the Fisher matrix, which [`kfac`](crate::optim::kfac) approximates, and the step is shortened where it would change the
//! distribution of the actions by more than `kl_clip`:
//!
//! ```text
//! d = F^-1 g        eta = min(lr, sqrt(2 kl_clip / d'g))        m <- momentum m + (1 - momentum) eta d        p <- p - m
//! ```
//!
//! Policy and value function are separate networks and have a step length each; the value is taken for the mean of a
//! normal distribution of deviation 1, whose Fisher matrix is that of Gauss and Newton. The deviations of the actions are
//! parameters of their own: their block of the Fisher matrix is known, 2 for each logarithm.
//!
//! Unlike OpenAI Baselines, no updates with another optimizer come first (the running means of the factors weigh the
//! first rollouts alike instead), and the damping is split between the factors (Martens and Grosse, 2015, section 6.3).

use crate::algorithms::a2c;
use crate::trainer::workers::Update;
use serde::{Deserialize, Serialize};

/// What only ACKTR has; the defaults are those of OpenAI Baselines.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Acktr {
    /// Weight of the value function's squared error.
    pub value_coef: f64,
    /// Divergence that a step may cause, nats; in the value network half the mean squared change.
    pub kl_clip: f64,
    /// Decay of the sum of steps.
    pub momentum: f64,
    /// Added to the Fisher matrix.
    pub damping: f64,
    /// Decay of the running means of the factors.
    pub stats_decay: f64,
    /// Updates from one inversion of the factors to the next; the first so many updates invert every time.
    pub inverse_every: u64,
}

impl Default for Acktr {
    fn default() -> Self {
        Self { value_coef: 0.5, kl_clip: 1e-3, momentum: 0.9, damping: 0.01, stats_decay: 0.99, inverse_every: 10 }
    }
}

/// One step on one rollout.
pub fn update(mut update: Update<'_>, settings: &Acktr) {
    let run = update.run;
    let kfac = run.kfac.as_ref().expect("a run with ACKTR has factors");
    let items: Vec<u32> = (0..run.items() as u32).collect();
    let objective = a2c::objective(&update);
    let sums = update.gradient(&items, 0, objective);
    let gradient = update.whole_gradient().to_vec();
    let mean = 1.0 / sums.samples;
    // the gradient at hand is that of (V - R)^2 / 2
    let scale = [mean, mean * 2.0 * settings.value_coef];

    // factors, inverses and natural gradients, a layer at a time, shared out among the workers
    let count = update.learner.iteration;
    let refresh = count <= settings.inverse_every || count.is_multiple_of(settings.inverse_every);
    // all rollouts weigh the same at first
    let decay = settings.stats_decay.min(1.0 - 1.0 / count as f64);
    let partials = update.partials(items.len());
    while let Some(l) = update.take(1, kfac.count()) {
        let mut layer = kfac.layer(l);
        layer.merge(partials.iter().map(|p| &p.moments[..]), sums.samples, decay);
        if refresh {
            layer.invert(settings.damping);
        }
        let scale = scale[layer.network];
        layer.natural(run.isa, &gradient, scale);
    }
    drop(partials);
    update.wait();

    let learner = &mut *update.learner;
    learner.lr = run.config.lr * run.linear(learner);
    let log_std = run.layout.log_std.clone();
    let of_std = |i: usize| gradient[i] as f64 * scale[0] / (2.0 + settings.damping);
    let mut products = [0.0; 2];
    products[0] = log_std.clone().map(|i| of_std(i) * gradient[i] as f64 * scale[0]).sum();
    (0..kfac.count()).map(|l| kfac.layer(l)).for_each(|layer| products[layer.network] += layer.product);
    if products.iter().all(|p| p.is_finite() && *p >= 0.0) {
        // a product of zero asks for no step: any length will do
        let length = products.map(|p| learner.lr.min((2.0 * settings.kl_clip / p.max(1e-300)).sqrt()));
        let mut step = |i: usize, d: f64, length: f64| {
            let m = &mut learner.adam.m[i];
            *m = (settings.momentum * *m as f64 + (1.0 - settings.momentum) * length * d) as f32;
            learner.params[i] -= *m;
        };
        log_std.for_each(|i| step(i, of_std(i), length[0]));
        for l in 0..kfac.count() {
            let layer = kfac.layer(l);
            let places = layer.weights.start..layer.biases.end;
            for (i, d) in places.zip(&layer.step) {
                step(i, *d as f64, length[layer.network]);
            }
        }
        run.bound_std(learner);
        update.set_kl(0.5 * length[0] * length[0] * products[0], &sums);
    } else {
        learner.skipped += 1;
    }
    update.wait();
}
