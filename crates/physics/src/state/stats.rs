//! Counts of the constraint solver's work.

/// Counts of the constraint solver's work, summed over steps since the `Work` was created.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SolverStats {
    /// Solves of a lane group.
    pub solves: u64,
    /// Newton iterations of a lane group (that of its slowest lane).
    pub newton: u64,
    /// Line search iterations.
    pub line_search: u64,
    /// Largest number of Newton iterations in a solve.
    pub max_newton: u64,
    /// Lanes that hit the iteration cap before they converged.
    pub unconverged: u64,
    /// Contacts, summed over lanes.
    pub contacts: u64,
    /// Contacts in the union of a group's lanes.
    pub contact_rows: u64,
    /// Tested pairs of geoms, of lane groups.
    pub pairs: u64,
    /// Factorizations of single crowded agents instead of lane groups.
    pub crowded: u64,
    /// Entries of their computed factors, a measure of their cost.
    pub entries: u64,
}

impl SolverStats {
    /// Adds another thread's counts.
    pub fn add(&mut self, other: &SolverStats) {
        self.solves += other.solves;
        self.newton += other.newton;
        self.line_search += other.line_search;
        self.max_newton = self.max_newton.max(other.max_newton);
        self.unconverged += other.unconverged;
        self.contacts += other.contacts;
        self.contact_rows += other.contact_rows;
        self.pairs += other.pairs;
        self.crowded += other.crowded;
        self.entries += other.entries;
    }

    /// Subtracts earlier counts (the largest iteration count stays).
    pub(crate) fn subtract(&mut self, earlier: &SolverStats) {
        self.solves -= earlier.solves;
        self.newton -= earlier.newton;
        self.line_search -= earlier.line_search;
        self.unconverged -= earlier.unconverged;
        self.contacts -= earlier.contacts;
        self.contact_rows -= earlier.contact_rows;
        self.pairs -= earlier.pairs;
        self.crowded -= earlier.crowded;
        self.entries -= earlier.entries;
    }
}
