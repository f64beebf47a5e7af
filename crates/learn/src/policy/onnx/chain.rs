//! A chain of stages in the form of a policy:
//!
//! ```text
//! [Scale] [Clip] (Dense Activation)* Dense [Tanh] [Clip] [Scale]
//! ```
//!
//! Scales elsewhere are merged into the layers next to them.

use super::graph::Stage;
use crate::nets::activation::Activation;

type Result<T> = std::result::Result<T, String>;

/// Stands for no bound in a format that requires one.
pub const UNBOUNDED: f32 = f32::MAX;

/// The parts of a policy.
#[derive(Debug)]
pub struct Parts {
    pub obs_mean: Vec<f32>,
    pub obs_std: Vec<f32>,
    pub observation_clip: f32,
    /// Weights, `[output][input]`, and biases of each layer.
    pub params: Vec<f32>,
    pub hidden: Vec<usize>,
    pub activation: Activation,
    /// The output goes through the hyperbolic tangent.
    pub squash: bool,
    pub action_clip: f32,
    pub action_range: Vec<[f32; 2]>,
    /// Factors of the outputs, which also scale the spread of sampled actions. Empty means 1.
    pub spread: Vec<f64>,
}

/// A layer and the activation after it.
struct Layer {
    weights: Vec<f64>,
    bias: Vec<f64>,
    activation: Option<Activation>,
}

impl Layer {
    /// Scales and shifts the outputs.
    fn scale_outputs(&mut self, factor: &[f64], shift: &[f64]) {
        let inputs = self.weights.len() / self.bias.len();
        for (o, row) in self.weights.chunks_exact_mut(inputs).enumerate() {
            row.iter_mut().for_each(|w| *w *= factor[o]);
            self.bias[o] = self.bias[o] * factor[o] + shift[o];
        }
    }

    /// Absorbs a scale and shift of the inputs.
    fn scale_inputs(&mut self, factor: &[f64], shift: &[f64]) {
        for (o, row) in self.weights.chunks_exact_mut(factor.len()).enumerate() {
            for (i, w) in row.iter_mut().enumerate() {
                self.bias[o] += *w * shift[i];
                *w *= factor[i];
            }
        }
    }
}

/// Factors and shifts, per feature.
type Scale = (Vec<f64>, Vec<f64>);

/// Converts stages, in their order, to the form of a policy for `obs` numbers.
pub fn arrange(stages: &[Stage], obs: usize) -> Result<Parts> {
    let stages = merge_scales(stages);
    let first = stages.iter().position(|s| matches!(s, Stage::Dense { .. })).ok_or("no layer with weights")?;
    let last = stages.iter().rposition(|s| matches!(s, Stage::Dense { .. })).unwrap_or(first);
    let (mut norm, bound) = input(&stages[..first])?;
    let mut layers = body(&stages[first..=last])?;
    if bound.is_none() && norm.as_ref().is_some_and(|(factor, _)| factor.iter().any(|f| !(*f > 0.0))) {
        // not a normalization: the first layer absorbs it
        if let Some((factor, shift)) = norm.take() {
            layers[0].scale_inputs(&factor, &shift);
        }
    }
    let (mean, std) = match norm {
        None => (vec![0.0; obs], vec![1.0; obs]),
        Some((factor, shift)) => {
            if let Some(f) = factor.iter().find(|f| !(**f > 0.0)) {
                return Err(format!(
                    "an observation multiplied by {f} before it is clipped, expected a positive number"
                ));
            }
            let mean = factor.iter().zip(&shift).map(|(f, s)| (-s / f) as f32).collect();
            (mean, factor.iter().map(|f| (1.0 / f) as f32).collect())
        }
    };
    let tail = output(&stages[last + 1..], &mut layers[..])?;
    let hidden: Vec<usize> = layers[..layers.len() - 1].iter().map(|l| l.bias.len()).collect();
    let activation = layers[0].activation.unwrap_or(Activation::Tanh);
    if let Some(other) = layers.iter().filter_map(|l| l.activation).find(|a| *a != activation) {
        return Err(format!("activations {} and {}, expected one for all layers", activation.name(), other.name()));
    }
    let numbers = layers.iter().flat_map(|l| l.weights.iter().chain(&l.bias));
    Ok(Parts {
        obs_mean: mean,
        obs_std: std,
        observation_clip: bound.map_or(UNBOUNDED, |b| b as f32),
        params: numbers.map(|x| *x as f32).collect(),
        hidden,
        activation,
        ..tail
    })
}

/// Merges consecutive scales, and those after a layer into the layer.
fn merge_scales(stages: &[Stage]) -> Vec<Stage> {
    let mut merged: Vec<Stage> = Vec::new();
    for stage in stages {
        match (merged.last_mut(), stage) {
            (Some(Stage::Scale { factor: f, shift: s }), Stage::Scale { factor, shift }) => {
                for i in 0..factor.len() {
                    f[i] *= factor[i];
                    s[i] = s[i] * factor[i] + shift[i];
                }
            }
            (Some(Stage::Dense { weights, bias }), Stage::Scale { factor, shift }) => {
                let mut layer =
                    Layer { weights: std::mem::take(weights), bias: std::mem::take(bias), activation: None };
                layer.scale_outputs(factor, shift);
                (*weights, *bias) = (layer.weights, layer.bias);
            }
            _ => merged.push(stage.clone()),
        }
    }
    merged
}

/// Normalization and clip of the observation before the first layer.
fn input(stages: &[Stage]) -> Result<(Option<Scale>, Option<f64>)> {
    let scale = |factor: &[f64], shift: &[f64]| Some((factor.to_vec(), shift.to_vec()));
    match stages {
        [] => Ok((None, None)),
        [Stage::Scale { factor, shift }] => Ok((scale(factor, shift), None)),
        [Stage::Clip(low, high)] => Ok((None, symmetric(*low, *high)?)),
        [Stage::Scale { factor, shift }, Stage::Clip(low, high)] => Ok((scale(factor, shift), symmetric(*low, *high)?)),
        _ => Err("observations that go through more than normalization and a clip before the first layer".into()),
    }
}

fn symmetric(low: f64, high: f64) -> Result<Option<f64>> {
    match (low == -high, high) {
        (true, f64::INFINITY) => Ok(None),
        (true, bound) if bound > 0.0 => Ok(Some(bound)),
        _ => Err(format!("normalized observations clipped to [{low}, {high}], expected bounds of one size")),
    }
}

/// Layers with activations between them.
fn body(stages: &[Stage]) -> Result<Vec<Layer>> {
    let mut layers: Vec<Layer> = Vec::new();
    let mut scale: Option<Scale> = None;
    for stage in stages {
        match stage {
            Stage::Dense { weights, bias } => {
                if layers.last().is_some_and(|l| l.activation.is_none()) {
                    return Err("two layers without an activation between them".into());
                }
                let mut layer = Layer { weights: weights.clone(), bias: bias.clone(), activation: None };
                if let Some((factor, shift)) = scale.take() {
                    layer.scale_inputs(&factor, &shift);
                }
                layers.push(layer);
            }
            Stage::Activation(activation) => match layers.last_mut() {
                Some(layer) if layer.activation.is_none() && scale.is_none() => layer.activation = Some(*activation),
                _ => return Err("two activations in a row".into()),
            },
            Stage::Scale { factor, shift } => scale = Some((factor.clone(), shift.clone())),
            Stage::Clip(low, high) => return Err(format!("hidden features clipped to [{low}, {high}]")),
            Stage::Sigmoid => return Err("activation sigmoid, expected one of swish, tanh, elu, relu".into()),
        }
    }
    Ok(layers)
}

/// Bounds and scale of the output of the last layer, which may absorb a part of them.
fn output(stages: &[Stage], layers: &mut [Layer]) -> Result<Parts> {
    let last = layers.len() - 1;
    let act = layers[last].bias.len();
    let mut tail = Parts {
        obs_mean: Vec::new(),
        obs_std: Vec::new(),
        observation_clip: UNBOUNDED,
        params: Vec::new(),
        hidden: Vec::new(),
        activation: Activation::Tanh,
        squash: false,
        action_clip: UNBOUNDED,
        action_range: Vec::new(),
        spread: Vec::new(),
    };
    let (one, zero) = (vec![1.0; act], vec![0.0; act]);
    let range = |factor: &[f64], shift: &[f64]| -> Result<Vec<[f32; 2]>> {
        if let Some(f) = factor.iter().find(|f| !(**f > 0.0)) {
            return Err(format!("bounded actions multiplied by {f}, expected a positive number"));
        }
        Ok(factor.iter().zip(shift).map(|(f, s)| [(s - f) as f32, (s + f) as f32]).collect())
    };
    // bounds that change nothing after the tangent
    let mut rest = stages;
    if let [Stage::Activation(Activation::Tanh), after @ ..] = rest {
        (tail.squash, tail.action_clip, rest) = (true, 1.0, after);
        if let [Stage::Clip(low, high), after @ ..] = rest
            && *low <= -1.0
            && *high >= 1.0
        {
            rest = after;
        }
        match rest {
            [] => {}
            [Stage::Scale { factor, shift }] if *factor == one && *shift == zero => {}
            [Stage::Scale { factor, shift }] => tail.action_range = range(factor, shift)?,
            _ => return Err("actions that go through more than a scale after the tangent".into()),
        }
        return Ok(tail);
    }
    let (low, high, scale) = match rest {
        [] => return Ok(tail),
        [Stage::Clip(low, high)] => (*low, *high, None),
        [Stage::Clip(low, high), Stage::Scale { factor, shift }] => (*low, *high, Some((factor, shift))),
        // a scale between clips, as of a network whose actions are clipped twice
        [Stage::Clip(low, high), Stage::Scale { factor, shift }, Stage::Clip(l, h)]
            if factor.iter().zip(shift).all(|(f, s)| *f > 0.0 && low * f + s >= *l && high * f + s <= *h) =>
        {
            (*low, *high, Some((factor, shift)))
        }
        _ => return Err("actions that go through more than the tangent, a clip and a scale".into()),
    };
    let (factor, shift) = scale.map_or((one.clone(), zero.clone()), |(f, s)| (f.clone(), s.clone()));
    if !(low.is_finite() && high.is_finite() && low < high) {
        return Err(format!("actions clipped to [{low}, {high}], expected two bounds"));
    }
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    if middle == 0.0 && factor == one && shift == zero {
        tail.action_clip = half as f32;
    } else {
        // outputs in [-1, 1], mapped to the range
        layers[last].scale_outputs(&vec![1.0 / half; act], &vec![-middle / half; act]);
        tail.action_clip = 1.0;
        tail.spread = vec![1.0 / half; act];
        let factors: Vec<f64> = factor.iter().map(|f| f * half).collect();
        let shifts: Vec<f64> = factor.iter().zip(&shift).map(|(f, s)| f * middle + s).collect();
        tail.action_range = range(&factors, &shifts)?;
    }
    Ok(tail)
}
