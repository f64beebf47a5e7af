//! Views of an element: to read it, and to change it.

use super::super::document::Element;
use super::super::error::{MjcfError, shorten};
use super::kind::Kind;
use super::part;
use super::value::AttrValue;
use super::walk::{self, Path};
use super::{ModelSpec, references};
use crate::hint::{did_you_mean, nearest};

/// An element of a model, to read. It has what the file says, without what default classes add.
#[derive(Clone, Copy, Debug)]
pub struct ElementRef<'s>(pub(super) &'s Element);

impl<'s> ElementRef<'s> {
    /// The MJCF element, such as `geom` or `motor`.
    pub fn tag(self) -> &'s str {
        &self.0.name
    }

    /// Its name, if it has one.
    pub fn name(self) -> Option<&'s str> {
        self.get("name").filter(|name| !name.is_empty())
    }

    /// The text of an attribute, if it is given.
    pub fn get(self, attribute: &str) -> Option<&'s str> {
        self.0.text(attribute)
    }

    /// The numbers of an attribute, if it is given and holds only numbers.
    pub fn numbers(self, attribute: &str) -> Option<Vec<f64>> {
        self.get(attribute)?.split_ascii_whitespace().map(|word| word.parse().ok()).collect()
    }

    /// All attributes by name, in the order of the file.
    pub fn attributes(self) -> impl Iterator<Item = (&'s str, &'s str)> {
        self.0.attrs.iter().map(|attr| (attr.name.as_str(), attr.value.as_str()))
    }

    /// The elements directly in it.
    pub fn children(self) -> impl Iterator<Item = ElementRef<'s>> {
        self.0.children.iter().map(ElementRef)
    }
}

/// An element of a model, to change.
#[derive(Debug)]
pub struct ElementMut<'s> {
    pub(super) spec: &'s mut ModelSpec,
    pub(super) path: Path,
    /// Its kind, if its kind has names.
    pub(super) kind: Option<Kind>,
}

impl ElementMut<'_> {
    /// The element as it is.
    pub fn view(&self) -> ElementRef<'_> {
        ElementRef(walk::at(&self.spec.root, &self.path))
    }

    /// Sets an attribute by its MJCF name. References to the element follow a change of its `name`.
    ///
    /// # Errors
    /// If the element has no such attribute, or another one has the name.
    pub fn set(&mut self, attribute: &str, value: impl Into<AttrValue>) -> Result<&mut Self, MjcfError> {
        let value = value.into();
        let kind = self.kind.filter(|_| attribute == "name");
        let old = kind.and_then(|kind| kind.name(walk::at(&self.spec.root, &self.path)).map(str::to_owned));
        if let Some(kind) = kind.filter(|_| old.as_deref() != Some(value.0.as_str())) {
            self.spec.check_free(kind, &value.0, walk::at(&self.spec.root, &self.path))?;
        }
        self.spec.change(&self.path, |element| part::set(element, attribute, value.clone()))?;
        if let Some((kind, old)) = kind.zip(old) {
            references::rename(&mut self.spec.root, kind, &old, &value.0);
        }
        Ok(self)
    }

    /// Leaves an attribute to the element's default class, or to MuJoCo's default.
    ///
    /// # Errors
    /// If the attribute is not given.
    pub fn unset(&mut self, attribute: &str) -> Result<&mut Self, MjcfError> {
        let element = walk::at(&self.spec.root, &self.path);
        if element.attr(attribute).is_none() {
            let given = element.attrs.iter().map(|attr| attr.name.as_str());
            let hint = did_you_mean(nearest(attribute, given));
            return Err(element.invalid(format!("the attribute '{}' is not given{hint}", shorten(attribute))));
        }
        self.spec.change(&self.path, |element| element.attrs.retain(|attr| attr.name != attribute))?;
        Ok(self)
    }
}
