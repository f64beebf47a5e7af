//! Models that others attach: found by name, read once per file.

pub(super) mod child;
pub(super) mod classes;
pub(super) mod keys;

use super::super::compiler::Settings;
use super::super::document::{self, Attr, Element, join, normalize};
use super::super::error::{MjcfError, MjcfErrorKind, shorten};
use super::super::room::Room;
use super::super::schema;
use super::super::settings::entries;
use super::super::utf8;
use crate::hint::nearest;
use child::Child;
use keys::Key;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

/// Elements that may be looked at; bounds the time that nested copies take.
const MOST_LOOKS: usize = 20_000_000;
/// Limit on models that attach models that attach models.
const MAX_NESTED: usize = 20;

/// Expands the copies of a document, given the folder of its file, and returns the keyframes of attached models.
pub(super) type Expand = fn(&mut Element, &str, &Library) -> Result<Vec<Key>, MjcfError>;

/// All models that a model and its parts attach, and what reading them may cost.
pub(super) struct Library<'a> {
    resolve: &'a dyn Fn(&str) -> Result<Vec<u8>, String>,
    expand: Expand,
    pub room: &'a Room,
    looks: Cell<usize>,
    read: RefCell<BTreeMap<String, Rc<Child>>>,
    /// Files that are being read, each for the one before it.
    open: RefCell<Vec<String>>,
}

impl<'a> Library<'a> {
    pub fn new(resolve: &'a dyn Fn(&str) -> Result<Vec<u8>, String>, expand: Expand, room: &'a Room) -> Library<'a> {
        Library {
            resolve,
            expand,
            room,
            looks: Cell::new(0),
            read: RefCell::new(BTreeMap::new()),
            open: RefCell::new(Vec::new()),
        }
    }

    /// Counts elements that are looked at.
    pub fn look(&self, element: &Element, count: usize) -> Result<(), MjcfError> {
        self.looks.set(self.looks.get().saturating_add(count));
        if self.looks.get() > MOST_LOOKS {
            return Err(
                element.invalid(format!("to expand it takes more than {MOST_LOOKS} steps; expected fewer copies"))
            );
        }
        Ok(())
    }

    /// The model that an `<attach>` names. `folder`: folder of the file of the model that attaches it.
    pub(super) fn find(
        &self,
        root: &Element,
        folder: &str,
        attach: &Element,
        wanted: &Attr,
    ) -> Result<Rc<Child>, MjcfError> {
        let mut names = Vec::new();
        for model in entries(root, "asset").filter(|asset| asset.name == "model") {
            schema::check_expanded(model)?;
            let (name, child) = match model.text("name") {
                Some(name) => (name.to_owned(), None),
                None => {
                    let child = self.read(model, folder)?;
                    (child.root.text("model").unwrap_or("MuJoCo Model").to_owned(), Some(child))
                }
            };
            if name == wanted.value {
                return child.map_or_else(|| self.read(model, folder), Ok);
            }
            names.push(name);
        }
        Err(wanted.place.error(MjcfErrorKind::UnknownName {
            element: attach.label(),
            attribute: wanted.name.clone(),
            kind: "model".to_owned(),
            found: shorten(&wanted.value),
            nearest: nearest(&wanted.value, names.iter().map(String::as_str)).map(Into::into),
        }))
    }

    /// The model in the file of a `<model>`.
    fn read(&self, model: &Element, folder: &str) -> Result<Rc<Child>, MjcfError> {
        let Some(attr) = model.attr("file").filter(|attr| !attr.value.is_empty()) else {
            return Err(model.invalid("the attribute 'file' is missing"));
        };
        match model.attr("content_type").filter(|kind| !kind.value.is_empty()) {
            Some(kind) if kind.value != "text/xml" => {
                return Err(model.bad_value(kind, "'text/xml': other models than MJCF are not supported"));
            }
            None if !attr.value.ends_with(".xml") => {
                return Err(model.bad_value(attr, "a file that ends with .xml, or content_type=\"text/xml\""));
            }
            _ => {}
        }
        let path = normalize(&join(folder, &attr.value));
        if let Some(child) = self.read.borrow().get(&path) {
            return Ok(child.clone());
        }
        if self.open.borrow().contains(&path) {
            let way = [&self.open.borrow()[..], &[path]].concat();
            return Err(model.invalid(format!("a model attaches itself: {}", shorten(&way.join(" > ")))));
        }
        if self.open.borrow().len() >= MAX_NESTED {
            return Err(model.invalid(format!("models are attached more than {MAX_NESTED} deep")));
        }
        let text = (self.resolve)(&path).and_then(utf8).map_err(|reason| {
            attr.place.error(MjcfErrorKind::Read(format!("model file '{}': {reason}", shorten(&path))))
        })?;
        self.open.borrow_mut().push(path.clone());
        let child = self.child(&text, &path)?;
        self.open.borrow_mut().pop();
        let child = Rc::new(child);
        self.read.borrow_mut().insert(path, child.clone());
        Ok(child)
    }

    fn child(&self, text: &str, path: &str) -> Result<Child, MjcfError> {
        let folder = path.rfind('/').map_or("", |end| &path[..=end]);
        let mut root = document::parse(text, path, folder, &|file| utf8((self.resolve)(file)?), self.room)?;
        let pending = (self.expand)(&mut root, folder, self)?;
        check(&root)?;
        let settings = Settings { folder: folder.to_owned(), ..Settings::read(&root)? };
        let settings = Arc::new(settings);
        settle(&mut root, &settings);
        let mut keys = keys::keep(&mut root, self.room)?;
        keys.extend(pending);
        let size = count(&root);
        Ok(Child { root, file: path.to_owned(), settings, keys, size })
    }
}

/// Checks names of elements and attributes that will not be part of the enclosing model. Features that are not supported
/// are refused where they become part of it.
fn check(root: &Element) -> Result<(), MjcfError> {
    for (i, section) in root.children.iter().enumerate() {
        if section.name == "compiler" {
            schema::check_at(root, &[i], true)?;
        }
        schema::tolerate(schema::check_at(root, &[i], false))?;
        for j in 0..section.children.len() {
            schema::tolerate(schema::check_at(root, &[i, j], true))?;
        }
    }
    Ok(())
}

/// Gives the settings to all elements that have none of their own.
fn settle(element: &mut Element, settings: &Arc<Settings>) {
    element.settings.get_or_insert_with(|| settings.clone());
    element.children.iter_mut().for_each(|child| settle(child, settings));
}

fn count(element: &Element) -> usize {
    1 + element.children.iter().map(count).sum::<usize>()
}
