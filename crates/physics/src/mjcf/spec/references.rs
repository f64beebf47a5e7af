//! References between elements: attributes that hold the name of another element.

use super::super::document::{Attr, Element};
use super::kind::{Kind, WORLD};
use super::walk::{self, Path};
use std::collections::BTreeSet;

/// Sections whose elements refer to others.
const SECTIONS: [&str; 7] = ["worldbody", "contact", "tendon", "equality", "actuator", "sensor", "custom"];

/// Names of elements that are no longer there.
pub(super) type Gone = BTreeSet<(Kind, String)>;

/// The kind of element that an attribute names.
pub(super) fn target(element: &Element, attr: &Attr) -> Option<Kind> {
    let by_type = |attribute: &str| match element.text(attribute)? {
        "body" | "xbody" => Some(Kind::Body),
        "joint" => Some(Kind::Joint),
        "geom" => Some(Kind::Geom),
        "site" => Some(Kind::Site),
        "camera" => Some(Kind::Camera),
        "light" => Some(Kind::Light),
        "hfield" => Some(Kind::HField),
        "mesh" => Some(Kind::Mesh),
        "tendon" => Some(Kind::Tendon),
        "equality" => Some(Kind::Equality),
        "pair" => Some(Kind::ContactPair),
        "exclude" => Some(Kind::ContactExclude),
        "actuator" => Some(Kind::Actuator),
        "sensor" => Some(Kind::Sensor),
        "key" => Some(Kind::Keyframe),
        _ => None,
    };
    match attr.name.as_str() {
        "body" | "body1" | "body2" | "subtree1" | "subtree2" | "target" => Some(Kind::Body),
        "joint" | "joint1" | "joint2" | "jointinparent" => Some(Kind::Joint),
        "geom" | "geom1" | "geom2" => Some(Kind::Geom),
        "site" | "site1" | "site2" | "sidesite" | "refsite" | "slidersite" | "cranksite" => Some(Kind::Site),
        "camera" => Some(Kind::Camera),
        "hfield" => Some(Kind::HField),
        "mesh" => Some(Kind::Mesh),
        "tendon" | "tendon1" | "tendon2" => Some(Kind::Tendon),
        "actuator" => Some(Kind::Actuator),
        "objname" => by_type("objtype"),
        "refname" => by_type("reftype"),
        _ => None,
    }
}

/// Whether an attribute names an element of this kind. `site_exists`: there is a site of the name that it holds.
fn names_a(kind: Kind, element: &Element, attr: &Attr, site_exists: impl Fn() -> bool) -> bool {
    // a touch sensor may name a geom where there is no such site
    let by_geom = || kind == Kind::Geom && element.name == "touch" && attr.name == "site" && !site_exists();
    target(element, attr) == Some(kind) || by_geom()
}

/// Names of an element and of all that it holds.
pub(super) fn names_within(root: &Element, path: &[usize]) -> Gone {
    let mut names = Gone::new();
    walk::search(root, |kind, element, at| {
        if at.starts_with(path) {
            names.extend(kind.name(element).map(|name| (kind, name.to_owned())));
        }
        None::<()>
    });
    names
}

/// The way to the first element that refers to one of those.
pub(super) fn first_to(root: &Element, gone: &Gone) -> Option<Path> {
    walk::search(root, |_, element, path| refers(root, element, gone).then(|| path.to_vec()))
}

fn refers(root: &Element, element: &Element, gone: &Gone) -> bool {
    let hits = |attr: &Attr| {
        let site_exists = || walk::named(root, Kind::Site, &attr.value).is_some();
        gone.iter().any(|(kind, name)| *name == attr.value && names_a(*kind, element, attr, site_exists))
    };
    let holds_others = matches!(element.name.as_str(), "body" | "frame");
    element.attrs.iter().any(hits) || (!holds_others && element.children.iter().any(|part| refers(root, part, gone)))
}

/// Takes the references to those out of the tuples, and returns what went.
pub(super) fn leave_tuples(root: &mut Element, gone: &Gone) -> Vec<String> {
    let mut labels = Vec::new();
    for section in root.children.iter_mut().filter(|section| section.name == "custom") {
        for tuple in &mut section.children {
            let refers = |part: &Element| {
                let (kind, name) = (part.attr("objname").and_then(|attr| target(part, attr)), part.text("objname"));
                kind.zip(name).is_some_and(|(kind, name)| gone.contains(&(kind, name.to_owned())))
            };
            labels.extend(tuple.children.iter().filter(|part| refers(part)).map(Element::label));
            tuple.children.retain(|part| !refers(part));
        }
    }
    labels
}

/// Whether an element refers to one of those names.
pub(super) fn is_any_to(element: &Element, names: &Gone) -> bool {
    element.attrs.iter().any(|attr| is_one_of(names, element, attr))
        || element.children.iter().any(|part| is_any_to(part, names))
}

/// Whether an element refers to anything.
pub(super) fn are_any(element: &Element) -> bool {
    element.attrs.iter().any(|attr| target(element, attr).is_some()) || element.children.iter().any(are_any)
}

/// Whether an element refers to those names, and to nothing else but the world.
pub(super) fn are_all_to(element: &Element, names: &Gone) -> bool {
    let mut any = false;
    all_to(element, names, &mut any) && any
}

fn all_to(element: &Element, names: &Gone, any: &mut bool) -> bool {
    element.attrs.iter().all(|attr| {
        let Some(kind) = target(element, attr) else { return true };
        let hit = is_one_of(names, element, attr);
        *any |= hit;
        hit || (kind == Kind::Body && attr.value == WORLD)
    }) && element.children.iter().all(|part| all_to(part, names, any))
}

fn is_one_of(names: &Gone, element: &Element, attr: &Attr) -> bool {
    let known = |kind: Kind| names.contains(&(kind, attr.value.clone()));
    target(element, attr).is_some_and(known) || (element.name == "touch" && attr.name == "site" && known(Kind::Geom))
}

/// A copy of an element. Its names, and its references to those names, end with `suffix`.
pub(super) fn numbered(element: &Element, names: &Gone, suffix: &str) -> Element {
    let mut copy = element.clone();
    number(&mut copy, names, suffix);
    copy
}

fn number(element: &mut Element, names: &Gone, suffix: &str) {
    let renamed: Vec<usize> = (0..element.attrs.len())
        .filter(|i| {
            let attr = &element.attrs[*i];
            (attr.name == "name" && !attr.value.is_empty()) || is_one_of(names, element, attr)
        })
        .collect();
    renamed.into_iter().for_each(|i| element.attrs[i].value.push_str(suffix));
    element.children.iter_mut().for_each(|part| number(part, names, suffix));
}

/// Changes all references to an element whose name changes.
pub(super) fn rename(root: &mut Element, kind: Kind, old: &str, new: &str) {
    let site_exists = walk::named(root, Kind::Site, old).is_some();
    for section in root.children.iter_mut().filter(|section| SECTIONS.contains(&section.name.as_str())) {
        rename_in(section, kind, old, new, site_exists);
    }
}

fn rename_in(element: &mut Element, kind: Kind, old: &str, new: &str, site_exists: bool) {
    let found: Vec<usize> = (0..element.attrs.len())
        .filter(|i| {
            let attr = &element.attrs[*i];
            attr.value == old && names_a(kind, element, attr, || site_exists)
        })
        .collect();
    for i in found {
        element.attrs[i].value = new.to_owned();
    }
    element.children.iter_mut().for_each(|child| rename_in(child, kind, old, new, site_exists));
}
