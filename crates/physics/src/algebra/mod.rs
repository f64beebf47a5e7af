//! Linear algebra over lanes: vectors, rotations, spatial (6-D) vectors and inertias.
//!
//! [`spatial`] has the functions, [`planar`] the same algebra restricted to planar motions, [`rigid`] the few transforms in
//! double precision with which a model is prepared.

pub(crate) mod planar;
pub(crate) mod rigid;
pub mod spatial;
