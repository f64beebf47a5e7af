//! Optimizers, and sums of gradients.

pub(crate) mod adam;
pub mod kfac;
pub(crate) mod rmsprop;
pub(crate) mod sum;
