//! The configuration of a training run as an argument.

use crate::error;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use std::path::PathBuf;

/// Where the configuration comes from.
pub enum Config {
    /// A file.
    Path(PathBuf),
    /// A dictionary with the keys of the files.
    Table(Py<PyDict>),
}

/// Reads the argument.
pub fn read(value: &Bound<'_, PyAny>) -> PyResult<Option<Config>> {
    if value.is_none() {
        return Ok(None);
    }
    if let Ok(table) = value.cast::<PyDict>() {
        return Ok(Some(Config::Table(table.clone().unbind())));
    }
    value.extract().map(|path| Some(Config::Path(path))).map_err(|_| match value.get_type().name() {
        Ok(found) => PyTypeError::new_err(format!("config is of type {found}, expected a path or a dictionary")),
        Err(error) => error,
    })
}

/// A dictionary as JSON. Arrays and numbers of NumPy become lists and plain numbers.
pub fn json(table: &Bound<'_, PyDict>) -> PyResult<String> {
    let plain = Plain::default().of(table.as_any())?;
    table.py().import("json")?.call_method1("dumps", (plain,))?.extract()
}

/// Makes plain values of a dictionary's.
#[derive(Default)]
struct Plain {
    /// Keys of the present value.
    keys: Vec<String>,
    /// Addresses of the containers around it.
    around: Vec<usize>,
}

impl Plain {
    fn of<'py>(&mut self, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = value.py();
        let is_text = value.is_instance_of::<PyString>();
        let is_number = value.is_instance_of::<PyInt>() || value.is_instance_of::<PyFloat>();
        if value.is_none() || value.is_instance_of::<PyBool>() || is_number || is_text {
            return Ok(value.clone());
        }
        if let Ok(table) = value.cast::<PyDict>() {
            let plain = PyDict::new(py);
            self.enter(value)?;
            for (key, value) in table {
                let Ok(name) = key.extract::<String>() else {
                    let found = key.get_type().name()?;
                    return Err(self.wrong(&format!("a key of type {found}"), "a text"));
                };
                self.keys.push(name);
                plain.set_item(key, self.of(&value)?)?;
                self.keys.pop();
            }
            self.around.pop();
            return Ok(plain.into_any());
        }
        if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
            let plain = PyList::empty(py);
            self.enter(value)?;
            for value in value.try_iter()? {
                plain.append(self.of(&value?)?)?;
            }
            self.around.pop();
            return Ok(plain.into_any());
        }
        let listed = if value.hasattr("tolist")? { value.call_method0("tolist").ok() } else { None };
        match listed {
            Some(listed) if !listed.get_type().is(value.get_type()) => self.of(&listed),
            _ => {
                let found = value.get_type().name()?;
                let expected = "a number, a text, True, False, None, a list or a dictionary";
                Err(self.wrong(&format!("a value of type {found}"), expected))
            }
        }
    }

    /// Notes that the values of a container follow.
    fn enter(&mut self, container: &Bound<'_, PyAny>) -> PyResult<()> {
        let address = container.as_ptr() as usize;
        if self.around.contains(&address) {
            let found = "a container that contains itself";
            return Err(error::value(format!("config: {}: found {found}, expected values", self.keys.join("."))));
        }
        self.around.push(address);
        Ok(())
    }

    fn wrong(&self, found: &str, expected: &str) -> PyErr {
        let place: String = self.keys.iter().map(|key| format!("{key}.")).collect();
        let place = place.trim_end_matches('.');
        let place = if place.is_empty() { String::new() } else { format!("{place}: ") };
        PyTypeError::new_err(format!("config: {place}found {found}, expected {expected}"))
    }
}
