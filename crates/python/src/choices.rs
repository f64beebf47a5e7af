//! Arguments that are one of a few names.

use crate::error;
use marathon_envs::Autoreset;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

/// Names of the autoreset modes; those of Gymnasium's `AutoresetMode` work too.
const AUTORESET: [(&str, Autoreset); 3] =
    [("next_step", Autoreset::NextStep), ("same_step", Autoreset::SameStep), ("disabled", Autoreset::Disabled)];

/// The mode with a name.
pub fn autoreset(name: &str) -> PyResult<Autoreset> {
    let squeezed = |name: &str| name.replace('_', "").to_lowercase();
    let found = AUTORESET.iter().find(|(known, _)| squeezed(known) == squeezed(name));
    found.map(|(_, mode)| *mode).ok_or_else(|| {
        error::value(format!("autoreset is '{name}', expected one of 'next_step', 'same_step', 'disabled'"))
    })
}

/// Name of a mode.
pub fn autoreset_name(mode: Autoreset) -> &'static str {
    AUTORESET.iter().find(|(_, known)| *known == mode).map_or("", |(name, _)| name)
}

/// Whether a type of numbers is float64 rather than float32. It is given by its name or as NumPy has it.
pub fn is_double(dtype: &Bound<'_, PyAny>) -> PyResult<bool> {
    let name: String = match dtype.extract() {
        Ok(name) => name,
        Err(_) => match dtype.py().import("numpy")?.call_method1("dtype", (dtype,)) {
            Ok(dtype) => dtype.getattr("name")?.extract()?,
            Err(_) => {
                let found = dtype.get_type().name()?;
                return Err(PyTypeError::new_err(format!("dtype is of type {found}, expected 'float32' or 'float64'")));
            }
        },
    };
    match &name[..] {
        "float32" => Ok(false),
        "float64" => Ok(true),
        _ => Err(error::value(format!("dtype is '{name}', expected 'float32' or 'float64'"))),
    }
}

/// Name of a type of numbers.
pub fn dtype_name(double: bool) -> &'static str {
    if double { "float64" } else { "float32" }
}
