//! Whole numbers as arguments: those that cannot be are refused with their names.

use crate::error;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyInt;

/// A number that an argument can be.
pub trait Whole: Sized {
    fn read(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Self>;
}

impl Whole for u64 {
    fn read(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        match value.extract() {
            Ok(number) => Ok(number),
            Err(_) if value.is_instance_of::<PyInt>() || value.hasattr("__index__")? => {
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

/// A function per argument, for `from_py_with`.
macro_rules! arguments {
    ($($name:ident),*) => {
        $(pub fn $name<N: Whole>(value: &Bound<'_, PyAny>) -> PyResult<N> {
            N::read(stringify!($name), value)
        })*
    };
}

arguments!(body, field, seed, max_episode_steps, steps, substeps);

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

/// Converters for numbers of things, with their limit.
macro_rules! counts {
    ($($name:ident),*) => {
        $(pub fn $name<N: Whole + Count>(value: &Bound<'_, PyAny>) -> PyResult<N> {
            N::read(stringify!($name), value)?.check(stringify!($name))
        })*
    };
}

counts!(num_envs, threads, episodes, width, height);

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
    let Ok(each) = value.try_iter() else {
        let found = value.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "seed is of type {found}, expected a whole number, a sequence with one or None for each agent, or None"
        )));
    };
    let each = each.map(|one| seed(&one?)).collect::<PyResult<_>>()?;
    Ok(Some(Seeds::Each(each)))
}
