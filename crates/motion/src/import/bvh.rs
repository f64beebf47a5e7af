//! Biovision's BVH: a hierarchy of joints with Euler angles.
//!
//! A file does not tell its unit, nor which way is up. BVH's y points up, but for files whose rest pose reaches further along
//! z. Lengths are taken for meters, centimeters, inches or CMU's unit, whichever makes the figure nearest to 1.7 m tall.
//! Positions of joints other than the root are read and dropped: bones keep their length.

use super::unit;
use crate::clip::About;
use crate::error::MotionError;
use crate::rotation::{exp, wxyz};
use crate::skeleton::{Animation, Bone, Keyframe, Skeleton};
use glam::{DQuat, DVec3};
use std::path::Path;

/// Frames further apart are milliseconds that were meant as seconds, and would make hours of a short file, s.
const LONGEST_STEP: f64 = 1.0;
/// More joints, or deeper ones, are not of a figure.
const MOST_JOINTS: usize = 1000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Channel {
    Position(usize),
    Rotation(usize),
}

/// A joint of the file, in the file's axes and unit.
struct Node {
    name: String,
    parent: Option<usize>,
    offset: DVec3,
    channels: Vec<Channel>,
}

/// Words of the text with their lines.
struct Words<'a> {
    path: &'a Path,
    words: Vec<(usize, usize, &'a str)>,
    next: usize,
}

/// Reads a BVH file; the path is for messages and names the motion.
///
/// # Errors
/// If the text is not BVH: the message names the line.
pub fn bvh(path: &Path, bytes: &[u8]) -> Result<Animation, MotionError> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
        MotionError::Syntax { path: path.into(), line, column: 1, problem: "found bytes that are not UTF-8".into() }
    })?;
    let words = text.lines().enumerate().flat_map(|(i, line)| {
        line.split_whitespace().map(move |word| (i + 1, 1 + word.as_ptr() as usize - line.as_ptr() as usize, word))
    });
    let mut words = Words { path, words: words.collect(), next: 0 };
    let nodes = hierarchy(&mut words)?;

    words.expect("MOTION")?;
    words.expect("Frames:")?;
    let (line, count) = (words.line(), words.number()?);
    if !(2.0..=1e7).contains(&count) || count != count.trunc() {
        return Err(words.wrong(line, format!("found {count} frames, expected two or more")));
    }
    words.expect("Frame")?;
    words.expect("Time:")?;
    let (line, dt) = (words.line(), words.number()?);
    if dt > LONGEST_STEP {
        return Err(words.wrong(line, format!("found a frame time of {dt}, expected seconds, up to {LONGEST_STEP}")));
    }
    let width: usize = nodes.iter().map(|node| node.channels.len()).sum();
    let numbers: Vec<f64> = (0..count as usize * width)
        .map(|i| {
            if words.next == words.words.len() {
                let problem = format!("the file ends; expected {count} frames");
                return Err(MotionError::frame(path, i / width.max(1), problem));
            }
            words.number()
        })
        .collect::<Result<_, _>>()?;
    if let Some((line, _, word)) = words.words.get(words.next) {
        return Err(words.wrong(*line, format!("found {word:?}, expected the end after {count} frames")));
    }

    let rest = rest(&nodes);
    let extent = |axis: usize| {
        let heights = rest.iter().map(|pos| pos[axis]);
        heights.clone().fold(f64::NEG_INFINITY, f64::max) - heights.fold(f64::INFINITY, f64::min)
    };
    let z_up = extent(2) > 1.2 * extent(1);
    let height = if z_up { extent(2) } else { extent(1) };
    if let Some(node) = nodes.iter().find(|node| !(node.offset.abs().max_element() <= 1e6)) {
        let found = format!("{} of {:?}", node.offset, node.name);
        return Err(MotionError::value(path, "OFFSET", found, "numbers from -1000000 to 1000000"));
    }
    if !(height > 0.0) {
        return Err(MotionError::value(path, "HIERARCHY", "joints that all lie in one point", "a figure"));
    }
    let unit = unit(height);
    // y to z, z to -y
    let upright = if z_up { DQuat::IDENTITY } else { exp(DVec3::X * std::f64::consts::FRAC_PI_2) };

    let bones = nodes.iter().map(|node| Bone {
        name: node.name.clone(),
        parent: node.parent,
        offset: (upright * (unit * node.offset)).to_array(),
        rest: [1.0, 0.0, 0.0, 0.0],
    });
    let skeleton = Skeleton { bones: bones.collect() };
    let keyframes: Vec<Keyframe> =
        numbers.chunks(width.max(1)).map(|row| keyframe(&nodes, row, upright, unit)).collect();
    let name = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    Animation::new(path, About { name, model: "BVH".into(), ..About::default() }, skeleton, dt, false, &keyframes)
}

/// The joints; ends of bones are not among them.
fn hierarchy(words: &mut Words) -> Result<Vec<Node>, MotionError> {
    words.expect("HIERARCHY")?;
    words.expect("ROOT")?;
    let mut nodes: Vec<Node> = Vec::new();
    // the joints whose braces are open; an end of a bone is None
    let mut open: Vec<Option<usize>> = Vec::new();
    node(words, &mut nodes, None)?;
    open.push(Some(0));
    while let Some(&inside) = open.last() {
        let line = words.line();
        match (words.word()?, inside) {
            ("}", _) => {
                open.pop();
            }
            ("OFFSET", Some(of)) => nodes[of].offset = DVec3::new(words.number()?, words.number()?, words.number()?),
            ("OFFSET", None) => (0..3).try_for_each(|_| words.number().map(drop))?,
            ("CHANNELS", Some(of)) => nodes[of].channels = channels(words)?,
            ("JOINT", Some(of)) => {
                node(words, &mut nodes, Some(of))?;
                open.push(Some(nodes.len() - 1));
            }
            ("End", Some(_)) => {
                words.expect("Site")?;
                words.expect("{")?;
                open.push(None);
            }
            ("ROOT", _) => return Err(words.wrong(line, "found a second ROOT, expected one figure".into())),
            (word, _) => {
                let expected = "OFFSET, CHANNELS, JOINT, End Site or }";
                return Err(words.wrong(line, format!("found {word:?}, expected {expected}")));
            }
        }
        if nodes.len() > MOST_JOINTS {
            return Err(words.wrong(line, format!("found more than {MOST_JOINTS} joints")));
        }
    }
    Ok(nodes)
}

/// The name and the opening brace of a joint. Names may have spaces.
fn node(words: &mut Words, nodes: &mut Vec<Node>, parent: Option<usize>) -> Result<(), MotionError> {
    let mut name = String::new();
    loop {
        match words.word()? {
            "{" => break,
            word => {
                if !name.is_empty() {
                    name.push(' ');
                }
                name.push_str(word);
            }
        }
    }
    nodes.push(Node { name, parent, offset: DVec3::ZERO, channels: Vec::new() });
    Ok(())
}

fn channels(words: &mut Words) -> Result<Vec<Channel>, MotionError> {
    let (line, count) = (words.line(), words.number()?);
    if !(0.0..=6.0).contains(&count) || count != count.trunc() {
        return Err(words.wrong(line, format!("found {count} channels, expected 0 to 6")));
    }
    (0..count as usize)
        .map(|_| {
            let line = words.line();
            let word = words.word()?;
            let axis = match word.as_bytes().first() {
                Some(b'X' | b'x') => 0,
                Some(b'Y' | b'y') => 1,
                Some(b'Z' | b'z') => 2,
                _ => 3,
            };
            match word.get(1..).map(str::to_ascii_lowercase).as_deref() {
                Some("position") if axis < 3 => Ok(Channel::Position(axis)),
                Some("rotation") if axis < 3 => Ok(Channel::Rotation(axis)),
                _ => {
                    Err(words.wrong(line, format!("found {word:?}, expected a channel such as Xposition or Zrotation")))
                }
            }
        })
        .collect()
}

/// Positions of the joints at rest, with all angles 0.
fn rest(nodes: &[Node]) -> Vec<DVec3> {
    let mut pos: Vec<DVec3> = Vec::with_capacity(nodes.len());
    for node in nodes {
        pos.push(node.parent.map_or(DVec3::ZERO, |parent| pos[parent] + node.offset));
    }
    pos
}

fn keyframe(nodes: &[Node], row: &[f64], upright: DQuat, unit: f64) -> Keyframe {
    let mut numbers = row.iter();
    let mut root = nodes[0].offset;
    let rotations = nodes
        .iter()
        .enumerate()
        .map(|(i, node)| {
            let (mut turn, mut at) = (DQuat::IDENTITY, DVec3::ZERO);
            for channel in &node.channels {
                let value = numbers.next().copied().unwrap_or(0.0);
                match channel {
                    Channel::Position(axis) => at[*axis] = value,
                    // the first channel is the outermost rotation
                    Channel::Rotation(axis) => turn *= exp(DVec3::AXES[*axis] * value.to_radians()),
                }
            }
            if i == 0 && node.channels.iter().any(|channel| matches!(channel, Channel::Position(_))) {
                root = at;
            }
            wxyz((upright * turn * upright.conjugate()).normalize())
        })
        .collect();
    Keyframe { root: (upright * (unit * root)).to_array(), rotations }
}

impl<'a> Words<'a> {
    /// The line of the next word.
    fn line(&self) -> usize {
        let last = self.words.last().map_or(1, |word| word.0);
        self.words.get(self.next).map_or(last, |word| word.0)
    }

    fn word(&mut self) -> Result<&'a str, MotionError> {
        let (_, _, word) = self
            .words
            .get(self.next)
            .copied()
            .ok_or_else(|| self.wrong(self.line(), "the file ends too early".into()))?;
        self.next += 1;
        Ok(word)
    }

    fn expect(&mut self, wanted: &str) -> Result<(), MotionError> {
        let line = self.line();
        match self.word()? {
            word if word.eq_ignore_ascii_case(wanted) => Ok(()),
            word => Err(self.wrong(line, format!("found {word:?}, expected {wanted}"))),
        }
    }

    fn number(&mut self) -> Result<f64, MotionError> {
        let line = self.line();
        let word = self.word()?;
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.wrong(line, format!("found {word:?}, expected a number"))),
        }
    }

    /// An error at the word before the next one, or else in this line.
    fn wrong(&self, line: usize, problem: String) -> MotionError {
        let before = self.next.checked_sub(1).map(|i| self.words[i]);
        let column = before.filter(|word| word.0 == line).map_or(1, |word| word.1);
        MotionError::Syntax { path: self.path.into(), line, column, problem }
    }
}
