//! Motion clips in memory.

use crate::error;
use crate::model::Model;
use marathon_envs::NamedClip;
use marathon_motion::{About, Cycle, Layout, MotionError};
use marathon_physics::budget;
use marathon_runs::RunError;
use numpy::{AllowTypeChange, PyArray1, PyArray2, PyArrayLike2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;

/// A function and its arguments, from which `pickle` makes an object again.
type Reduced<'py> = (Bound<'py, PyAny>, (String, Bound<'py, PyBytes>));

/// A motion clip as a value of the option `clip`.
#[pyclass(frozen, eq, module = "marathon_rl")]
#[derive(PartialEq)]
pub struct Clip(NamedClip);

#[pymethods]
impl Clip {
    /// A clip of `qpos`, `(n, nq)`, `dt` seconds apart. It loops if it has a `cycle`: how far one lap moves along x and y, m, and
    /// turns to the left, rad.
    #[new]
    #[pyo3(signature = (model, qpos, dt, *, name = "clip", cycle = None))]
    fn new(
        model: &Model,
        qpos: PyArrayLike2<'_, f64, AllowTypeChange>,
        dt: f64,
        name: &str,
        cycle: Option<[f64; 3]>,
    ) -> PyResult<Self> {
        let frames: Vec<Vec<f64>> = qpos.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
        let about = About {
            name: name.into(),
            model: model.inner.name.clone(),
            source: "unknown".into(),
            license: "unknown".into(),
            fit: None,
        };
        let cycle = cycle.map(|[x, y, yaw]| Cycle { pos: [x, y], yaw });
        let clip = marathon_motion::Clip::new(name.as_ref(), about, Layout::of(&model.inner), dt, cycle, &frames);
        // what is learned with the clip stores it: it has to be one that can be read
        clip.and_then(|clip| NamedClip::parse(name, &clip.to_bytes())).map(Clip).map_err(bad)
    }

    /// Reads a `.motion` file.
    #[staticmethod]
    #[pyo3(signature = (path, /))]
    fn load(path: PathBuf) -> PyResult<Self> {
        let bytes = budget::read(&path, &budget::CLIP_FILE).map_err(RunError::io(&path, "read")).map_err(error::run)?;
        let clip = marathon_motion::Clip::parse(&path, &bytes).map_err(bad)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(Clip(NamedClip::new(&name, clip)))
    }

    /// Name in options, run folders and policies, such as `jump.motion`.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// Seconds between frames.
    #[getter]
    fn dt(&self) -> f64 {
        self.clip().dt()
    }

    /// Length of the clip, or of a lap of it, s.
    #[getter]
    fn duration(&self) -> f64 {
        self.clip().duration()
    }

    /// How far a lap moves along x and y, m, and turns to the left, rad; `None` if the clip does not loop.
    #[getter]
    fn cycle(&self) -> Option<(f64, f64, f64)> {
        self.clip().cycle().map(|Cycle { pos: [x, y], yaw }| (x, y, yaw))
    }

    /// Configurations of the frames, `(n, nq)`.
    #[getter]
    fn qpos<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let clip = self.clip();
        let (n, nq) = (clip.frames(), clip.layout().nq());
        PyArray1::from_iter(py, (0..n).flat_map(|i| clip.frame(i).to_vec())).reshape([n, nq])
    }

    /// Writes a `.motion` file.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        marathon_learn::write_atomic(&path, &self.clip().to_bytes()).map_err(error::learn)
    }

    /// For `copy` and `pickle`: the bytes of a file.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let make = py.import("marathon_rl._native")?.getattr("_clip")?;
        Ok((make, (self.name().into(), PyBytes::new(py, &self.clip().to_bytes()))))
    }

    fn __repr__(&self) -> String {
        format!("Clip({:?}, frames={}, dt={})", self.name(), self.clip().frames(), self.dt())
    }
}

impl Clip {
    /// `None` for one that comes with Marathon, which is its name alone.
    pub fn of(clip: &NamedClip) -> Option<Self> {
        clip.clip().map(|_| Clip(clip.clone()))
    }

    /// As a value of an option.
    pub fn named(&self) -> NamedClip {
        self.0.clone()
    }

    fn clip(&self) -> &marathon_motion::Clip {
        self.0.clip().expect("a clip object has its clip")
    }
}

/// A clip from its name and the bytes of a file.
#[pyfunction]
pub fn _clip(name: &str, bytes: &[u8]) -> PyResult<Clip> {
    NamedClip::parse(name, bytes).map(Clip).map_err(bad)
}

fn bad(error: MotionError) -> PyErr {
    error::value(error.to_string())
}
