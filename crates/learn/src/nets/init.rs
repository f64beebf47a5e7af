//! Initial weights: orthogonal (Saxe, McClelland and Ganguli, 2014), or those of ML-Agents.

use crate::lanes::noise::SplitMix;
use crate::nets::mlp::Mlp;
use marathon_physics::lanes::Real;
use serde::{Deserialize, Serialize};

/// Initial weights of the policy and value networks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Init {
    /// Orthogonal weights, scaled by 0.01 in the policy's last layer, so that actions hardly depend on the state.
    #[default]
    Orthogonal,
    /// Normal numbers as in ML-Agents: smaller in the hidden layers, larger in the policy's last layer.
    MlAgents,
}

impl Init {
    /// Fills the parameters of a policy's network.
    pub(crate) fn policy(self, net: &Mlp, params: &mut [f32], random: &mut SplitMix) {
        match self {
            Init::Orthogonal => orthogonal(net, params, 0.01, random),
            Init::MlAgents => ml_agents(net, params, |inputs| 0.2 / inputs.sqrt(), random),
        }
    }
    /// Fills the parameters of a value network.
    pub(crate) fn value(self, net: &Mlp, params: &mut [f32], random: &mut SplitMix) {
        match self {
            Init::Orthogonal => orthogonal(net, params, 1.0, random),
            // there, each stream of rewards has an output layer
            Init::MlAgents => ml_agents(net, params, |inputs| (2.0 / (inputs + 1.0)).sqrt(), random),
        }
    }
}

/// Fills the parameters of a network: orthogonal weights with gain sqrt 2 in hidden layers and `last_gain` in the last,
/// biases zero.
pub fn orthogonal(net: &Mlp, params: &mut [f32], last_gain: f64, random: &mut SplitMix) {
    let last = net.sizes().len() - 2;
    for (l, (weights, biases)) in net.layers().enumerate() {
        let (inputs, outputs) = (net.sizes()[l], net.sizes()[l + 1]);
        let gain = if l == last { last_gain } else { std::f64::consts::SQRT_2 };
        // orthonormalizes the vectors along the shorter side
        let (count, length) = (inputs.min(outputs), inputs.max(outputs));
        let basis = orthonormal(count, length, random);
        let w = &mut params[weights];
        for j in 0..outputs {
            for k in 0..inputs {
                let x = if outputs <= inputs { basis[j][k] } else { basis[k][j] };
                w[j * inputs + k] = (gain * x) as f32;
            }
        }
        params[biases].fill(0.0);
    }
}

/// Fills the parameters of a network as ML-Agents 1.1.0 does (`NetworkBody` and its heads). Hidden layers get normal
/// weights with deviation `1 / sqrt(inputs)`. The last layer gets the deviation `last`, a function of the inputs.
/// Biases are zero. ML-Agents draws the weights of value heads uniformly; here they are normal with the same deviation.
pub fn ml_agents(net: &Mlp, params: &mut [f32], last: impl Fn(f64) -> f64, random: &mut SplitMix) {
    let sizes = net.sizes();
    for (l, (weights, biases)) in net.layers().enumerate() {
        let inputs = sizes[l] as f64;
        let deviation = if l + 2 == sizes.len() { last(inputs) } else { 1.0 / inputs.sqrt() };
        params[weights].iter_mut().for_each(|w| *w = (deviation * normal(random)) as f32);
        params[biases].fill(0.0);
    }
}

/// `count` orthonormal vectors, uniformly distributed (Gram and Schmidt on normal numbers, each projection done twice).
fn orthonormal(count: usize, length: usize, random: &mut SplitMix) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(count);
    while basis.len() < count {
        let mut v: Vec<f64> = (0..length).map(|_| normal(random)).collect();
        for _ in 0..2 {
            for b in &basis {
                let dot: f64 = b.iter().zip(&v).map(|(b, v)| b * v).sum();
                v.iter_mut().zip(b).for_each(|(v, b)| *v -= dot * b);
            }
        }
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        // the vector happens to lie in the span of the others: draw again
        if norm > 1e-6 {
            v.iter_mut().for_each(|x| *x /= norm);
            basis.push(v);
        }
    }
    basis
}

/// A standard normal number.
pub(crate) fn normal(random: &mut SplitMix) -> f64 {
    let unit = |x: u64| (x >> 11) as f64 / (1u64 << 53) as f64;
    let (u, v) = (1.0 - unit(random.word()), unit(random.word()));
    (-2.0 * Real::ln(u)).sqrt() * Real::sin_cos(std::f64::consts::TAU * v).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nets::activation::Activation;

    #[test]
    fn weights_of_ml_agents_have_their_deviations() {
        let net = Mlp::new(&[40, 90, 80, 30], Activation::Swish);
        let mut params = vec![7.0; net.len()];
        ml_agents(&net, &mut params, |inputs| 0.2 / inputs.sqrt(), &mut SplitMix::new(1, 2));
        let wanted = [1.0 / 40f64.sqrt(), 1.0 / 90f64.sqrt(), 0.2 / 80f64.sqrt()];
        for ((weights, biases), wanted) in net.layers().zip(wanted) {
            let w = &params[weights];
            let deviation = (w.iter().map(|x| (*x as f64).powi(2)).sum::<f64>() / w.len() as f64).sqrt();
            assert!((deviation / wanted - 1.0).abs() < 0.06, "{deviation}, not {wanted}");
            assert!(params[biases].iter().all(|b| *b == 0.0));
        }
    }

    #[test]
    fn weights_are_orthogonal_with_their_gain() {
        let net = Mlp::new(&[17, 64, 40, 3], Activation::Tanh);
        let mut params = vec![7.0; net.len()];
        orthogonal(&net, &mut params, 0.01, &mut SplitMix::new(1, 2));
        for (l, (weights, biases)) in net.layers().enumerate() {
            let (ni, no) = (net.sizes()[l], net.sizes()[l + 1]);
            let gain: f64 = if l == 2 { 0.01 } else { std::f64::consts::SQRT_2 };
            let w = |j: usize, k: usize| params[weights.start + j * ni + k] as f64;
            for a in 0..ni.min(no) {
                for b in 0..=a {
                    let at = |i: usize, s: usize| if no <= ni { w(s, i) } else { w(i, s) };
                    let dot: f64 = (0..ni.max(no)).map(|i| at(i, a) * at(i, b)).sum();
                    let want = if a == b { gain * gain } else { 0.0 };
                    assert!((dot - want).abs() < 1e-6 * gain * gain, "layer {l}: {a} {b} {dot}");
                }
            }
            assert!(params[biases].iter().all(|b| *b == 0.0));
        }
    }
}
