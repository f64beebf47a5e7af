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
//! Nothing here draws, and no renderer is compiled: a server needs no more, and a game has its own.

pub mod asset;
pub mod axes;
mod herd;
pub mod plugin;
pub mod ragdoll;
mod simulate;
pub mod stage;

pub use asset::{PolicyAsset, RagdollPrefab};
pub use plugin::{MarathonPlugin, MarathonSystems};
pub use ragdoll::*;
pub use simulate::{Marathon, RagdollState};

/// What an app wants to have at hand.
pub mod prelude {
    pub use crate::plugin::{MarathonPlugin, MarathonSystems};
    pub use crate::ragdoll::*;
    pub use crate::{Marathon, PolicyAsset, RagdollPrefab, RagdollState};
    pub use marathon_physics::Variation;
}
