//! A model that is edited and then compiled equals, bit for bit, the model whose file says the same.
//!
//! References to removed elements go with them, and keyframes keep their meaning. A wrong name is an error with the nearest
//! one, and an edit that fails changes nothing.

use crate::common::{shipped, workspace};
use marathon_physics::Model;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::spec::*;

/// Two arms on a torso, with something that refers to each part of them.
const ARMS: &str = r#"<mujoco model="arms">
  <default>
    <geom density="500"/>
    <default class="arm"><geom size="0.04" rgba="1 0 0 1"/><joint damping="2" range="-90 90"/></default>
  </default>
  <asset><hfield name="hills" nrow="2" ncol="3" size="5 5 1 1" elevation="0 1 2 3 4 5"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <body name="torso" pos="0 0 1">
      <freejoint name="root"/>
      <geom name="torso" size="0.2"/>
      <body name="left" pos="0 0.3 0" childclass="arm">
        <joint name="left" type="ball" limited="false"/>
        <geom name="left" fromto="0 0 0 0 0.3 0" type="capsule"/>
        <site name="left"/>
      </body>
      <body name="right" pos="0 -0.3 0" childclass="arm">
        <joint name="right" ref="10"/>
        <geom name="right" fromto="0 0 0 0 -0.3 0" type="capsule"/>
        <site name="right"/>
      </body>
    </body>
    <body name="target" mocap="true" pos="1 2 3"><site name="target"/></body>
    <camera name="at_left" mode="targetbody" target="left" pos="3 0 1"/>
  </worldbody>
  <contact>
    <exclude name="arms" body1="left" body2="right"/>
    <pair name="left_floor" geom1="left" geom2="floor"/>
    <pair name="right_floor" geom1="right" geom2="floor"/>
  </contact>
  <tendon>
    <fixed name="pull"><joint joint="right" coef="2"/></fixed>
  </tendon>
  <equality><weld name="hand" body1="left" body2="target"/></equality>
  <actuator>
    <motor name="pull" tendon="pull"/>
    <general name="slow" joint="right" dyntype="integrator"/>
    <motor name="twist" joint="right" gear="3"/>
  </actuator>
  <sensor>
    <touch name="left" site="left"/>
    <touch name="right" site="right"/>
    <framepos name="left_from_right" objtype="body" objname="left" reftype="site" refname="right"/>
    <actuatorfrc name="pulled" actuator="pull"/>
    <framepos name="torso" objtype="geom" objname="torso"/>
  </sensor>
  <keyframe>
    <key name="start" qpos="1 2 3 1 0 0 0 0 1 0 0 0.5" qvel="1 2 3 4 5 6 7 8 9 10" act="11" ctrl="12 13 14" mpos="4 5 6" mquat="0 0 0 1"/>
    <key name="short" qpos="1 2 3"/>
  </keyframe>
</mujoco>"#;

fn arms() -> ModelSpec {
    ModelSpec::from_xml_str(ARMS, "arms.xml").unwrap()
}

/// The model of [`ARMS`] with other text in some places.
fn by_hand(changes: &[(&str, &str)]) -> Model {
    let mut text = ARMS.to_owned();
    for (old, new) in changes {
        assert_eq!(text.matches(old).count(), 1, "{old}");
        text = text.replace(old, new);
    }
    Model::from_xml_str(&text, "by hand").unwrap()
}

/// The start tag with the name, as errors and removals give it.
fn tags(list: &[(&str, &str)]) -> Vec<String> {
    list.iter().map(|(tag, name)| format!("<{tag} name=\"{name}\">")).collect()
}

#[test]
fn added_parts_are_those_of_a_file() {
    let mut spec = arms();
    spec.add_to("torso", Body::new("pack").pos([-0.2, 0.0, 0.1]).quat([1.0, 0.0, 0.0, 1.0]).childclass("arm")).unwrap();
    spec.add_to("pack", Joint::slide([1.0, 0.0, 0.0]).name("strap").range([-0.1, 0.25]).stiffness(100.0)).unwrap();
    spec.add_to("pack", Geom::cuboid([0.1, 0.2, 0.3]).name("pack").mass(6.0).friction([0.9, 0.01, 0.001])).unwrap();
    spec.add_to("pack", Site::new("top").pos([0.0, 0.0, 1.0 / 3.0]).size(&[0.01])).unwrap();
    spec.add_first_to("world", Geom::hfield("dunes").name("dunes").pos([20.0, 0.0, -0.01]).collision(0, 1)).unwrap();
    spec.add(HField::new("dunes", 2, 3, [4.0, 5.0, 0.5, 0.1]).elevation(&[0.1, 0.2, 0.7, 0.4, 0.5, 0.6])).unwrap();
    spec.add(Tendon::fixed("sum").joint("right", 1.0).joint("strap", -0.5)).unwrap();
    spec.add(Actuator::position("strap", 50.0).joint("strap").ctrl_range([-1.0, 1.0]).force_range([-9.0, 9.0]))
        .unwrap();
    spec.add(Actuator::motor("sum").tendon("sum").gear(2.5)).unwrap();
    spec.add(Sensor::new("jointpos", "strap").set("joint", "strap")).unwrap();
    spec.add(Equality::connect("pack", "world", [0.1, 0.0, 0.0]).name("held").set("active", false)).unwrap();
    spec.add(ContactExclude::new("pack", "left")).unwrap();
    spec.section_mut("option").unwrap().set("timestep", 0.001).unwrap();
    spec.section_mut("statistic").unwrap().set("extent", 7.0).unwrap();

    let added = by_hand(&[
        (
            "<worldbody>",
            r#"<worldbody>
               <geom name="dunes" type="hfield" hfield="dunes" pos="20 0 -0.01" contype="0" conaffinity="1"/>"#,
        ),
        (
            "      </body>\n    </body>",
            r#"      </body>
               <body name="pack" pos="-0.2 0 0.1" quat="1 0 0 1" childclass="arm">
                 <joint name="strap" type="slide" axis="1 0 0" range="-0.1 0.25" stiffness="100"/>
                 <geom name="pack" type="box" size="0.1 0.2 0.3" mass="6" friction="0.9 0.01 0.001"/>
                 <site name="top" pos="0 0 0.3333333333333333" size="0.01"/>
               </body></body>"#,
        ),
        (
            "</asset>",
            r#"<hfield name="dunes" nrow="2" ncol="3" size="4 5 0.5 0.1" elevation="0.1 0.2 0.7 0.4 0.5 0.6"/></asset>"#,
        ),
        (
            "</tendon>",
            r#"<fixed name="sum"><joint joint="right" coef="1"/><joint joint="strap" coef="-0.5"/></fixed></tendon>"#,
        ),
        (
            "</actuator>",
            r#"<position name="strap" kp="50" joint="strap" ctrlrange="-1 1" forcerange="-9 9"/>
               <motor name="sum" tendon="sum" gear="2.5"/></actuator>"#,
        ),
        ("</sensor>", r#"<jointpos name="strap" joint="strap"/></sensor>"#),
        (
            "</equality>",
            r#"<connect name="held" body1="pack" body2="world" anchor="0.1 0 0" active="false"/></equality>"#,
        ),
        ("</contact>", r#"<exclude body1="pack" body2="left"/></contact>"#),
        ("<default>", r#"<option timestep="0.001"/><statistic extent="7"/><default>"#),
    ]);
    assert_eq!(spec.compile().unwrap(), added);
    assert_eq!(added.joints[3].range, [-0.1, 0.25], "the class has degrees, a slide has meters");
}

#[test]
fn a_model_can_be_made_from_nothing() {
    let mut spec = ModelSpec::new("ball");
    spec.add_to("world", Geom::plane()).unwrap();
    spec.add_to("world", Body::new("ball").pos([0.0, 0.0, 1.0])).unwrap();
    spec.add_to("ball", Joint::free()).unwrap().add_to("ball", Geom::sphere(0.1)).unwrap();
    spec.add(Keyframe::new("low").qpos(&[0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0]).qvel(&[1.0; 6])).unwrap();
    let text = r#"<mujoco model="ball">
      <worldbody>
        <geom type="plane" size="0 0 1"/>
        <body name="ball" pos="0 0 1"><freejoint/><geom type="sphere" size="0.1"/></body>
      </worldbody>
      <keyframe><key name="low" qpos="0 0 0.1 1 0 0 0" qvel="1 1 1 1 1 1"/></keyframe>
    </mujoco>"#;
    assert_eq!(spec.compile().unwrap(), Model::from_xml_str(text, "text").unwrap());
}

#[test]
fn what_refers_to_a_removed_body_goes_with_it() {
    let mut spec = arms();
    let gone = spec.remove(Kind::Body, "left").unwrap();
    let mut expected = tags(&[
        ("camera", "at_left"),
        ("exclude", "arms"),
        ("pair", "left_floor"),
        ("weld", "hand"),
        ("touch", "left"),
        ("framepos", "left_from_right"),
    ]);
    assert_eq!(gone, expected);
    let left = by_hand(&[
        (
            r#"      <body name="left" pos="0 0.3 0" childclass="arm">
        <joint name="left" type="ball" limited="false"/>
        <geom name="left" fromto="0 0 0 0 0.3 0" type="capsule"/>
        <site name="left"/>
      </body>
"#,
            "",
        ),
        (r#"<camera name="at_left" mode="targetbody" target="left" pos="3 0 1"/>"#, ""),
        (r#"<exclude name="arms" body1="left" body2="right"/>"#, ""),
        (r#"<pair name="left_floor" geom1="left" geom2="floor"/>"#, ""),
        (r#"<weld name="hand" body1="left" body2="target"/>"#, ""),
        (r#"<touch name="left" site="left"/>"#, ""),
        (r#"<framepos name="left_from_right" objtype="body" objname="left" reftype="site" refname="right"/>"#, ""),
        (
            r#"qpos="1 2 3 1 0 0 0 0 1 0 0 0.5" qvel="1 2 3 4 5 6 7 8 9 10""#,
            r#"qpos="1 2 3 1 0 0 0 0.5" qvel="1 2 3 4 5 6 10""#,
        ),
    ]);
    assert_eq!(spec.compile().unwrap(), left);

    // a tendon goes with its joint, an actuator with its tendon, a sensor with its actuator
    let mut spec = arms();
    let gone = spec.remove(Kind::Joint, "right").unwrap();
    expected = tags(&[
        ("fixed", "pull"),
        ("motor", "pull"),
        ("general", "slow"),
        ("motor", "twist"),
        ("actuatorfrc", "pulled"),
    ]);
    assert_eq!(gone, expected);
    let model = spec.compile().unwrap();
    assert_eq!((model.nq, model.nv, model.nu, model.na, model.tendons.len()), (11, 9, 0, 0, 0));
    let start = &model.keyframes[0];
    assert_eq!(start.qpos, [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    assert_eq!((start.qvel.last(), start.ctrl.len(), start.act.len()), (Some(&9.0), 0, 0));
}

#[test]
fn removed_assets_and_everything_else_have_no_remains() {
    let mut spec = arms();
    spec.add_to("world", Geom::hfield("hills").name("hills")).unwrap();
    assert_eq!(spec.remove(Kind::HField, "hills").unwrap(), tags(&[("geom", "hills")]));
    assert_eq!(spec.remove(Kind::Site, "right").unwrap(), tags(&[("touch", "right"), ("framepos", "left_from_right")]));
    assert_eq!(spec.remove(Kind::Actuator, "pull").unwrap(), tags(&[("actuatorfrc", "pulled")]));
    for (kind, name) in [
        (Kind::Camera, "at_left"),
        (Kind::ContactExclude, "arms"),
        (Kind::ContactPair, "left_floor"),
        (Kind::Equality, "hand"),
        (Kind::Sensor, "torso"),
        (Kind::Keyframe, "short"),
        (Kind::Tendon, "pull"),
    ] {
        assert_eq!(spec.remove(kind, name).unwrap(), [""; 0], "{kind:?}");
        assert!(spec.get(kind, name).is_err(), "{kind:?}");
    }
    let model = spec.compile().unwrap();
    assert_eq!((model.hfields.len(), model.tendons.len(), model.nu, model.sensors.len()), (0, 0, 2, 1));
    assert_eq!((model.cameras.len(), model.pairs.len(), model.excludes.len(), model.keyframes.len()), (0, 1, 0, 1));
    assert_eq!(model.keyframes[0].ctrl, [13.0, 14.0]);
}

#[test]
fn a_replaced_part_stands_where_the_old_one_stood() {
    let mut spec = arms();
    assert_eq!(spec.replace("floor", Geom::hfield("hills").pos([0.0, 0.0, -1.0])).unwrap(), [""; 0]);
    assert_eq!(spec.replace("twist", Actuator::velocity("turn", 4.0).joint("right")).unwrap(), [""; 0]);
    assert_eq!(spec.replace("hills", HField::new("hills", 2, 2, [1.0; 4])).unwrap(), [""; 0]);
    let replaced = by_hand(&[
        (
            r#"<geom name="floor" type="plane" size="0 0 1"/>"#,
            r#"<geom name="floor" type="hfield" hfield="hills" pos="0 0 -1"/>"#,
        ),
        (r#"<motor name="twist" joint="right" gear="3"/>"#, r#"<velocity name="turn" kv="4" joint="right"/>"#),
        (r#"nrow="2" ncol="3" size="5 5 1 1" elevation="0 1 2 3 4 5""#, r#"nrow="2" ncol="2" size="1 1 1 1""#),
    ]);
    assert_eq!(spec.compile().unwrap(), replaced);

    // a body goes with all that it holds, but what refers to the body itself stays
    let gone = spec.replace("left", Body::new("left").pos([0.0, 0.4, 0.0])).unwrap();
    assert_eq!(gone, tags(&[("pair", "left_floor"), ("touch", "left")]));
    spec.add_to("left", Geom::sphere(0.1)).unwrap();
    let model = spec.compile().unwrap();
    assert_eq!((model.excludes.len(), model.equalities.len(), model.nq), (1, 1, 8));
    assert_eq!(model.keyframes[0].qpos, [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.5]);
}

#[test]
fn attributes_can_be_changed_and_left_to_the_class() {
    let mut spec = arms();
    spec.get_mut(Kind::Geom, "left").unwrap().set("size", 0.07).unwrap().set("rgba", [0.0, 1.0, 0.0, 0.5]).unwrap();
    spec.get_mut(Kind::Body, "left").unwrap().unset("pos").unwrap();
    spec.default_mut("arm", "joint").unwrap().set("damping", 3.0).unwrap().unset("range").unwrap();
    spec.default_mut("main", "geom").unwrap().set("density", 250.0).unwrap();
    let mut floor = spec.find_mut(Kind::Geom, |geom| geom.get("type") == Some("plane")).unwrap();
    assert_eq!(floor.view().numbers("size"), Some(vec![0.0, 0.0, 1.0]));
    floor.set("name", "ground").unwrap();
    spec.get_mut(Kind::Body, "left").unwrap().set("name", "wing").unwrap();
    spec.get_mut(Kind::Site, "right").unwrap().set("name", "hand").unwrap();
    let changed = by_hand(&[
        (r#"<geom name="left" fromto"#, r#"<geom name="left" size="0.07" rgba="0 1 0 0.5" fromto"#),
        (r#"<body name="left" pos="0 0.3 0""#, r#"<body name="wing""#),
        (r#"<joint damping="2" range="-90 90"/>"#, r#"<joint damping="3"/>"#),
        (r#"density="500""#, r#"density="250""#),
        (r#"<geom name="floor""#, r#"<geom name="ground""#),
        (r#"geom1="left" geom2="floor""#, r#"geom1="left" geom2="ground""#),
        (r#"geom1="right" geom2="floor""#, r#"geom1="right" geom2="ground""#),
        (r#"target="left""#, r#"target="wing""#),
        (r#"body1="left" body2="right""#, r#"body1="wing" body2="right""#),
        (r#"body1="left" body2="target""#, r#"body1="wing" body2="target""#),
        (
            r#"objtype="body" objname="left" reftype="site" refname="right""#,
            r#"objtype="body" objname="wing" reftype="site" refname="hand""#,
        ),
        (r#"<site name="right"/>"#, r#"<site name="hand"/>"#),
        (r#"<touch name="right" site="right"/>"#, r#"<touch name="right" site="hand"/>"#),
    ]);
    assert_eq!(spec.compile().unwrap(), changed);
}

#[test]
fn keyframes_keep_their_meaning() {
    let mut spec = arms();
    // a hinge before the other one, a free body before the mocap body, which was the second and becomes the third
    spec.add_to("left", Body::new("hand")).unwrap();
    spec.add_to("hand", Joint::hinge([1.0, 0.0, 0.0]).set("ref", 90.0))
        .unwrap()
        .add_to("hand", Geom::sphere(0.1))
        .unwrap();
    spec.add_first_to("world", Body::new("crate").pos([7.0, 8.0, 9.0])).unwrap();
    spec.add_to("crate", Joint::free()).unwrap().add_to("crate", Geom::sphere(0.1)).unwrap();
    spec.add_first_to("world", Body::new("other").set("mocap", true).pos([0.5, 0.0, 0.0])).unwrap();
    let model = spec.compile().unwrap();
    let start = &model.keyframes[0];
    let free = [7.0, 8.0, 9.0, 1.0, 0.0, 0.0, 0.0];
    let turned = std::f64::consts::FRAC_PI_2;
    let rest = [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, turned, 0.5];
    assert_eq!(start.qpos, [&free[..], &rest].concat());
    let qvel: Vec<f64> = [&[0.0; 6][..], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 0.0, 10.0]].concat();
    assert_eq!(start.qvel, qvel);
    assert_eq!(start.mpos, [[0.5, 0.0, 0.0], [4.0, 5.0, 6.0]]);
    assert_eq!(start.mquat, [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]);
    assert_eq!(model.keyframes[1].qpos[..10], [7.0, 8.0, 9.0, 1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);

    // a joint of another type has other numbers, an actuator with an activation has one more
    spec.get_mut(Kind::Joint, "left").unwrap().set("type", "hinge").unwrap();
    spec.remove(Kind::Actuator, "pull").unwrap();
    spec.get_mut(Kind::Actuator, "slow").unwrap().set("dyntype", "none").unwrap();
    spec.add(Actuator::general("fast").joint("right").set("dyntype", "filter").set("dynprm", 0.1)).unwrap();
    let model = spec.compile().unwrap();
    let start = &model.keyframes[0];
    let rest = [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0, turned, 0.5];
    assert_eq!(start.qpos, [&free[..], &rest].concat());
    assert_eq!((&start.ctrl[..], &start.act[..]), (&[13.0, 14.0, 0.0][..], &[0.0][..]));
    spec.remove(Kind::Body, "target").unwrap();
    assert_eq!(spec.compile().unwrap().keyframes[0].mpos, [[0.5, 0.0, 0.0]]);
}

#[test]
fn a_model_written_back_compiles_to_the_same_bits() {
    let folder = workspace().join("crates/physics/tests/models/mjcf");
    let features = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let files = shipped().into_iter().chain(features.filter(|path| path.extension().is_some_and(|e| e == "xml")));
    let mut compiled = 0;
    for file in files {
        let Ok(model) = Model::from_xml_file(&file) else { continue };
        let spec = ModelSpec::from_xml_file(&file).unwrap();
        let read = |name: &str| std::fs::read(file.parent().unwrap().join(name)).map_err(|e| e.to_string());
        if spec.to_xml().contains(" masses=\"") {
            // no file can say this: see `attached_models`
            continue;
        }
        let again = ModelSpec::from_xml_str_with(&spec.to_xml(), "written", &read).unwrap();
        assert_eq!(again.compile_with(&read).unwrap(), model, "{}", file.display());
        assert_eq!(spec.compile().unwrap(), model, "{}", file.display());
        assert_eq!(again.to_xml(), spec.to_xml());
        compiled += 1;
    }
    assert!(compiled > 30, "{compiled} models");

    let odd = "a&b <c> \"d\" 'e'\tf\ng";
    let mut spec = arms();
    spec.get_mut(Kind::Geom, "torso").unwrap().set("name", odd).unwrap();
    let again = ModelSpec::from_xml_str(&spec.to_xml(), "written").unwrap();
    assert_eq!(again.get(Kind::Geom, odd).unwrap().name(), Some(odd));
    assert_eq!(again.compile().unwrap(), spec.compile().unwrap());
}

#[test]
fn a_wrong_name_comes_with_the_nearest_one_and_changes_nothing() {
    let mut spec = arms();
    let before = spec.to_xml();
    let error = |result: Result<(), MjcfError>| result.unwrap_err().to_string();
    let mut check = |edit: &dyn Fn(&mut ModelSpec) -> Result<(), MjcfError>, expected: &str| {
        assert_eq!(error(edit(&mut spec)), expected);
        assert_eq!(spec.to_xml(), before, "{expected}");
    };
    check(&|s| s.get(Kind::Body, "tors").map(|_| ()), "arms.xml: there is no body 'tors'; did you mean 'torso'?");
    check(
        &|s| s.get(Kind::HField, "hill").map(|_| ()),
        "arms.xml: there is no height field 'hill'; did you mean 'hills'?",
    );
    check(
        &|s| s.add_to("wrold", Geom::sphere(1.0)).map(|_| ()),
        "arms.xml: there is no body 'wrold'; did you mean 'world'?",
    );
    check(
        &|s| s.remove(Kind::Actuator, "twits").map(|_| ()),
        "arms.xml: there is no actuator 'twits'; did you mean 'twist'?",
    );
    check(&|s| s.section_mut("optoin").map(|_| ()), "arms.xml: there is no section 'optoin'; did you mean 'option'?");
    check(
        &|s| s.default_mut("arn", "geom").map(|_| ()),
        "arms.xml: there is no default class 'arn'; did you mean 'arm'?",
    );
    check(
        &|s| s.default_mut("arm", "geon").map(|_| ()),
        "arms.xml: there is no default of class 'arm' for 'geon'; did you mean 'geom'?",
    );
    check(
        &|s| s.get_mut(Kind::Geom, "torso")?.unset("siez").map(|_| ()),
        "arms.xml:11: <geom name=\"torso\">: the attribute 'siez' is not given; did you mean 'size'?",
    );
    check(
        &|s| s.get_mut(Kind::Geom, "floor")?.set("siez", 1.0).map(|_| ()),
        "arms.xml:8: <geom name=\"floor\"> has no attribute 'siez'; did you mean 'size'?",
    );
    check(
        &|s| s.add(Sensor::new("tuoch", "x").set("site", "left")).map(|_| ()),
        "arms.xml: <tuoch name=\"x\"> is not an element of <sensor>; did you mean 'touch'?",
    );
    check(
        &|s| s.add(Actuator::motor("x").set("geer", 1.0)).map(|_| ()),
        "arms.xml: <motor name=\"x\"> has no attribute 'geer'; did you mean 'gear'?",
    );
    check(
        &|s| s.replace("floor", Geom::sphere(1.0).set("siez", 1.0)).map(|_| ()),
        "arms.xml:8: <geom name=\"floor\"> has no attribute 'siez'; did you mean 'size'?",
    );
    type Edit = fn(&mut ModelSpec) -> Result<(), MjcfError>;
    let doubled: [Edit; 4] = [
        |s| s.add_to("torso", Body::new("left")).map(|_| ()),
        |s| s.add_to("torso", Body::new("world")).map(|_| ()),
        |s| s.get_mut(Kind::Geom, "left")?.set("name", "right").map(|_| ()),
        |s| s.replace("slow", Actuator::motor("pull")).map(|_| ()),
    ];
    for edit in doubled {
        let text = error(edit(&mut spec));
        assert!(text.contains("there is already a"), "{text}");
    }
    let text = error(spec.remove(Kind::Body, "world").map(|_| ()));
    assert!(text.contains("the world cannot be removed"), "{text}");
    let text = error(spec.get_mut(Kind::Geom, "left").unwrap().set("name", "a\u{1}b").map(|_| ()));
    assert!(text.contains("a text without control characters"), "{text}");
    assert_eq!(spec.to_xml(), before);

    // values are checked when the model is compiled
    spec.add_to("torso", Geom::sphere(f64::NAN).name("bad")).unwrap();
    let text = error(spec.compile().map(|_| ()));
    assert!(text.contains("<geom name=\"bad\"> attribute 'size' is 'NaN'; expected"), "{text}");
}

#[test]
fn an_edited_model_keeps_to_the_budget() {
    let mut spec = ModelSpec::new("large");
    for i in 0..100 {
        spec.add(Sensor::new("user", &format!("sensor {i}")).set("dim", 100_000)).unwrap();
    }
    let error = spec.compile().unwrap_err().to_string();
    assert!(error.contains("the limit 'memory' is 2 GB"), "{error}");

    let mut spec = ModelSpec::new("deep");
    let error = (0..1000).find_map(|i| {
        let parent = if i == 0 { "world".to_owned() } else { format!("b{}", i - 1) };
        spec.add_to(&parent, Body::new(&format!("b{i}"))).err()
    });
    assert!(error.is_some_and(|e| e.to_string().contains("nested more than 200 deep")));
    assert!(ModelSpec::from_xml_str(&spec.to_xml(), "deep").is_ok());
}

#[test]
fn meshes_are_parts() {
    let points = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let mut spec = ModelSpec::new("wedge");
    spec.add(Mesh::points("wedge", &points).scale([0.1, 0.1, 0.2])).unwrap();
    spec.add_to("world", Body::new("b")).unwrap();
    spec.add_to("b", Joint::free()).unwrap();
    spec.add_to("b", Geom::mesh("wedge").name("g")).unwrap();
    let model = spec.compile().unwrap();
    assert_eq!((model.meshes.len(), model.hulls[0].polygons.len(), model.geoms[0].hull), (1, 4, Some(0)));
    assert!((model.bodies[1].mass - 1000.0 * 0.002 / 6.0).abs() < 1e-9);
    let written = Model::from_xml_str(&spec.to_xml(), "wedge").unwrap();
    assert!(written == model);
    assert_eq!(spec.remove(Kind::Mesh, "wedge").unwrap(), ["<geom name=\"g\">"]);
}
