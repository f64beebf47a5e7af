//! The mailbox between the picture and the thread that talks to another program.

use crate::app::stage::puppets::Kind;
use bevy::prelude::*;
use bevy_marathon::Episode;
use marathon_mlagents::EngineSettings;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The state of a character as its program sent it last.
#[derive(Clone, Debug, Default)]
pub struct RemotePose {
    /// Its configuration.
    pub qpos: Vec<f64>,
    /// Its episode.
    pub episode: Episode,
}

/// The mailbox between a thread and the picture.
#[derive(Default)]
pub struct Mailbox {
    /// The characters.
    pub poses: Vec<RemotePose>,
    /// Whether the picture has taken the poses, and needs new ones.
    pub taken: bool,
    /// Settings of the picture that the other side requests.
    pub engine: EngineSettings,
    /// Set when the other side has closed, or after an error.
    pub end: Option<Result<(), String>>,
}

/// The mailbox of a thread.
pub type Shared = Arc<Mutex<Mailbox>>;

/// Opens the mailbox.
pub fn open(shared: &Shared) -> MutexGuard<'_, Mailbox> {
    // a thread that panicked has left valid numbers
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Characters that another program moves.
#[derive(Resource, Clone)]
pub struct RemoteSource {
    /// Their body.
    pub kind: Kind,
    /// Number of characters on the screen.
    pub agents: usize,
    /// The mailbox of the thread.
    pub shared: Shared,
    /// The settings of the picture that have been applied.
    pub applied: EngineSettings,
}

impl RemoteSource {
    /// Characters without poses yet.
    pub fn new(kind: Kind, agents: usize) -> Self {
        RemoteSource { kind, agents, shared: Shared::default(), applied: EngineSettings::default() }
    }
}
