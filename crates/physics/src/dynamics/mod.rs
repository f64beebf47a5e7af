//! Smooth dynamics: frames, velocities, applied forces, and the recursion that computes accelerations in linear time.

mod actuation;
mod articulated;
mod drive;
mod ellipsoid;
mod external;
mod fluid;
mod joint_space;
mod kinematics;
mod muscle;
mod passive;
mod string;

pub(crate) use actuation::{actuation, advance_activations};
pub(crate) use articulated::{accelerate, bring_inward, factorize, link_accelerations, reduce_free_root};
pub(crate) use drive::measure_drives;
pub(crate) use external::{joint_gravity_compensation, link_forces};
pub(crate) use fluid::add_fluid_derivatives;
pub(crate) use joint_space::joint_space;
pub(crate) use kinematics::{kinematics, velocities};
pub(crate) use passive::{joint_passive, measure_tendons, tendon_passive};
pub(crate) use string::{measure_strings, straights};
