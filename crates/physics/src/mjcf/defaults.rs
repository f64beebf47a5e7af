//! `<default>` classes: which settings lie under an element of a given class.

use super::document::Element;
use super::error::{MjcfError, MjcfErrorKind, shorten};
use super::room::Room;
use super::schema::check_inherited;
use super::value::Attrs;
use crate::hint::nearest;
use std::collections::{BTreeMap, BTreeSet};

/// Name of the outermost class.
pub(crate) const MAIN: &str = "main";

/// Actuator elements; a class has one actuator default, which each of them modifies.
pub(crate) const ACTUATORS: [&str; 13] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "orientation",
    "pid",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
    "plugin",
];

/// Kind of element under which defaults are kept.
fn kind(name: &str) -> &str {
    match name {
        "spatial" | "fixed" => "tendon",
        name if ACTUATORS.contains(&name) => "actuator",
        name => name,
    }
}

/// Elements that set the defaults of a class, by kind, outermost class first.
#[derive(Clone, Default)]
struct Class<'a> {
    layers: BTreeMap<&'a str, Vec<&'a Element>>,
    /// Number of actuator elements up to the end of each enclosing class, this one last.
    actuator_ends: Vec<usize>,
}

impl Class<'_> {
    /// Size of a copy, bytes.
    fn size(&self) -> usize {
        300 + self.layers.values().map(|elements| 100 + 8 * elements.len()).sum::<usize>()
    }
}

/// Limit on the nesting of classes. Every element reads its attributes through all of them.
const MAX_CLASSES: usize = 50;
/// Limit on the elements of one kind that set a class's defaults, including those of the enclosing classes.
const MAX_LAYERS: usize = 200;

/// All default classes of a model.
pub(crate) struct Defaults<'a> {
    classes: BTreeMap<&'a str, Class<'a>>,
    room: &'a Room,
}

impl<'a> Defaults<'a> {
    /// Reads every `<default>` section of the model.
    pub fn read(root: &'a Element, room: &'a Room) -> Result<Self, MjcfError> {
        let mut defaults = Defaults { classes: BTreeMap::from([(MAIN, Class::default())]), room };
        for section in root.children.iter().filter(|e| e.name == "default") {
            let name = section.text("class").filter(|class| !class.is_empty()).unwrap_or(MAIN);
            // an attached model has an outermost class of its own
            if name != MAIN && section.settings.is_none() {
                let message = format!(
                    "the outermost default class is '{}'; expected no 'class', or '{MAIN}', as in MuJoCo",
                    shorten(name)
                );
                return Err(section.invalid(message));
            }
            defaults.section(section, name)?;
        }
        Ok(defaults)
    }

    fn section(&mut self, section: &'a Element, name: &'a str) -> Result<(), MjcfError> {
        let mut class = self.classes.remove(name).unwrap_or_default();
        let settings = section.children.iter().filter(|e| e.name != "default");
        let mut seen = BTreeSet::new();
        for element in settings {
            if !seen.insert(element.name.as_str()) {
                let message = format!("there is already a <{}> in this class", shorten(&element.name));
                return Err(element.invalid(message));
            }
            let layers = class.layers.entry(kind(&element.name)).or_default();
            layers.push(element);
            if layers.len() > MAX_LAYERS {
                let message = format!("more than {MAX_LAYERS} of these set the defaults of one class");
                return Err(element.invalid(message));
            }
        }
        let actuators = class.layers.get("actuator").map_or(0, Vec::len);
        match class.actuator_ends.last_mut() {
            Some(end) => *end = actuators,
            None => class.actuator_ends.push(actuators),
        }
        // a nested class starts as a copy of its parent, complete as of the end of the parent's element
        self.classes.insert(name, class.clone());
        for nested in section.children.iter().filter(|e| e.name == "default") {
            let Some(name) = nested.text("class").filter(|c| !c.is_empty()) else {
                return Err(nested.invalid("a nested default needs the attribute 'class'"));
            };
            if self.classes.contains_key(name) {
                return Err(nested.invalid(format!("the default class '{}' is already defined", shorten(name))));
            }
            if class.actuator_ends.len() >= MAX_CLASSES {
                return Err(nested.invalid(format!("default classes are nested more than {MAX_CLASSES} deep")));
            }
            // one copy for the class, one while it is read
            self.room.take_for(nested, 2, class.size())?;
            let mut inner = class.clone();
            inner.actuator_ends.push(actuators);
            self.classes.insert(name, inner);
            self.section(nested, name)?;
        }
        Ok(())
    }

    /// Checks that the class that `element` names in `attribute` exists, and returns it.
    pub fn named<'e>(&self, element: &'e Element, attribute: &str) -> Result<Option<&'e str>, MjcfError> {
        let Some(attr) = element.attr(attribute).filter(|a| !a.value.is_empty()) else { return Ok(None) };
        if self.classes.contains_key(attr.value.as_str()) {
            return Ok(Some(&attr.value));
        }
        Err(attr.place.error(MjcfErrorKind::UnknownName {
            element: element.label(),
            attribute: attribute.to_owned(),
            kind: "default class".to_owned(),
            found: shorten(&attr.value),
            nearest: nearest(&attr.value, self.classes.keys().copied()).map(Into::into),
        }))
    }

    /// The element's attributes over those of its class, else of `childclass`, else of the outermost class.
    pub fn attrs<'d>(&'d self, element: &'d Element, childclass: Option<&str>) -> Result<Attrs<'d>, MjcfError>
    where
        'a: 'd,
    {
        let class = self.named(element, "class")?.or(childclass).unwrap_or(MAIN);
        let layers = self.classes.get(class).and_then(|c| c.layers.get(kind(&element.name)));
        let attrs = Attrs { element, defaults: layers.map_or(&[], Vec::as_slice) };
        // reading many layers takes time, so each layer counts as if it took memory
        self.room.take_for(element, attrs.defaults.len().saturating_sub(10), 100)?;
        check_inherited(&attrs)?;
        Ok(attrs)
    }

    /// The same for an element whose defaults are kept under a name of their own, such as `equality`.
    pub fn of_kind<'d>(&'d self, kind: &str, element: &'d Element) -> Result<Attrs<'d>, MjcfError>
    where
        'a: 'd,
    {
        let class = self.named(element, "class")?.unwrap_or(MAIN);
        let layers = self.classes.get(class).and_then(|c| c.layers.get(kind));
        Ok(Attrs { element, defaults: layers.map_or(&[], Vec::as_slice) })
    }

    /// Attributes of an actuator, and the number of its default elements up to the end of each class that encloses it.
    pub fn actuator<'d>(&'d self, element: &'d Element) -> Result<(Attrs<'d>, &'d [usize]), MjcfError>
    where
        'a: 'd,
    {
        let class = self.named(element, "class")?.unwrap_or(MAIN);
        let ends = self.classes.get(class).map_or(&[][..], |c| &c.actuator_ends);
        Ok((self.attrs(element, None)?, ends))
    }

    /// Every element that sets defaults, on top of the ones below it: for checks.
    pub fn all(&self) -> impl Iterator<Item = Attrs<'_>> {
        self.classes.values().flat_map(|class| class.layers.values()).filter_map(|layers| {
            let (element, defaults) = layers.split_last()?;
            Some(Attrs { element, defaults })
        })
    }
}
