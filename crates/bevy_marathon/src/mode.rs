//! Whether a character acts, lies limp or gets up.

use bevy::prelude::*;

/// Use that a [`Ragdoll`](crate::Ragdoll) makes of its actuators. The plugin writes it after every decision, and an app can set it.
///
/// An app that sets `Limp` takes all strength from the character, as after a fall. Its episode then stands still until the
/// app sets `Powered`, or [`RestartNow`](crate::RestartNow) begins the next one. `Powered` gives the character back to its
/// policy, wherever it lies. One whose task goes on after a fall then gets up. For the others, the task fails again, and
/// [`Restart`](crate::Restart) says what follows.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub enum RagdollMode {
    /// Its policy or its [`Controls`](crate::Controls) act.
    #[default]
    Powered,
    /// It has no strength: the app has set this, or it lies after a fall, see [`Restart`](crate::Restart).
    Limp,
    /// It has fallen, and its policy gets it up. Only the plugin writes this, for tasks that report
    /// [`rising`](marathon_envs::Spec::rising); an app that sets it gets `Powered`.
    GettingUp,
    /// A [`PlayClip`](crate::PlayClip) moves it. Only the plugin writes this.
    Animated,
}
