//! Factors of the mass matrix of one kinematic tree.

use super::math::MIN_VAL;

/// Larger trees are factored along their branches, which is faster and rounds differently.
const LARGE: usize = 128;

/// A factored mass matrix.
pub(crate) enum Factor {
    /// Lower triangle `L` by rows, with `M = L L'`.
    Dense { n: usize, lower: Vec<f64> },
    /// `M = L' D L`. A row of `L` has entries only for the ancestors of its dof.
    Branches(Vec<Branch>),
}

/// A row of the factor.
pub(crate) struct Branch {
    /// Entry of `D`.
    diagonal: f64,
    /// The dof's ancestors, nearest first, and their entries in `L`.
    entries: Vec<(usize, f64)>,
}

impl Factor {
    /// Factors a matrix from the rows of its lower triangle. `parents` has each dof's next dof towards the root. `None`
    /// if the matrix is not positive definite.
    pub fn new(matrix: Vec<f64>, parents: &[Option<usize>]) -> Option<Self> {
        let n = parents.len();
        if n <= LARGE {
            return cholesky(matrix, n).map(|lower| Factor::Dense { n, lower });
        }
        branches(&matrix, parents).map(Factor::Branches)
    }

    /// `v inv(M) v'`.
    pub fn inverse_form(&self, mut v: Vec<f64>) -> f64 {
        match self {
            Factor::Dense { n, lower } => solve_lower(lower, *n, v).iter().map(|x| x * x).sum(),
            Factor::Branches(rows) => {
                let mut sum = 0.0;
                for (k, row) in rows.iter().enumerate().rev() {
                    let x = v[k];
                    // most entries stay zero
                    if x != 0.0 {
                        row.entries.iter().for_each(|(i, l)| v[*i] -= l * x);
                        sum += x * x / row.diagonal;
                    }
                }
                sum
            }
        }
    }

    /// `inv(M) v`.
    pub fn solve(&self, mut v: Vec<f64>) -> Vec<f64> {
        match self {
            Factor::Dense { n, lower } => solve_upper(lower, *n, solve_lower(lower, *n, v)),
            Factor::Branches(rows) => {
                for (k, row) in rows.iter().enumerate().rev() {
                    let x = v[k];
                    row.entries.iter().for_each(|(i, l)| v[*i] -= l * x);
                }
                for (k, row) in rows.iter().enumerate() {
                    let sum: f64 = row.entries.iter().map(|(i, l)| l * v[*i]).sum();
                    v[k] = v[k] / row.diagonal - sum;
                }
                v
            }
        }
    }
}

/// Solves `L' x = rhs`.
fn solve_upper(factor: &[f64], n: usize, mut x: Vec<f64>) -> Vec<f64> {
    for i in (0..n).rev() {
        x[i] /= factor[i * n + i];
        let (head, own) = x.split_at_mut(i);
        head.iter_mut().zip(&factor[i * n..]).for_each(|(x, l)| *x -= l * own[0]);
    }
    x
}

/// Eliminates each dof from its ancestors, from the leaves to the root, as in MuJoCo's `mj_factorM`.
fn branches(matrix: &[f64], parents: &[Option<usize>]) -> Option<Vec<Branch>> {
    let n = parents.len();
    let mut rows: Vec<Branch> = Vec::with_capacity(n);
    for (k, parent) in parents.iter().enumerate() {
        let mut entries = Vec::new();
        let mut ancestor = *parent;
        while let Some(i) = ancestor {
            entries.push((i, matrix[k * n + i]));
            ancestor = parents[i];
        }
        rows.push(Branch { diagonal: matrix[k * n + k], entries });
    }
    for k in (0..n).rev() {
        let (above, own) = rows.split_at_mut(k);
        let row = &mut own[0];
        if !(row.diagonal >= MIN_VAL) || !row.diagonal.is_finite() {
            return None;
        }
        for (m, (i, entry)) in row.entries.iter().enumerate() {
            let part = entry / row.diagonal;
            above[*i].diagonal -= part * entry;
            // an ancestor's own ancestors are the rest of the list
            for ((_, to), (_, from)) in above[*i].entries.iter_mut().zip(&row.entries[m + 1..]) {
                *to -= part * from;
            }
        }
        row.entries.iter_mut().for_each(|(_, entry)| *entry /= row.diagonal);
    }
    Some(rows)
}

/// Lower factor of a symmetric positive definite matrix; `None` for other matrices.
fn cholesky(mut a: Vec<f64>, n: usize) -> Option<Vec<f64>> {
    for j in 0..n {
        for i in j..n {
            let (row_i, row_j) = (&a[i * n..i * n + j], &a[j * n..j * n + j]);
            let sum = a[i * n + j] - row_i.iter().zip(row_j).map(|(x, y)| x * y).sum::<f64>();
            if i == j {
                if !(sum >= MIN_VAL) || !sum.is_finite() {
                    return None;
                }
                a[i * n + j] = sum.sqrt();
            } else {
                a[i * n + j] = sum / a[j * n + j];
            }
        }
    }
    Some(a)
}

/// Solves `L x = rhs`.
fn solve_lower(factor: &[f64], n: usize, mut x: Vec<f64>) -> Vec<f64> {
    for i in 0..n {
        let sum: f64 = factor[i * n..i * n + i].iter().zip(&x).map(|(l, x)| l * x).sum();
        x[i] = (x[i] - sum) / factor[i * n + i];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both methods give the same numbers.
    #[test]
    fn branches_agree_with_the_dense_factor() {
        let n = 40;
        let parents: Vec<Option<usize>> = (0..n).map(|k| (k > 0).then(|| (k * 7 + 3) % k)).collect();
        let rows: Vec<Vec<f64>> = (0..n)
            .map(|k| {
                let mut row = vec![0.0; n];
                let mut at = Some(k);
                while let Some(i) = at {
                    row[i] = 0.1 + ((k * 31 + i * 17) % 13) as f64 / 13.0;
                    at = parents[i];
                }
                row
            })
            .collect();
        // L' L has entries between ancestors only
        let entry = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum::<f64>();
        let matrix: Vec<f64> = (0..n * n).map(|at| entry(at / n, at % n)).collect();
        let dense = Factor::Dense { n, lower: cholesky(matrix.clone(), n).expect("positive") };
        let branches = Factor::Branches(branches(&matrix, &parents).expect("positive"));
        for k in 0..n {
            let v: Vec<f64> = (0..n).map(|i| ((i * k) % 5) as f64 - 1.5).collect();
            let (a, b) = (dense.inverse_form(v.clone()), branches.inverse_form(v.clone()));
            assert!((a - b).abs() < 1e-9 * a.abs(), "{a} and {b}");
            for factor in [&dense, &branches] {
                let x = factor.solve(v.clone());
                let back = (0..n).map(|i| (0..n).map(|j| entry(i, j) * x[j]).sum::<f64>());
                assert!(back.zip(&v).all(|(a, b)| (a - b).abs() < 1e-9), "{x:?}");
            }
        }
    }
}
