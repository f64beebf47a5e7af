//! Pictures of agents as arrays.

use crate::arrays::of_shape;
use crate::model::Model;
use crate::{error, number, options, task};
use marathon_envs::registry;
use marathon_render::{Follow, Scene};
use marathon_runs::TaskConfig;
use numpy::ndarray::Ix2;
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Draws agents of one kind with the ray caster, followed by a camera. No window, no GPU.
#[pyclass(module = "marathon_rl")]
pub struct Renderer {
    scene: Scene,
    renderer: marathon_render::Renderer,
    camera: Follow,
    /// Agents, and length of a configuration.
    shape: [usize; 2],
}

#[pymethods]
impl Renderer {
    #[new]
    #[pyo3(signature = (id, width = 480, height = 480, *, num_envs = 1, **options))]
    fn new(
        #[pyo3(from_py_with = task::name)] id: String,
        #[pyo3(from_py_with = number::width)] width: usize,
        #[pyo3(from_py_with = number::height)] height: usize,
        #[pyo3(from_py_with = number::num_envs)] num_envs: usize,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let id = task::plain(&id);
        let TaskConfig { agent, options } = options::set(id, options)?;
        let agent = registry::global().agent_with(&agent, &options).map_err(error::env)?;
        Self::with(&agent.model().map_err(error::env)?, width, height, num_envs)
    }

    /// The same for a compiled model.
    #[staticmethod]
    #[pyo3(signature = (model, width = 480, height = 480, *, num_envs = 1))]
    fn of(
        model: &Model,
        #[pyo3(from_py_with = number::width)] width: usize,
        #[pyo3(from_py_with = number::height)] height: usize,
        #[pyo3(from_py_with = number::num_envs)] num_envs: usize,
    ) -> PyResult<Self> {
        Self::with(&model.inner, width, height, num_envs)
    }

    /// Draws agents side by side, their states in the rows of `qpos`, `(num_envs, nq)`, `elapsed` seconds after the last
    /// picture; the camera jumps to them at first and after more than a second. Returns `(height, width, 3)`, uint8, sRGB.
    #[pyo3(signature = (qpos, elapsed = f64::INFINITY))]
    fn render<'py>(
        &mut self,
        py: Python<'py>,
        qpos: &Bound<'py, PyAny>,
        elapsed: f64,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let qpos = of_shape::<f64, Ix2, 2>("qpos has", qpos, self.shape)?;
        let poses: Vec<Vec<f64>> = qpos.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
        let frame = self.scene.frame(&poses).map_err(error::any)?;
        let camera = self.camera.update(&frame, elapsed);
        let image = py.detach(|| self.renderer.render(&frame, &camera));
        PyArray1::from_slice(py, image.rgb()).reshape([image.height(), image.width(), 3])
    }
}

/// Checks the size of pictures.
#[pyfunction]
pub fn _check_size(
    #[pyo3(from_py_with = number::width)] width: usize,
    #[pyo3(from_py_with = number::height)] height: usize,
) -> PyResult<()> {
    marathon_render::Renderer::new(width, height).map(|_| ()).map_err(error::any)
}

impl Renderer {
    fn with(model: &marathon_physics::Model, width: usize, height: usize, num_envs: usize) -> PyResult<Self> {
        let scene = Scene::new(model);
        let renderer = marathon_render::Renderer::new(width, height).map_err(error::any)?;
        let camera = Follow::new(&scene, num_envs, width, height);
        Ok(Renderer { scene, renderer, camera, shape: [num_envs, model.nq] })
    }
}
