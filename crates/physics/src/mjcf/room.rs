//! How much memory a model may take.

use crate::budget::{MEMORY, OverBudget};
use std::cell::Cell;

/// Bytes of an element, with what the model keeps of it.
pub(crate) const ELEMENT: usize = 1000;
/// A simulation keeps a copy of its model.
const COPIES: f64 = 2.0;

/// Memory that a model has taken so far of what one file may ask for. Everything whose size a file decides is counted here
/// before it is made.
#[derive(Default)]
pub(crate) struct Room(Cell<f64>);

impl Room {
    /// Takes room for `count` things of `bytes` bytes.
    pub fn take(&self, count: usize, bytes: usize) -> Result<(), OverBudget> {
        self.0.set(self.0.get() + COPIES * count as f64 * bytes as f64);
        MEMORY.check(self.0.get())
    }
}
