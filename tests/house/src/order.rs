//! The order in which crates and rooms are said to stand, as `docs/project/architecture.md` has it.

use crate::Error;
use std::path::Path;

/// Order that the page describes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Order {
    /// Crates, the one below all others first.
    pub crates: Vec<Step>,
    /// Rooms of each crate that has a section, the one below all others first.
    pub rooms: Vec<(String, Vec<Step>)>,
}

/// Subject of the page's lines.
enum Section {
    Crates,
    Rooms,
    Other,
}

/// A line of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// The crate or room.
    pub name: String,
    /// Its description.
    pub about: String,
}

impl Order {
    /// Reads the page.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(page: &Path) -> Result<Order, Error> {
        let text = std::fs::read_to_string(page).map_err(|source| Error::Io { path: page.into(), source })?;
        Ok(Order::parse(&text))
    }

    /// Takes the tables whose first column is a name in code font: the table under `## Crates`, and those under a heading that
    /// is the name of a crate in code font.
    pub fn parse(page: &str) -> Order {
        let mut order = Order { crates: Vec::new(), rooms: Vec::new() };
        let mut section = Section::Other;
        for line in page.lines() {
            if let Some(heading) = line.strip_prefix('#') {
                let heading = heading.trim_start_matches('#').trim();
                let name = heading.strip_prefix('`').and_then(|h| h.strip_suffix('`'));
                section = match name {
                    _ if heading == "Crates" => Section::Crates,
                    Some(_) => Section::Rooms,
                    None => Section::Other,
                };
                order.rooms.extend(name.map(|name| (name.to_string(), Vec::new())));
            } else if let Some(step) = step(line) {
                match (&section, order.rooms.last_mut()) {
                    (Section::Crates, _) => order.crates.push(step),
                    (Section::Rooms, Some((_, steps))) => steps.push(step),
                    _ => {}
                }
            }
        }
        order
    }
}

/// A row such as "| `name` | what it is |"; the name may be a link.
fn step(line: &str) -> Option<Step> {
    let mut columns = line.strip_prefix('|')?.split('|');
    let (first, about) = (columns.next()?, columns.next()?);
    let (name, _) = first.split_once('`')?.1.split_once('`')?;
    Some(Step { name: name.trim_end_matches('/').into(), about: about.trim().into() })
}
