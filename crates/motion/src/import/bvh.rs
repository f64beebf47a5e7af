//! Biovision's BVH: a hierarchy of joints with Euler angles.
//!
//! A file states neither its unit nor its up axis. The reader finds both from the motion. It drops the positions of
//! joints below the pelvis, because bones have a constant length.

use super::raw::{Local, Raw, chain, cut};
use super::{Reading, Recording, upright};
use crate::clip::About;
use crate::error::MotionError;
use crate::limits;
use crate::roles;
use crate::rotation::{exp, wxyz};
use crate::skeleton::{Animation, Bone, Keyframe, Skeleton};
use glam::{DQuat, DVec3};
use std::path::Path;

/// Longest time between frames, s. Larger values are probably milliseconds, and would turn a short file into hours.
const LONGEST_STEP: f64 = 1.0;
/// Maximum number of joints, and maximum depth.
const MOST_JOINTS: usize = 1000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Channel {
    Position(usize),
    Rotation(usize),
}

impl Channel {
    fn name(self) -> String {
        let (axis, kind) = match self {
            Channel::Position(axis) => (axis, "position"),
            Channel::Rotation(axis) => (axis, "rotation"),
        };
        format!("{}{kind}", ["X", "Y", "Z"][axis])
    }
}

/// A joint of the file, in the file's axes and unit.
struct Node {
    name: String,
    parent: Option<usize>,
    offset: DVec3,
    channels: Vec<Channel>,
}

/// Splits the text into words and tracks their lines and columns.
struct Words<'a> {
    path: &'a Path,
    text: &'a str,
    /// Position of the next word, bytes.
    at: usize,
    line: usize,
    /// Start of the line, bytes.
    start: usize,
    /// Line and column of the last word read.
    last: (usize, usize),
}

/// Reads a BVH file; the path is for messages and names the motion.
///
/// # Errors
/// If the text is not BVH: the message names the line.
pub fn bvh(path: &Path, bytes: &[u8]) -> Result<Animation, MotionError> {
    Ok(read(path, bytes, &Reading::default())?.animation)
}

pub(super) fn read(path: &Path, bytes: &[u8], reading: &Reading) -> Result<Recording, MotionError> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
        MotionError::Syntax { path: path.into(), line, column: 1, problem: "found bytes that are not UTF-8".into() }
    })?;
    // some editors write a byte order mark before the first word
    let mut words = Words::new(path, text.strip_prefix('\u{feff}').unwrap_or(text));
    let nodes = hierarchy(&mut words)?;

    words.expect("MOTION")?;
    words.label("Frames:")?;
    let count = words.number()?;
    let line = words.line;
    if !(1.0..=1e7).contains(&count) || count != count.trunc() {
        return Err(words.wrong(line, format!("found {count} frames, expected a whole number from 2 to 1e7")));
    }
    words.label("Frame Time:")?;
    let dt = words.number()?;
    if dt > LONGEST_STEP {
        return Err(
            words.wrong(words.line, format!("found a frame time of {dt}, expected seconds, up to {LONGEST_STEP}"))
        );
    }
    if let Some(node) = nodes.iter().find(|node| !(node.offset.abs().max_element() <= 1e6)) {
        let found = format!("{} of {:?}", node.offset, node.name);
        return Err(MotionError::value(path, "OFFSET", found, "numbers from -1000000 to 1000000"));
    }
    if !(rest(&nodes).iter().any(|pos| pos.length() > 0.0)) {
        return Err(MotionError::value(path, "HIERARCHY", "joints that all lie in one point", "a figure"));
    }
    let whole = Skeleton {
        bones: nodes
            .iter()
            .map(|node| Bone {
                name: node.name.clone(),
                parent: node.parent,
                offset: node.offset.to_array(),
                rest: [1.0, 0.0, 0.0, 0.0],
            })
            .collect(),
    };
    let (skeleton, kept) = cut(&whole, root(&nodes, &whole));
    let carriers = chain(&whole, kept[0]);
    limits::check_seconds(path, count * dt)?;
    // the keyframes, the file's motion rows and the clip's frames
    limits::check_frames(path, count, 4 * nodes.len() + 7)?;

    let width: usize = nodes.iter().map(|node| node.channels.len()).sum();
    let (mut row, mut keyframes, mut notes) = (vec![0.0; width], Vec::new(), Vec::new());
    let count = count as usize;
    while keyframes.len() < count || width > 0 && words.is_more() {
        for value in &mut row {
            if !words.is_more() && keyframes.len() < count {
                let problem = format!("the file ends; expected {count} frames");
                return Err(MotionError::frame(path, keyframes.len(), problem));
            }
            *value = words.number()?;
        }
        keyframes.push(keyframe(&nodes, &row, &kept, &carriers));
        if keyframes.len() == count + 1 {
            notes.push(format!("the file says {count} frames and has more; all are read"));
        }
        limits::check_seconds(path, keyframes.len() as f64 * dt)?;
    }
    if words.is_more() {
        let line = words.line;
        return Err(words.wrong(line, format!("found more than {count} frames of no channels, expected the end")));
    }
    if keyframes.len() < 2 {
        return Err(words.wrong(line, format!("found {} frames, expected two or more", keyframes.len())));
    }
    let name = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let about = About { name, model: "BVH".into(), ..About::default() };
    let raw = Raw { about, skeleton, dt, keyframes, trust_y: 0.0, notes };
    upright::settle(path, raw, false, reading)
}

/// The root joint of the skeleton: the pelvis. If there is none, the first joint below which the skeleton branches or
/// does not travel.
fn root(nodes: &[Node], whole: &Skeleton) -> usize {
    if let Some(pelvis) = roles::carrier(whole) {
        return pelvis;
    }
    let mut root = 0;
    loop {
        let mut children = (0..nodes.len()).filter(|i| nodes[*i].parent == Some(root));
        match (children.next(), children.next()) {
            (Some(only), None) if nodes[only].travels() => root = only,
            _ => return root,
        }
    }
}

impl Node {
    fn travels(&self) -> bool {
        self.channels.iter().any(|channel| matches!(channel, Channel::Position(_)))
    }
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
        words.skip();
        let line = words.line;
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
                // some programs name the end sites
                while words.word()? != "{" {}
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
    let count = words.number()?;
    let line = words.line;
    if !(0.0..=6.0).contains(&count) || count != count.trunc() {
        return Err(words.wrong(line, format!("found {count} channels, expected 0 to 6")));
    }
    let channels: Vec<Channel> = (0..count as usize)
        .map(|_| {
            let word = words.word()?;
            let line = words.line;
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
        .collect::<Result<_, _>>()?;
    // rotations such as Z, X, Z are in use; the same one twice in a row or two positions on one axis mean nothing
    let repeated = |i: usize| match channels[i] {
        Channel::Position(_) => channels[..i].contains(&channels[i]),
        Channel::Rotation(_) => i > 0 && channels[i - 1] == channels[i],
    };
    match (1..channels.len()).find(|i| repeated(*i)) {
        Some(i) => Err(words.wrong(line, format!("found channel {} again, expected each once", channels[i].name()))),
        None => Ok(channels),
    }
}

/// Positions of the joints at rest, with all angles 0.
fn rest(nodes: &[Node]) -> Vec<DVec3> {
    let mut pos: Vec<DVec3> = Vec::with_capacity(nodes.len());
    for node in nodes {
        pos.push(node.parent.map_or(DVec3::ZERO, |parent| pos[parent] + node.offset));
    }
    pos
}

/// The rotations of the kept joints. The carriers above the first of them are folded into it.
fn keyframe(nodes: &[Node], row: &[f64], kept: &[usize], carriers: &[usize]) -> Keyframe {
    let mut numbers = row.iter();
    let locals: Vec<Local> = nodes
        .iter()
        .map(|node| {
            let (mut turn, mut at) = (DQuat::IDENTITY, DVec3::ZERO);
            for channel in &node.channels {
                let value = numbers.next().copied().unwrap_or(0.0);
                match channel {
                    Channel::Position(axis) => at[*axis] = value,
                    // the first channel is the outermost rotation
                    Channel::Rotation(axis) => turn *= exp(DVec3::AXES[*axis] * value.to_radians()),
                }
            }
            Local { pos: if node.travels() { at } else { node.offset }, turn }
        })
        .collect();
    let root = carriers[1..].iter().fold(locals[carriers[0]], |place, joint| place.then(locals[*joint]));
    let rotations = kept.iter().enumerate().map(|(i, joint)| {
        let turn = if i == 0 { root.turn } else { locals[*joint].turn };
        wxyz(turn.normalize())
    });
    Keyframe { root: root.pos.to_array(), rotations: rotations.collect() }
}

impl<'a> Words<'a> {
    fn new(path: &'a Path, text: &'a str) -> Self {
        let mut words = Words { path, text, at: 0, line: 1, start: 0, last: (0, 1) };
        words.skip();
        words
    }

    /// Moves to the next word.
    fn skip(&mut self) {
        for (i, letter) in self.text[self.at..].char_indices() {
            if !letter.is_whitespace() {
                self.at += i;
                return;
            }
            if letter == '\n' {
                self.line += 1;
                self.start = self.at + i + 1;
            }
        }
        self.at = self.text.len();
    }

    /// Whether there is another word.
    fn is_more(&mut self) -> bool {
        self.skip();
        self.at < self.text.len()
    }

    /// Returns the next word and makes its line the current one.
    fn word(&mut self) -> Result<&'a str, MotionError> {
        if !self.is_more() {
            let line = self.text.lines().count().max(1);
            return Err(self.wrong(line, "the file ends too early".into()));
        }
        self.last = (self.line, 1 + self.at - self.start);
        let rest = &self.text[self.at..];
        let word = &rest[..rest.find(char::is_whitespace).unwrap_or(rest.len())];
        self.at += word.len();
        Ok(word)
    }

    fn expect(&mut self, wanted: &str) -> Result<(), MotionError> {
        match self.word()? {
            word if word.eq_ignore_ascii_case(wanted) => Ok(()),
            word => Err(self.wrong(self.line, format!("found {word:?}, expected {wanted}"))),
        }
    }

    /// Reads a label with its colon. Spaces within it and after it are optional.
    fn label(&mut self, label: &str) -> Result<(), MotionError> {
        let mut first = None;
        for letter in label.chars().filter(|letter| !letter.is_whitespace()) {
            self.skip();
            let (at, _) = *first.get_or_insert((self.at, self.line));
            if at == self.at {
                self.last = (self.line, 1 + at - self.start);
            }
            match self.text[self.at..].chars().next() {
                Some(found) if found.eq_ignore_ascii_case(&letter) => self.at += found.len_utf8(),
                _ => {
                    let (at, line) = first.unwrap_or((self.at, self.line));
                    let word = self.text[at..].split_whitespace().next().unwrap_or("");
                    self.at = at + word.len();
                    return Err(self.wrong(line, format!("found {word:?}, expected {label}")));
                }
            }
        }
        Ok(())
    }

    fn number(&mut self) -> Result<f64, MotionError> {
        let word = self.word()?;
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.wrong(self.line, format!("found {word:?}, expected a number"))),
        }
    }

    /// An error at the last word read, if it is in this line, or else at the start of the line.
    fn wrong(&self, line: usize, problem: String) -> MotionError {
        let column = if self.last.0 == line { self.last.1 } else { 1 };
        MotionError::Syntax { path: self.path.into(), line, column, problem }
    }
}
