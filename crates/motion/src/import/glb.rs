//! glTF animations in `.glb` files, as Mixamo's characters have them after a pass through Blender, and Blender's own.
//!
//! The skeleton is the joints of the first skin, or else the nodes that move and what hangs from them. The first animation is read; rotations of all
//! joints, and the translation of the root. Scales are read where they stand still.

use super::unit;
use crate::clip::About;
use crate::error::MotionError;
use crate::rotation::{exp, slerp, wxyz};
use crate::skeleton::{Animation, Bone, Keyframe, Skeleton};
use glam::{DQuat, DVec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::animation::util::ReadOutputs;
use gltf::animation::{Interpolation, Property};
use gltf::json::validation::Checked;
use gltf::{Accessor, Document, Gltf, Node};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Keyframes are read at this step, s.
const DT: f64 = 1.0 / 60.0;
/// Bytes of the file's header.
const HEADER: u32 = 12;
/// Longer motions are mistakes, s.
const LONGEST: f64 = 3600.0;
/// A file of a kilobyte can ask for an hour of a thousand joints: no more turns of joints than this, a quarter of an hour of 70.
const MOST_TURNS: usize = 4_000_000;
/// Deeper hierarchies are not of a figure.
const DEEPEST: usize = 200;

/// Values of a channel at its times.
struct Track<T> {
    times: Vec<f64>,
    values: Vec<T>,
}

/// Channels of a node.
#[derive(Default)]
struct Tracks {
    rotation: Option<Track<DQuat>>,
    translation: Option<Track<DVec3>>,
}

/// Reads a `.glb` file; the path is for messages and names the motion.
///
/// # Errors
/// If the file is not glTF, or has no animated skeleton.
pub fn glb(path: &Path, bytes: &[u8]) -> Result<Animation, MotionError> {
    let wrong = |key: &str, found: String, expected: &str| MotionError::value(path, key, found, expected);
    // the library subtracts the header from the length without a look
    let length = bytes.get(8..12).and_then(|word| word.try_into().ok()).map_or(0, u32::from_le_bytes);
    if bytes.starts_with(b"glTF") && length < HEADER {
        return Err(wrong("glTF", format!("a length of {length} bytes"), "the file's, in its third word"));
    }
    let Gltf { document, blob } =
        Gltf::from_slice(bytes).map_err(|error| wrong("glTF", error.to_string(), "a .glb file of glTF 2.0"))?;
    let blob = blob.ok_or_else(|| wrong("buffers", "buffers in other files".into(), "one .glb file with all data"))?;
    check_channels(path, &document, &blob)?;
    let animation = document
        .animations()
        .next()
        .ok_or_else(|| wrong("animations", "none".into(), "an animation; export the file with it"))?;

    let mut tracks: BTreeMap<usize, Tracks> = BTreeMap::new();
    for (i, channel) in animation.channels().enumerate() {
        if !matches!(channel.target().property(), Property::Rotation | Property::Translation) {
            continue;
        }
        let reader = channel.reader(|buffer| (buffer.index() == 0).then_some(blob.as_slice()));
        let (Some(times), Some(outputs)) = (reader.read_inputs(), reader.read_outputs()) else {
            return Err(wrong(&format!("animations[0].channels[{i}]"), "no data".into(), "times and values"));
        };
        let times: Vec<f64> = times.map(f64::from).collect();
        let cubic = channel.sampler().interpolation() == Interpolation::CubicSpline;
        let place = format!("animations[0].channels[{i}]");
        let tracks = tracks.entry(channel.target().node().index()).or_default();
        match outputs {
            ReadOutputs::Rotations(values) => {
                let values = values.into_f32().map(|q| DQuat::from_array(q.map(f64::from)));
                tracks.rotation = Some(track(path, &place, times, values.collect(), cubic)?);
            }
            ReadOutputs::Translations(values) => {
                let values = values.map(|v| DVec3::from_array(v.map(f64::from)));
                tracks.translation = Some(track(path, &place, times, values.collect(), cubic)?);
            }
            _ => {}
        }
    }
    let turns: BTreeSet<usize> =
        tracks.iter().filter(|(_, tracks)| tracks.rotation.is_some()).map(|(node, _)| *node).collect();
    let joints: BTreeSet<usize> = match document.skins().next() {
        Some(skin) => skin.joints().map(|joint| joint.index()).collect(),
        None => with_descendants(&document, tracks.keys().copied()),
    };
    if joints.is_disjoint(&turns) {
        return Err(wrong("animations[0]", "no joint that turns".into(), "rotations of the skeleton's joints"));
    }

    let nodes: Vec<Node> = document.nodes().collect();
    let parents = parents(path, &nodes)?;
    let root = root(&joints, &parents);
    let mut order = Vec::new();
    walk(path, &nodes[root], &joints, None, 0, &mut order)?;
    let above = above(&nodes, &parents, root);

    // lengths of the skeleton, its root at the origin, in the file's unit
    let local: Vec<(DVec3, DQuat)> = order.iter().map(|(node, _)| transform(&nodes[*node])).collect();
    let bone = |i: usize, scale: f64| Bone {
        name: nodes[order[i].0].name().map_or_else(|| format!("node {}", order[i].0), String::from),
        parent: order[i].1,
        offset: if i == 0 { [0.0; 3] } else { (scale * local[i].0).to_array() },
        rest: wxyz(if i == 0 { above.1 * local[i].1 } else { local[i].1 }),
    };
    let skeleton = |scale: f64| Skeleton { bones: (0..order.len()).map(|i| bone(i, scale)).collect() };
    let rest = skeleton(above.2).rest();
    let heights = rest.pos.iter().map(|pos| pos.z);
    let height = heights.clone().fold(f64::NEG_INFINITY, f64::max) - heights.fold(f64::INFINITY, f64::min);
    if !(height > 0.0 && height < 1e9) {
        return Err(wrong("nodes", format!("a skeleton {height} high"), "a figure that stands"));
    }
    let unit = unit(height);

    let end = order
        .iter()
        .filter_map(|(node, _)| tracks.get(node))
        .flat_map(|tracks| {
            let rotation = tracks.rotation.as_ref().and_then(|track| track.times.last());
            let translation = tracks.translation.as_ref().and_then(|track| track.times.last());
            [rotation, translation]
        })
        .flatten()
        .fold(0.0, |end: f64, time| end.max(*time));
    if !(DT..=LONGEST).contains(&end) {
        return Err(wrong("animations[0]", format!("{end} s"), "from a sixtieth of a second to an hour"));
    }
    let last = libm::round(end / DT) as usize;
    if (last + 1) * order.len() > MOST_TURNS {
        let longest = DT * (MOST_TURNS / order.len()) as f64;
        let found = format!("{end} s of {} joints", order.len());
        return Err(wrong("animations[0]", found, &format!("up to {longest:.0} s of so many; export a part of it")));
    }
    let keyframes: Vec<Keyframe> = (0..=last)
        .map(|i| {
            let time = i as f64 * DT;
            let at = |i: usize| {
                let tracks = tracks.get(&order[i].0);
                let turn = tracks.and_then(|tracks| tracks.rotation.as_ref());
                let place = tracks.and_then(|tracks| tracks.translation.as_ref());
                let turn = turn.map_or(local[i].1, |track| track.at(time, slerp));
                (place.map_or(local[i].0, |track| track.at(time, |a, b, share| a.lerp(b, share))), turn)
            };
            let (pos, turn) = at(0);
            let rotations = (0..order.len()).map(|i| wxyz(if i == 0 { above.1 * turn } else { at(i).1 }));
            let pos = above.0 + above.2 * (above.1 * pos);
            Keyframe { root: (unit * pos).to_array(), rotations: rotations.collect() }
        })
        .collect();
    let stem = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let about = About { name: stem, model: "glTF".into(), ..About::default() };
    Animation::new(path, about, skeleton(unit * above.2), DT, false, &keyframes)
}

impl<T: Copy> Track<T> {
    /// The value at a time, by interpolation between the values around it.
    fn at(&self, time: f64, between: impl Fn(T, T, f64) -> T) -> T {
        let after = self.times.partition_point(|t| *t <= time);
        if after == 0 || after == self.times.len() {
            return self.values[after.saturating_sub(1)];
        }
        let (a, b) = (self.times[after - 1], self.times[after]);
        between(self.values[after - 1], self.values[after], (time - a) / (b - a))
    }
}

/// Nodes and all that hangs from them.
fn with_descendants(document: &Document, nodes: impl Iterator<Item = usize>) -> BTreeSet<usize> {
    let all: Vec<Node> = document.nodes().collect();
    let (mut found, mut open) = (BTreeSet::new(), nodes.collect::<Vec<_>>());
    while let Some(node) = open.pop() {
        if found.insert(node) {
            open.extend(all[node].children().map(|child| child.index()));
        }
    }
    found
}

/// A channel, checked. Of cubic splines the values are kept and the tangents are not: at 60 keys per second they say nothing new.
fn track<T: Copy>(
    path: &Path,
    place: &str,
    times: Vec<f64>,
    values: Vec<T>,
    cubic: bool,
) -> Result<Track<T>, MotionError> {
    let values: Vec<T> = if cubic { values.into_iter().skip(1).step_by(3).collect() } else { values };
    if times.is_empty() || times.len() != values.len() {
        let found = format!("{} times and {} values", times.len(), values.len());
        return Err(MotionError::value(path, place, found, "as many of both, at least one"));
    }
    if !times.windows(2).all(|pair| pair[0] < pair[1]) || !times.iter().all(|time| time.is_finite()) {
        return Err(MotionError::value(path, place, "times out of order", "times that increase"));
    }
    Ok(Track { times, values })
}

/// What the library takes for granted: channels of known kinds with samplers that exist, accessors of the types that belong
/// to them, and data within the file.
fn check_channels(path: &Path, document: &Document, blob: &[u8]) -> Result<(), MotionError> {
    let Some(json) = document.as_json().animations.first() else { return Ok(()) };
    for (i, channel) in json.channels.iter().enumerate() {
        let place = format!("animations[0].channels[{i}]");
        let Checked::Valid(property) = channel.target.path else {
            return Err(MotionError::value(path, &place, "an unknown path", "rotation or translation"));
        };
        if channel.target.node.value() >= document.nodes().len() {
            let found = format!("node {}", channel.target.node.value());
            return Err(MotionError::value(path, &place, found, format!("one of {} nodes", document.nodes().len())));
        }
        let Some(sampler) = json.samplers.get(channel.sampler.value()) else {
            let (found, count) = (channel.sampler.value(), json.samplers.len());
            return Err(MotionError::value(
                path,
                &place,
                format!("sampler {found}"),
                format!("one of {count} samplers"),
            ));
        };
        if !matches!(sampler.interpolation, Checked::Valid(_)) {
            return Err(MotionError::value(path, &place, "an unknown interpolation", "LINEAR, STEP or CUBICSPLINE"));
        }
        let kind = match property {
            Property::Rotation => Dimensions::Vec4,
            Property::Translation => Dimensions::Vec3,
            Property::Scale | Property::MorphTargetWeights => continue,
        };
        let numbers = |index: usize, kind: Dimensions| {
            let accessor = document.accessors().nth(index);
            let fits = |accessor: &Accessor| accessor.dimensions() == kind && accessor.data_type() == DataType::F32;
            match accessor.filter(fits) {
                Some(accessor) => check_accessor(path, &accessor, blob),
                None => Err(MotionError::value(path, &place, format!("accessor {index}"), format!("floats, {kind:?}"))),
            }
        };
        numbers(sampler.input.value(), Dimensions::Scalar)?;
        numbers(sampler.output.value(), kind)?;
    }
    Ok(())
}

/// Everything that an accessor reads must lie within the file.
fn check_accessor(path: &Path, accessor: &Accessor, blob: &[u8]) -> Result<(), MotionError> {
    let place = format!("accessors[{}]", accessor.index());
    let Some(view) = accessor.view().filter(|_| accessor.sparse().is_none()) else {
        return Err(MotionError::value(path, &place, "a sparse accessor", "one with a buffer view"));
    };
    let stride = view.stride().unwrap_or(accessor.size());
    let within = (accessor.count().checked_sub(1))
        .and_then(|gaps| gaps.checked_mul(stride))
        .and_then(|bytes| bytes.checked_add(accessor.size()))
        .and_then(|bytes| bytes.checked_add(accessor.offset()))
        .is_some_and(|bytes| bytes <= view.length());
    let inside = view.offset().checked_add(view.length()).is_some_and(|end| end <= blob.len());
    if !within || !inside || view.buffer().index() != 0 || stride < accessor.size() {
        return Err(MotionError::value(path, &place, "data beyond the end", "data within the file"));
    }
    Ok(())
}

/// The parent of each node.
fn parents(path: &Path, nodes: &[Node]) -> Result<Vec<Option<usize>>, MotionError> {
    let mut parents = vec![None; nodes.len()];
    for node in nodes {
        for child in node.children() {
            if parents[child.index()].replace(node.index()).is_some() {
                let found = format!("node {} below two nodes", child.index());
                return Err(MotionError::value(path, "nodes", found, "one parent for each node"));
            }
        }
    }
    Ok(parents)
}

/// The joint from which most joints hang.
fn root(joints: &BTreeSet<usize>, parents: &[Option<usize>]) -> usize {
    let top = |joint: usize| {
        let (mut at, mut top) = (joint, joint);
        for _ in 0..DEEPEST {
            match parents[at] {
                Some(parent) => at = parent,
                None => break,
            }
            if joints.contains(&at) {
                top = at;
            }
        }
        top
    };
    let mut count: BTreeMap<usize, usize> = BTreeMap::new();
    joints.iter().for_each(|joint| *count.entry(top(*joint)).or_default() += 1);
    count.into_iter().max_by_key(|(_, count)| *count).map_or(0, |(root, _)| root)
}

/// The joints below a node, each with the place of its parent in the list; nodes between joints are kept.
fn walk(
    path: &Path,
    node: &Node,
    joints: &BTreeSet<usize>,
    parent: Option<usize>,
    depth: usize,
    order: &mut Vec<(usize, Option<usize>)>,
) -> Result<(), MotionError> {
    if depth > DEEPEST {
        return Err(MotionError::value(path, "nodes", format!("more than {DEEPEST} generations"), "a figure"));
    }
    order.push((node.index(), parent));
    let here = order.len() - 1;
    for child in node.children().filter(|child| holds(child, joints, depth)) {
        walk(path, &child, joints, Some(here), depth + 1, order)?;
    }
    Ok(())
}

/// Whether a node is a joint, or one hangs from it.
fn holds(node: &Node, joints: &BTreeSet<usize>, depth: usize) -> bool {
    joints.contains(&node.index()) || depth < DEEPEST && node.children().any(|child| holds(&child, joints, depth + 1))
}

/// Translation and rotation of a node at rest.
fn transform(node: &Node) -> (DVec3, DQuat) {
    let (place, turn, _) = node.transform().decomposed();
    (DVec3::from_array(place.map(f64::from)), DQuat::from_array(turn.map(f64::from)).normalize())
}

/// The frame in which the root lies: position, rotation and scale, with z up instead of glTF's y.
fn above(nodes: &[Node], parents: &[Option<usize>], root: usize) -> (DVec3, DQuat, f64) {
    let (mut pos, mut turn, mut scale) = (DVec3::ZERO, DQuat::IDENTITY, 1.0);
    let mut at = parents[root];
    for _ in 0..DEEPEST {
        let Some(node) = at else { break };
        let (place, own) = transform(&nodes[node]);
        let (_, _, size) = nodes[node].transform().decomposed();
        let size = f64::from((size[0] + size[1] + size[2]) / 3.0);
        pos = place + own * (size * pos);
        turn = own * turn;
        scale *= size;
        at = parents[node];
    }
    let upright = exp(DVec3::X * std::f64::consts::FRAC_PI_2);
    (upright * pos, upright * turn, scale)
}
