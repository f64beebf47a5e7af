//! Activations of the hidden layers and their derivatives, on lanes.

use crate::lanes::buffer::Blocks;
use marathon_physics::lanes::Real;
use serde::{Deserialize, Serialize};

/// Activation of the hidden layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// `x sigmoid(x)`, also called SiLU.
    Swish,
    /// Hyperbolic tangent.
    Tanh,
    /// `x` above zero, `exp(x) - 1` below.
    Elu,
    /// `max(x, 0)`.
    Relu,
}

impl Activation {
    /// Names in configurations and files.
    pub const NAMES: [&str; 4] = ["swish", "tanh", "elu", "relu"];
    /// All of them.
    pub const ALL: [Activation; 4] = [Activation::Swish, Activation::Tanh, Activation::Elu, Activation::Relu];

    /// Name in configurations and files.
    pub fn name(self) -> &'static str {
        match self {
            Activation::Swish => "swish",
            Activation::Tanh => "tanh",
            Activation::Elu => "elu",
            Activation::Relu => "relu",
        }
    }

    /// Whether the derivative does not follow from the value, so the forward pass stores it.
    pub(crate) fn stores_slope(self) -> bool {
        self == Activation::Swish
    }

    /// The value.
    #[inline(always)]
    pub(crate) fn value<T: Real>(self, x: T) -> T {
        match self {
            Activation::Swish => swish(x).0,
            Activation::Tanh => x.tanh(),
            Activation::Elu => elu(x),
            Activation::Relu => x.max(T::zero()),
        }
    }
}

impl std::str::FromStr for Activation {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|a| a.name() == s);
        found.ok_or_else(|| format!("unknown activation '{s}'; expected one of swish, tanh, elu, relu"))
    }
}

/// Value and derivative.
#[inline(always)]
fn swish<T: Real>(x: T) -> (T, T) {
    let s = (T::lit(1.0) + (-x).exp()).recip();
    let y = x * s;
    // s + y (1 - s)
    (y, y.neg_mul_add(s, y) + s)
}

#[inline(always)]
fn elu<T: Real>(x: T) -> T {
    let zero = T::zero();
    T::select(zero.lt(x), x, x.min(zero).exp() - T::lit(1.0))
}

/// Applies an activation to the first `rows` rows of `blocks` blocks in place. Stores the derivative where the backward
/// pass needs it.
#[inline(always)]
pub(crate) fn apply<T: Real>(
    activation: Activation,
    y: &mut Blocks<T::Scalar>,
    slope: Option<&mut Blocks<T::Scalar>>,
    blocks: std::ops::Range<usize>,
) {
    // one loop per activation: the branch is outside
    macro_rules! in_place {
        ($x:ident => $f:expr) => {
            for b in blocks {
                for v in y.block_mut(b).chunks_exact_mut(T::LANES) {
                    let $x = T::load(v);
                    $f.store(v);
                }
            }
        };
    }
    match (activation, slope) {
        (Activation::Swish, Some(slope)) => {
            for b in blocks {
                let out = y.block_mut(b).chunks_exact_mut(T::LANES);
                for (v, d) in out.zip(slope.block_mut(b).chunks_exact_mut(T::LANES)) {
                    let (value, derivative) = swish(T::load(v));
                    value.store(v);
                    derivative.store(d);
                }
            }
        }
        (Activation::Swish, None) => in_place!(x => swish(x).0),
        (Activation::Tanh, _) => in_place!(x => x.tanh()),
        (Activation::Elu, _) => in_place!(x => elu(x)),
        (Activation::Relu, _) => in_place!(x => x.max(T::zero())),
    }
}

/// Multiplies gradients by the derivative of the activation at the values `y` (for swish: by the stored derivative).
#[inline(always)]
pub(crate) fn apply_slope<T: Real>(
    activation: Activation,
    y: &Blocks<T::Scalar>,
    slope: Option<&Blocks<T::Scalar>>,
    d: &mut Blocks<T::Scalar>,
    blocks: std::ops::Range<usize>,
) {
    let one = T::lit(1.0);
    macro_rules! scale {
        ($from:expr, $y:ident => $f:expr) => {
            for b in blocks {
                let at = $from.block(b).chunks_exact(T::LANES);
                for (v, at) in d.block_mut(b).chunks_exact_mut(T::LANES).zip(at) {
                    let $y = T::load(at);
                    (T::load(v) * $f).store(v);
                }
            }
        };
    }
    match activation {
        Activation::Swish => {
            let slope = slope.expect("the forward pass of training stores swish's derivative");
            scale!(slope, s => s)
        }
        Activation::Tanh => scale!(y, y => y.neg_mul_add(y, one)),
        Activation::Elu => scale!(y, y => (y + one).min(one)),
        Activation::Relu => scale!(y, y => T::masked(T::zero().lt(y), one)),
    }
}
