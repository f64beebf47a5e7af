//! Elimination order of the trees of a crowd.
//!
//! Eliminating a tree connects all trees that it touches. The tree with the fewest neighbors goes first, and the lower
//! number if several have as many (minimum degree). In a pile, this eliminates the rim first, and islands stay
//! separate.

/// Order of trees by minimum degree. The memory is reused from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct TreeOrder {
    /// Trees that touch another, ascending, and the index of each tree among them.
    tied: Vec<usize>,
    place: Vec<usize>,
    /// Bit rows: which of them touch or are connected by an elimination.
    bits: Vec<u64>,
    words: usize,
    degree: Vec<u32>,
    pivot: Vec<u64>,
    /// All trees in elimination order.
    pub order: Vec<usize>,
}

/// Number of trees above which the model's order is used: the bit rows grow with the square.
const MOST: usize = 4096;
/// A tree that touches no other.
const ALONE: usize = usize::MAX;
/// Degree of a tree that is eliminated.
const GONE: u32 = u32::MAX;

impl TreeOrder {
    /// Finds the order of `trees` trees, of which `touching` lists those that touch each other.
    pub fn find(&mut self, trees: usize, touching: impl Iterator<Item = [usize; 2]> + Clone) {
        self.place.clear();
        self.place.resize(trees, ALONE);
        for pair in touching.clone().filter(|p| p[0] != p[1]) {
            pair.iter().for_each(|t| self.place[*t] = 0);
        }
        self.order.clear();
        self.tied.clear();
        for tree in 0..trees {
            if self.place[tree] == ALONE {
                self.order.push(tree);
            } else {
                self.place[tree] = self.tied.len();
                self.tied.push(tree);
            }
        }
        if self.tied.len() > MOST {
            self.order.extend_from_slice(&self.tied);
            return;
        }
        self.connect(touching);
        while let Some(next) = self.least() {
            self.order.push(self.tied[next]);
            self.eliminate(next);
        }
    }

    fn connect(&mut self, touching: impl Iterator<Item = [usize; 2]>) {
        let n = self.tied.len();
        self.words = n.div_ceil(64);
        self.bits.clear();
        self.bits.resize(n * self.words, 0);
        for pair in touching.filter(|p| p[0] != p[1]) {
            let [a, b] = pair.map(|t| self.place[t]);
            self.bits[a * self.words + b / 64] |= 1 << (b % 64);
            self.bits[b * self.words + a / 64] |= 1 << (a % 64);
        }
        self.degree.clear();
        for row in 0..n {
            let degree = self.row(row).iter().map(|w| w.count_ones()).sum();
            self.degree.push(degree);
        }
    }

    fn row(&self, i: usize) -> &[u64] {
        &self.bits[i * self.words..(i + 1) * self.words]
    }

    fn least(&self) -> Option<usize> {
        let (index, degree) = self.degree.iter().enumerate().min_by_key(|(_, d)| **d)?;
        (*degree != GONE).then_some(index)
    }

    /// Connects the neighbors of a tree and removes the tree.
    fn eliminate(&mut self, gone: usize) {
        let words = self.words;
        let mut pivot = std::mem::take(&mut self.pivot);
        pivot.clear();
        pivot.extend_from_slice(self.row(gone));
        for word in 0..words {
            let mut left = pivot[word];
            while left != 0 {
                let neighbor = 64 * word + left.trailing_zeros() as usize;
                left &= left - 1;
                let row = &mut self.bits[neighbor * words..(neighbor + 1) * words];
                for (bits, more) in row.iter_mut().zip(&pivot) {
                    *bits |= more;
                }
                row[neighbor / 64] &= !(1 << (neighbor % 64));
                row[gone / 64] &= !(1 << (gone % 64));
                self.degree[neighbor] = row.iter().map(|w| w.count_ones()).sum();
            }
        }
        self.degree[gone] = GONE;
        self.pivot = pivot;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(trees: usize, touching: &[[usize; 2]]) -> Vec<usize> {
        let mut order = TreeOrder::default();
        order.find(trees, touching.iter().copied());
        order.order
    }

    #[test]
    fn rims_go_first() {
        // a star: the center is last but one, when one arm is left and the lower number decides
        assert_eq!(order(5, &[[2, 0], [2, 1], [2, 3], [4, 2]]), [0, 1, 3, 2, 4]);
        // trees that touch nothing come before all others
        assert_eq!(order(4, &[[0, 3]]), [1, 2, 0, 3]);
    }

    #[test]
    fn neighbors_of_an_eliminated_tree_are_tied() {
        // a ring of six: each elimination leaves a smaller ring
        let ring: Vec<[usize; 2]> = (0..6).map(|i| [i, (i + 1) % 6]).collect();
        let mut order = TreeOrder::default();
        order.find(6, ring.iter().copied());
        assert_eq!(order.order[0], 0);
        let mut sorted = order.order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, [0, 1, 2, 3, 4, 5]);
    }
}
