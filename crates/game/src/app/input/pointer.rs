//! The left mouse button over the picture: a click, or a drag.

use crate::app::mode::AppSet;
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use bevy_egui::input::EguiWantsInput;

/// Distance from which on a movement with the button held is a drag, points.
const FAR: f32 = 6.0;
/// Seconds after which a held button is a drag.
const LONG: f32 = 0.25;

/// The pointer over the picture.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct Pointer {
    /// The cursor, points of the window, if it is in the window.
    pub cursor: Option<Vec2>,
    /// The use of the left button in this frame.
    pub gesture: Gesture,
}

/// The use of the left button.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Gesture {
    /// It is up, or held over text and bars.
    #[default]
    None,
    /// It has been pressed at this place; it is not known yet whether this is a click.
    Pressed {
        /// Place of the press, points.
        from: Vec2,
        /// Seconds since then.
        seconds: f32,
    },
    /// It has been pressed and released at this place.
    Click(Vec2),
    /// It is being held since it was pressed at this place.
    Drag(Vec2),
}

impl Gesture {
    /// The gesture of the next frame, in which the button is down or not, and has just been pressed or not.
    fn next(self, down: bool, just_pressed: Option<Vec2>, cursor: Option<Vec2>, dt: f32) -> Self {
        if let Some(from) = just_pressed {
            return Gesture::Pressed { from, seconds: 0.0 };
        }
        match (self, down) {
            (Gesture::Pressed { from, seconds }, true) => {
                let seconds = seconds + dt;
                let moved = cursor.is_some_and(|at| at.distance(from) >= FAR);
                if moved || seconds >= LONG { Gesture::Drag(from) } else { Gesture::Pressed { from, seconds } }
            }
            (Gesture::Pressed { from, .. }, false) => Gesture::Click(from),
            (Gesture::Drag(from), true) => Gesture::Drag(from),
            _ => Gesture::None,
        }
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Pointer>().add_systems(Update, read.in_set(AppSet::Input));
}

fn read(
    time: Res<Time<Real>>,
    buttons: Res<ButtonInput<MouseButton>>,
    wants: Option<Res<EguiWantsInput>>,
    window: Query<&Window, With<PrimaryWindow>>,
    mut pointer: ResMut<Pointer>,
) {
    let over_ui = wants.is_some_and(|w| w.wants_any_pointer_input());
    let cursor = window.iter().next().and_then(Window::cursor_position);
    let pressed = cursor.filter(|_| buttons.just_pressed(MouseButton::Left) && !over_ui);
    let gesture = pointer.gesture.next(buttons.pressed(MouseButton::Left), pressed, cursor, time.delta_secs());
    pointer.set_if_neq(Pointer { cursor, gesture });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_button_clicks_or_drags() {
        let at = Vec2::new(100.0, 50.0);
        let pressed = Gesture::None.next(true, Some(at), Some(at), 0.02);
        assert_eq!(pressed.next(false, None, Some(at), 0.02), Gesture::Click(at));
        // it moves away, or is held for a while
        assert_eq!(pressed.next(true, None, Some(at + 10.0), 0.02), Gesture::Drag(at));
        assert_eq!(pressed.next(true, None, Some(at), 0.3), Gesture::Drag(at));
        assert_eq!(Gesture::Drag(at).next(false, None, Some(at), 0.02), Gesture::None);
        assert_eq!(Gesture::Click(at).next(false, None, Some(at), 0.02), Gesture::None);
        // a press over a panel is none
        assert_eq!(Gesture::None.next(true, None, Some(at), 0.02), Gesture::None);
    }
}
