//! Events of ragdolls, in the axes of the physics.

use crate::messages::End;
use crate::ragdoll::Episode;
use serde::{Deserialize, Serialize};

/// An event of a ragdoll.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) enum Event {
    /// A foot: its lowest point, m, and its speed, m/s.
    Foot {
        foot: usize,
        down: bool,
        point: [f64; 3],
        speed: f64,
    },
    Landed {
        speed: f64,
        seconds: f64,
    },
    /// A button of the command takes effect, or no longer.
    Skill {
        button: usize,
        on: bool,
    },
    Fell {
        prone: bool,
    },
    GotUp,
    Hit {
        body: usize,
        impulse: [f64; 3],
    },
    Ended(End, Episode),
    Began(u64),
}
