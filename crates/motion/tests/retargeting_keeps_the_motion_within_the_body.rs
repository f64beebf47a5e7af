//! Retargeting respects limits, ground, contacts, bones and balance. The identity mapping reproduces the clip. Shipped
//! clips have no warnings.

use crate::common::{all_shipped, file, model, shipped};
use glam::{DQuat, DVec3};
use marathon_motion::kinematics::Pose;
use marathon_motion::{About, Animation, Clip, Fit, Layout, Mapping, check, efforts, fit, import, retarget, soles};
use marathon_physics::Model;
use std::path::Path;

#[test]
fn shipped_clips_have_nothing_to_warn_of() {
    for character in ["marathon_man", "humanoid", "walker2d"] {
        let model = model(character);
        let names = all_shipped(character);
        assert!(names.contains(&"walk".to_string()) && names.contains(&"run".to_string()), "{character}: {names:?}");
        for name in names {
            let clip = shipped(character, &name);
            let report = check(name.as_ref(), &clip, &model, &soles(&model)).unwrap();
            // here the recorded people drag a foot along the ground
            let drags = ["cartwheel", "getup_faceup", "punch"];
            let slides = drags.contains(&name.as_str());
            let warnings = report.warnings();
            let sound = warnings.is_empty() || slides && warnings.iter().all(|text| text.contains("slid"));
            assert!(sound, "{character}, {name}: {warnings:#?}");
            assert!(report.slide.value < 0.06, "{character}, {name}: {:?}", report.slide);
            let about = clip.about();
            assert_eq!(about.name, name);
            assert!(about.source.contains("DeepMimic") && about.license == "Zlib", "{about:?}");
        }
    }
}

#[test]
fn leaps_of_the_whole_figure_and_floating_are_warned_of() {
    let model = model("marathon_man");
    let whole: serde_json::Value =
        serde_json::from_slice(&std::fs::read(file("assets/motions/marathon_man/walk.motion")).unwrap()).unwrap();
    let warnings = |edit: &dyn Fn(usize, &mut Vec<serde_json::Value>)| {
        let mut edited = whole.clone();
        edited.as_object_mut().unwrap().remove("checksum");
        for (i, frame) in edited["frames"].as_array_mut().unwrap().iter_mut().enumerate() {
            edit(i, frame.as_array_mut().unwrap());
        }
        let clip = Clip::parse_without_checksum("edited".as_ref(), edited.to_string().as_bytes()).unwrap();
        check("edited".as_ref(), &clip, &model, &soles(&model)).unwrap().warnings().join("\n")
    };
    let add = |frame: &mut Vec<serde_json::Value>, axis: usize, way: f64| {
        frame[axis] = (frame[axis].as_f64().unwrap() + way).into();
    };
    assert_eq!(warnings(&|_, _| ()), "");
    let leap = warnings(&|i, frame| {
        if i >= 20 {
            add(frame, 0, 3.0)
        }
    });
    assert!(leap.contains("root moves at") && leap.contains("m/s"), "{leap}");
    let floats = warnings(&|_, frame| add(frame, 2, 0.5));
    assert!(floats.contains("no frame touches the ground: the lowest point is"), "{floats}");
    // half a turn about the vertical axis
    let turned = warnings(&|i, frame| {
        if i >= 20 {
            let [w, x, y, z] = [3, 4, 5, 6].map(|k| frame[k].as_f64().unwrap());
            for (k, value) in [-z, -y, x, w].into_iter().enumerate() {
                frame[3 + k] = value.into();
            }
        }
    });
    assert!(turned.contains("root turns at"), "{turned}");
}

#[test]
fn a_clip_onto_its_own_model_is_the_clip_again() {
    let model = model("marathon_man");
    for name in ["walk", "run", "backflip", "kick", "spin", "cartwheel"] {
        let clip = shipped("marathon_man", name);
        let animation = Animation::of_clip(name.as_ref(), &model, &clip).unwrap();
        let animation = if animation.wraps() { animation.looped("clip".as_ref()).unwrap() } else { animation };
        let hips = ["left_thigh", "right_thigh"];
        let mapping = Mapping::by_name(name.as_ref(), animation.skeleton(), &model, hips).unwrap();
        let again = retarget(name.as_ref(), &animation, &model, &mapping).unwrap();
        assert_eq!(again.frames(), clip.frames());
        let (mut joints, mut place) = (0.0_f64, 0.0_f64);
        for i in 0..clip.frames() {
            for joint in model.joints.iter().skip(1) {
                joints = joints.max((again.frame(i)[joint.qpos_adr] - clip.frame(i)[joint.qpos_adr]).abs());
            }
            place = place.max((DVec3::from_slice(again.frame(i)) - DVec3::from_slice(clip.frame(i))).length());
        }
        println!("{name}: {joints:.4} rad, {place:.4} m");
        assert!(joints < 0.02 && place < 0.008, "{name}: {joints} rad, {place} m");
    }
}

#[test]
fn retargeting_gives_the_same_bits_again() {
    let (humanoid, man) = (model("humanoid"), model("marathon_man"));
    let clip = shipped("marathon_man", "run");
    let bytes = || {
        let animation = Animation::of_clip("run".as_ref(), &man, &clip).unwrap();
        let text = r#"{"mapping": 1, "model": "humanoid", "hips": ["left_thigh", "right_thigh"], "soles": ["left_foot"],
            "parts": {"torso": {"joint": "torso"}, "left_thigh": {"joint": "left_thigh"},
            "right_thigh": {"joint": "right_thigh"}, "left_shin": {"joint": "left_shin"}}}"#;
        let mapping = Mapping::parse("m.json".as_ref(), text.as_bytes(), animation.skeleton(), &humanoid).unwrap();
        retarget("run".as_ref(), &animation, &humanoid, &mapping).unwrap().to_bytes()
    };
    assert_eq!(bytes(), bytes());
}

/// A recording of a character in T-pose with Mixamo's names, in centimeters and with y up. It raises its left leg to
/// the front, bends the knee, and lifts its right arm from the T-pose straight up.
fn mixamo(frames: usize) -> String {
    let limb = |names: [&str; 3], at: [f64; 3], step: [f64; 3], end: [f64; 3]| {
        let v = |v: [f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
        let channels = "CHANNELS 3 Zrotation Xrotation Yrotation";
        format!(
            "JOINT mixamorig:{} {{ OFFSET {} {channels}\nJOINT mixamorig:{} {{ OFFSET {} {channels}\n\
             JOINT mixamorig:{} {{ OFFSET {} {channels}\nEnd Site {{ OFFSET {} }} }} }} }}\n",
            names[0],
            v(at),
            names[1],
            v(step),
            names[2],
            v(step),
            v(end)
        )
    };
    let leg = |side: &str, x: f64| {
        let names = ["UpLeg", "Leg", "Foot"].map(|part| format!("{side}{part}"));
        limb([&names[0], &names[1], &names[2]], [x, -5.0, 0.0], [0.0, -42.0, 0.0], [0.0, -6.0, 15.0])
    };
    let arm = |side: &str, x: f64| {
        let names = ["Arm", "ForeArm", "Hand"].map(|part| format!("{side}{part}"));
        limb([&names[0], &names[1], &names[2]], [17.0 * x, 12.0, 0.0], [27.0 * x, 0.0, 0.0], [10.0 * x, 0.0, 0.0])
    };
    let mut text = format!(
        "HIERARCHY\nROOT mixamorig:Hips\n{{ OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n\
         {}{}JOINT mixamorig:Spine2 {{ OFFSET 0 40 0 CHANNELS 3 Zrotation Xrotation Yrotation\n\
         {}{}JOINT mixamorig:Head {{ OFFSET 0 25 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site {{ OFFSET 0 20 0 }} }} }} }}\n\
         MOTION\nFrames: {frames}\nFrame Time: 0.0166667\n",
        leg("Left", 10.0),
        leg("Right", -10.0),
        arm("Left", 1.0),
        arm("Right", -1.0)
    );
    for i in 0..frames {
        let share = i as f64 / (frames - 1) as f64;
        // root; left leg: a negative angle about x moves the thigh forward, a positive one the shin back
        text.push_str("0 95 0 0 0 0 ");
        text.push_str(&format!("0 {} 0 0 {} 0 0 0 0 ", -60.0 * share, 90.0 * share));
        text.push_str("0 0 0 0 0 0 0 0 0 0 0 0 ");
        // left arm down, right arm from down to straight ahead
        text.push_str("-80 0 0 0 0 0 0 0 0 ");
        text.push_str(&format!("80 {} 0 0 0 0 0 0 0 0 0 0\n", -80.0 * share));
    }
    text
}

#[test]
fn a_recording_of_another_skeleton_unit_and_pose_moves_the_same_limbs() {
    for character in ["marathon_man", "humanoid"] {
        let model = model(character);
        let animation = import::bvh("mixamo.bvh".as_ref(), mixamo(61).as_bytes()).unwrap();
        let mapping = Mapping::built_in("mixamo.bvh".as_ref(), animation.skeleton(), &model).unwrap();
        let clip = retarget("mixamo.bvh".as_ref(), &animation, &model, &mapping).unwrap();
        let body = |name: &str| model.bodies.iter().position(|body| body.name == name).expect("a body");
        let way = |frame: usize, a: &str, b: &str| {
            let pose = Pose::of(&model, clip.frame(frame));
            (pose.pos[body(b)] - pose.pos[body(a)]).normalize()
        };
        // in degrees from the expected direction; +x is forward
        let off = |found: DVec3, wanted: DVec3| found.angle_between(wanted.normalize()).to_degrees();
        let (last, down) = (clip.frames() - 1, DVec3::NEG_Z);
        let raised = DQuat::from_rotation_y(-60f64.to_radians()) * down;
        let bent = DQuat::from_rotation_y(30f64.to_radians()) * down;
        let found = [
            off(way(0, "left_thigh", "left_shin"), down),
            off(way(last, "left_thigh", "left_shin"), raised),
            off(way(last, "left_shin", "left_foot"), bent),
            off(way(last, "right_thigh", "right_shin"), down),
        ];
        assert!(found.iter().all(|off| *off < 8.0), "{character}: legs off by {found:?} degrees");
        let lower = if character == "humanoid" { "left_lower_arm" } else { "left_larm" };
        assert!(off(way(0, "left_upper_arm", lower), down) < 30.0, "{character}");
        let report = check("mixamo.bvh".as_ref(), &clip, &model, &soles(&model)).unwrap();
        assert_eq!(report.warnings(), Vec::<String>::new(), "{character}");
    }
}

/// A clip of Marathon Man, retargeted again with a factor on the balance law.
fn balanced(model: &Model, clip: &Clip, factor: f64) -> (Clip, Fit) {
    let path = Path::new("clip");
    let animation = Animation::of_clip(path, model, clip).unwrap();
    let animation = if animation.wraps() { animation.looped("clip".as_ref()).unwrap() } else { animation };
    let parts: Vec<String> = (model.bodies.iter().filter(|body| body.mass > 0.0))
        .map(|body| format!(r#""{0}": {{"joint": "{0}", "rotation": 0.3, "position": 1}}"#, body.name))
        .collect();
    let text = format!(
        r#"{{"mapping": 1, "model": "marathon_man", "hips": ["left_thigh", "right_thigh"],
        "soles": ["left_foot", "right_foot"], "parts": {{{}}}}}"#,
        parts.join(", ")
    );
    let mapping = Mapping::parse("m.json".as_ref(), text.as_bytes(), animation.skeleton(), model).unwrap();
    let mapping = mapping.balanced(factor);
    let again = retarget(path, &animation, model, &mapping).unwrap();
    let fit = fit(path, &animation, model, &mapping, &again).unwrap();
    (again, fit)
}

#[test]
fn nobody_falls_over_faster_than_weight_and_ground_let_him() {
    let model = model("marathon_man");
    let clip = shipped("marathon_man", "cartwheel");
    let [(moment, _), (lawful, fit)] = [0.0, 1.0].map(|factor| {
        let (again, fit) = balanced(&model, &clip, factor);
        (efforts("clip".as_ref(), &again, &model).unwrap().unbalanced.value, fit)
    });
    println!("{moment}, {lawful}, {fit:?}");
    assert!(moment > 0.4 && lawful < 0.5 * moment, "a moment of {moment}, with the law {lawful}");
    assert!(fit.position < 0.03, "{fit:?}");
}

#[test]
fn nobody_begins_to_turn_in_the_air() {
    let model = model("marathon_man");
    let stand = shipped("marathon_man", "stand");
    let dt = 1.0 / 60.0;
    // a second in the air, upright in the first half, falling forward in the second
    let rows: Vec<Vec<f64>> = (0..=60)
        .map(|i| {
            let time = f64::from(i) * dt;
            let mut qpos = stand.frame(0).to_vec();
            qpos[2] += 0.2 + 0.5 * 9.81 * time * (1.0 - time);
            let pitch = DQuat::from_rotation_y(2.0 * (time - 0.5).max(0.0));
            let turned = pitch * DQuat::from_xyzw(qpos[4], qpos[5], qpos[6], qpos[3]);
            qpos[3..7].copy_from_slice(&[turned.w, turned.x, turned.y, turned.z]);
            qpos
        })
        .collect();
    let about = About { model: "marathon_man".into(), ..About::default() };
    let clip = Clip::new("clip".as_ref(), about, Layout::of(&model), dt, None, &rows).unwrap();
    let [free, lawful] = [0.0, 10.0].map(|factor| {
        let (again, fit) = balanced(&model, &clip, factor);
        let flights = efforts("clip".as_ref(), &again, &model).unwrap().flights;
        println!("{factor}: {flights:?} {fit:?}");
        let [flight] = &flights[..] else { panic!("{flights:?}") };
        flight.gained[1].abs()
    });
    assert!(free > 15.0 && lawful < 0.3 * free, "{free} kg m^2/s gained, with the law {lawful}");
}

#[test]
fn the_shipped_mappings_are_in_the_repository() {
    for name in ["marathon_man", "humanoid", "walker2d"] {
        assert!(file(&format!("assets/motions/mappings/{name}.json")).exists(), "{name}");
    }
}
