//! Keyframes keep their meaning: the numbers of a joint, mocap body or actuator come and go with it.

use super::super::actuator_params::ActuatorParams;
use super::super::compiler::Settings;
use super::super::defaults::Defaults;
use super::super::document::{Element, LISTS};
use super::super::error::MjcfError;
use super::super::joint::JointSpec;
use super::super::math::{Frame, IDENTITY};
use super::super::orientation::orientation;
use super::super::room::Room;
use super::super::settings::sections;
use super::super::value::Attrs;
use super::walk::Path;
use crate::model::{Dynamics, JointType};

/// The part of each list that belongs to one element and what it holds: where it begins, and its values at rest.
#[derive(Clone, Debug, Default)]
pub(super) struct Share([(usize, Vec<f64>); LISTS.len()]);

/// The numbers that one element adds to each list.
pub(super) type Values = [Vec<f64>; LISTS.len()];

impl Share {
    /// The share of the element at a path; an empty one if the model has no keyframes.
    pub fn of(root: &Element, path: &[usize]) -> Result<Share, MjcfError> {
        let mut share = Share::default();
        if sections(root, "keyframe").all(|section| section.children.is_empty()) {
            return Ok(share);
        }
        let all = at_rest(root, &Room::default())?;
        let first = all.iter().position(|(at, _)| at.starts_with(path)).unwrap_or(all.len());
        for (_, values) in &all[..first] {
            share.0.iter_mut().zip(values).for_each(|((start, _), more)| *start += more.len());
        }
        for (_, values) in all[first..].iter().filter(|(at, _)| at.starts_with(path)) {
            share.0.iter_mut().zip(values).for_each(|((_, own), more)| own.extend(more));
        }
        Ok(share)
    }

    /// The share of nothing at the same place.
    pub fn emptied(&self) -> Share {
        Share(self.0.each_ref().map(|(start, _)| (*start, Vec::new())))
    }
}

/// The numbers that each joint, mocap body and actuator adds to the lists, in their order.
pub(super) fn at_rest(root: &Element, room: &Room) -> Result<Vec<(Path, Values)>, MjcfError> {
    let defaults = Defaults::read(root, room)?;
    let mut reader = Reader { defaults: &defaults, settings: Settings::read(root)?, values: Vec::new() };
    reader.model(root)?;
    Ok(reader.values)
}

/// Puts the new share of an element in place of its old one, in every key. A share of the same size keeps its numbers.
pub(super) fn replace(root: &mut Element, old: &Share, new: &Share) {
    for section in root.children.iter_mut().filter(|section| section.name == "keyframe") {
        for key in &mut section.children {
            for ((name, (start, gone)), (begin, values)) in LISTS.iter().zip(&old.0).zip(&new.0) {
                if gone.len() == values.len() {
                    continue;
                }
                let Some(i) = key.attrs.iter().position(|attr| attr.name == *name) else { continue };
                // nothing has no place of its own
                let start = if gone.is_empty() { *begin } else { *start };
                match spliced(&key.attrs[i].value, start, gone.len(), values) {
                    text if text.is_empty() => drop(key.attrs.remove(i)),
                    text => key.attrs[i].value = text,
                }
            }
        }
    }
}

/// A list of numbers with others in place of `count` of them. A list that ends before them stays as it is: the rest
/// of a short list is at rest.
fn spliced(text: &str, start: usize, count: usize, values: &[f64]) -> String {
    let numbers: Vec<&str> = text.split_ascii_whitespace().collect();
    let end = (start + count).min(numbers.len());
    if start > end {
        return text.to_owned();
    }
    let values = if start + count <= numbers.len() { values } else { &[] };
    let values: Vec<String> = values.iter().map(f64::to_string).collect();
    let (before, after) = (&numbers[..start], &numbers[end..]);
    before
        .iter()
        .copied()
        .chain(values.iter().map(String::as_str))
        .chain(after.iter().copied())
        .collect::<Vec<_>>()
        .join(" ")
}

/// Reads what each joint, mocap body and actuator adds, in the order of the lists.
struct Reader<'a> {
    defaults: &'a Defaults<'a>,
    settings: Settings,
    values: Vec<(Path, Values)>,
}

impl<'a> Reader<'a> {
    fn model(&mut self, root: &'a Element) -> Result<(), MjcfError> {
        for (i, section) in root.children.iter().enumerate() {
            match section.name.as_str() {
                "worldbody" => self.bodies(section, &mut vec![i], None, &Frame::IDENTITY)?,
                "actuator" => {
                    for (j, element) in section.children.iter().enumerate() {
                        let (attrs, ends) = self.defaults.actuator(element)?;
                        // an unsupported actuator can still be removed
                        let stateful = ActuatorParams::compile(&attrs, ends)
                            .map_or(element.name == "muscle", |params| params.dynamics() != Dynamics::None);
                        let act = if stateful { vec![0.0] } else { Vec::new() };
                        self.values
                            .push((vec![i, j], [Vec::new(), Vec::new(), act, vec![0.0], Vec::new(), Vec::new()]));
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The bodies in an element. `frame` is that of the enclosing frames.
    fn bodies(
        &mut self,
        parent: &'a Element,
        path: &mut Path,
        class: Option<&'a str>,
        frame: &Frame,
    ) -> Result<(), MjcfError> {
        for (i, element) in parent.children.iter().enumerate() {
            if !matches!(element.name.as_str(), "body" | "frame") {
                continue;
            }
            path.push(i);
            let class = self.defaults.named(element, "childclass")?.or(class);
            let attrs = Attrs::plain(element);
            let inner = frame.compose(&self.frame(&attrs)?);
            if element.name == "body" {
                if attrs.flag_or("mocap", false)? {
                    let (pos, quat) = (inner.pos.to_vec(), inner.quat.to_vec());
                    self.values.push((path.clone(), [Vec::new(), Vec::new(), Vec::new(), Vec::new(), pos, quat]));
                }
                // joints of a body come before those of the bodies in it, wherever they stand
                self.joints(element, path, class, &Frame::IDENTITY, &inner)?;
                self.bodies(element, path, class, &Frame::IDENTITY)?;
            } else {
                self.bodies(element, path, class, &inner)?;
            }
            path.pop();
        }
        Ok(())
    }

    /// The joints of a body. `frame` is that of the enclosing frames in the body, `body` that of the body.
    fn joints(
        &mut self,
        parent: &'a Element,
        path: &mut Path,
        class: Option<&'a str>,
        frame: &Frame,
        body: &Frame,
    ) -> Result<(), MjcfError> {
        for (i, element) in parent.children.iter().enumerate() {
            path.push(i);
            let joint = match element.name.as_str() {
                "frame" => {
                    let class = self.defaults.named(element, "childclass")?.or(class);
                    let inner = frame.compose(&self.frame(&Attrs::plain(element))?);
                    self.joints(element, path, class, &inner, body)?;
                    None
                }
                "joint" => Some(JointSpec::read(&self.defaults.attrs(element, class)?, frame, &self.settings)?),
                "freejoint" => Some(JointSpec::free(element)?),
                _ => None,
            };
            if let Some(joint) = joint {
                let qpos = match joint.kind {
                    JointType::Free => [&body.pos[..], &body.quat].concat(),
                    JointType::Ball => IDENTITY.to_vec(),
                    JointType::Slide | JointType::Hinge => vec![joint.reference],
                };
                let qvel = vec![0.0; joint.sizes().1];
                self.values.push((path.clone(), [qpos, qvel, Vec::new(), Vec::new(), Vec::new(), Vec::new()]));
            }
            path.pop();
        }
        Ok(())
    }

    /// `pos` and orientation of an element.
    fn frame(&self, attrs: &Attrs) -> Result<Frame, MjcfError> {
        let pos = attrs.array_or("pos", [0.0; 3])?;
        Ok(Frame { pos, quat: orientation(attrs, &self.settings)?.unwrap_or(IDENTITY) })
    }
}
