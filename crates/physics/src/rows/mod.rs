//! Constraint rows: their values, stiffness, and forces at a given acceleration.
//!
//! Three kinds that dominate in walking have their own layout: points above a level floor ([`FloorRow`]), limits of
//! hinges and slides ([`LimitRow`]), dry friction ([`DryRow`]). Everything else is a [`Block`].

mod block;
mod blocks;
mod cone;
mod cost;
mod floor;
mod force;
mod jacobian;
mod joint;
mod measure;
mod row;

pub(crate) use block::{Block, RowValues, Source, at};
pub(crate) use blocks::ConstraintRows;
pub(crate) use cost::RowCost;
pub(crate) use floor::FloorRow;
pub(crate) use jacobian::{Jacobian, Side};
pub(crate) use joint::{DryRow, LimitRow};
pub(crate) use row::{NewtonStep, Row, former};
