//! Many agents of one kind as a Python object.

use crate::arrays::{Arrays, ObsMut, mask, of_shape, rows};
use crate::borrow::{exclusive, shared};
use crate::inputs::{self, Constants, Grounds, grounds_array};
use crate::model::Model;
use crate::number::{self, Seeds};
use crate::spec::Spec;
use crate::viewer::{Shown, Viewer};
use crate::{choices, error, options, task};
use marathon_envs::{AgentState, Autoreset, Options, VecEnvOptions, registry};
use marathon_physics::lanes::Isa;
use numpy::ndarray::Ix2;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

type State<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);
type StepResult = (Py<PyAny>, Py<PyArray1<f32>>, Py<PyArray1<bool>>, Py<PyArray1<bool>>);

/// Agents of one kind that are stepped together on the threads of a pool, without the GIL.
///
/// Arrays are row-major with one row per agent. Without `copy`, the environment owns the arrays that it returns and
/// overwrites them at the next step; with `copy`, every step returns new ones. Observations are computed in
/// 32 bits, and written in 64 if `dtype` says so, or without it if the task is one of Gymnasium's.
#[pyclass(module = "marathon_rl")]
pub struct VecEnv {
    /// Behind a lock because a Python object may be dropped on any thread; never contended.
    env: Mutex<marathon_envs::VecEnv>,
    arrays: Arrays,
    spec: Py<Spec>,
    num_envs: usize,
    autoreset: Autoreset,
    copy: bool,
    ready: bool,
    made: Made,
    model: Option<Py<Model>>,
    shown: Option<Shown>,
}

/// Arguments that an environment was made with, as far as it does not tell them.
struct Made {
    seed: u64,
    threads: usize,
    isa: Option<Isa>,
}

#[pymethods]
impl VecEnv {
    #[new]
    #[pyo3(signature = (
        id, num_envs = 1, *, seed = 0, threads = 0, isa = None, autoreset = "next_step", max_episode_steps = None,
        copy = false, dtype = None, **options
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of a Python constructor")]
    fn new(
        py: Python<'_>,
        #[pyo3(from_py_with = task::name)] id: String,
        #[pyo3(from_py_with = number::num_envs)] num_envs: usize,
        #[pyo3(from_py_with = number::seed)] seed: u64,
        #[pyo3(from_py_with = number::threads)] threads: usize,
        isa: Option<&str>,
        autoreset: &str,
        #[pyo3(from_py_with = number::max_episode_steps)] max_episode_steps: Option<usize>,
        copy: bool,
        dtype: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let isa = isa.map(str::parse::<Isa>).transpose().map_err(error::value)?;
        let autoreset = choices::autoreset(autoreset)?;
        let double = dtype.map(choices::is_double).transpose()?;
        let (agents, made) = (num_envs, Made { seed, threads, isa });
        let id = task::plain(&id);
        let setting = options::set(id, options)?;
        let options = Options::new();
        let options = VecEnvOptions { agents, seed, threads, isa, autoreset, max_episode_steps, options };
        let env = py.detach(|| setting.vec_env(&options)).map_err(error::run)?;
        let spec = Spec::of(env.spec())?;
        let arrays = Arrays::new(py, num_envs, env.spec(), double.unwrap_or(spec.is_double()));
        let spec = Py::new(py, spec)?;
        Ok(VecEnv {
            env: Mutex::new(env),
            arrays,
            spec,
            num_envs,
            autoreset,
            copy,
            ready: false,
            made,
            model: None,
            shown: None,
        })
    }

    /// Facts of the task, with this environment's `max_episode_steps`.
    #[getter]
    fn spec(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<Spec>> {
        Ok(shared(slf)?.spec.clone_ref(py))
    }

    /// Number of agents.
    #[getter]
    fn num_envs(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(shared(slf)?.num_envs)
    }

    /// Number of threads.
    #[getter]
    fn threads(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(exclusive(slf)?.env().threads())
    }

    /// Reset mode for agents whose episode ended: "next_step", "same_step" or "disabled".
    #[getter]
    fn autoreset(slf: &Bound<'_, Self>) -> PyResult<&'static str> {
        Ok(choices::autoreset_name(shared(slf)?.autoreset))
    }

    /// Type of the observations, "float32" or "float64".
    #[getter]
    fn dtype(slf: &Bound<'_, Self>) -> PyResult<&'static str> {
        Ok(choices::dtype_name(shared(slf)?.arrays.double()))
    }

    /// Whether every step returns new arrays.
    #[getter]
    fn copy(slf: &Bound<'_, Self>) -> PyResult<bool> {
        Ok(shared(slf)?.copy)
    }

    /// Observations to act upon next, `(num_envs, obs_size)`: what the last `reset` or `step` returned.
    #[getter]
    fn obs(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(shared(slf)?.arrays.obs(py))
    }

    /// Observations of the states that the last step reached, `(num_envs, obs_size)`. With "same_step", they differ from
    /// `obs` where an episode ended. Overwritten by the next step, also with `copy`.
    #[getter]
    fn final_obs(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(shared(slf)?.arrays.final_obs(py))
    }

    /// Terms of the last step's rewards, `(num_envs, len(spec.reward_terms))`; they add up to the rewards.
    #[getter]
    fn reward_terms(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyArray2<f32>>> {
        Ok(shared(slf)?.arrays.terms.clone_ref(py))
    }

    /// The agents' metrics of the states that the last step reached, `(num_envs, len(spec.info))`.
    #[getter]
    fn info(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyArray2<f32>>> {
        Ok(shared(slf)?.arrays.info.clone_ref(py))
    }

    /// The agents' metrics of their current states, `(num_envs, len(spec.info))`, a new array. It differs from `info`
    /// where a step has begun an episode.
    fn read_info<'py>(slf: &Bound<'_, Self>, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let this = &mut *exclusive(slf)?;
        let (n, columns) = (this.num_envs, this.spec.get().info.len());
        let mut info = vec![0.0; n * columns];
        this.env().info(&mut info).map_err(error::env)?;
        PyArray1::from_vec(py, info).reshape([n, columns])
    }

    /// Distance that each agent moved along +x in the last step, m, `(num_envs,)`.
    #[getter]
    fn forward(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyArray1<f32>>> {
        Ok(shared(slf)?.arrays.forward.clone_ref(py))
    }

    /// Agents whose simulation broke down in the last step, `(num_envs,)`; they count as terminated, with reward 0.
    #[getter]
    fn diverged(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<PyArray1<bool>>> {
        Ok(shared(slf)?.arrays.diverged.clone_ref(py))
    }

    /// Position of each agent's root along x, m, `(num_envs,)`, a new array; `None` if the task has no such thing.
    #[getter]
    fn x_position<'py>(slf: &Bound<'_, Self>, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        Ok(exclusive(slf)?.env().x_positions().map(|x| PyArray1::from_vec(py, x)))
    }

    /// Starts new episodes and returns the observations, `(num_envs, obs_size)`.
    ///
    /// A seed restarts the random streams: the same seed gives the same episodes. A sequence has a seed, or `None`, for
    /// each agent, which then acts as the only agent of an environment with that seed. With a mask, `(num_envs,)`, only
    /// the chosen agents are reset.
    #[pyo3(signature = (seed = None, mask = None))]
    fn reset(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        #[pyo3(from_py_with = number::seeds)] seed: Option<Seeds>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let this = &mut *exclusive(slf)?;
        let mask = self::mask(mask, this.num_envs)?;
        if !this.ready && mask.contains(&false) {
            return Err(error::value("the first reset must be of all agents; mask has some that are False"));
        }
        // seeds and the numbers of the streams that they mean
        let streams: Vec<Option<(u64, usize)>> = match seed {
            None => vec![None; this.num_envs],
            Some(Seeds::One(seed)) => (0..this.num_envs).map(|i| Some((seed, i))).collect(),
            Some(Seeds::Each(each)) if each.len() == this.num_envs => {
                each.iter().map(|seed| seed.map(|seed| (seed, 0))).collect()
            }
            Some(Seeds::Each(each)) => {
                return Err(error::value(format!("seed has {} numbers, expected {}", each.len(), this.num_envs)));
            }
        };
        this.begin(py, move |env, obs| {
            for (i, stream) in streams.iter().enumerate().filter(|(i, _)| mask[*i]) {
                if let Some((seed, number)) = stream {
                    env.reseed_agent(i, *seed, *number)?;
                }
            }
            match obs {
                ObsMut::Single(obs) => env.reset_agents(&mask, obs),
                ObsMut::Double(obs) => env.reset_agents(&mask, obs),
            }
        })
    }

    /// Advances every agent by one decision. `actions` is `(num_envs, act_size)`, within
    /// `spec.action_low` and `spec.action_high`.
    ///
    /// Returns `(obs, reward, terminated, truncated)`, of shapes `(num_envs, obs_size)` and three times `(num_envs,)`;
    /// more is in `final_obs`, `reward_terms`, `forward` and `diverged`. A C-contiguous float32 array is read in place.
    fn step(slf: &Bound<'_, Self>, py: Python<'_>, actions: &Bound<'_, PyAny>) -> PyResult<StepResult> {
        let this = &mut *exclusive(slf)?;
        if !this.ready {
            return Err(error::value("reset must be called before the first step"));
        }
        let actions = of_shape::<f32, Ix2, 2>("actions have", actions, [this.num_envs, this.spec.get().act_size])?;
        if this.copy {
            let env = this.env.get_mut().expect("no thread panics with the lock");
            this.arrays.renew(py, this.num_envs, env.spec());
        }
        let actions = rows(&actions);
        let env = this.env.get_mut().expect("no thread panics with the lock");
        this.arrays.step(py, env, &actions)?.map_err(error::env)?;
        let a = &this.arrays;
        if let Some(shown) = &mut this.shown {
            let (terminated, truncated) = (a.terminated.bind(py).readonly(), a.truncated.bind(py).readonly());
            let (terminated, truncated) = (terminated.as_array(), truncated.as_array());
            shown.stepped(env, |agent| terminated[agent] || truncated[agent])?;
        }
        Ok((a.obs(py), a.reward.clone_ref(py), a.terminated.clone_ref(py), a.truncated.clone_ref(py)))
    }

    /// Shows up to 16 agents in a browser: returns a `Viewer`, whose `url` this computer can open. Steps show themselves
    /// from now on; they never wait for the page. Port 0 takes a free one; `page` is the folder of the page.
    #[pyo3(signature = (*, port = 0, page = None))]
    fn show(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        #[pyo3(from_py_with = number::port)] port: u16,
        page: Option<PathBuf>,
    ) -> PyResult<Viewer> {
        let this = &mut *exclusive(slf)?;
        let model = this.own_model(py)?.get().inner.clone();
        let (autoreset, env) = (this.autoreset, this.env.get_mut().expect("no thread panics with the lock"));
        let (shown, viewer) = Shown::start(py, env, &model, autoreset, port, page)?;
        this.shown = Some(shown);
        Ok(viewer)
    }

    /// State of every agent in MuJoCo's layout: `qpos`, `(num_envs, nq)`, and `qvel`, `(num_envs, nv)`, m, rad, m/s and
    /// rad/s, quaternions w x y z.
    fn get_state<'py>(slf: &Bound<'_, Self>, py: Python<'py>) -> PyResult<State<'py>> {
        let this = &mut *exclusive(slf)?;
        let (n, spec) = (this.num_envs, this.spec.clone_ref(py));
        let (mut qpos, mut qvel) = (Vec::new(), Vec::new());
        for i in 0..n {
            let state = this.env().state(i).map_err(error::env)?;
            qpos.extend(state.qpos);
            qvel.extend(state.qvel);
        }
        let array = |data, columns| PyArray1::from_vec(py, data).reshape([n, columns]);
        Ok((array(qpos, spec.get().nq)?, array(qvel, spec.get().nv)?))
    }

    /// Puts agents, all or those of a mask, into states as `get_state` returns them, as if their
    /// episodes had begun there. Returns the observations, `(num_envs, obs_size)`.
    #[pyo3(signature = (qpos, qvel, mask = None))]
    fn set_state(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        qpos: &Bound<'_, PyAny>,
        qvel: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let this = &mut *exclusive(slf)?;
        let mask = self::mask(mask, this.num_envs)?;
        let spec = this.spec.get();
        let qpos = of_shape::<f64, Ix2, 2>("qpos has", qpos, [this.num_envs, spec.nq])?;
        let qvel = of_shape::<f64, Ix2, 2>("qvel has", qvel, [this.num_envs, spec.nv])?;
        let (qpos, qvel) = (qpos.as_array(), qvel.as_array());
        if let Some(i) = (0..this.num_envs).find(|i| mask[*i] && !all_finite([qpos.row(*i), qvel.row(*i)])) {
            return Err(error::value(format!("the state of agent {i} is not finite")));
        }
        let env = this.env.get_mut().expect("no thread panics with the lock");
        for i in (0..this.num_envs).filter(|i| mask[*i]) {
            let state = AgentState { qpos: qpos.row(i).to_vec(), qvel: qvel.row(i).to_vec() };
            env.set_state(i, &state).map_err(error::env)?;
        }
        this.begin(py, move |env, obs| match obs {
            ObsMut::Single(obs) => env.observe(&mask, obs),
            ObsMut::Double(obs) => env.observe(&mask, obs),
        })
    }

    /// The compiled model: what the indices of bodies, actuators and height fields mean.
    #[getter]
    fn model(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<Py<Model>> {
        exclusive(slf)?.own_model(py)
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
        let none = this.env().unvaried().clone();
        for (agent, own) in (Constants { mass, friction, strength, gravity, mask }).read(&none, this.num_envs)? {
            this.env().vary(agent, &own).map_err(error::env)?;
        }
        Ok(())
    }

    /// Command in each agent's current observation, `(num_envs, len(spec.command))`, a new array.
    #[getter]
    fn command<'py>(slf: &Bound<'_, Self>, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let this = &mut *exclusive(slf)?;
        let (n, columns) = (this.num_envs, this.spec.get().command.len());
        let mut all = Vec::with_capacity(n * columns);
        for agent in 0..n {
            all.extend(this.env().context(agent).map_err(error::env)?.command());
        }
        PyArray1::from_vec(py, all).reshape([n, columns])
    }

    /// Tells agents, all or those of a mask, what to do, `(num_envs, len(spec.command))`, in place of their own schedule;
    /// with `None`, gives them back to it. They observe it at the end of the next step or at the start of the next episode,
    /// and are rewarded for it from there on. It lasts over resets, until changed.
    #[pyo3(signature = (command, mask = None))]
    fn set_command(
        slf: &Bound<'_, Self>,
        command: Option<&Bound<'_, PyAny>>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let this = &mut *exclusive(slf)?;
        let n = this.num_envs;
        let mask = self::mask(mask, n)?;
        let columns = this.spec.get().command.len();
        if columns == 0 {
            let id = &this.spec.get().id;
            return Err(error::value(format!("the agents of {id} take no commands, spec.command is empty")));
        }
        let Some(command) = command else {
            for agent in (0..n).filter(|i| mask[*i]) {
                this.env().set_command(agent, None).map_err(error::env)?;
            }
            return Ok(());
        };
        let command = of_shape::<f64, Ix2, 2>("command has", command, [n, columns])?;
        let command = rows(&command).into_owned();
        let before = this.env().save();
        for agent in (0..n).filter(|i| mask[*i]) {
            if let Err(error) = this.env().set_command(agent, Some(&command[agent * columns..][..columns])) {
                // all or nothing
                this.env().load(&before).map_err(error::env)?;
                return Err(error::value(error.to_string().replace("agent '", &format!("agent {agent} of '"))));
            }
        }
        Ok(())
    }

    /// Pushes a body, given by its index or name, of all agents or those of a mask: force, N, and torque, N m,
    /// `(num_envs, 3)`, in world axes at the body's center of mass. It lasts until changed or until the agent's next
    /// episode.
    #[pyo3(signature = (force, torque = None, *, body, mask = None))]
    fn push(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        force: &Bound<'_, PyAny>,
        torque: Option<&Bound<'_, PyAny>>,
        body: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let this = &mut *exclusive(slf)?;
        let model = this.own_model(py)?;
        let pushes = inputs::pushes(model.get(), this.num_envs, force, torque, body, mask)?;
        for (agent, force, torque) in pushes.each {
            this.env().push(agent, pushes.body, force, torque).map_err(error::env)?;
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
        let (n, grid) = (this.num_envs, this.grid(py, field)?);
        let mut elevations = Vec::with_capacity(n * grid[0] * grid[1]);
        for agent in 0..n {
            elevations.extend(this.env().ground(agent, field).map_err(error::env)?);
        }
        grounds_array(py, n, grid, elevations)
    }

    /// Sets the ground of all agents or those of a mask: elevations, m above the zero of the model's height field `field`,
    /// `(num_envs, nrow, ncol)`, or `(nrow, ncol)` for the same ground. The first row has the smallest y. The ground lasts
    /// over resets, until changed. In tasks that draw the ground of every episode, such as `TerrainWalker2d-v0`, it lasts
    /// until the episode ends.
    #[pyo3(signature = (elevations, field = 0, mask = None))]
    fn set_ground(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        elevations: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = number::field)] field: usize,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let this = &mut *exclusive(slf)?;
        let grounds = Grounds::read(this.grid(py, field)?, this.num_envs, elevations, mask)?;
        for (agent, elevations) in grounds.each() {
            this.env().set_ground(agent, field, elevations).map_err(error::env)?;
        }
        Ok(())
    }

    /// Everything that the future depends on. Loaded, the environment continues with the same bits, whatever the number
    /// of threads and the instruction set.
    fn save<'py>(slf: &Bound<'_, Self>, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &exclusive(slf)?.env().save()))
    }

    /// Restores what `save` returned for the same task and number of agents. Observations are those of
    /// the next step.
    fn load(slf: &Bound<'_, Self>, snapshot: &[u8]) -> PyResult<()> {
        exclusive(slf)?.restore(snapshot)
    }

    /// For `copy` and `pickle`: the arguments.
    fn __getnewargs_ex__<'py>(
        slf: &Bound<'_, Self>,
        py: Python<'py>,
    ) -> PyResult<((String, usize), Bound<'py, PyDict>)> {
        let this = &*shared(slf)?;
        let (spec, Made { seed, threads, isa }) = (this.spec.get(), &this.made);
        let keywords = options::show(py, &spec.options)?;
        keywords.set_item("seed", seed)?;
        keywords.set_item("threads", threads)?;
        keywords.set_item("isa", isa.map(Isa::name))?;
        keywords.set_item("autoreset", choices::autoreset_name(this.autoreset))?;
        keywords.set_item("max_episode_steps", spec.max_episode_steps)?;
        keywords.set_item("copy", this.copy)?;
        keywords.set_item("dtype", choices::dtype_name(this.arrays.double()))?;
        Ok(((spec.id.clone(), this.num_envs), keywords))
    }

    /// For `copy` and `pickle`: a snapshot, unless nothing has begun, and the observations.
    fn __getstate__<'py>(slf: &Bound<'_, Self>, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let this = &mut *exclusive(slf)?;
        let state = PyDict::new(py);
        let snapshot = this.ready.then(|| PyBytes::new(py, &this.env().save()));
        state.set_item("snapshot", snapshot)?;
        state.set_item("obs", this.arrays.obs(py).call_method0(py, "copy")?)?;
        Ok(state)
    }

    /// Goes on from a snapshot and its observations.
    fn __setstate__(slf: &Bound<'_, Self>, py: Python<'_>, state: &Bound<'_, PyDict>) -> PyResult<()> {
        let this = &mut *exclusive(slf)?;
        let part = |name| state.get_item(name)?.ok_or_else(|| error::value(format!("the state has no {name}")));
        let (snapshot, obs) = (part("snapshot")?, part("obs")?);
        if !snapshot.is_none() {
            let obs = of_shape::<f64, Ix2, 2>("obs has", &obs, [this.num_envs, this.spec.get().obs_size])?;
            this.restore(snapshot.cast::<PyBytes>()?.as_bytes())?;
            let obs = rows(&obs).into_owned();
            this.arrays.write_obs(py, this.copy, |to| match to {
                ObsMut::Single(to) => to.iter_mut().zip(&obs).for_each(|(to, x)| *to = *x as f32),
                ObsMut::Double(to) => to.copy_from_slice(&obs),
            })?;
        }
        Ok(())
    }

    fn __len__(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(shared(slf)?.num_envs)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = &*shared(slf)?;
        let (id, autoreset) = (&this.spec.get().id, choices::autoreset_name(this.autoreset));
        Ok(format!("VecEnv({id:?}, num_envs={}, autoreset={autoreset:?})", this.num_envs))
    }
}

impl VecEnv {
    /// Rows and columns of a height field's grid.
    fn grid(&mut self, py: Python<'_>, field: usize) -> PyResult<[usize; 2]> {
        self.own_model(py)?.get().grid(field)
    }

    /// The model, compiled when it is first asked for.
    fn own_model(&mut self, py: Python<'_>) -> PyResult<Py<Model>> {
        if self.model.is_none() {
            let spec = self.spec.get();
            let agent = registry::global().agent_with(&spec.id, &spec.options).map_err(error::env)?;
            let inner = Arc::new(agent.model().map_err(error::env)?);
            self.model = Some(Py::new(py, Model { inner, spec: None })?);
        }
        Ok(self.model.as_ref().expect("it was made").clone_ref(py))
    }

    /// Restores a snapshot; observations stay.
    fn restore(&mut self, snapshot: &[u8]) -> PyResult<()> {
        self.env().load(snapshot).map_err(error::env)?;
        self.ready = true;
        Ok(())
    }

    fn env(&mut self) -> &mut marathon_envs::VecEnv {
        self.env.get_mut().expect("no thread panics with the lock")
    }

    /// Lets `f` begin episodes and write their observations.
    fn begin<F>(&mut self, py: Python<'_>, f: F) -> PyResult<Py<PyAny>>
    where
        F: FnOnce(&mut marathon_envs::VecEnv, ObsMut<'_>) -> Result<(), marathon_envs::EnvError> + Send,
    {
        let env = self.env.get_mut().expect("no thread panics with the lock");
        // rows of agents that go on are carried over into a copy
        self.arrays.write_obs(py, self.copy, |obs| f(env, obs))?.map_err(error::env)?;
        if let Some(shown) = &mut self.shown {
            shown.reset(env)?;
        }
        self.ready = true;
        Ok(self.arrays.obs(py))
    }
}

fn all_finite<'a, const N: usize>(rows: [numpy::ndarray::ArrayView1<'a, f64>; N]) -> bool {
    rows.iter().all(|row| row.iter().all(|x| x.is_finite()))
}
