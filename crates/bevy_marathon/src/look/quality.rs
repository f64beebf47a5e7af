//! Quality of the picture, and the color that distance fades into.

use bevy::prelude::*;

/// Color of the sky at the horizon, which the far ground fades into; sRGB.
pub(crate) const HORIZON: [f32; 3] = [0.80, 0.87, 0.93];

/// How much a frame may cost.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Reflect)]
#[reflect(Resource, Default, Clone, Debug, PartialEq)]
pub enum Quality {
    /// For software rendering: no shadows, no smoothed edges.
    Low,
    /// Shadows, edges smoothed.
    #[default]
    Medium,
    /// Larger shadow maps, seen farther.
    High,
}

impl Quality {
    /// How edges are smoothed.
    pub(crate) fn msaa(self) -> Msaa {
        if self == Quality::Low { Msaa::Off } else { Msaa::Sample4 }
    }
}
