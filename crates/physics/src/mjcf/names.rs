//! Names of a model's objects, and the references to them.

use super::document::Element;
use super::error::{MjcfError, MjcfErrorKind, shorten};
use crate::hint::nearest;
use std::collections::BTreeMap;

/// The names of one kind of objects, such as joints.
pub(crate) struct Names<'a> {
    /// Name of the objects in messages.
    kind: &'static str,
    index: BTreeMap<&'a str, usize>,
}

impl<'a> Names<'a> {
    pub fn new(kind: &'static str) -> Self {
        Names { kind, index: BTreeMap::new() }
    }

    /// Names of all objects in their order; a name may occur once.
    pub fn collect(kind: &'static str, elements: impl IntoIterator<Item = &'a Element>) -> Result<Self, MjcfError> {
        let mut names = Names::new(kind);
        for (i, element) in elements.into_iter().enumerate() {
            names.add(element, i)?;
        }
        Ok(names)
    }

    /// Adds the object `index` under the element's name, if it has one.
    pub fn add(&mut self, element: &'a Element, index: usize) -> Result<(), MjcfError> {
        match element.text("name").filter(|n| !n.is_empty()) {
            Some(name) => self.add_as(name, element, index),
            None => Ok(()),
        }
    }

    /// Adds the object `index` under a name that follows from the element.
    pub fn add_as(&mut self, name: &'a str, element: &Element, index: usize) -> Result<(), MjcfError> {
        if self.index.insert(name, index).is_some() {
            return Err(element.invalid(format!("there is already a {} of this name", self.kind)));
        }
        Ok(())
    }

    /// Takes a name that no element gives.
    pub fn reserve(&mut self, name: &'a str, index: usize) {
        self.index.insert(name, index);
    }

    /// Index of the object with this name.
    pub fn get(&self, name: &str) -> Option<usize> {
        self.index.get(name).copied()
    }

    /// The object that the element names in `attribute`, which must be given.
    pub fn required(&self, element: &Element, attribute: &str) -> Result<usize, MjcfError> {
        match element.attr(attribute).filter(|a| !a.value.is_empty()) {
            Some(_) => self.find(element, attribute),
            None => Err(element.invalid(format!("the attribute '{attribute}' is missing"))),
        }
    }

    /// The object that the element names in `attribute`.
    fn find(&self, element: &Element, attribute: &str) -> Result<usize, MjcfError> {
        let text = element.text(attribute).unwrap_or_default();
        self.get(text).ok_or_else(|| self.unknown(element, attribute))
    }

    /// There is no object of the name that the element gives in `attribute`.
    pub fn unknown(&self, element: &Element, attribute: &str) -> MjcfError {
        let found = element.text(attribute).unwrap_or_default();
        let place = element.attr(attribute).map_or(&element.place, |a| &a.place);
        place.error(MjcfErrorKind::UnknownName {
            element: element.label(),
            attribute: attribute.to_owned(),
            kind: self.kind.to_owned(),
            found: shorten(found),
            nearest: nearest(found, self.index.keys().copied()).map(Into::into),
        })
    }
}

/// All names that other elements may refer to.
pub(crate) struct Registry<'a> {
    pub bodies: Names<'a>,
    pub joints: Names<'a>,
    pub geoms: Names<'a>,
    pub sites: Names<'a>,
    pub cameras: Names<'a>,
    pub tendons: Names<'a>,
    pub actuators: Names<'a>,
}
