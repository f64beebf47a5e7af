//! Expands `<replicate>`: copies of what it holds, in frames along a path, with numbered names.
//!
//! The rules are MuJoCo's. Names in a copy get `sep` and the copy's number. Elements of other sections may refer to things in
//! the `<replicate>`. They are copied, too, behind the other elements of their section. Constraints and actuators must refer to nothing
//! else but the world; MuJoCo leaves out those that do. Sensors that refer to nothing are copied with each copy, even those that are
//! copies themselves.

use super::super::document::Element;
use super::super::error::MjcfError;
use super::super::math::{add, rotate, scale};
use super::super::orientation::from_euler;
use super::super::schema;
use super::super::value::Attrs;
use super::expand::{Expansion, FOLLOWERS, named};
use super::library::keys;
use super::part::{Draft, set};
use super::references::{self, Gone};
use super::walk;

/// Sections whose elements may refer to other things as well.
const MIXED: [&str; 3] = ["contact", "tendon", "sensor"];
/// Parts of a body that cannot stand in a frame.
const NOT_IN_FRAMES: [&str; 3] = ["joint", "freejoint", "inertial"];

impl Expansion<'_> {
    /// Puts copies in the place of the `<replicate>` with this index among the parts of an element. Returns their number.
    pub fn replicate(&mut self, parent: &[usize], index: usize) -> Result<usize, MjcfError> {
        let replicate = walk::at_mut(self.root, parent).children.remove(index);
        let copies = self.copies(&replicate)?;
        let count = copies.len();
        walk::at_mut(self.root, parent).children.splice(index..index, copies);
        Ok(count)
    }

    fn copies(&mut self, replicate: &Element) -> Result<Vec<Element>, MjcfError> {
        schema::check_expanded(replicate)?;
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
            self.library.room.take_document(&frame)?;
            for child in &replicate.children {
                self.library.room.take_document(child)?;
                frame.children.push(numbered(child, &names, &suffix(i), i));
            }
            copies.push(frame);
            pos = add(pos, rotate(from_euler(turn, &self.settings), offset));
        }
        let suffixes: Vec<String> = (0..count).map(suffix).collect();
        for name in &names {
            self.known.remove(name);
            self.known.extend(suffixes.iter().map(|suffix| (name.0, format!("{}{suffix}", name.1))));
        }
        self.follow_copies(replicate, names, &suffixes)?;
        Ok(copies)
    }

    /// Copies the elements of other sections that refer to these names.
    fn follow_copies(&mut self, replicate: &Element, mut names: Gone, suffixes: &[String]) -> Result<(), MjcfError> {
        for section in FOLLOWERS {
            let sections = || self.root.children.iter().filter(|s| s.name == section);
            let elements: usize = sections().map(|s| s.children.len()).sum();
            if elements == 0 {
                continue;
            }
            self.library.look(replicate, elements)?;
            let follows = if MIXED.contains(&section) { references::is_any_to } else { references::are_all_to };
            let alone = |element: &Element| section == "sensor" && !references::are_any(element);
            let mut found = Vec::new();
            for section in self.root.children.iter_mut().filter(|s| s.name == section) {
                found.extend(section.children.iter().filter(|e| follows(e, &names) || alone(e)).cloned());
                section.children.retain(|element| !follows(element, &names));
            }
            names.extend(found.iter().filter(|e| !alone(e)).filter_map(|element| named(section, element)));
            let last = self.section(section);
            for (i, suffix) in suffixes.iter().enumerate() {
                for j in 0..found.len() {
                    self.library.room.take_document(&found[j])?;
                    let copy = numbered(&found[j], &names, suffix, i);
                    self.known.extend(named(section, &copy));
                    if alone(&copy) {
                        self.library.room.take_document(&copy)?;
                        found.push(copy.clone());
                    }
                    self.root.children[last].children.push(copy);
                }
            }
        }
        Ok(())
    }
}

/// A numbered copy. As in MuJoCo, only the first one keeps the numbers of keyframes.
fn numbered(element: &Element, names: &Gone, suffix: &str, index: usize) -> Element {
    let mut copy = references::numbered(element, names, suffix);
    if index > 0 {
        keys::forget(&mut copy);
    }
    copy
}
