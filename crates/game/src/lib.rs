//! Physical characters in a game engine: ragdolls from MJCF that move by learned policies, in any Bevy app.
//!
//! | this crate | Bevy |
//! |---|---|
//! | 0.1 | 0.19 |
//!
//! Add [`MarathonPlugin`], spawn a [`Ragdoll`], give it a [`Policy`]:
//!
//! ```no_run
//! use bevy::prelude::*;
//! use marathon_game::prelude::*;
//!
//! fn main() {
//!     App::new()
//!         .add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), MarathonPlugin))
//!         .add_systems(Startup, |mut commands: Commands, assets: Res<AssetServer>| {
//!             let policy = assets.load("policies/hopper.safetensors");
//!             commands.spawn((Ragdoll::agent("hopper"), Policy(policy)));
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
//! The simulation is that of `marathon train` and `marathon eval`: the same seed gives the same bits here and there,
//! whatever the frame rate.
//!
//! Ragdolls and the bodies of another physics engine can touch: the example `avian_props` has a hopper run into a wall of
//! avian's boxes.
//!
//! Without the feature `render` nothing draws and no renderer is compiled: what a server needs. With it (the default),
//! `look` has plugins that make ragdolls visible, and `marathon-game` is an app around them.

#[cfg(feature = "render")]
pub mod app;
pub mod asset;
pub mod axes;
mod characters;
mod ground;
#[cfg(feature = "render")]
pub mod look;
pub mod plugin;
pub mod ragdoll;
mod simulate;
pub mod stage;

pub use asset::{PolicyAsset, RagdollPrefab};
pub use ground::Ground;
pub use plugin::{MarathonPlugin, MarathonSystems};
pub use ragdoll::*;
pub use simulate::{Marathon, RagdollState};

/// What an app wants to have at hand.
pub mod prelude {
    #[cfg(feature = "render")]
    pub use crate::look::{
        ErrorColors, FollowCamera, FollowCameraPlugin, Ghost, GhostPlugin, LookPlugin, Marks, MarksPlugin, Quality,
        SceneryPlugin, Skin, SkinPlugin, Tint,
    };
    pub use crate::plugin::{MarathonPlugin, MarathonSystems};
    pub use crate::ragdoll::*;
    pub use crate::{Ground, Marathon, PolicyAsset, RagdollPrefab, RagdollState};
    pub use marathon_physics::Variation;
    pub use marathon_runs::Setting;
}
