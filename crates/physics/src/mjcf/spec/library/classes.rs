//! Names of the default classes of attached models.

use super::super::super::defaults::MAIN;
use super::super::super::document::Element;
use super::super::default_classes;
use super::child::Child;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// New names of a model's classes, by their own ones.
pub(in super::super) type Classes = BTreeMap<String, String>;

/// Names of all classes of a document, and those that attached models got.
pub(in super::super) struct ClassNames {
    taken: BTreeSet<String>,
    /// By file and prefix: a model that is attached again has its classes already.
    given: BTreeMap<(String, String), Rc<Classes>>,
}

impl ClassNames {
    /// Names of the classes of a document without attached models.
    pub fn of(root: &Element) -> ClassNames {
        ClassNames { taken: names(root).into_iter().chain([MAIN]).map(str::to_owned).collect(), given: BTreeMap::new() }
    }

    /// Names for the classes of a model that is attached with a prefix, and whether they are new.
    pub(in super::super) fn map(&mut self, child: &Child, prefix: &str) -> (Rc<Classes>, bool) {
        let key = (child.file.clone(), prefix.to_owned());
        if let Some(classes) = self.given.get(&key) {
            return (classes.clone(), false);
        }
        let mut classes = Classes::new();
        for name in names(&child.root).into_iter().chain([MAIN]) {
            if classes.contains_key(name) {
                continue;
            }
            let mut new = format!("{prefix}{name}");
            // MuJoCo lets classes share a name
            while !self.taken.insert(new.clone()) {
                new.push('_');
            }
            classes.insert(name.to_owned(), new);
        }
        let classes = Rc::new(classes);
        self.given.insert(key, classes.clone());
        (classes, true)
    }
}

fn names(root: &Element) -> Vec<&str> {
    root.children.iter().filter(|section| section.name == "default").flat_map(class_names).collect()
}

/// Names of a `<default>` element's class and of those in it.
pub(in super::super) fn class_names(section: &Element) -> Vec<&str> {
    let mut classes = Vec::new();
    default_classes(section, &mut Vec::new(), &mut classes);
    classes.into_iter().map(|(name, _)| name).collect()
}
