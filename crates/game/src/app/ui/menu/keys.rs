//! The screen of keys and buttons. A click on one waits for the next press; a press that is taken asks.

use crate::app::input::bindings::{Bindable, Bindings};
use crate::app::input::device::Device;
use crate::app::input::key_names::{button_name, key_name};
use crate::app::input::rebind::Rebinding;
use crate::app::ui::menu::choice::Choice;
use crate::app::ui::menu::window::Items;
use crate::app::ui::theme::{ACCENT, FAINT, TEXT, text};
use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, Button, Grid, Order, Ui, Vec2, Window};

/// Size of a button of the table, points.
const CELL: Vec2 = Vec2::new(110.0, 20.0);

/// Draws the screen.
pub fn draw(
    ui: &mut Ui,
    items: &mut Items,
    bindings: &mut ResMut<Bindings>,
    rebinding: &mut Rebinding,
    device: Device,
) -> Choice {
    let words = match (&*rebinding, device) {
        (Rebinding::Waiting { what, device, left }, _) => {
            let name = bindings.row(*what).name;
            let press = if *device == Device::Pad { "Press a button" } else { "Press a key" };
            format!("{press} for: {name}. Esc, or {left:.0} s without one, leaves it as it is.")
        }
        (_, Device::Keyboard) => "Click a key or a button to change it.".into(),
        (_, Device::Pad) => "Choose a key or a button to change it.".into(),
    };
    ui.label(text(13.0, if rebinding.is_busy() { ACCENT } else { FAINT }, words));
    let rows: Vec<_> = bindings.rows().copied().collect();
    let steers = |what: Bindable| matches!(what, Bindable::Steer(_));
    for (heading, held) in [("Movement", true), ("Actions", false)] {
        ui.add_space(4.0);
        ui.label(text(15.0, ACCENT, heading).strong());
        Grid::new(heading).num_columns(3).spacing([16.0, 4.0]).min_col_width(120.0).show(ui, |ui| {
            for row in rows.iter().filter(|row| steers(row.what) == held) {
                ui.label(row.name);
                let cells = [
                    (Device::Keyboard, key_name(row.key)),
                    (Device::Pad, row.button.map_or("-", button_name)),
                ];
                for (device, name) in cells {
                    let waits = matches!(*rebinding, Rebinding::Waiting { what, device: of, .. } if (what, of) == (row.what, device));
                    let name = if waits { "..." } else { name };
                    if items.add(ui, Button::new(text(13.0, TEXT, name)).min_size(CELL)).clicked() {
                        rebinding.start(row.what, device);
                    }
                }
                ui.end_row();
            }
        });
    }
    ui.add_space(6.0);
    if items.button(ui, "Reset keys and buttons").clicked() {
        rebinding.cancel();
        bindings.set_if_neq(Bindings::default());
    }
    Choice::Stay
}

/// Asks about a press that is taken.
pub fn draw_conflict(ctx: &egui::Context, bindings: &mut ResMut<Bindings>, rebinding: &mut Rebinding) {
    let Rebinding::Taken { what, press, by } = *rebinding else { return };
    let [wanted, other] = [what, by].map(|what| bindings.row(what).name);
    let window = Window::new("Already in use").anchor(Align2::CENTER_CENTER, [0.0, 0.0]).collapsible(false);
    window.order(Order::Foreground).resizable(false).show(ctx, |ui| {
        ui.label(text(15.0, TEXT, format!("{} is for: {other}.", press.name())));
        ui.horizontal(|ui| {
            let swap = ui.button(text(15.0, TEXT, format!("Swap with: {wanted}")));
            let cancel = ui.button(text(15.0, TEXT, "Cancel"));
            let focused = ui.memory(|memory| memory.focused());
            if ![swap.id, cancel.id].map(Some).contains(&focused) {
                swap.request_focus();
            }
            if swap.clicked() {
                rebinding.swap(bindings);
            } else if cancel.clicked() {
                rebinding.cancel();
            }
        });
    });
}
