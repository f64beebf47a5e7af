//! A compiled model file: what is in it, by name and by index.

use crate::{error, model_edit, number};
use marathon_physics::hint::among;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::model::{Joint, JointType};
use marathon_physics::spec::ModelSpec;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::path::PathBuf;
use std::sync::Arc;

type Numbers<'py> = Bound<'py, PyArray1<f64>>;
type Table<'py> = Bound<'py, PyArray2<f64>>;
type Indices<'py> = Bound<'py, PyArray1<i64>>;

/// A compiled MJCF model, the counterpart of MuJoCo's `MjModel`: SI units, radians, quaternions w x y z, body 0 is the
/// world. Where the file gives no name, the name is empty.
#[pyclass(frozen, module = "marathon_rl")]
pub struct Model {
    pub(crate) inner: Arc<marathon_physics::Model>,
    /// The file before it was compiled. `None` for models of tasks.
    pub(crate) spec: Option<ModelSpec>,
}

#[pymethods]
impl Model {
    /// Reads a model file; included files and height fields are looked up beside it.
    #[staticmethod]
    #[pyo3(signature = (path, /))]
    fn from_xml_path(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Self::of(py, || ModelSpec::from_xml_file(path))
    }

    /// Compiles a model given as text, which has no other files; `name` stands for the file in messages.
    #[staticmethod]
    #[pyo3(signature = (xml, /, name = "model"))]
    fn from_xml_string(py: Python<'_>, xml: &str, name: &str) -> PyResult<Self> {
        Self::of(py, || ModelSpec::from_xml_str(xml, name))
    }

    /// A copy of the model with other attributes, `{kind: {name: {attribute: value}}}` or `{section: {attribute: value}}`, and
    /// without the elements of `remove`, `{kind: [name]}`, and what refers to them.
    #[pyo3(signature = (changes = None, *, remove = None))]
    fn edit(
        &self,
        py: Python<'_>,
        changes: Option<&Bound<'_, PyDict>>,
        remove: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let Some(spec) = &self.spec else {
            let expected = "expected one of Model.from_xml_path or Model.from_xml_string";
            return Err(error::value(format!("the model of a task cannot be edited, {expected}")));
        };
        let spec = model_edit::edited(spec, changes, remove)?;
        Self::of(py, || Ok(spec))
    }

    /// The settings of the physics as in MJCF's `option`: a new dict.
    #[getter]
    fn option<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        model_edit::option(py, &self.inner.opt)
    }

    /// Name of the model.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// Seconds per physics step.
    #[getter]
    fn timestep(&self) -> f64 {
        self.inner.opt.timestep
    }

    /// Length of `qpos`.
    #[getter]
    fn nq(&self) -> usize {
        self.inner.nq
    }

    /// Length of `qvel`.
    #[getter]
    fn nv(&self) -> usize {
        self.inner.nv
    }

    /// Number of actuators.
    #[getter]
    fn nu(&self) -> usize {
        self.inner.nu
    }

    /// Indices of the mocap bodies, `(nmocap,)`.
    #[getter]
    fn mocap_bodies<'py>(&self, py: Python<'py>) -> Indices<'py> {
        indices(py, self.inner.mocap_bodies().collect::<Vec<_>>().into_iter())
    }

    /// Names of the bodies, the first being the world.
    #[getter]
    fn body_names(&self) -> Vec<&str> {
        self.inner.bodies.iter().map(|x| x.name.as_str()).collect()
    }

    /// Names of the geoms.
    #[getter]
    fn geom_names(&self) -> Vec<&str> {
        self.inner.geoms.iter().map(|x| x.name.as_str()).collect()
    }

    /// Names of the joints.
    #[getter]
    fn joint_names(&self) -> Vec<&str> {
        self.inner.joints.iter().map(|x| x.name.as_str()).collect()
    }

    /// Names of the actuators.
    #[getter]
    fn actuator_names(&self) -> Vec<&str> {
        self.inner.actuators.iter().map(|x| x.name.as_str()).collect()
    }

    /// Names of the sensors.
    #[getter]
    fn sensor_names(&self) -> Vec<&str> {
        self.inner.sensors.iter().map(|x| x.name.as_str()).collect()
    }

    /// Names of the keyframes.
    #[getter]
    fn keyframe_names(&self) -> Vec<&str> {
        self.inner.keyframes.iter().map(|x| x.name.as_str()).collect()
    }

    /// Index of a body.
    fn body(&self, name: &str) -> PyResult<usize> {
        find("body", name, self.body_names())
    }

    /// Index of a geom.
    fn geom(&self, name: &str) -> PyResult<usize> {
        find("geom", name, self.geom_names())
    }

    /// Index of a joint.
    fn joint(&self, name: &str) -> PyResult<usize> {
        find("joint", name, self.joint_names())
    }

    /// Index of an actuator.
    fn actuator(&self, name: &str) -> PyResult<usize> {
        find("actuator", name, self.actuator_names())
    }

    /// First value of a sensor among all sensors' values, and their number.
    fn sensor(&self, name: &str) -> PyResult<(usize, usize)> {
        let sensor = &self.inner.sensors[find("sensor", name, self.sensor_names())?];
        Ok((sensor.adr, sensor.dim))
    }

    /// `qpos`, `(nq,)`, and `qvel`, `(nv,)`, of a keyframe.
    fn keyframe<'py>(&self, py: Python<'py>, name: &str) -> PyResult<(Numbers<'py>, Numbers<'py>)> {
        let key = &self.inner.keyframes[find("keyframe", name, self.keyframe_names())?];
        Ok((PyArray1::from_slice(py, &key.qpos), PyArray1::from_slice(py, &key.qvel)))
    }

    /// Reference configuration, `(nq,)`.
    #[getter]
    fn qpos0<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, &self.inner.qpos0)
    }

    /// Parent of each body, `(nbody,)`.
    #[getter]
    fn body_parent<'py>(&self, py: Python<'py>) -> Indices<'py> {
        indices(py, self.inner.bodies.iter().map(|b| b.parent))
    }

    /// Body that each body follows rigidly: itself if it has joints; 0 if it does not move. `(nbody,)`.
    #[getter]
    fn body_weld<'py>(&self, py: Python<'py>) -> Indices<'py> {
        indices(py, self.inner.bodies.iter().map(|b| b.weld_id))
    }

    /// First body of each body's tree, `(nbody,)`.
    #[getter]
    fn body_root<'py>(&self, py: Python<'py>) -> Indices<'py> {
        indices(py, self.inner.bodies.iter().map(|b| b.root_id))
    }

    /// Orientation of each body in its parent, `(nbody, 4)`.
    #[getter]
    fn body_quat<'py>(&self, py: Python<'py>) -> PyResult<Table<'py>> {
        table(py, self.inner.bodies.iter().map(|b| b.quat))
    }

    /// Mass of each body, kg, `(nbody,)`.
    #[getter]
    fn body_mass<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_iter(py, self.inner.bodies.iter().map(|b| b.mass))
    }

    /// Body of each geom, `(ngeom,)`.
    #[getter]
    fn geom_body<'py>(&self, py: Python<'py>) -> Indices<'py> {
        indices(py, self.inner.geoms.iter().map(|g| g.body))
    }

    /// "free", "ball", "slide" or "hinge" for each joint.
    #[getter]
    fn joint_type(&self) -> Vec<&'static str> {
        let name = |joint: &Joint| match joint.kind {
            JointType::Free => "free",
            JointType::Ball => "ball",
            JointType::Slide => "slide",
            JointType::Hinge => "hinge",
        };
        self.inner.joints.iter().map(name).collect()
    }

    /// Body that each joint moves, `(njoint,)`.
    #[getter]
    fn joint_body<'py>(&self, py: Python<'py>) -> Indices<'py> {
        indices(py, self.inner.joints.iter().map(|j| j.body))
    }

    /// First coordinate of each joint in `qpos`, `(njoint,)`.
    #[getter]
    fn joint_qpos<'py>(&self, py: Python<'py>) -> Indices<'py> {
        indices(py, self.inner.joints.iter().map(|j| j.qpos_adr))
    }

    /// First velocity of each joint in `qvel`, `(njoint,)`.
    #[getter]
    fn joint_dof<'py>(&self, py: Python<'py>) -> Indices<'py> {
        indices(py, self.inner.joints.iter().map(|j| j.dof_adr))
    }

    /// Axis of each hinge or slide in its body's frame, `(njoint, 3)`.
    #[getter]
    fn joint_axis<'py>(&self, py: Python<'py>) -> PyResult<Table<'py>> {
        table(py, self.inner.joints.iter().map(|j| j.axis))
    }

    /// Limits of each joint, rad or m, infinite where there are none, `(njoint, 2)`.
    #[getter]
    fn joint_range<'py>(&self, py: Python<'py>) -> PyResult<Table<'py>> {
        let range = |j: &Joint| if j.limited { j.range } else { [f64::NEG_INFINITY, f64::INFINITY] };
        table(py, self.inner.joints.iter().map(range))
    }

    /// Joint that each actuator acts on, -1 for one that acts on something else, `(nu,)`.
    #[getter]
    fn actuator_joint<'py>(&self, py: Python<'py>) -> Indices<'py> {
        PyArray1::from_iter(py, self.inner.actuators.iter().map(|a| a.joint().map_or(-1, |joint| joint as i64)))
    }

    /// Range of each actuator's control in its own units, infinite where there is none, `(nu, 2)`.
    #[getter]
    fn actuator_range<'py>(&self, py: Python<'py>) -> PyResult<Table<'py>> {
        let unlimited = [f64::NEG_INFINITY, f64::INFINITY];
        table(py, self.inner.actuators.iter().map(|a| if a.ctrl_limited { a.ctrl_range } else { unlimited }))
    }

    /// Names of the height fields.
    #[getter]
    fn hfield_names(&self) -> Vec<&str> {
        self.inner.hfields.iter().map(|x| x.name.as_str()).collect()
    }

    /// Index of a height field.
    fn hfield(&self, name: &str) -> PyResult<usize> {
        find("height field", name, self.hfield_names())
    }

    /// Rows of each height field's grid, along y, `(nhfield,)`.
    #[getter]
    fn hfield_nrow<'py>(&self, py: Python<'py>) -> Indices<'py> {
        indices(py, self.inner.hfields.iter().map(|h| h.nrow))
    }

    /// Columns of each height field's grid, along x, `(nhfield,)`.
    #[getter]
    fn hfield_ncol<'py>(&self, py: Python<'py>) -> Indices<'py> {
        indices(py, self.inner.hfields.iter().map(|h| h.ncol))
    }

    /// Half extents of each height field along x and y, height of its highest elevation, thickness of its base, m,
    /// `(nhfield, 4)`.
    #[getter]
    fn hfield_size<'py>(&self, py: Python<'py>) -> PyResult<Table<'py>> {
        table(py, self.inner.hfields.iter().map(|h| h.size))
    }

    fn __repr__(&self) -> String {
        let m = &self.inner;
        format!("Model({:?}, nq={}, nv={}, nu={})", m.name, m.nq, m.nv, m.nu)
    }
}

impl Model {
    /// Index of a body that is given by its index or its name.
    pub(crate) fn body_index(&self, body: &Bound<'_, PyAny>) -> PyResult<usize> {
        if let Ok(name) = body.cast::<PyString>() {
            return self.body(name.to_str()?);
        }
        let (index, n): (usize, usize) = (number::body(body)?, self.inner.bodies.len());
        if index < n { Ok(index) } else { Err(error::value(format!("body is {index}, expected less than {n}"))) }
    }

    /// Rows and columns of a height field's grid.
    pub(crate) fn grid(&self, field: usize) -> PyResult<[usize; 2]> {
        let fields = &self.inner.hfields;
        let beyond = || match fields.len() {
            0 => error::value(format!("field is {field}, but the model has no height fields")),
            n => error::value(format!("field is {field}, expected less than {n}")),
        };
        fields.get(field).map(|h| [h.nrow, h.ncol]).ok_or_else(beyond)
    }

    /// Reads and compiles a model without the GIL.
    fn of(py: Python<'_>, read: impl FnOnce() -> Result<ModelSpec, MjcfError> + Send) -> PyResult<Self> {
        let compile = || read().and_then(|spec| Ok((spec.compile()?, spec)));
        let (model, spec) = py.detach(compile).map_err(|e| error::value(e.to_string()))?;
        Ok(Model { inner: Arc::new(model), spec: Some(spec) })
    }
}

fn indices(py: Python<'_>, all: impl ExactSizeIterator<Item = usize>) -> Indices<'_> {
    PyArray1::from_iter(py, all.map(|i| i as i64))
}

fn table<const N: usize>(py: Python<'_>, rows: impl ExactSizeIterator<Item = [f64; N]>) -> PyResult<Table<'_>> {
    let n = rows.len();
    PyArray1::from_iter(py, rows.flatten()).reshape([n, N])
}

/// Index of a name, or an error that names the nearest.
fn find(what: &str, name: &str, known: Vec<&str>) -> PyResult<usize> {
    known.iter().position(|k| *k == name && !name.is_empty()).ok_or_else(|| {
        let named: Vec<&str> = known.into_iter().filter(|k| !k.is_empty()).collect();
        error::value(format!("the model has no {what} '{name}'{}", among(name, &named)))
    })
}
