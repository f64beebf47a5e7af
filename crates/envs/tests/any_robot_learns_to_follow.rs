//! The task for any model finds out what it needs: root, standing pose, feet, servos and speeds.

use crate::common;
use marathon_envs::agents::robot::arguments::RobotArguments;
use marathon_envs::agents::robot::rig::Rig;
use marathon_envs::agents::robot::servos::Drive;
use marathon_envs::options::{OptionSet, Value};
use marathon_envs::{Options, VecEnv, VecEnvOptions, registry};
use std::path::{Path, PathBuf};

fn asset(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets").join(name).to_string_lossy().into_owned()
}

fn rig(file: &str) -> Rig {
    let rig = with_options(&asset(file), &[]).unwrap_or_else(|error| panic!("{file}: {error}"));
    println!("--- {file}\n{rig}");
    rig
}

/// Names of the feet with their phases.
fn feet(rig: &Rig) -> Vec<(&str, f64)> {
    rig.feet.iter().map(|(foot, phase)| (rig.model.bodies[foot.body].name.as_str(), *phase)).collect()
}

#[test]
fn feet_and_their_order_are_found() {
    let quadruped = rig("agents/quadruped.xml");
    // a trot: diagonal legs together
    let trot = [("fl_shank", 0.0), ("fr_shank", 0.5), ("rl_shank", 0.5), ("rr_shank", 0.0)];
    assert_eq!(feet(&quadruped), trot);
    assert!((quadruped.height - 0.297).abs() < 0.03, "{}", quadruped.height);
    assert_eq!(quadruped.drives.len(), 12);
    assert!(quadruped.fastest.iter().all(|most| *most > 0.0));

    for (file, count, commands) in [
        ("agents/hopper.xml", 1, 1),
        ("agents/walker2d.xml", 2, 1),
        ("agents/humanoid.xml", 2, 3),
        ("agents/ant.xml", 4, 3),
        ("agents/marathon_man.xml", 2, 3),
        ("gymnasium/ant.xml", 4, 3),
        ("gymnasium/humanoid.xml", 2, 3),
        ("dm_control/humanoid.xml", 2, 3),
        ("dm_control/walker.xml", 2, 1),
        ("../examples/robots/hexapod.xml", 6, 3),
        ("../examples/robots/snake.xml", 0, 3),
    ] {
        let rig = rig(file);
        assert_eq!(rig.feet.len(), count, "{file}");
        let servos = rig.drives.iter().filter(|drive| matches!(drive, Drive::Servo(_))).count();
        assert_eq!(servos, rig.model.nu, "{file}: motors on joints become servos");
        let env = VecEnv::new(&asset(file), &VecEnvOptions::default()).expect("an environment");
        assert_eq!(env.spec().command.len(), commands, "{file}");
        if let [(_, first), (_, second)] = feet(&rig)[..] {
            assert!((first - second).abs() == 0.5, "{file}: two feet alternate");
        }
    }
}

/// The rig of a file with options, or why there is none.
fn with_options(path: &str, options: &[(&str, &str)]) -> Result<Rig, String> {
    let read = |text: &str| text.parse::<Value>().expect("a value");
    let given =
        options.iter().fold(Options::new().with("xml_file", path), |all, (name, value)| all.with(name, read(value)));
    Rig::new(&RobotArguments::default().with(&given)).map_err(|error| error.to_string())
}

#[test]
fn the_place_of_a_robot_does_not_matter() {
    let text = std::fs::read_to_string(asset("agents/quadruped.xml")).expect("the file");
    let root = text.lines().find(|line| line.contains("<body ")).expect("a root").trim().to_owned();
    let pos = root.split("pos=\"").nth(1).and_then(|rest| rest.split('"').next()).expect("a place");
    let height = pos.split(' ').nth(2).expect("three numbers");
    let moved = root.replace(pos, &format!("-1 1 {height}"));
    let path = common::scratch("robot-elsewhere").join("quadruped.xml");
    std::fs::write(&path, text.replace(&root, &moved)).expect("the file can be written");
    let rig = with_options(&path.to_string_lossy(), &[]).expect("a robot");
    assert_eq!(feet(&rig), [("fl_shank", 0.0), ("fr_shank", 0.5), ("rl_shank", 0.5), ("rr_shank", 0.0)]);
}

#[test]
fn options_replace_what_is_found() {
    let quadruped = asset("agents/quadruped.xml");
    let none = with_options(&quadruped, &[("feet", "none")]).expect("a robot");
    assert!(none.feet.is_empty() && !none.clock);
    let kept = with_options(&asset("dm_control/humanoid.xml"), &[("stiffness", "0")]).expect("a robot");
    assert!(kept.drives.iter().all(|drive| matches!(drive, Drive::Direct(_))));
    let reference = with_options(&quadruped, &[("pose", "reference")]).expect("a robot");
    assert!(reference.to_string().contains("pose       the reference pose"));
    for (name, value, part) in [
        ("feet", "fl_shank,fl_shank", "feet has 'fl_shank' twice"),
        ("pose", "sitting", "expected auto, reference"),
        ("step_rate", "100", "step_rate is 100, expected at most 25"),
    ] {
        let Err(error) = with_options(&quadruped, &[(name, value)]) else { panic!("{name}={value} is accepted") };
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn what_is_no_robot_is_refused() {
    let folder = common::scratch("no-robots");
    let file = |name: &str, text: &str| -> PathBuf {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("a file");
        path
    };
    let arm = "<mujoco><worldbody><body><joint name='j' axis='0 1 0'/><geom size='.1'/></body></worldbody>\
               <actuator><motor joint='j'/></actuator></mujoco>";
    let ball = "<mujoco><worldbody><body pos='0 0 1'><freejoint/><geom size='.1'/></body></worldbody></mujoco>";
    let still = "<mujoco><worldbody><geom size='.1'/></worldbody></mujoco>";
    let ghost = "<mujoco><worldbody><body pos='0 0 1'><freejoint/><geom size='.1' contype='0' conaffinity='0'/></body>\
                 </worldbody></mujoco>";
    for (path, said) in [
        (file("arm.xml", arm), "its root is fixed"),
        (file("ball.xml", ball), "no actuators"),
        (file("still.xml", still), "nothing in it moves"),
        (file("ghost.xml", ghost), "none of its geoms can touch the ground"),
        (folder.join("missing.xml"), "cannot read the file"),
    ] {
        let error = registry::agent(&path.to_string_lossy()).err().expect("an error").to_string();
        assert!(error.contains(said), "{error}");
    }
    let refused = |options: Options| {
        let agent = registry::agent("Robot").and_then(|agent| agent.with_options(&options));
        agent.err().expect("an error").to_string()
    };
    let said = refused(Options::new().with("feet", "fl_shank,fr_shink"));
    assert!(said.contains("'fr_shink'") && said.contains("'fr_shank'"), "{said}");
    let said = refused(Options::new().with("pose", "stanse"));
    assert!(said.contains("'stanse'") && said.contains("stance"), "{said}");
    let said = refused(Options::new().with("speed", -1.0));
    assert!(said.contains("auto, or a finite number"), "{said}");
    std::fs::remove_dir_all(&folder).expect("the folder goes");
}

/// The servos hold the standing pose: the robot is not thrown off by its own findings.
#[test]
fn a_robot_with_four_legs_stands() {
    for file in ["agents/quadruped.xml", "agents/ant.xml", "gymnasium/ant.xml"] {
        let rig = rig(file);
        let hold = rig.hold.expect("a robot with four legs is held");
        assert!(hold.stands() && hold.height > 0.8 && hold.tilt < 15.0, "{file}: {hold:?}");
        let options = VecEnvOptions { agents: 4, ..VecEnvOptions::default() };
        let mut env = VecEnv::new(&asset(file), &options).expect("an environment");
        let mut step = env.buffers();
        env.reset(Some(1), &mut step.obs).expect("a start");
        let actions = vec![0.0; 4 * env.spec().act];
        for _ in 0..50 {
            env.step(&actions, &mut step).expect("a step");
            assert!(!step.terminated.contains(&true), "{file} falls");
        }
        let height = env.state(0).expect("a state").qpos[2] - rig.ground;
        assert!(height > 0.7 * rig.height, "{file}: {height} of {}", rig.height);
    }
    assert!(rig("agents/humanoid.xml").hold.is_none(), "two legs need balance");
}

/// A file as robots come: a wall but no floor, soft feet, a solver with one iteration, motors.
/// On two feet, an action can ask a joint for all its torque: in each step, one leg carries the robot.
#[test]
fn legs_carry_a_robot_alone_on_two_feet() {
    let asks = |file: &str| -> Vec<f64> {
        let servos = rig(file).drives.into_iter().filter_map(|drive| match drive {
            Drive::Servo(servo) => Some(servo.scale * servo.stiffness / servo.strength),
            Drive::Direct(_) => None,
        });
        servos.collect()
    };
    assert!(asks("dm_control/humanoid.xml").iter().all(|torque| *torque > 1.0));
    assert!(asks("agents/quadruped.xml").iter().all(|torque| *torque < 1.0));
}

#[test]
fn a_bare_model_is_made_ready() {
    let quadruped = std::fs::read_to_string(asset("agents/quadruped.xml")).expect("the model");
    let mut bare = quadruped.clone();
    let wall = r#"<geom type="plane" size="1 1 .1" pos="3 0 2" zaxis="-1 0 0" contype="1" conaffinity="1"/>"#;
    for (old, new) in [
        (r#"<option timestep="0.004" integrator="implicitfast"/>"#, r#"<option timestep="0.002" iterations="1"/>"#),
        (r#"<geom name="floor" type="plane" size="0 0 0.05" contype="1" conaffinity="1"/>"#, wall),
        (r#"friction="0.7"/>"#, r#"friction="0.4" margin="0.001" solimp="0.015 1 0.03"/>"#),
        (r#"kp="38" forcerange="-24 24" inheritrange="1"/>"#, r#"kp="38"/><motor ctrlrange="-24 24"/>"#),
        (r#"<position forcerange="-36 36"/>"#, r#"<motor ctrlrange="-36 36"/>"#),
        ("    <position name=", "    <motor name="),
    ] {
        assert!(bare.contains(old), "{old}");
        bare = bare.replace(old, new);
    }
    let file = common::scratch("bare").join("quadruped.xml");
    std::fs::write(&file, bare).expect("a file");
    let name = file.to_string_lossy().into_owned();
    let arguments = RobotArguments::default().with(&Options::new().with("xml_file", name.as_str()));
    let (shipped, bare) = (rig("agents/quadruped.xml"), Rig::new(&arguments).expect("a robot"));
    println!("{bare}");
    assert_eq!(feet(&bare), feet(&shipped));
    let soles = |rig: &Rig| -> Vec<String> {
        let geoms = rig.feet.iter().flat_map(|(foot, _)| &foot.geoms);
        geoms.map(|geom| rig.model.geoms[*geom].name.clone()).collect()
    };
    assert_eq!(soles(&bare), ["fl", "fr", "rl", "rr"]);
    assert_eq!(soles(&shipped), soles(&bare));
    for geom in bare.feet.iter().flat_map(|(foot, _)| &foot.geoms).map(|geom| &bare.model.geoms[*geom]) {
        assert_eq!((geom.solimp[0], geom.margin, geom.friction[0]), (0.9, 0.0, 0.6), "{}", geom.name);
    }
    assert!(bare.hold.is_some_and(|hold| hold.stands()));
    for said in ["12 in place of motors", "made hard at 4 geoms"] {
        assert!(bare.to_string().contains(said), "{said} in\n{bare}");
    }
    let options = VecEnvOptions { agents: 16, ..VecEnvOptions::default() };
    let mut env = VecEnv::new(&name, &options).expect("an environment");
    let mut step = env.buffers();
    env.reset(Some(1), &mut step.obs).expect("a start");
    for t in 0..200 {
        let actions: Vec<f32> =
            (0..16 * env.spec().act).map(|i| if (i * 7 + t * 3) % 5 < 2 { 1.0 } else { -1.0 }).collect();
        env.step(&actions, &mut step).expect("a step");
        assert!(!step.diverged.contains(&true), "decision {t}");
    }
    std::fs::remove_file(&file).expect("the file goes");
}

/// A straight knee bends in the reference pose. A keyframe stays as its author made it.
#[test]
fn straight_knees_bend() {
    for file in ["dm_control/humanoid.xml", "dm_control/walker.xml", "gymnasium/walker2d.xml"] {
        let rig = rig(file);
        assert!(rig.to_string().contains("straight knees bent"), "{file}");
        let mut spec = marathon_physics::spec::ModelSpec::from_xml_file(asset(file)).expect("a model");
        let straight = spec.compile().expect("a model").qpos0;
        spec.add(marathon_physics::spec::Keyframe::new("home").qpos(&straight)).expect("a keyframe");
        let path = common::scratch("knees").join("robot.xml");
        std::fs::write(&path, spec.to_xml()).expect("a file");
        let name = path.to_string_lossy().into_owned();
        let chosen = RobotArguments::default().with(&Options::new().with("xml_file", name.as_str()));
        let chosen = Rig::new(&chosen).expect("a robot");
        std::fs::remove_file(&path).expect("the file goes");
        let lower = 1.0 - rig.height / chosen.height;
        assert!((0.02..0.09).contains(&lower), "{file}: {lower}");
        assert!(!chosen.to_string().contains("bent"), "{file}");
    }
}

/// A cart on four wheels, moved by actuators such as `<motor .../>`.
fn cart(actuator: &str, wheel: &str) -> Rig {
    let [mut wheels, mut actuators] = [const { String::new() }; 2];
    for (i, [x, y]) in [[0.2, 0.25], [0.2, -0.25], [-0.2, 0.25], [-0.2, -0.25]].into_iter().enumerate() {
        wheels += &format!(
            "<body name='w{i}' pos='{x} {y} 0'><joint name='w{i}' axis='0 1 0'/><geom {wheel} euler='90 0 0'/></body>"
        );
        actuators += &format!("<{actuator} joint='w{i}' ctrlrange='-2 2'/>");
    }
    let text = format!(
        "<mujoco><worldbody><body name='cart' pos='0 0 .15'><freejoint/><geom type='box' size='.3 .2 .05'/>{wheels}</body>\
         </worldbody><actuator>{actuators}</actuator></mujoco>"
    );
    let path = common::scratch(&format!("cart-{}", actuator.len() + wheel.len())).join("cart.xml");
    std::fs::write(&path, text).expect("a file");
    let arguments = RobotArguments::default().with(&Options::new().with("xml_file", path.to_string_lossy().as_ref()));
    let rig = Rig::new(&arguments).unwrap_or_else(|error| panic!("{error}"));
    let _ = std::fs::remove_file(path);
    rig
}

#[test]
fn wheels_are_no_feet() {
    let round = "type='cylinder' size='.1 .03'";
    for actuator in ["velocity kv='1'", "motor"] {
        let rig = cart(actuator, round);
        assert!(rig.feet.is_empty() && !rig.clock, "{rig}");
        assert!(rig.drives.iter().all(|drive| matches!(drive, Drive::Direct([0.0, 2.0]))), "{rig}");
        assert!(rig.to_string().contains("feet       none: it rolls on w0, w1, w2, w3"), "{rig}");
    }
    // a paddle turns as well, but does not roll
    assert_eq!(cart("motor", "type='box' size='.02 .1 .03'").feet.len(), 4);
    assert_eq!(cart("motor", "type='cylinder' size='.1 .03' pos='0 0 -.05'").feet.len(), 4);
}
