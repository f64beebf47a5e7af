//! The bare physics of many agents as a Python object: controls in, readings out, no task.

use crate::arrays::{mask, of_shape, rows};
use crate::borrow::{exclusive, shared};
use crate::inputs::{self, Constants, Grounds, grounds_array};
use crate::model::Model;
use crate::{error, number};
use marathon_physics::budget::AGENTS_MEMORY;
use marathon_physics::{AgentState, Batch, BatchOptions, ContactReading, Isa, Quantity, Variation};
use numpy::ndarray::Ix2;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods};
use pyo3::basic::CompareOp;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::sync::Mutex;

/// Most threads. Each has working memory of its own.
const MOST_THREADS: usize = 1024;

/// Most physics steps of one call: as many as a step of an environment has. Ctrl-C waits for the end of a call.
const MOST_SUBSTEPS: usize = 1000;

/// Agents per thread that are worth a thread.
const AGENTS_PER_THREAD: usize = 64;

/// Size of an agent's allocations, bytes.
const OVERHEAD: usize = 500;

/// Largest number of pairs of geoms that count in an agent's memory.
const MOST_PAIRS: usize = 1 << 14;

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
        let useful = if threads == 0 { num_envs.div_ceil(AGENTS_PER_THREAD) } else { threads };
        let threads = marathon_physics::threads(threads).min(useful);
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
    fn model(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<Model>> {
        Ok(shared(slf)?.model.clone_ref(py))
    }

    /// Number of agents.
    #[getter]
    fn num_envs(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(shared(slf)?.num_envs)
    }

    /// Number of threads.
    #[getter]
    fn threads(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(shared(slf)?.threads)
    }

    /// Advances every agent by `substeps` physics steps, at most 1000, under `ctrl`, `(num_envs, nu)`.
    ///
    /// Returns which agents broke, `(num_envs,)`: their states stopped being finite, so they were put into the reference
    /// configuration at rest.
    #[pyo3(signature = (ctrl, substeps = 1))]
    fn step<'py>(
        slf: &Bound<'_, Self>,
        py: Python<'py>,
        ctrl: &Bound<'py, PyAny>,
        #[pyo3(from_py_with = number::substeps)] substeps: usize,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let this = &mut *exclusive(slf)?;
        if !(1..=MOST_SUBSTEPS).contains(&substeps) {
            return Err(error::value(format!("substeps is {substeps}, expected 1 to {MOST_SUBSTEPS}")));
        }
        let ctrl = of_shape::<f64, Ix2, 2>("ctrl has", ctrl, [this.num_envs, this.model.get().inner.nu])?;
        let (ctrl, n) = (rows(&ctrl), this.num_envs);
        if let Some(at) = ctrl.iter().position(|u| u.is_nan()) {
            let (agent, actuator) = (at / this.model.get().inner.nu, at % this.model.get().inner.nu);
            let name = this.model.get().inner.actuators[actuator].name.as_str();
            return Err(error::value(format!(
                "agent {agent}: ctrl of actuator {actuator} '{name}' is NaN, expected a number"
            )));
        }
        this.read.clear();
        let batch = this.batch();
        let broken = py.detach(|| batch.step(&ctrl, substeps));
        let mut out = vec![false; n];
        for agent in broken {
            out[agent] = true;
        }
        Ok(PyArray1::from_vec(py, out))
    }

    /// Puts agents, all or those of a mask, `(num_envs,)`, into the states in the rows of `qpos`, `(num_envs, nq)`, and
    /// `qvel`, `(num_envs, nv)`, with the activations `act`, `(num_envs, na)`, or 0. Quaternions are normalized; controls, pushes and
    /// contacts are forgotten, and mocap bodies are where the model has them.
    #[pyo3(signature = (qpos, qvel, mask = None, *, act = None))]
    fn reset(
        slf: &Bound<'_, Self>,
        qpos: &Bound<'_, PyAny>,
        qvel: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
        act: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let this = &mut *exclusive(slf)?;
        let mask = self::mask(mask, this.num_envs)?;
        let model = &this.model.get().inner;
        let qpos = of_shape::<f64, Ix2, 2>("qpos has", qpos, [this.num_envs, model.nq])?;
        let qvel = of_shape::<f64, Ix2, 2>("qvel has", qvel, [this.num_envs, model.nv])?;
        let shape = [this.num_envs, model.na];
        let act = act.map(|act| of_shape::<f64, Ix2, 2>("act has", act, shape)).transpose()?;
        let (qpos, qvel, act) = (qpos.as_array(), qvel.as_array(), act.as_ref().map(|act| act.as_array()));
        let chosen = || (0..mask.len()).filter(|i| mask[*i]);
        if let Some(i) = chosen().find(|i| !qpos.row(*i).iter().chain(qvel.row(*i)).all(|x| x.is_finite())) {
            return Err(error::value(format!("the state of agent {i} is not finite")));
        }
        if let Some(i) = chosen().find(|i| act.is_some_and(|act| act.row(*i).iter().any(|x| !x.is_finite()))) {
            return Err(error::value(format!("act of agent {i} is not finite")));
        }
        this.read.clear();
        for i in chosen() {
            this.batch().reset(i, &qpos.row(i).to_vec(), &qvel.row(i).to_vec());
            if let Some(act) = act {
                this.batch().set_act(i, &act.row(i).to_vec());
            }
        }
        Ok(())
    }

    /// Pushes a body, given by its index or name, of all agents or those of a mask: force, N, and torque, N m,
    /// `(num_envs, 3)`, in world axes at the body's center of mass. It lasts until changed or until a reset.
    #[pyo3(signature = (force, torque = None, *, body, mask = None))]
    fn push(
        slf: &Bound<'_, Self>,
        force: &Bound<'_, PyAny>,
        torque: Option<&Bound<'_, PyAny>>,
        body: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let this = &mut *exclusive(slf)?;
        let pushes = inputs::pushes(this.model.get(), this.num_envs, force, torque, body, mask)?;
        this.read.clear();
        for (agent, force, torque) in pushes.each {
            this.batch().push(agent, pushes.body, force, torque);
        }
        Ok(())
    }

    /// Moves a mocap body, given by its index or name, of all agents or those of a mask: its position, m, `(num_envs, 3)`, and its
    /// orientation, `(num_envs, 4)`. Omitted parts stay as they are. They last until changed or until a reset.
    #[pyo3(signature = (pos = None, quat = None, *, body, mask = None))]
    fn set_mocap(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        pos: Option<&Bound<'_, PyAny>>,
        quat: Option<&Bound<'_, PyAny>>,
        body: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let this = &mut *exclusive(slf)?;
        let model = this.model.clone_ref(py);
        let inner = &model.get().inner;
        let size = |quantity: Quantity| vec![0.0; this.num_envs * quantity.width(inner)];
        let (mut of_pos, mut of_quat) = (size(Quantity::MocapPos), size(Quantity::MocapQuat));
        this.batch().gather(&mut [(Quantity::MocapPos, &mut of_pos), (Quantity::MocapQuat, &mut of_quat)]);
        let present = (this.num_envs, (&of_pos[..], &of_quat[..]));
        let poses = inputs::mocap_poses(model.get(), present, pos, quat, body, mask)?;
        this.read.clear();
        for (agent, pos, quat) in poses.each {
            this.batch().set_mocap(agent, poses.mocap, &pos, &quat);
        }
        Ok(())
    }

    /// Sets constants of all agents or those of a mask: factors of the bodies' masses and inertias, `(num_envs,
    /// nbody)`, of all friction coefficients, `(num_envs,)`, and of the actuators' forces, `(num_envs, nu)`; gravity,
    /// m/s^2, `(num_envs, 3)`. Omitted constants have the model's values. They last over resets, until changed.
    #[pyo3(signature = (*, mass = None, friction = None, strength = None, gravity = None, mask = None))]
    fn vary(
        slf: &Bound<'_, Self>,
        mass: Option<&Bound<'_, PyAny>>,
        friction: Option<&Bound<'_, PyAny>>,
        strength: Option<&Bound<'_, PyAny>>,
        gravity: Option<&Bound<'_, PyAny>>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let this = &mut *exclusive(slf)?;
        let none = Variation::none(&this.model.get().inner);
        let each = Constants { mass, friction, strength, gravity, mask }.read(&none, this.num_envs)?;
        this.read.clear();
        for (agent, own) in each {
            this.batch().vary(agent, &own);
        }
        Ok(())
    }

    /// Ground of each agent: elevations, m above the zero of the model's height field `field`, `(num_envs, nrow, ncol)`,
    /// a new array. The first row has the smallest y.
    #[pyo3(signature = (field = 0))]
    fn ground<'py>(
        slf: &Bound<'_, Self>,
        py: Python<'py>,
        #[pyo3(from_py_with = number::field)] field: usize,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let this = &mut *exclusive(slf)?;
        let (n, grid) = (this.num_envs, this.model.get().grid(field)?);
        let batch = this.batch();
        let elevations = (0..n).flat_map(|agent| batch.ground(agent, field)).collect();
        grounds_array(py, n, grid, elevations)
    }

    /// Sets the ground of all agents or those of a mask: elevations, m above the zero of the model's height field `field`,
    /// `(num_envs, nrow, ncol)`, or `(nrow, ncol)` for the same ground. The first row has the smallest y. The ground lasts
    /// over resets, until changed, and belongs to snapshots.
    #[pyo3(signature = (elevations, field = 0, mask = None))]
    fn set_ground(
        slf: &Bound<'_, Self>,
        elevations: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = number::field)] field: usize,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let this = &mut *exclusive(slf)?;
        let grounds = Grounds::read(this.model.get().grid(field)?, this.num_envs, elevations, mask)?;
        this.read.clear();
        for (agent, elevations) in grounds.each() {
            this.batch().set_ground(agent, field, elevations);
        }
        Ok(())
    }

    /// Heights of the ground at places of the world, m, `(num_envs, n)`: of planes and of height fields that lie level,
    /// with ground of each agent's own. `x` and `y`, m, are `(num_envs, n)`. Beyond all ground, the height is that of the
    /// nearest place; 0 if the model has no ground.
    fn ground_height<'py>(
        slf: &Bound<'_, Self>,
        py: Python<'py>,
        x: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let this = &mut *exclusive(slf)?;
        let shape: Vec<usize> = py.import("numpy")?.call_method1("shape", (x,))?.extract()?;
        let n = if shape.len() == 2 { shape[1] } else { 1 };
        let x = of_shape::<f64, Ix2, 2>("x has", x, [this.num_envs, n])?;
        let y = of_shape::<f64, Ix2, 2>("y has", y, [this.num_envs, n])?;
        let places: Vec<[f64; 2]> = rows(&x).iter().zip(rows(&y).iter()).map(|(x, y)| [*x, *y]).collect();
        let heights = PyArray2::<f64>::zeros(py, [this.num_envs, n], false);
        let mut writer = heights.try_readwrite().map_err(|e| error::array("heights", e))?;
        let (rows, batch) = (writer.as_slice_mut()?, this.batch());
        py.detach(|| batch.ground_height(&places, rows));
        drop(writer);
        Ok(heights)
    }

    /// Everything that the future depends on, as JSON. Loaded, the simulation continues with the same bits.
    fn save<'py>(slf: &Bound<'_, Self>, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let this = &mut *exclusive(slf)?;
        let n = this.num_envs;
        let batch = this.batch();
        let json = py.detach(move || {
            let states: Vec<AgentState> = (0..n).map(|i| batch.agent_state(i)).collect();
            serde_json::to_vec(&states)
        });
        Ok(PyBytes::new(py, &json.map_err(|e| error::value(e.to_string()))?))
    }

    /// Restores what `save` returned for the same model and number of agents.
    fn load(slf: &Bound<'_, Self>, snapshot: &[u8]) -> PyResult<()> {
        let this = &mut *exclusive(slf)?;
        let states: Vec<AgentState> =
            serde_json::from_slice(snapshot).map_err(|e| error::value(format!("snapshot: {e}")))?;
        if states.len() != this.num_envs {
            let (found, expected) = (states.len(), this.num_envs);
            return Err(error::value(format!("the snapshot has {found} agents, expected {expected}")));
        }
        if let Some(i) = states.iter().position(|state| !state.fits(&this.model.get().inner)) {
            return Err(error::value(format!(
                "the snapshot's agent {i} is not of model '{}'",
                this.model.get().inner.name
            )));
        }
        this.read.clear();
        for (i, state) in states.iter().enumerate() {
            this.batch().set_agent_state(i, state);
        }
        Ok(())
    }

    /// Configuration, `(num_envs, nq)`.
    #[getter]
    fn qpos(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::Qpos)
    }

    /// Velocity, `(num_envs, nv)`.
    #[getter]
    fn qvel(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::Qvel)
    }

    /// Activations of the actuators that have one, `(num_envs, na)`.
    #[getter]
    fn act(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::Act)
    }

    /// Positions of the mocap bodies, m, `(num_envs, nmocap, 3)`.
    #[getter]
    fn mocap_pos(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::MocapPos)
    }

    /// Orientations of the mocap bodies, `(num_envs, nmocap, 4)`.
    #[getter]
    fn mocap_quat(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::MocapQuat)
    }

    /// Accelerations at the present state and controls, `(num_envs, nv)`.
    #[getter]
    fn qacc(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::Qacc)
    }

    /// Forces of contacts, limits, dry friction and equalities on the joints at the present state and controls, N or N m,
    /// `(num_envs, nv)`.
    #[getter]
    fn qfrc_constraint(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::QfrcConstraint)
    }

    /// Forces of the actuators at the present state and controls, N or N m, `(num_envs, nu)`.
    #[getter]
    fn actuator_force(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::ActuatorForce)
    }

    /// Contacts of an agent at the present state and controls: a dict of arrays, `geom`, `(n, 2)`, and `pos`, `normal`, `force` and
    /// `torque`, `(n, 3)`.
    #[pyo3(signature = (agent = 0))]
    fn contacts<'py>(
        slf: &Bound<'_, Self>,
        py: Python<'py>,
        #[pyo3(from_py_with = number::agent)] agent: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let this = &mut *exclusive(slf)?;
        if agent >= this.num_envs {
            return Err(error::value(format!("agent is {agent}, expected less than {}", this.num_envs)));
        }
        let batch = this.batch();
        let all = py.detach(|| batch.contacts(agent));
        let out = PyDict::new(py);
        let geoms = all.iter().flat_map(|contact| contact.geoms.map(|geom| geom as i64));
        out.set_item("geom", PyArray1::from_iter(py, geoms).reshape([all.len(), 2])?)?;
        let rows = |of: fn(&ContactReading) -> [f64; 3]| {
            PyArray1::from_iter(py, all.iter().flat_map(of)).reshape([all.len(), 3])
        };
        out.set_item("pos", rows(|contact| contact.pos)?)?;
        out.set_item("normal", rows(|contact| contact.normal)?)?;
        out.set_item("force", rows(|contact| contact.force)?)?;
        out.set_item("torque", rows(|contact| contact.torque)?)?;
        Ok(out)
    }

    /// Origins of the bodies' frames, m, `(num_envs, nbody, 3)`.
    #[getter]
    fn body_pos(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::BodyPos)
    }

    /// Directions of the bodies' x, y and z axes, `(num_envs, nbody, 3, 3)`: `[..., 0, :]` is that of x.
    #[getter]
    fn body_axes(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::BodyAxes)
    }

    /// Velocities of the origins of the bodies' frames, m/s, `(num_envs, nbody, 3)`.
    #[getter]
    fn body_velocity(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::BodyVelocity)
    }

    /// Angular velocities of the bodies, rad/s, `(num_envs, nbody, 3)`.
    #[getter]
    fn body_angular_velocity(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::BodyAngularVelocity)
    }

    /// Centers of the geoms, m, `(num_envs, ngeom, 3)`.
    #[getter]
    fn geom_pos(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::GeomPos)
    }

    /// Velocities of the geoms' centers, m/s, `(num_envs, ngeom, 3)`.
    #[getter]
    fn geom_velocity(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::GeomVelocity)
    }

    /// Geoms that touched the static world at the last physics step, `(num_envs, ngeom)`, bool.
    #[getter]
    fn touching(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::Touching)
    }

    /// Geoms that touched the static world at any physics step of the last `step`, `(num_envs, ngeom)`, bool.
    #[getter]
    fn touched(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::Touched)
    }

    /// Normal forces of the geoms' contacts with the static world at the last physics step, N, `(num_envs, ngeom)`.
    #[getter]
    fn normal_force(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::NormalForce)
    }

    /// Sensors' values at the present state and controls, in the model's order, `(num_envs, ...)`; NaN for those that
    /// cannot be evaluated. This costs about as much as a physics step.
    #[getter]
    fn sensors(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        exclusive(slf)?.reading(py, Quantity::Sensors)
    }

    fn __len__(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(shared(slf)?.num_envs)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = &*shared(slf)?;
        Ok(format!("Simulation({:?}, num_envs={})", this.model.get().inner.name, this.num_envs))
    }
}

/// Upper bound on the memory of an agent with all its readings, bytes.
fn agent_bytes(model: &marathon_physics::Model) -> f64 {
    let mocap = 14 * model.mocap_bodies().count();
    let state = model.nq + 3 * model.nv + 2 * model.nu + model.na + 6 * model.bodies.len() + mocap;
    let frames = 18 * model.bodies.len() + 6 * model.geoms.len();
    let contacts = 6 * model.geoms.len();
    let sensors: usize = model.sensors.iter().map(|sensor| sensor.dim).sum();
    let ground: usize = model.hfields.iter().map(|field| field.nrow * field.ncol).sum();
    // what physics keeps of pairs of geoms
    let colliding = model.geoms.iter().filter(|geom| geom.contype != 0 || geom.conaffinity != 0).count();
    let pairs = (colliding * colliding / 2).min(MOST_PAIRS);
    (8 * (state + frames + contacts + sensors + ground + pairs) + OVERHEAD) as f64
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
            Quantity::MocapPos => vec![n, model.mocap_bodies().count(), 3],
            Quantity::MocapQuat => vec![n, model.mocap_bodies().count(), 4],
            Quantity::GeomPos | Quantity::GeomVelocity => vec![n, geoms, 3],
            flat => vec![n, flat.width(model)],
        }
    }
}
