//! The key hints on the screen: a line with the most useful keys, or a list of all keys that work now. Keys that steer
//! are labeled with the command that they set.

use crate::app::args::Mode;
use crate::app::course::builds;
use crate::app::hud::{ACCENT, CARD, FAINT, TEXT, card, text};
use crate::app::keys::{Bindings, Deed};
use crate::app::show::Show;
use crate::app::steer::{Control, Steering};
use bevy_egui::egui::text::LayoutJob;
use bevy_egui::egui::{self, Align2, Area, CornerRadius, FontId, Frame, Id, Label, Margin, TextFormat, Vec2};
use std::ops::Range;

/// Window width below which the line shows only the steering keys, so that it does not cover the character, points.
const NARROW: f32 = 900.0;

/// Distance between two hints, and free space beside the line, points.
const GAP: f32 = 12.0;
const BESIDE: f32 = 48.0;

/// The current use of the keys.
pub struct Hints<'a> {
    /// The key of each action.
    pub bindings: &'a Bindings,
    /// The devices that steer.
    pub steering: Steering,
    /// The controls that steer.
    pub controls: Vec<Control>,
    /// Whether a gamepad is connected.
    pub pads: bool,
}

/// Whether an action has an effect in this mode.
fn works(deed: Deed, show: &Show, steering: Steering) -> bool {
    let mode = show.mode;
    let simulated = !matches!(mode, Mode::Replay | Mode::Outside);
    match deed {
        Deed::Back | Deed::Ahead => mode == Mode::Replay,
        Deed::Higher | Deed::Lower | Deed::Even => builds(show),
        Deed::Save => mode == Mode::Learn,
        Deed::Push | Deed::Throw => simulated && mode != Mode::Course,
        Deed::Restart | Deed::NextAgent => simulated,
        Deed::Record => simulated && mode != Mode::Testbed,
        Deed::Release => steering.on && mode != Mode::Course,
        Deed::NextFocus => show.agents > 1,
        _ => true,
    }
}

/// The name of an action in this mode.
fn name_in(show: &Show, deed: Deed, name: &'static str) -> &'static str {
    match (deed, show.mode) {
        (Deed::NextAgent, Mode::Imitate) => "next clip",
        (Deed::Restart, Mode::Learn) => "learn anew",
        (Deed::Restart, Mode::Course) => "give up",
        (Deed::Learn, Mode::Learn) => "watch again",
        _ => name,
    }
}

/// The most useful actions in this mode.
fn useful(show: &Show) -> &'static [Deed] {
    match show.mode {
        Mode::Watch => {
            &[Deed::Menu, Deed::Pause, Deed::NextFocus, Deed::NextAgent, Deed::Camera, Deed::Push, Deed::Learn]
        }
        Mode::Imitate => &[
            Deed::Menu,
            Deed::Ghost,
            Deed::Errors,
            Deed::NextAgent,
            Deed::Push,
            Deed::Throw,
            Deed::Camera,
            Deed::Learn,
        ],
        Mode::Push => &[Deed::Menu, Deed::Push, Deed::Throw, Deed::Restart, Deed::Camera, Deed::Contacts],
        Mode::Learn => &[Deed::Menu, Deed::Pause, Deed::Faster, Deed::Save, Deed::Restart, Deed::Learn],
        Mode::Testbed => &[Deed::Menu, Deed::Pause, Deed::Step, Deed::Restart, Deed::Joints, Deed::Contacts],
        Mode::Course if builds(show) => &[Deed::Menu, Deed::Higher, Deed::Lower, Deed::Restart, Deed::Runs],
        Mode::Course => &[Deed::Menu, Deed::Pause, Deed::Restart, Deed::Runs, Deed::Slower, Deed::Camera],
        Mode::Outside => &[Deed::Menu, Deed::NextFocus, Deed::Camera, Deed::Hud],
        Mode::Replay => &[Deed::Menu, Deed::Pause, Deed::Back, Deed::Ahead, Deed::Slower, Deed::Camera],
    }
}

/// A row of the list of all keys: key, button, action.
type Row = (String, String, String);

impl Hints<'_> {
    /// Draws the line, and the list if `all` is set.
    pub fn draw(&self, ctx: &egui::Context, show: &Show, all: bool, room: Vec2) {
        if all {
            self.list(ctx, show);
        }
        let hints: Vec<_> = self.line(show, room.x).iter().map(|(key, does)| hint(key, does)).collect();
        let widths: Vec<f32> =
            ctx.fonts_mut(|fonts| hints.iter().map(|hint| fonts.layout_job(hint.clone()).size().x + GAP).collect());
        let rows = broken(&widths, room.x - BESIDE);
        let area = Area::new(Id::new("keys")).anchor(Align2::CENTER_BOTTOM, [0.0, -10.0]).interactable(false);
        area.show(ctx, |ui| {
            let frame = Frame::new().fill(CARD).corner_radius(CornerRadius::same(6));
            frame.inner_margin(Margin::symmetric(10, 4)).show(ui, |ui| {
                for row in rows {
                    ui.horizontal(|ui| {
                        ui.spacing_mut().item_spacing.x = GAP;
                        hints[row].iter().for_each(|hint| drop(ui.add(Label::new(hint.clone()).extend())));
                    });
                }
            });
        });
    }

    /// The keys in a line of the given width, with their actions. Steering keys come first.
    fn line(&self, show: &Show, width: f32) -> Vec<(String, String)> {
        let steers = |control: &Control| match self.pads {
            true => format!("{} | pad {}", control.keys, control.pad),
            false => control.keys.to_string(),
        };
        let mut line: Vec<_> = self.controls.iter().map(|c| (steers(c), c.does.clone())).collect();
        if builds(show) {
            line.push(("mouse".into(), "build".into()));
        }
        let useful = if width < NARROW { &[Deed::Menu][..] } else { useful(show) };
        let shown = |deed: Deed| match deed {
            Deed::Help => true,
            Deed::Release => works(deed, show, self.steering),
            _ => useful.contains(&deed) && works(deed, show, self.steering),
        };
        for (deed, name, key, button) in self.bindings.free_rows(self.steering).filter(|row| shown(row.0)) {
            // a key that steers does no other action: show the gamepad's button if one is connected
            let key = key.map(String::from).or(button.filter(|_| self.pads).map(|button| format!("pad {button}")));
            line.extend(key.map(|key| (key, name_in(show, deed, name).to_string())));
        }
        line
    }

    /// All keys and buttons that work now.
    fn rows(&self, show: &Show) -> Vec<Row> {
        let steers = self.controls.iter().map(|c| (c.keys.to_string(), c.pad.to_string(), c.does.clone()));
        let free = self.bindings.free_rows(self.steering).filter(|row| works(row.0, show, self.steering));
        let free = free.filter(|(_, _, key, button)| key.is_some() || button.is_some());
        let free = free.map(|(deed, name, key, button)| {
            let name = name_in(show, deed, name).to_string();
            (key.unwrap_or_default().to_string(), button.unwrap_or_default().to_string(), name)
        });
        steers.chain(free).collect()
    }

    fn list(&self, ctx: &egui::Context, show: &Show) {
        Area::new(Id::new("help")).anchor(Align2::LEFT_BOTTOM, [14.0, -58.0]).interactable(false).show(ctx, |ui| {
            card().show(ui, |ui| {
                // two columns, because a small window is lower than the whole list
                let rows = self.rows(show);
                let half = rows.len().div_ceil(2);
                egui::Grid::new("all keys").num_columns(6).spacing([18.0, 3.0]).show(ui, |ui| {
                    for (i, first) in rows[..half].iter().enumerate() {
                        for (key, button, name) in [Some(first), rows.get(half + i)].into_iter().flatten() {
                            ui.label(text(13.0, TEXT, key).strong());
                            ui.label(text(13.0, FAINT, button));
                            ui.label(text(13.0, TEXT, name));
                        }
                        ui.end_row();
                    }
                });
                let wheel = match builds(show) {
                    true => "left mouse button: drag the end of the next meter   wheel: a step higher or lower",
                    false => "wheel: closer",
                };
                ui.label(text(12.0, FAINT, format!("right mouse button or right stick: turn the camera   {wheel}")));
            });
        });
    }
}

/// A key and its action.
fn hint(key: &str, does: &str) -> LayoutJob {
    let mut words = LayoutJob::default();
    for (color, part) in [(ACCENT, format!("{key} ")), (TEXT, does.to_string())] {
        words.append(&part, 0.0, TextFormat::simple(FontId::proportional(12.0), color));
    }
    words
}

/// Breaks items with these widths into rows. An item wider than a row gets its own row.
fn broken(widths: &[f32], room: f32) -> Vec<Range<usize>> {
    let (mut rows, mut first, mut filled) = (Vec::new(), 0, 0.0);
    for (i, width) in widths.iter().enumerate() {
        if filled + width > room && i > first {
            rows.push(first..i);
            (first, filled) = (i, 0.0);
        }
        filled += width;
    }
    rows.push(first..widths.len());
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::args::Args;
    use crate::app::steer::controls;
    use clap::Parser;
    use marathon_runs::Setting;

    /// The hints for a command line: the line and the list.
    #[allow(clippy::type_complexity, reason = "a line and a list")]
    fn hints(words: &[&str], pads: bool) -> Result<(Vec<(String, String)>, Vec<Row>), Box<dyn std::error::Error>> {
        let show = Show::of(&Args::parse_from([&["marathon-game"], words].concat()))?;
        let ranges = Setting::named(&show.agent)?.factory()?.spec().command.clone();
        let steering = Steering { on: !ranges.is_empty(), buttons: controls(&ranges).iter().any(|c| c.keys == "W") };
        let bindings = Bindings::default();
        let hints = Hints { bindings: &bindings, steering, controls: controls(&ranges), pads };
        Ok((hints.line(&show, 1280.0), hints.rows(&show)))
    }

    #[test]
    fn what_steers_is_on_the_screen_by_its_key() -> Result<(), Box<dyn std::error::Error>> {
        let (line, rows) = hints(&["MarathonManController"], false)?;
        for (key, does) in
            [("Up Down", "speed"), ("Left Right", "turn"), ("W", "jump"), ("V", "backflip"), ("G", "let go")]
        {
            assert!(line.iter().any(|(k, d)| (k.as_str(), d.as_str()) == (key, does)), "{key} {does}: {line:?}");
        }
        // the hints omit the keys' usual actions while they steer
        for taken in ["Up", "Down"] {
            assert!(rows.iter().all(|(key, ..)| key != taken), "{rows:?}");
        }
        let of =
            |name: &str| rows.iter().find(|(.., does)| does == name).map(|(key, pad, _)| (key.as_str(), pad.as_str()));
        assert_eq!([of("jump"), of("backflip")], [Some(("W", "A")), Some(("V", "B"))]);
        // the gamepad's A and B usually push and throw; the D-pad takes over the actions of the arrow keys
        assert_eq!([of("push"), of("faster")], [Some(("P", "")), Some(("", "D-pad up"))]);
        let (line, _) = hints(&["MarathonManController"], true)?;
        assert!(line.contains(&("W | pad A".into(), "jump".into())), "{line:?}");
        Ok(())
    }

    #[test]
    #[allow(clippy::single_range_in_vec_init, reason = "one range is one line")]
    fn a_line_breaks_where_it_is_too_long() {
        assert_eq!(broken(&[3.0, 3.0, 3.0, 9.0, 1.0], 6.0), [0..2, 2..3, 3..4, 4..5]);
        assert_eq!(broken(&[3.0], 6.0), [0..1]);
        assert_eq!(broken(&[], 6.0), [0..0]);
    }

    #[test]
    fn a_course_that_one_runs_does_not_say_that_down_is_slower() -> Result<(), Box<dyn std::error::Error>> {
        let (line, _) = hints(&["--mode", "course", "--part", "run"], false)?;
        assert!(line.iter().all(|(key, does)| key != "Down" && does != "slower"), "{line:?}");
        assert!(line.iter().any(|(key, does)| key == "A D" && does == "step aside"), "{line:?}");
        let (line, _) = hints(&["--mode", "course", "--part", "run"], true)?;
        assert!(line.contains(&("pad D-pad down".into(), "slower".into())), "{line:?}");
        Ok(())
    }

    #[test]
    fn the_list_follows_the_mode() -> Result<(), Box<dyn std::error::Error>> {
        let names = |words: &[&str]| -> Result<Vec<String>, Box<dyn std::error::Error>> {
            Ok(hints(words, false)?.1.into_iter().map(|(.., name)| name).collect())
        };
        let watch = names(&["hopper"])?;
        for absent in ["back", "build higher", "save policy", "let go"] {
            assert!(!watch.iter().any(|name| name == absent), "{absent}: {watch:?}");
        }
        let learn = names(&["hopper", "--mode", "learn"])?;
        assert!(["save policy", "learn anew", "watch again"].iter().all(|name| learn.iter().any(|n| n == name)));
        let build = names(&["--mode", "course", "--part", "build"])?;
        assert!(build.iter().any(|name| name == "build higher") && build.iter().all(|name| name != "push"));
        Ok(())
    }
}
