//! Appearance of ragdolls and their world: meshes and materials, ground, sky and sun, a camera that follows, marks for
//! contacts and joints. Every part is a separate plugin; add those that your game lacks.

mod blobs;
mod body;
mod camera;
mod dust;
mod effects;
mod foot_lock;
mod generated;
mod ghost;
mod ground;
mod lens;
mod marks;
mod meters;
mod obstacle;
mod orbit;
mod quality;
mod scenery;
mod skin;

pub use body::{LookPlugin, Tint, joint_places};
pub use camera::{CameraMode, FollowCamera, FollowCameraPlugin};
pub use dust::DustPlugin;
pub use foot_lock::FootLock;
pub use generated::{GeneratedSkin, GeneratedSkinPlugin, SkinGeneration};
pub use ghost::{ErrorColors, ErrorPalette, Ghost, GhostPlugin, part_errors};
pub use marks::{Marks, MarksPlugin, commanded_velocity};
pub use quality::Quality;
pub use scenery::SceneryPlugin;
pub use skin::{Dressed, Skin, SkinError, SkinPlugin, UnfitSkin};

/// Colors of a row of ragdolls, one after the other.
pub const TINTS: [[f32; 3]; 8] = [
    [0.93, 0.42, 0.16],
    [0.13, 0.53, 0.80],
    [0.22, 0.65, 0.38],
    [0.80, 0.27, 0.46],
    [0.50, 0.38, 0.78],
    [0.88, 0.66, 0.14],
    [0.10, 0.62, 0.62],
    [0.70, 0.36, 0.20],
];
