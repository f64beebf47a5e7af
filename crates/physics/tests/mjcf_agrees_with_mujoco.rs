//! A compiled model is MuJoCo's compiled model.
//!
//! The loader accepts every file, and every number of the model equals MuJoCo's to 1e-9 relative: frames, masses,
//! inertias, inverse weights, joints, geoms, sites, height fields, tendons, equality constraints, cameras, lights,
//! actuators, sensors, keyframes, contact pairs, options and statistics. The files are Marathon's agents, the models of
//! dm_control and Gymnasium, Marathon's own files of both, and one small model per feature of the format in
//! `models/mjcf`. Colors and elevations are single precision in MuJoCo and agree to 1e-6.

use crate::common;
use crate::common::compiled::differ;
use crate::common::{oracle, package, workspace};
use marathon_physics::Model;
use marathon_physics::mjcf::MjcfErrorKind;
use marathon_physics::spec::{Actuator, Body, Geom, HField, Joint, Kind, ModelSpec};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// XML files of a folder, in order. Empty if there is no such folder.
fn xml_files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries.map(|e| e.expect("a folder entry").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "xml"));
    files.sort();
    files
}

/// Compiles every file on both sides and collects the differences.
fn compare(files: &[PathBuf]) {
    assert!(!files.is_empty(), "no model files");
    let answers = oracle("compiled_model.py", &json!({ "files": files }));
    let mut report = Vec::new();
    for (file, theirs) in files.iter().zip(answers["files"].as_array().expect("one answer per file")) {
        if let Some(error) = theirs.get("error") {
            report.push(format!("{}: MuJoCo refuses it: {error}", file.display()));
            continue;
        }
        match Model::from_xml_file(file) {
            Err(error) => report.push(format!("refused: {error}")),
            Ok(model) => {
                let ours = serde_json::to_value(&model).expect("a model is JSON");
                let mut differences = Vec::new();
                differ("", &ours, theirs, &mut differences);
                report.extend(differences.iter().take(10).map(|d| format!("{}: {d}", file.display())));
            }
        }
    }
    assert!(report.is_empty(), "{}", report.join("\n"));
}

#[test]
fn every_feature_of_the_format() {
    compare(&xml_files(&workspace().join("crates/physics/tests/models/mjcf")));
}

#[test]
fn marathons_own_agents() {
    let files = xml_files(&workspace().join("assets/agents"));
    if !files.is_empty() {
        compare(&files);
    }
}

/// MuJoCo also reads the models that the edit API writes.
#[test]
fn edited_models() {
    let mut spec = ModelSpec::from_xml_file(workspace().join("assets/agents/humanoid.xml")).expect("a model");
    spec.add_to("torso", Body::new("backpack").pos([-0.15, 0.0, 0.0])).expect("a torso");
    spec.add_to("backpack", Joint::hinge([0.0, 1.0, 0.0]).name("strap").range([-10.0, 10.0])).expect("a backpack");
    spec.add_to("backpack", Geom::cuboid([0.08, 0.14, 0.2]).name("backpack").mass(6.0)).expect("a backpack");
    spec.add(Actuator::position("strap", 20.0).joint("strap").ctrl_range([-1.0, 1.0])).expect("a free name");
    let gone = spec.remove(Kind::Body, "left_upper_arm").expect("an arm");
    assert_eq!(gone.len(), 3, "{gone:?}");
    spec.add(HField::new("hills", 2, 3, [5.0, 5.0, 1.0, 1.0]).elevation(&[0.0, 0.5, 1.0, 0.0, 1.0, 2.0]))
        .expect("a free name");
    spec.replace("floor", Geom::hfield("hills").collision(0, 1)).expect("a floor");
    let file = common::scratch("edited").join("marathon_man.xml");
    std::fs::write(&file, spec.to_xml()).expect("a file");
    assert!(Model::from_xml_file(&file).expect("a model") == spec.compile().expect("a model"));
    compare(std::slice::from_ref(&file));
    std::fs::remove_file(file).expect("the file is there");
}

#[test]
fn dm_control_suite() {
    let folder = package("dm_control").join("suite");
    // ball_in_cup has a string through sites
    let names = [
        "acrobot",
        "cartpole",
        "cheetah",
        "finger",
        "fish",
        "hopper",
        "humanoid",
        "humanoid_CMU",
        "lqr",
        "manipulator",
        "pendulum",
        "point_mass",
        "quadruped",
        "reacher",
        "stacker",
        "swimmer",
        "walker",
    ];
    let files = names.iter().map(|name| folder.join(format!("{name}.xml")));
    compare(&files.collect::<Vec<_>>());
}

#[test]
fn dm_control_locomotion() {
    let folder = package("dm_control").join("locomotion");
    let names = [
        "soccer/assets/boxhead/boxhead",
        "walkers/assets/humanoid_CMU_V2019",
        "walkers/assets/humanoid_CMU_V2020",
        "walkers/assets/jumping_ball/jumping_ball_with_head",
        "walkers/assets/rodent",
    ];
    compare(&names.map(|name| folder.join(format!("{name}.xml"))));
}

#[test]
fn gymnasium_mujoco() {
    let folder = package("gymnasium").join("envs/mujoco/assets");
    let names = [
        "ant",
        "half_cheetah",
        "hopper",
        "humanoid",
        "humanoidstandup",
        "inverted_double_pendulum",
        "inverted_pendulum",
        "point",
        "pusher",
        "pusher_v5",
        "reacher",
        "swimmer",
        "walker2d",
        "walker2d_v5",
    ];
    compare(&names.map(|name| folder.join(format!("{name}.xml"))));
}

/// Marathon's own files of Gymnasium's models equal Gymnasium's models in everything that the physics and the tasks
/// use.
#[test]
fn gymnasiums_models_written_anew() {
    let installed = package("gymnasium").join("envs/mujoco/assets");
    let own = xml_files(&workspace().join("assets/gymnasium"));
    assert_eq!(own.len(), 11);
    let original = |file: &PathBuf| match file.file_name().expect("a file").to_str().expect("a name") {
        name @ ("walker2d.xml" | "pusher.xml") => installed.join(name.replace(".xml", "_v5.xml")),
        name => installed.join(name),
    };
    compare_but_looks(&own, &own.iter().map(original).collect::<Vec<_>>(), &[]);
}

/// The same for dm_control's, except for sensors and their sites that no task reads.
#[test]
fn dm_controls_models_written_anew() {
    let installed = package("dm_control").join("suite");
    let own = xml_files(&workspace().join("assets/dm_control"));
    assert_eq!(own.len(), 4);
    for file in own {
        let original = installed.join(file.file_name().expect("a file"));
        let hopper = file.ends_with("hopper.xml");
        let unread: &[&str] = if hopper { &["sensors"] } else { &["sensors", "sites"] };
        compare_but_looks(&[file], &[original], unread);
    }
}

/// Compares files of Marathon's own with others, except for looks and some further fields.
fn compare_but_looks(own: &[PathBuf], originals: &[PathBuf], unread: &[&str]) {
    let answers = oracle("compiled_model.py", &json!({ "files": originals }));
    for (file, theirs) in own.iter().zip(answers["files"].as_array().expect("one answer per file")) {
        let model = Model::from_xml_file(file).unwrap_or_else(|e| panic!("{e}"));
        let mut theirs = theirs.clone();
        forget_looks(&mut theirs);
        // Gymnasium's humanoids set PGS, and every solver with an ordinary cap is Newton's method here
        theirs["opt"]["solver"] = Value::Null;
        for field in unread {
            theirs[*field] = Value::Null;
        }
        let mut differences = Vec::new();
        differ("", &serde_json::to_value(&model).expect("a model is JSON"), &theirs, &mut differences);
        assert!(differences.is_empty(), "{}: {}", file.display(), differences.join("\n"));
    }
}

/// Replaces values by `null`, which is not compared: the look of a model, fields that its tasks do not use, and missing
/// names.
fn forget_looks(model: &mut Value) {
    const LOOKS: [&str; 8] = ["rgba", "material", "cameras", "lights", "keyframes", "numerics", "extent", "center"];
    match model {
        Value::Array(list) => list.iter_mut().for_each(forget_looks),
        Value::Object(fields) => {
            // the visible part of an infinite plane
            let plane = fields.get("kind").is_some_and(|kind| kind == "Plane");
            for (name, value) in fields {
                let nameless = name == "name" && value == "";
                if LOOKS.contains(&name.as_str()) || nameless || plane && ["size", "pos"].contains(&name.as_str()) {
                    *value = Value::Null;
                } else {
                    forget_looks(value);
                }
            }
        }
        _ => {}
    }
}

/// The frame of equal moments is arbitrary; the tensor that it stands for is not.
#[test]
fn the_inertia_tensor_of_nearly_symmetric_bodies() {
    let shapes = [
        r#"<geom size=".1"/><geom size=".1" pos="1 1 0"/>"#,
        r#"<geom size=".1"/><geom size=".1" pos="0 0 1"/><geom size=".1" pos="0 0 -1"/>"#,
        r#"<geom type="box" size=".1 .1 .1" euler="10 20 30"/><geom type="box" size=".1 .1 .1" pos=".3 .3 .3"/>"#,
        r#"<inertial pos="0 0 0" mass="1" fullinertia="1 1 1 1e-7 0 0"/>"#,
        r#"<inertial pos="0 0 0" mass="1" fullinertia="2 2 3 .4 .5 .5"/>"#,
    ];
    let texts: Vec<String> =
        shapes.iter().map(|s| format!("<mujoco><worldbody><body><joint/>{s}</body></worldbody></mujoco>")).collect();
    let answers = oracle("compiled_model.py", &json!({ "texts": texts }));
    for (text, theirs) in texts.iter().zip(answers["texts"].as_array().expect("one answer per text")) {
        let model = Model::from_xml_str(text, "text").expect("a valid model");
        let numbers = |key: &str| -> Vec<f64> {
            let values = theirs["bodies"][1][key].as_array().expect("a vector");
            values.iter().map(|v| v.as_f64().expect("a number")).collect()
        };
        let body = &model.bodies[1];
        let ours = tensor(&body.iquat, &body.inertia);
        let theirs = tensor(&numbers("iquat"), &numbers("inertia"));
        for (a, b) in ours.iter().zip(theirs) {
            assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{text}: {a} and {b}");
        }
    }
}

/// `R diag(inertia) R'` by rows.
fn tensor(quat: &[f64], inertia: &[f64]) -> [f64; 9] {
    let (w, x, y, z) = (quat[0], quat[1], quat[2], quat[3]);
    let r = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ];
    std::array::from_fn(|n| (0..3).map(|k| r[n / 3][k] * inertia[k] * r[n % 3][k]).sum())
}

/// An actuator keeps the class defaults that MuJoCo keeps, including those of unsupported actuators.
#[test]
fn actuators_over_defaults_of_any_kind() {
    const DEFAULTS: [&str; 23] = [
        r#"<muscle timeconst=".1 .2" ctrlrange="0 1" force="5"/>"#,
        r#"<adhesion gain="5" ctrlrange="0 1"/>"#,
        r#"<dcmotor motorconst="1" resistance="2"/>"#,
        r#"<pid kp="5" ki="1" kv="2"/>"#,
        r#"<orientation kp="5"/>"#,
        r#"<general input="pos vel" gaintype="pid" biastype="affine" ctrlrange="0 1"/>"#,
        r#"<general dyntype="muscle" gaintype="muscle" biastype="muscle" gainprm="1 2 3 4 5"/>"#,
        r#"<general gaintype="muscle" gainprm=".6 .9 3 100 .4 1.5 1.4 1.2 1.1" dyntype="filter" dynprm="3 4 5"/>"#,
        r#"<muscle timeconst=".1 .2" scale="30"/>"#,
        r#"<general input="ff"/>"#,
        r#"<general gaintype="user" gainprm="7"/>"#,
        r#"<general biastype="user" gainprm="7"/>"#,
        r#"<general dyntype="user" gainprm="7"/>"#,
        r#"<general biastype="muscle" gainprm="7" biasprm="1 -2 -3"/>"#,
        r#"<general input="vel" gainprm="7" biasprm="1 -2 -3"/>"#,
        r#"<general actlimited="true" actrange="-1 1" actearly="true" dyntype="muscle"/>"#,
        r#"<muscle gear="3" forcerange="-2 2" damping="2" armature="1"/>"#,
        r#"<position kp="9" kv="2"/>"#,
        r#"<velocity kv="9"/>"#,
        r#"<motor gear="3"/>"#,
        r#"<damper kv="2" ctrlrange="0 1"/>"#,
        r#"<cylinder area="2" timeconst=".3"/>"#,
        r#"<intvelocity kp="3" actrange="-1 1"/>"#,
    ];
    const SECOND: [&str; 8] = [
        "",
        r#"<general gainprm="20"/>"#,
        r#"<position kp="20"/>"#,
        "<motor/>",
        r#"<muscle force="3"/>"#,
        r#"<velocity kv="8"/>"#,
        r#"<general dyntype="muscle" dynprm=".5 .6 .7"/>"#,
        r#"<general gaintype="fixed" biastype="affine"/>"#,
    ];
    const ACTUATORS: [&str; 11] = [
        "motor",
        "position",
        "velocity",
        "general",
        r#"intvelocity actrange="-1 1""#,
        r#"damper ctrlrange="0 2""#,
        "cylinder",
        r#"general gaintype="fixed" biastype="none" dyntype="none" input="pos""#,
        r#"position kp="4" kv="3""#,
        "muscle",
        r#"muscle force="3" timeconst="1 2" tausmooth="0.1""#,
    ];
    let body = r#"<compiler><lengthrange uselimit="true"/></compiler><worldbody><body><joint name="j" axis="0 1 0" range="-1 1"/><geom size=".1" pos=".3 0 0"/></body></worldbody>"#;
    let mut texts = Vec::new();
    for (default, second) in DEFAULTS.iter().flat_map(|d| SECOND.iter().map(move |s| (d, s))) {
        for (outer, inner) in [(default, second), (second, default)] {
            texts.extend(ACTUATORS.iter().map(|actuator| {
                format!(
                    r#"<mujoco><default>{outer}<default class="a">{inner}</default></default>{body}<actuator><{actuator} joint="j" class="a"/></actuator></mujoco>"#
                )
            }));
        }
    }
    let answers = oracle("compiled_model.py", &json!({ "texts": texts }));
    let (mut agree, mut report) = (0, Vec::new());
    for (text, theirs) in texts.iter().zip(answers["texts"].as_array().expect("one answer per text")) {
        let error = theirs.get("error");
        match Model::from_xml_str(text, "text") {
            Ok(_) if error.is_some() => report.push(format!("{text}: MuJoCo refuses it: {error:?}")),
            Ok(model) => {
                let mut differences = Vec::new();
                differ("", &serde_json::to_value(&model).expect("a model is JSON"), theirs, &mut differences);
                agree += usize::from(differences.is_empty());
                report.extend(differences.iter().take(1).map(|d| format!("{text}: {d}")));
            }
            Err(e) if error.is_some() || matches!(e.kind, MjcfErrorKind::Unsupported { .. }) => {}
            Err(e) => report.push(format!("{text}: refused: {e}")),
        }
    }
    println!("{agree} of {} load and agree", texts.len());
    assert!(agree > 1500, "{agree} of {} load and agree", texts.len());
    assert!(report.is_empty(), "{} differ: {}", report.len(), report[..report.len().min(5)].join("\n"));
}
