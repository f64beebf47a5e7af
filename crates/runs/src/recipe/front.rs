//! What a front end shows and decides while a recipe runs.

/// What a front end does while a recipe runs.
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
