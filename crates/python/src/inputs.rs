//! Inputs of many agents besides their actions: pushes, constants and ground as arrays with one row per agent.
//!
//! All rows are checked before an agent gets its own, so a wrong one changes nothing.

use crate::arrays::{check_numbers, mask, of_shape, rows, tuple};
use crate::error;
use crate::model::Model;
use marathon_physics::Variation;
use numpy::ndarray::{Ix1, Ix2};
use numpy::{
    AllowTypeChange, PyArray1, PyArray3, PyArrayLikeDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

/// An argument that may be missing.
pub type Given<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// Forces on one body of each selected agent.
pub struct Pushes {
    pub body: usize,
    /// Agent, force, N, and torque, N m.
    pub each: Vec<(usize, [f64; 3], [f64; 3])>,
}

/// Largest coordinate of a mocap body, m: that of a valid state.
const FARTHEST: f64 = 1e10;

/// Poses of one mocap body of each selected agent.
pub struct MocapPoses {
    /// Its number among the mocap bodies.
    pub mocap: usize,
    /// Agent, position, m, and orientation.
    pub each: Vec<(usize, [f64; 3], [f64; 4])>,
}

/// Reads the arguments of `set_mocap` for the agents whose mocap bodies have the poses `present`, `[agent][mocap]`.
pub fn mocap_poses(
    model: &Model,
    (n, present): (usize, (&[f64], &[f64])),
    pos: Given<'_, '_>,
    quat: Given<'_, '_>,
    body: &Bound<'_, PyAny>,
    mask: Given<'_, '_>,
) -> PyResult<MocapPoses> {
    let (body, chosen) = (model.body_index(body)?, self::mask(mask, n)?);
    let bodies: Vec<usize> = model.inner.mocap_bodies().collect();
    let Some(mocap) = bodies.iter().position(|b| *b == body) else {
        let name = |b: &usize| match model.inner.bodies[*b].name.as_str() {
            "" => b.to_string(),
            name => format!("'{name}'"),
        };
        let valid = match bodies.len() {
            0 => "the model has none".to_owned(),
            _ => format!("those of the model are {}", bodies.iter().map(name).collect::<Vec<_>>().join(", ")),
        };
        return Err(error::value(format!("body {} is no mocap body; {valid}", name(&body))));
    };
    let (of_pos, of_quat) = present;
    let row = |agent: usize| agent * bodies.len() + mocap;
    let mut each: Vec<(usize, [f64; 3], [f64; 4])> = Vec::new();
    for agent in (0..n).filter(|agent| chosen[*agent]) {
        let [p, q] = [3 * row(agent), 4 * row(agent)];
        each.push((agent, [of_pos[p], of_pos[p + 1], of_pos[p + 2]], [0, 1, 2, 3].map(|i| of_quat[q + i])));
    }
    let near = |agent: usize, pos: &[f64]| match pos.iter().find(|x| x.abs() > FARTHEST) {
        Some(x) => Err(error::value(format!("agent {agent}: pos is {x}, expected at most {FARTHEST:e} m"))),
        None => Ok(()),
    };
    if let Some(pos) = pos {
        let pos = of_shape::<f64, Ix2, 2>("pos has", pos, [n, 3])?;
        for (agent, own, _) in &mut each {
            *own = [0, 1, 2].map(|i| pos.as_array()[[*agent, i]]);
            finite(*agent, "pos", own)?;
            near(*agent, own)?;
        }
    }
    if let Some(quat) = quat {
        let quat = of_shape::<f64, Ix2, 2>("quat has", quat, [n, 4])?;
        for (agent, _, own) in &mut each {
            *own = [0, 1, 2, 3].map(|i| quat.as_array()[[*agent, i]]);
            finite(*agent, "quat", own)?;
            if own.iter().all(|x| x.abs() < 1e-10) {
                return Err(error::value(format!("agent {agent}: quat is zero, expected a rotation, w x y z")));
            }
        }
    }
    Ok(MocapPoses { mocap, each })
}

/// Refuses numbers of an agent that are not finite.
fn finite(agent: usize, name: &str, numbers: &[f64]) -> PyResult<()> {
    match numbers.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(error::value(format!("agent {agent}: {name} is {x}, expected finite numbers"))),
        None => Ok(()),
    }
}

/// Reads the arguments of `push` for `n` agents.
pub fn pushes(
    model: &Model,
    n: usize,
    force: &Bound<'_, PyAny>,
    torque: Given<'_, '_>,
    body: &Bound<'_, PyAny>,
    mask: Given<'_, '_>,
) -> PyResult<Pushes> {
    let (body, chosen) = (model.body_index(body)?, self::mask(mask, n)?);
    let vectors = |name: &str, given: &Bound<'_, PyAny>| -> PyResult<Vec<[f64; 3]>> {
        let given = of_shape::<f64, Ix2, 2>(&format!("{name} has"), given, [n, 3])?;
        let vectors: Vec<[f64; 3]> = given.as_array().rows().into_iter().map(|v| [v[0], v[1], v[2]]).collect();
        for (agent, vector) in vectors.iter().enumerate().filter(|(agent, _)| chosen[*agent]) {
            finite(agent, name, vector)?;
        }
        Ok(vectors)
    };
    let force = vectors("force", force)?;
    let torque = torque.map_or_else(|| Ok(vec![[0.0; 3]; n]), |torque| vectors("torque", torque))?;
    let each = (0..n).filter(|i| chosen[*i]).map(|i| (i, force[i], torque[i])).collect();
    Ok(Pushes { body, each })
}

/// The arguments of `vary`.
pub struct Constants<'a, 'py> {
    pub mass: Given<'a, 'py>,
    pub friction: Given<'a, 'py>,
    pub strength: Given<'a, 'py>,
    pub gravity: Given<'a, 'py>,
    pub mask: Given<'a, 'py>,
}

impl Constants<'_, '_> {
    /// The constants of each selected agent of `n`. Omitted ones are those of `none`.
    pub fn read(&self, none: &Variation, n: usize) -> PyResult<Vec<(usize, Variation)>> {
        let chosen = self::mask(self.mask, n)?;
        let table = |name: &str, given: Given<'_, '_>, columns: usize| -> PyResult<Option<Vec<f64>>> {
            let Some(given) = given else { return Ok(None) };
            let given = of_shape::<f64, Ix2, 2>(&format!("{name} has"), given, [n, columns])?;
            Ok(Some(rows(&given).into_owned()))
        };
        let mass = table("mass", self.mass, none.mass.len())?;
        let strength = table("strength", self.strength, none.strength.len())?;
        let gravity = table("gravity", self.gravity, 3)?;
        let friction = match self.friction {
            Some(given) => Some(of_shape::<f64, Ix1, 1>("friction has", given, [n])?.as_array().to_vec()),
            None => None,
        };
        let mut each = Vec::new();
        for agent in (0..n).filter(|i| chosen[*i]) {
            let mut own = none.clone();
            let parts = [(&mass, &mut own.mass[..]), (&strength, &mut own.strength), (&gravity, &mut own.gravity)];
            for (given, to) in parts {
                if let Some(given) = given {
                    to.copy_from_slice(&given[agent * to.len()..][..to.len()]);
                }
            }
            if let Some(friction) = &friction {
                own.friction = friction[agent];
            }
            if let Some((name, found, expected)) = own.out_of_range() {
                return Err(error::value(format!("agent {agent}: {name} is {found}, expected {expected}")));
            }
            each.push((agent, own));
        }
        Ok(each)
    }
}

/// Ground of each selected agent.
pub struct Grounds {
    elevations: Vec<f32>,
    /// Points of the grid.
    points: usize,
    chosen: Vec<bool>,
}

impl Grounds {
    /// Reads the arguments of `set_ground` for `n` agents: one grid for each agent, or one for all.
    pub fn read(grid: [usize; 2], n: usize, elevations: &Bound<'_, PyAny>, mask: Given<'_, '_>) -> PyResult<Self> {
        let [rows, columns] = grid;
        if let Ok(array) = elevations.cast::<PyUntypedArray>() {
            check_numbers("elevations have", &array.dtype())?;
        }
        let (chosen, points) = (self::mask(mask, n)?, rows * columns);
        let shape: Vec<usize> = elevations.py().import("numpy")?.call_method1("shape", (elevations,))?.extract()?;
        if shape != [n, rows, columns] && shape != grid {
            let found = tuple(&shape);
            let expected = format!("{} or {}", tuple(&[n, rows, columns]), tuple(&grid));
            return Err(error::value(format!("elevations have the shape {found}, expected {expected}")));
        }
        let array: PyArrayLikeDyn<'_, f32, AllowTypeChange> = elevations.extract()?;
        let grounds = Grounds { elevations: array.as_array().iter().copied().collect(), points, chosen };
        for (_, ground) in grounds.each() {
            if let Some(x) = ground.iter().find(|x| !x.is_finite()) {
                return Err(error::value(format!("elevations have a number that is {x}, expected finite ones")));
            }
        }
        Ok(grounds)
    }

    /// The selected agents with their elevations, row by row.
    pub fn each(&self) -> impl Iterator<Item = (usize, &[f32])> {
        let own = self.elevations.len() > self.points;
        let of = move |agent: usize| &self.elevations[if own { agent * self.points } else { 0 }..][..self.points];
        (0..self.chosen.len()).filter(|i| self.chosen[*i]).map(move |i| (i, of(i)))
    }
}

/// The elevations of `n` agents, `(n, nrow, ncol)`, as an array.
pub fn grounds_array<'py>(
    py: Python<'py>,
    n: usize,
    [rows, columns]: [usize; 2],
    elevations: Vec<f32>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    PyArray1::from_vec(py, elevations).reshape([n, rows, columns])
}
