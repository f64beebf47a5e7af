//! The squashed policy of SAC: derivatives of its objective equal finite differences in double precision, and its
//! log-probabilities belong to a density.

use crate::common::numbers::noise;
use marathon_learn::BLOCK;
use marathon_learn::lanes::buffer::Blocks;
use marathon_learn::nets::squash::{Draw, Objective};
use marathon_physics::lanes::Real;
use std::marker::PhantomData;

const ACT: usize = 3;
const ALPHA: f64 = 0.3;

fn draw(output: &[f64], z: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut blocks = Blocks::new(1, 2 * ACT);
    blocks.block_mut(0).copy_from_slice(output);
    let (mut action, mut log_prob) = (vec![0.0; ACT * BLOCK], vec![0.0; BLOCK]);
    f64::enter(Draw::<f64> {
        output: &blocks,
        z,
        act: ACT,
        action: &mut action,
        log_prob: &mut log_prob,
        blocks: 1,
        lanes: PhantomData,
    });
    (action, log_prob)
}

#[test]
fn derivatives_equal_finite_differences() {
    let (output, z) = (noise(2 * ACT * BLOCK, 1), noise(ACT * BLOCK, 2));
    // -Q is the sum of two linear functions of the action
    let slopes = [noise(ACT * BLOCK, 3), noise(ACT * BLOCK, 4)];
    let loss = |output: &[f64]| {
        let (action, log_prob) = draw(output, &z);
        let minus_q: f64 = slopes.iter().flat_map(|s| s.iter().zip(&action).map(|(s, a)| s * a)).sum();
        ALPHA * log_prob.iter().sum::<f64>() + minus_q
    };
    let (action, _) = draw(&output, &z);
    let (mut blocks, mut delta) = (Blocks::new(1, 2 * ACT), Blocks::new(1, 2 * ACT));
    blocks.block_mut(0).copy_from_slice(&output);
    let inputs: Vec<Blocks<f64>> = slopes
        .iter()
        .map(|slope| {
            // two features of the state come first
            let mut input = Blocks::new(1, 2 + ACT);
            input.block_mut(0)[2 * BLOCK..].copy_from_slice(slope);
            input
        })
        .collect();
    f64::enter(Objective::<f64> {
        output: (&blocks, &mut delta),
        z: &z,
        action: &action,
        minus_q: [&inputs[0], &inputs[1]],
        first: 2,
        alpha: ALPHA,
        act: ACT,
        blocks: 1,
        lanes: PhantomData,
    });
    for i in 0..output.len() {
        let (mut up, mut down, h) = (output.clone(), output.clone(), 1e-6);
        up[i] += h;
        down[i] -= h;
        let want = (loss(&up) - loss(&down)) / (2.0 * h);
        assert!((want - delta.block(0)[i]).abs() < 1e-6, "{i}: {want} {}", delta.block(0)[i]);
    }
}

/// The density of one action, integrated over a grid of actions, is one.
#[test]
fn probabilities_add_up_to_one() {
    let (mean, log_std) = (0.4, -0.7);
    let mut total = 0.0;
    const N: usize = 20_000;
    for i in (0..N).step_by(BLOCK) {
        let a = |lane: usize| (2 * (i + lane) + 1) as f64 / N as f64 - 1.0;
        let mut output = vec![0.0; 2 * ACT * BLOCK];
        let mut z = vec![0.0; ACT * BLOCK];
        for lane in 0..BLOCK {
            output[lane] = mean;
            output[ACT * BLOCK + lane] = log_std;
            z[lane] = (a(lane).atanh() - mean) / log_std.exp();
        }
        let (action, log_prob) = draw(&output, &z);
        // the other two actions are at z = 0, mean 0 and deviation 1
        let others = -(ACT as f64 - 1.0) * 0.918_938_533_204_672_7;
        for lane in 0..BLOCK {
            assert!((action[lane] - a(lane)).abs() < 1e-9);
            total += (log_prob[lane] - others).exp() * 2.0 / N as f64;
        }
    }
    assert!((total - 1.0).abs() < 1e-3, "{total}");
}
