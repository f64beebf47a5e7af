//! Whole numbers as arguments: those that cannot be are refused with their names. Numbers of things may be floats without
//! a fraction, such as `4e6`; seeds and indices may not.

use crate::error;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyInt, PyString};

/// A number that an argument can be.
pub trait Whole: Sized {
    fn read(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Self>;
}

impl Whole for u64 {
    fn read(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        match value.extract() {
            Ok(number) => Ok(number),
            Err(_) if is_whole(value)? => {
                Err(error::value(format!("{name} is {}, expected a whole number from 0 to 2**64 - 1", value.str()?)))
            }
            Err(_) => {
                let found = value.get_type().name()?;
                Err(PyTypeError::new_err(format!("{name} is of type {found}, expected a whole number")))
            }
        }
    }
}

impl Whole for usize {
    fn read(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let number = u64::read(name, value)?;
        number.try_into().map_err(|_| error::value(format!("{name} is {number}, which is too large")))
    }
}

impl<N: Whole> Whole for Option<N> {
    fn read(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() { Ok(None) } else { N::read(name, value).map(Some) }
    }
}

/// Whether Python takes the value for a whole number.
fn is_whole(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(value.is_instance_of::<PyInt>() || value.hasattr("__index__")?)
}

/// A number of things: the value itself, or the whole number that a float is.
fn amount<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    if is_whole(value)? || !value.hasattr("is_integer")? {
        return Ok(value.clone());
    }
    if value.call_method0("is_integer")?.is_truthy()? {
        return value.call_method0("__int__");
    }
    Err(error::value(format!("{name} is {}, expected a whole number", value.str()?)))
}

/// Converters for seeds and indices, for `from_py_with`.
macro_rules! arguments {
    ($($name:ident),*) => {
        $(pub fn $name<N: Whole>(value: &Bound<'_, PyAny>) -> PyResult<N> {
            N::read(stringify!($name), value)
        })*
    };
}

arguments!(agent, body, field, seed);

/// Converters for numbers of steps.
macro_rules! amounts {
    ($($name:ident),*) => {
        $(pub fn $name<N: Whole>(value: &Bound<'_, PyAny>) -> PyResult<N> {
            N::read(stringify!($name), &amount(stringify!($name), value)?)
        })*
    };
}

amounts!(max_episode_steps, steps, substeps);

/// A number of things, each of which takes memory or time.
pub trait Count: Sized {
    fn check(self, name: &str) -> PyResult<Self>;
}

/// Upper limit. The constructors check the memory.
const MOST: usize = u32::MAX as usize;

impl Count for usize {
    fn check(self, name: &str) -> PyResult<Self> {
        if self <= MOST { Ok(self) } else { Err(error::value(format!("{name} is {self}, expected at most {MOST}"))) }
    }
}

impl<N: Count> Count for Option<N> {
    fn check(self, name: &str) -> PyResult<Self> {
        self.map(|number| number.check(name)).transpose()
    }
}

/// A number of things within the limit.
pub fn count<N: Whole + Count>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<N> {
    N::read(name, &amount(name, value)?)?.check(name)
}

/// Converters for numbers of things, with their limit.
macro_rules! counts {
    ($($name:ident),*) => {
        $(pub fn $name<N: Whole + Count>(value: &Bound<'_, PyAny>) -> PyResult<N> {
            count(stringify!($name), value)
        })*
    };
}

counts!(num_envs, threads, episodes, width, height);

/// A port of this computer.
pub fn port(value: &Bound<'_, PyAny>) -> PyResult<u16> {
    match value.extract() {
        Ok(port) => Ok(port),
        Err(_) if is_whole(value)? => {
            Err(error::value(format!("port is {}, expected a whole number from 0 to 65535", value.str()?)))
        }
        Err(_) => {
            let found = value.get_type().name()?;
            Err(PyTypeError::new_err(format!("port is of type {found}, expected a whole number")))
        }
    }
}

/// Seeds of a reset.
pub enum Seeds {
    One(u64),
    Each(Vec<Option<u64>>),
}

/// One seed for all, or one or none for each.
pub fn seeds(value: &Bound<'_, PyAny>) -> PyResult<Option<Seeds>> {
    if value.is_none() {
        return Ok(None);
    }
    if value.is_instance_of::<PyInt>() || value.hasattr("__index__")? && !value.hasattr("__len__")? {
        return Ok(Some(Seeds::One(seed(value)?)));
    }
    let is_text = value.is_instance_of::<PyString>() || value.is_instance_of::<PyBytes>();
    let Some(each) = value.try_iter().ok().filter(|_| !is_text) else {
        let found = value.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "seed is of type {found}, expected a whole number, a sequence with one or None for each agent, or None"
        )));
    };
    let each = each.map(|one| seed(&one?)).collect::<PyResult<_>>()?;
    Ok(Some(Seeds::Each(each)))
}

/// The seeds of a reset, checked, for the environments that are written in Python.
#[pyfunction]
pub fn _seeds<'py>(seed: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = seed.py();
    match seeds(seed)? {
        None => Ok(py.None().into_bound(py)),
        Some(Seeds::One(seed)) => Ok(seed.into_pyobject(py)?.into_any()),
        Some(Seeds::Each(each)) => Ok(each.into_pyobject(py)?.into_any()),
    }
}

/// A number of things, checked, for what is written in Python.
#[pyfunction]
#[pyo3(signature = (name, value, *, limited = true))]
pub fn _count(name: &str, value: &Bound<'_, PyAny>, limited: bool) -> PyResult<usize> {
    if limited { count(name, value) } else { usize::read(name, &amount(name, value)?) }
}
