//! Expands `<attach>`: a body, a frame or the whole world of another model, or a part of the same model, once more under
//! names with a prefix.
//!
//! The rules are MuJoCo's:
//! * The part keeps its own default classes and compiler settings, whatever those of the enclosing parts are.
//! * The other model's assets, numbers and texts are copied with it. Of the elements of other sections, those are copied
//!   whose references exist under the prefix. Pairs, excludes, tendons and sensors may refer to other things as well.
//! * Its `<option>` counts as `<compiler conflict>` says. By default, the enclosing model's counts.
//! * Its keyframes become keyframes of the enclosing model, in which all else is at rest.

mod conflict;
mod follow;
mod prefix;

use super::super::document::{Attr, Element};
use super::super::error::{MjcfError, MjcfErrorKind, shorten};
use super::super::schema;
use super::super::settings::entries;
use super::expand::{Expansion, FOLLOWERS, named};
use super::kind::{Kind, WORLD};
use super::library::child::Child;
use super::library::keys;
use super::part::{Draft, set};
use super::references::Gone;
use super::walk::{self, Path};
use crate::hint::nearest;
use prefix::Prefix;
use std::collections::BTreeSet;

/// Looks that take as long as a copy of an element.
const LOOKS: usize = 10;

impl Expansion<'_> {
    /// Puts the attached part in the place of the `<attach>` with this index among the parts of an element. Returns 1, the
    /// number of elements there.
    pub fn attach(&mut self, parent: &[usize], index: usize) -> Result<usize, MjcfError> {
        let attach = walk::at(self.root, parent).children[index].clone();
        schema::check_expanded(&attach)?;
        if let Some(child) = attach.children.first() {
            return Err(child.invalid("an <attach> contains no elements"));
        }
        let Some(prefix) = attach.text("prefix") else {
            return Err(attach.invalid("the attribute 'prefix' is missing"));
        };
        let part = match (attach.attr("body"), attach.attr("frame")) {
            (Some(_), Some(_)) => return Err(attach.invalid("there are both 'body' and 'frame'")),
            (body, frame) => body.or(frame),
        };
        let at = [parent, &[index]].concat();
        let frame = match (attach.attr("model"), part) {
            (Some(model), part) => self.of_model(&attach, model, part, prefix)?,
            (None, Some(part)) => self.of_itself(&attach, part, prefix, &at)?,
            (None, None) => return Err(attach.invalid("'model', 'body' or 'frame' is missing")),
        };
        self.check_depth(&frame, parent.len())?;
        *walk::at_mut(self.root, &at) = frame;
        Ok(1)
    }

    /// A part of another model, in a frame, while the rest of the document gets what belongs to it.
    fn of_model(
        &mut self,
        attach: &Element,
        model: &Attr,
        part: Option<&Attr>,
        prefix: &str,
    ) -> Result<Element, MjcfError> {
        let child = self.library.find(self.root, self.folder, attach, model)?;
        conflict::resolve(self.root, &child.root, attach)?;
        self.library.look(attach, LOOKS * child.size)?;
        let mut source = match self.sources.remove(&model.value) {
            Some(source) => source,
            None => {
                self.library.room.take_document(&child.root)?;
                child.root.clone()
            }
        };
        keys::store(&mut source, prefix, self.library.room)?;
        let (classes, are_new) = self.classes.map(&child, prefix);
        let prefix = Prefix { prefix, classes: Some(&classes) };
        let (paths, class) = match part {
            Some(part) if part.name != "body" || part.value != WORLD => {
                let path = find(&source, attach, part, |_| true)?;
                let class = childclass(&source, &path);
                (vec![path], class)
            }
            _ => (world_parts(&source), None),
        };
        let mut parts: Vec<Element> = paths.iter().map(|path| walk::at(&source, path).clone()).collect();
        if part.is_some_and(|part| part.name == "body" && part.value == WORLD) {
            let mut world = Draft::new("body").with("name", WORLD).placed(&attach.place);
            world.children = parts;
            world.settings = Some(child.settings.clone());
            parts = vec![world];
        }
        let frame = self.framed(attach, parts, class, &prefix)?;
        if are_new {
            self.add_defaults(&child, &prefix)?;
        }
        self.add_assets(&child, &prefix)?;
        let copied = self.follow(&source, &prefix)?;
        paths.iter().for_each(|path| keys::forget(walk::at_mut(&mut source, path)));
        forget_followers(&mut source, &copied);
        self.keys.extend(child.keys.iter().map(|key| key.attached(prefix.prefix)));
        self.sources.insert(model.value.clone(), source);
        Ok(frame)
    }

    /// A copy of an earlier part of the same model, in a frame, while the other sections get copies of what refers to it.
    fn of_itself(&mut self, attach: &Element, part: &Attr, prefix: &str, at: &[usize]) -> Result<Element, MjcfError> {
        let path = find(self.root, attach, part, |path| path < at)?;
        let source = until(walk::at(self.root, &path), at.strip_prefix(&path[..]).unwrap_or_default());
        let class = childclass(self.root, &path);
        let prefix = Prefix { prefix, classes: None };
        let frame = self.framed(attach, vec![source], class, &prefix)?;
        // as in MuJoCo, the numbers of keyframes go to the copy
        keys::forget(walk::at_mut(self.root, &path));
        let sections: Vec<Element> =
            self.root.children.iter().filter(|s| FOLLOWERS.contains(&s.name.as_str())).cloned().collect();
        self.library.look(attach, LOOKS * sections.iter().map(|section| section.children.len()).sum::<usize>())?;
        let sections = Element { children: sections, ..attach.clone() };
        let copied = self.follow(&sections, &prefix)?;
        forget_followers(self.root, &copied);
        Ok(frame)
    }

    /// Copies of parts in a frame that keeps their default class.
    fn framed(
        &mut self,
        attach: &Element,
        parts: Vec<Element>,
        class: Option<String>,
        prefix: &Prefix,
    ) -> Result<Element, MjcfError> {
        let mut frame = Draft::new("frame").placed(&attach.place);
        set(&mut frame, "childclass", prefix.class(class.as_deref()).into());
        let mut names = Gone::new();
        for mut part in parts {
            self.library.room.take_document(&part)?;
            prefix.part(&mut part);
            self.collect(&part, &mut names)?;
            frame.children.push(part);
        }
        self.known.extend(names);
        Ok(frame)
    }

    fn add_defaults(&mut self, child: &Child, prefix: &Prefix) -> Result<(), MjcfError> {
        // MuJoCo's outermost class is there even if nothing is set in it
        let empty = Draft::new("default").placed(&child.root.place);
        let empty = Element { settings: Some(child.settings.clone()), ..empty };
        let sections = child.root.children.iter().filter(|section| section.name == "default");
        for section in std::iter::once(&empty).chain(sections) {
            self.library.room.take_document(section)?;
            let mut section = section.clone();
            prefix.default(&mut section);
            self.root.children.push(section);
        }
        Ok(())
    }

    /// Adds what comes with a model even if nothing refers to it.
    fn add_assets(&mut self, child: &Child, prefix: &Prefix) -> Result<(), MjcfError> {
        for section in &child.root.children {
            let is_wanted = |element: &&Element| match section.name.as_str() {
                "asset" => element.name != "model",
                "custom" => element.name != "tuple",
                "deformable" => element.name == "flex",
                _ => false,
            };
            for element in section.children.iter().filter(is_wanted) {
                self.library.room.take_document(element)?;
                let mut copy = element.clone();
                prefix.asset(&mut copy);
                let last = self.section(&section.name);
                self.root.children[last].children.push(copy);
            }
        }
        Ok(())
    }

    /// Adds the elements of other sections whose references exist under the prefix. Returns the section and the index in it of each
    /// element that was copied.
    fn follow(&mut self, source: &Element, prefix: &Prefix) -> Result<Vec<(&'static str, usize)>, MjcfError> {
        let mut copied = Vec::new();
        for section in FOLLOWERS {
            for (i, element) in entries(source, section).enumerate() {
                let Some(mut copy) = follow::copy(section, element, &self.known, prefix.prefix) else { continue };
                self.library.room.take_document(&copy)?;
                prefix.follower(section, &mut copy);
                self.known.extend(named(section, &copy));
                let last = self.section(section);
                self.root.children[last].children.push(copy);
                copied.push((section, i));
            }
        }
        Ok(copied)
    }
}

fn forget_followers(root: &mut Element, copied: &[(&str, usize)]) {
    for section in FOLLOWERS {
        let elements = root.children.iter_mut().filter(|s| s.name == section).flat_map(|s| &mut s.children);
        let copied: BTreeSet<usize> = copied.iter().filter(|(name, _)| *name == section).map(|(_, i)| *i).collect();
        elements.enumerate().filter(|(i, _)| copied.contains(i)).for_each(|(_, element)| keys::forget(element));
    }
}

/// The ways to the parts of the world.
fn world_parts(root: &Element) -> Vec<Path> {
    let worlds = root.children.iter().enumerate().filter(|(_, section)| section.name == "worldbody");
    worlds.flat_map(|(i, world)| (0..world.children.len()).map(move |j| vec![i, j])).collect()
}

/// The way to the body or frame that an attribute of an `<attach>` names, among those that are wanted.
fn find(
    root: &Element,
    attach: &Element,
    part: &Attr,
    is_wanted: impl Fn(&[usize]) -> bool,
) -> Result<Path, MjcfError> {
    let mut named = Vec::new();
    for (i, world) in root.children.iter().enumerate().filter(|(_, section)| section.name == "worldbody") {
        parts(world, &part.name, &mut vec![i], &mut named);
    }
    named.retain(|(_, path)| is_wanted(path));
    if let Some((_, path)) = named.iter().find(|(name, _)| *name == part.value) {
        return Ok(path.clone());
    }
    Err(part.place.error(MjcfErrorKind::UnknownName {
        element: attach.label(),
        attribute: part.name.clone(),
        kind: if attach.attr("model").is_some() {
            format!("{} in the model", part.name)
        } else {
            format!("{} above this line", part.name)
        },
        found: shorten(&part.value),
        nearest: nearest(&part.value, named.iter().map(|(name, _)| *name)).map(Into::into),
    }))
}

/// Names of all bodies or all frames, with the ways to them.
fn parts<'e>(parent: &'e Element, tag: &str, path: &mut Path, out: &mut Vec<(&'e str, Path)>) {
    for (i, child) in parent.children.iter().enumerate() {
        path.push(i);
        if child.name == tag {
            out.extend(child.text("name").filter(|name| !name.is_empty()).map(|name| (name, path.clone())));
        }
        parts(child, tag, path, out);
        path.pop();
    }
}

/// The default class of the parts of a body that name none.
fn childclass(root: &Element, path: &[usize]) -> Option<String> {
    let enclosing = (1..path.len()).rev().map(|depth| walk::at(root, &path[..depth]));
    let mut classes = enclosing.filter_map(|element| element.text("childclass").filter(|class| !class.is_empty()));
    classes.next().map(str::to_owned)
}

/// A copy of an element without its end: the child at `path`, the rest of the way to that, and everything behind it.
fn until(element: &Element, path: &[usize]) -> Element {
    let Some((index, rest)) = path.split_first() else { return element.clone() };
    let mut copy = Element { children: element.children[..*index].to_vec(), ..shallow(element) };
    if !rest.is_empty() {
        copy.children.push(until(&element.children[*index], rest));
    }
    copy
}

/// A copy of an element without what it holds.
fn shallow(element: &Element) -> Element {
    Element {
        name: element.name.clone(),
        attrs: element.attrs.clone(),
        children: Vec::new(),
        place: element.place.clone(),
        settings: element.settings.clone(),
        keys: element.keys.clone(),
    }
}

/// Kinds that a prefix can find; the world keeps its name.
fn is_world(kind: Kind, name: &str) -> bool {
    kind == Kind::Body && name == WORLD
}
