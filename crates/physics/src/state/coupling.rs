//! Memory of the correction for blocks that connect branches of the tree.

use crate::algebra::spatial::V6;
use crate::lanes::Real;

/// Columns of the coupled rows and the factors of the small matrix.
#[derive(Clone, Debug)]
pub(crate) struct Coupling<T: Real> {
    /// Inward passes of the rows: `nv` numbers each.
    pub columns: Vec<T>,
    /// The same times R.
    pub scaled: Vec<T>,
    /// R u0.
    pub offset: Vec<T>,
    /// Cholesky factor of the small matrix, lower triangle; inverses on the diagonal.
    pub factor: Vec<T>,
    pub y: Vec<T>,
    /// Number of rows.
    pub rows: usize,
    /// Unit force along one row: on joints and on links, and the links whose joints it can move.
    pub rhs: Vec<T>,
    pub link_force: Vec<V6<T>>,
    pub on_path: Vec<bool>,
}

impl<T: Real> Coupling<T> {
    pub fn new(links: usize, nv: usize) -> Self {
        Coupling {
            columns: Vec::new(),
            scaled: Vec::new(),
            offset: Vec::new(),
            factor: Vec::new(),
            y: Vec::new(),
            rows: 0,
            rhs: vec![T::zero(); nv],
            link_force: vec![[T::zero(); 6]; links],
            on_path: vec![false; links],
        }
    }
}
