//! The plugin: its systems and their order.

use crate::actuation;
use crate::animation::{self, PlayClip};
use crate::asset::{MjcfLoader, MotionClip, MotionLoader, PolicyAsset, PolicyLoader, RagdollPrefab};
use crate::command::AgentCommand;
use crate::contact;
use crate::direction::{self, MoveDirection};
use crate::height_field::HeightField;
use crate::levels;
use crate::lod::{Lod, LodByDistance};
use crate::marathon::Marathon;
use crate::messages::{
    EpisodeBegan, EpisodeEnded, Fell, FootContact, GotUp, HitReceived, Landed, Push, RestartNow, SkillEnded,
    SkillStarted, TargetReached,
};
use crate::mode::RagdollMode;
use crate::obstacle::{Collides, Obstacle};
use crate::place::{self, CharacterPose};
use crate::ragdoll::{
    CharacterPolicy, Controls, Episode, Held, LaidGround, Opponent, OwnGround, Part, Physique, Ragdoll, Restart, Target,
};
use crate::reactions::HitReactions;
use crate::report;
use crate::simulate;
use crate::strength::LimbStrength;
use crate::track::{self, Track};
use bevy::prelude::*;

/// Ragdolls for any Bevy app.
///
/// The simulation runs in [`FixedUpdate`] whatever the timestep there: every kind of ragdoll decides at the rate of its
/// task. Frames show the state at their own time, between two decisions.
#[derive(Clone, Copy, Debug, Default)]
pub struct MarathonPlugin;

/// The systems of [`MarathonPlugin`], in their order. All but the last run in [`FixedUpdate`].
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MarathonSystems {
    /// New ragdolls enter the simulation; changed components and pushes are taken in. Write [`crate::Controls`], [`Push`]
    /// and [`RestartNow`] before this.
    Admit,
    /// Policies decide and the physics steps, for as many decisions as are due.
    Simulate,
    /// [`crate::Episode`]s and messages are written. Read them after this.
    Report,
    /// In [`RunFixedMainLoop`], after the fixed loop: the transforms of all parts and [`crate::CharacterPose`]s, at the time of the frame.
    Show,
}

impl Plugin for MarathonPlugin {
    fn build(&self, app: &mut App) {
        register_types(app);
        add_messages(app);
        app.init_asset::<RagdollPrefab>()
            .init_asset::<PolicyAsset>()
            .init_asset::<MotionClip>()
            .init_asset_loader::<MjcfLoader>()
            .init_asset_loader::<MotionLoader>()
            .init_asset_loader::<PolicyLoader>()
            .init_resource::<Marathon>()
            .configure_sets(
                FixedUpdate,
                (MarathonSystems::Admit, MarathonSystems::Simulate, MarathonSystems::Report).chain(),
            )
            .configure_sets(RunFixedMainLoop, MarathonSystems::Show.in_set(RunFixedMainLoopSystems::AfterFixedMainLoop))
            .add_systems(
                FixedUpdate,
                (
                    (
                        track::take_in,
                        simulate::admit,
                        direction::follow,
                        levels::by_distance,
                        simulate::take_in,
                        actuation::take_in,
                        animation::take_in,
                        contact::feel,
                        simulate::push,
                        levels::pack,
                    )
                        .chain()
                        .in_set(MarathonSystems::Admit),
                    simulate::simulate.in_set(MarathonSystems::Simulate),
                    (report::report, simulate::face_targets, animation::end).chain().in_set(MarathonSystems::Report),
                ),
            )
            .add_systems(
                RunFixedMainLoop,
                (track::take_in, place::show, simulate::show).chain().in_set(MarathonSystems::Show),
            )
            .add_observer(simulate::dismiss);
    }
}

fn add_messages(app: &mut App) {
    app.add_message::<Push>()
        .add_message::<RestartNow>()
        .add_message::<FootContact>()
        .add_message::<Landed>()
        .add_message::<Fell>()
        .add_message::<GotUp>()
        .add_message::<SkillStarted>()
        .add_message::<SkillEnded>()
        .add_message::<HitReceived>()
        .add_message::<EpisodeEnded>()
        .add_message::<EpisodeBegan>()
        .add_message::<TargetReached>();
}

/// Lets inspectors and scenes read and write the components.
fn register_types(app: &mut App) {
    app.register_type::<Ragdoll>()
        .register_type::<CharacterPolicy>()
        .register_type::<Opponent>()
        .register_type::<Controls>()
        .register_type::<Held>()
        .register_type::<AgentCommand>()
        .register_type::<MoveDirection>()
        .register_type::<LaidGround>()
        .register_type::<PlayClip>()
        .register_type::<Obstacle>()
        .register_type::<HeightField>()
        .register_type::<Collides>()
        .register_type::<Lod>()
        .register_type::<LodByDistance>()
        .register_type::<Target>()
        .register_type::<Physique>()
        .register_type::<RagdollMode>()
        .register_type::<LimbStrength>()
        .register_type::<HitReactions>()
        .register_type::<Restart>()
        .register_type::<OwnGround>()
        .register_type::<Episode>()
        .register_type::<CharacterPose>()
        .register_type::<Track>()
        .register_type::<Part>();
}
