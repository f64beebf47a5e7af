//! The Fisher matrix of a network, layer by layer, as a Kronecker product (Martens and Grosse, "Optimizing neural networks
//! with Kronecker-factored approximate curvature", 2015).
//!
//! Let `a` be a layer's input with a constant 1 appended, and `g` the derivative of the log-likelihood with respect to
//! its output. The layer's block of the Fisher matrix is `E[a a' (x) g g']`, approximated by `A (x) G = E[a a'] (x) E[g
//! g']`. For one sample that is exact. The natural gradient of a layer is then `G^-1 W A^-1`, where `W` is its gradient
//! with the biases as the last column.
//!
//! `g` belongs to a draw from the network's own distribution. For the policy, the actions of the rollout are such
//! draws. The value has a normal distribution of deviation 1, so `g` is the derivative of the value times a normal
//! number. Only the square of that number matters; its mean is 1, so it is left out.

use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::tiles;
use crate::nets::gaussian::Gaussian;
use crate::nets::mlp::{LayerMoments, Mlp, Tape};
use marathon_physics::lanes::{Isa, Kernel, Real};
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard};

/// The factors of all layers of both networks.
pub struct Kfac {
    policy: Mlp,
    value: Mlp,
    layers: Vec<Mutex<Layer>>,
}

impl Kfac {
    /// Starts with identities for two networks. The value function's parameters begin at `value_start`.
    pub fn new(policy: &Mlp, value: &Mlp, value_start: usize) -> Self {
        let mut layers = Vec::new();
        let nets = [(policy, 0, 0), (value, value_start, policy.moments_len())];
        for (network, (net, params, moments)) in nets.into_iter().enumerate() {
            layers.extend(net.moments().map(|m| Mutex::new(Layer::new(network, &m, params, moments))));
        }
        Self { policy: policy.clone(), value: value.clone(), layers }
    }

    /// Number of layers of both networks.
    pub fn count(&self) -> usize {
        self.layers.len()
    }
    /// Returns a layer. The policy's layers come first.
    pub fn layer(&self, l: usize) -> MutexGuard<'_, Layer> {
        self.layers[l].lock().expect("no worker has panicked")
    }
    /// Length of the output of [`Kfac::moments`] for two networks, a multiple of sixteen.
    pub fn moments_len(policy: &Mlp, value: &Mlp) -> usize {
        (policy.moments_len() + value.moments_len()).next_multiple_of(BLOCK)
    }

    /// Sums the moments of the factors over samples, after the forward passes of both networks (their parameters,
    /// tapes) on the same input. `actions` are the actions taken, `[action][16]` for each block.
    #[expect(clippy::too_many_arguments, reason = "both networks with all inputs of the forward pass")]
    pub fn moments(
        &self,
        isa: Isa,
        (policy, value): (&[f32], &[f32]),
        gaussian: &Gaussian<f32>,
        actions: &[&[f32]],
        input: &Blocks<f32>,
        (of_policy, of_value): (&mut Tape<f32>, &mut Tape<f32>),
        out: &mut [f32],
    ) {
        let n = actions.len();
        let (mean, score) = of_policy.output_and_delta();
        f32_lanes!(isa, T => <T as Real>::enter(Score::<T> { gaussian, actions, mean, score, lanes: PhantomData }));
        for b in 0..n {
            of_value.output_delta().block_mut(b).fill(1.0);
        }
        let (first, rest) = out.split_at_mut(self.policy.moments_len());
        self.policy.second_moments(isa, policy, input, of_policy, first, n);
        self.value.second_moments(isa, value, input, of_value, rest, n);
    }

    /// All factors and their inverses, as saved.
    pub fn save(&self) -> (Vec<f64>, Vec<f32>) {
        let (mut factors, mut inverses) = (Vec::new(), Vec::new());
        for layer in (0..self.count()).map(|l| self.layer(l)) {
            factors.extend(layer.a.iter().chain(&layer.g));
            inverses.extend(layer.a_inverse.iter().chain(&layer.g_inverse));
        }
        (factors, inverses)
    }

    /// The inverse of [`Kfac::save`]. Returns false if the lengths do not fit these networks.
    pub fn load(&self, factors: &[f64], inverses: &[f32]) -> bool {
        let len: usize = (0..self.count()).map(|l| self.layer(l)).map(|l| l.a.len() + l.g.len()).sum();
        if factors.len() != len || inverses.len() != len {
            return false;
        }
        let mut at = 0;
        for l in 0..self.count() {
            let Layer { a, g, a_inverse, g_inverse, .. } = &mut *self.layer(l);
            for (factor, inverse) in [(a, a_inverse), (g, g_inverse)] {
                let place = at..at + factor.len();
                factor.copy_from_slice(&factors[place.clone()]);
                inverse.copy_from_slice(&inverses[place.clone()]);
                at = place.end;
            }
        }
        true
    }
}

/// Derivative of the log-probability of the actions taken with respect to their means, `(action - mean) / std^2`.
struct Score<'a, T> {
    gaussian: &'a Gaussian<f32>,
    actions: &'a [&'a [f32]],
    mean: &'a Blocks<f32>,
    score: &'a mut Blocks<f32>,
    lanes: PhantomData<T>,
}

impl<T: Real<Scalar = f32>> Kernel<T> for Score<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (b, action) in self.actions.iter().enumerate() {
            let (mean, score) = (self.mean.block(b), self.score.block_mut(b));
            for (k, inv_std) in self.gaussian.inv_std.iter().enumerate() {
                let inv_var = T::splat(*inv_std) * T::splat(*inv_std);
                for at in (k * BLOCK..(k + 1) * BLOCK).step_by(T::LANES) {
                    ((T::load(&action[at..]) - T::load(&mean[at..])) * inv_var).store(&mut score[at..]);
                }
            }
        }
    }
}

/// A layer with its factors.
pub struct Layer {
    /// 0 for the policy, 1 for the value function.
    pub network: usize,
    /// Range of its weights among all parameters.
    pub weights: Range<usize>,
    /// Its biases, which follow its weights.
    pub biases: Range<usize>,
    /// Natural gradient of the weights and biases, see [`Layer::natural`].
    pub step: Vec<f32>,
    /// Product of `step` with the gradient.
    pub product: f64,
    /// Running means, symmetric: `[input and 1][input and 1]` and `[output][output]`.
    a: Vec<f64>,
    g: Vec<f64>,
    a_inverse: Vec<f32>,
    g_inverse: Vec<f32>,
    /// Place of its sums among the moments.
    moments: LayerMoments,
    space: Space,
}

/// Work space of the two products with inverses: matrices in panels of sixteen columns.
struct Space {
    gradient: Blocks<f32>,
    left: Blocks<f32>,
    turned: Blocks<f32>,
    both: Blocks<f32>,
    zeros: Vec<f32>,
}

impl Layer {
    /// Starts with identities as factors, for a layer whose network begins at parameter `params` and moment `moments`.
    pub fn new(network: usize, of: &LayerMoments, params: usize, moments: usize) -> Self {
        let (inputs, outputs) = (of.inputs, of.outputs);
        let n = inputs + 1;
        let shift = |r: &Range<usize>, by: usize| r.start + by..r.end + by;
        let identity = |n: usize| (0..n * n).map(|i| if i % (n + 1) == 0 { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        let single = |x: &[f64]| x.iter().map(|x| *x as f32).collect();
        let (a, g) = (identity(n), identity(outputs));
        let panels = |columns: usize, rows: usize| Blocks::new(columns.div_ceil(BLOCK), rows);
        Self {
            network,
            weights: shift(&of.weights, params),
            biases: shift(&of.biases, params),
            step: vec![0.0; n * outputs],
            product: 0.0,
            a_inverse: single(&a),
            g_inverse: single(&g),
            a,
            g,
            moments: LayerMoments {
                xx: shift(&of.xx, moments),
                x: shift(&of.x, moments),
                dd: shift(&of.dd, moments),
                d: shift(&of.d, moments),
                ..of.clone()
            },
            space: Space {
                gradient: panels(n, outputs),
                left: panels(n, outputs),
                turned: panels(outputs, n),
                both: panels(outputs, n),
                zeros: vec![0.0; n.max(outputs)],
            },
        }
    }

    /// The factor of the inputs, `[input and 1][input and 1]`.
    pub fn inputs_factor(&self) -> &[f64] {
        &self.a
    }
    /// The factor of the outputs, `[output][output]`.
    pub fn outputs_factor(&self) -> &[f64] {
        &self.g
    }

    /// Merges the moments of `samples` samples into the running means, of which `decay` is kept. The parts are added up
    /// in their order. Numbers that are not finite change nothing.
    pub fn merge<'p>(&mut self, parts: impl Iterator<Item = &'p [f32]>, samples: f64, decay: f64) {
        let (ni, no) = (self.moments.inputs, self.moments.outputs);
        let n = ni + 1;
        let (mut a, mut g) = (vec![0.0; n * n], vec![0.0; no * no]);
        for part in parts {
            let (xx, x, dd) =
                (&part[self.moments.xx.clone()], &part[self.moments.x.clone()], &part[self.moments.dd.clone()]);
            for i in 0..ni {
                for j in 0..ni {
                    a[i * n + j] += xx[i * ni + j] as f64;
                }
                a[i * n + ni] += x[i] as f64;
                a[ni * n + i] += x[i] as f64;
            }
            g.iter_mut().zip(dd).for_each(|(g, d)| *g += *d as f64);
        }
        a[n * n - 1] = samples;
        if !a.iter().chain(&g).all(|x| x.is_finite()) {
            return;
        }
        let weight = (1.0 - decay) / samples;
        for (mean, sums) in [(&mut self.a, &a), (&mut self.g, &g)] {
            mean.iter_mut().zip(sums).for_each(|(m, s)| *m = decay * *m + weight * s);
        }
    }

    /// Inverts the factors. The damping is split so that both parts weigh the same: `A + pi sqrt(damping)` and `G +
    /// sqrt(damping) / pi`, with `pi^2` the ratio of the factors' mean eigenvalues. Factors without an inverse keep
    /// their old one.
    pub fn invert(&mut self, damping: f64) {
        let mean_eigenvalue = |x: &[f64], n: usize| (0..n).map(|i| x[i * (n + 1)]).sum::<f64>() / n as f64;
        let (n, no) = (self.moments.inputs + 1, self.moments.outputs);
        let (of_a, of_g) = (mean_eigenvalue(&self.a, n), mean_eigenvalue(&self.g, no));
        let pi = (of_a.max(1e-30) / of_g.max(1e-30)).sqrt();
        let root = damping.sqrt();
        if let (Some(a), Some(g)) = (inverse(&self.a, n, pi * root), inverse(&self.g, no, root / pi)) {
            (self.a_inverse, self.g_inverse) = (a, g);
        }
    }

    /// Fills `step` with the natural gradient `G^-1 W A^-1`, where `W` is the layer's part of `scale * gradient`. Fills
    /// `product` with the product of `step` and `W`.
    pub fn natural(&mut self, isa: Isa, gradient: &[f32], scale: f64) {
        let (ni, no) = (self.moments.inputs, self.moments.outputs);
        let n = ni + 1;
        let (weights, biases) = (&gradient[self.weights.clone()], &gradient[self.biases.clone()]);
        let Space { gradient, left, turned, both, zeros } = &mut self.space;
        let at = |row: usize, column: usize| row * BLOCK + column % BLOCK;
        let scale = scale as f32;
        for j in 0..no {
            for k in 0..ni {
                gradient.block_mut(k / BLOCK)[at(j, k)] = scale * weights[j * ni + k];
            }
            gradient.block_mut(ni / BLOCK)[at(j, ni)] = scale * biases[j];
        }
        multiply(isa, &self.g_inverse, zeros, gradient, left, n.div_ceil(BLOCK));
        for j in 0..no {
            for k in 0..n {
                turned.block_mut(j / BLOCK)[at(k, j)] = left.block(k / BLOCK)[at(j, k)];
            }
        }
        // A is symmetric
        multiply(isa, &self.a_inverse, zeros, turned, both, no.div_ceil(BLOCK));
        self.product = 0.0;
        for j in 0..no {
            for k in 0..n {
                let x = both.block(j / BLOCK)[at(k, j)];
                self.product += x as f64 * gradient.block(k / BLOCK)[at(j, k)] as f64;
                self.step[if k < ni { j * ni + k } else { no * ni + j }] = x;
            }
        }
    }
}

/// Inverse of a symmetric positive definite matrix with a number added to its diagonal, by Cholesky factorization.
///
/// A library would choose the order of its sums by the processor. Here it is the same everywhere.
fn inverse(matrix: &[f64], n: usize, damping: f64) -> Option<Vec<f32>> {
    // M = L L', row by row; the upper triangle is not used
    let mut l = matrix.to_vec();
    for i in 0..n {
        l[i * n + i] += damping;
        for j in 0..=i {
            let (above, row) = l.split_at_mut(i * n);
            let of_j = if j < i { &above[j * n..j * n + j] } else { &[][..] };
            let dot: f64 = match j < i {
                true => of_j.iter().zip(&*row).map(|(a, b)| a * b).sum(),
                false => row[..i].iter().map(|x| x * x).sum(),
            };
            let rest = row[j] - dot;
            if j < i {
                row[j] = rest / above[j * n + j];
            } else if rest > 0.0 {
                row[i] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    // K = L^-1, then M^-1 = K' K; rows are added to rows, which vectorizes
    let mut k = vec![0.0; n * n];
    for i in 0..n {
        let (above, row) = k.split_at_mut(i * n);
        row[i] = 1.0;
        for j in 0..i {
            let factor = l[i * n + j];
            row[..=j].iter_mut().zip(&above[j * n..]).for_each(|(x, y)| *x -= factor * y);
        }
        row[..=i].iter_mut().for_each(|x| *x /= l[i * n + i]);
    }
    let mut out = vec![0.0; n * n];
    for row in k.chunks_exact(n).enumerate().map(|(i, row)| &row[..=i]) {
        for (j, factor) in row.iter().enumerate() {
            out[j * n..].iter_mut().zip(row).for_each(|(x, y)| *x += factor * y);
        }
    }
    let single: Vec<f32> = out.iter().map(|x| *x as f32).collect();
    single.iter().all(|x| x.is_finite()).then_some(single)
}

/// `y = matrix x`, with `x` and `y` in panels of sixteen columns.
fn multiply(isa: Isa, matrix: &[f32], zeros: &[f32], x: &Blocks<f32>, y: &mut Blocks<f32>, panels: usize) {
    f32_lanes!(isa, T => <T as Real>::enter(Multiply { matrix, zeros, x, y, panels }))
}

struct Multiply<'a> {
    matrix: &'a [f32],
    zeros: &'a [f32],
    x: &'a Blocks<f32>,
    y: &'a mut Blocks<f32>,
    panels: usize,
}

impl<T: Real<Scalar = f32>> Kernel<T> for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (x, n) = ((self.x.as_rows(), self.x.stride(), self.x.features()), self.y.features());
        let stride = self.y.stride();
        tiles::affine::<T>((self.matrix, self.zeros), x, (self.y.as_rows_mut(), stride, n), self.panels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_matrix_is_the_identity() {
        for n in [1, 2, 5, 33] {
            // B B' + 1
            let b: Vec<f64> = (0..n * n).map(|i| ((i * 7919 + 13) % 101) as f64 / 101.0 - 0.5).collect();
            let dot = |i: usize, j: usize| (0..n).map(|k| b[i * n + k] * b[j * n + k]).sum::<f64>();
            let matrix: Vec<f64> = (0..n * n).map(|i| dot(i / n, i % n)).collect();
            let inverse = inverse(&matrix, n, 1.0).expect("positive definite");
            for i in 0..n {
                for j in 0..n {
                    let damped = |k: usize| matrix[i * n + k] + if i == k { 1.0 } else { 0.0 };
                    let product: f64 = (0..n).map(|k| damped(k) * inverse[k * n + j] as f64).sum();
                    let want = if i == j { 1.0 } else { 0.0 };
                    assert!((product - want).abs() < 1e-5, "{n}: {i} {j} {product}");
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_inverted_is_refused() {
        assert!(inverse(&[1.0, 2.0, 2.0, 1.0], 2, 0.0).is_none());
        assert!(inverse(&[f64::NAN], 1, 0.1).is_none());
    }
}
