//! The window of a screen, and its items, which a gamepad and the keyboard reach in turn.

use crate::app::ui::theme::ACCENT;
use bevy_egui::egui::{self, Align2, Button, Id, Response, RichText, ScrollArea, Stroke, StrokeKind, Ui, Vec2, Widget};

/// Free space beside and above the window, points.
const MARGIN: Vec2 = Vec2::new(44.0, 64.0);

/// The items of a screen.
#[derive(Default)]
pub struct Items {
    /// The first item takes the focus, because the screen has just appeared.
    pub fresh: bool,
}

impl Items {
    /// Adds an item. The first one of a new screen has the focus, and one that gets it becomes visible.
    pub fn add(&mut self, ui: &mut Ui, widget: impl Widget) -> Response {
        let response = ui.add(widget);
        if std::mem::take(&mut self.fresh) {
            response.request_focus();
        }
        if ui.memory(|memory| memory.has_focus(response.id)) {
            let stroke = Stroke::new(2.0, ACCENT);
            ui.painter().rect_stroke(response.rect.expand(1.0), 3.0, stroke, StrokeKind::Outside);
        }
        if response.gained_focus() {
            response.scroll_to_me(None);
        }
        response
    }

    /// Adds a large button.
    pub fn button(&mut self, ui: &mut Ui, label: &str) -> Response {
        self.add(ui, Button::new(RichText::new(format!("  {label}  ")).size(17.0)))
    }

    /// Adds a large button as wide as the window.
    pub fn wide_button(&mut self, ui: &mut Ui, label: &str) -> Response {
        let size = Vec2::new(ui.available_width(), 32.0);
        self.add(ui, Button::new(RichText::new(label).size(17.0)).min_size(size))
    }
}

/// The name of the area of the window.
pub fn id() -> Id {
    Id::new("menu")
}

/// Draws a window in the middle, at most as large as the picture. A list that is too long scrolls.
pub fn show(ctx: &egui::Context, title: &str, width: f32, draw: impl FnOnce(&mut Ui)) {
    let room = (ctx.content_rect().size() - MARGIN).max(Vec2::splat(80.0));
    let window = egui::Window::new(RichText::new(title).size(20.0).strong());
    // egui keeps the largest height of the first frame, when the text may not have its size yet
    let window = window.id(id()).anchor(Align2::CENTER_CENTER, [0.0, 0.0]).collapsible(false).auto_sized();
    let window = window.min_height(room.y - 24.0);
    window.show(ctx, |ui| {
        ui.set_width(width.min(room.x));
        // each screen scrolls by itself
        ScrollArea::vertical().id_salt(title).max_height(room.y - 24.0).show(ui, |ui| {
            ui.set_width(ui.available_width());
            // room for the frame of the first item
            ui.add_space(4.0);
            draw(ui);
        });
    });
}
