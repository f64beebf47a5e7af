//! Import of an ONNX network as a policy.

use super::graph::{Net, Stage, Value, evaluate};
use super::proto::{Graph, Model, Size, ValueInfo};
use super::tensor::{Array, Neighbors};
use super::{API_VERSION, DETERMINISTIC, KEY, SAMPLED, chain};
use crate::error::Error;
use crate::policy::Policy;
use crate::policy::PolicyMeta;
use marathon_envs::Spec;
use marathon_physics::budget;
use prost::Message;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

/// Maximum number of operations of a graph. A policy has dozens.
const MOST_NODES: usize = 4096;
/// Memory for decoding a file, as a multiple of its length. Two bytes can encode an operation without inputs.
const DECODED: f64 = 64.0;
/// Maximum length of an observation or an action.
const LARGEST: usize = 1 << 16;
/// Names of outputs with actions, by preference, in lower case. Other outputs of the right length follow.
const ACTIONS: [&str; 8] =
    [DETERMINISTIC, "actions", "action", "mean", "mu", "mean_actions", "output", "continuous_actions"];
/// Names of the logarithm of the actions' standard deviation in files by Marathon and ML-Agents.
const LOG_STD: [&str; 2] = ["log_std", "log_sigma"];
/// Input of ML-Agents' recurrent policies.
const MEMORY: &str = "recurrent_in";
/// Logarithm of the standard deviation for files without one: almost no spread.
const SMALL: f32 = -10.0;

/// Values of the graph by name, or the reason why one is missing.
type Values = BTreeMap<String, Result<Value, String>>;

/// Reads Marathon's metadata of a file.
pub fn meta(bytes: &[u8]) -> Option<PolicyMeta> {
    noted(&model(Path::new(""), bytes).ok()?)
}

/// Decodes a file.
fn model(path: &Path, bytes: &[u8]) -> Result<Model, Error> {
    budget::MEMORY.check(DECODED * bytes.len() as f64).map_err(|e| Error::budget(path, "file", e))?;
    Model::decode(bytes).map_err(|e| Error::file(path, "file", format!("'{e}'"), "an ONNX model"))
}

fn noted(model: &Model) -> Option<PolicyMeta> {
    let document = model.metadata_props.iter().find(|property| property.key == KEY)?;
    let meta: PolicyMeta = serde_json::from_str(&document.value).ok()?;
    // other errors show up in the network
    let practical = |n: usize| (1..=LARGEST).contains(&n);
    (practical(meta.obs) && practical(meta.act) && practical(meta.frame_skip)).then_some(meta)
}

/// The task of a policy, as far as the file describes it.
fn task(meta: &PolicyMeta) -> Spec {
    let range = |i: usize| meta.action_range.get(i).copied().unwrap_or([-1.0, 1.0]);
    Spec {
        id: meta.agent.clone(),
        obs: meta.obs,
        act: meta.act,
        action_names: Vec::new(),
        action_low: (0..meta.act).map(|i| range(i)[0]).collect(),
        action_high: (0..meta.act).map(|i| range(i)[1]).collect(),
        dt: meta.control_dt,
        frame_skip: meta.frame_skip,
        max_episode_steps: usize::MAX,
        reward_terms: Vec::new(),
        info: Vec::new(),
        options: meta.options.clone(),
        nq: 0,
        nv: 0,
        ..Spec::default()
    }
}

/// Reads the policy of a file, for a given task or the one that the file names.
pub fn decode(path: &Path, bytes: &[u8], spec: Option<&Spec>) -> Result<Policy, Error> {
    // one function: a table of operators
    let wrong = |place: &str, found: String, expected: &str| Error::file(path, place, found, expected);
    let model = model(path, bytes)?;
    let noted = noted(&model);
    let spec = &match (spec, &noted) {
        (Some(spec), _) => spec.clone(),
        (None, Some(meta)) => task(meta),
        (None, None) => {
            let expected = "one, since another program than Marathon has written the file: name it";
            return Err(wrong("agent", "none".into(), expected));
        }
    };
    let graph = model.graph.ok_or_else(|| wrong("file", "no graph".into(), "an ONNX model"))?;
    if graph.node.len() > MOST_NODES {
        let expected = format!("at most {MOST_NODES}, a multi-layer perceptron");
        return Err(wrong("graph", format!("{} operations", graph.node.len()), &expected));
    }
    if graph.input.iter().any(|input| input.name == MEMORY) {
        let expected = "a policy without memory: one trained without `memory` in its `network_settings`";
        return Err(wrong("inputs", format!("'{MEMORY}'"), expected));
    }
    let input = observation(&graph, spec.obs).map_err(|found| {
        wrong("inputs", found, &format!("one observation of {} numbers, as {} has", spec.obs, spec.id))
    })?;
    let neighbors = Neighbors::of(path);
    let mut values = Values::new();
    for tensor in &graph.initializer {
        let value = Array::read(tensor, &neighbors).map(|array| Value::Constant(Rc::new(array)));
        values.insert(tensor.name.clone(), value);
    }
    values.insert(input, Ok(Value::Network(Rc::new(Net { stage: None, width: spec.obs }))));
    for node in &graph.node {
        let value = inputs(&values, &node.input).and_then(|inputs| evaluate(node, &inputs, &neighbors));
        let numbers = value.as_ref().map_or(0, Value::numbers);
        neighbors.count(numbers).map_err(|e| Error::budget(path, &format!("operation {}", node.op_type), e))?;
        let Some(output) = node.output.first() else { continue };
        values.insert(output.clone(), value);
        // further outputs, such as a dropout's mask, are for training only
        for other in &node.output[1..] {
            values.insert(other.clone(), Err(format!("output '{other}' of operation {}", node.op_type)));
        }
    }

    let expected = format!("the {} actions of {} by a multi-layer perceptron", spec.act, spec.id);
    let (name, net) = actions(&graph, &values, spec.act).map_err(|(place, found)| wrong(&place, found, &expected))?;
    let parts = chain::arrange(&stages(&net), spec.obs)
        .map_err(|found| wrong(&format!("output '{name}'"), found, "a multi-layer perceptron that a policy can be"))?;
    let finite = |list: &[f32]| list.iter().all(|x| x.is_finite());
    if !(finite(&parts.params)
        && finite(&parts.obs_mean)
        && finite(&parts.obs_std)
        && parts.obs_std.iter().all(|s| *s > 0.0))
    {
        return Err(wrong("weights", "numbers that are not finite".into(), "finite numbers"));
    }

    let mut meta = PolicyMeta::of(spec, parts.hidden, parts.activation);
    meta.observation_clip = parts.observation_clip;
    meta.action_clip = parts.action_clip;
    let of_mlagents = noted.is_none() && name == DETERMINISTIC && graph.output.iter().any(|o| o.name == API_VERSION);
    let nominal = parts.action_range.iter().all(|range| *range == [-1.0, 1.0]);
    meta.action_range = match nominal {
        // ML-Agents acts in [-1, 1], which its player maps to the task's range
        true if of_mlagents => (0..spec.act).map(|i| spec.action_range(i)).collect(),
        true => vec![[-1.0, 1.0]; spec.act],
        false => parts.action_range,
    };
    meta.squash = parts.squash;
    if of_mlagents && parts.action_clip == chain::UNBOUNDED && is_squashed(&graph, SAMPLED) {
        // ML-Agents' SAC trains the tangent of this output, but exports the output itself
        (meta.squash, meta.action_clip) = (true, 1.0);
    }
    if let Some(noted) = noted.filter(|noted| noted.agent == spec.id) {
        (meta.training, meta.evaluation) = (noted.training, noted.evaluation);
    }
    let mut log_std = log_std(&values, spec.act);
    for (log_std, scale) in log_std.iter_mut().zip(&parts.spread) {
        *log_std += libm::log(*scale) as f32;
    }
    Policy::from_parts(meta, parts.params, (parts.obs_mean, parts.obs_std), log_std)
        .map_err(|e| wrong("network", e.to_string(), "a network of a practical size"))
}

/// Whether an output is a hyperbolic tangent.
fn is_squashed(graph: &Graph, output: &str) -> bool {
    let mut name = output;
    // a node's inputs come before it, so this ends
    for node in graph.node.iter().rev() {
        if node.output.iter().any(|output| output == name) {
            match (node.op_type.as_str(), node.input.first()) {
                ("Tanh", _) => return true,
                ("Identity", Some(input)) => name = input,
                _ => return false,
            }
        }
    }
    false
}

/// Name of the input that the observation goes to.
fn observation(graph: &Graph, obs: usize) -> Result<String, String> {
    let is_constant = |name: &str| graph.initializer.iter().any(|tensor| tensor.name == name);
    let inputs: Vec<&ValueInfo> = graph.input.iter().filter(|input| !is_constant(&input.name)).collect();
    let fits = |input: &&&ValueInfo| matches!(last_dimension(input), Some(None)) || width(input) == Some(obs);
    match inputs.iter().find(fits) {
        Some(input) => Ok(input.name.clone()),
        None => {
            let found: Vec<String> = inputs.iter().map(|i| format!("'{}' of {:?} numbers", i.name, width(i))).collect();
            Err(if found.is_empty() { "none".into() } else { found.join(", ").replace("Some(", "").replace(')', "") })
        }
    }
}

/// The last dimension of an input with two dimensions. The inner value is `None` if the file leaves it open.
fn last_dimension(input: &ValueInfo) -> Option<Option<i64>> {
    let shape = input.kind.as_ref()?.tensor_type.as_ref()?.shape.as_ref()?;
    match &shape.dim[..] {
        [_, last] => match last.value {
            Some(Size::Value(n)) => Some(Some(n)),
            _ => Some(None),
        },
        _ => None,
    }
}

fn width(input: &ValueInfo) -> Option<usize> {
    last_dimension(input)?.and_then(|n| usize::try_from(n).ok())
}

/// Values of a node's inputs. An input without a name is omitted.
fn inputs(values: &Values, names: &[String]) -> Result<Vec<Option<Value>>, String> {
    let of = |name: &String| match (name.is_empty(), values.get(name)) {
        (true, _) => Ok(None),
        (false, Some(value)) => value.clone().map(Some),
        (false, None) => Err(format!("'{name}', which nothing before computes")),
    };
    names.iter().map(of).collect()
}

/// Finds the output with the best actions. The error has its place and what was found there.
fn actions(graph: &Graph, values: &Values, act: usize) -> Result<(String, Rc<Net>), (String, String)> {
    let rank = |name: &str| ACTIONS.iter().position(|a| *a == name.to_lowercase()).unwrap_or(ACTIONS.len());
    let mut names: Vec<&str> = graph.output.iter().map(|output| output.name.as_str()).collect();
    names.sort_by_key(|name| rank(name));
    let mut problem = None;
    for name in &names {
        let found = match values.get(*name) {
            Some(Ok(Value::Network(net))) if net.width == act && net.stage.is_some() => {
                return Ok((name.to_string(), net.clone()));
            }
            Some(Ok(Value::Network(net))) => format!("{} numbers", net.width),
            Some(Ok(Value::Constant(_))) => "a constant".into(),
            Some(Ok(Value::Shape(_))) => "a shape".into(),
            Some(Ok(Value::Opaque { reason, .. })) => reason.clone(),
            Some(Err(reason)) => reason.clone(),
            None => "nothing that is computed".into(),
        };
        problem.get_or_insert((format!("output '{name}'"), found));
    }
    Err(problem.unwrap_or(("outputs".into(), "none".into())))
}

/// The stages of a network in their order.
fn stages(net: &Rc<Net>) -> Vec<Stage> {
    let mut stages = Vec::new();
    let mut at = net;
    while let Some((stage, before)) = &at.stage {
        stages.push(stage.clone());
        at = before;
    }
    stages.reverse();
    stages
}

fn log_std(values: &Values, act: usize) -> Vec<f32> {
    let known = values.iter().filter(|(name, _)| LOG_STD.iter().any(|end| name.ends_with(end)));
    let mut lists = known.filter_map(|(_, value)| match value {
        Ok(Value::Constant(array)) if array.data.len() == act && array.data.iter().all(|x| x.is_finite()) => {
            Some(array.data.iter().map(|x| *x as f32).collect())
        }
        _ => None,
    });
    lists.next().unwrap_or_else(|| vec![SMALL; act])
}

#[cfg(test)]
mod tests {
    use super::super::proto::{Dimension, FLOAT, Node, Shape, Tensor, TensorType, Type};
    use super::*;

    fn error(graph: Graph) -> String {
        let model = Model { graph: Some(graph), ..Model::default() };
        let spec = Spec { id: "Any-v0".into(), obs: 2, act: 1, ..Spec::default() };
        decode(Path::new("a.onnx"), &model.encode_to_vec(), Some(&spec)).unwrap_err().to_string()
    }

    fn input() -> Vec<ValueInfo> {
        let dim = [1, 2].map(|n| Dimension { value: Some(Size::Value(n)) }).into();
        let tensor_type = Some(TensorType { elem_type: FLOAT, shape: Some(Shape { dim }) });
        vec![ValueInfo { name: "obs_0".into(), kind: Some(Type { tensor_type }) }]
    }

    /// A file of a few megabytes that would need 100 GB: it transposes the same matrix many times.
    #[test]
    fn operations_may_not_multiply_memory() {
        let numbers = 1 << 18;
        let matrix = Tensor {
            dims: vec![1, numbers],
            data_type: FLOAT,
            name: "w".into(),
            raw_data: vec![0; 4 * numbers as usize],
            ..Tensor::default()
        };
        let turn = |i: usize| Node {
            input: vec!["w".into()],
            output: vec![format!("w{i}")],
            op_type: "Transpose".into(),
            ..Node::default()
        };
        let node = (0..4096).map(turn).collect();
        let text = error(Graph { node, initializer: vec![matrix], input: input(), ..Graph::default() });
        assert!(text.starts_with("a.onnx: operation Transpose asks for "), "{text}");
        assert!(text.contains("the limit 'memory' is 2 GB"), "{text}");
    }

    /// Many tensors refer to the same numbers in an external file.
    #[test]
    #[cfg_attr(target_family = "wasm", ignore = "needs a folder for temporary files")]
    fn neighbors_may_not_multiply_memory() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("w.data"), vec![0; 1 << 20]).unwrap();
        let neighbors = Neighbors::of(&folder.path().join("a.onnx"));
        let entry = |key: &str, value: &str| super::super::proto::Property { key: key.into(), value: value.into() };
        let tensor = Tensor {
            dims: vec![1 << 18],
            data_type: FLOAT,
            name: "w".into(),
            external_data: vec![entry("location", "w.data")],
            data_location: 1,
            ..Tensor::default()
        };
        let refused = (0..1000).find_map(|_| Array::read(&tensor, &neighbors).err()).expect("a refusal");
        assert!(refused.starts_with("tensor 'w' asks for") && refused.contains("'memory'"), "{refused}");
    }
}
