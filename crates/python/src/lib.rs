//! The native module `marathon_rl._native` of the Python package: environments stepped without the GIL on NumPy arrays
//! that are not copied, and the `marathon` command.
//!
//! `python/marathon_rl` documents the Python API; its `_native.pyi` also documents this module's classes.
//! Nothing here knows of Gymnasium or another framework.

mod arrays;
mod batch_task;
mod borrow;
mod choices;
mod clip;
mod config;
mod error;
mod inputs;
mod interrupt;
mod model;
mod model_edit;
mod number;
mod options;
mod players;
mod policy;
mod renderer;
mod simulation;
mod spec;
mod task;
mod train;
mod vec_env;
mod viewer;

use pyo3::prelude::*;
use std::ffi::OsString;

/// Native part of marathon_rl.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::{
        arrays::_mask, clip::_clip, clip::Clip, main, model::Model, number::_count, number::_seeds, players::Player,
        policy::_policy, policy::Policy, policy::evaluate, policy::load_policy, renderer::_check_size,
        renderer::Renderer, simulation::Simulation, spec::_limits, spec::_spec, spec::CommandRange, spec::Spec,
        spec::ids, spec::spec, train::_train_result, train::TrainResult, train::train, vec_env::VecEnv, viewer::Viewer,
    };
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        if let Some(obstacle) = marathon_physics::lanes::Isa::best().obstacle() {
            return Err(pyo3::exceptions::PyImportError::new_err(obstacle));
        }
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

/// Runs the `marathon` command with the words of a command line, the first being the program's name; returns its exit
/// code. It belongs at the end of a process: some commands replace the handler of Ctrl-C.
#[pyfunction]
fn main(py: Python<'_>, words: Vec<OsString>) -> PyResult<u8> {
    viewer::offer_page(py)?;
    Ok(py.detach(|| marathon_cli::main(words)))
}
