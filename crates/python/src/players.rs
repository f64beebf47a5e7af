//! Rollouts that other processes play: the learner's side, and that of those who play.

use crate::error;
use marathon_learn::{Control, Deliver, Players, TrainConfig};
use marathon_physics::lanes::Isa;
use marathon_runs::TaskConfig;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyList;
use std::sync::Mutex;

/// Plays the agents of one slice of a training run, in a process of its own.
#[pyclass(module = "marathon_rl")]
pub struct Player {
    /// Behind a lock because a Python object may be dropped on any thread; never contended.
    player: Mutex<marathon_learn::Player>,
}

#[pymethods]
impl Player {
    #[new]
    fn new(py: Python<'_>, task: &str, config: &str, slice: usize, slices: usize) -> PyResult<Self> {
        let config: TrainConfig = serde_json::from_str(config).map_err(|e| error::value(format!("config: {e}")))?;
        let task = match task.starts_with('{') {
            true => serde_json::from_str(task).map_err(|e| error::value(format!("task: {e}")))?,
            false => TaskConfig::named(task).map_err(error::run)?,
        };
        let factory = task.factory().map_err(error::run)?;
        let make = || marathon_learn::Player::new(&*factory, Isa::best(), &config, (slice, slices));
        Ok(Player { player: Mutex::new(py.detach(make).map_err(error::learn)?) })
    }

    /// Plays one horizon, without the GIL, and returns the answer for the learner. The same orders and state give the
    /// same bits, whatever was played before.
    fn play<'py>(
        &mut self,
        py: Python<'py>,
        orders: PyReadonlyArray1<'py, u8>,
        state: PyReadonlyArray1<'py, u8>,
    ) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let (orders, state) = (orders.as_slice()?, state.as_slice()?);
        let player = self.player.get_mut().expect("no thread panics with the lock");
        let answer = py.detach(|| player.play(orders, state)).map_err(error::learn)?;
        Ok(PyArray1::from_vec(py, answer))
    }
}

/// A Python object that has the rollouts of a run played.
pub struct PyPlayers {
    object: Py<PyAny>,
    slices: usize,
    /// The exception that it raised.
    pub failure: Option<PyErr>,
}

impl PyPlayers {
    /// Tells the object the task and the configuration of the run; it says how many slices it wants. The task is its name, or
    /// JSON if it has arguments.
    pub fn begin(py: Python<'_>, object: Py<PyAny>, task: &TaskConfig, config: &TrainConfig) -> PyResult<Self> {
        let task = match task.options.is_empty() {
            true => task.agent.clone(),
            false => serde_json::to_string(task).map_err(error::any)?,
        };
        let config = serde_json::to_string(config).map_err(error::any)?;
        let slices = object.bind(py).call_method1("begin", (task, config))?.extract()?;
        Ok(PyPlayers { object, slices, failure: None })
    }
}

impl Players for PyPlayers {
    fn slices(&self) -> usize {
        self.slices
    }

    fn play(&mut self, orders: &[u8], states: &[Vec<u8>], deliver: Deliver<'_>) -> Control {
        let result = Python::attach(|py| -> PyResult<()> {
            let states = PyList::new(py, states.iter().map(|state| PyArray1::from_slice(py, state)))?;
            let arguments = (PyArray1::from_slice(py, orders), states);
            for item in self.object.bind(py).call_method1("play", arguments)?.try_iter()? {
                let (slice, answer): (usize, PyReadonlyArray1<'_, u8>) = item?.extract()?;
                deliver(slice, answer.as_slice()?).map_err(error::learn)?;
            }
            py.check_signals()
        });
        match result {
            Ok(()) => Control::Continue,
            Err(failure) => {
                self.failure = Some(failure);
                Control::Stop
            }
        }
    }
}
