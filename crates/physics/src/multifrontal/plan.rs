//! The symbolic factorization of a crowd: the fronts of its links, without numbers.
//!
//! The front of a link is the matrix of all variables in the link's elimination: the link itself, the links that
//! contacts or earlier eliminations connect it to, and the rows over joints with terms here or above. The remainder of
//! a front is added to the front of the member that is eliminated next.

use super::order::TreeOrder;
use super::tie::Tie;
use crate::lanes::Real;
use crate::sim::Link;

/// No link, no row, no place.
pub(crate) const NONE: usize = usize::MAX;
/// Rows of matrices start at multiples of this.
const ALIGN: usize = 8;

/// The front of a link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Front {
    /// First index of its other links in [`Plan::others`], and their number.
    pub others: usize,
    pub links: usize,
    /// The same for its rows in [`Plan::rows`], and in [`Plan::coefficients`].
    pub rows: usize,
    pub row_count: usize,
    pub coefficients: usize,
    /// Whether a row has a term in this link's joints.
    pub own_rows: bool,
    /// Width of the matrix, without and with padding.
    pub size: usize,
    pub stride: usize,
    /// Start of the matrix, and of the gains.
    pub matrix: usize,
    pub gains: usize,
    /// The link whose front receives the remainder.
    pub target: usize,
    /// Start of its places in the target's front in [`Plan::places`].
    pub places: usize,
    /// First of the fronts whose remainder comes here, and the next front with the same target.
    pub child: usize,
    pub sibling: usize,
    /// First contact of this front, and first row.
    pub tie: usize,
    pub row: usize,
}

impl Front {
    const EMPTY: Front = Front {
        others: 0,
        links: 0,
        rows: 0,
        row_count: 0,
        coefficients: 0,
        own_rows: false,
        size: 0,
        stride: 0,
        matrix: 0,
        gains: 0,
        target: NONE,
        places: 0,
        child: NONE,
        sibling: NONE,
        tie: NONE,
        row: NONE,
    };
}

/// A row over joints: its terms, in [`Plan::terms`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowTerms {
    pub start: usize,
    pub end: usize,
    /// The link in whose front it starts, and the next row there.
    pub enters: usize,
    pub next: usize,
}

/// Order and fronts. The memory is reused from step to step.
#[derive(Clone, Debug)]
pub(crate) struct Plan<S> {
    /// Links in elimination order, and the index of each in it.
    pub order: Vec<usize>,
    pub position: Vec<usize>,
    /// By link.
    pub fronts: Vec<Front>,
    pub others: Vec<usize>,
    pub rows: Vec<usize>,
    pub coefficients: Vec<S>,
    pub places: Vec<usize>,
    pub row_terms: Vec<RowTerms>,
    /// Terms of the rows: degree of freedom, its link, coefficient.
    pub terms: Vec<(usize, usize, S)>,
    /// Numbers in all matrices and all gains.
    pub matrix_len: usize,
    pub gains_len: usize,
    /// Number of entries of the factors, and of products that they take.
    pub fill: u64,
    trees: TreeOrder,
    /// Scratch: place in the current front, by link and by row.
    slot: Vec<usize>,
    row_slot: Vec<usize>,
}

impl<S: Real> Plan<S> {
    pub fn new() -> Self {
        Plan {
            order: Vec::new(),
            position: Vec::new(),
            fronts: Vec::new(),
            others: Vec::new(),
            rows: Vec::new(),
            coefficients: Vec::new(),
            places: Vec::new(),
            row_terms: Vec::new(),
            terms: Vec::new(),
            matrix_len: 0,
            gains_len: 0,
            fill: 0,
            trees: TreeOrder::default(),
            slot: Vec::new(),
            row_slot: Vec::new(),
        }
    }

    /// Orders the links. `ties` lists the links that contacts connect; rows are in `row_terms`.
    pub fn order<C>(&mut self, links: &[Link<C>], trees: usize, ties: impl Iterator<Item = [usize; 2]> + Clone) {
        let tree = |l: usize| links[l].tree;
        let rows = self.row_terms.iter().flat_map(|r| {
            let terms = &self.terms[r.start..r.end];
            terms.windows(2).map(|t| [t[0].1, t[1].1])
        });
        self.trees.find(trees, ties.chain(rows).map(|[a, b]| [tree(a), tree(b)]));
        // the links of a tree are consecutive, with its root first
        self.slot.clear();
        self.slot.resize(trees + 1, links.len());
        for l in (0..links.len()).rev() {
            self.slot[tree(l)] = l;
        }
        self.order.clear();
        for t in &self.trees.order {
            self.order.extend((self.slot[*t]..self.slot[*t + 1]).rev());
        }
        self.position.clear();
        self.position.resize(links.len(), 0);
        for (at, l) in self.order.iter().enumerate() {
            self.position[*l] = at;
        }
        self.fronts.clear();
        self.fronts.resize(links.len(), Front::EMPTY);
        for (i, row) in self.row_terms.iter_mut().enumerate().rev() {
            let enters = self.terms[row.start..row.end].iter().map(|t| t.1);
            row.enters = enters.min_by_key(|l| self.position[*l]).unwrap_or(NONE);
            if row.enters != NONE {
                row.next = std::mem::replace(&mut self.fronts[row.enters].row, i);
            }
        }
    }

    /// Finds the fronts, and the place of each tie's other link in its front.
    pub fn find_fronts<C>(&mut self, links: &[Link<C>], ties: &mut [Tie<S>]) {
        self.others.clear();
        self.rows.clear();
        self.coefficients.clear();
        self.places.clear();
        (self.matrix_len, self.gains_len, self.fill) = (0, 0, 0);
        self.slot.clear();
        self.slot.resize(links.len(), NONE);
        self.row_slot.clear();
        self.row_slot.resize(self.row_terms.len(), NONE);
        for at in 0..self.order.len() {
            let l = self.order[at];
            self.find_members(links, l, ties);
            self.measure(links, l);
            // places of the incoming remainders
            let mut t = self.fronts[l].tie;
            while t != NONE {
                ties[t].slot = self.slot[ties[t].links[1]];
                t = ties[t].next;
            }
            let mut child = self.fronts[l].child;
            while child != NONE {
                self.place(links, child);
                child = self.fronts[child].sibling;
            }
            self.find_target(links, l);
            // reset the scratch
            let f = self.fronts[l];
            self.slot[l] = NONE;
            for i in f.others..f.others + f.links {
                self.slot[self.others[i]] = NONE;
            }
            for i in f.rows..f.rows + f.row_count {
                self.row_slot[self.rows[i]] = NONE;
            }
        }
    }

    /// Lists the other links and the rows of a front.
    fn find_members<C>(&mut self, links: &[Link<C>], l: usize, ties: &[Tie<S>]) {
        (self.fronts[l].others, self.fronts[l].rows) = (self.others.len(), self.rows.len());
        self.slot[l] = 0;
        let mut t = self.fronts[l].tie;
        while t != NONE {
            self.join(ties[t].links[1]);
            t = ties[t].next;
        }
        let mut child = self.fronts[l].child;
        while child != NONE {
            let f = self.fronts[child];
            if let Some(p) = links[child].parent {
                self.join(p);
            }
            for i in f.others..f.others + f.links {
                self.join(self.others[i]);
            }
            for i in f.rows..f.rows + f.row_count {
                let row = self.rows[i];
                if self.next_place(row, child) != NONE {
                    self.join_row(row);
                }
            }
            child = f.sibling;
        }
        let mut row = self.fronts[l].row;
        while row != NONE {
            self.join_row(row);
            row = self.row_terms[row].next;
        }
        let f = &mut self.fronts[l];
        f.links = self.others.len() - f.others;
        f.row_count = self.rows.len() - f.rows;
    }

    fn join(&mut self, link: usize) {
        if self.slot[link] == NONE {
            self.slot[link] = 1;
            self.others.push(link);
        }
    }

    fn join_row(&mut self, row: usize) {
        if self.row_slot[row] == NONE {
            self.row_slot[row] = 1;
            self.rows.push(row);
        }
    }

    /// Sizes of a front, places of its members, and coefficients of its rows.
    fn measure<C>(&mut self, links: &[Link<C>], l: usize) {
        let mut f = self.fronts[l];
        for i in 0..f.links {
            self.slot[self.others[f.others + i]] = 6 * (1 + i);
        }
        f.coefficients = self.coefficients.len();
        let dofs = links[l].dofs.clone();
        for i in 0..f.row_count {
            let row = self.rows[f.rows + i];
            self.row_slot[row] = 6 * (1 + f.links) + i;
            let from = self.coefficients.len();
            self.coefficients.resize(from + dofs.len(), S::zero());
            let terms = self.row_terms[row];
            for (dof, link, coefficient) in &self.terms[terms.start..terms.end] {
                if *link == l {
                    self.coefficients[from + dof - dofs.start] += *coefficient;
                    f.own_rows = true;
                }
            }
        }
        f.size = 6 * (1 + f.links) + f.row_count;
        f.stride = f.size.next_multiple_of(ALIGN);
        (f.matrix, f.gains) = (self.matrix_len, self.gains_len);
        self.matrix_len += f.size * f.stride;
        self.gains_len += dofs.len() * f.stride;
        self.fill += (dofs.len() * f.size) as u64;
        self.fronts[l] = f;
    }

    /// Places of a front's remainder in its target: that of the parent, the other links, the rows.
    fn place<C>(&mut self, links: &[Link<C>], child: usize) {
        let f = self.fronts[child];
        self.fronts[child].places = self.places.len();
        let parent = links[child].parent.map_or(NONE, |p| self.slot[p]);
        self.places.push(parent);
        for i in f.others..f.others + f.links {
            self.places.push(self.slot[self.others[i]]);
        }
        for i in f.rows..f.rows + f.row_count {
            let row = self.rows[i];
            let stays = self.next_place(row, child) != NONE;
            self.places.push(if stays { self.row_slot[row] } else { NONE });
        }
    }

    /// Position in the order of the next link after `link` in which a row has a term.
    fn next_place(&self, row: usize, link: usize) -> usize {
        let (terms, here) = (self.row_terms[row], self.position[link]);
        let places = self.terms[terms.start..terms.end].iter().map(|t| self.position[t.1]);
        places.filter(|p| *p > here).min().unwrap_or(NONE)
    }

    /// Assigns the remainder of a front to the member that is eliminated next.
    fn find_target<C>(&mut self, links: &[Link<C>], l: usize) {
        let f = self.fronts[l];
        let mut next = links[l].parent.map_or(NONE, |p| self.position[p]);
        for i in f.others..f.others + f.links {
            next = next.min(self.position[self.others[i]]);
        }
        for i in f.rows..f.rows + f.row_count {
            next = next.min(self.next_place(self.rows[i], l));
        }
        if next == NONE {
            return;
        }
        let target = self.order[next];
        self.fronts[l].target = target;
        self.fronts[l].sibling = std::mem::replace(&mut self.fronts[target].child, l);
    }
}
