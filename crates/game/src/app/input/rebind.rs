//! Changes of bindings: the next key or button that is pressed is bound. If it is taken, the player decides.

use crate::app::input::bindings::{Bindable, Bindings, Press};
use crate::app::input::device::Device;
use crate::app::input::key_names::{BUTTON_NAMES, KEYS};
use bevy::input::InputSystems;
use bevy::input::gamepad::Gamepad;
use bevy::prelude::*;

/// Seconds in which a key or button must be pressed.
const PATIENCE: f32 = 6.0;

/// A change of a binding that is under way.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub enum Rebinding {
    /// None.
    #[default]
    Idle,
    /// The next press of the device is bound.
    Waiting {
        /// The one that gets it.
        what: Bindable,
        /// The device.
        device: Device,
        /// Seconds that remain.
        left: f32,
    },
    /// The press is taken: [`Rebinding::swap`] or [`Rebinding::cancel`].
    Taken {
        /// The one that would get it.
        what: Bindable,
        /// The key or button.
        press: Press,
        /// The one that has it.
        by: Bindable,
    },
}

/// The systems that bind.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct RebindSet;

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Rebinding>().add_systems(PreUpdate, rebind.in_set(RebindSet).after(InputSystems));
}

impl Rebinding {
    /// Binds the next press of a device.
    pub fn start(&mut self, what: Bindable, device: Device) {
        *self = Rebinding::Waiting { what, device, left: PATIENCE };
    }

    /// Whether the next press is to be bound.
    pub fn is_busy(&self) -> bool {
        matches!(self, Rebinding::Waiting { .. })
    }

    /// Leaves the bindings as they are.
    pub fn cancel(&mut self) {
        *self = Rebinding::Idle;
    }

    /// Binds the press that is taken. The one that has it gets the former one.
    pub fn swap(&mut self, bindings: &mut Bindings) {
        if let Rebinding::Taken { what, press, .. } = *self {
            bindings.bind(what, press);
        }
        *self = Rebinding::Idle;
    }
}

/// Binds the next press. Esc, or too long a wait, leaves the binding as it is.
fn rebind(
    time: Res<Time<Real>>,
    keys: Res<ButtonInput<KeyCode>>,
    pads: Query<&Gamepad>,
    mut bindings: ResMut<Bindings>,
    mut rebinding: ResMut<Rebinding>,
) {
    let Rebinding::Waiting { what, device, left } = *rebinding else { return };
    let left = left - time.delta_secs();
    let pressed = match device {
        _ if keys.just_pressed(KeyCode::Escape) || left <= 0.0 => return rebinding.cancel(),
        Device::Keyboard => KEYS.iter().map(|(key, _)| *key).find(|key| keys.just_pressed(*key)).map(Press::Key),
        Device::Pad => {
            let pressed = |button| pads.iter().any(|pad| pad.just_pressed(button));
            BUTTON_NAMES.iter().map(|(button, _)| *button).find(|button| pressed(*button)).map(Press::Button)
        }
    };
    *rebinding = match pressed.map(|press| (press, bindings.taken(what, press))) {
        None => Rebinding::Waiting { what, device, left },
        Some((press, Some(by))) => Rebinding::Taken { what, press, by },
        Some((press, None)) => {
            bindings.bind(what, press);
            Rebinding::Idle
        }
    };
}
