//! Symmetric positive definite band matrices.

/// The lower half of a matrix: entry `(i, j)` with `i - width < j <= i`.
#[derive(Clone)]
pub(super) struct Band {
    size: usize,
    width: usize,
    entries: Vec<f64>,
}

impl Band {
    /// Creates a zero matrix.
    pub fn new(size: usize, width: usize) -> Self {
        Band { size, width, entries: vec![0.0; size * width] }
    }

    /// Index of the entry `(i, j)`, `j <= i`. Entries of a row are adjacent.
    fn at(&self, i: usize, j: usize) -> usize {
        i * self.width + self.width - 1 - (i - j)
    }

    /// Adds to the entries `(i, j)` and `(j, i)`, which are stored once. Callers visit each pair once.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let at = self.at(i.max(j), i.min(j));
        self.entries[at] += value;
    }

    /// Replaces the matrix, with `damping` times its diagonal added, by its Cholesky factor, and solves for `b` in
    /// place. Returns false if the matrix is not positive definite.
    pub fn solve(&mut self, damping: f64, b: &mut [f64]) -> bool {
        let (n, w) = (self.size, self.width);
        for i in 0..n {
            let diagonal = self.at(i, i);
            self.entries[diagonal] += damping * (self.entries[diagonal] + 1e-6);
            let first = (i + 1).saturating_sub(w);
            for j in first..=i {
                let from = first.max((j + 1).saturating_sub(w));
                let (row, other) = (self.at(i, from), self.at(j, from));
                let known = dot(&self.entries[row..row + j - from], &self.entries[other..other + j - from]);
                let at = self.at(i, j);
                let rest = self.entries[at] - known;
                if j < i {
                    self.entries[at] = rest / self.entries[self.at(j, j)];
                } else if rest > 0.0 {
                    self.entries[at] = rest.sqrt();
                } else {
                    return false;
                }
            }
        }
        for i in 0..n {
            let first = (i + 1).saturating_sub(w);
            let row = self.at(i, first);
            let known = dot(&self.entries[row..row + i - first], &b[first..i]);
            b[i] = (b[i] - known) / self.entries[self.at(i, i)];
        }
        for i in (0..n).rev() {
            b[i] /= self.entries[self.at(i, i)];
            let first = (i + 1).saturating_sub(w);
            for j in first..i {
                b[j] -= self.entries[self.at(i, j)] * b[i];
            }
        }
        true
    }
}

/// The dot product, in eight independent sums for vectorization. Their order is fixed.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut strands = [0.0; 8];
    let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for k in 0..8 {
            strands[k] += a[k] * b[k];
        }
    }
    let [a, b, c, d, e, f, g, h] = strands;
    ((a + e) + (b + f)) + ((c + g) + (d + h)) + rest
}

#[cfg(test)]
mod tests {
    use super::Band;

    #[test]
    fn a_banded_system_is_solved() {
        let (n, w) = (7, 3);
        let mut band = Band::new(n, w);
        let mut dense = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in i.saturating_sub(w - 1)..=i {
                let value = if i == j { 4.0 + i as f64 } else { 1.0 / (1.0 + (i * j) as f64) };
                band.add(i, j, value);
                dense[i][j] = value;
                dense[j][i] = value;
            }
        }
        let x: Vec<f64> = (0..n).map(|i| (i as f64) - 2.5).collect();
        let mut b: Vec<f64> = dense.iter().map(|row| row.iter().zip(&x).map(|(a, x)| a * x).sum()).collect();
        assert!(band.solve(0.0, &mut b));
        for (b, x) in b.iter().zip(&x) {
            assert!((b - x).abs() < 1e-12);
        }
    }
}
