//! glTF animations in `.glb`, `.gltf`, `.vrm` and `.vrma` files. Examples are Blender's own, and Mixamo's characters
//! after conversion with Blender.
//!
//! The skeleton consists of the joints of the skin that the animation moves. Without a skin, it consists of the moving
//! nodes and their descendants. The reader takes the rotations of all joints, and the translations of the pelvis and
//! the nodes above it. Scales must be constant.

mod data;
mod document;

use super::raw::{Local, Raw, chain, cut};
use super::{Reading, Recording, upright};
use crate::clip::About;
use crate::error::MotionError;
use crate::limits;
use crate::roles;
use crate::rotation::{slerp, wxyz};
use crate::skeleton::{Animation, Bone, Keyframe, Skeleton};
use data::Buffers;
use document::{Document, Node};
use glam::{DMat4, DQuat, DVec3};
use marathon_physics::hint::{did_you_mean, nearest};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Time between keyframes, s.
const DT: f64 = 1.0 / 60.0;
/// Limit on the depth of the hierarchy.
const DEEPEST: usize = 200;
/// The glTF standard says that y points up, so the motion needs strong evidence for another axis.
const TRUST_Y: f64 = 0.4;
/// Limit on the animations that a message lists.
const NAMED: usize = 30;

/// Values of a channel at its times.
struct Track<T> {
    times: Vec<f64>,
    values: Vec<T>,
    steps: bool,
}

/// Channels of a node.
#[derive(Default)]
struct Tracks {
    rotation: Option<Track<DQuat>>,
    translation: Option<Track<DVec3>>,
}

/// Reads a `.glb` file. The path is used in messages and to name the motion.
///
/// # Errors
/// If the file is not glTF, or has no animated skeleton.
pub fn glb(path: &Path, bytes: &[u8]) -> Result<Animation, MotionError> {
    Ok(read(path, bytes, &Reading::default())?.animation)
}

pub(super) fn read(path: &Path, bytes: &[u8], reading: &Reading) -> Result<Recording, MotionError> {
    // one function: the stages of reading in order
    let wrong = |key: &str, found: String, expected: &str| MotionError::value(path, key, found, expected);
    let (document, blob) = document::read(path, bytes)?;
    let (chosen, mut notes) = choose(path, &document, reading.animation.as_deref())?;
    notes.extend(document.unknown_extensions().map(|name| {
        format!("the file requires the glTF extension {name:?}, which is not read; look at the clip before you use it")
    }));
    let mut buffers = Buffers::new(path, &document, blob, reading.beside);
    let tracks = tracks(path, &document, chosen, &mut buffers)?;
    let place = format!("animations[{chosen}]");

    let nodes = &document.nodes;
    let parents = parents(path, nodes)?;
    let turns: BTreeSet<usize> =
        tracks.iter().filter(|(_, tracks)| tracks.rotation.is_some()).map(|(node, _)| *node).collect();
    let joints = joints(path, &document, &tracks, &turns)?;
    if joints.is_disjoint(&turns) {
        return Err(wrong(&place, "no joint that turns".into(), "rotations of the skeleton's joints"));
    }
    let order = order(path, nodes, &joints, &parents)?;
    let locals: Vec<(Local, f64)> =
        order.iter().map(|(node, _)| local(path, &nodes[*node], *node)).collect::<Result<_, _>>()?;
    // the scales of a node and of all nodes above it multiply the lengths below it
    let mut scales: Vec<f64> = Vec::with_capacity(order.len());
    for ((_, parent), (_, own)) in order.iter().zip(&locals) {
        scales.push(own * parent.map_or(1.0, |parent| scales[parent]));
    }
    let scale = |i: usize| order[i].1.map_or(1.0, |parent| scales[parent]);
    let names = document.extensions.bones();
    let name = |node: usize| {
        let own = names.get(&node).or(nodes[node].name.as_ref());
        own.cloned().unwrap_or_else(|| format!("node {node}"))
    };
    let bones = order.iter().enumerate().map(|(i, (node, parent))| Bone {
        name: name(*node),
        parent: *parent,
        offset: (scale(i) * locals[i].0.pos).to_array(),
        rest: wxyz(locals[i].0.turn),
    });
    let whole = Skeleton { bones: bones.collect() };
    let (skeleton, kept) = cut(&whole, root(&whole, &order, &joints));
    let carriers = chain(&whole, kept[0]);

    let tracked: Vec<Option<&Tracks>> = order.iter().map(|(node, _)| tracks.get(node)).collect();
    let times = || {
        tracked.iter().flatten().flat_map(|tracks| {
            let rotation = tracks.rotation.as_ref().map(|track| &track.times);
            rotation.into_iter().chain(tracks.translation.as_ref().map(|track| &track.times)).flatten()
        })
    };
    let begin = times().fold(f64::INFINITY, |begin: f64, time| begin.min(*time));
    let end = times().fold(begin, |end: f64, time| end.max(*time));
    let seconds = end - begin;
    limits::check_seconds(path, seconds)?;
    if !(seconds >= DT) {
        return Err(wrong(&place, format!("{seconds} s"), "a sixtieth of a second or more"));
    }
    let last = libm::round(seconds / DT);
    limits::check_frames(path, last + 1.0, 4 * order.len() + 7)?;
    let keyframes: Vec<Keyframe> = (0..=last as usize)
        .map(|i| {
            let time = begin + i as f64 * DT;
            let turn = |i: usize| {
                let track = tracked[i].and_then(|tracks| tracks.rotation.as_ref());
                track.map_or(locals[i].0.turn, |track| track.at(time, slerp))
            };
            let pos = |i: usize| {
                let track = tracked[i].and_then(|tracks| tracks.translation.as_ref());
                scale(i) * track.map_or(locals[i].0.pos, |track| track.at(time, |a, b, share| a.lerp(b, share)))
            };
            let at = |i: usize| Local { pos: pos(i), turn: turn(i) };
            let root = carriers[1..].iter().fold(at(carriers[0]), |place, joint| place.then(at(*joint)));
            let rotations =
                kept.iter().enumerate().map(|(k, joint)| wxyz(if k == 0 { root.turn } else { turn(*joint) }));
            Keyframe { root: root.pos.to_array(), rotations: rotations.collect() }
        })
        .collect();
    let stem = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let about = About { name: stem, model: "glTF".into(), ..About::default() };
    upright::settle(path, Raw { about, skeleton, dt: DT, keyframes, trust_y: TRUST_Y, notes }, false, reading)
}

/// Finds an animation by name or index. The default is the first one, with a note if there are others.
fn choose(path: &Path, document: &Document, asked: Option<&str>) -> Result<(usize, Vec<String>), MotionError> {
    let name = |i: usize| document.animations[i].name.clone().unwrap_or_default();
    let count = document.animations.len();
    let all = || {
        let named = (0..count.min(NAMED)).map(|i| format!("{i} {:?}", name(i))).collect::<Vec<_>>().join(", ");
        if count > NAMED { format!("{named}, and {} more", count - NAMED) } else { named }
    };
    if count == 0 {
        return Err(MotionError::value(path, "animations", "none", "an animation; export the file with it"));
    }
    let Some(asked) = asked else {
        let note = format!("animation 0 of {count} is read; --animation NAME|INDEX chooses among {}", all());
        return Ok((0, if count > 1 { vec![note] } else { Vec::new() }));
    };
    let found = (0..count).find(|i| document.animations[*i].name.as_deref() == Some(asked));
    match found.or_else(|| asked.parse().ok().filter(|index| *index < count)) {
        Some(index) => Ok((index, Vec::new())),
        None => {
            let names: Vec<String> = (0..count).map(name).collect();
            let hint = did_you_mean(nearest(asked, names.iter().map(String::as_str)));
            Err(MotionError::value(path, "animation", format!("{asked:?}"), format!("one of {}{hint}", all())))
        }
    }
}

/// The rotations and translations of an animation, by node. Other channels are ignored.
fn tracks(
    path: &Path,
    document: &Document,
    chosen: usize,
    buffers: &mut Buffers,
) -> Result<BTreeMap<usize, Tracks>, MotionError> {
    let animation = &document.animations[chosen];
    let mut tracks: BTreeMap<usize, Tracks> = BTreeMap::new();
    for (i, channel) in animation.channels.iter().enumerate() {
        let place = format!("animations[{chosen}].channels[{i}]");
        let wrong = |found: String, expected: String| MotionError::value(path, &place, found, expected);
        let turns = match channel.target.path.as_str() {
            "rotation" => true,
            "translation" => false,
            _ => continue,
        };
        let Some(node) = channel.target.node else { continue };
        if node >= document.nodes.len() {
            return Err(wrong(format!("node {node}"), format!("one of {} nodes", document.nodes.len())));
        }
        let Some(sampler) = animation.samplers.get(channel.sampler) else {
            let (found, count) = (channel.sampler, animation.samplers.len());
            return Err(wrong(format!("sampler {found}"), format!("one of {count} samplers")));
        };
        let kind = sampler.interpolation.as_deref().unwrap_or("LINEAR");
        if !["LINEAR", "STEP", "CUBICSPLINE"].contains(&kind) {
            return Err(wrong(format!("the interpolation {kind:?}"), "LINEAR, STEP or CUBICSPLINE".into()));
        }
        let times = buffers.rows(&place, sampler.input, 1, false)?;
        let node = tracks.entry(node).or_default();
        if turns {
            let rows = buffers.rows(&place, sampler.output, 4, true)?;
            let turns = rows.chunks_exact(4).map(|q| DQuat::from_array([q[0], q[1], q[2], q[3]]));
            let track = track(path, &place, times, turns.collect(), kind)?;
            if let Some(turn) = track.values.iter().find(|turn| !((0.5..=1.5).contains(&turn.length()))) {
                return Err(wrong(format!("a quaternion {:.3} long", turn.length()), "unit length".into()));
            }
            let values = track.values.into_iter().map(DQuat::normalize).collect();
            node.rotation = Some(Track { values, ..track });
        } else {
            let rows = buffers.rows(&place, sampler.output, 3, false)?;
            let places = rows.chunks_exact(3).map(DVec3::from_slice);
            node.translation = Some(track(path, &place, times, places.collect(), kind)?);
        }
    }
    Ok(tracks)
}

/// Checks a channel. Cubic splines keep their values but not their tangents, which matter little at 60 keys per second.
fn track<T: Copy>(
    path: &Path,
    place: &str,
    times: Vec<f64>,
    values: Vec<T>,
    kind: &str,
) -> Result<Track<T>, MotionError> {
    let cubic = kind == "CUBICSPLINE";
    let values: Vec<T> = if cubic { values.into_iter().skip(1).step_by(3).collect() } else { values };
    if times.is_empty() || times.len() != values.len() {
        let found = format!("{} times and {} values", times.len(), values.len());
        return Err(MotionError::value(path, place, found, "as many of both, at least one"));
    }
    if !times.windows(2).all(|pair| pair[0] < pair[1]) || !times.iter().all(|time| time.is_finite()) {
        return Err(MotionError::value(path, place, "times out of order", "times that increase"));
    }
    Ok(Track { times, values, steps: kind == "STEP" })
}

impl<T: Copy> Track<T> {
    /// Interpolates between the values around a time.
    fn at(&self, time: f64, between: impl Fn(T, T, f64) -> T) -> T {
        let after = self.times.partition_point(|t| *t <= time);
        if after == 0 || after == self.times.len() || self.steps {
            return self.values[after.saturating_sub(1)];
        }
        let (a, b) = (self.times[after - 1], self.times[after]);
        between(self.values[after - 1], self.values[after], (time - a) / (b - a))
    }
}

/// The joints of the skin with the most rotating joints. Without a skin, the moving nodes and their descendants.
fn joints(
    path: &Path,
    document: &Document,
    tracks: &BTreeMap<usize, Tracks>,
    turns: &BTreeSet<usize>,
) -> Result<BTreeSet<usize>, MotionError> {
    let nodes = &document.nodes;
    for (i, skin) in document.skins.iter().enumerate() {
        if let Some(joint) = skin.joints.iter().find(|joint| **joint >= nodes.len()) {
            let expected = format!("one of {} nodes", nodes.len());
            return Err(MotionError::value(path, &format!("skins[{i}].joints"), format!("node {joint}"), expected));
        }
    }
    let moved = |joints: &BTreeSet<usize>| joints.intersection(turns).count();
    let mut best: Option<BTreeSet<usize>> = None;
    for skin in &document.skins {
        let joints: BTreeSet<usize> = skin.joints.iter().copied().collect();
        if moved(&joints) > best.as_ref().map_or(0, moved) {
            best = Some(joints);
        }
    }
    if let Some(joints) = best {
        return Ok(joints);
    }
    let (mut found, mut open) = (BTreeSet::new(), tracks.keys().copied().collect::<Vec<_>>());
    while let Some(node) = open.pop() {
        if found.insert(node) {
            open.extend(&nodes[node].children);
        }
    }
    Ok(found)
}

/// The parent of each node.
fn parents(path: &Path, nodes: &[Node]) -> Result<Vec<Option<usize>>, MotionError> {
    let mut parents = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for child in &node.children {
            match parents.get_mut(*child) {
                Some(parent @ None) => *parent = Some(i),
                Some(_) => {
                    let found = format!("node {child} below two nodes");
                    return Err(MotionError::value(path, "nodes", found, "one parent for each node"));
                }
                None => {
                    let expected = format!("one of {} nodes", nodes.len());
                    return Err(MotionError::value(path, "nodes", format!("the child {child}"), expected));
                }
            }
        }
    }
    Ok(parents)
}

/// Lists the nodes above the common root of most joints, from the top down, and then the joints. Each entry has its
/// parent's position in the list. Nodes between joints are kept.
fn order(
    path: &Path,
    nodes: &[Node],
    joints: &BTreeSet<usize>,
    parents: &[Option<usize>],
) -> Result<Vec<(usize, Option<usize>)>, MotionError> {
    let deep = || MotionError::value(path, "nodes", format!("more than {DEEPEST} generations"), "a figure");
    let mut needed = vec![false; nodes.len()];
    let mut count: BTreeMap<usize, usize> = BTreeMap::new();
    for joint in joints {
        let (mut at, mut top, mut depth) = (*joint, *joint, 0);
        loop {
            needed[at] = true;
            if joints.contains(&at) {
                top = at;
            }
            let Some(parent) = parents[at] else { break };
            at = parent;
            depth += 1;
            if depth > DEEPEST {
                return Err(deep());
            }
        }
        *count.entry(top).or_default() += 1;
    }
    let top = count.into_iter().max_by_key(|(_, count)| *count).map_or(0, |(top, _)| top);
    let mut order: Vec<(usize, Option<usize>)> = Vec::new();
    let mut carriers = vec![top];
    while let Some(parent) = parents[carriers[carriers.len() - 1]] {
        carriers.push(parent);
    }
    for node in carriers.into_iter().rev() {
        order.push((node, order.len().checked_sub(1)));
    }
    // depth first, in file order
    let mut open: Vec<(usize, usize)> =
        nodes[top].children.iter().rev().map(|child| (*child, order.len() - 1)).collect();
    while let Some((node, parent)) = open.pop() {
        if needed[node] {
            order.push((node, Some(parent)));
            let here = order.len() - 1;
            open.extend(nodes[node].children.iter().rev().map(|child| (*child, here)));
        }
    }
    Ok(order)
}

/// The root joint of the skeleton: the pelvis. If there is none, the first joint below which the skeleton branches.
fn root(whole: &Skeleton, order: &[(usize, Option<usize>)], joints: &BTreeSet<usize>) -> usize {
    let top = order.iter().position(|(node, _)| joints.contains(node)).unwrap_or(0);
    match roles::carrier(whole) {
        Some(pelvis) if whole.hangs(pelvis, top) => pelvis,
        _ => top,
    }
}

/// Translation and rotation of a node at rest, and its scale.
fn local(path: &Path, node: &Node, index: usize) -> Result<(Local, f64), MotionError> {
    let (size, turn, pos) = match &node.matrix {
        Some(matrix) => DMat4::from_cols_array(matrix).to_scale_rotation_translation(),
        None => (
            node.scale.map_or(DVec3::ONE, DVec3::from_array),
            node.rotation.map_or(DQuat::IDENTITY, DQuat::from_array),
            node.translation.map_or(DVec3::ZERO, DVec3::from_array),
        ),
    };
    let scale = (size.x + size.y + size.z) / 3.0;
    if !(pos.is_finite() && turn.is_finite() && turn.length() > 0.1 && scale.is_finite()) {
        let found = "a place, turn or size that is none";
        return Err(MotionError::value(
            path,
            &format!("nodes[{index}]"),
            found,
            "finite numbers, and a rotation of unit length",
        ));
    }
    Ok((Local { pos, turn: turn.normalize() }, scale))
}
