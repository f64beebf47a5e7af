// one file: forward and backward pass mirror each other
//! Multi-layer perceptrons in the lane layout of the physics.
//!
//! Parameters are one flat array: for each layer the weights `[output][input]`, then the biases (PyTorch's order).
//! Samples come in blocks of sixteen, `[block][feature][16]`. The hidden layers share one [`Activation`]. The output is
//! linear.
//!
//! The forward pass takes four columns (64 samples with AVX-512) at a time through all layers, so they stay in the
//! first-level cache. The backward pass works on a whole chunk of [`CHUNK`] blocks, which fits the second level.

use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::tiles;
use crate::nets::activation::{self, Activation};
use crate::nets::normalize::Normalizer;
use marathon_physics::lanes::{Isa, Kernel, Real};
use std::marker::PhantomData;
use std::ops::Range;

/// Blocks per pass: 256 samples.
pub const CHUNK: usize = 16;

/// Shape of a network.
#[derive(Clone, Debug, PartialEq)]
pub struct Mlp {
    sizes: Vec<usize>,
    pub(super) activation: Activation,
    pub(super) layers: Vec<Layer>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layer {
    inputs: usize,
    pub outputs: usize,
    pub weights: Range<usize>,
    pub biases: Range<usize>,
}

/// A layer and its places in the output of [`Mlp::second_moments`].
#[derive(Clone, Debug)]
pub struct LayerMoments {
    /// Number of inputs.
    pub inputs: usize,
    /// Number of outputs.
    pub outputs: usize,
    /// Its weights among the parameters.
    pub weights: Range<usize>,
    /// Its biases among the parameters.
    pub biases: Range<usize>,
    /// Sums of products of inputs, `[input][input]`.
    pub xx: Range<usize>,
    /// Sums of inputs.
    pub x: Range<usize>,
    /// Sums of products of derivatives with respect to outputs, `[output][output]`.
    pub dd: Range<usize>,
    /// Sums of those derivatives.
    pub d: Range<usize>,
}

/// Results of the forward pass for the backward pass, and the backward pass's own work space, for [`CHUNK`] blocks.
pub struct Tape<S> {
    /// Output of each layer.
    values: Vec<Blocks<S>>,
    /// Derivative of the activation, where it does not follow from the value.
    slopes: Vec<Blocks<S>>,
    /// Derivative of the loss with respect to the output of each layer. For hidden layers: before the activation.
    deltas: Vec<Blocks<S>>,
}

impl<S: Copy + Default> Tape<S> {
    /// Output of the network.
    pub fn output(&self) -> &Blocks<S> {
        &self.values[self.values.len() - 1]
    }
    /// Derivative of the loss with respect to the output of the network. Fill it before the backward pass.
    pub fn output_delta(&mut self) -> &mut Blocks<S> {
        let last = self.deltas.len() - 1;
        &mut self.deltas[last]
    }
    /// Output, and the derivative with respect to it.
    pub fn output_and_delta(&mut self) -> (&Blocks<S>, &mut Blocks<S>) {
        let last = self.deltas.len() - 1;
        (&self.values[last], &mut self.deltas[last])
    }
}

impl Mlp {
    /// Creates a network with the given widths: inputs, hidden layers, outputs.
    ///
    /// # Panics
    /// With fewer than two widths, or with a width of zero.
    pub fn new(sizes: &[usize], activation: Activation) -> Self {
        assert!(sizes.len() >= 2 && !sizes.contains(&0), "a network needs positive widths, not {sizes:?}");
        let mut at = 0;
        let mut layers = Vec::new();
        for pair in sizes.windows(2) {
            let (inputs, outputs) = (pair[0], pair[1]);
            let weights = at..at + inputs * outputs;
            let biases = weights.end..weights.end + outputs;
            at = biases.end;
            layers.push(Layer { inputs, outputs, weights, biases });
        }
        Self { sizes: sizes.to_vec(), activation, layers }
    }

    /// Widths: inputs, hidden layers, outputs.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }
    /// Activation of the hidden layers.
    pub fn activation(&self) -> Activation {
        self.activation
    }
    /// Number of parameters.
    pub fn len(&self) -> usize {
        self.layers[self.layers.len() - 1].biases.end
    }
    /// Always false: a network has parameters.
    pub fn is_empty(&self) -> bool {
        false
    }
    /// Ranges of the weights and biases of each layer in the parameters.
    pub fn layers(&self) -> impl Iterator<Item = (Range<usize>, Range<usize>)> + '_ {
        self.layers.iter().map(|l| (l.weights.clone(), l.biases.clone()))
    }
    /// Multiplications and additions per sample in the forward and the backward pass.
    pub fn flops(&self) -> f64 {
        let cost = |(i, l): (usize, &Layer)| (l.inputs * l.outputs) as f64 * if i == 0 { 4.0 } else { 6.0 };
        self.layers.iter().enumerate().map(cost).sum()
    }

    /// Adapts the first layer to new statistics of the inputs, so that the network's output for a raw input stays the
    /// same. If the deviation of an input has more than doubled, for example because it never moved before, its weights
    /// are only doubled. They were never trained at the larger scale.
    pub fn follow(&self, params: &mut [f32], before: &Normalizer, after: &Normalizer) {
        let layer = &self.layers[0];
        let (weights, biases) = params[..layer.biases.end].split_at_mut(layer.weights.end);
        let growth: Vec<f32> = before.std().iter().zip(after.std()).map(|(old, new)| (new / old).min(2.0)).collect();
        let means = before.mean().iter().zip(after.mean()).zip(after.std());
        let shift: Vec<f64> = means.map(|((old, new), std)| (*new as f64 - *old as f64) / *std as f64).collect();
        for (row, bias) in weights.chunks_exact_mut(layer.inputs).zip(biases) {
            let mut moved = *bias as f64;
            for ((weight, growth), shift) in row.iter_mut().zip(&growth).zip(&shift) {
                *weight *= growth;
                moved += *weight as f64 * shift;
            }
            *bias = moved as f32;
        }
    }

    /// Work space for inference: no derivatives.
    pub fn inference_tape<S: Copy + Default>(&self) -> Tape<S> {
        Tape { values: self.work_space(), slopes: Vec::new(), deltas: Vec::new() }
    }
    /// Work space for training.
    pub fn tape<S: Copy + Default>(&self) -> Tape<S> {
        let slopes = if self.activation.stores_slope() { self.work_space() } else { Vec::new() };
        Tape { values: self.work_space(), slopes, deltas: self.work_space() }
    }
    fn work_space<S: Copy + Default>(&self) -> Vec<Blocks<S>> {
        self.layers.iter().map(|l| Blocks::new(CHUNK, l.outputs)).collect()
    }
    /// Allocates the inputs of a chunk.
    pub fn input<S: Copy + Default>(&self) -> Blocks<S> {
        Blocks::new(CHUNK, self.sizes[0])
    }

    /// Computes the output for the first `blocks` blocks of `input`.
    pub fn forward(&self, isa: Isa, params: &[f32], input: &Blocks<f32>, tape: &mut Tape<f32>, blocks: usize) {
        f32_lanes!(isa, T => self.forward_on::<T>(params, input, tape, blocks))
    }

    /// Overwrites `gradient` with the gradient of the loss with respect to the parameters, summed over the first
    /// `blocks` blocks. Requires [`Mlp::forward`] on the same input, and [`Tape::output_delta`].
    pub fn backward(
        &self,
        isa: Isa,
        params: &[f32],
        input: &Blocks<f32>,
        tape: &mut Tape<f32>,
        gradient: &mut [f32],
        blocks: usize,
    ) {
        f32_lanes!(isa, T => self.backward_on::<T>(params, input, tape, gradient, blocks))
    }

    /// [`Mlp::forward`] on given lanes.
    pub fn forward_on<T: Real>(
        &self,
        params: &[T::Scalar],
        input: &Blocks<T::Scalar>,
        tape: &mut Tape<T::Scalar>,
        blocks: usize,
    ) {
        T::enter(Forward::<T> { net: self, params, input, tape, blocks, lanes: PhantomData })
    }

    /// [`Mlp::backward`] on given lanes.
    pub fn backward_on<T: Real>(
        &self,
        params: &[T::Scalar],
        input: &Blocks<T::Scalar>,
        tape: &mut Tape<T::Scalar>,
        gradient: &mut [T::Scalar],
        blocks: usize,
    ) {
        for (l, layer) in self.layers.iter().enumerate().rev() {
            let (before, rest) = tape.deltas.split_at_mut(l);
            let dy = &rest[0];
            let x = if l == 0 { input } else { &tape.values[l - 1] };
            let (dw, db) = gradient[layer.weights.start..layer.biases.end].split_at_mut(layer.weights.len());
            T::enter(Outer::<T> { x, dy, dw, db, blocks, lanes: PhantomData });
            if l > 0 {
                let dx = &mut before[l - 1];
                T::enter(Transposed::<T> { w: &params[layer.weights.clone()], dy, dx: &mut *dx, blocks });
                let slope = tape.slopes.get(l - 1);
                T::enter(Slope::<T> { activation: self.activation, y: x, slope, d: dx, blocks });
            }
        }
    }

    /// Overwrites `dx` with the derivative of the loss with respect to the input. Requires [`Mlp::backward_on`].
    pub fn input_delta_on<T: Real>(
        &self,
        params: &[T::Scalar],
        tape: &Tape<T::Scalar>,
        dx: &mut Blocks<T::Scalar>,
        blocks: usize,
    ) {
        let w = &params[self.layers[0].weights.clone()];
        T::enter(Transposed::<T> { w, dy: &tape.deltas[0], dx, blocks });
    }

    /// Overwrites `dx` with the derivative of the loss with respect to the input, without the parameters' gradient.
    /// Requires [`Mlp::forward`] and [`Tape::output_delta`].
    pub fn input_gradient(&self, isa: Isa, params: &[f32], tape: &mut Tape<f32>, dx: &mut Blocks<f32>, blocks: usize) {
        f32_lanes!(isa, T => {
            for (l, layer) in self.layers.iter().enumerate().skip(1).rev() {
                let (before, rest) = tape.deltas.split_at_mut(l);
                let (dy, dx) = (&rest[0], &mut before[l - 1]);
                <T as Real>::enter(Transposed::<T> { w: &params[layer.weights.clone()], dy, dx: &mut *dx, blocks });
                let (y, slope) = (&tape.values[l - 1], tape.slopes.get(l - 1));
                <T as Real>::enter(Slope::<T> { activation: self.activation, y, slope, d: dx, blocks });
            }
            self.input_delta_on::<T>(params, tape, dx, blocks);
        })
    }

    /// The layers and their places among the second moments.
    pub fn moments(&self) -> impl Iterator<Item = LayerMoments> + '_ {
        let mut end = 0;
        self.layers.iter().map(move |layer| {
            let (inputs, outputs) = (layer.inputs, layer.outputs);
            let mut next = |n: usize| {
                end += n;
                end - n..end
            };
            LayerMoments {
                inputs,
                outputs,
                weights: layer.weights.clone(),
                biases: layer.biases.clone(),
                xx: next(inputs * inputs),
                x: next(inputs),
                dd: next(outputs * outputs),
                d: next(outputs),
            }
        })
    }
    /// Numbers that [`Mlp::second_moments`] fills.
    pub fn moments_len(&self) -> usize {
        self.moments().last().map_or(0, |m| m.d.end)
    }

    /// Overwrites `moments` with sums of products over the first `blocks` blocks: of each layer's inputs, and of the
    /// derivatives with respect to its outputs before the activation. Requires [`Mlp::forward`] on the same input, and
    /// [`Tape::output_delta`].
    pub fn second_moments(
        &self,
        isa: Isa,
        params: &[f32],
        input: &Blocks<f32>,
        tape: &mut Tape<f32>,
        moments: &mut [f32],
        blocks: usize,
    ) {
        f32_lanes!(isa, T => self.second_moments_on::<T>(params, input, tape, moments, blocks))
    }

    /// [`Mlp::second_moments`] on given lanes.
    pub fn second_moments_on<T: Real>(
        &self,
        params: &[T::Scalar],
        input: &Blocks<T::Scalar>,
        tape: &mut Tape<T::Scalar>,
        moments: &mut [T::Scalar],
        blocks: usize,
    ) {
        let places: Vec<LayerMoments> = self.moments().collect();
        for (l, (layer, of)) in self.layers.iter().zip(&places).enumerate().rev() {
            let (before, rest) = tape.deltas.split_at_mut(l);
            let dy = &rest[0];
            let x = if l == 0 { input } else { &tape.values[l - 1] };
            let (dw, db) = moments[of.xx.start..of.x.end].split_at_mut(of.xx.len());
            T::enter(Outer::<T> { x, dy: x, dw, db, blocks, lanes: PhantomData });
            let (dw, db) = moments[of.dd.start..of.d.end].split_at_mut(of.dd.len());
            T::enter(Outer::<T> { x: dy, dy, dw, db, blocks, lanes: PhantomData });
            if l > 0 {
                let dx = &mut before[l - 1];
                T::enter(Transposed::<T> { w: &params[layer.weights.clone()], dy, dx: &mut *dx, blocks });
                let slope = tape.slopes.get(l - 1);
                T::enter(Slope::<T> { activation: self.activation, y: x, slope, d: dx, blocks });
            }
        }
    }

    /// The output for one sample, one number at a time, with the bits of [`Mlp::forward`].
    pub fn forward_row(&self, params: &[f32], input: &[f32]) -> Vec<f32> {
        f32::enter(ForwardRow { net: self, params, input })
    }
}

struct Forward<'a, T: Real> {
    net: &'a Mlp,
    params: &'a [T::Scalar],
    input: &'a Blocks<T::Scalar>,
    tape: &'a mut Tape<T::Scalar>,
    blocks: usize,
    lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Forward<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Forward { net, params, input, tape, blocks, .. } = self;
        // as many blocks at a time as a tile has columns
        let step = if T::LANES == 16 { 4 } else { 1 };
        let mut first = 0;
        while first < blocks {
            let n = step.min(blocks - first);
            for (l, layer) in net.layers.iter().enumerate() {
                let (before, rest) = tape.values.split_at_mut(l);
                let x = if l == 0 { input } else { &before[l - 1] };
                let y = &mut rest[0];
                let (x_stride, y_stride) = (x.stride(), y.stride());
                tiles::affine::<T>(
                    (&params[layer.weights.clone()], &params[layer.biases.clone()]),
                    (&x.as_rows()[first * x_stride..], x_stride, layer.inputs),
                    (&mut y.as_rows_mut()[first * y_stride..], y_stride, layer.outputs),
                    n,
                );
                if l + 1 < net.layers.len() {
                    activation::apply::<T>(net.activation, y, tape.slopes.get_mut(l), first..first + n);
                }
            }
            first += n;
        }
    }
}

/// Gradient of a layer's parameters.
pub(super) struct Outer<'a, T: Real> {
    pub x: &'a Blocks<T::Scalar>,
    pub dy: &'a Blocks<T::Scalar>,
    pub dw: &'a mut [T::Scalar],
    pub db: &'a mut [T::Scalar],
    pub blocks: usize,
    pub lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Outer<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        tiles::outer::<T>(
            (self.x.as_rows(), self.x.stride(), self.x.features()),
            (self.dy.as_rows(), self.dy.stride(), self.dy.features()),
            (self.dw, self.db),
            self.blocks,
        );
    }
}

/// Gradient of a layer's input.
pub(super) struct Transposed<'a, T: Real> {
    pub w: &'a [T::Scalar],
    pub dy: &'a Blocks<T::Scalar>,
    pub dx: &'a mut Blocks<T::Scalar>,
    pub blocks: usize,
}

impl<T: Real> Kernel<T> for Transposed<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (stride, features) = (self.dx.stride(), self.dx.features());
        let dy = (self.dy.as_rows(), self.dy.stride(), self.dy.features());
        tiles::transposed::<T>(self.w, dy, (self.dx.as_rows_mut(), stride, features), self.blocks);
    }
}

/// Gradient before an activation from the gradient after it.
struct Slope<'a, T: Real> {
    activation: Activation,
    y: &'a Blocks<T::Scalar>,
    slope: Option<&'a Blocks<T::Scalar>>,
    d: &'a mut Blocks<T::Scalar>,
    blocks: usize,
}

impl<T: Real> Kernel<T> for Slope<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        activation::apply_slope::<T>(self.activation, self.y, self.slope, self.d, 0..self.blocks);
    }
}

struct ForwardRow<'a> {
    net: &'a Mlp,
    params: &'a [f32],
    input: &'a [f32],
}

impl Kernel<f32> for ForwardRow<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn run(self) -> Vec<f32> {
        let net = self.net;
        let mut x = self.input.to_vec();
        for (l, layer) in net.layers.iter().enumerate() {
            let rows = self.params[layer.weights.clone()].chunks_exact(layer.inputs);
            let mut y = self.params[layer.biases.clone()].to_vec();
            for (y, row) in y.iter_mut().zip(rows) {
                for (w, x) in row.iter().zip(&x) {
                    *y = Real::mul_add(*w, *x, *y);
                }
                if l + 1 < net.layers.len() {
                    *y = net.activation.value(*y);
                }
            }
            x = y;
        }
        x
    }
}
