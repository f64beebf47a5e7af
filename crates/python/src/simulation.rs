//! The bare physics of many agents as a Python object: controls in, readings out, no task.

use crate::arrays::{mask, of_shape, rows};
use crate::inputs::{self, Constants, Grounds, grounds_array};
use crate::model::Model;
use crate::{error, number};
use marathon_physics::budget::AGENTS_MEMORY;
use marathon_physics::{AgentState, Batch, BatchOptions, Isa, Quantity, Variation};
use numpy::ndarray::Ix2;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods};
use pyo3::basic::CompareOp;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::Mutex;

/// Most threads. Each has working memory of its own.
const MOST_THREADS: usize = 1024;

/// Agents per thread that are worth a thread.
const AGENTS_PER_THREAD: usize = 64;

/// Size of an agent's allocations, bytes.
const OVERHEAD: usize = 500;

/// Quantities that are read together, because all come from the frames of the bodies.
const FRAMES: [Quantity; 6] = [
    Quantity::BodyPos,
    Quantity::BodyAxes,
    Quantity::BodyVelocity,
    Quantity::BodyAngularVelocity,
    Quantity::GeomPos,
    Quantity::GeomVelocity,
];

/// Physics of many agents of one model, stepped together by native threads without the GIL.
///
/// Readings are read-only float64 arrays with one row per agent, in world axes and SI units. They are computed when they
/// are first asked for after a step or a reset, and never overwritten.
#[pyclass(module = "marathon_rl")]
pub struct Simulation {
    /// Behind a lock because a Python object may be dropped on any thread; never contended.
    batch: Mutex<Batch>,
    model: Py<Model>,
    num_envs: usize,
    threads: usize,
    /// Readings of the present state.
    read: Vec<(Quantity, Py<PyAny>)>,
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (model, num_envs = 1, *, threads = 0, isa = None))]
    fn new(
        py: Python<'_>,
        model: Py<Model>,
        #[pyo3(from_py_with = number::num_envs)] num_envs: usize,
        #[pyo3(from_py_with = number::threads)] threads: usize,
        isa: Option<&str>,
    ) -> PyResult<Self> {
        if num_envs == 0 {
            return Err(error::value("num_envs is 0, expected at least 1"));
        }
        let isa = isa.map(str::parse::<Isa>).transpose().map_err(error::value)?.unwrap_or_else(Isa::best);
        if let Some(obstacle) = isa.obstacle() {
            let (found, best) = (isa.name(), Isa::best().name());
            return Err(error::value(format!("cannot run isa '{found}': {obstacle}; the best is '{best}'")));
        }
        let cores = || std::thread::available_parallelism().map_or(1, |n| n.get());
        let threads = if threads == 0 { cores().min(num_envs.div_ceil(AGENTS_PER_THREAD)) } else { threads };
        if threads > MOST_THREADS {
            return Err(error::value(format!("threads is {threads}, expected at most {MOST_THREADS}")));
        }
        AGENTS_MEMORY
            .check(num_envs as f64 * agent_bytes(&model.get().inner))
            .map_err(|over| PyMemoryError::new_err(format!("num_envs is {num_envs}, which {over}")))?;
        let options = BatchOptions { agents: num_envs, threads, isa, ..Default::default() };
        let inner = &model.get().inner;
        let batch = py.detach(|| Batch::new(inner, &options)).map_err(|e| error::value(e.to_string()))?;
        Ok(Simulation { batch: Mutex::new(batch), model, num_envs, threads, read: Vec::new() })
    }

    /// The model.
    #[getter]
    fn model(&self, py: Python<'_>) -> Py<Model> {
        self.model.clone_ref(py)
    }

    /// Number of agents.
    #[getter]
    fn num_envs(&self) -> usize {
        self.num_envs
    }

    /// Number of threads.
    #[getter]
    fn threads(&self) -> usize {
        self.threads
    }

    /// Advances every agent by `substeps` physics steps under `ctrl`, `(num_envs, nu)`.
    ///
    /// Returns which agents broke, `(num_envs,)`: their states stopped being finite, so they were put into the reference
    /// configuration at rest.
    #[pyo3(signature = (ctrl, substeps = 1))]
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        ctrl: &Bound<'py, PyAny>,
        #[pyo3(from_py_with = number::substeps)] substeps: usize,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        if substeps == 0 {
            return Err(error::value("substeps is 0, expected at least 1"));
        }
        let ctrl = of_shape::<f64, Ix2, 2>("ctrl has", ctrl, [self.num_envs, self.model.get().inner.nu])?;
        self.read.clear();
        let (ctrl, n) = (rows(&ctrl), self.num_envs);
        let batch = self.batch();
        let broken = py.detach(|| batch.step(&ctrl, substeps));
        let mut out = vec![false; n];
        for agent in broken {
            out[agent] = true;
        }
        Ok(PyArray1::from_vec(py, out))
    }

    /// Puts agents, all or those of a mask, `(num_envs,)`, into the states in the rows of `qpos`, `(num_envs, nq)`, and
    /// `qvel`, `(num_envs, nv)`. Quaternions are normalized; controls, pushes and contacts are forgotten.
    #[pyo3(signature = (qpos, qvel, mask = None))]
    fn reset(
        &mut self,
        qpos: &Bound<'_, PyAny>,
        qvel: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let mask = self::mask(mask, self.num_envs)?;
        let model = &self.model.get().inner;
        let qpos = of_shape::<f64, Ix2, 2>("qpos has", qpos, [self.num_envs, model.nq])?;
        let qvel = of_shape::<f64, Ix2, 2>("qvel has", qvel, [self.num_envs, model.nv])?;
        let (qpos, qvel) = (qpos.as_array(), qvel.as_array());
        let chosen = || (0..mask.len()).filter(|i| mask[*i]);
        if let Some(i) = chosen().find(|i| !qpos.row(*i).iter().chain(qvel.row(*i)).all(|x| x.is_finite())) {
            return Err(error::value(format!("the state of agent {i} is not finite")));
        }
        self.read.clear();
        for i in chosen() {
            self.batch().reset(i, &qpos.row(i).to_vec(), &qvel.row(i).to_vec());
        }
        Ok(())
    }

    /// Pushes a body, given by its index or name, of all agents or those of a mask: force, N, and torque, N m,
    /// `(num_envs, 3)`, in world axes at the body's center of mass. It lasts until changed or until a reset.
    #[pyo3(signature = (force, torque = None, *, body, mask = None))]
    fn push(
        &mut self,
        force: &Bound<'_, PyAny>,
        torque: Option<&Bound<'_, PyAny>>,
        body: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let pushes = inputs::pushes(self.model.get(), self.num_envs, force, torque, body, mask)?;
        self.read.clear();
        for (agent, force, torque) in pushes.each {
            self.batch().push(agent, pushes.body, force, torque);
        }
        Ok(())
    }

    /// Sets constants of all agents or those of a mask: factors of the bodies' masses and inertias, `(num_envs,
    /// nbody)`, of all friction coefficients, `(num_envs,)`, and of the actuators' forces, `(num_envs, nu)`; gravity,
    /// m/s^2, `(num_envs, 3)`. Omitted constants have the model's values. They last over resets, until changed.
    #[pyo3(signature = (*, mass = None, friction = None, strength = None, gravity = None, mask = None))]
    fn vary(
        &mut self,
        mass: Option<&Bound<'_, PyAny>>,
        friction: Option<&Bound<'_, PyAny>>,
        strength: Option<&Bound<'_, PyAny>>,
        gravity: Option<&Bound<'_, PyAny>>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let none = Variation::none(&self.model.get().inner);
        let each = Constants { mass, friction, strength, gravity, mask }.read(&none, self.num_envs)?;
        self.read.clear();
        for (agent, own) in each {
            self.batch().vary(agent, &own);
        }
        Ok(())
    }

    /// Ground of each agent: elevations, m above the zero of the model's height field `field`, `(num_envs, nrow, ncol)`,
    /// a new array. The first row has the smallest y.
    #[pyo3(signature = (field = 0))]
    fn ground<'py>(
        &mut self,
        py: Python<'py>,
        #[pyo3(from_py_with = number::field)] field: usize,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let (n, grid) = (self.num_envs, self.model.get().grid(field)?);
        let batch = self.batch();
        let elevations = (0..n).flat_map(|agent| batch.ground(agent, field)).collect();
        grounds_array(py, n, grid, elevations)
    }

    /// Sets the ground of all agents or those of a mask: elevations, m above the zero of the model's height field `field`,
    /// `(num_envs, nrow, ncol)`, or `(nrow, ncol)` for the same ground. The first row has the smallest y. The ground lasts
    /// over resets, until changed, and belongs to snapshots.
    #[pyo3(signature = (elevations, field = 0, mask = None))]
    fn set_ground(
        &mut self,
        elevations: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = number::field)] field: usize,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let grounds = Grounds::read(self.model.get().grid(field)?, self.num_envs, elevations, mask)?;
        self.read.clear();
        for (agent, elevations) in grounds.each() {
            self.batch().set_ground(agent, field, elevations);
        }
        Ok(())
    }

    /// Heights of the ground at places of the world, m, `(num_envs, n)`: of planes and of height fields that lie level,
    /// with ground of each agent's own. `x` and `y`, m, are `(num_envs, n)`. Beyond all ground, the height is that of the
    /// nearest place; 0 if the model has no ground.
    fn ground_height<'py>(
        &mut self,
        py: Python<'py>,
        x: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let shape: Vec<usize> = py.import("numpy")?.call_method1("shape", (x,))?.extract()?;
        let n = if shape.len() == 2 { shape[1] } else { 1 };
        let x = of_shape::<f64, Ix2, 2>("x has", x, [self.num_envs, n])?;
        let y = of_shape::<f64, Ix2, 2>("y has", y, [self.num_envs, n])?;
        let places: Vec<[f64; 2]> = rows(&x).iter().zip(rows(&y).iter()).map(|(x, y)| [*x, *y]).collect();
        let heights = PyArray2::<f64>::zeros(py, [self.num_envs, n], false);
        let mut writer = heights.try_readwrite().map_err(|e| error::array("heights", e))?;
        let (rows, batch) = (writer.as_slice_mut()?, self.batch());
        py.detach(|| batch.ground_height(&places, rows));
        drop(writer);
        Ok(heights)
    }

    /// Everything that the future depends on, as JSON. Loaded, the simulation continues with the same bits.
    fn save<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let n = self.num_envs;
        let batch = self.batch();
        let json = py.detach(move || {
            let states: Vec<AgentState> = (0..n).map(|i| batch.agent_state(i)).collect();
            serde_json::to_vec(&states)
        });
        Ok(PyBytes::new(py, &json.map_err(|e| error::value(e.to_string()))?))
    }

    /// Restores what `save` returned for the same model and number of agents.
    fn load(&mut self, snapshot: &[u8]) -> PyResult<()> {
        let states: Vec<AgentState> =
            serde_json::from_slice(snapshot).map_err(|e| error::value(format!("snapshot: {e}")))?;
        if states.len() != self.num_envs {
            let (found, expected) = (states.len(), self.num_envs);
            return Err(error::value(format!("the snapshot has {found} agents, expected {expected}")));
        }
        if let Some(i) = states.iter().position(|state| !state.fits(&self.model.get().inner)) {
            return Err(error::value(format!(
                "the snapshot's agent {i} is not of model '{}'",
                self.model.get().inner.name
            )));
        }
        self.read.clear();
        for (i, state) in states.iter().enumerate() {
            self.batch().set_agent_state(i, state);
        }
        Ok(())
    }

    /// Configuration, `(num_envs, nq)`.
    #[getter]
    fn qpos(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::Qpos)
    }

    /// Velocity, `(num_envs, nv)`.
    #[getter]
    fn qvel(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::Qvel)
    }

    /// Origins of the bodies' frames, m, `(num_envs, nbody, 3)`.
    #[getter]
    fn body_pos(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::BodyPos)
    }

    /// Directions of the bodies' x, y and z axes, `(num_envs, nbody, 3, 3)`: `[..., 0, :]` is that of x.
    #[getter]
    fn body_axes(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::BodyAxes)
    }

    /// Velocities of the origins of the bodies' frames, m/s, `(num_envs, nbody, 3)`.
    #[getter]
    fn body_velocity(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::BodyVelocity)
    }

    /// Angular velocities of the bodies, rad/s, `(num_envs, nbody, 3)`.
    #[getter]
    fn body_angular_velocity(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::BodyAngularVelocity)
    }

    /// Centers of the geoms, m, `(num_envs, ngeom, 3)`.
    #[getter]
    fn geom_pos(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::GeomPos)
    }

    /// Velocities of the geoms' centers, m/s, `(num_envs, ngeom, 3)`.
    #[getter]
    fn geom_velocity(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::GeomVelocity)
    }

    /// Geoms that touched the static world at the last physics step, `(num_envs, ngeom)`, bool.
    #[getter]
    fn touching(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::Touching)
    }

    /// Geoms that touched the static world at any physics step of the last `step`, `(num_envs, ngeom)`, bool.
    #[getter]
    fn touched(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::Touched)
    }

    /// Normal forces of the geoms' contacts with the static world at the last physics step, N, `(num_envs, ngeom)`.
    #[getter]
    fn normal_force(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::NormalForce)
    }

    /// Sensors' values at the present state and controls, in the model's order, `(num_envs, ...)`; NaN for those that
    /// cannot be evaluated. This costs about as much as a physics step.
    #[getter]
    fn sensors(&mut self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.reading(py, Quantity::Sensors)
    }

    fn __len__(&self) -> usize {
        self.num_envs
    }

    fn __repr__(&self) -> String {
        format!("Simulation({:?}, num_envs={})", self.model.get().inner.name, self.num_envs)
    }
}

/// Upper bound on the memory of an agent with all its readings, bytes.
fn agent_bytes(model: &marathon_physics::Model) -> f64 {
    let state = model.nq + 3 * model.nv + 2 * model.nu + model.na + 6 * model.bodies.len();
    let frames = 18 * model.bodies.len() + 6 * model.geoms.len();
    let contacts = 6 * model.geoms.len();
    let sensors: usize = model.sensors.iter().map(|sensor| sensor.dim).sum();
    let ground: usize = model.hfields.iter().map(|field| field.nrow * field.ncol).sum();
    (8 * (state + frames + contacts + sensors + ground) + OVERHEAD) as f64
}

impl Simulation {
    fn batch(&mut self) -> &mut Batch {
        self.batch.get_mut().expect("no thread panics with the lock")
    }

    /// A reading of the present state, computed if it has not been yet.
    fn reading(&mut self, py: Python<'_>, quantity: Quantity) -> PyResult<Py<PyAny>> {
        if let Some((_, array)) = self.read.iter().find(|(q, _)| *q == quantity) {
            return Ok(array.clone_ref(py));
        }
        let wanted = if FRAMES.contains(&quantity) { &FRAMES[..] } else { std::slice::from_ref(&quantity) };
        let arrays: Vec<_> = wanted.iter().map(|q| PyArrayDyn::<f64>::zeros(py, self.shape(*q), false)).collect();
        let mut writers = Vec::new();
        for array in &arrays {
            writers.push(array.try_readwrite().map_err(|e| error::array("readings", e))?);
        }
        let mut parts = Vec::new();
        for (quantity, writer) in wanted.iter().zip(&mut writers) {
            parts.push((*quantity, writer.as_slice_mut()?));
        }
        let batch = self.batch();
        py.detach(|| batch.gather(&mut parts));
        drop(parts);
        drop(writers);
        for (quantity, array) in wanted.iter().zip(arrays) {
            let flag = matches!(quantity, Quantity::Touching | Quantity::Touched);
            let array = if flag { array.rich_compare(0.0, CompareOp::Ne)? } else { array.into_any() };
            array.call_method1("setflags", (false,))?;
            self.read.push((*quantity, array.unbind()));
        }
        self.reading(py, quantity)
    }

    fn shape(&self, quantity: Quantity) -> Vec<usize> {
        let model = &self.model.get().inner;
        let (n, bodies, geoms) = (self.num_envs, model.bodies.len(), model.geoms.len());
        match quantity {
            Quantity::BodyPos | Quantity::BodyVelocity | Quantity::BodyAngularVelocity => vec![n, bodies, 3],
            Quantity::BodyAxes => vec![n, bodies, 3, 3],
            Quantity::GeomPos | Quantity::GeomVelocity => vec![n, geoms, 3],
            flat => vec![n, flat.width(model)],
        }
    }
}
