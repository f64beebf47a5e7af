//! The key hints on the screen: a line with the most useful keys, or a list of all keys that work now. Keys that steer
//! are labeled with the command that they set. Features [contribute](KeyHints) the keys of their modes.

use crate::app::input::actions::{Action, Steering};
use crate::app::input::bindings::Bindings;
use crate::app::input::controls::{Control, controls};
use crate::app::stage::actors::{Actor, Focus};
use crate::app::stage::scenario::Scenario;
use crate::app::ui::rewards;
use crate::app::ui::theme::{ACCENT, CARD, FAINT, Hud, TEXT, UiSet, card, text};
use bevy::input::gamepad::Gamepad;
use bevy::prelude::*;
use bevy_egui::egui::text::LayoutJob;
use bevy_egui::egui::{self, Align2, Area, CornerRadius, FontId, Frame, Id, Label, Margin, TextFormat};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::Anatomy;
use std::ops::Range;

/// Window width below which the hints are hidden, and below which the line shows only the steering keys, so that they do not
/// cover the character, points.
const NARROW: [f32; 2] = [640.0, 900.0];

/// Distance between two hints, and free space beside the line, points.
const GAP: f32 = 12.0;
const BESIDE: f32 = 48.0;

/// The keys of a mode.
#[derive(Debug)]
pub struct ModeKeys {
    /// The most useful actions.
    pub useful: &'static [Action],
    /// Actions that have an effect in this mode alone.
    pub own: &'static [Action],
    /// Actions that have an effect in other modes, but not in this one.
    pub without: &'static [Action],
    /// Names of actions that differ in this mode.
    pub names: &'static [(Action, &'static str)],
    /// The use of the mouse, in a word and in full, if it differs in this mode.
    pub mouse: Option<[&'static str; 2]>,
}

impl ModeKeys {
    /// The keys of a mode without any of its own.
    pub const COMMON: ModeKeys = ModeKeys {
        useful: &[
            Action::Menu,
            Action::Pause,
            Action::NextFocus,
            Action::NextAgent,
            Action::Camera,
            Action::Push,
            Action::Learn,
        ],
        own: &[],
        without: &[],
        names: &[],
        mouse: None,
    };
}

/// The keys of the modes, as the features contribute them.
#[derive(Resource, Default)]
pub struct KeyHints(Vec<(Condition, &'static ModeKeys)>);

/// Whether keys are those of a scenario.
type Condition = fn(&Scenario) -> bool;

impl KeyHints {
    /// Adds the keys of the scenarios that a condition holds for. The first one that holds counts.
    pub fn add(&mut self, holds: Condition, keys: &'static ModeKeys) {
        self.0.push((holds, keys));
    }

    fn of(&self, scenario: &Scenario) -> &'static ModeKeys {
        self.0.iter().find(|(holds, _)| holds(scenario)).map_or(&ModeKeys::COMMON, |(_, keys)| keys)
    }

    /// Whether an action has an effect in some modes only.
    fn is_special(&self, action: Action) -> bool {
        self.0.iter().any(|(_, keys)| keys.own.contains(&action))
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<KeyHints>().add_systems(EguiPrimaryContextPass, draw.in_set(UiSet::Hud).after(rewards::draw));
}

fn draw(
    mut contexts: EguiContexts,
    (hud, scenario, focus): (Res<Hud>, Res<Scenario>, Res<Focus>),
    (bindings, key_hints, steering): (Res<Bindings>, Res<KeyHints>, Res<Steering>),
    pads: Query<(), With<Gamepad>>,
    actors: Query<(&Actor, &Anatomy)>,
) -> Result {
    let ctx = contexts.ctx_mut()?.clone();
    let room = ctx.content_rect().size();
    let shown = hud.help || hud.is_full() && room.x > NARROW[0];
    if !hud.on || !shown {
        return Ok(());
    }
    let actor = actors.iter().find(|(actor, _)| actor.0 == focus.0);
    let ranges = actor.and_then(|(_, anatomy)| anatomy.spec.as_ref()).map_or(&[][..], |spec| &spec.command);
    let controls = if steering.on { controls(ranges, steering.by_camera, &bindings) } else { Vec::new() };
    let hints = Hints {
        bindings: &bindings,
        key_hints: &key_hints,
        keys: key_hints.of(&scenario),
        several: scenario.agents > 1,
        steering: *steering,
        controls,
        pads: !pads.is_empty(),
    };
    hints.draw(&ctx, hud.help, room);
    Ok(())
}

/// The current use of the keys.
struct Hints<'a> {
    /// The key of each action.
    bindings: &'a Bindings,
    /// The keys of all modes, and those of the current one.
    key_hints: &'a KeyHints,
    keys: &'static ModeKeys,
    /// Whether there are several characters.
    several: bool,
    /// The devices that steer.
    steering: Steering,
    /// The controls that steer.
    controls: Vec<Control>,
    /// Whether a gamepad is connected.
    pads: bool,
}

/// A row of the list of all keys: key, button, action.
type Row = (String, String, String);

impl Hints<'_> {
    /// Whether an action has an effect now.
    fn works(&self, action: Action) -> bool {
        match action {
            Action::NextFocus => self.several,
            Action::Release if !self.steering.on => false,
            _ if self.key_hints.is_special(action) => self.keys.own.contains(&action),
            _ => !self.keys.without.contains(&action),
        }
    }

    /// The name of an action in this mode.
    fn name(&self, action: Action, name: &'static str) -> &'static str {
        self.keys.names.iter().find(|(renamed, _)| *renamed == action).map_or(name, |(_, name)| name)
    }

    /// Draws the line, and the list if `all` is set.
    fn draw(&self, ctx: &egui::Context, all: bool, room: egui::Vec2) {
        if all {
            self.list(ctx);
        }
        let hints: Vec<_> = self.line(room.x).iter().map(|(key, does)| hint(key, does)).collect();
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
    fn line(&self, width: f32) -> Vec<(String, String)> {
        let steers = |control: &Control| match self.pads {
            true => format!("{} | pad {}", control.keys, control.pad),
            false => control.keys.clone(),
        };
        let mut line: Vec<_> = self.controls.iter().map(|c| (steers(c), c.does.clone())).collect();
        line.extend(self.keys.mouse.map(|[does, _]| ("mouse".into(), does.into())));
        let useful = if width < NARROW[1] { &[Action::Menu][..] } else { self.keys.useful };
        let shown = |action: Action| match action {
            Action::Help => true,
            Action::Release => self.works(action),
            _ => useful.contains(&action) && self.works(action),
        };
        for (action, name, key, button) in self.bindings.free_rows(self.steering).filter(|row| shown(row.0)) {
            // a key that steers does no other action: show the gamepad's button if one is connected
            let key = key.map(String::from).or(button.filter(|_| self.pads).map(|button| format!("pad {button}")));
            line.extend(key.map(|key| (key, self.name(action, name).to_string())));
        }
        line
    }

    /// All keys and buttons that work now.
    fn rows(&self) -> Vec<Row> {
        let steers = self.controls.iter().map(|c| (c.keys.clone(), c.pad.clone(), c.does.clone()));
        let free = self.bindings.free_rows(self.steering).filter(|row| self.works(row.0));
        let free = free.filter(|(_, _, key, button)| key.is_some() || button.is_some());
        let free = free.map(|(action, name, key, button)| {
            let name = self.name(action, name).to_string();
            (key.unwrap_or_default().to_string(), button.unwrap_or_default().to_string(), name)
        });
        steers.chain(free).collect()
    }

    fn list(&self, ctx: &egui::Context) {
        Area::new(Id::new("help")).anchor(Align2::LEFT_BOTTOM, [14.0, -58.0]).interactable(false).show(ctx, |ui| {
            card().show(ui, |ui| {
                // two columns, because a small window is lower than the whole list
                let rows = self.rows();
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
                let wheel = self.keys.mouse.map_or("wheel: closer", |[_, does]| does);
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
    use crate::app::cli::Args;
    use crate::app::features;
    use crate::app::first_scene;
    use crate::app::mode::Mode;
    use crate::app::stage::policies::ShippedPolicies;
    use bevy_marathon::MoveDirection;
    use clap::Parser;
    use marathon_runs::TaskConfig;

    /// The hints for a command line: the line and the list.
    #[allow(clippy::type_complexity, reason = "a line and a list")]
    fn hints(words: &[&str], pads: bool) -> Result<(Vec<(String, String)>, Vec<Row>), Box<dyn std::error::Error>> {
        let args = Args::parse_from([&["marathon-game"], words].concat());
        let scenario = first_scene::scenario(&args, &ShippedPolicies::decode())?;
        let ranges = TaskConfig::named(&scenario.agent)?.factory()?.spec().command.clone();
        let by_camera = MoveDirection::moves(&ranges) && scenario.mode != Mode::Course;
        let (bindings, key_hints) = (Bindings::default(), features::key_hints());
        let buttons = controls(&ranges, by_camera, &bindings).iter().any(|control| control.keys == "Space");
        let steering = Steering { on: !ranges.is_empty(), buttons, by_camera, flying: false };
        let hints = Hints {
            bindings: &bindings,
            key_hints: &key_hints,
            keys: key_hints.of(&scenario),
            several: scenario.agents > 1,
            steering,
            controls: controls(&ranges, by_camera, &bindings),
            pads,
        };
        Ok((hints.line(1280.0), hints.rows()))
    }

    #[test]
    fn what_steers_is_on_the_screen_by_its_key() -> Result<(), Box<dyn std::error::Error>> {
        let (line, rows) = hints(&["MarathonManController"], false)?;
        for (key, does) in
            [("W A S D", "move"), ("Shift", "run"), ("Space", "jump"), ("V", "backflip"), ("G", "let go")]
        {
            assert!(line.iter().any(|(k, d)| (k.as_str(), d.as_str()) == (key, does)), "{key} {does}: {line:?}");
        }
        // the hints omit the keys' usual actions while they steer
        for taken in ["Up", "Down"] {
            assert!(rows.iter().all(|(key, ..)| key != taken), "{rows:?}");
        }
        let of =
            |name: &str| rows.iter().find(|(.., does)| does == name).map(|(key, pad, _)| (key.as_str(), pad.as_str()));
        assert_eq!([of("jump"), of("backflip")], [Some(("Space", "A")), Some(("V", "B"))]);
        // the gamepad's A and B usually push and throw; the D-pad takes over the actions of the arrow keys
        assert_eq!([of("push"), of("faster")], [Some(("P", "")), Some(("", "D-pad up"))]);
        let (line, _) = hints(&["MarathonManController"], true)?;
        assert!(line.contains(&("Space | pad A".into(), "jump".into())), "{line:?}");
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
    fn a_course_that_the_player_runs_does_not_say_that_down_is_slower() -> Result<(), Box<dyn std::error::Error>> {
        let (line, _) = hints(&["--mode", "course", "--role", "run"], false)?;
        assert!(line.iter().all(|(key, does)| key != "Down" && does != "slower"), "{line:?}");
        assert!(line.iter().any(|(key, does)| key == "A D" && does == "step aside"), "{line:?}");
        let (line, _) = hints(&["--mode", "course", "--role", "run"], true)?;
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
        let build = names(&["--mode", "course", "--role", "build"])?;
        assert!(build.iter().any(|name| name == "build higher") && build.iter().all(|name| name != "push"));
        Ok(())
    }
}
