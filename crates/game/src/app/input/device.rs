//! The device that the player uses: prompts show its keys or buttons.

use bevy::input::InputSystems;
use bevy::input::gamepad::{Gamepad, GamepadAxis};
use bevy::input::mouse::AccumulatedMouseMotion;
use bevy::prelude::*;
use serde::{Deserialize, Serialize};

/// Seconds for which the device in use must rest before another one takes its place.
const REST: f32 = 0.3;
/// Deflection of a stick that counts as use; a stick at rest drifts.
const STICK: f32 = 0.3;
/// Motion of the mouse in a frame that counts as use, pixels; a desk that shakes moves it less.
const MOUSE: f32 = 3.0;

/// A device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Device {
    /// Keyboard and mouse.
    #[default]
    Keyboard,
    /// Any gamepad.
    Pad,
}

/// The device that the player uses.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceInUse {
    /// The device.
    pub device: Device,
    /// Seconds since it was last used.
    rested: f32,
}

/// The drawings of the four buttons at the right of a gamepad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PadShapes {
    /// A, B, X and Y.
    #[default]
    Letters,
    /// Cross, circle, square and triangle.
    Shapes,
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<DeviceInUse>().add_systems(PreUpdate, watch.after(InputSystems));
}

impl DeviceInUse {
    /// Takes in which devices are used in a frame of `dt` seconds.
    fn update(&mut self, keyboard: bool, pad: bool, dt: f32) {
        let (own, other, next) = match self.device {
            Device::Keyboard => (keyboard, pad, Device::Pad),
            Device::Pad => (pad, keyboard, Device::Keyboard),
        };
        self.rested = if own { 0.0 } else { self.rested + dt };
        if other && !own && self.rested >= REST {
            *self = DeviceInUse { device: next, rested: 0.0 };
        }
    }
}

fn watch(
    time: Res<Time<Real>>,
    (keys, buttons): (Res<ButtonInput<KeyCode>>, Res<ButtonInput<MouseButton>>),
    motion: Res<AccumulatedMouseMotion>,
    pads: Query<&Gamepad>,
    mut in_use: ResMut<DeviceInUse>,
) {
    let keyboard = keys.get_pressed().len() > 0 || buttons.get_pressed().len() > 0 || motion.delta.length() > MOUSE;
    const AXES: [GamepadAxis; 4] =
        [GamepadAxis::LeftStickX, GamepadAxis::LeftStickY, GamepadAxis::RightStickX, GamepadAxis::RightStickY];
    let moved = |pad: &Gamepad| AXES.iter().any(|axis| pad.get(*axis).is_some_and(|x| x.abs() > STICK));
    let pad = pads.iter().any(|pad| pad.get_pressed().next().is_some() || moved(pad));
    let mut next = *in_use;
    next.update(keyboard, pad, time.delta_secs());
    in_use.set_if_neq(next);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_takes_over_after_the_other_has_rested() {
        let mut in_use = DeviceInUse::default();
        in_use.update(true, false, 0.1);
        for (keyboard, pad, expected) in [
            (false, true, Device::Keyboard),
            (false, false, Device::Keyboard),
            // a nudge of the desk does not count while the keyboard is in use
            (true, true, Device::Keyboard),
            (false, true, Device::Keyboard),
            (false, true, Device::Keyboard),
            (false, true, Device::Pad),
            (true, false, Device::Pad),
        ] {
            in_use.update(keyboard, pad, 0.11);
            assert_eq!(in_use.device, expected, "{in_use:?}");
        }
    }
}
