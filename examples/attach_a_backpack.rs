//! Edit a model before it is compiled: a humanoid with a backpack.
//!
//! A [`ModelSpec`] is a parsed MJCF file, the counterpart of MuJoCo's `mjSpec`. Parts are added, changed, replaced and
//! removed by name, then [`ModelSpec::compile`] makes the [`Model`]. Keyframes keep their meaning: the start pose of the humanoid
//! gets a number for the strap of the backpack. [`ModelSpec::to_xml`] writes the edited model as MJCF. An agent takes it as
//! `marathon_rl::envs::ModelSource::from(spec)`.
//!
//! The example lets the humanoid fall with and without ten kilograms on its back. Its motors are off, so the weight decides
//! which way it falls.
//!
//! ```sh
//! cargo run --release -p marathon-examples --bin attach_a_backpack
//! ```

use marathon_rl::physics::spec::{Actuator, Body, Geom, Joint, Kind, ModelSpec, Sensor, Site};
use marathon_rl::physics::{Batch, BatchOptions, Model};
use std::error::Error;
use std::path::Path;

/// Physics steps: one second.
const STEPS: usize = 200;

fn main() -> Result<(), Box<dyn Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/agents/humanoid.xml");
    let mut spec = ModelSpec::from_xml_file(file)?;
    let bare = spec.compile()?;

    // ten kilograms behind the torso, on a strap that gives way
    spec.add_to("torso", Body::new("backpack").pos([-0.2, 0.0, 0.0]))?;
    spec.add_to(
        "backpack",
        Joint::hinge([0.0, 1.0, 0.0]).name("strap").pos([0.1, 0.0, 0.1]).stiffness(500.0).damping(20.0),
    )?;
    spec.add_to("backpack", Geom::cuboid([0.09, 0.14, 0.2]).name("backpack").mass(10.0).rgba([0.2, 0.5, 0.3, 1.0]))?;
    // what it carries is measured, and a motor can shake it
    spec.add_to("backpack", Site::new("backpack"))?;
    spec.add(Sensor::new("accelerometer", "backpack").set("site", "backpack"))?;
    spec.add(Actuator::motor("strap").joint("strap").gear(5.0))?;
    // a slippery floor
    spec.get_mut(Kind::Geom, "floor")?.set("friction", [0.4, 0.005, 0.0001])?;
    let loaded = spec.compile()?;
    println!("without a backpack: {}", summary(&bare));
    println!("with a backpack: {}", summary(&loaded));
    println!("a wrong name: {}", spec.get(Kind::Body, "tors").err().ok_or("there is a body 'tors'")?);

    println!("after one second without: torso at {:.2?} m", fall(&bare)?);
    println!("after one second with: torso at {:.2?} m", fall(&loaded)?);

    // motors and sensors go with what they refer to
    let gone = spec.remove(Kind::Body, "backpack")?;
    println!("removed again, with {}", gone.join(" "));
    println!("without a backpack: {}", summary(&spec.compile()?));
    Ok(())
}

fn summary(model: &Model) -> String {
    let keyframe = model.keyframes.first().map_or(0, |key| key.qpos.len());
    let mass = model.bodies[0].subtree_mass;
    format!("{mass:.1} kg, nq {}, nu {}, {keyframe} numbers in the start pose", model.nq, model.nu)
}

/// Where the torso is after a second without motors, m.
fn fall(model: &Model) -> Result<[f64; 3], Box<dyn Error>> {
    let mut batch = Batch::new(model, &BatchOptions { agents: 1, ..Default::default() })?;
    let spawn = model.keyframes.iter().find(|key| key.name == "spawn").ok_or("the model has no keyframe 'spawn'")?;
    batch.reset(0, &spawn.qpos, &spawn.qvel);
    batch.step(&vec![0.0; model.nu], STEPS);
    let torso = model.bodies.iter().position(|body| body.name == "torso").ok_or("the model has no torso")?;
    Ok(batch.bodies(0)[torso].pos)
}
