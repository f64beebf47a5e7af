//! The picture of the house: a floor per crate, the one that others stand on at the bottom; on it the rooms, each as wide as its
//! lines of code are many.

use crate::{Crate, House, Order, Room};
use std::fmt::Write;

/// Width of the picture and of what is left of the floors, pixels.
const WIDTH: f64 = 1180.0;
const LEFT: f64 = 150.0;
/// Height of a floor and the space above it.
const FLOOR: f64 = 78.0;
const GAP: f64 = 26.0;
/// Narrowest room and the wall between two.
const ROOM: f64 = 16.0;
const WALL: f64 = 3.0;
const COLORS: [&str; 6] = ["#dbe9f6", "#e2f0d9", "#fdebd0", "#f6dfe6", "#e6e0f3", "#d9f0ee"];

/// Draws the crates that the order names, as SVG.
pub fn svg(house: &House, order: &Order) -> String {
    let floors: Vec<&Crate> = order.crates.iter().filter_map(|step| house.find(&step.name)).collect();
    let height = floors.len() as f64 * (FLOOR + GAP) + GAP;
    let mut out = String::new();
    let head = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
         font-family=\"DejaVu Sans, sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    out.push_str(&head);
    for (i, floor) in floors.iter().enumerate() {
        let top = height - (i + 1) as f64 * (FLOOR + GAP);
        draw_floor(&mut out, floor, order, top, COLORS[i % COLORS.len()]);
    }
    out.push_str("</svg>\n");
    out
}

fn draw_floor(out: &mut String, floor: &Crate, order: &Order, top: f64, color: &str) {
    let lines: usize = floor.rooms.iter().map(|room| room.lines).sum();
    let on: Vec<&str> =
        order.crates.iter().map(|step| step.name.as_str()).filter(|name| floor.depends_on.contains(*name)).collect();
    let on = if on.is_empty() { String::new() } else { format!("on {}", on.join(", ")) };
    let _ = writeln!(
        out,
        "<text x=\"10\" y=\"{:.0}\" font-size=\"19\" font-weight=\"bold\">{}</text>\n\
         <text x=\"10\" y=\"{:.0}\" font-size=\"11\" fill=\"#555\">{lines} lines</text>",
        top + 30.0,
        floor.name,
        top + 48.0
    );
    let _ =
        writeln!(out, "<text x=\"{LEFT}\" y=\"{:.0}\" font-size=\"11\" fill=\"#555\">{on}</text>", top + FLOOR + 14.0);
    let rooms = ordered(floor, order);
    let free = WIDTH - LEFT - 10.0 - rooms.len() as f64 * (ROOM + WALL);
    let mut x = LEFT;
    for room in rooms {
        let width = ROOM + free * room.lines as f64 / lines.max(1) as f64;
        draw_room(out, room, (x, top, width), color);
        x += width + WALL;
    }
}

/// The rooms as the page has them, the one below all others first; those that it leaves out at the end.
fn ordered<'a>(floor: &'a Crate, order: &Order) -> Vec<&'a Room> {
    let steps = order.rooms.iter().find(|(name, _)| *name == floor.name).map_or(&[][..], |(_, steps)| steps);
    let mut rooms: Vec<&Room> = floor.rooms.iter().collect();
    rooms.sort_by_key(|room| steps.iter().position(|step| step.name == room.name).unwrap_or(usize::MAX));
    rooms
}

fn draw_room(out: &mut String, room: &Room, (x, y, width): (f64, f64, f64), color: &str) {
    let _ = writeln!(
        out,
        "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{FLOOR}\" rx=\"3\" fill=\"{color}\" stroke=\"#888\"/>"
    );
    // names stand upright where a room is too narrow for them
    let (cx, cy) = (x + width / 2.0, y + FLOOR / 2.0);
    let fits = room.name.len() as f64 * 8.5 < width;
    let (turn, size) =
        if fits { (String::new(), 13) } else { (format!(" transform=\"rotate(-90 {cx:.1} {cy:.1})\""), 10) };
    let _ = writeln!(
        out,
        "<text x=\"{cx:.1}\" y=\"{:.1}\" font-size=\"{size}\" text-anchor=\"middle\"{turn}>{}</text>",
        cy + 4.0,
        room.name
    );
}
