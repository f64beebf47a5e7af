//! The rows of one evaluation of the forces.

use super::block::Block;
use super::floor::FloorRow;
use super::joint::{DryRow, LimitRow};
use crate::lanes::Real;

/// All rows of one evaluation of the forces, by kind.
#[derive(Clone, Debug)]
pub(crate) struct ConstraintRows<T: Real> {
    /// Contacts with level planes.
    pub contacts: Vec<FloorRow<T>>,
    /// Limits of hinges and slides.
    pub limits: Vec<LimitRow<T>>,
    /// Dry friction of degrees of freedom.
    pub dry: Vec<DryRow<T>>,
    /// Everything else.
    pub blocks: Blocks<T>,
}

impl<T: Real> ConstraintRows<T> {
    /// Creates an empty list.
    pub fn new() -> Self {
        Self::with_capacity(0, 0, 0)
    }

    /// Creates an empty list with capacity for the first three kinds.
    pub fn with_capacity(contacts: usize, limits: usize, dry: usize) -> Self {
        ConstraintRows {
            contacts: Vec::with_capacity(contacts),
            limits: Vec::with_capacity(limits),
            dry: Vec::with_capacity(dry),
            blocks: Blocks::new(),
        }
    }

    /// Removes all rows.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.contacts.clear();
        self.limits.clear();
        self.dry.clear();
        self.blocks.clear();
    }
}

/// The blocks of a step. Their memory is reused from step to step.
#[derive(Clone, Debug)]
pub(crate) struct Blocks<T: Real> {
    items: Vec<Block<T>>,
    len: usize,
}

impl<T: Real> Blocks<T> {
    pub fn new() -> Self {
        Blocks { items: Vec::new(), len: 0 }
    }

    /// Removes all blocks.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Hides all blocks but the first `len`, or shows that many again. Returns the number that was shown.
    pub fn show(&mut self, len: usize) -> usize {
        std::mem::replace(&mut self.len, len.min(self.items.len()))
    }

    /// Adds a block and returns its index. Its contents are those of an earlier block.
    pub fn add(&mut self) -> usize {
        if self.len == self.items.len() {
            self.items.push(Block::new());
        }
        self.len += 1;
        self.len - 1
    }
}

impl<T: Real> std::ops::Deref for Blocks<T> {
    type Target = [Block<T>];
    #[inline(always)]
    fn deref(&self) -> &[Block<T>] {
        &self.items[..self.len]
    }
}

impl<T: Real> std::ops::DerefMut for Blocks<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [Block<T>] {
        &mut self.items[..self.len]
    }
}
