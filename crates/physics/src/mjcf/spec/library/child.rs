//! A model that others attach.

use super::super::super::compiler::Settings;
use super::super::super::document::Element;
use super::keys::Key;
use std::sync::Arc;

/// A model that others attach, without copies and includes.
pub(in super::super) struct Child {
    pub root: Element,
    /// Its file, relative to the main one.
    pub file: String,
    pub settings: Arc<Settings>,
    /// Its keyframes, whose numbers are in its elements.
    pub keys: Vec<Key>,
    /// Number of its elements.
    pub size: usize,
}
