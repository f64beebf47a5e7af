//! Linear algebra over lanes: vectors, rotations, spatial (6-D) vectors and inertias.
//!
//! [`spatial`] has the functions. [`planar`] has the same algebra for planar motions only. [`rigid`] has the few
//! transforms in double precision that prepare a model.

pub(crate) mod planar;
pub(crate) mod rigid;
pub mod spatial;
