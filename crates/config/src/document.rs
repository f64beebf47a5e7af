//! YAML text to a tree whose parts know their lines.
//!
//! The parser's events are put together here, not by a library's loader, because a file may be anything: nesting and
//! aliases are bounded, so that no file exhausts the stack or the memory.

use super::error::{ConfigError, printable, shown};
use marathon_physics::budget::CONFIG_FILE;
use saphyr_parser::{Event, Parser, ScalarStyle, Span, Tag};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Most values of a file, repetitions by aliases included.
const MOST_NODES: usize = 100_000;
/// Limit on the bytes of all texts in a file, including texts repeated by aliases.
const MOST_TEXT: usize = 1 << 24;
/// Most levels of nesting.
const MOST_LEVELS: usize = 32;

/// A value and the line where it starts.
#[derive(Clone, Debug)]
pub struct Node {
    pub line: usize,
    pub value: Value,
}

#[derive(Clone, Debug)]
pub enum Value {
    /// A text; `plain` if it stood without quotes, so that it may be a number, a truth value or nothing.
    Scalar {
        text: String,
        plain: bool,
    },
    List(Vec<Node>),
    Map(Map),
}

/// Keys with their lines, and their values, in the order of the file.
#[derive(Clone, Debug, Default)]
pub struct Map {
    pub entries: Vec<Field>,
}

#[derive(Clone, Debug)]
pub struct Field {
    pub key: String,
    pub line: usize,
    pub node: Node,
}

impl Map {
    pub fn get(&self, key: &str) -> Option<&Field> {
        self.entries.iter().find(|field| field.key == key)
    }
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|field| field.key.as_str())
    }
}

impl Node {
    /// Whether there is nothing: no text, `~` or `null`.
    pub fn is_null(&self) -> bool {
        match &self.value {
            Value::Scalar { text, plain: true } => matches!(text.as_str(), "" | "~" | "null" | "Null" | "NULL"),
            _ => false,
        }
    }
    /// The value as messages name it.
    pub fn describe(&self) -> String {
        match &self.value {
            _ if self.is_null() => "nothing".into(),
            Value::Scalar { text, .. } => format!("'{}'", shown(text)),
            Value::List(_) => "a list".into(),
            Value::Map(_) => "a mapping".into(),
        }
    }
    /// Number of values, itself included.
    fn size(&self) -> usize {
        1 + match &self.value {
            Value::Scalar { .. } => 0,
            Value::List(items) => items.iter().map(Node::size).sum(),
            Value::Map(map) => map.entries.iter().map(|field| field.node.size()).sum(),
        }
    }
    /// Bytes of all texts in the document.
    fn text(&self) -> usize {
        match &self.value {
            Value::Scalar { text, .. } => text.len(),
            Value::List(items) => items.iter().map(Node::text).sum(),
            Value::Map(map) => map.entries.iter().map(|field| field.key.len() + field.node.text()).sum(),
        }
    }
    /// Levels below it.
    fn depth(&self) -> usize {
        match &self.value {
            Value::Scalar { .. } => 0,
            Value::List(items) => 1 + items.iter().map(Node::depth).max().unwrap_or(0),
            Value::Map(map) => 1 + map.entries.iter().map(|field| field.node.depth()).max().unwrap_or(0),
        }
    }
}

/// Parses a file's bytes; its single document must be a mapping.
///
/// # Errors
/// If it is not, with line and column.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Map, ConfigError> {
    let asked = CONFIG_FILE.check(bytes.len() as f64);
    asked.map_err(|error| ConfigError::syntax(path, 1, 1, format!("the file {error}")))?;
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = 1 + bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count();
        ConfigError::syntax(path, line, 1, "found bytes that are no text, expected UTF-8")
    })?;
    parse_text(path, text)
}

/// The same for a text of the program itself, which has no limit.
///
/// # Errors
/// As [`parse`].
pub fn parse_text(path: &Path, text: &str) -> Result<Map, ConfigError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut builder = Builder { path, open: Vec::new(), anchors: BTreeMap::new(), nodes: 0, repeated: 0, root: None };
    let mut parser = Parser::new_from_str(text);
    while let Some(event) = parser.next_event() {
        let (event, span) = event.map_err(|e| {
            let at = e.marker();
            ConfigError::syntax(path, at.line(), at.col() + 1, format!("not YAML: {}", printable(e.info())))
        })?;
        builder.event(event, span)?;
    }
    match builder.root {
        Some(Node { value: Value::Map(map), .. }) => Ok(map),
        Some(node) => {
            let problem =
                format!("found {}, expected a mapping with a section such as 'run:' or 'behaviors:'", node.describe());
            Err(ConfigError::syntax(path, node.line, 1, problem))
        }
        None => {
            Err(ConfigError::syntax(path, 1, 1, "found nothing, expected a section such as 'run:' or 'behaviors:'"))
        }
    }
}

/// Takes the lines off what stands for an object of a program.
pub fn forget_lines(map: &mut Map) {
    for field in &mut map.entries {
        field.line = 0;
        forget(&mut field.node);
    }
}

fn forget(node: &mut Node) {
    node.line = 0;
    match &mut node.value {
        Value::Scalar { .. } => {}
        Value::List(items) => items.iter_mut().for_each(forget),
        Value::Map(map) => forget_lines(map),
    }
}

/// A list or mapping whose end has not come yet.
struct Open {
    line: usize,
    anchor: usize,
    content: Content,
}

enum Content {
    List(Vec<Node>),
    Map { map: Map, names: BTreeSet<String>, key: Option<(String, usize)>, merged: Vec<Map> },
}

struct Builder<'a> {
    path: &'a Path,
    open: Vec<Open>,
    anchors: BTreeMap<usize, Node>,
    nodes: usize,
    /// Bytes of texts repeated by aliases.
    repeated: usize,
    root: Option<Node>,
}

impl Builder<'_> {
    fn event(&mut self, event: Event<'_>, span: Span) -> Result<(), ConfigError> {
        let line = span.start.line();
        let column = span.start.col() + 1;
        let fail = |problem: String| Err(ConfigError::syntax(self.path, line, column, problem));
        let (node, anchor) = match event {
            Event::Scalar(text, style, anchor, tag) => {
                let Some(plain) = plain(style, tag.as_ref()) else {
                    return fail("found a tag of one's own, expected a plain value".into());
                };
                (Node { line, value: Value::Scalar { text: text.into_owned(), plain } }, anchor)
            }
            Event::Alias(id) => match self.anchors.get(&id) {
                Some(node) => {
                    self.repeated += node.text();
                    if self.repeated > MOST_TEXT {
                        return fail(format!(
                            "found aliases that repeat more than {MOST_TEXT} bytes of text, expected a configuration"
                        ));
                    }
                    (node.clone(), 0)
                }
                None => return fail("found a value that contains itself, expected an alias of an earlier one".into()),
            },
            Event::SequenceStart(anchor, _) => return self.begin(line, anchor, Content::List(Vec::new())),
            Event::MappingStart(anchor, _) => {
                let (map, names) = (Map::default(), BTreeSet::new());
                return self.begin(line, anchor, Content::Map { map, names, key: None, merged: Vec::new() });
            }
            Event::SequenceEnd | Event::MappingEnd => {
                let Some(Open { line, anchor, content }) = self.open.pop() else { return Ok(()) };
                let value = match content {
                    Content::List(items) => Value::List(items),
                    Content::Map { map, names, merged, .. } => Value::Map(merge(map, names, merged)),
                };
                (Node { line, value }, anchor)
            }
            Event::DocumentStart(_) if self.root.is_some() => {
                return fail("found a second document, expected one in the file".into());
            }
            _ => return Ok(()),
        };
        if anchor != 0 {
            self.anchors.insert(anchor, node.clone());
        }
        self.put(node, line, column)
    }

    fn begin(&mut self, line: usize, anchor: usize, content: Content) -> Result<(), ConfigError> {
        self.open.push(Open { line, anchor, content });
        self.check_levels(self.open.len(), line)
    }

    fn check_levels(&self, levels: usize, line: usize) -> Result<(), ConfigError> {
        if levels > MOST_LEVELS {
            let problem = format!("found more than {MOST_LEVELS} levels, expected a configuration");
            return Err(ConfigError::syntax(self.path, line, 1, problem));
        }
        Ok(())
    }

    /// Gives a finished node to the list or mapping that it belongs to.
    fn put(&mut self, node: Node, line: usize, column: usize) -> Result<(), ConfigError> {
        let path = self.path;
        let fail = |problem: String| Err(ConfigError::syntax(path, line, column, problem));
        self.nodes += node.size();
        if self.nodes > MOST_NODES {
            return fail(format!("found more than {MOST_NODES} values, expected a configuration"));
        }
        self.check_levels(self.open.len() + node.depth(), line)?;
        match self.open.last_mut().map(|open| &mut open.content) {
            None => self.root = Some(node),
            Some(Content::List(items)) => items.push(node),
            Some(Content::Map { map, names, key, merged }) => match (key.take(), node.value) {
                (None, Value::Scalar { text, .. }) => {
                    if text != "<<" && !names.insert(text.clone()) {
                        return fail(format!("found the key '{}' twice, expected it once", shown(&text)));
                    }
                    *key = Some((text, line));
                }
                (None, _) => return fail("found a list or mapping as a key, expected a name".into()),
                // YAML 1.1: the keys of other mappings, where this one lacks them
                (Some((key, _)), value) if key == "<<" => match value {
                    Value::Map(other) => merged.push(other),
                    Value::List(items) => {
                        merged.extend(items.into_iter().filter_map(|node| match node.value {
                            Value::Map(other) => Some(other),
                            _ => None,
                        }));
                    }
                    Value::Scalar { .. } => return fail("found a value after '<<', expected a mapping".into()),
                },
                (Some((key, line)), value) => {
                    map.entries.push(Field { key, line, node: Node { line: node.line, value } });
                }
            },
        }
        Ok(())
    }
}

fn merge(mut map: Map, mut names: BTreeSet<String>, merged: Vec<Map>) -> Map {
    for field in merged.into_iter().flat_map(|other| other.entries) {
        if names.insert(field.key.clone()) {
            map.entries.push(field);
        }
    }
    map
}

/// Whether a scalar may be a number or truth value; none if its tag says what no configuration knows.
fn plain(style: ScalarStyle, tag: Option<&Cow<'_, Tag>>) -> Option<bool> {
    match tag {
        None => Some(style == ScalarStyle::Plain),
        Some(tag) if tag.is_yaml_core_schema() => Some(tag.suffix != "str"),
        Some(_) => None,
    }
}
