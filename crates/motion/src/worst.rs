//! What is measured over a clip and told where it is worst.

use serde::Serialize;

/// Something measured over a clip where it is worst.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Worst {
    /// How bad; the unit is that of the field which holds it.
    pub value: f64,
    /// The frame.
    pub frame: usize,
    /// The joint, body or bodies.
    pub name: String,
}

impl Worst {
    pub(crate) fn meet(&mut self, value: f64, frame: usize, name: impl FnOnce() -> String) {
        if value > self.value {
            *self = Worst { value, frame, name: name() };
        }
    }
}
