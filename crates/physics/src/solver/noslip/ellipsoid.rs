//! The friction force of a contact with an elliptic cone and a fixed normal force.

use crate::model::vector::MIN_VAL;
use crate::state::MOST_ROWS;

/// Change of the multiplier, excess of the squared force, and determinants and pivots below which MuJoCo stops.
const ENOUGH: f64 = 1e-10;
const MOST_STEPS: usize = 20;

type Vector = [f64; MOST_ROWS];
type Matrix = [[f64; MOST_ROWS]; MOST_ROWS];

/// Minimizes `1/2 x' A x + b' x` with `sum_i (x_i / mu_i)^2 <= r^2` in `n` dimensions. Newton's method for the
/// multiplier, with the limits of MuJoCo's: the answer may be approximate, and it is zero if A is nearly singular.
pub(super) fn minimize(a: &Matrix, b: &Vector, mu: &Vector, r: f64, n: usize) -> Vector {
    // in units of mu the ellipsoid is a ball
    let (mut scaled, mut force) = ([[0.0; MOST_ROWS]; MOST_ROWS], [0.0; MOST_ROWS]);
    for i in 0..n {
        force[i] = -(b[i] * mu[i]);
        for j in 0..n {
            scaled[i][j] = a[i][j] * mu[i] * mu[j];
        }
    }
    let (mut multiplier, mut x) = (0.0, [0.0; MOST_ROWS]);
    for _ in 0..MOST_STEPS {
        let mut shifted = scaled;
        for i in 0..n {
            shifted[i][i] += multiplier;
        }
        let Some(factor) = factorize(&shifted, n) else { return [0.0; MOST_ROWS] };
        x = solve(&factor, &force, n);
        let excess = dot(&x, &x, n) - r * r;
        if excess < ENOUGH {
            break;
        }
        // the derivative of the squared length by the multiplier is -2 x' inv(A) x
        let step = excess / (2.0 * dot(&x, &solve(&factor, &x, n), n));
        // not a number: rounding has lost the answer
        if step < ENOUGH || step.is_nan() {
            break;
        }
        multiplier += step;
    }
    let mut out = [0.0; MOST_ROWS];
    let mut square = 0.0;
    for i in 0..n {
        out[i] = x[i] * mu[i];
        square += out[i] * out[i] / (mu[i] * mu[i]);
    }
    if multiplier != 0.0 {
        let onto = (r * r / square.max(MIN_VAL)).sqrt();
        out.iter_mut().take(n).for_each(|x| *x *= onto);
    }
    out
}

/// Cholesky factor, lower triangle. `None` if MuJoCo takes the matrix for singular: for up to three dimensions by its
/// determinant, else by the pivots.
fn factorize(a: &Matrix, n: usize) -> Option<Matrix> {
    let mut l = [[0.0; MOST_ROWS]; MOST_ROWS];
    let mut determinant = 1.0;
    for j in 0..n {
        let pivot = a[j][j] - dot(&l[j], &l[j], j);
        determinant *= pivot;
        if pivot <= 0.0 || pivot.is_nan() || (n > 3 && pivot < ENOUGH) {
            return None;
        }
        l[j][j] = pivot.sqrt();
        for i in j + 1..n {
            l[i][j] = (a[i][j] - dot(&l[i], &l[j], j)) / l[j][j];
        }
    }
    (n > 3 || determinant >= ENOUGH).then_some(l)
}

/// Solves with a Cholesky factor.
fn solve(l: &Matrix, b: &Vector, n: usize) -> Vector {
    let mut x = *b;
    for i in 0..n {
        x[i] = (x[i] - dot(&l[i], &x, i)) / l[i][i];
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            x[i] -= l[k][i] * x[k];
        }
        x[i] /= l[i][i];
    }
    x
}

/// Product of the first `n` entries.
pub(super) fn dot(a: &Vector, b: &Vector, n: usize) -> f64 {
    a.iter().zip(b).take(n).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A weak and coupled 2 x 2 problem with the minimum at (-1, 2).
    fn problem() -> (Matrix, Vector, Vector) {
        let (mut a, mut b, mut mu) = ([[0.0; MOST_ROWS]; MOST_ROWS], [0.0; MOST_ROWS], [0.0; MOST_ROWS]);
        (a[0][0], a[0][1], a[1][0], a[1][1]) = (2.0, 0.5, 0.5, 1.0);
        (b[0], b[1]) = (1.0, -1.5);
        (mu[0], mu[1]) = (0.5, 1.0);
        (a, b, mu)
    }

    #[test]
    fn a_wide_ellipsoid_has_the_free_minimum_inside() {
        let (a, b, mu) = problem();
        let x = minimize(&a, &b, &mu, 10.0, 2);
        assert!((x[0] + 1.0).abs() < 1e-12 && (x[1] - 2.0).abs() < 1e-12, "{x:?}");
    }

    #[test]
    fn on_the_surface_the_gradient_is_along_the_normal() {
        let (a, b, mu) = problem();
        let x = minimize(&a, &b, &mu, 1.0, 2);
        let square = (x[0] / mu[0]).powi(2) + (x[1] / mu[1]).powi(2);
        assert!((square - 1.0).abs() < 1e-12, "{square}");
        let gradient = [0, 1].map(|i| a[i][0] * x[0] + a[i][1] * x[1] + b[i]);
        let normal = [0, 1].map(|i| x[i] / (mu[i] * mu[i]));
        let across = gradient[0] * normal[1] - gradient[1] * normal[0];
        assert!(across.abs() < 1e-8, "{across}");
        assert!(gradient[0] * normal[0] + gradient[1] * normal[1] < 0.0);
    }

    #[test]
    fn a_singular_matrix_gives_no_force() {
        let (_, b, mu) = problem();
        assert_eq!(minimize(&[[0.0; MOST_ROWS]; MOST_ROWS], &b, &mu, 1.0, 2), [0.0; MOST_ROWS]);
        assert_eq!(minimize(&[[f64::NAN; MOST_ROWS]; MOST_ROWS], &b, &mu, 1.0, 5), [0.0; MOST_ROWS]);
    }
}
