//! Ways through the document, and the search for elements by kind.

use super::super::document::Element;
use super::kind::Kind;

/// The way from the root to an element: which child at each step.
pub(super) type Path = Vec<usize>;

/// The element at a path.
pub(super) fn at<'e>(root: &'e Element, path: &[usize]) -> &'e Element {
    path.iter().fold(root, |element, step| &element.children[*step])
}

/// The element at a path, to change it.
pub(super) fn at_mut<'e>(root: &'e mut Element, path: &[usize]) -> &'e mut Element {
    path.iter().fold(root, |element, step| &mut element.children[*step])
}

/// Shows every element that has a kind to `visit`, in document order, until that returns something.
pub(super) fn search<'e, T>(
    root: &'e Element,
    mut visit: impl FnMut(Kind, &'e Element, &[usize]) -> Option<T>,
) -> Option<T> {
    let mut path = Path::new();
    root.children.iter().enumerate().find_map(|(i, section)| {
        path.push(i);
        let found = below(section, &section.name, &mut path, &mut visit);
        path.pop();
        found
    })
}

fn below<'e, T>(
    parent: &'e Element,
    section: &str,
    path: &mut Path,
    visit: &mut impl FnMut(Kind, &'e Element, &[usize]) -> Option<T>,
) -> Option<T> {
    parent.children.iter().enumerate().find_map(|(i, child)| {
        path.push(i);
        let found = Kind::of(section, &child.name).and_then(|kind| visit(kind, child, path));
        let holds_more = section == "worldbody" && matches!(child.name.as_str(), "body" | "frame");
        let found = match found {
            None if holds_more => below(child, section, path, visit),
            found => found,
        };
        path.pop();
        found
    })
}

/// The way to the element of a kind that has a name.
pub(super) fn named(root: &Element, wanted: Kind, name: &str) -> Option<Path> {
    search(root, |kind, element, path| (kind == wanted && wanted.name(element) == Some(name)).then(|| path.to_vec()))
}

/// All names of a kind.
pub(super) fn names(root: &Element, wanted: Kind) -> Vec<&str> {
    let mut names = Vec::new();
    search(root, |kind, element, _| {
        names.extend(wanted.name(element).filter(|_| kind == wanted));
        None::<()>
    });
    names
}
