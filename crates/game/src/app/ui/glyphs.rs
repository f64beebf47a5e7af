//! Drawings of keys, buttons and sticks. They are made of shapes and text, so that they need no files.

use crate::app::input::device::PadShapes;
use crate::app::ui::theme::{TEXT, font};
use bevy::input::gamepad::GamepadButton;
use bevy_egui::egui::{Align2, Color32, Painter, Pos2, Rect, Sense, Shape, Stroke, StrokeKind, Ui, Vec2, vec2};

/// The color of a key cap or button, and of its edge.
const CAP: Color32 = Color32::from_rgb(44, 52, 62);
const EDGE: Color32 = Color32::from_rgb(190, 200, 210);
/// The colors of the buttons at the south, east, west and north.
const FACES: [Color32; 4] = [
    Color32::from_rgb(120, 210, 120),
    Color32::from_rgb(240, 120, 110),
    Color32::from_rgb(110, 170, 240),
    Color32::from_rgb(240, 210, 100),
];

/// A drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Glyph {
    /// A key, with its name.
    Key(&'static str),
    /// A button of a gamepad, with its name.
    Button(GamepadButton, &'static str),
    /// The left stick, pushed this far to the right and up, -1 to 1.
    Stick([f32; 2]),
}

/// Draws a glyph of a height, points.
pub fn glyph(ui: &mut Ui, glyph: Glyph, shapes: PadShapes, height: f32) {
    let width = match glyph {
        Glyph::Key(name) | Glyph::Button(_, name) if is_wide(glyph) => {
            let text = ui.painter().layout_no_wrap(name.into(), font(0.5 * height), TEXT);
            (text.size().x + 0.6 * height).max(height)
        }
        _ => height,
    };
    let (response, painter) = ui.allocate_painter(vec2(width, height), Sense::hover());
    let rect = response.rect.shrink(1.0);
    match glyph {
        Glyph::Key(name) => key(&painter, rect, name),
        Glyph::Button(button, name) => pad_button(&painter, rect, button, name, shapes),
        Glyph::Stick(push) => stick(&painter, rect, push),
    }
}

/// Whether a glyph is as wide as its text.
fn is_wide(glyph: Glyph) -> bool {
    match glyph {
        Glyph::Key(_) => true,
        Glyph::Button(button, _) => matches!(
            button,
            GamepadButton::LeftTrigger
                | GamepadButton::RightTrigger
                | GamepadButton::LeftTrigger2
                | GamepadButton::RightTrigger2
        ),
        Glyph::Stick(_) => false,
    }
}

/// A key cap.
fn key(painter: &Painter, rect: Rect, name: &str) {
    let radius = 0.18 * rect.height();
    painter.rect(rect, radius, EDGE.gamma_multiply(0.5), Stroke::NONE, StrokeKind::Inside);
    let top = rect.with_max_y(rect.bottom() - 0.1 * rect.height());
    painter.rect(top, radius, CAP, Stroke::new(1.2, EDGE), StrokeKind::Inside);
    painter.text(top.center(), Align2::CENTER_CENTER, name, font(0.5 * rect.height()), TEXT);
}

fn pad_button(painter: &Painter, rect: Rect, button: GamepadButton, name: &str, shapes: PadShapes) {
    let (center, radius) = (rect.center(), 0.48 * rect.height());
    let face = [GamepadButton::South, GamepadButton::East, GamepadButton::West, GamepadButton::North];
    if let Some(i) = face.iter().position(|known| *known == button) {
        painter.circle(center, radius, CAP, Stroke::new(1.5, FACES[i]));
        match shapes {
            PadShapes::Letters => {
                painter.text(center, Align2::CENTER_CENTER, name, font(0.6 * rect.height()), FACES[i]);
            }
            PadShapes::Shapes => face_shape(painter, center, 0.5 * radius, i),
        }
        return;
    }
    match button {
        GamepadButton::DPadUp => cross(painter, center, radius, vec2(0.0, -1.0)),
        GamepadButton::DPadDown => cross(painter, center, radius, vec2(0.0, 1.0)),
        GamepadButton::DPadLeft => cross(painter, center, radius, vec2(-1.0, 0.0)),
        GamepadButton::DPadRight => cross(painter, center, radius, vec2(1.0, 0.0)),
        GamepadButton::Start | GamepadButton::Select => {
            painter.circle(center, radius, CAP, Stroke::new(1.2, EDGE));
            let rows = if button == GamepadButton::Start { 3 } else { 2 };
            for row in 0..rows {
                let y = center.y + 0.32 * radius * (row as f32 - 0.5 * (rows as f32 - 1.0)) * 1.4;
                let ends = [Pos2::new(center.x - 0.5 * radius, y), Pos2::new(center.x + 0.5 * radius, y)];
                painter.line_segment(ends, Stroke::new(1.8, TEXT));
            }
        }
        GamepadButton::LeftThumb | GamepadButton::RightThumb => {
            painter.circle(center, radius, CAP, Stroke::new(1.2, EDGE));
            painter.circle_stroke(center, 0.7 * radius, Stroke::new(1.0, EDGE));
            painter.text(center, Align2::CENTER_CENTER, name, font(0.42 * rect.height()), TEXT);
        }
        _ => {
            painter.rect(rect, 0.35 * rect.height(), CAP, Stroke::new(1.2, EDGE), StrokeKind::Inside);
            painter.text(rect.center(), Align2::CENTER_CENTER, name, font(0.5 * rect.height()), TEXT);
        }
    }
}

/// Cross, circle, square or triangle.
fn face_shape(painter: &Painter, center: Pos2, size: f32, i: usize) {
    let stroke = Stroke::new(1.8, FACES[i]);
    match i {
        0 => {
            let arm = Vec2::splat(0.8 * size);
            painter.line_segment([center - arm, center + arm], stroke);
            let arm = vec2(arm.x, -arm.y);
            painter.line_segment([center - arm, center + arm], stroke);
        }
        1 => drop(painter.circle_stroke(center, size, stroke)),
        2 => {
            let square = Rect::from_center_size(center, Vec2::splat(1.7 * size));
            painter.rect_stroke(square, 0.0, stroke, StrokeKind::Middle);
        }
        _ => {
            let corners = [vec2(0.0, -1.0), vec2(0.95, 0.7), vec2(-0.95, 0.7)].map(|way| center + size * way);
            painter.add(Shape::closed_line(corners.to_vec(), stroke));
        }
    }
}

/// The cross of directions, with one arm lit.
fn cross(painter: &Painter, center: Pos2, radius: f32, lit: Vec2) {
    let arm = 0.6 * radius;
    for size in [vec2(2.0 * radius, arm), vec2(arm, 2.0 * radius)] {
        painter.rect_filled(Rect::from_center_size(center, size), 2.0, EDGE.gamma_multiply(0.6));
    }
    let size = vec2(arm, arm) + 0.25 * radius * lit.abs();
    painter.rect_filled(Rect::from_center_size(center + 0.62 * radius * lit, size), 2.0, TEXT);
}

/// A stick in its ring, with an arrow in the direction of the push.
fn stick(painter: &Painter, rect: Rect, [x, y]: [f32; 2]) {
    let (center, radius) = (rect.center(), 0.48 * rect.height());
    let push = vec2(x, -y);
    painter.circle(center, radius, CAP, Stroke::new(1.2, EDGE));
    painter.circle(center + 0.35 * radius * push, 0.5 * radius, EDGE, Stroke::NONE);
    painter.text(center + 0.35 * radius * push, Align2::CENTER_CENTER, "L", font(0.36 * rect.height()), CAP);
    if push != Vec2::ZERO {
        let way = push.normalized();
        let (tip, across) = (center + 0.98 * radius * way, vec2(-way.y, way.x));
        let base = tip - 0.22 * radius * way;
        let corners = vec![tip, base + 0.25 * radius * across, base - 0.25 * radius * across];
        painter.add(Shape::convex_polygon(corners, TEXT, Stroke::NONE));
    }
}
