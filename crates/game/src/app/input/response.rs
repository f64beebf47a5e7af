//! The response to sticks, triggers and keys that steer: dead zone, curve, smoothing.

use bevy::prelude::*;

/// The response to the deflections of a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mapping {
    /// Deflection up to which a stick or trigger counts as released, 0 to 1. The response begins at 0 beyond it.
    pub dead_zone: f32,
    /// Response exponent; above 1 gives finer control near the center.
    pub curve: f32,
    /// Smoothing time constant, s (63 % of a change); 0 for none.
    pub smoothing: f32,
}

/// The mappings of gamepads and of the keyboard, whose keys have neither a dead zone nor a curve.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub struct Mappings {
    /// For gamepads.
    pub pad: Mapping,
    /// For the keyboard.
    pub keys: Mapping,
}

impl Default for Mappings {
    fn default() -> Self {
        let at_once = Mapping { dead_zone: 0.0, curve: 1.0, smoothing: 0.0 };
        Mappings { pad: Mapping { dead_zone: 0.12, ..at_once }, keys: at_once }
    }
}

impl Mapping {
    /// The response to a deflection.
    pub fn map(&self, x: f32) -> f32 {
        let beyond = ((x.abs() - self.dead_zone) / (1.0 - self.dead_zone)).clamp(0.0, 1.0);
        beyond.powf(self.curve) * x.signum()
    }

    /// The smoothed response, `dt` seconds after it was `before`.
    pub fn smooth(&self, before: f32, now: f32, dt: f32) -> f32 {
        // a difference too small to see ends, so that a released stick comes to rest
        if self.smoothing <= 0.0 || (now - before).abs() < 1e-3 {
            return now;
        }
        now + (before - now) * (-dt / self.smoothing).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dead_zone_hides_a_released_stick() {
        let pad = Mappings::default().pad;
        assert_eq!([0.0, 0.1, -0.12].map(|x| pad.map(x).abs()), [0.0; 3]);
        assert!([1.0, -1.0] == [1.0, -1.0].map(|x| pad.map(x)) && pad.map(0.13) > 0.0 && pad.map(0.13) < 0.02);
    }

    #[test]
    fn a_curve_leaves_the_ends_and_a_smoothed_stick_arrives() {
        let mapping = Mapping { dead_zone: 0.0, curve: 2.0, smoothing: 0.1 };
        assert_eq!([-1.0, -0.5, 0.0, 0.5, 1.0].map(|x| mapping.map(x)), [-1.0, -0.25, 0.0, 0.25, 1.0]);
        // 63 % after the time of the smoothing, whatever the frames; all of it in the end
        for frames in [6u8, 25] {
            let mut said = 0.0;
            for _ in 0..frames {
                said = mapping.smooth(said, 1.0, 0.1 / f32::from(frames));
            }
            assert!((said - (1.0 - (-1.0f32).exp())).abs() < 1e-3, "{said}");
        }
        let arrived = (0..100).fold(0.0, |said, _| mapping.smooth(said, 1.0, 1.0 / 60.0));
        assert_eq!(arrived, 1.0);
        assert_eq!(Mappings::default().keys.smooth(0.0, 1.0, 1.0 / 60.0), 1.0);
    }
}
