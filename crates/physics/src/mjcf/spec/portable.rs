//! A document whose attached parts have the compiler settings and default classes of the whole model, to be written.
//!
//! All values keep their bits: angles become radians, files are named from the model's folder, and the model's own settings of its
//! outermost class move to a class of their own. Only settings that give masses cannot be written: bodies with other ones
//! get an attribute that readers refuse.

use super::super::compiler::Settings;
use super::super::defaults::{Defaults, MAIN};
use super::super::document::Element;
use super::super::error::MjcfError;
use super::super::limit::is_limited;
use super::super::orientation::euler_product;
use super::super::room::Room;
use super::super::schema::OTHER_MASS;
use super::super::value::Attrs;
use super::last_section;
use super::library::classes::class_names;
use super::part::{Draft, set};
use std::borrow::Cow;

/// Elements of bodies that have default classes.
const WITH_CLASS: [&str; 5] = ["joint", "geom", "site", "camera", "light"];

/// The document for the writer.
pub(super) fn portable(root: &Element) -> Cow<'_, Element> {
    let mut attached = Vec::new();
    collect(root, &mut attached);
    if attached.is_empty() {
        return Cow::Borrowed(root);
    }
    let mut out = root.clone();
    let room = Room::default();
    // a document with errors is written as it is, and its readers find the errors
    if let (Ok(own), Ok(defaults)) = (Settings::read(root), Defaults::read(root, &room)) {
        let moved =
            out.children.iter().flat_map(|section| &section.children).any(|e| is_file(e) && e.settings.is_some());
        let radians = attached.iter().any(|s| s.degree != own.degree);
        let autolimits = attached.iter().any(|s| s.autolimits);
        let rewrite = Rewrite { own: &own, defaults: &defaults, moved, radians };
        for section in &mut out.children {
            let name = section.name.clone();
            rewrite.element(section, &name, None);
        }
        rewrite.compilers(&mut out, autolimits);
    }
    join_classes(&mut out);
    Cow::Owned(out)
}

/// Settings of all attached parts.
fn collect<'e>(element: &'e Element, out: &mut Vec<&'e Settings>) {
    let settings = element.settings.as_deref();
    out.extend(settings.filter(|settings| !out.iter().any(|other| std::ptr::eq(*other, *settings))));
    element.children.iter().for_each(|child| collect(child, out));
}

fn is_file(element: &Element) -> bool {
    matches!(element.name.as_str(), "mesh" | "hfield") && element.text("file").is_some_and(|file| !file.is_empty())
}

struct Rewrite<'a> {
    own: &'a Settings,
    defaults: &'a Defaults<'a>,
    /// Files are named from the model's folder.
    moved: bool,
    /// Angles are written in radians.
    radians: bool,
}

impl Rewrite<'_> {
    /// Rewrites an element and all that it holds. `class`: default class of parts that name none.
    fn element(&self, element: &mut Element, section: &str, class: Option<&str>) {
        let class = element.text("childclass").filter(|class| !class.is_empty()).or(class).map(str::to_owned);
        let settings = element.settings.clone();
        let settings = settings.as_deref().unwrap_or(self.own);
        if let Ok(values) = self.values(element, settings, section, class.as_deref()) {
            values.into_iter().for_each(|(name, value)| set(element, name, value.as_str().into()));
        }
        if self.moved && is_file(element) {
            let name = super::super::asset::given_name(element).map(str::to_owned);
            let path = element.text("file").map(|file| settings.asset_path(file));
            name.into_iter().for_each(|name| set(element, "name", name.into()));
            path.into_iter().for_each(|path| set(element, "file", path.into()));
        }
        if element.name == "body" && !settings.gives_masses_like(self.own) {
            set(element, OTHER_MASS, "other".into());
        }
        element.children.iter_mut().for_each(|child| self.element(child, section, class.as_deref()));
    }

    /// The element's angles in the settings of the whole model.
    fn values(
        &self,
        element: &mut Element,
        settings: &Settings,
        section: &str,
        class: Option<&str>,
    ) -> Result<Vec<(&'static str, String)>, MjcfError> {
        let mut values = Vec::new();
        let text = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let plain = Attrs::plain(element);
        let angle = |x: f64| if self.radians { settings.angle(x) } else { x };
        if let Some([x, y, z, turn]) = plain.array("axisangle")? {
            values.push(("axisangle", text(&[x, y, z, angle(turn)])));
        }
        let euler: Option<[f64; 3]> = plain.array("euler")?;
        if let Some(angles) = euler.filter(|_| settings.eulerseq == self.own.eulerseq) {
            values.push(("euler", text(&angles.map(angle))));
        }
        let turned = euler.filter(|_| settings.eulerseq != self.own.eulerseq);
        // the class of an attached joint may belong to joints of other types, whose numbers are not angles
        if element.name == "joint" && self.radians && section == "worldbody" {
            let attrs = self.defaults.attrs(element, class)?;
            let kind = attrs.text("type").unwrap_or("hinge");
            let range = attrs.array_or("range", [0.0; 2])?;
            if matches!(kind, "hinge" | "ball") && is_limited(&attrs, "limited", range)? {
                values.push(("range", text(&range.map(angle))));
            }
            for name in ["ref", "springref"].into_iter().filter(|_| kind == "hinge") {
                values.extend(attrs.array::<1>(name)?.map(|value| (name, text(&value.map(angle)))));
            }
        }
        if let Some(angles) = turned {
            element.attrs.retain(|attr| attr.name != "euler");
            values.push(("quat", text(&euler_product(angles, settings))));
        }
        Ok(values)
    }

    fn compilers(&self, out: &mut Element, autolimits: bool) {
        let mut textures = None;
        for compiler in out.children.iter_mut().filter(|section| section.name == "compiler" && self.moved) {
            let folder = ["assetdir", "texturedir"].into_iter().rev().find_map(|name| compiler.text(name));
            textures = folder.map(str::to_owned).or(textures);
            compiler.attrs.retain(|attr| !["assetdir", "meshdir", "texturedir", "strippath"].contains(&&*attr.name));
        }
        let last = last_section(out, "compiler");
        let compiler = &mut out.children[last];
        if self.radians {
            set(compiler, "angle", "radian".into());
        }
        if autolimits && !self.own.autolimits {
            set(compiler, "autolimits", "true".into());
        }
        textures.into_iter().for_each(|folder| set(compiler, "texturedir", folder.into()));
    }
}

/// Puts the outermost classes of attached models into that of the model, which gives up its settings.
fn join_classes(root: &mut Element) {
    let (attached, own): (Vec<Element>, Vec<Element>) =
        root.children.extract_if(.., |section| section.name == "default").partition(|s| s.settings.is_some());
    let mut outermost = Draft::new("default").placed(&root.place);
    let sets_something = |section: &Element| section.children.iter().any(|child| child.name != "default");
    if !attached.is_empty() && own.iter().any(sets_something) {
        let mut name = "own".to_owned();
        while attached.iter().chain(&own).flat_map(class_names).any(|taken| taken == name) {
            name.push('_');
        }
        let mut class = Draft::new("default").with("class", name.as_str()).placed(&root.place);
        own.into_iter().for_each(|section| merge(&mut class, section));
        outermost.children.push(class);
        root.children.iter_mut().for_each(|section| move_section(section, &name));
    } else {
        own.into_iter().for_each(|section| merge(&mut outermost, section));
    }
    for section in attached {
        match outermost.children.iter_mut().find(|class| class.text("class") == section.text("class")) {
            Some(class) => merge(class, section),
            None => outermost.children.push(section),
        }
    }
    root.children.insert(0, outermost);
}

/// Lays what a class sets in a section over what it sets before.
fn merge(class: &mut Element, section: Element) {
    for new in section.children {
        match class.children.iter_mut().find(|old| old.name == new.name && new.name != "default") {
            Some(old) => new.attrs.iter().for_each(|attr| {
                // a short list replaces the beginning of a longer one
                let count = attr.value.split_ascii_whitespace().count();
                let rest = old.text(&attr.name).unwrap_or_default().split_ascii_whitespace().skip(count);
                let value = attr.value.split_ascii_whitespace().chain(rest).collect::<Vec<_>>().join(" ");
                set(old, &attr.name, value.into());
            }),
            None => class.children.push(new),
        }
    }
}

/// Gives the elements of a section that name no class, or the outermost one, the class that has its settings now.
fn move_section(section: &mut Element, class: &str) {
    let has_class = |element: &Element| match section.name.as_str() {
        "tendon" | "equality" | "actuator" => true,
        _ => matches!(element.name.as_str(), "pair" | "mesh" | "material"),
    };
    if section.name == "worldbody" {
        section.children.iter_mut().for_each(|part| move_part(part, class, true));
        return;
    }
    let own: Vec<bool> = section.children.iter().map(|e| e.settings.is_none() && has_class(e)).collect();
    let elements = section.children.iter_mut().zip(own).filter(|(_, own)| *own);
    elements.for_each(|(element, _)| rename(element, "class", class, true));
}

/// The same for a part of a body. `outside`: no part around it names a class.
fn move_part(part: &mut Element, class: &str, outside: bool) {
    let holds_parts = matches!(part.name.as_str(), "body" | "frame");
    if part.settings.is_none() && holds_parts {
        rename(part, "childclass", class, outside);
    } else if part.settings.is_none() && WITH_CLASS.contains(&part.name.as_str()) {
        rename(part, "class", class, outside);
    }
    part.children.iter_mut().for_each(|child| move_part(child, class, outside && !holds_parts));
}

fn rename(element: &mut Element, attribute: &str, class: &str, absent: bool) {
    match element.text(attribute).filter(|class| !class.is_empty()) {
        Some(MAIN) => set(element, attribute, class.into()),
        None if absent => set(element, attribute, class.into()),
        _ => {}
    }
}
