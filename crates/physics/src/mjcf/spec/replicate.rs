//! Expands `<replicate>`: copies of what it holds, in frames along a path, with numbered names.
//!
//! The rules are MuJoCo's. Names in a copy get `sep` and the copy's number. Elements of other sections may refer to things in
//! the `<replicate>`. They are copied, too, behind the other elements of their section. Constraints and actuators must refer to nothing
//! else but the world; MuJoCo leaves out those that do.

use super::super::document::Element;
use super::super::error::MjcfError;
use super::super::math::{add, rotate, scale};
use super::super::orientation::from_euler;
use super::super::room::Room;
use super::super::schema;
use super::super::settings::Settings;
use super::super::value::Attrs;
use super::kind::Kind;
use super::part::{Draft, set};
use super::references::{self, Gone};

/// Sections whose elements are copied. Each refers to earlier ones only.
const FOLLOWERS: [&str; 6] = ["contact", "tendon", "equality", "actuator", "sensor", "custom"];
/// Those whose elements may refer to other things as well.
const MIXED: [&str; 3] = ["contact", "tendon", "sensor"];
/// Parts of a body that cannot stand in a frame.
const NOT_IN_FRAMES: [&str; 3] = ["joint", "freejoint", "inertial"];
/// Elements that may be looked at; bounds the time that nested copies take.
const MOST_LOOKS: usize = 20_000_000;

/// Replaces every `<replicate>` of a document by its copies.
pub(super) fn expand(root: &mut Element, room: &Room) -> Result<(), MjcfError> {
    let is_world = |section: &Element| section.name == "worldbody";
    if !root.children.iter().any(|section| is_world(section) && holds_one(section)) {
        return Ok(());
    }
    let mut expansion = Expansion { settings: Settings::read(root)?, sections: Vec::new(), room, looks: 0 };
    expansion.sections = std::mem::take(&mut root.children);
    for i in 0..expansion.sections.len() {
        if is_world(&expansion.sections[i]) {
            let world = std::mem::take(&mut expansion.sections[i].children);
            expansion.sections[i].children = expansion.expanded(world)?;
        }
    }
    root.children = expansion.sections;
    Ok(())
}

fn holds_one(element: &Element) -> bool {
    element.children.iter().any(|child| child.name == "replicate" || holds_one(child))
}

struct Expansion<'a> {
    settings: Settings,
    sections: Vec<Element>,
    room: &'a Room,
    looks: usize,
}

impl Expansion<'_> {
    /// Parts of a body after expansion, from the inside outward.
    fn expanded(&mut self, parts: Vec<Element>) -> Result<Vec<Element>, MjcfError> {
        let mut out = Vec::with_capacity(parts.len());
        for mut part in parts {
            let inside = std::mem::take(&mut part.children);
            part.children = self.expanded(inside)?;
            if part.name == "replicate" {
                out.extend(self.copies(&part)?);
            } else {
                out.push(part);
            }
        }
        Ok(out)
    }

    fn copies(&mut self, replicate: &Element) -> Result<Vec<Element>, MjcfError> {
        schema::check_replicate(replicate)?;
        let attrs = Attrs::plain(replicate);
        if !attrs.has("count") {
            return Err(replicate.invalid("the attribute 'count' is missing"));
        }
        let count = usize::try_from(attrs.integer_or("count", 0)?)
            .map_err(|_| replicate.invalid("'count' is negative; expected a number of copies"))?;
        let (offset, euler) = (attrs.array_or("offset", [0.0; 3])?, attrs.array_or("euler", [0.0; 3])?);
        if let Some(child) = replicate.children.iter().find(|child| NOT_IN_FRAMES.contains(&child.name.as_str())) {
            return Err(child.invalid("it cannot stand in a <replicate> itself; put it into a <body> there"));
        }
        let mut names = Gone::new();
        replicate.children.iter().try_for_each(|child| self.collect(child, &mut names))?;
        let (separator, digits) = (replicate.text("sep").unwrap_or_default(), count.to_string().len());
        let suffix = |i: usize| format!("{separator}{i:0digits$}");

        let mut copies = Vec::new();
        let mut pos = [0.0; 3];
        for i in 0..count {
            let turn = scale(euler, i as f64);
            let mut frame = Draft::new("frame").placed(&replicate.place);
            frame.attrs.extend(replicate.attr("childclass").cloned());
            set(&mut frame, "pos", pos.into());
            set(&mut frame, "euler", turn.into());
            self.room.take_document(&frame)?;
            for child in &replicate.children {
                self.room.take_document(child)?;
                frame.children.push(references::numbered(child, &names, &suffix(i)));
            }
            copies.push(frame);
            pos = add(pos, rotate(from_euler(turn, &self.settings), offset));
        }
        self.follow(replicate, names, &(0..count).map(suffix).collect::<Vec<_>>())?;
        Ok(copies)
    }

    /// Adds the names of an element of a body and of all that it holds.
    fn collect(&mut self, element: &Element, names: &mut Gone) -> Result<(), MjcfError> {
        self.look(element, 1)?;
        let kind = Kind::of("worldbody", &element.name);
        names.extend(kind.and_then(|kind| Some((kind, kind.name(element)?.to_owned()))));
        element.children.iter().try_for_each(|child| self.collect(child, names))
    }

    /// Copies the elements of other sections that refer to these names.
    fn follow(&mut self, replicate: &Element, mut names: Gone, suffixes: &[String]) -> Result<(), MjcfError> {
        if names.is_empty() {
            return Ok(());
        }
        for section in FOLLOWERS {
            let Some(last) = self.sections.iter().rposition(|s| s.name == section) else { continue };
            let elements: usize = self.sections.iter().filter(|s| s.name == section).map(|s| s.children.len()).sum();
            self.look(replicate, elements)?;
            let follows = if MIXED.contains(&section) { references::is_any_to } else { references::are_all_to };
            let mut found = Vec::new();
            for section in self.sections.iter_mut().filter(|s| s.name == section) {
                found.extend(section.children.extract_if(.., |element| follows(element, &names)));
            }
            let named = |element: &Element| {
                let kind = Kind::of(section, &element.name)?;
                Some((kind, kind.name(element)?.to_owned()))
            };
            names.extend(found.iter().filter_map(named));
            for suffix in suffixes {
                for element in &found {
                    self.room.take_document(element)?;
                    self.sections[last].children.push(references::numbered(element, &names, suffix));
                }
            }
        }
        Ok(())
    }

    fn look(&mut self, element: &Element, count: usize) -> Result<(), MjcfError> {
        self.looks = self.looks.saturating_add(count);
        if self.looks > MOST_LOOKS {
            return Err(
                element.invalid(format!("to expand it takes more than {MOST_LOOKS} steps; expected fewer copies"))
            );
        }
        Ok(())
    }
}
