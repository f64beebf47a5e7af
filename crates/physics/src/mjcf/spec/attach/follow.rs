//! Which elements of other sections follow an attached part.

use super::super::super::document::Element;
use super::super::kind::Kind;
use super::super::references::{self, Gone};
use super::is_world;

/// A copy of an element whose references have the prefix, or nothing if what they name is not there.
pub(super) fn copy(section: &str, element: &Element, known: &Gone, prefix: &str) -> Option<Element> {
    let mut copy = element.clone();
    let follows = match section {
        "contact" | "sensor" => any(&mut copy, known, prefix)?,
        "tendon" => wraps(&mut copy, known, prefix)?,
        _ => all(&mut copy, known, prefix)?,
    };
    // sensors of nothing, such as a clock, come with every model
    (follows || section == "sensor").then_some(copy)
}

/// Kinds of elements that an attribute may name.
fn kinds(element: &Element, index: usize) -> Option<[Kind; 2]> {
    let attr = element.attrs.get(index).filter(|attr| !attr.value.is_empty())?;
    let kind = references::target(element, attr)?;
    // a touch sensor may name a geom
    Some([kind, if element.name == "touch" && kind == Kind::Site { Kind::Geom } else { kind }])
}

fn exists(known: &Gone, kinds: [Kind; 2], name: &str) -> bool {
    kinds.into_iter().any(|kind| known.contains(&(kind, name.to_owned())))
}

/// Changes the references that exist with the prefix. The others must exist as they are. Returns whether there are any.
fn any(element: &mut Element, known: &Gone, prefix: &str) -> Option<bool> {
    let (mut changed, mut kept) = (false, false);
    for i in 0..element.attrs.len() {
        let Some(kinds) = kinds(element, i) else { continue };
        let value = &mut element.attrs[i].value;
        let new = format!("{prefix}{value}");
        if exists(known, kinds, &new) {
            *value = new;
            changed = true;
        } else if exists(known, kinds, value) {
            kept = true;
        } else {
            return None;
        }
    }
    (changed || !kept).then_some(changed)
}

/// The same for the parts of a tendon's path. Both names of a part change, or none.
fn wraps(tendon: &mut Element, known: &Gone, prefix: &str) -> Option<bool> {
    let mut changed = false;
    for wrap in &mut tendon.children {
        let mut new = wrap.clone();
        if let Some(any) = all(&mut new, known, prefix) {
            *wrap = new;
            changed |= any;
        } else {
            all(wrap, known, "")?;
        }
    }
    changed.then_some(true)
}

/// Changes all references, which must exist with the prefix. The world keeps its name. Returns whether there are any.
fn all(element: &mut Element, known: &Gone, prefix: &str) -> Option<bool> {
    let mut any = false;
    for i in 0..element.attrs.len() {
        let Some(kinds) = kinds(element, i) else { continue };
        any = true;
        let value = &mut element.attrs[i].value;
        if is_world(kinds[0], value) {
            continue;
        }
        let new = format!("{prefix}{value}");
        if !exists(known, kinds, &new) {
            return None;
        }
        *value = new;
    }
    for child in &mut element.children {
        any |= all(child, known, prefix)?;
    }
    Some(any)
}
