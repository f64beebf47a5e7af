//! Symmetric positive definite matrices whose entries lie near the diagonal.

/// The lower half of a matrix: entry `(i, j)` with `i - width < j <= i`.
#[derive(Clone)]
pub(super) struct Band {
    size: usize,
    width: usize,
    entries: Vec<f64>,
}

impl Band {
    /// Zeros.
    pub fn new(size: usize, width: usize) -> Self {
        Band { size, width, entries: vec![0.0; size * width] }
    }

    /// Adds to the entries `(i, j)` and `(j, i)`, which are one; callers visit each pair once.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let (i, j) = (i.max(j), i.min(j));
        self.entries[i * self.width + (i - j)] += value;
    }

    /// The diagonal entry.
    pub fn diagonal(&self, i: usize) -> f64 {
        self.entries[i * self.width]
    }

    /// Replaces the matrix, with `damping` of its diagonal added, by its Cholesky factor, and solves for `b` in place.
    /// False if the matrix is not positive definite.
    pub fn solve(&self, damping: f64, b: &mut [f64]) -> bool {
        let (n, w) = (self.size, self.width);
        let mut l = self.entries.clone();
        for i in 0..n {
            l[i * w] += damping * (self.diagonal(i) + 1e-6);
            let first = (i + 1).saturating_sub(w);
            for j in first..=i {
                let from = first.max((j + 1).saturating_sub(w));
                let mut sum = l[i * w + (i - j)];
                for k in from..j {
                    sum -= l[i * w + (i - k)] * l[j * w + (j - k)];
                }
                if j < i {
                    l[i * w + (i - j)] = sum / l[j * w];
                } else if sum > 0.0 {
                    l[i * w] = sum.sqrt();
                } else {
                    return false;
                }
            }
        }
        for i in 0..n {
            let mut sum = b[i];
            for k in (i + 1).saturating_sub(w)..i {
                sum -= l[i * w + (i - k)] * b[k];
            }
            b[i] = sum / l[i * w];
        }
        for i in (0..n).rev() {
            let mut sum = b[i];
            for k in i + 1..n.min(i + w) {
                sum -= l[k * w + (k - i)] * b[k];
            }
            b[i] = sum / l[i * w];
        }
        true
    }
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
