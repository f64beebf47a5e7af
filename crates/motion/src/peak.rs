//! The largest value of a measure over a clip, and where it occurs.

use serde::Serialize;

/// The largest value of a measure over a clip, with its frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Peak {
    /// The value, in the unit of the field that holds it.
    pub value: f64,
    /// The frame.
    pub frame: usize,
    /// The joint, body or bodies.
    pub name: String,
}

impl Peak {
    /// Keeps a value if it is larger than the one so far.
    pub(crate) fn update(&mut self, value: f64, frame: usize, name: impl FnOnce() -> String) {
        if value > self.value {
            *self = Peak { value, frame, name: name() };
        }
    }
}
