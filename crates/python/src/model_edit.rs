//! Edits of a model file before it is compiled, and its solver settings.

use crate::error;
use marathon_physics::hint::among;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::model::{Cone, Integrator, Options, Solver};
use marathon_physics::spec::{AttrValue, ElementMut, Kind, ModelSpec};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyString};

/// Kinds of elements, by the names that MJCF gives them.
const KINDS: [(&str, Kind); 15] = [
    ("body", Kind::Body),
    ("joint", Kind::Joint),
    ("geom", Kind::Geom),
    ("site", Kind::Site),
    ("camera", Kind::Camera),
    ("light", Kind::Light),
    ("hfield", Kind::HField),
    ("mesh", Kind::Mesh),
    ("tendon", Kind::Tendon),
    ("equality", Kind::Equality),
    ("pair", Kind::ContactPair),
    ("exclude", Kind::ContactExclude),
    ("actuator", Kind::Actuator),
    ("sensor", Kind::Sensor),
    ("key", Kind::Keyframe),
];
/// Sections without names.
const SECTIONS: [&str; 4] = ["compiler", "option", "statistic", "visual"];

/// Applies changes, `{kind: {name: {attribute: value}}}` or `{section: {attribute: value}}`, and removes elements, `{kind: [name]}`.
pub fn edited(
    spec: &ModelSpec,
    changes: Option<&Bound<'_, PyDict>>,
    remove: Option<&Bound<'_, PyDict>>,
) -> PyResult<ModelSpec> {
    let mut spec = spec.clone();
    for (of, what) in changes.into_iter().flat_map(|changes| changes.iter()) {
        let of = text(&of, "a kind of elements")?;
        let what = dict(&what, &format!("changes['{of}']"))?;
        if SECTIONS.contains(&of.as_str()) {
            set(&mut spec.section_mut(&of).map_err(invalid)?, &what, &of)?;
            continue;
        }
        let kind = kind(&of)?;
        for (name, attributes) in what.iter() {
            let name = text(&name, &format!("the name of a {of}"))?;
            let place = format!("{of} '{name}'");
            let attributes = dict(&attributes, &place)?;
            set(&mut spec.get_mut(kind, &name).map_err(invalid)?, &attributes, &place)?;
        }
    }
    let mut named = Vec::new();
    for (of, names) in remove.into_iter().flat_map(|remove| remove.iter()) {
        let of = text(&of, "a kind of elements")?;
        let kind = kind(&of)?;
        // a text is a sequence of its letters
        if names.is_instance_of::<PyString>() {
            return Err(error::value(format!("remove['{of}'] is a text, expected a list of names")));
        }
        for name in names.try_iter()? {
            let name = text(&name?, &format!("the name of a {of}"))?;
            spec.get(kind, &name).map_err(invalid)?;
            named.push((kind, name));
        }
    }
    for (kind, name) in named {
        // an element that was removed before may have taken this one along
        if spec.get(kind, &name).is_ok() {
            spec.remove(kind, &name).map_err(invalid)?;
        }
    }
    Ok(spec)
}

/// Sets attributes of an element. `None` takes an attribute away.
fn set(element: &mut ElementMut<'_>, attributes: &Bound<'_, PyDict>, place: &str) -> PyResult<()> {
    for (attribute, value) in attributes.iter() {
        let attribute = text(&attribute, &format!("an attribute of {place}"))?;
        let done = match value.is_none() {
            true => element.unset(&attribute),
            false => element.set(&attribute, attribute_value(&value, &attribute, place)?),
        };
        done.map_err(invalid)?;
    }
    Ok(())
}

/// A value of an attribute: a text, a flag, a number, or several numbers.
fn attribute_value(value: &Bound<'_, PyAny>, attribute: &str, place: &str) -> PyResult<AttrValue> {
    if value.is_instance_of::<PyString>() {
        return Ok(value.extract::<String>()?.into());
    }
    if value.is_instance_of::<PyBool>() {
        return Ok(value.extract::<bool>()?.into());
    }
    if let Ok(number) = value.extract::<f64>() {
        return Ok(number.into());
    }
    match value.extract::<Vec<f64>>() {
        Ok(numbers) => Ok(numbers.as_slice().into()),
        Err(_) => Err(error::value(format!(
            "attribute '{attribute}' of {place} is {}, expected a text, a bool, a number or a list of numbers",
            value.repr()?
        ))),
    }
}

fn kind(name: &str) -> PyResult<Kind> {
    let known: Vec<&str> = KINDS.iter().map(|(name, _)| *name).chain(SECTIONS).collect();
    let found = KINDS.iter().find(|(known, _)| *known == name).map(|(_, kind)| *kind);
    found.ok_or_else(|| error::value(format!("there is no kind of elements '{name}'{}", among(name, &known))))
}

fn text(value: &Bound<'_, PyAny>, what: &str) -> PyResult<String> {
    match value.extract() {
        Ok(text) => Ok(text),
        Err(_) => Err(error::value(format!("{what} is {}, expected a text", value.repr()?))),
    }
}

fn dict<'py>(value: &Bound<'py, PyAny>, what: &str) -> PyResult<Bound<'py, PyDict>> {
    match value.cast::<PyDict>() {
        Ok(dict) => Ok(dict.clone()),
        Err(_) => Err(error::value(format!("{what} is {}, expected a dict", value.repr()?))),
    }
}

fn invalid(e: MjcfError) -> PyErr {
    error::value(e.to_string())
}

/// The settings of the physics as in MJCF's `option`.
pub fn option<'py>(py: Python<'py>, opt: &Options) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("timestep", opt.timestep)?;
    out.set_item(
        "integrator",
        match opt.integrator {
            Integrator::Euler => "Euler",
            Integrator::Rk4 => "RK4",
            Integrator::Implicit => "implicit",
            Integrator::ImplicitFast => "implicitfast",
        },
    )?;
    out.set_item(
        "solver",
        match opt.solver {
            Solver::Pgs => "PGS",
            Solver::Cg => "CG",
            Solver::Newton => "Newton",
        },
    )?;
    out.set_item(
        "cone",
        match opt.cone {
            Cone::Pyramidal => "pyramidal",
            Cone::Elliptic => "elliptic",
        },
    )?;
    out.set_item("iterations", opt.iterations)?;
    out.set_item("tolerance", opt.tolerance)?;
    out.set_item("ls_iterations", opt.ls_iterations)?;
    out.set_item("ls_tolerance", opt.ls_tolerance)?;
    out.set_item("noslip_iterations", opt.noslip_iterations)?;
    out.set_item("noslip_tolerance", opt.noslip_tolerance)?;
    out.set_item("ccd_iterations", opt.ccd_iterations)?;
    out.set_item("ccd_tolerance", opt.ccd_tolerance)?;
    out.set_item("impratio", opt.impratio)?;
    out.set_item("gravity", opt.gravity)?;
    out.set_item("wind", opt.wind)?;
    out.set_item("magnetic", opt.magnetic)?;
    out.set_item("density", opt.density)?;
    out.set_item("viscosity", opt.viscosity)?;
    Ok(out)
}
