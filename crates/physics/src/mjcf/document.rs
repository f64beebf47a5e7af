//! The XML document: elements with their places, `<include>` already expanded.

use super::compiler::Settings;
use super::error::{MjcfError, MjcfErrorKind, shorten};
use super::room::{ELEMENT, Room};
use super::xml::{self, MAX_ATTRIBUTES};
use crate::hint::nearest;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Elements may be nested this deep; deeper files would exhaust the stack of whatever walks them.
pub(crate) const MAX_DEPTH: usize = 200;
/// Elements, text pieces and comments per file; keeps memory in proportion.
const MAX_NODES: u32 = 4_000_000;

/// Where something stands: file and line.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    pub file: Arc<str>,
    pub line: usize,
}

impl Place {
    pub fn error(&self, kind: MjcfErrorKind) -> MjcfError {
        MjcfError { file: self.file.to_string(), line: self.line, kind }
    }
}

/// One attribute and the line it stands on.
#[derive(Clone, Debug)]
pub(crate) struct Attr {
    pub name: String,
    pub value: String,
    pub place: Place,
}

/// The part of a keyframe that belongs to one element of a model that is attached to another one.
#[derive(Clone, Debug)]
pub(crate) struct KeyNumbers {
    /// Name of the keyframe.
    pub key: String,
    /// The keyframe is one of the model itself, not of a model that is attached to it.
    pub own: bool,
    /// Numbers for each list of the keyframe.
    pub lists: [Vec<f64>; LISTS.len()],
}

/// Lists of a key. Each holds the numbers of all joints, actuators or mocap bodies in their order.
pub(crate) const LISTS: [&str; 6] = ["qpos", "qvel", "act", "ctrl", "mpos", "mquat"];

/// One element with everything below it.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub name: String,
    pub attrs: Vec<Attr>,
    pub children: Vec<Element>,
    pub place: Place,
    /// Compiler settings of the model that the element was attached from.
    pub settings: Option<Arc<Settings>>,
    /// Numbers of the element in keyframes that are not written yet.
    pub keys: Vec<KeyNumbers>,
}

impl Element {
    /// The attribute of that name.
    pub fn attr(&self, name: &str) -> Option<&Attr> {
        self.attrs.iter().find(|a| a.name == name)
    }

    /// The attribute's text.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.attr(name).map(|a| a.value.as_str())
    }

    /// Start tag with the name, for messages.
    pub fn label(&self) -> String {
        let tag = shorten(&self.name);
        for key in ["name", "class"] {
            if let Some(value) = self.text(key).filter(|v| !v.is_empty()) {
                return format!("<{tag} {key}=\"{}\">", shorten(value));
            }
        }
        format!("<{tag}>")
    }

    /// The element contradicts itself or the rest of the model.
    pub fn invalid(&self, message: impl Into<String>) -> MjcfError {
        self.place.error(MjcfErrorKind::Invalid { element: self.label(), message: message.into() })
    }

    /// The element, or one attribute of it, is valid MJCF that this engine does not have.
    pub fn unsupported(&self, attribute: Option<&str>, reason: impl Into<String>) -> MjcfError {
        let place = attribute.and_then(|a| self.attr(a)).map_or(&self.place, |a| &a.place);
        place.error(MjcfErrorKind::Unsupported {
            element: self.label(),
            attribute: attribute.map(str::to_owned),
            reason: reason.into(),
        })
    }

    /// The attribute's text is not what it should be.
    pub fn bad_value(&self, attr: &Attr, expected: impl Into<String>) -> MjcfError {
        attr.place.error(MjcfErrorKind::BadValue {
            element: self.label(),
            attribute: attr.name.clone(),
            found: shorten(&attr.value),
            expected: expected.into(),
        })
    }
}

impl Room {
    /// Takes room for `count` things of `bytes` bytes that an element asks for.
    pub fn take_for(&self, element: &Element, count: usize, bytes: usize) -> Result<(), MjcfError> {
        self.take(count, bytes).map_err(|over| element.invalid(format!("the model {over}")))
    }

    /// Takes room for an element without its children. `text`: length of its attributes' values.
    fn take_element(&self, element: &Element, attributes: usize, text: usize) -> Result<(), MjcfError> {
        self.take_for(element, 1, ELEMENT)?;
        self.take_for(element, 1, 100 * attributes + text)
    }

    /// Takes room for a document that is already parsed.
    pub fn take_document(&self, root: &Element) -> Result<(), MjcfError> {
        self.take_element(root, root.attrs.len(), root.attrs.iter().map(|a| a.value.len()).sum())?;
        self.take_for(root, root.keys.iter().map(|key| 300 + key.key.len()).sum(), 1)?;
        root.children.iter().try_for_each(|child| self.take_document(child))
    }
}

/// Reads the text of an included file, given the path relative to the main file.
pub(crate) type Resolve<'a> = dyn Fn(&str) -> Result<String, String> + 'a;

/// Parses `text` and expands its includes with `resolve`. `name` is the file's name for messages.
/// `folder` is its folder relative to the main file, empty or with a slash at the end.
pub(crate) fn parse(
    text: &str,
    name: &str,
    folder: &str,
    resolve: &Resolve,
    room: &Room,
) -> Result<Element, MjcfError> {
    let mut loader = Loader { folder, resolve, room, included: BTreeSet::new() };
    let root = loader.file(text, name, "", 0)?;
    if root.name != "mujoco" {
        let found = shorten(&root.name);
        let message = format!("the top-level element is <{found}>; expected <mujoco>");
        return Err(root.place.error(MjcfErrorKind::Syntax(message)));
    }
    Ok(root)
}

struct Loader<'a> {
    folder: &'a str,
    resolve: &'a Resolve<'a>,
    room: &'a Room,
    included: BTreeSet<String>,
}

impl Loader<'_> {
    /// One file; `dir` is its directory relative to the main file, empty or with a trailing slash.
    fn file(&mut self, text: &str, name: &str, dir: &str, depth: usize) -> Result<Element, MjcfError> {
        let file: Arc<str> = name.into();
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        // no DTD, hence no entity bombs; the parser itself does not recurse over elements
        let text = &*xml::repaired(text).map_err(|line| {
            let place = Place { file: file.clone(), line };
            place.error(MjcfErrorKind::Syntax(format!("an element has more than {MAX_ATTRIBUTES} attributes")))
        })?;
        let options = roxmltree::ParsingOptions { nodes_limit: MAX_NODES, ..Default::default() };
        let document = roxmltree::Document::parse_with_options(text, options).map_err(|error| {
            let place = Place { file: file.clone(), line: error.pos().row as usize };
            place.error(MjcfErrorKind::Syntax(format!("not well-formed XML: {error}")))
        })?;
        let lines = LineIndex::new(text);
        self.element(document.root_element(), &file, &lines, dir, depth)
    }

    fn element(
        &mut self,
        node: roxmltree::Node,
        file: &Arc<str>,
        lines: &LineIndex,
        dir: &str,
        depth: usize,
    ) -> Result<Element, MjcfError> {
        let place = |offset: usize| Place { file: file.clone(), line: lines.line(offset) };
        let mut element = Element {
            name: node.tag_name().name().to_owned(),
            // attributes of other namespaces (xsi:schemaLocation) are not MJCF
            attrs: node
                .attributes()
                .filter(|a| a.namespace().is_none())
                .map(|a| Attr { name: a.name().to_owned(), value: a.value().to_owned(), place: place(a.range().start) })
                .collect(),
            children: Vec::new(),
            place: place(node.range().start),
            settings: None,
            keys: Vec::new(),
        };
        self.room.take_element(&element, node.attributes().len(), node.attributes().map(|a| a.value().len()).sum())?;
        if depth >= MAX_DEPTH {
            return Err(element.invalid(format!("elements are nested more than {MAX_DEPTH} deep")));
        }
        for child in node.children().filter(|n| n.is_element()) {
            let child = self.element(child, file, lines, dir, depth + 1)?;
            if child.name == "include" {
                element.children.extend(self.include(&child, dir, depth)?);
            } else {
                element.children.push(child);
            }
        }
        Ok(element)
    }

    /// The children of the included file's top-level element.
    fn include(&mut self, include: &Element, dir: &str, depth: usize) -> Result<Vec<Element>, MjcfError> {
        if let Some(attr) = include.attrs.iter().find(|a| a.name != "file") {
            return Err(attr.place.error(MjcfErrorKind::UnknownAttribute {
                element: include.label(),
                attribute: shorten(&attr.name),
                nearest: nearest(&attr.name, ["file"]).map(Into::into),
            }));
        }
        let Some(attr) = include.attr("file") else {
            return Err(include.invalid("the attribute 'file' is missing"));
        };
        if let Some(child) = include.children.first() {
            return Err(child.place.error(MjcfErrorKind::UnknownElement {
                element: child.label(),
                parent: "include".into(),
                nearest: None,
            }));
        }
        // relative to the main file, else to the including one
        let path = normalize(&attr.value);
        let read = |path: &str| (self.resolve)(&normalize(&join(self.folder, path)));
        let (path, text) = match read(&path) {
            Ok(text) => (path, text),
            Err(reason) => {
                let local = normalize(&join(dir, &attr.value));
                let text = read(&local).map_err(|_| {
                    let message = format!("included file '{}': {reason}", shorten(&path));
                    attr.place.error(MjcfErrorKind::Read(message))
                })?;
                (local, text)
            }
        };
        if !self.included.insert(path.clone()) {
            return Err(include.invalid(format!("the file '{}' is already included", shorten(&path))));
        }
        let dir = path.rfind('/').map_or("", |end| &path[..=end]);
        let root = self.file(&text, &join(self.folder, &path), dir, depth)?;
        if root.children.is_empty() {
            return Err(include.invalid(format!("the file '{}' contains no elements", shorten(&path))));
        }
        Ok(root.children)
    }
}

/// `path` seen from `dir`, which is empty or ends with a slash.
pub(crate) fn join(dir: &str, path: &str) -> String {
    if path.starts_with('/') { path.to_owned() } else { format!("{dir}{path}") }
}

/// Removes `.` and resolvable `..` parts, so that one file has one name.
pub(crate) fn normalize(path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split(['/', '\\']) {
        match part {
            "." => {}
            "" if !parts.is_empty() => {}
            ".." if parts.last().is_some_and(|&last| last != ".." && !last.is_empty()) => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// Line numbers by byte offset.
struct LineIndex(Vec<usize>);

impl LineIndex {
    fn new(text: &str) -> Self {
        LineIndex(text.bytes().enumerate().filter(|&(_, b)| b == b'\n').map(|(i, _)| i).collect())
    }

    fn line(&self, offset: usize) -> usize {
        self.0.partition_point(|&newline| newline < offset) + 1
    }
}
