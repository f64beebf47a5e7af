//! Expands `<replicate>` and `<attach>`: copies of bodies and frames, with what refers to them.
//!
//! The order is MuJoCo's: the world is read from its beginning to its end, and a copy holds what is there already.

use super::super::compiler::Settings;
use super::super::document::{Element, MAX_DEPTH};
use super::super::error::MjcfError;
use super::kind::{Kind, WORLD};
use super::library::Library;
use super::library::classes::ClassNames;
use super::library::keys::Key;
use super::references::Gone;
use super::walk::{self, Path};
use std::collections::BTreeMap;

/// Sections whose elements follow the parts that they refer to. Each refers to earlier ones only.
pub(super) const FOLLOWERS: [&str; 6] = ["contact", "tendon", "equality", "actuator", "sensor", "custom"];

/// Replaces every `<replicate>` and `<attach>` of a document by copies. `folder`: folder of its file, relative to the main
/// file. Returns the keyframes of attached models, whose numbers are in the elements.
pub(super) fn expand(root: &mut Element, folder: &str, library: &Library) -> Result<Vec<Key>, MjcfError> {
    let worlds = |root: &Element| -> Vec<usize> {
        (0..root.children.len()).filter(|i| root.children[*i].name == "worldbody").collect()
    };
    if !worlds(root).iter().any(|i| holds_copies(&root.children[*i])) {
        return Ok(Vec::new());
    }
    let mut known = Gone::from([(Kind::Body, WORLD.to_owned())]);
    for section in root.children.iter().filter(|section| section.name != "worldbody") {
        known.extend(section.children.iter().filter_map(|element| named(&section.name, element)));
    }
    let settings = Settings::read(root)?;
    let classes = ClassNames::of(root);
    let mut expansion =
        Expansion { root, settings, folder, library, known, classes, sources: BTreeMap::new(), keys: Vec::new() };
    for i in worlds(expansion.root) {
        expansion.parts(&mut vec![i])?;
    }
    Ok(expansion.keys)
}

fn holds_copies(element: &Element) -> bool {
    let copies = |child: &Element| matches!(child.name.as_str(), "replicate" | "attach");
    element.children.iter().any(|child| copies(child) || holds_copies(child))
}

/// Kind and name of an element in a section.
pub(super) fn named(section: &str, element: &Element) -> Option<(Kind, String)> {
    let kind = Kind::of(section, &element.name)?;
    Some((kind, kind.name(element)?.to_owned()))
}

/// A document on the way to one without copies.
pub(super) struct Expansion<'a> {
    pub root: &'a mut Element,
    pub settings: Settings,
    pub folder: &'a str,
    pub library: &'a Library<'a>,
    /// Names that are in the document so far.
    pub known: Gone,
    pub classes: ClassNames,
    /// Models that were attached, by their names, with the numbers of keyframes that later copies of other parts get.
    pub sources: BTreeMap<String, Element>,
    pub keys: Vec<Key>,
}

impl Expansion<'_> {
    /// Expands the parts of a body, a frame or the world in place.
    fn parts(&mut self, path: &mut Path) -> Result<(), MjcfError> {
        let mut i = 0;
        while let Some(part) = walk::at(self.root, path).children.get(i) {
            self.known.extend(named("worldbody", part));
            let name = part.name.clone();
            if !part.children.is_empty() {
                path.push(i);
                self.parts(path)?;
                path.pop();
            }
            i += match name.as_str() {
                "replicate" => self.replicate(path, i)?,
                "attach" => self.attach(path, i)?,
                _ => 1,
            };
        }
        Ok(())
    }

    /// Adds the names of an element of a body and of all that it holds.
    pub fn collect(&self, element: &Element, names: &mut Gone) -> Result<(), MjcfError> {
        self.library.look(element, 1)?;
        names.extend(named("worldbody", element));
        element.children.iter().try_for_each(|child| self.collect(child, names))
    }

    /// Index of the last section of a name. The model gets one if it has none.
    pub fn section(&mut self, name: &str) -> usize {
        super::last_section(self.root, name)
    }

    /// Checks that parts can stand at a depth.
    pub fn check_depth(&self, element: &Element, above: usize) -> Result<(), MjcfError> {
        if above >= MAX_DEPTH {
            return Err(element.invalid(format!("elements are nested more than {MAX_DEPTH} deep")));
        }
        element.children.iter().try_for_each(|child| self.check_depth(child, above + 1))
    }
}
