//! The front end's part while a recipe runs.

/// The front end's part: it shows lines, and may stop the recipe.
pub struct Front<'a> {
    /// Shows a line.
    pub note: &'a mut dyn FnMut(String),
    /// Whether the user wants to stop.
    pub stop: &'a dyn Fn() -> bool,
    /// Whether to show a bar or lines of progress on stderr.
    pub show: bool,
}

impl Front<'_> {
    /// Shows a line.
    pub(super) fn note(&mut self, text: String) {
        (self.note)(text);
    }

    /// Whether the user wants to stop.
    pub(super) fn stops(&self) -> bool {
        (self.stop)()
    }
}
