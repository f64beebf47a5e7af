//! The screen of the settings, in groups. A change takes effect at once, except for the skin.

use crate::app::input::device::PadShapes;
use crate::app::settings::values::{
    Detail, FIELD, QualityChoice, SCALE, SENSITIVITY, Settings, SkinSetting, TEXT_SIZE, VOLUME, WindowKind,
};
use crate::app::ui::menu::choice::Choice;
use crate::app::ui::menu::state::Screen;
use crate::app::ui::menu::window::Items;
use crate::app::ui::theme::{ACCENT, text};
use bevy::prelude::*;
use bevy_egui::egui::{Button, Grid, RichText, Slider, TextEdit, Ui};
use std::ops::RangeInclusive;

/// The rows of a group.
struct Rows<'a> {
    ui: &'a mut Ui,
    items: &'a mut Items,
}

impl Rows<'_> {
    fn toggle(&mut self, name: &str, on: &mut bool) {
        self.choice(name, on, &[(false, "off"), (true, "on")]);
    }

    fn slider(&mut self, name: &str, x: &mut f32, range: RangeInclusive<f32>, step: f64) {
        self.ui.label(name);
        self.items.add(self.ui, Slider::new(x, range).step_by(step).max_decimals(2));
        self.ui.end_row();
    }

    fn choice<T: PartialEq + Clone>(&mut self, name: &str, chosen: &mut T, choices: &[(T, &str)]) {
        self.ui.label(name);
        self.ui.horizontal_wrapped(|ui| {
            for (choice, label) in choices {
                if self.items.add(ui, Button::selectable(chosen == choice, *label)).clicked() {
                    *chosen = choice.clone();
                }
            }
        });
        self.ui.end_row();
    }
}

/// Draws the screen.
pub fn draw(ui: &mut Ui, items: &mut Items, settings: &mut ResMut<Settings>) -> Choice {
    let mut choice = Choice::Stay;
    let mut now = Settings::clone(settings);
    group(ui, items, "Picture", |rows| picture(rows, &mut now));
    group(ui, items, "Camera", |rows| {
        rows.slider("Field of view, degrees", &mut now.camera.field_of_view, FIELD, 1.0);
        rows.slider("Sensitivity", &mut now.camera.sensitivity, SENSITIVITY, 0.1);
        rows.toggle("Invert up and down", &mut now.camera.invert_y);
        rows.toggle("Reduced motion", &mut now.camera.reduced_motion);
    });
    group(ui, items, "Sound", |rows| {
        rows.slider("All", &mut now.sound.master, VOLUME, 0.05);
        rows.slider("Effects", &mut now.sound.effects, VOLUME, 0.05);
    });
    group(ui, items, "Text and bars", |rows| {
        rows.slider("Size of text", &mut now.interface.text_size, TEXT_SIZE, 0.05);
        let details = [(Detail::Play, "goal and speed"), (Detail::Full, "all numbers"), (Detail::Nothing, "none")];
        rows.choice("Detail", &mut now.interface.detail, &details);
        rows.toggle("Colors for color blindness", &mut now.interface.safe_colors);
        rows.toggle("Prompts", &mut now.interface.prompts);
        let shapes = [(PadShapes::Letters, "A B X Y"), (PadShapes::Shapes, "cross, circle, square, triangle")];
        rows.choice("Buttons of a gamepad", &mut now.interface.pad_shapes, &shapes);
    });
    group(ui, items, "Character", |rows| skin(rows, &mut now.skin));
    ui.add_space(6.0);
    ui.horizontal_wrapped(|ui| {
        if items.button(ui, "Keys and buttons").clicked() {
            choice = Choice::Show(Screen::Keys);
        }
        if items.button(ui, "Reset all but keys").clicked() {
            now = Settings { bindings: now.bindings.clone(), ..Settings::default() };
        }
    });
    settings.set_if_neq(now);
    choice
}

/// A heading, and a table of rows.
fn group(ui: &mut Ui, items: &mut Items, name: &str, draw: impl FnOnce(&mut Rows<'_>)) {
    ui.add_space(4.0);
    ui.label(text(15.0, ACCENT, name).strong());
    Grid::new(name).num_columns(2).spacing([16.0, 6.0]).min_col_width(170.0).show(ui, |ui| {
        draw(&mut Rows { ui, items });
    });
}

fn picture(rows: &mut Rows<'_>, now: &mut Settings) {
    let display = &mut now.display;
    let windows = [(WindowKind::Windowed, "window"), (WindowKind::FullScreen, "full screen")];
    rows.choice("Window", &mut display.window, &windows);
    rows.slider("Resolution", &mut display.resolution_scale, SCALE, 0.05);
    let qualities = [
        (QualityChoice::Automatic, "automatic"),
        (QualityChoice::Low, "low"),
        (QualityChoice::Medium, "medium"),
        (QualityChoice::High, "high"),
    ];
    rows.choice("Quality", &mut display.quality, &qualities);
    rows.toggle("Wait for the screen (vsync)", &mut display.vsync);
}

fn skin(rows: &mut Rows<'_>, skin: &mut SkinSetting) {
    let mut file = match skin {
        SkinSetting::File(path) => path.display().to_string(),
        _ => String::new(),
    };
    rows.choice(
        "Skin, from the next start on",
        skin,
        &[
            (SkinSetting::Automatic, "automatic"),
            (SkinSetting::Generated, "generated"),
            (SkinSetting::Shapes, "shapes of the physics"),
        ],
    );
    rows.ui.label("Skin of your own");
    let edit = TextEdit::singleline(&mut file).hint_text(RichText::new("file.glb")).desired_width(190.0);
    if rows.items.add(rows.ui, edit).changed() {
        *skin = if file.is_empty() { SkinSetting::Automatic } else { SkinSetting::File(file.into()) };
    }
    rows.ui.end_row();
}
