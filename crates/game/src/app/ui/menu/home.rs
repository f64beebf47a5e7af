//! The main menu, and the menu of a paused game.

use crate::app::input::actions::Action;
use crate::app::mode::Mode;
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::Scenario;
use crate::app::stage::selection::fresh_start;
use crate::app::ui::menu::choice::Choice;
use crate::app::ui::menu::pictures::{Picture, Pictures};
use crate::app::ui::menu::state::Screen;
use crate::app::ui::menu::window::Items;
use crate::app::ui::theme::{FAINT, TEXT, text};
use bevy_egui::egui::{self, Button, Image, Ui, Vec2};

/// An entry of the main menu with a picture: its name, and what it is for.
const TILES: [(Picture, &str, &str); 6] = [
    (Picture::Play, "Play", "walk, run, jump, flip"),
    (Picture::Courses, "Courses", "reach the finish in time"),
    (Picture::Learn, "Learn live", "watch a policy learn"),
    (Picture::Motion, "Motion clips", "follow a motion capture"),
    (Picture::Testbed, "Test bed", "move every motor"),
    (Picture::Replays, "Replays", "see a run again"),
];
/// Tiles in a row.
const COLUMNS: usize = 3;

/// Draws the main menu.
pub fn main(
    ui: &mut Ui,
    items: &mut Items,
    pictures: &mut Pictures,
    scenario: &Scenario,
    shipped: &ShippedPolicies,
) -> Choice {
    let mut choice = Choice::Stay;
    let gap = 10.0;
    let width = ((ui.available_width() - gap * (COLUMNS as f32 - 1.0)) / COLUMNS as f32 - 12.0).max(60.0);
    let size = Vec2::new(width, width * 9.0 / 16.0).floor();
    for row in TILES.chunks(COLUMNS) {
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = gap;
            for (picture, name, does) in row {
                ui.vertical(|ui| {
                    ui.set_width(width);
                    let image = Image::from_texture((pictures.texture(ui.ctx(), *picture), size));
                    if items.add(ui, Button::image(image).min_size(size)).clicked() {
                        choice = chosen(*picture, scenario, shipped);
                    }
                    ui.label(text(16.0, TEXT, *name).strong());
                    ui.label(text(12.0, FAINT, *does));
                });
            }
        });
        ui.add_space(6.0);
    }
    ui.separator();
    ui.horizontal_wrapped(|ui| {
        for (label, next) in
            [("Settings", Choice::Show(Screen::Settings)), ("Keys", Choice::Show(Screen::Keys)), ("Quit", Choice::Quit)]
        {
            if items.button(ui, label).clicked() {
                choice = next;
            }
        }
    });
    choice
}

/// The effect of a tile.
fn chosen(picture: Picture, scenario: &Scenario, shipped: &ShippedPolicies) -> Choice {
    let mode = match picture {
        Picture::Courses => return Choice::Show(Screen::Courses),
        Picture::Replays => return Choice::Show(Screen::Replays),
        Picture::Play => Mode::Watch,
        Picture::Learn => Mode::Learn,
        Picture::Motion => Mode::Imitate,
        Picture::Testbed => Mode::Testbed,
    };
    let wanted = fresh_start(scenario, mode, shipped);
    // the scene behind the menu may be the one that is wanted
    if wanted == *scenario && mode != Mode::Learn { Choice::Close } else { Choice::Start(wanted) }
}

/// Draws the menu of a paused game.
pub fn pause(ui: &mut Ui, items: &mut Items) -> Choice {
    let mut choice = Choice::Stay;
    ui.spacing_mut().item_spacing.y = 8.0;
    ui.with_layout(egui::Layout::top_down_justified(egui::Align::Center), |ui| {
        for (label, next) in [
            ("Continue", Choice::Back),
            ("Restart", Choice::Do(Action::Restart)),
            ("Change the scene", Choice::Show(Screen::Setup)),
            ("Settings", Choice::Show(Screen::Settings)),
            ("Keys and buttons", Choice::Show(Screen::Keys)),
            ("Main menu", Choice::Show(Screen::Main)),
            ("Quit", Choice::Quit),
        ] {
            if items.wide_button(ui, label).clicked() {
                choice = next;
            }
        }
    });
    choice
}
