//! Physical characters for Bevy: ragdolls from MJCF that move by learned policies, in any Bevy app.
//!
//! | `bevy_marathon` | Bevy |
//! |---|---|
//! | 0.1 | 0.19 |
//!
//! Add [`MarathonPlugin`], spawn a [`Ragdoll`], give it a [`CharacterPolicy`]:
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_marathon::prelude::*;
//!
//! fn main() {
//!     App::new()
//!         .add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), MarathonPlugin))
//!         .add_systems(Startup, |mut commands: Commands, assets: Res<AssetServer>| {
//!             let policy = assets.load("policies/hopper.safetensors");
//!             commands.spawn((Ragdoll::agent("hopper"), CharacterPolicy(policy)));
//!         })
//!         .add_systems(Update, |mut falls: MessageReader<EpisodeEnded>| {
//!             for fall in falls.read() {
//!                 println!("{:?} after {:.1} m", fall.end, fall.episode.distance);
//!             }
//!         })
//!         .run();
//! }
//! ```
//!
//! An agent that takes commands has an [`AgentCommand`]: `command.set("speed", 2.0)?` steers it. [`MoveDirection`] makes it walk
//! in a direction of the world, such as that of a stick as the camera sees it.
//!
//! The simulation is that of `marathon train` and `marathon eval`: the same seed gives the same bits in both,
//! at every frame rate.
//!
//! Ragdolls and the bodies of another physics engine can touch: in the example `avian_props`, a hopper runs into a wall of
//! avian's boxes.
//!
//! The plugin registers its components for reflection, so inspectors and scenes can read and write them. [`Anatomy`],
//! [`RagdollState`] and [`Unfit`] are not registered: the plugin makes them, and a scene cannot.
//!
//! # Features
//!
//! | feature | adds |
//! |---|---|
//! | `render` | the module `look`: plugins that draw ragdolls |
//! | `window` | `render`, and Bevy's window, input devices and glTF reader |
//! | `baseline` | kernels for x86-64 processors without fused multiply-add |
//!
//! None is a default: then nothing draws and no renderer is compiled, as a server needs it.

mod actuation;
mod animation;
pub mod asset;
pub mod axes;
mod characters;
mod command;
mod contact;
mod direction;
mod error;
mod ground;
mod height_field;
mod levels;
mod limbs;
mod lod;
#[cfg(feature = "render")]
pub mod look;
mod marathon;
mod messages;
mod mode;
mod obstacle;
mod place;
mod plugin;
pub mod pose;
mod ragdoll;
mod reactions;
mod report;
mod simulate;
mod snapshot;
mod strength;
mod track;

pub use animation::PlayClip;
pub use asset::{MotionClip, PolicyAsset, RagdollPrefab};
pub use characters::{PoseSample, spec_of_role};
pub use command::AgentCommand;
pub use direction::MoveDirection;
pub use error::{CommandError, RagdollError, SnapshotError, StrengthError};
pub use ground::{Ground, TRACK_HALF_WIDTH};
pub use height_field::HeightField;
pub use lod::{Lod, LodByDistance};
pub use marathon::{Marathon, RagdollState};
pub use messages::*;
pub use mode::RagdollMode;
pub use obstacle::{Collides, Obstacle, ObstacleMotion};
pub use place::CharacterPose;
pub use plugin::{MarathonPlugin, MarathonSystems};
pub use ragdoll::*;
pub use reactions::HitReactions;
pub use snapshot::{MarathonSnapshot, RagdollSnapshot};
pub use strength::LimbStrength;
pub use track::{Track, Tracks};

/// The names that most apps need.
pub mod prelude {
    #[cfg(feature = "render")]
    pub use crate::look::{
        DustPlugin, ErrorColors, FollowCamera, FollowCameraPlugin, FootLock, GeneratedSkin, GeneratedSkinPlugin, Ghost,
        GhostPlugin, LookPlugin, Marks, MarksPlugin, Quality, SceneryPlugin, Skin, SkinPlugin, Tint,
    };
    pub use crate::messages::*;
    pub use crate::plugin::{MarathonPlugin, MarathonSystems};
    pub use crate::ragdoll::*;
    pub use crate::{
        AgentCommand, CharacterPose, Collides, CommandError, Ground, HeightField, HitReactions, LimbStrength, Lod,
        LodByDistance, Marathon, MarathonSnapshot, MotionClip, MoveDirection, Obstacle, PlayClip, PolicyAsset,
        RagdollError, RagdollMode, RagdollPrefab, RagdollSnapshot, RagdollState, SnapshotError, StrengthError, Track,
        Tracks,
    };
    pub use marathon_physics::Variation;
    pub use marathon_runs::TaskConfig;
}

/// The programs of the README and of the documentation are compiled as tests.
#[cfg(all(doctest, feature = "window"))]
mod pages {
    #[doc = include_str!("../README.md")]
    struct Readme;

    #[doc = include_str!("../../../docs/tutorials/bevy.md")]
    struct Tutorial;

    #[doc = include_str!("../../../docs/reference/bevy.md")]
    struct Reference;
}
