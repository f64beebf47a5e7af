//! Quality of the picture, and the color that distance fades into.

use bevy::prelude::*;

/// Color of the sky at the horizon, which the far ground fades into; sRGB.
pub(crate) const HORIZON: [f32; 3] = [0.80, 0.87, 0.93];

/// How much a frame may cost.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Reflect)]
#[reflect(Resource, Default, Clone, Debug, PartialEq)]
pub enum Quality {
    /// For integrated graphics and software rendering: soft discs below the bodies in place of shadows, edges not smoothed.
    Low,
    /// Shadows, edges smoothed.
    #[default]
    Medium,
    /// Larger shadow maps, seen farther; ambient occlusion, and shadows where bodies touch the ground.
    High,
}

impl Quality {
    /// How edges are smoothed in the picture's samples. Ambient occlusion needs a picture of one sample per pixel, whose edges
    /// a filter smooths.
    pub(crate) fn msaa(self) -> Msaa {
        if self == Quality::Medium { Msaa::Sample4 } else { Msaa::Off }
    }
}
