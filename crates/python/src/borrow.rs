//! Objects that one thread at a time may use: their methods run without the GIL.

use pyo3::PyClass;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::False;

/// An object to change. It fails while another thread uses the object.
pub fn exclusive<'py, T: PyClass<Frozen = False>>(object: &Bound<'py, T>) -> PyResult<PyRefMut<'py, T>> {
    object.try_borrow_mut().map_err(|_| in_use(object))
}

/// An object to read. It fails while another thread changes the object.
pub fn shared<'py, T: PyClass>(object: &Bound<'py, T>) -> PyResult<PyRef<'py, T>> {
    object.try_borrow().map_err(|_| in_use(object))
}

/// `RuntimeError` for an object that is in use.
fn in_use<T: PyClass>(object: &Bound<'_, T>) -> PyErr {
    let name = object.as_any().get_type().name().map_or_else(|_| "object".into(), |name| name.to_string());
    PyRuntimeError::new_err(format!(
        "another thread is using this {name}, expected one thread at a time: use a threading.Lock or one {name} per thread"
    ))
}
