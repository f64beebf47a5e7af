//! Proximal policy optimization (Schulman et al., 2017): what it does with a rollout, from top to bottom.
//!
//! `epochs` times, the rollout of all workers is shuffled and split into minibatches; each gives one step of Adam on the
//! clipped objective of [`loss`](crate::algorithms::loss). [`run`](crate::trainer) is what leads here: acting, advantages, threads.

use crate::algorithms::loss::{LossSums, Objective};
use crate::lanes::noise::{SHUFFLES, SplitMix};
use crate::trainer::config::Schedule;
use crate::trainer::workers::Update;
use crate::trainer::{NETWORKS, share};

/// All epochs over one rollout.
pub fn update(mut update: Update<'_>) {
    let config = update.run.config;
    let objective = objective(&update);
    let mut items: Vec<u32> = (0..update.run.items() as u32).collect();
    if config.schedule == Schedule::Linear {
        update.learner.lr = config.lr * update.run.linear(update.learner);
    }
    for epoch in 0..config.epochs {
        let draw = update.learner.iteration * config.epochs as u64 + epoch as u64;
        SplitMix::new(config.seed, draw | SHUFFLES).shuffle(&mut items);
        for m in 0..config.minibatches {
            let batch = &items[share(items.len(), config.minibatches, m)];
            let sums = update.gradient(batch, epoch * config.minibatches + m, objective);
            step(&mut update, &sums);
        }
    }
}

/// The objective with the settings of this moment; advantages are normalized over the rollout.
fn objective(update: &Update<'_>) -> Objective {
    let config = update.run.config;
    let moved = |first, last| update.run.moved(update.learner, first, last);
    let (mean, var) = update.totals.advantage();
    let clip = moved(config.clip, config.final_clip);
    Objective {
        ratio: config.ratio,
        clip,
        value_clip: config.value_clip.map(|range| range * (clip / config.clip)),
        entropy_coef: moved(config.entropy_coef, config.final_entropy_coef),
        advantage_mean: mean,
        advantage_scale: 1.0 / var.max(1e-12).sqrt(),
    }
}

/// One step of Adam on the worker's replica, each network's gradient bounded by itself.
fn step(update: &mut Update<'_>, sums: &LossSums) {
    let (run, learner) = (update.run, &mut *update.learner);
    let (config, isa) = (run.config, run.isa);
    let squares = run.squares();
    if !squares.iter().all(|s| s.is_finite()) {
        learner.skipped += 1;
        return;
    }
    let mean = 1.0 / sums.samples;
    let scale = squares.map(|s| mean * (config.max_grad_norm / (s.sqrt() * mean)).min(1.0));

    learner.adam.advance();
    let value_lr = if config.schedule == Schedule::Linear { learner.lr / config.lr } else { 1.0 } * config.value_lr;
    // each signal has a rate of its own
    let mut lr = [0.0; NETWORKS];
    lr[..2].copy_from_slice(&[learner.lr, value_lr]);
    lr[2..].iter_mut().zip(&config.signals).for_each(|(lr, signal)| *lr = signal.lr);
    run.pieces(|range, gradient| {
        let net = run.layout.network(&range);
        learner.adam.update(isa, &mut learner.params, range, gradient, scale[net], lr[net]);
    });
    run.bound_std(learner);

    if config.schedule == Schedule::Adaptive {
        let kl = sums.kl * mean;
        let target = run.moved(learner, config.target_kl, config.final_target_kl);
        if kl > 2.0 * target {
            learner.lr = (learner.lr / 1.5).max(config.lr_range[0]);
        } else if kl < 0.5 * target {
            learner.lr = (learner.lr * 1.2).min(config.lr_range[1]);
        }
    }
}
