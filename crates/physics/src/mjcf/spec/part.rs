//! Base of all parts: an element that is not in a document yet.

use super::super::document::{Attr, Element, Place};
use super::kind::Kind;
use super::value::AttrValue;

/// A part that a [`ModelSpec`](super::ModelSpec) can take: a body, geom, actuator...
pub trait Part: Sealed {}

/// A part that belongs to a body or the world.
pub trait BodyPart: Part {}

/// A part with a section of its own in the model.
pub trait ModelPart: Part {}

/// Keeps the traits to the parts of this module.
pub trait Sealed {
    /// Its kind.
    #[doc(hidden)]
    const KIND: Kind;

    /// Its tag and attributes.
    #[doc(hidden)]
    fn into_draft(self) -> Draft;
}

/// An element that belongs to no document yet.
#[derive(Clone, Debug)]
pub struct Draft(Element);

impl Draft {
    pub(super) fn new(tag: &str) -> Draft {
        let place = Place { file: "".into(), line: 0 };
        Draft(Element {
            name: tag.to_owned(),
            attrs: Vec::new(),
            children: Vec::new(),
            place,
            settings: None,
            keys: Vec::new(),
        })
    }

    pub(super) fn with(mut self, attribute: &str, value: impl Into<AttrValue>) -> Draft {
        set(&mut self.0, attribute, value.into());
        self
    }

    pub(super) fn containing(mut self, part: Draft) -> Draft {
        self.0.children.push(part.0);
        self
    }

    /// The element at a place of a document.
    pub(super) fn placed(self, place: &Place) -> Element {
        let mut element = self.0;
        settle(&mut element, place);
        element
    }
}

fn settle(element: &mut Element, place: &Place) {
    element.place = place.clone();
    element.attrs.iter_mut().for_each(|attr| attr.place = place.clone());
    element.children.iter_mut().for_each(|child| settle(child, place));
}

/// Sets an attribute of an element. A new one gets the element's place.
pub(super) fn set(element: &mut Element, attribute: &str, value: AttrValue) {
    let place = element.place.clone();
    match element.attrs.iter_mut().find(|attr| attr.name == attribute) {
        Some(attr) => *attr = Attr { value: value.0, place, ..attr.clone() },
        None => element.attrs.push(Attr { name: attribute.to_owned(), value: value.0, place }),
    }
}

/// Defines a part: a type around a draft, with `set` and the methods given.
macro_rules! part {
    ($(#[$meta:meta])* $name:ident: $kind:ident in $owner:ident { $($methods:tt)* }) => {
        $(#[$meta])*
        #[derive(Clone, Debug)]
        pub struct $name($crate::mjcf::spec::part::Draft);

        impl $name {
            $($methods)*

            /// Sets any attribute by its MJCF name. [`ModelSpec`](super::ModelSpec) checks the name when it takes the part.
            pub fn set(self, attribute: &str, value: impl Into<AttrValue>) -> Self {
                $name(self.0.with(attribute, value))
            }
        }

        impl $crate::mjcf::spec::part::Sealed for $name {
            const KIND: Kind = Kind::$kind;

            fn into_draft(self) -> $crate::mjcf::spec::part::Draft {
                self.0
            }
        }

        impl $crate::mjcf::spec::part::Part for $name {}

        impl $crate::mjcf::spec::part::$owner for $name {}
    };
}
pub(super) use part;
