//! Optimizers, and the sums of gradients that they work on.

pub(crate) mod adam;
pub mod kfac;
pub(crate) mod rmsprop;
pub(crate) mod sum;
