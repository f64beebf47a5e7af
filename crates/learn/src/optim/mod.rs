//! Optimizers.

pub(crate) mod adam;
pub mod kfac;
