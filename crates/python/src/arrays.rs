//! The NumPy arrays that a step writes to, and those that it reads.

use crate::error;
use marathon_envs::{EnvError, ObsNumber, Spec, StepMut, VecEnv};
use numpy::{
    AllowTypeChange, Element, PyArray, PyArray1, PyArray2, PyArrayDescr, PyArrayDescrMethods, PyArrayLike,
    PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray, PyUntypedArray, PyUntypedArrayMethods,
    ndarray::Dimension,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::borrow::Cow;

/// Results of a step, the fields of [`marathon_envs::Step`].
pub struct Arrays {
    observations: Observations,
    pub reward: Py<PyArray1<f32>>,
    pub terms: Py<PyArray2<f32>>,
    pub info: Py<PyArray2<f32>>,
    pub forward: Py<PyArray1<f32>>,
    pub terminated: Py<PyArray1<bool>>,
    pub truncated: Py<PyArray1<bool>>,
    pub diverged: Py<PyArray1<bool>>,
    /// Those of the step before, see [`Arrays::renew`].
    spare: Option<Box<Arrays>>,
}

/// Observations in one of two types of numbers.
enum Observations {
    Single(Pair<f32>),
    Double(Pair<f64>),
}

/// `obs` and `final_obs` of a step.
struct Pair<O: Element> {
    next: Py<PyArray2<O>>,
    last: Py<PyArray2<O>>,
}

/// Observations to write to.
pub enum ObsMut<'a> {
    Single(&'a mut [f32]),
    Double(&'a mut [f64]),
}

impl Arrays {
    /// For a number of agents; observations are float64 if `double`.
    pub fn new(py: Python<'_>, agents: usize, spec: &Spec, double: bool) -> Self {
        let shape = [agents, spec.obs];
        let observations = if double {
            Observations::Double(Pair::new(py, shape))
        } else {
            Observations::Single(Pair::new(py, shape))
        };
        Arrays {
            observations,
            reward: list(py, agents),
            terms: PyArray2::zeros(py, [agents, spec.reward_terms.len()], false).unbind(),
            info: PyArray2::zeros(py, [agents, spec.info.len()], false).unbind(),
            forward: list(py, agents),
            terminated: list(py, agents),
            truncated: list(py, agents),
            diverged: list(py, agents),
            spare: None,
        }
    }

    /// Observations to act upon next.
    pub fn obs(&self, py: Python<'_>) -> Py<PyAny> {
        match &self.observations {
            Observations::Single(pair) => pair.next.clone_ref(py).into_any(),
            Observations::Double(pair) => pair.next.clone_ref(py).into_any(),
        }
    }

    /// Observations of the states that the last step reached.
    pub fn final_obs(&self, py: Python<'_>) -> Py<PyAny> {
        match &self.observations {
            Observations::Single(pair) => pair.last.clone_ref(py).into_any(),
            Observations::Double(pair) => pair.last.clone_ref(py).into_any(),
        }
    }

    /// Whether observations are float64.
    pub fn double(&self) -> bool {
        matches!(self.observations, Observations::Double(_))
    }

    /// Replaces all arrays but `final_obs`, so that callers can keep those of the last step. Arrays of the step before
    /// are reused if no caller has kept them; others are new.
    pub fn renew(&mut self, py: Python<'_>, agents: usize, spec: &Spec) {
        let double = self.double();
        let mut spare = self.spare.take().unwrap_or_else(|| Box::new(Arrays::new(py, agents, spec, double)));
        match (&mut self.observations, &mut spare.observations) {
            (Observations::Single(pair), Observations::Single(spare)) => turn(py, &mut pair.next, &mut spare.next),
            (Observations::Double(pair), Observations::Double(spare)) => turn(py, &mut pair.next, &mut spare.next),
            _ => unreachable!("the type of observations never changes"),
        }
        turn(py, &mut self.terms, &mut spare.terms);
        turn(py, &mut self.info, &mut spare.info);
        turn(py, &mut self.reward, &mut spare.reward);
        turn(py, &mut self.forward, &mut spare.forward);
        turn(py, &mut self.terminated, &mut spare.terminated);
        turn(py, &mut self.truncated, &mut spare.truncated);
        turn(py, &mut self.diverged, &mut spare.diverged);
        self.spare = Some(spare);
    }

    /// Makes a step without the GIL and has it write to all arrays.
    pub fn step(&self, py: Python<'_>, env: &mut VecEnv, actions: &[f32]) -> PyResult<Result<(), EnvError>> {
        match &self.observations {
            Observations::Single(pair) => self.step_into(py, pair, env, actions),
            Observations::Double(pair) => self.step_into(py, pair, env, actions),
        }
    }

    fn step_into<O: Element + ObsNumber>(
        &self,
        py: Python<'_>,
        pair: &Pair<O>,
        env: &mut VecEnv,
        actions: &[f32],
    ) -> PyResult<Result<(), EnvError>> {
        let mut obs = writer(py, "obs", &pair.next)?;
        let mut final_obs = writer(py, "final_obs", &pair.last)?;
        let mut reward = writer(py, "reward", &self.reward)?;
        let mut terms = writer(py, "reward_terms", &self.terms)?;
        let mut info = writer(py, "info", &self.info)?;
        let mut forward = writer(py, "forward", &self.forward)?;
        let mut terminated = writer(py, "terminated", &self.terminated)?;
        let mut truncated = writer(py, "truncated", &self.truncated)?;
        let mut diverged = writer(py, "diverged", &self.diverged)?;
        let out = StepMut {
            obs: obs.as_slice_mut()?,
            final_obs: final_obs.as_slice_mut()?,
            reward: reward.as_slice_mut()?,
            terms: terms.as_slice_mut()?,
            info: info.as_slice_mut()?,
            forward: forward.as_slice_mut()?,
            terminated: terminated.as_slice_mut()?,
            truncated: truncated.as_slice_mut()?,
            diverged: diverged.as_slice_mut()?,
        };
        Ok(py.detach(|| env.step(actions, out)))
    }

    /// Lets `f` write to the observations without the GIL. With `keep`, it is a copy that it writes to.
    pub fn write_obs<R: Send>(
        &mut self,
        py: Python<'_>,
        keep: bool,
        f: impl FnOnce(ObsMut<'_>) -> R + Send,
    ) -> PyResult<R> {
        match &mut self.observations {
            Observations::Single(pair) => pair.write(py, keep, |obs| f(ObsMut::Single(obs))),
            Observations::Double(pair) => pair.write(py, keep, |obs| f(ObsMut::Double(obs))),
        }
    }
}

impl<O: Element> Pair<O> {
    fn new(py: Python<'_>, shape: [usize; 2]) -> Self {
        let zeros = || PyArray2::zeros(py, shape, false).unbind();
        Pair { next: zeros(), last: zeros() }
    }

    fn write<R: Send>(&mut self, py: Python<'_>, keep: bool, f: impl FnOnce(&mut [O]) -> R + Send) -> PyResult<R> {
        if keep {
            self.next = self.next.bind(py).call_method0("copy")?.cast_into()?.unbind();
        }
        let mut obs = writer(py, "obs", &self.next)?;
        let obs = obs.as_slice_mut()?;
        Ok(py.detach(|| f(obs)))
    }
}

fn list<T: Element>(py: Python<'_>, n: usize) -> Py<PyArray1<T>> {
    PyArray1::zeros(py, n, false).unbind()
}

/// Exchanges an array for a spare one, or for a new one if that is still used.
fn turn<T: Element, D: Dimension>(py: Python<'_>, array: &mut Py<PyArray<T, D>>, spare: &mut Py<PyArray<T, D>>) {
    std::mem::swap(array, spare);
    let bound = array.bind(py);
    // SAFETY: it points to a living object, and the GIL is held
    let owners = unsafe { pyo3::ffi::Py_REFCNT(array.as_ptr()) };
    if owners > 1 || bound.try_readwrite().is_err() {
        let fresh = PyArray::zeros(py, bound.dims(), false).unbind();
        *array = fresh;
    }
}

/// Exclusive access to an array. It fails if the array is being written to by another thread, or was made read-only.
fn writer<'py, T: Element, D: Dimension>(
    py: Python<'py>,
    name: &str,
    array: &Py<PyArray<T, D>>,
) -> PyResult<PyReadwriteArray<'py, T, D>> {
    array.bind(py).try_readwrite().map_err(|e| error::array(name, e))
}

/// The numbers of an array, row by row, without a copy if they lie so.
pub fn rows<'a, T: Element + Copy>(array: &'a PyReadonlyArray2<'_, T>) -> Cow<'a, [T]> {
    match array.as_slice() {
        // a slice may lie column by column too
        Ok(slice) if array.is_c_contiguous() => slice.into(),
        _ => array.as_array().iter().copied().collect(),
    }
}

/// Reads `value` as an array of this shape; the error starts with `name`, which includes its verb.
pub fn of_shape<'py, T, D, const N: usize>(
    name: &str,
    value: &Bound<'py, PyAny>,
    expected: [usize; N],
) -> PyResult<PyArrayLike<'py, T, D, AllowTypeChange>>
where
    T: Element + 'py,
    D: Dimension + 'py,
    Vec<T>: for<'a> FromPyObject<'a, 'py>,
{
    if let Ok(array) = value.cast::<PyUntypedArray>() {
        check_numbers(name, &array.dtype())?;
    }
    match value.extract::<PyArrayLike<'py, T, D, AllowTypeChange>>() {
        Ok(array) if array.shape() == expected => Ok(array),
        other => {
            // lists of different lengths have no shape, and an error of NumPy's own
            let array = value.py().import("numpy")?.call_method1("asarray", (value,))?;
            let array = array.cast::<PyUntypedArray>()?;
            let found = array.shape();
            if found.is_empty() && !b"biuf".contains(&array.dtype().kind()) {
                let found = value.get_type().name()?;
                return Err(PyTypeError::new_err(format!("{name} the type {found}, expected an array of numbers")));
            }
            check_numbers(name, &array.dtype())?;
            if found == expected {
                return other;
            }
            Err(error::value(format!("{name} the shape {}, expected {}", tuple(found), tuple(&expected))))
        }
    }
}

/// Refuses arrays of other things than real numbers; NumPy would drop the imaginary parts of complex ones.
pub fn check_numbers(name: &str, dtype: &Bound<'_, PyArrayDescr>) -> PyResult<()> {
    match dtype.kind() {
        b'b' | b'i' | b'u' | b'f' => Ok(()),
        _ => Err(PyTypeError::new_err(format!("{name} the type {dtype}, expected real numbers"))),
    }
}

/// A shape as Python writes it.
pub fn tuple(shape: &[usize]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => format!("({})", shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// A mask of `n` agents as a list; all agents without one.
pub fn mask(mask: Option<&Bound<'_, PyAny>>, n: usize) -> PyResult<Vec<bool>> {
    let Some(mask) = mask else { return Ok(vec![true; n]) };
    Ok(flags("mask", mask, n)?.as_array().to_vec())
}

/// A mask of `n` agents: a boolean array, or a list of True and False. Numbers are none: indices would pass for flags.
pub fn flags<'py>(name: &str, mask: &Bound<'py, PyAny>, n: usize) -> PyResult<PyReadonlyArray1<'py, bool>> {
    let array = mask.py().import("numpy")?.call_method1("asarray", (mask,)).ok();
    let found = match array.as_ref().map(|array| array.cast::<PyUntypedArray>()) {
        Some(Ok(array)) if !array.shape().is_empty() => {
            if let Ok(flags) = array.cast::<PyArray1<bool>>()
                && flags.len() == n
            {
                return flags.try_readonly().map_err(|e| error::value(format!("{name} cannot be read: {e}")));
            }
            format!("{} {}", array.dtype(), tuple(array.shape()))
        }
        _ => mask.get_type().name()?.to_string(),
    };
    Err(error::value(format!("{name} is {found}, expected a boolean array of shape ({n},)")))
}

/// A mask as an array, for the environments that are written in Python.
#[pyfunction]
#[pyo3(signature = (mask, num_envs, name = "mask"))]
pub fn _mask<'py>(mask: &Bound<'py, PyAny>, num_envs: usize, name: &str) -> PyResult<Bound<'py, PyArray1<bool>>> {
    Ok((*flags(name, mask, num_envs)?).clone())
}
