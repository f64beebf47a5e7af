//! The Kronecker factors equal the Fisher matrix: exactly for one observation in a network of any depth, and exactly
//! for many in a network of one layer. Otherwise they are means over the samples. The natural gradient solves with
//! them, and in a linear policy a step causes the requested divergence.

use crate::common::numbers::noise_f32 as noise;
use marathon_learn::lanes::buffer::Blocks;
use marathon_learn::nets::mlp::Mlp;
use marathon_learn::optim::kfac::Layer;
use marathon_learn::{Activation, BLOCK};
use marathon_physics::lanes::Isa;

/// A policy network with deviations, parameters and observations of two blocks.
struct Case {
    net: Mlp,
    params: Vec<f32>,
    std: Vec<f32>,
    input: Blocks<f32>,
    blocks: usize,
}

impl Case {
    /// With the same observation for all agents, or with different ones.
    fn new(sizes: &[usize], same: bool) -> Self {
        let net = Mlp::new(sizes, Activation::Tanh);
        let params = noise(net.len(), 3);
        let std = (0..sizes[sizes.len() - 1]).map(|k| 0.3 + 0.2 * k as f32).collect();
        let (mut input, blocks) = (net.input(), 2);
        for b in 0..blocks {
            let mut row = noise(sizes[0] * BLOCK, if same { 7 } else { 7 + b as u64 });
            if same {
                row.chunks_exact_mut(BLOCK).for_each(|feature| feature.fill(feature[0]));
            }
            input.block_mut(b).copy_from_slice(&row);
        }
        Self { net, params, std, input, blocks }
    }

    /// The layers with factors of draws whose products are, on average, exactly one for the same action and zero for
    /// two actions.
    fn layers(&self) -> Vec<Layer> {
        let mut tape = self.net.tape();
        self.net.forward(Isa::best(), &self.params, &self.input, &mut tape, self.blocks);
        for b in 0..self.blocks {
            for (i, d) in tape.output_delta().block_mut(b).iter_mut().enumerate() {
                let (k, lane) = (i / BLOCK, i % BLOCK);
                // rows of a Hadamard matrix
                let z = if ((k + 1) & lane).count_ones() % 2 == 0 { 1.0 } else { -1.0 };
                *d = z / self.std[k];
            }
        }
        let mut moments = vec![0.0; self.net.moments_len()];
        self.net.second_moments(Isa::best(), &self.params, &self.input, &mut tape, &mut moments, self.blocks);
        let samples = (self.blocks * BLOCK) as f64;
        let make = |m| {
            let mut layer = Layer::new(0, &m, 0, 0);
            layer.merge([&moments[..]].into_iter(), samples, 0.0);
            layer
        };
        self.net.moments().map(make).collect()
    }

    /// Derivatives of output `k` of sample `s` with respect to all parameters.
    fn jacobian(&self, k: usize, s: usize) -> Vec<f32> {
        let (mut tape, mut gradient) = (self.net.tape(), vec![0.0; self.net.len()]);
        self.net.forward(Isa::best(), &self.params, &self.input, &mut tape, self.blocks);
        for b in 0..self.blocks {
            let delta = tape.output_delta().block_mut(b);
            delta.fill(0.0);
            if b == s / BLOCK {
                delta[k * BLOCK + s % BLOCK] = 1.0;
            }
        }
        self.net.backward(Isa::best(), &self.params, &self.input, &mut tape, &mut gradient, self.blocks);
        gradient
    }

    /// The block of the exact Fisher matrix of a layer, parameters in the order weights, biases.
    fn fisher(&self, layer: &Layer) -> Vec<Vec<f64>> {
        let range = layer.weights.start..layer.biases.end;
        let mut fisher = vec![vec![0.0; range.len()]; range.len()];
        let samples = self.blocks * BLOCK;
        for s in 0..samples {
            for (k, std) in self.std.iter().enumerate() {
                let j = &self.jacobian(k, s)[range.clone()];
                for (row, a) in fisher.iter_mut().zip(j) {
                    for (f, b) in row.iter_mut().zip(j) {
                        *f += (*a as f64) * (*b as f64) / (*std as f64).powi(2) / samples as f64;
                    }
                }
            }
        }
        fisher
    }

    /// Largest difference between the product of a layer's factors and the exact matrix, relative to the matrix's
    /// largest element.
    fn error(&self, layer: &Layer) -> f64 {
        let exact = self.fisher(layer);
        let no = layer.biases.len();
        let (ni, n) = (layer.weights.len() / no, layer.weights.len() / no + 1);
        // output and input of a parameter
        let of = |p: usize| if p < no * ni { (p / ni, p % ni) } else { (p - no * ni, ni) };
        let (mut worst, mut largest) = (0f64, 0f64);
        for (p, row) in exact.iter().enumerate() {
            for (q, f) in row.iter().enumerate() {
                let ((j, k), (l, m)) = (of(p), of(q));
                let product = layer.inputs_factor()[k * n + m] * layer.outputs_factor()[j * no + l];
                worst = worst.max((product - f).abs());
                largest = largest.max(f.abs());
            }
        }
        worst / largest
    }
}

#[test]
fn factors_of_one_observation_are_exact_in_every_layer() {
    let case = Case::new(&[5, 7, 6, 4], true);
    for (l, layer) in case.layers().iter().enumerate() {
        let error = case.error(layer);
        assert!(error < 1e-5, "layer {l}: {error}");
    }
}

#[test]
fn factors_of_many_observations_are_exact_in_one_layer() {
    let case = Case::new(&[6, 3], false);
    let error = case.error(&case.layers()[0]);
    assert!(error < 1e-5, "{error}");
    // an approximation below the last of several layers, or this test could not fail
    let deep = Case::new(&[5, 7, 6, 4], false);
    assert!(deep.layers()[..2].iter().all(|layer| deep.error(layer) > 1e-3));
}

/// Value networks: one output, the derivative itself.
#[test]
fn factors_of_a_value_network_are_means_over_its_samples() {
    let mut case = Case::new(&[4, 9, 5, 1], false);
    case.std = vec![1.0];
    let samples = case.blocks * BLOCK;
    for layer in case.layers() {
        let no = layer.biases.len();
        let (ni, n) = (layer.weights.len() / no, layer.weights.len() / no + 1);
        let (mut a, mut g) = (vec![0.0; n * n], vec![0.0; no * no]);
        for s in 0..samples {
            let jacobian = case.jacobian(0, s);
            let (weights, delta) = (&jacobian[layer.weights.clone()], &jacobian[layer.biases.clone()]);
            // inputs from the row with the largest derivative
            let j = (0..no).max_by(|a, b| delta[*a].abs().total_cmp(&delta[*b].abs())).unwrap();
            let x = |k: usize| if k < ni { (weights[j * ni + k] / delta[j]) as f64 } else { 1.0 };
            for i in 0..n * n {
                a[i] += x(i / n) * x(i % n) / samples as f64;
            }
            for i in 0..no * no {
                g[i] += delta[i / no] as f64 * delta[i % no] as f64 / samples as f64;
            }
        }
        for (want, got) in [(&a, layer.inputs_factor()), (&g, layer.outputs_factor())] {
            let size = want.iter().fold(0f64, |m, x| m.max(x.abs()));
            assert!(want.iter().zip(got).all(|(w, g)| (w - g).abs() < 1e-5 * size), "{want:?} {got:?}");
        }
    }
}

#[test]
fn natural_gradient_solves_with_the_damped_factors_on_every_width() {
    let case = Case::new(&[19, 33, 4], false);
    let gradient = noise(case.net.len(), 90);
    let (damping, scale) = (0.01, 0.5);
    for mut layer in case.layers() {
        layer.invert(damping);
        let no = layer.biases.len();
        let (ni, n) = (layer.weights.len() / no, layer.weights.len() / no + 1);
        let mean = |x: &[f64], n: usize| (0..n).map(|i| x[i * n + i]).sum::<f64>() / n as f64;
        let pi = (mean(layer.inputs_factor(), n) / mean(layer.outputs_factor(), no)).sqrt();
        let damped = |x: &[f64], n: usize, by: f64| {
            (0..n * n).map(|i| x[i] + if i % (n + 1) == 0 { by } else { 0.0 }).collect::<Vec<f64>>()
        };
        let a = damped(layer.inputs_factor(), n, pi * damping.sqrt());
        let g = damped(layer.outputs_factor(), no, damping.sqrt() / pi);
        let mut before: Option<(Vec<f32>, f64)> = None;
        for isa in [Isa::F32, Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|isa| isa.supported()) {
            layer.natural(isa, &gradient, scale);
            let step = |j: usize, k: usize| layer.step[if k < ni { j * ni + k } else { no * ni + j }] as f64;
            let (mut product, mut worst) = (0.0, 0f64);
            for j in 0..no {
                for k in 0..n {
                    let at = if k < ni { layer.weights.start + j * ni + k } else { layer.biases.start + j };
                    let want = gradient[at] as f64 * scale;
                    let got: f64 = (0..no)
                        .flat_map(|l| (0..n).map(move |m| (l, m)))
                        .map(|(l, m)| g[j * no + l] * step(l, m) * a[m * n + k])
                        .sum();
                    worst = worst.max((got - want).abs());
                    product += want * step(j, k);
                }
            }
            assert!(
                worst < 1e-3 && (layer.product / product - 1.0).abs() < 1e-4,
                "{worst} {product} {}",
                layer.product
            );
            assert!(before.is_none_or(|b| b == (layer.step.clone(), layer.product)), "{}", isa.name());
            before = Some((layer.step.clone(), layer.product));
        }
    }
}

#[test]
fn a_step_of_a_linear_policy_has_the_divergence_that_was_asked_for() {
    let case = Case::new(&[6, 4], false);
    let mut layer = case.layers().remove(0);
    layer.invert(1e-9);
    layer.natural(Isa::best(), &noise(case.net.len(), 33), 1.0);
    let (wanted, samples) = (1e-3, case.blocks * BLOCK);
    let length = (2.0 * wanted / layer.product).sqrt();
    let moved: Vec<f32> = case.params.iter().zip(&layer.step).map(|(p, s)| p - length as f32 * s).collect();
    let mut divergence = 0.0;
    for s in 0..samples {
        let obs: Vec<f32> = (0..6).map(|k| case.input.block(s / BLOCK)[k * BLOCK + s % BLOCK]).collect();
        let (old, new) = (case.net.forward_row(&case.params, &obs), case.net.forward_row(&moved, &obs));
        for ((old, new), std) in old.iter().zip(&new).zip(&case.std) {
            divergence += 0.5 * ((old - new) / std).powi(2) as f64 / samples as f64;
        }
    }
    assert!((divergence / wanted - 1.0).abs() < 0.01, "{divergence}");
}
