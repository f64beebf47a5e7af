//! A model by itself, without a task.

use crate::abi::respond;
use crate::answer::{Answer, Failure, Request, numbers};
use crate::objects::{Kind, ask, keep, with};
use marathon_physics::{Batch, BatchOptions, Model};
use marathon_viewer::Poses;
use serde::Deserialize;
use std::cell::RefCell;
use std::ptr::null;

/// One model that is simulated.
pub struct Simulation {
    batch: Batch,
    ctrl: Vec<f64>,
    poses: Poses,
}

impl Kind for Simulation {
    const NAME: &'static str = "simulation";
}

impl Simulation {
    fn new(mut request: Request) -> Result<Self, Failure> {
        #[derive(Deserialize)]
        struct Fields {
            xml: String,
            #[serde(default)]
            name: Option<String>,
        }
        let Fields { xml, name } = request.fields()?;
        let missing = RefCell::new(Vec::new());
        let resolve = |path: &str| {
            let known = request.files().get(path);
            known.cloned().ok_or_else(|| {
                let mut missing = missing.borrow_mut();
                if !missing.iter().any(|known| known == path) {
                    missing.push(path.to_string());
                }
                "this file was not given".into()
            })
        };
        let model = Model::from_xml_str_with(&xml, name.as_deref().unwrap_or("model.xml"), &resolve);
        let model = model.map_err(|error| Failure::from(error).missing(missing.take()))?;
        let batch = Batch::new(&model, &BatchOptions::default())?;
        let mut simulation = Simulation { ctrl: vec![0.0; model.nu], poses: Poses::new(&model, 1), batch };
        simulation.reset();
        Ok(simulation)
    }

    /// `qpos`, then `qvel`.
    fn state(&self) -> Vec<f64> {
        [self.batch.qpos(0), self.batch.qvel(0)].concat()
    }

    /// Back to the first keyframe; without keyframes, to the reference configuration.
    fn reset(&mut self) {
        let model = self.batch.model();
        let key = model.keyframes.first();
        let qpos = key.map_or_else(|| model.qpos0.clone(), |key| key.qpos.clone());
        let qvel = key.map_or_else(|| vec![0.0; model.nv], |key| key.qvel.clone());
        let ctrl = key.map_or_else(|| vec![0.0; model.nu], |key| key.ctrl.clone());
        self.batch.reset(0, &qpos, &qvel);
        self.ctrl.copy_from_slice(&ctrl);
    }
}

/// Creates a simulation of the MJCF text `xml`; the answer has the facts of the model.
#[unsafe(no_mangle)]
pub extern "C" fn simulation_new() -> i32 {
    respond(|request| {
        let simulation = Simulation::new(request)?;
        let answer = Answer::json(&marathon_viewer::facts(simulation.batch.model()))?;
        Ok(answer.about(keep(simulation)))
    })
}

/// Sets the simulation back to its start.
#[unsafe(no_mangle)]
pub extern "C" fn simulation_reset(simulation: usize) -> i32 {
    ask::<Simulation>(simulation, |simulation, _| {
        simulation.reset();
        Answer::done()
    })
}

/// Advances by physics steps. A state that is not finite is set back to the reference configuration; the answer says so.
#[unsafe(no_mangle)]
pub extern "C" fn simulation_step(simulation: usize, steps: usize) -> i32 {
    ask::<Simulation>(simulation, |simulation, _| {
        let broken = simulation.batch.step(&simulation.ctrl, steps);
        Ok(Answer::bytes(if broken.is_empty() { Vec::new() } else { b"diverged".to_vec() }))
    })
}

/// Place of an array: 0 controls in double precision, 6 poses of the geoms, 7 poses of the bodies, which this call computes.
#[unsafe(no_mangle)]
pub extern "C" fn simulation_array(simulation: usize, which: u32) -> *const u8 {
    let place = with::<Simulation, _>(simulation, |simulation| {
        if which == 0 {
            return Ok(simulation.ctrl.as_ptr().cast());
        }
        let qpos = simulation.batch.qpos(0);
        simulation.poses.set(simulation.batch.model(), 0, &qpos);
        Ok(match which {
            6 => simulation.poses.geoms().as_ptr().cast(),
            7 => simulation.poses.bodies().as_ptr().cast(),
            _ => null(),
        })
    });
    place.unwrap_or(null())
}

/// Pushes a body until changed: force, N, and torque, N m.
#[unsafe(no_mangle)]
pub extern "C" fn simulation_push(
    simulation: usize,
    body: usize,
    fx: f64,
    fy: f64,
    fz: f64,
    tx: f64,
    ty: f64,
    tz: f64,
) -> i32 {
    ask::<Simulation>(simulation, |simulation, _| {
        let bodies = simulation.batch.model().bodies.len();
        if body >= bodies {
            return Err(format!("there is no body {body}, only 0 to {}", bodies - 1).into());
        }
        let (force, torque) = ([fx, fy, fz], [tx, ty, tz]);
        if force.iter().chain(&torque).any(|x| !x.is_finite()) {
            return Err("a push is not finite".into());
        }
        simulation.batch.push(0, body, force, torque);
        Answer::done()
    })
}

/// The state: `qpos`, then `qvel`, in double precision.
#[unsafe(no_mangle)]
pub extern "C" fn simulation_state(simulation: usize) -> i32 {
    ask::<Simulation>(simulation, |simulation, _| Ok(Answer::numbers(&simulation.state())))
}

/// Sets the state: the file `state` has `qpos`, then `qvel`.
#[unsafe(no_mangle)]
pub extern "C" fn simulation_set_state(simulation: usize) -> i32 {
    ask::<Simulation>(simulation, |simulation, mut request| {
        let numbers = numbers(&request.take_file("state").unwrap_or_default());
        let (nq, nv) = (simulation.batch.model().nq, simulation.batch.model().nv);
        if numbers.len() != nq + nv || numbers.iter().any(|x| !x.is_finite()) {
            return Err(format!("the state has {} numbers, expected {nq} + {nv} finite ones", numbers.len()).into());
        }
        simulation.batch.reset(0, &numbers[..nq], &numbers[nq..]);
        Answer::done()
    })
}

/// Heights of a height field, m, in single precision, row by row.
#[unsafe(no_mangle)]
pub extern "C" fn simulation_ground(simulation: usize, field: usize) -> i32 {
    ask::<Simulation>(simulation, |simulation, _| {
        let fields = simulation.batch.model().hfields.len();
        if field >= fields {
            return Err(format!("there is no height field {field}, the model has {fields}").into());
        }
        Ok(Answer::singles(&simulation.batch.ground(0, field)))
    })
}

/// A mesh in the frame of its geoms: its points in single precision, m, then the numbers of three points of each triangle.
#[unsafe(no_mangle)]
pub extern "C" fn simulation_mesh(simulation: usize, mesh: usize) -> i32 {
    ask::<Simulation>(simulation, |simulation, _| {
        let meshes = &simulation.batch.model().meshes;
        let Some(mesh) = meshes.get(mesh) else {
            return Err(format!("there is no mesh {mesh}, the model has {}", meshes.len()).into());
        };
        let points = mesh.vertices.as_flattened().iter().flat_map(|x| x.to_le_bytes());
        let triangles = mesh.faces.as_flattened().iter().flat_map(|i| i.to_le_bytes());
        Ok(Answer::bytes(points.chain(triangles).collect()))
    })
}

/// Hash of the state, as text.
#[unsafe(no_mangle)]
pub extern "C" fn simulation_hash(simulation: usize) -> i32 {
    ask::<Simulation>(simulation, |simulation, _| Ok(Answer::hash(simulation.state())))
}
