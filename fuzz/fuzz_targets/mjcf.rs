//! Any bytes are a model or an error: the reader never panics, and neither does the simulator on what the reader lets
//! through.

#![no_main]

use libfuzzer_sys::fuzz_target;
use marathon_physics::{Group, Model, Readings, Sim, SimOptions, Work};

/// Larger models are read but not simulated: a fuzzer finds more in many small ones.
const MOST_DOFS: usize = 40;
const MOST_GEOMS: usize = 60;

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    let model = match Model::from_xml_str_with(&text, "fuzzed.xml", &other_file) {
        Ok(model) => model,
        Err(e) => {
            assert!(!e.to_string().is_empty() && !e.file.is_empty(), "an error says where");
            return;
        }
    };
    assert!(model.qpos0.iter().all(|x| x.is_finite()), "a compiled model is finite");
    if model.nv > MOST_DOFS || model.geoms.len() > MOST_GEOMS {
        return;
    }
    let Ok(sim) = Sim::<f32>::new(&model, SimOptions::default()) else { return };
    let mut group = Group::new(&sim);
    let mut work = Work::new(&sim);
    // strange but valid numbers (a mass of 1e-300, a gravity of 1e300) may leave a state that is not finite, no more
    sim.step(&mut work, &mut group, 2);
    let readings = Readings::new(&sim, &group, &work);
    for sensor in 0..model.sensors.len() {
        let _ = readings.sensor(sensor);
    }
});

/// A model with parts and with what refers to them.
const ARM: &[u8] = b"<mujoco model='arm'><compiler angle='radian'/><default><geom size='.1'/></default><worldbody>
<body name='a' euler='1 0 0'><joint name='j' range='0 1'/><geom name='g'/><frame name='f'><site name='s'/></frame></body></worldbody>
<tendon><fixed name='t'><joint joint='j' coef='1'/></fixed></tendon><actuator><motor joint='j'/></actuator>
<sensor><clock/><accelerometer site='s'/></sensor><keyframe><key name='k' qpos='1'/></keyframe></mujoco>";
/// A model that attaches itself.
const RING: &[u8] = b"<mujoco model='ring'><asset><model name='r' file='ring.xml'/></asset>
<worldbody><attach model='r' prefix='r'/></worldbody></mujoco>";

/// Files that a model may include, attach or read heights from.
fn other_file(name: &str) -> Result<Vec<u8>, String> {
    match name {
        "part.xml" => Ok(b"<mujoco><body><geom size='.1'/></body></mujoco>".to_vec()),
        "self.xml" => Ok(b"<mujoco><include file='self.xml'/></mujoco>".to_vec()),
        "arm.xml" => Ok(ARM.to_vec()),
        "ring.xml" => Ok(RING.to_vec()),
        "grid.bin" => Ok([2i32.to_le_bytes(), 2i32.to_le_bytes()].concat().into_iter().chain([0; 16]).collect()),
        _ => Err("there is no such file".to_owned()),
    }
}
