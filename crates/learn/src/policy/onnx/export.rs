//! Export of a policy as an ONNX model that follows ML-Agents' contract.

use super::proto::{
    ATTRIBUTE_FLOAT, ATTRIBUTE_INT, Attribute, Dimension, FLOAT, Graph, Model, Node, OperatorSet, Property, Shape,
    Size, Tensor, TensorType, Type, ValueInfo,
};
use super::{API_VERSION, DETERMINISTIC, KEY, OBSERVATION, SAMPLED};
use crate::nets::activation::Activation;
use crate::policy::Policy;
use prost::Message;

/// The operator set of ML-Agents' exporter: any runtime since 2019 reads it.
const OPSET: i64 = 9;
const IR_VERSION: i64 = 4;
/// ML-Agents' `ModelApiVersion` 2.0.
const VERSION: f32 = 3.0;

/// The bytes of the file.
pub fn encode(policy: &Policy) -> Vec<u8> {
    let meta = policy.meta();
    let (net, params) = (policy.net(), policy.params());
    let mut g = Builder::default();

    // clamp((obs - mean) / std)
    let normalizer = policy.normalizer();
    let inverse: Vec<f32> = normalizer.std().iter().map(|std| 1.0 / std).collect();
    let mean = g.constant("obs_mean", &[meta.obs], normalizer.mean());
    let inverse = g.constant("obs_inverse_std", &[meta.obs], &inverse);
    let centered = g.op("Sub", &[OBSERVATION, &mean], "obs_centered");
    let scaled = g.op("Mul", &[&centered, &inverse], "obs_scaled");
    let mut x = g.clip(&scaled, meta.observation_clip, "normalized");

    let layers = net.layers().count();
    for (l, (weights, biases)) in net.layers().enumerate() {
        let shape = [net.sizes()[l + 1], net.sizes()[l]];
        let w = g.constant(&format!("layer.{l}.weight"), &shape, &params[weights]);
        let b = g.constant(&format!("layer.{l}.bias"), &shape[..1], &params[biases]);
        x = g.op("Gemm", &[&x, &w, &b], &format!("layer.{l}"));
        let scale = |name: &str| Attribute { name: name.into(), f: 1.0, kind: ATTRIBUTE_FLOAT, ..Default::default() };
        let transposed = Attribute { name: "transB".into(), i: 1, kind: ATTRIBUTE_INT, ..Default::default() };
        g.attributes([scale("alpha"), scale("beta"), transposed]);
        if l + 1 < layers {
            x = g.activation(meta.activation, &x, l);
        }
    }

    // the best action, and one sampled as in training
    g.actions(policy, &x, DETERMINISTIC);
    let log_std = g.constant("log_std", &[1, meta.act], policy.log_std());
    let std = g.op("Exp", &[&log_std], "std");
    let noise = g.op("RandomNormalLike", &[&x], "noise");
    g.attributes([Attribute { name: "dtype".into(), i: FLOAT as i64, kind: ATTRIBUTE_INT, ..Default::default() }]);
    let scaled = g.op("Mul", &[&noise, &std], "noise_scaled");
    let drawn = g.op("Add", &[&x, &scaled], "drawn");
    g.actions(policy, &drawn, SAMPLED);

    let facts = [(API_VERSION, VERSION), ("memory_size", 0.0), ("continuous_action_output_shape", meta.act as f32)];
    for (name, value) in facts {
        let constant = g.constant(&format!("{name}_value"), &[1], &[value]);
        g.op("Identity", &[&constant], name);
    }
    let output = vec![
        value_info(API_VERSION, None, 1),
        value_info("memory_size", None, 1),
        value_info(SAMPLED, Some("batch"), meta.act),
        value_info("continuous_action_output_shape", None, 1),
        value_info(DETERMINISTIC, Some("batch"), meta.act),
    ];
    let model = Model {
        ir_version: IR_VERSION,
        producer_name: "marathon".into(),
        producer_version: env!("CARGO_PKG_VERSION").into(),
        graph: Some(Graph {
            node: g.nodes,
            name: meta.agent.clone(),
            initializer: g.constants,
            input: vec![value_info(OBSERVATION, Some("batch"), meta.obs)],
            output,
        }),
        opset_import: vec![OperatorSet { domain: String::new(), version: OPSET }],
        metadata_props: vec![Property {
            key: KEY.into(),
            value: serde_json::to_string(meta).expect("documents are plain data"),
        }],
    };
    model.encode_to_vec()
}

/// A graph under construction, in the order of execution.
#[derive(Default)]
struct Builder {
    nodes: Vec<Node>,
    constants: Vec<Tensor>,
}

impl Builder {
    fn constant(&mut self, name: &str, shape: &[usize], data: &[f32]) -> String {
        self.constants.push(Tensor {
            dims: shape.iter().map(|n| *n as i64).collect(),
            data_type: FLOAT,
            name: name.into(),
            raw_data: data.iter().flat_map(|x| x.to_le_bytes()).collect(),
            ..Default::default()
        });
        name.into()
    }

    fn op(&mut self, op_type: &str, input: &[&str], output: &str) -> String {
        self.nodes.push(Node {
            input: input.iter().map(|name| name.to_string()).collect(),
            output: vec![output.into()],
            name: output.into(),
            op_type: op_type.into(),
            ..Default::default()
        });
        output.into()
    }

    /// Attributes of the last operation.
    fn attributes<const N: usize>(&mut self, attributes: [Attribute; N]) {
        if let Some(node) = self.nodes.last_mut() {
            node.attribute.extend(attributes);
        }
    }

    fn clip(&mut self, input: &str, bound: f32, output: &str) -> String {
        if bound == f32::MAX {
            return self.op("Identity", &[input], output);
        }
        let output = self.op("Clip", &[input], output);
        let limit = |name: &str, f| Attribute { name: name.into(), f, kind: ATTRIBUTE_FLOAT, ..Default::default() };
        self.attributes([limit("min", -bound), limit("max", bound)]);
        output
    }

    fn activation(&mut self, activation: Activation, x: &str, layer: usize) -> String {
        let output = format!("hidden.{layer}");
        match activation {
            Activation::Swish => {
                let sigmoid = self.op("Sigmoid", &[x], &format!("sigmoid.{layer}"));
                self.op("Mul", &[x, &sigmoid], &output)
            }
            Activation::Tanh => self.op("Tanh", &[x], &output),
            Activation::Elu => self.op("Elu", &[x], &output),
            Activation::Relu => self.op("Relu", &[x], &output),
        }
    }

    /// Maps the network's output to actions in the environment's units.
    fn actions(&mut self, policy: &Policy, x: &str, output: &str) {
        let meta = policy.meta();
        let squashed = if meta.squash { self.op("Tanh", &[x], &format!("{output}.squashed")) } else { x.into() };
        if meta.action_range.iter().all(|range| *range == [-1.0, 1.0]) {
            self.clip(&squashed, meta.action_clip, output);
            return;
        }
        let nominal = self.clip(&squashed, meta.action_clip, &format!("{output}.nominal"));
        let of_range = |f: fn(f32, f32) -> f32| meta.action_range.iter().map(|[l, h]| f(*l, *h)).collect::<Vec<f32>>();
        let half = self.constant(&format!("{output}.half"), &[meta.act], &of_range(|l, h| 0.5 * (h - l)));
        let middle = self.constant(&format!("{output}.middle"), &[meta.act], &of_range(|l, h| 0.5 * (l + h)));
        let scaled = self.op("Mul", &[&nominal, &half], &format!("{output}.scaled"));
        self.op("Add", &[&scaled, &middle], output);
    }
}

/// A list, or a batch of them.
fn value_info(name: &str, batch: Option<&str>, n: usize) -> ValueInfo {
    let dim = |value| Dimension { value: Some(value) };
    let batch = batch.map(|name| dim(Size::Param(name.into())));
    let shape = Shape { dim: batch.into_iter().chain([dim(Size::Value(n as i64))]).collect() };
    let tensor_type = Some(TensorType { elem_type: FLOAT, shape: Some(shape) });
    ValueInfo { name: name.into(), kind: Some(Type { tensor_type }) }
}
