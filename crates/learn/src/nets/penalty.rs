//! Gradient penalties: the gradient of a loss that contains the derivative of a network with respect to its input.
//!
//! Take a network `d(x)` with one output, layers `a_l = W_l h_(l-1) + b_l`, `h_l = s(a_l)`, `h_0 = x`, and a weight
//! `w`. The penalty is `w/2 |grad_x d|^2`. Its gradient with respect to the parameters is that of `w (v . grad_x d)`
//! with `v = grad_x d` held constant. `v . grad_x d` is the derivative of `d` along `v`, which a second forward pass
//! computes with the first:
//!
//! ```text
//! t_0 = v      u_l = W_l t_(l-1)      t_l = s'(a_l) u_l                                  tangents
//! p_l = s'(a_l) W_(l+1)^T p_(l+1)     p_L = 1                                            derivatives of d by a_l
//! q_l = s'(a_l) W_(l+1)^T q_(l+1) + s''(a_l) u_l W_(l+1)^T (w p_(l+1))     q_L = dloss/dd
//! gradient of W_l: q_l h_(l-1)^T + w p_l t_(l-1)^T       of b_l: q_l
//! ```

use super::activation::Activation;
use super::mlp::{CHUNK, Mlp, Outer, Transposed};
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::tiles;
use marathon_physics::lanes::{Kernel, Real};
use std::marker::PhantomData;

/// Work space for a chunk of blocks, per layer of the network.
pub struct PenaltySpace<S> {
    /// Outputs `h_l` of the hidden layers, then `d`.
    values: Vec<Blocks<S>>,
    /// First and second derivatives of the activations.
    slopes: Vec<Blocks<S>>,
    curves: Vec<Blocks<S>>,
    /// `p_l`, from the first layer to the last.
    back: Vec<Blocks<S>>,
    /// `grad_x d`.
    slope: Blocks<S>,
    /// `u_l` and `t_l` of the hidden layers.
    along: Vec<Blocks<S>>,
    tangents: Vec<Blocks<S>>,
    /// `q_l`.
    deltas: Vec<Blocks<S>>,
    /// `W_(l+1)^T p_(l+1)` of the hidden layers.
    pulled: Vec<Blocks<S>>,
    /// Zeros in place of biases, and a gradient that is added.
    zeros: Vec<S>,
    gradient: Vec<S>,
}

impl<S: Copy + Default> PenaltySpace<S> {
    /// The network's output.
    pub fn output(&self) -> &Blocks<S> {
        &self.values[self.values.len() - 1]
    }
    /// Output, and the derivative of the loss with respect to it. Fill the latter before the backward pass.
    pub fn output_and_delta(&mut self) -> (&Blocks<S>, &mut Blocks<S>) {
        let last = self.values.len() - 1;
        (&self.values[last], &mut self.deltas[last])
    }
    /// Derivative of the output with respect to the input, after [`Mlp::penalty_forward`].
    pub fn slope(&self) -> &Blocks<S> {
        &self.slope
    }
}

impl Mlp {
    /// Creates the work space for a penalty.
    pub fn penalty_space<S: Copy + Default>(&self) -> PenaltySpace<S> {
        let all = || self.layers.iter().map(|l| Blocks::new(CHUNK, l.outputs)).collect::<Vec<_>>();
        let hidden = || all().into_iter().take(self.layers.len() - 1).collect::<Vec<_>>();
        PenaltySpace {
            values: all(),
            slopes: hidden(),
            curves: hidden(),
            back: all(),
            slope: self.input(),
            along: hidden(),
            tangents: hidden(),
            deltas: all(),
            pulled: hidden(),
            zeros: vec![S::default(); self.layers.iter().map(|l| l.outputs).max().unwrap_or(0)],
            gradient: vec![S::default(); self.layers.iter().map(|l| l.weights.len()).max().unwrap_or(0)],
        }
    }

    /// Computes the output, its derivative with respect to the input, and intermediate results for the backward pass,
    /// for the first blocks of `input`.
    pub fn penalty_forward<T: Real>(
        &self,
        params: &[T::Scalar],
        input: &Blocks<T::Scalar>,
        space: &mut PenaltySpace<T::Scalar>,
        blocks: usize,
    ) {
        let s = space;
        let last = self.layers.len() - 1;
        for (l, layer) in self.layers.iter().enumerate() {
            let (before, rest) = s.values.split_at_mut(l);
            let x = if l == 0 { input } else { &before[l - 1] };
            let (w, b) = (&params[layer.weights.clone()], &params[layer.biases.clone()]);
            T::enter(Affine::<T> { w, b, x, y: &mut rest[0], blocks });
            if l < last {
                let activation = self.activation;
                let (slope, curve) = (&mut s.slopes[l], &mut s.curves[l]);
                T::enter(Bend::<T> { activation, y: &mut rest[0], slope, curve, blocks, lanes: PhantomData });
            }
        }
        for b in 0..blocks {
            s.back[last].block_mut(b).fill(T::scalar(1.0));
        }
        for (l, layer) in self.layers.iter().enumerate().rev() {
            let (before, rest) = s.back.split_at_mut(l);
            let (w, dy) = (&params[layer.weights.clone()], &rest[0]);
            if l == 0 {
                T::enter(Transposed::<T> { w, dy, dx: &mut s.slope, blocks });
                break;
            }
            T::enter(Transposed::<T> { w, dy, dx: &mut s.pulled[l - 1], blocks });
            let (a, b, out) = (&s.pulled[l - 1], &s.slopes[l - 1], &mut before[l - 1]);
            T::enter(Product::<T> { a, b, out, blocks, lanes: PhantomData });
        }
    }

    /// Overwrites `gradient` with the gradient of the loss plus `weight / 2 |slope|^2`, summed over the blocks.
    /// Requires [`Mlp::penalty_forward`] on the same input, and the derivative of the loss with respect to the output.
    pub fn penalty_backward<T: Real>(
        &self,
        params: &[T::Scalar],
        input: &Blocks<T::Scalar>,
        (space, weight): (&mut PenaltySpace<T::Scalar>, f64),
        gradient: &mut [T::Scalar],
        blocks: usize,
    ) {
        let s = space;
        let last = self.layers.len() - 1;
        for (l, layer) in self.layers[..last].iter().enumerate() {
            let x = if l == 0 { &s.slope } else { &s.tangents[l - 1] };
            let (w, b) = (&params[layer.weights.clone()], &s.zeros[..layer.outputs]);
            T::enter(Affine::<T> { w, b, x, y: &mut s.along[l], blocks });
            let (a, b, out) = (&s.along[l], &s.slopes[l], &mut s.tangents[l]);
            T::enter(Product::<T> { a, b, out, blocks, lanes: PhantomData });
        }
        for (l, layer) in self.layers.iter().enumerate().rev() {
            let (before, rest) = s.deltas.split_at_mut(l);
            let (w, dy) = (&params[layer.weights.clone()], &rest[0]);
            let (x, t) = if l == 0 { (input, &s.slope) } else { (&s.values[l - 1], &s.tangents[l - 1]) };
            let (dw, db) = gradient[layer.weights.start..layer.biases.end].split_at_mut(layer.weights.len());
            let (more, none) = (&mut s.gradient[..layer.weights.len()], &mut s.zeros[..layer.outputs]);
            T::enter(Outer::<T> { x: t, dy: &s.back[l], dw: more, db: none, blocks, lanes: PhantomData });
            none.fill(T::scalar(0.0));
            T::enter(Outer::<T> { x, dy, dw, db, blocks, lanes: PhantomData });
            T::enter(AddTimes::<T> { sum: dw, x: more, factor: weight, lanes: PhantomData });
            if l > 0 {
                T::enter(Transposed::<T> { w, dy, dx: &mut before[l - 1], blocks });
                let (slope, curve) = (&s.slopes[l - 1], &s.curves[l - 1]);
                let (along, pulled, delta) = (&s.along[l - 1], &s.pulled[l - 1], &mut before[l - 1]);
                T::enter(Turn::<T> { slope, curve, along, pulled, weight, delta, blocks, lanes: PhantomData });
            }
        }
    }
}

/// `y = W x + b`.
struct Affine<'a, T: Real> {
    w: &'a [T::Scalar],
    b: &'a [T::Scalar],
    x: &'a Blocks<T::Scalar>,
    y: &'a mut Blocks<T::Scalar>,
    blocks: usize,
}

impl<T: Real> Kernel<T> for Affine<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Affine { w, b, x, y, blocks } = self;
        let (x_stride, y_stride, no) = (x.stride(), y.stride(), y.features());
        tiles::affine::<T>((w, b), (x.as_rows(), x_stride, x.features()), (y.as_rows_mut(), y_stride, no), blocks);
    }
}

/// An activation in place, with its first and second derivative.
struct Bend<'a, T: Real> {
    activation: Activation,
    y: &'a mut Blocks<T::Scalar>,
    slope: &'a mut Blocks<T::Scalar>,
    curve: &'a mut Blocks<T::Scalar>,
    blocks: usize,
    lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Bend<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Bend { activation, y, slope, curve, blocks, .. } = self;
        let (zero, one, two) = (T::zero(), T::lit(1.0), T::lit(2.0));
        macro_rules! bend {
            ($x:ident => $f:expr) => {
                for b in 0..blocks {
                    let all = y.block_mut(b).chunks_exact_mut(T::LANES);
                    let slopes = slope.block_mut(b).chunks_exact_mut(T::LANES);
                    let curves = curve.block_mut(b).chunks_exact_mut(T::LANES);
                    for ((v, slope), curve) in all.zip(slopes).zip(curves) {
                        let $x = T::load(v);
                        let [value, first, second] = $f;
                        value.store(v);
                        first.store(slope);
                        second.store(curve);
                    }
                }
            };
        }
        match activation {
            Activation::Swish => bend!(x => {
                let s = (one + (-x).exp()).recip();
                let y = x * s;
                // s (1 - s) (2 + x - 2 y)
                [y, y.neg_mul_add(s, y) + s, s.neg_mul_add(s, s) * y.neg_mul_add(two, two + x)]
            }),
            Activation::Tanh => bend!(x => {
                let y = x.tanh();
                let slope = y.neg_mul_add(y, one);
                [y, slope, y * slope * T::lit(-2.0)]
            }),
            Activation::Elu => bend!(x => {
                let positive = zero.lt(x);
                let e = x.min(zero).exp();
                [T::select(positive, x, e - one), T::select(positive, one, e), T::select(positive, zero, e)]
            }),
            Activation::Relu => bend!(x => [x.max(zero), T::masked(zero.lt(x), one), zero]),
        }
    }
}

/// `out = a b`.
struct Product<'a, T: Real> {
    a: &'a Blocks<T::Scalar>,
    b: &'a Blocks<T::Scalar>,
    out: &'a mut Blocks<T::Scalar>,
    blocks: usize,
    lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Product<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for b in 0..self.blocks {
            let (x, y) = (self.a.block(b), self.b.block(b));
            for (at, out) in self.out.block_mut(b).chunks_exact_mut(T::LANES).enumerate() {
                (T::load(&x[at * T::LANES..]) * T::load(&y[at * T::LANES..])).store(out);
            }
        }
    }
}

/// `sum += factor x`, of any length.
struct AddTimes<'a, T: Real> {
    sum: &'a mut [T::Scalar],
    x: &'a [T::Scalar],
    factor: f64,
    lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for AddTimes<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        // the same split for every vector width
        let whole = self.sum.len() / BLOCK * BLOCK;
        let (sum, sum_rest) = self.sum.split_at_mut(whole);
        let (x, x_rest) = self.x.split_at(whole);
        let factor = T::lit(self.factor);
        for (s, x) in sum.chunks_exact_mut(T::LANES).zip(x.chunks_exact(T::LANES)) {
            factor.mul_add(T::load(x), T::load(s)).store(s);
        }
        for (s, x) in sum_rest.iter_mut().zip(x_rest) {
            *s = T::scalar(self.factor * T::widen(*x) + T::widen(*s));
        }
    }
}

/// `delta = slope delta + weight curve along pulled`: from the gradient after an activation to that before it.
struct Turn<'a, T: Real> {
    slope: &'a Blocks<T::Scalar>,
    curve: &'a Blocks<T::Scalar>,
    along: &'a Blocks<T::Scalar>,
    pulled: &'a Blocks<T::Scalar>,
    weight: f64,
    delta: &'a mut Blocks<T::Scalar>,
    blocks: usize,
    lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Turn<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let weight = T::lit(self.weight);
        for b in 0..self.blocks.min(CHUNK) {
            let [slope, curve, along, pulled] =
                [self.slope, self.curve, self.along, self.pulled].map(|blocks| blocks.block(b));
            let delta = self.delta.block_mut(b);
            for (i, d) in delta.chunks_exact_mut(T::LANES).enumerate() {
                let at = i * T::LANES;
                let bend = T::load(&curve[at..]) * T::load(&along[at..]) * T::load(&pulled[at..]);
                T::load(d).mul_add(T::load(&slope[at..]), bend * weight).store(d);
            }
        }
    }
}
