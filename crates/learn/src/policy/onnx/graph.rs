//! Evaluation of a graph's operations: each value is a constant, or a stage of the network.

use super::proto::{Attribute, Node};
use super::tensor::{Array, Neighbors};
use crate::nets::activation::Activation;
use std::rc::Rc;

/// A value of the graph.
#[derive(Clone, Debug)]
pub enum Value {
    /// An array, or a batch of the same one.
    Constant(Rc<Array>),
    Network(Rc<Net>),
    /// A value that depends on the network, but of which only the number of features is used. Keeps the reason.
    Opaque {
        width: usize,
        reason: String,
    },
    /// The shape of a batch with this number of features.
    Shape(usize),
}

impl Value {
    /// Number of numbers stored in the value itself.
    pub fn numbers(&self) -> usize {
        match self {
            Value::Constant(array) => array.data.len(),
            Value::Network(net) => match &net.stage {
                Some((Stage::Scale { factor, shift }, _)) => factor.len() + shift.len(),
                Some((Stage::Dense { weights, bias }, _)) => weights.len() + bias.len(),
                _ => 0,
            },
            Value::Opaque { .. } | Value::Shape(_) => 0,
        }
    }
}

/// Elementwise functions that policies do not use. Their results may be irrelevant.
const ELEMENTWISE: [&str; 9] = ["Exp", "Log", "Softplus", "Abs", "Neg", "Sqrt", "Pow", "Reciprocal", "Erf"];
/// Operations that keep the number of features.
const ARITHMETIC: [&str; 10] = ["Add", "Sub", "Mul", "Div", "Clip", "Min", "Max", "Tanh", "Sigmoid", "Identity"];

/// A function of the observation: a stage after the previous stages. The observation itself has none.
#[derive(Debug)]
pub struct Net {
    pub stage: Option<(Stage, Rc<Net>)>,
    /// Number of features, or zero if the file does not give the length of the observation.
    pub width: usize,
}

/// A step of the computation.
#[derive(Clone, Debug, PartialEq)]
pub enum Stage {
    /// `x * factor + shift`, feature by feature.
    Scale { factor: Vec<f64>, shift: Vec<f64> },
    /// Clips to two bounds, which may be infinite.
    Clip(f64, f64),
    /// Weights, `[output][input]`, and biases.
    Dense { weights: Vec<f64>, bias: Vec<f64> },
    /// An activation.
    Activation(Activation),
    /// The logistic function, half of swish.
    Sigmoid,
}

type Result<T> = std::result::Result<T, String>;

/// Computes the value of a node from the values of its inputs (`None` for omitted ones). The error gives the reason.
pub fn evaluate(node: &Node, inputs: &[Option<Value>], neighbors: &Neighbors) -> Result<Value> {
    let op = node.op_type.as_str();
    if !matches!(node.domain.as_str(), "" | "ai.onnx") {
        return Err(format!("operation {op} of '{}', expected one of ONNX's own", node.domain));
    }
    if op == "Constant" {
        return constant(node, neighbors);
    }
    if let Some(value) = shapes(node, inputs) {
        return value;
    }
    match inputs {
        [Some(Value::Network(x)), rest @ ..] => network(node, x, rest),
        [Some(Value::Constant(a)), Some(Value::Network(x))] => reversed(op, a, x),
        [Some(Value::Constant(a)), rest @ ..] => fold(node, a, rest),
        _ => Err(format!("operation {op} without an input")),
    }
}

/// Operations on shapes, or on values of which only the shape is known. Exporters leave many of them behind.
fn shapes(node: &Node, inputs: &[Option<Value>]) -> Option<Result<Value>> {
    let op = node.op_type.as_str();
    let width = |value: &Option<Value>| match value {
        Some(Value::Network(net)) => Some(net.width),
        Some(Value::Opaque { width, .. }) => Some(*width),
        _ => None,
    };
    let known = inputs.iter().find_map(width);
    let reason = inputs.iter().find_map(|value| match value {
        Some(Value::Opaque { reason, .. }) => Some(reason.clone()),
        _ => None,
    });
    match (op, inputs) {
        ("Shape", [value]) => Some(Ok(Value::Shape(width(value)?))),
        ("ConstantOfShape", [Some(Value::Shape(_))]) => {
            let value = attribute(node, "value").and_then(|a| a.t.as_ref());
            let fill = value.map_or(Some(0.0), |tensor| {
                tensor.float_data.first().map(|x| f64::from(*x)).or_else(|| {
                    let raw: &[u8; 4] = tensor.raw_data.first_chunk()?;
                    Some(f64::from(f32::from_le_bytes(*raw)))
                })
            });
            Some(
                fill.map(|x| Value::Constant(Array::scalar(x).into()))
                    .ok_or_else(|| "a constant without a value".into()),
            )
        }
        ("Expand", [Some(value @ Value::Constant(_)), Some(Value::Shape(_))]) => Some(Ok(value.clone())),
        ("Expand", [value @ Some(of), Some(Value::Shape(n))]) if width(value) == Some(*n) => Some(Ok(of.clone())),
        _ if reason.is_some() && (ELEMENTWISE.contains(&op) || ARITHMETIC.contains(&op)) => {
            Some(Ok(Value::Opaque { width: known?, reason: reason? }))
        }
        _ if reason.is_some() => Some(Err(reason?)),
        _ if known.is_some() && ELEMENTWISE.contains(&op) => {
            let reason = format!("operation {op} on the network, which no policy has");
            Some(Ok(Value::Opaque { width: known?, reason }))
        }
        _ => None,
    }
}

fn attribute<'a>(node: &'a Node, name: &str) -> Option<&'a Attribute> {
    node.attribute.iter().find(|a| a.name == name)
}

fn number(node: &Node, name: &str, default: f64) -> f64 {
    attribute(node, name).map_or(default, |a| f64::from(a.f))
}

fn integer(node: &Node, name: &str, default: i64) -> i64 {
    attribute(node, name).map_or(default, |a| a.i)
}

fn constant(node: &Node, neighbors: &Neighbors) -> Result<Value> {
    let array = match (attribute(node, "value"), attribute(node, "value_float"), attribute(node, "value_floats")) {
        (Some(a), ..) => Array::read(a.t.as_ref().ok_or("a constant without a value")?, neighbors)?,
        (_, Some(a), _) => Array::scalar(f64::from(a.f)),
        (_, _, Some(a)) => {
            Array { shape: vec![a.floats.len()], data: a.floats.iter().map(|x| f64::from(*x)).collect() }
        }
        _ => match (attribute(node, "value_int"), attribute(node, "value_ints")) {
            (Some(a), _) => Array::scalar(a.i as f64),
            (_, Some(a)) => Array { shape: vec![a.ints.len()], data: a.ints.iter().map(|x| *x as f64).collect() },
            _ => return Err("a constant that is not a tensor of numbers".into()),
        },
    };
    Ok(Value::Constant(array.into()))
}

/// Operations on constants only.
fn fold(node: &Node, a: &Rc<Array>, rest: &[Option<Value>]) -> Result<Value> {
    let op = node.op_type.as_str();
    let two = |f: fn(f64, f64) -> f64| match rest {
        [Some(Value::Constant(b))] => {
            a.zip(b, f).ok_or_else(|| format!("operation {op} on shapes {:?} and {:?}", a.shape, b.shape))
        }
        _ => Err(format!("operation {op} on {} inputs", rest.len() + 1)),
    };
    let array = match op {
        "Identity" | "Cast" => return Ok(Value::Constant(a.clone())),
        "Transpose" => a.transposed().ok_or_else(|| format!("operation {op} on shape {:?}", a.shape))?,
        // the position of dimensions of length 1 does not matter, see `spread`
        "Squeeze" | "Unsqueeze" if a.single().is_some() => Array::scalar(a.data[0]),
        "Unsqueeze" if a.shape.len() == 1 => Array { shape: vec![1, a.data.len()], data: a.data.clone() },
        "Sqrt" => a.map(f64::sqrt),
        "Exp" => a.map(libm::exp),
        "Neg" => a.map(|x| -x),
        "Reciprocal" => a.map(|x| 1.0 / x),
        "Add" => two(|x, y| x + y)?,
        "Sub" => two(|x, y| x - y)?,
        "Mul" => two(|x, y| x * y)?,
        "Div" => two(|x, y| x / y)?,
        _ => return Err(format!("operation {op} on constants")),
    };
    Ok(Value::Constant(array.into()))
}

/// Operations with a constant on the left of the network.
fn reversed(op: &str, a: &Array, x: &Rc<Net>) -> Result<Value> {
    let list = || a.spread(x.width).ok_or_else(|| widths(op, a, x));
    match op {
        "Add" => scale(x, vec![1.0; x.width], list()?),
        "Mul" => scale(x, list()?, vec![0.0; x.width]),
        "Sub" => scale(x, vec![-1.0; x.width], list()?),
        "Min" | "Max" => bound(op, a, x),
        _ => Err(format!("operation {op} of a constant and the network")),
    }
}

/// Operations on the network, with constants on the right.
fn network(node: &Node, x: &Rc<Net>, rest: &[Option<Value>]) -> Result<Value> {
    let op = node.op_type.as_str();
    let after = |stage: Stage| Ok(Value::Network(Rc::new(Net { stage: Some((stage, x.clone())), width: x.width })));
    match (op, rest) {
        ("Identity" | "Cast" | "Dropout", _) => Ok(Value::Network(x.clone())),
        ("Flatten", []) if matches!(integer(node, "axis", 1), 1 | -1) => Ok(Value::Network(x.clone())),
        ("Concat", []) => Ok(Value::Network(x.clone())),
        ("Reshape", [Some(Value::Constant(shape))]) => match shape.data[..] {
            [_, n] if n == x.width as f64 || n == -1.0 => Ok(Value::Network(x.clone())),
            _ => Err(format!("operation Reshape to {:?}, expected a batch of {} numbers", shape.data, x.width)),
        },
        ("Tanh", []) => after(Stage::Activation(Activation::Tanh)),
        ("Relu", []) => after(Stage::Activation(Activation::Relu)),
        ("Elu", []) if number(node, "alpha", 1.0) == 1.0 => after(Stage::Activation(Activation::Elu)),
        ("Swish", []) if number(node, "alpha", 1.0) == 1.0 => after(Stage::Activation(Activation::Swish)),
        ("Sigmoid", []) => after(Stage::Sigmoid),
        ("Mul", [Some(Value::Network(y))]) => swish(x, y),
        ("Clip", _) => {
            let limit = |i: usize, name: &str, default: f64| match rest.get(i) {
                Some(Some(Value::Constant(a))) => a.single().ok_or("operation Clip with bounds that are not numbers"),
                Some(Some(_)) => Err("operation Clip with bounds that are computed"),
                Some(None) | None => Ok(number(node, name, default)),
            };
            clip(x, limit(0, "min", f64::NEG_INFINITY)?, limit(1, "max", f64::INFINITY)?)
        }
        ("Min" | "Max", [Some(Value::Constant(a))]) => bound(op, a, x),
        ("Add" | "Sub" | "Mul" | "Div", [Some(Value::Constant(a))]) => {
            let b = a.spread(x.width).ok_or_else(|| widths(op, a, x))?;
            let (one, zero) = (vec![1.0; x.width], vec![0.0; x.width]);
            match op {
                "Add" => scale(x, one, b),
                "Sub" => scale(x, one, b.iter().map(|b| -b).collect()),
                "Mul" => scale(x, b, zero),
                _ => scale(x, b.iter().map(|b| 1.0 / b).collect(), zero),
            }
        }
        ("MatMul", [Some(Value::Constant(w))]) => {
            let weights = w.transposed().ok_or_else(|| widths(op, w, x))?;
            dense(x, &weights, None)
        }
        ("Gemm", [Some(Value::Constant(w)), bias @ ..]) if integer(node, "transA", 0) == 0 => {
            let (alpha, beta) = (number(node, "alpha", 1.0), number(node, "beta", 1.0));
            let w = match integer(node, "transB", 0) {
                0 => w.transposed().ok_or_else(|| widths(op, w, x))?,
                _ => (**w).clone(),
            };
            let bias = match bias {
                [] | [None] => None,
                [Some(Value::Constant(b))] => Some(b.map(|b| b * beta)),
                _ => return Err("operation Gemm with a bias that is computed".into()),
            };
            dense(x, &w.map(|w| w * alpha), bias)
        }
        _ => Err(format!("operation {op} on the network, which no policy has")),
    }
}

fn widths(op: &str, a: &Array, x: &Net) -> String {
    format!("operation {op} of {} features with a constant of shape {:?}", x.width, a.shape)
}

fn scale(x: &Rc<Net>, factor: Vec<f64>, shift: Vec<f64>) -> Result<Value> {
    let stage = Stage::Scale { factor, shift };
    Ok(Value::Network(Rc::new(Net { stage: Some((stage, x.clone())), width: x.width })))
}

fn bound(op: &str, a: &Array, x: &Rc<Net>) -> Result<Value> {
    let limit = a.single().ok_or_else(|| format!("operation {op} with bounds that are not one number"))?;
    if op == "Min" { clip(x, f64::NEG_INFINITY, limit) } else { clip(x, limit, f64::INFINITY) }
}

fn clip(x: &Rc<Net>, low: f64, high: f64) -> Result<Value> {
    // two clips in a row are one clip, if the ranges overlap
    let (low, high, x) = match &x.stage {
        Some((Stage::Clip(l, h), before)) if low.max(*l) <= high.min(*h) => (low.max(*l), high.min(*h), before),
        _ => (low, high, x),
    };
    if low.is_nan() || high.is_nan() || low > high {
        return Err(format!("operation Clip to [{low}, {high}]"));
    }
    if low == f64::NEG_INFINITY && high == f64::INFINITY {
        return Ok(Value::Network(x.clone()));
    }
    Ok(Value::Network(Rc::new(Net { stage: Some((Stage::Clip(low, high), x.clone())), width: x.width })))
}

/// `x * sigmoid(x)` in either order.
fn swish(x: &Rc<Net>, y: &Rc<Net>) -> Result<Value> {
    let is_gate = |gate: &Net, x: &Rc<Net>| matches!(&gate.stage, Some((Stage::Sigmoid, of)) if Rc::ptr_eq(of, x));
    let x = match (is_gate(y, x), is_gate(x, y)) {
        (true, _) => x,
        (_, true) => y,
        _ => {
            return Err(
                "operation Mul of two parts of the network, expected a number's product with its sigmoid".into()
            );
        }
    };
    let stage = Stage::Activation(Activation::Swish);
    Ok(Value::Network(Rc::new(Net { stage: Some((stage, x.clone())), width: x.width })))
}

/// A layer with weights `[output][input]`.
fn dense(x: &Rc<Net>, weights: &Array, bias: Option<Array>) -> Result<Value> {
    let outputs = match weights.matrix() {
        Some((outputs, inputs)) if inputs == x.width && outputs > 0 => outputs,
        _ => return Err(format!("a layer of shape {:?} after {} features", weights.shape, x.width)),
    };
    let bias = match bias {
        None => vec![0.0; outputs],
        Some(b) => b.spread(outputs).ok_or_else(|| format!("biases of shape {:?} of {outputs} outputs", b.shape))?,
    };
    let stage = Stage::Dense { weights: weights.data.clone(), bias };
    Ok(Value::Network(Rc::new(Net { stage: Some((stage, x.clone())), width: outputs })))
}
