//! Any bytes are a mesh file or an error that names it: the reader, the hull and the mass of a mesh never panic.

#![no_main]

use libfuzzer_sys::fuzz_target;
use marathon_physics::Model;

/// Formats by the first byte.
const ENDINGS: [&str; 3] = ["stl", "obj", "msh"];
/// Rules of inertia by the second byte, with a limit of vertices that one of them has.
const RULES: [&str; 4] = ["legacy", "exact' maxhullvert='5", "convex", "shell"];

fuzz_target!(|data: &[u8]| {
    let [format, rule, bytes @ ..] = data else { return };
    let file = format!("fuzzed.{}", ENDINGS[usize::from(*format) % ENDINGS.len()]);
    let rule = RULES[usize::from(*rule) % RULES.len()];
    let text = format!(
        "<mujoco><asset><mesh name='m' file='{file}' inertia='{rule}'/></asset><worldbody><body><joint/>\
         <geom type='mesh' mesh='m'/><geom type='capsule' mesh='m'/></body></worldbody></mujoco>"
    );
    match Model::from_xml_str_with(&text, "model.xml", &|_| Ok(bytes.to_vec())) {
        Ok(model) => {
            let hull = &model.hulls[0];
            let outline = |p: &Vec<u32>| p.len() > 2 && p.iter().all(|v| (*v as usize) < hull.vertices.len());
            assert!(hull.polygons.iter().all(outline), "polygons have corners of the hull");
            assert!(model.bodies[1].mass.is_finite(), "a compiled model is finite");
        }
        Err(error) => assert!(!error.to_string().is_empty() && error.file == "model.xml", "an error says where"),
    }
});
