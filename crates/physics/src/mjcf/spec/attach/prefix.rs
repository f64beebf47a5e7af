//! Copies under other names.

use super::super::super::asset;
use super::super::super::defaults::MAIN;
use super::super::super::document::{Attr, Element};
use super::super::kind::Kind;
use super::super::library::classes::Classes;
use super::super::part::set;
use super::super::references;

/// Attributes that name an asset.
const ASSETS: [&str; 4] = ["material", "texture", "hfield", "mesh"];

/// How names change.
pub(super) struct Prefix<'a> {
    pub prefix: &'a str,
    /// New names of the other model's classes; nothing if a part of the model itself is copied, which keeps classes and assets.
    pub classes: Option<&'a Classes>,
}

impl Prefix<'_> {
    /// Name of a default class in the enclosing model; nothing stands for the outermost one.
    pub fn class(&self, class: Option<&str>) -> String {
        let class = class.unwrap_or(MAIN);
        match self.classes {
            // a class that does not exist is found later
            Some(classes) => classes.get(class).cloned().unwrap_or_else(|| self.with(class)),
            None => class.to_owned(),
        }
    }

    /// Renames a part of a body and all that it holds.
    pub fn part(&self, part: &mut Element) {
        self.own(part);
        part.keys.retain(|numbers| !numbers.own);
        let targets: Vec<usize> =
            (0..part.attrs.len()).filter(|i| references::target(part, &part.attrs[*i]) == Some(Kind::Body)).collect();
        targets.into_iter().for_each(|i| self.put(&mut part.attrs[i]));
        part.children.iter_mut().for_each(|child| self.part(child));
    }

    /// Renames a `<default>` section and what is in it.
    pub fn default(&self, section: &mut Element) {
        let class = self.class(section.text("class").filter(|class| !class.is_empty()));
        set(section, "class", class.into());
        for child in &mut section.children {
            match child.name.as_str() {
                "default" => self.default(child),
                _ => self.assets(child),
            }
        }
    }

    /// Renames an asset, number or text, and gives it its class.
    pub fn asset(&self, asset: &mut Element) {
        let name = match asset.name.as_str() {
            "mesh" | "hfield" | "texture" => asset::given_name(asset).map(str::to_owned),
            _ => asset.text("name").map(str::to_owned),
        };
        if let Some(name) = name.filter(|name| !name.is_empty()) {
            set(asset, "name", name.into());
        }
        if matches!(asset.name.as_str(), "mesh" | "material") {
            self.give_class(asset);
        }
        self.own(asset);
        asset.children.iter_mut().for_each(|child| self.assets(child));
    }

    /// Renames an element of another section, whose references are changed already, and gives it its class.
    pub fn follower(&self, section: &str, element: &mut Element) {
        element.keys.retain(|numbers| !numbers.own);
        let has_class = matches!(section, "tendon" | "equality" | "actuator") || element.name == "pair";
        if has_class && self.classes.is_some() {
            self.give_class(element);
        }
        self.own(element);
    }

    /// Names the outermost class if an element names none.
    fn give_class(&self, element: &mut Element) {
        if element.text("class").is_none_or(str::is_empty) {
            set(element, "class", MAIN.into());
        }
    }

    /// Changes the element's name, its classes and its assets.
    fn own(&self, element: &mut Element) {
        for attr in &mut element.attrs {
            match attr.name.as_str() {
                "name" => self.put(attr),
                "class" | "childclass" if !attr.value.is_empty() => attr.value = self.class(Some(&attr.value)),
                _ => {}
            }
        }
        self.assets(element);
    }

    fn assets(&self, element: &mut Element) {
        let attrs = element.attrs.iter_mut().filter(|attr| ASSETS.contains(&attr.name.as_str()));
        attrs.filter(|_| self.classes.is_some()).for_each(|attr| self.put(attr));
    }

    fn put(&self, attr: &mut Attr) {
        if !attr.value.is_empty() {
            attr.value = self.with(&attr.value);
        }
    }

    fn with(&self, name: &str) -> String {
        format!("{}{name}", self.prefix)
    }
}
