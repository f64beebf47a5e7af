//! The NumPy arrays that a step writes to, and those that it reads.

use crate::error;
use marathon_envs::{Spec, StepMut};
use numpy::{
    AllowTypeChange, Element, PyArray, PyArray1, PyArray2, PyArrayLike1, PyArrayMethods, PyReadonlyArray2,
    PyReadwriteArray, PyUntypedArrayMethods, ndarray::Dimension,
};
use pyo3::prelude::*;
use std::borrow::Cow;

/// Results of a step, the fields of [`marathon_envs::Step`].
pub struct Arrays {
    pub obs: Py<PyArray2<f32>>,
    pub final_obs: Py<PyArray2<f32>>,
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

impl Arrays {
    /// For a number of agents.
    pub fn new(py: Python<'_>, agents: usize, spec: &Spec) -> Self {
        Arrays {
            obs: PyArray2::zeros(py, [agents, spec.obs], false).unbind(),
            final_obs: PyArray2::zeros(py, [agents, spec.obs], false).unbind(),
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

    /// Puts other arrays in the place of all but `final_obs`, so that those of the last step can be kept: those of the step
    /// before, where nobody has kept them, new ones elsewhere.
    pub fn renew(&mut self, py: Python<'_>, agents: usize, spec: &Spec) {
        let mut spare = self.spare.take().unwrap_or_else(|| Box::new(Arrays::new(py, agents, spec)));
        turn(py, &mut self.obs, &mut spare.obs);
        turn(py, &mut self.terms, &mut spare.terms);
        turn(py, &mut self.info, &mut spare.info);
        turn(py, &mut self.reward, &mut spare.reward);
        turn(py, &mut self.forward, &mut spare.forward);
        turn(py, &mut self.terminated, &mut spare.terminated);
        turn(py, &mut self.truncated, &mut spare.truncated);
        turn(py, &mut self.diverged, &mut spare.diverged);
        self.spare = Some(spare);
    }

    /// Lets `f` write to all arrays without the GIL.
    pub fn write<R: Send>(&self, py: Python<'_>, f: impl FnOnce(&mut StepMut<'_>) -> R + Send) -> PyResult<R> {
        let mut obs = writer(py, "obs", &self.obs)?;
        let mut final_obs = writer(py, "final_obs", &self.final_obs)?;
        let mut reward = writer(py, "reward", &self.reward)?;
        let mut terms = writer(py, "reward_terms", &self.terms)?;
        let mut info = writer(py, "info", &self.info)?;
        let mut forward = writer(py, "forward", &self.forward)?;
        let mut terminated = writer(py, "terminated", &self.terminated)?;
        let mut truncated = writer(py, "truncated", &self.truncated)?;
        let mut diverged = writer(py, "diverged", &self.diverged)?;
        let mut out = StepMut {
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
        Ok(py.detach(|| f(&mut out)))
    }

    /// Lets `f` write to the observations without the GIL.
    pub fn write_obs<R: Send>(&self, py: Python<'_>, f: impl FnOnce(&mut [f32]) -> R + Send) -> PyResult<R> {
        let mut obs = writer(py, "obs", &self.obs)?;
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

/// A mask of `n` agents as a list; all agents without one.
pub fn mask(mask: Option<PyArrayLike1<'_, bool, AllowTypeChange>>, n: usize) -> PyResult<Vec<bool>> {
    let Some(mask) = mask else { return Ok(vec![true; n]) };
    if mask.len() != n {
        return Err(error::value(format!("mask has {} values, expected {n}", mask.len())));
    }
    Ok(mask.as_array().to_vec())
}
