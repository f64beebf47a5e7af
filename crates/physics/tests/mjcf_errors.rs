//! A mistake in a model file is reported with its file, line, element and attribute, and with the nearest valid name.
//!
//! Unsupported elements that would change the dynamics are refused in the same way. Nothing is skipped silently. Each
//! row below is a model with one mistake, and the required parts of the message.

#[cfg(unix)]
use crate::common;
use crate::refusal::{self, check, in_body, message, with_section};
use marathon_physics::Model;
use marathon_physics::mjcf::MjcfErrorKind;

#[test]
fn misspelled_names_come_with_the_nearest_valid_one() {
    check("<mujoco><compilr/></mujoco>", &["bad.xml:1:", "<compilr>", "<mujoco>", "did you mean 'compiler'?"]);
    check("<mujoco>\n\n<compiler angel='radian'/></mujoco>", &["bad.xml:3:", "'angel'", "did you mean 'angle'?"]);
    check(&in_body("<goem size='1'/>"), &["bad.xml:5:", "<goem>", "<body>", "did you mean 'geom'?"]);
    check(&in_body("<geom name='foot' siez='1'/>"), &["bad.xml:5:", "<geom name=\"foot\">", "did you mean 'size'?"]);
    check(&in_body("<joint tpye='ball'/>"), &["did you mean 'type'?"]);
    check(&in_body("<geom size='1' type='capsul'/>"), &["'type' is 'capsul'", "did you mean 'capsule'?"]);
    check("<mujoco><option><flag gravty='enable'/></option></mujoco>", &["<flag>", "did you mean 'gravity'?"]);
    check("<mujoco><option integrator='euler'/></mujoco>", &["one of Euler, RK4", "did you mean 'Euler'?"]);
    check("<mujoco><default><jont/></default></mujoco>", &["<jont>", "<default>", "did you mean 'joint'?"]);
    check("<mujoco><default><geom name='a'/></default></mujoco>", &["<geom name=\"a\"> has no attribute 'name'"]);
    check("<mujoco><visual><map zner='1'/></visual></mujoco>", &["did you mean 'znear'?"]);
    // nothing similar: no suggestion
    assert!(!message("<mujoco><xyzzyplugh/></mujoco>").contains("did you mean"));
}

#[test]
fn references_must_exist() {
    check(&in_body("<geom size='1' class='leg'/>"), &["bad.xml:5:", "'class': there is no default class 'leg'"]);
    check("<mujoco><worldbody><body childclass='x'/></worldbody></mujoco>", &["'childclass'", "default class 'x'"]);
    check(&in_body("<geom size='1' material='grid'/>"), &["there is no material 'grid'"]);
    let section = "<actuator>\n<motor name='m' joint='hip'/></actuator>";
    check(&with_section(section), &["<motor name=\"m\"> attribute 'joint': there is no joint 'hip'"]);
    check(&with_section("<actuator><motor/></actuator>"), &["<motor>: the attribute 'joint' is missing"]);
    check(&with_section("<sensor><gyro site='t'/></sensor>"), &["there is no site 't'", "did you mean 's'?"]);
    check(&with_section("<sensor><framepos objtype='geom' objname='h'/></sensor>"), &["there is no geom 'h'"]);
    check(&with_section("<sensor><framepos objname='g'/></sensor>"), &["'objtype' is missing"]);
    check(&with_section("<sensor><tendonpos tendon='t'/></sensor>"), &["there is no tendon 't'"]);
    check(&with_section("<contact><pair geom1='g' geom2='h'/></contact>"), &["'geom2': there is no geom 'h'"]);
    check(&with_section("<contact><exclude body1='b' body2='c'/></contact>"), &["'body2': there is no body 'c'"]);
    check(&in_body("<camera mode='targetbody' target='c'/>"), &["'target': there is no body 'c'"]);
}

#[test]
fn names_must_be_unique() {
    check(&in_body("<geom name='g' size='1'/>"), &["bad.xml:5:", "there is already a geom of this name"]);
    check(&in_body("<body name='world'/>"), &["there is already a body of this name"]);
    check(&with_section("<sensor><clock name='a'/><clock name='a'/></sensor>"), &["already a sensor"]);
    let classes = "<default><default class='a'/>\n<default class='a'/></default>";
    check(&format!("<mujoco>{classes}</mujoco>"), &["bad.xml:2:", "the default class 'a' is already defined"]);
    check(
        "<mujoco><default class='x'/></mujoco>",
        &["the outermost default class is 'x'; expected no 'class', or 'main'"],
    );
    check("<mujoco><default><default/></default></mujoco>", &["a nested default needs the attribute 'class'"]);
}

#[test]
fn numbers_must_be_numbers_and_as_many_as_needed() {
    check(&in_body("<geom size='1 x'/>"), &["bad.xml:5:", "'size' is '1 x'; expected up to 3 numbers"]);
    check(&in_body("<geom size='1,2'/>"), &["expected up to 3 numbers"]);
    check(&in_body("<geom size='nan'/>"), &["'size' is 'nan'"]);
    check(&in_body("<geom size='1e999'/>"), &["'size' is '1e999'"]);
    check(&in_body("<geom size='1 2 3 4'/>"), &["up to 3 numbers, but there are 4"]);
    check(&in_body("<geom size='1' pos='1 2'/>"), &["'pos' is '1 2'; expected 3 numbers, but there are 2"]);
    check(&in_body("<geom size='1' condim='3.0'/>"), &["'condim' is '3.0'; expected an integer"]);
    check(&in_body("<geom size='1' contype='99999999999'/>"), &["expected an integer"]);
    check(&in_body("<joint limited='yes'/>"), &["'limited' is 'yes'; expected one of false, true, auto"]);
    check("<mujoco><option timestep='-1'/></mujoco>", &["expected a number greater than zero"]);
    check("<mujoco><compiler eulerseq='xyw'/></mujoco>", &["'eulerseq' is 'xyw'; expected three letters"]);
    check("<mujoco><statistic extent='0'/></mujoco>", &["'extent' is '0'; expected a number greater than zero"]);
    // a mistake in a class is found even if no element uses the class
    check("<mujoco><default>\n<joint axis='1 2'/></default></mujoco>", &["bad.xml:2:", "expected 3 numbers"]);
    check("<mujoco><default>\n<geom solref='a'/></default></mujoco>", &["bad.xml:2:", "expected up to 2 numbers"]);
    check("<mujoco><default><motor gear='a'/></default></mujoco>", &["expected up to 6 numbers"]);
    check(&with_section("<keyframe><key qpos='1 2'/></keyframe>"), &["'qpos' is '1 2'; expected a number"]);
}

#[test]
fn contradictions() {
    check(
        &with_section("<keyframe><key act='1'/></keyframe>"),
        &["'act' is '1'; expected no numbers: the model has none"],
    );
    check(&with_section("<keyframe><key mpos='1 2 3'/></keyframe>"), &["expected no numbers: the model has none"]);
    check(&in_body("<camera fovy='30' sensorsize='1 1'/>"), &["there are both 'fovy' and 'sensorsize'"]);
    check(&in_body("<camera focal='1 1'/>"), &["need a 'sensorsize'"]);
    check(&in_body("<camera sensorsize='1 1' focal='1 1' resolution='0 9'/>"), &["resolution is 0 x 9"]);
    check(&in_body("<geom size='1' quat='1 0 0 0' euler='0 0 0'/>"), &["only one orientation", "quat and euler"]);
    check(&in_body("<geom size='1' quat='0 0 0 0'/>"), &["'quat' is '0 0 0 0'; expected a quaternion"]);
    check(&in_body("<geom size='1' xyaxes='1 0 0 2 0 0'/>"), &["expected a y axis"]);
    check(&in_body("<geom size='1' fromto='0 0 0 1 0 0'/>"), &["'fromto' requires a capsule"]);
    check(&in_body("<geom type='capsule' size='1' fromto='1 1 1 1 1 1'/>"), &["coincide"]);
    check(&in_body("<geom type='capsule' size='1'/>"), &["size 2 of 2 is 0; it must be greater than zero"]);
    check(&in_body("<geom/>"), &["size 1 of 1 is 0"]);
    check(&in_body("<geom size='1' condim='2'/>"), &["condim is 2; expected 1, 3, 4 or 6"]);
    check(&in_body("<geom size='1' mass='-1'/>"), &["must not be negative"]);
    check(&in_body("<geom type='plane' size='1 1 1'/>"), &["a plane must belong to the world"]);
    check(&in_body("<joint axis='0 0 0'/>"), &["the axis is shorter"]);
    check(&in_body("<joint limited='true' range='1 0'/>"), &["'range' goes from"]);
    check(&in_body("<joint limited='true'/>"), &["'range' goes from 0 to 0"]);
    check(&in_body("<joint type='free'/>"), &["a free joint must be the only joint"]);
    check(&in_body("<body><freejoint/></body>"), &["only in a child of the world"]);
    check(&in_body("<body mocap='true'/>"), &["a mocap body must be a child of the world"]);
    check(&in_body("<joint/><joint/><joint/><joint/><joint/><joint/>"), &["bad.xml:3:", "at most 6 degrees", "not 7"]);
    check(&in_body("<inertial pos='0 0 0' mass='1' diaginertia='1 1 3'/>"), &["bad.xml:5:", "balanceinertia"]);
    check(&in_body("<inertial mass='1' diaginertia='1 1 1'/>"), &["<inertial>: the attribute 'pos' is missing"]);
    let twice = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>".repeat(2);
    check(&in_body(&twice), &["already has an <inertial>"]);
    check(
        "<mujoco><worldbody><body name='x'><joint/></body></worldbody></mujoco>",
        &["<body name=\"x\">", "needs mass"],
    );
    check("<mujoco><worldbody><joint/></worldbody></mujoco>", &["the world cannot have joints"]);
    check("<mujoco><worldbody name='x'/></mujoco>", &["<worldbody name=\"x\"> has no attribute 'name'"]);
    let strict = in_body("<body><joint range='0 1'/></body>")
        .replace("<worldbody>", "<compiler autolimits='false'/><worldbody>");
    check(&strict, &["there is 'range' but not 'limited'", "autolimits is false"]);
    let motor = "<actuator><motor joint='j' ctrllimited='true' ctrlrange='1 -1'/></actuator>";
    check(&with_section(motor), &["'ctrlrange' goes from 1 to -1"]);
    check(&with_section("<actuator><position joint='j' kv='-1'/></actuator>"), &["kv must not be negative"]);
    check(&with_section("<custom><numeric name='a'/></custom>"), &["there are no numbers"]);
    check(&with_section("<custom><numeric name='a' data='1 2' size='1'/></custom>"), &["expected an integer from 2"]);
}

#[test]
fn what_is_not_supported_is_refused_by_name() {
    for (content, parts) in [
        ("<geom size='1' adhesion='2'/>", &["attribute 'adhesion'", "'2' is not supported, only '0'"][..]),
        ("<geom size='1' shellinertia='true'/>", &["attribute 'shellinertia'", "only 'false'"]),
        ("<geom type='sdf'/>", &["<geom> attribute 'type'", "signed distance fields are not supported"]),
        ("<geom size='1'><plugin/></geom>", &["plugins are not supported"]),
        ("<joint springyield='1'/>", &["attribute 'springyield'"]),
        ("<composite/>", &["<composite>"]),
        ("<attach/>", &["<attach>"]),
        ("<flexcomp/>", &["<flexcomp>"]),
        ("<frame scale='2'/>", &["attribute 'scale'", "only '1'"]),
    ] {
        check(&in_body(content), &[&["bad.xml:5:"], parts].concat());
    }
    for (section, parts) in [
        ("<equality><flex flex='b'/></equality>", &["<flex>: deformable bodies are not supported"][..]),
        ("<tendon><spatial springyield='1'/></tendon>", &["<spatial> attribute 'springyield'"]),
        ("<deformable><flex/></deformable>", &["<flex>: deformable bodies"]),
        ("<extension><plugin><instance/></plugin></extension>", &["plugins are not supported"]),
        ("<actuator><muscle joint='j'/></actuator>", &["<muscle> attribute 'lengthrange'", "give two numbers"]),
        ("<actuator><motor joint='j' delay='.1' nsample='2'/></actuator>", &["<motor> attribute 'delay'", "only '0'"]),
        ("<actuator><pid joint='j'/></actuator>", &["<pid>: only the actuators motor"]),
        (
            "<actuator><general joint='j' dyntype='dcmotor'/></actuator>",
            &["attribute 'dyntype'", "only none, integrator"],
        ),
        ("<actuator><general joint='j' gaintype='user'/></actuator>", &["attribute 'gaintype'"]),
        ("<keyframe><key plastic='1'/></keyframe>", &["<key> attribute 'plastic'"]),
        ("<option actuatorgroupdisable='1'/>", &["<option> attribute 'actuatorgroupdisable'"]),
        ("<option integrator='discrete'/>", &["'discrete' is not supported; use Euler or RK4"]),
        ("<option><flag speculative='enable'/></option>", &["<flag> attribute 'speculative'", "only 'disable'"]),
        ("<compiler coordinate='global'/>", &["global coordinates are not supported"]),
        ("<compiler fusestatic='true'/>", &["attribute 'fusestatic'"]),
        ("<contact><pair geom1='g' geom2='g' solreffriction='1 1'/></contact>", &["attribute 'solreffriction'"]),
    ] {
        check(&with_section(section), parts);
        assert!(
            Model::from_xml_str(&with_section(section), "bad.xml").is_err_and(|e| e.line >= 7),
            "line of {section}"
        );
    }
    let error = Model::from_xml_str(&with_section("<equality><flex/></equality>"), "bad.xml").unwrap_err();
    assert!(matches!(error.kind, MjcfErrorKind::Unsupported { attribute: None, .. }));
}

/// Settings that only matter together with others are refused where those are present.
#[test]
fn copies() {
    let nested = "<replicate count='1000'>".repeat(4) + "<geom size='1'/>" + &"</replicate>".repeat(4);
    for (content, parts) in [
        ("<replicate offset='1 0 0'/>", &["<replicate>", "the attribute 'count' is missing"][..]),
        ("<replicate count='-1'/>", &["<replicate>", "'count' is negative"]),
        ("<replicate count='two'/>", &["attribute 'count'", "'two'"]),
        ("<replicate count='2' ofset='1 0 0'/>", &["attribute 'ofset'", "'offset'"]),
        ("<replicate count='2' offset='1 0'/>", &["attribute 'offset'"]),
        ("<replicate count='2'><joint/></replicate>", &["<joint>", "put it into a <body>"]),
        ("<replicate count='2'><geom size='1' sise='2'/></replicate>", &["attribute 'sise'", "'size'"]),
        (&nested, &["<geom>", "the model asks for"]),
    ] {
        check(&in_body(content), &[&["bad.xml:5:"], parts].concat());
    }
    // a constraint that also refers to other things is not copied, and the name without a number is gone
    let xml = "<mujoco><worldbody><replicate count='2'><body name='a'><geom size='1'/></body></replicate>
        <body name='b'><geom size='1'/></body></worldbody><equality><connect body1='a' body2='b' anchor='0 0 0'/></equality></mujoco>";
    check(xml, &["there is no body 'a'", "'a0'"]);
}

/// Bodies never sleep here, so only the policy that starts asleep changes the motion.
#[test]
fn sleep() {
    let xml = |flag: &str, policy: &str| {
        let option = format!("<option sleep_tolerance='1e-3'><flag sleep='{flag}'/></option>");
        with_section(&option).replace("<body name=\"b\">", &format!("<body name=\"b\" sleep=\"{policy}\">"))
    };
    for policy in ["auto", "never", "allowed"] {
        assert!(Model::from_xml_str(&xml("enable", policy), "good.xml").is_ok());
    }
    assert!(Model::from_xml_str(&xml("disable", "init"), "good.xml").is_ok());
    check(&xml("enable", "init"), &["bad.xml:3: <body name=\"b\"> attribute 'sleep': 'init' is not supported"]);
    check(&xml("enable", "alowed"), &["'sleep' is 'alowed'", "did you mean 'allowed'?"]);
    check(
        &in_body("<body sleep='never'><joint/><geom size='1'/></body>"),
        &["bad.xml:5:", "'sleep' belongs to a body"],
    );
}

#[test]
fn what_is_not_supported_together() {
    let meshes = |geom: &str| {
        with_section("<asset><mesh name='m' file='m.obj'/></asset>")
            .replace("<joint name=", &format!("{geom}<joint name="))
    };
    // a file may be missing if its mesh is only seen
    let refused = &["bad.xml:8:", "mesh file 'm.obj': a model given as text has no other files"];
    check(&meshes("<geom type='mesh' mesh='m'/>"), refused);
    check(&meshes("<geom type='mesh' mesh='m' contype='0' conaffinity='0'/>"), refused);
    check(&meshes("<geom type='mesh' mesh='m' mass='0'/>"), refused);
    check(&meshes("<geom type='box' mesh='m' contype='0' conaffinity='0' mass='0'/>"), refused);
    let shown = meshes("<geom name='m' type='mesh' mesh='m' contype='0' conaffinity='0' mass='0'/>");
    assert!(Model::from_xml_str(&shown, "good.xml").is_ok());
    let pair = shown.replace("<asset>", "<contact><pair geom1='g' geom2='m'/></contact><asset>");
    check(&pair, &["<pair>: geom 'm' collides, but the file of its mesh is missing"]);
}

#[test]
fn height_fields() {
    let files = |name: &str| match name {
        "maps/short.bin" => Ok(vec![2, 0, 0, 0, 2, 0, 0, 0, 0]),
        "maps/huge.bin" => Ok([[255, 255, 255, 127], [255, 255, 255, 127]].concat()),
        "maps/nan.bin" => Ok([2i32, 2, -1, -1, -1, -1].map(i32::to_le_bytes).concat()),
        "maps/bad.png" => Ok(b"not an image".to_vec()),
        _ => Err("no such file".to_owned()),
    };
    let mistake = |hfield: &str, geom: &str, parts: &[&str]| {
        let xml = format!(
            "<mujoco><compiler assetdir='maps/'/>\n<asset>{hfield}</asset>\n<worldbody>{geom}</worldbody></mujoco>"
        );
        refusal::names(&xml, &files, parts);
    };
    let good = "<hfield name='h' nrow='2' ncol='2' size='1 1 1 1'/>";
    mistake("<hfield name='h' nrow='2' ncol='2'/>", "", &["bad.xml:2:", "the attribute 'size' is missing"]);
    mistake("<hfield name='h' nrow='2' ncol='2' size='1 1 0 1'/>", "", &["must be greater than zero"]);
    mistake("<hfield name='h' nrow='2' size='1 1 1 1'/>", "", &["'file' or a positive 'ncol' is missing"]);
    mistake("<hfield name='h' nrow='1' ncol='9' size='1 1 1 1'/>", "", &["at least 2 rows and columns, not 1 x 9"]);
    mistake("<hfield name='h' nrow='99999' ncol='99999' size='1 1 1 1'/>", "", &["a grid has at most"]);
    mistake("<hfield name='h' nrow='2' ncol='2' size='1 1 1 1' elevation='1 2 3'/>", "", &["expected 4 numbers"]);
    mistake("<hfield nrow='2' ncol='2' size='1 1 1 1'/>", "", &["the attribute 'name' is missing"]);
    mistake(&good.repeat(2), "", &["already a height field of this name"]);
    let file = |name: &str| format!("<hfield name='h' file='{name}' size='1 1 1 1'/>");
    mistake(&file("none.bin"), "", &["bad.xml:2:", "cannot read the file", "'maps/none.bin': no such file"]);
    mistake(&file("short.bin"), "", &["2 x 2 elevations take 24 bytes, but there are 9"]);
    mistake(&file("huge.bin"), "", &["a grid has at most"]);
    mistake(&file("nan.bin"), "", &["an elevation is not a finite number"]);
    mistake(&file("bad.png"), "", &["'maps/bad.png'"]);
    mistake(good, "<geom type='hfield'/>", &["bad.xml:3:", "needs the attribute 'hfield'"]);
    mistake(good, "<geom type='hfield' hfield='g'/>", &["there is no height field 'g'", "did you mean 'h'?"]);
    mistake(good, "<geom size='1' hfield='h'/>", &["'hfield' needs type=\"hfield\""]);
    mistake(good, "<site type='hfield'/>", &["a site cannot be a plane, a height field or a mesh"]);
}

#[test]
fn settings_without_effect_are_accepted() {
    for content in [
        "<geom size='1' adhesion='0' surfacevel='0 0 0 0 0 0' shellinertia='false' user='1 2' castshadow='false'/>",
        "<joint axis='1 0 0' damping='1 0 0' springyield='0' actuatorgravcomp='false'/>",
        "<body gravcomp='0.0'><geom size='1' fluidshape='ellipsoid'/></body>",
    ] {
        Model::from_xml_str(&in_body(content), "good.xml").unwrap();
    }
    for section in [
        "<option density='0' solver='PGS' jacobian='sparse' wind='1 0 0' o_margin='1' noslip_iterations='0' noslip_tolerance='0'/>",
        "<tendon><fixed><joint joint='j' coef='1'/></fixed></tendon><equality/><deformable/>",
        "<asset><mesh name='unused' file='a.stl'/><texture type='2d' builtin='checker'/></asset>",
        "<actuator><general joint='j' dyntype='none' actlimited='false' delay='0'/></actuator>",
    ] {
        Model::from_xml_str(&with_section(section), "good.xml").unwrap();
    }
}

/// An extension: where there is no site of that name, a touch sensor may name a geom.
#[test]
fn a_touch_sensor_may_name_a_geom() {
    use marathon_physics::model::{SensorObject, SensorType};
    let xml = with_section("<sensor><touch site='g'/><touch site='s'/></sensor>");
    let model = Model::from_xml_str(&xml, "touch.xml").unwrap();
    assert_eq!(model.sensors[0].kind, SensorType::Touch);
    assert_eq!(model.sensors[0].object, SensorObject::Geom(0));
    assert_eq!(model.sensors[1].object, SensorObject::Site(0));
}

#[test]
fn broken_files() {
    check("", &["bad.xml:1:", "not well-formed XML"]);
    check("<mujoco>\n<worldbody>\n</mujoco>", &["bad.xml:3:", "not well-formed XML"]);
    check("<robot/>", &["the top-level element is <robot>; expected <mujoco>"]);
    check("<!DOCTYPE x [<!ENTITY a 'b'>]><mujoco model='&a;'/>", &["not well-formed XML"]);
    // MuJoCo's parser reads on behind these, and so does this one
    let world = "<worldbody><!-\\- a -\\-><geom name='a'size='1'/></worldbody>";
    assert!(
        Model::from_xml_str(&format!("<!DOCTYPE mujoco>\n<mujoco>{world}</mujoco>\n</mujoco>\n"), "good.xml").is_ok()
    );
    check(&format!("<mujoco>{world}</mujoco>\n<mujoco/>"), &["bad.xml:2:", "not well-formed XML"]);
    let deep = format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", "<body>".repeat(5000), "</body>".repeat(5000));
    check(&deep, &["nested more than"]);
    let missing = Model::from_xml_file("no/such/model.xml").unwrap_err().to_string();
    assert!(missing.starts_with("no/such/model.xml: cannot read the file:"), "{missing}");
}

#[test]
fn includes() {
    let files = |name: &str| match name {
        "parts/a.xml" => Ok("<mujoco><include file='b.xml'/></mujoco>".to_owned()),
        "parts/b.xml" => Ok("<mujoco><option timestep='0.5'/>\n<compiler angel='radian'/></mujoco>".to_owned()),
        "parts/c.xml" => Ok("<mujocoinclude><option timestep='0.5'/></mujocoinclude>".to_owned()),
        "loop.xml" => Ok("<mujoco><include file='./loop.xml'/></mujoco>".to_owned()),
        "empty.xml" => Ok("<mujoco/>".to_owned()),
        _ => Err("no such file".to_owned()),
    };
    let load = |file: &str| {
        let xml = format!("<mujoco>\n<include file='{file}'/>\n</mujoco>");
        Model::from_xml_str_with(&xml, "main.xml", &|name| files(name).map(String::into_bytes))
            .map_err(|e| e.to_string())
    };
    assert_eq!(load("parts/c.xml").unwrap().opt.timestep, 0.5);
    assert_eq!(load("parts/../parts/./c.xml").unwrap().opt.timestep, 0.5);
    for (file, parts) in [
        // the error names the included file, which was found next to the file that includes it
        ("parts/a.xml", &["parts/b.xml:2:", "did you mean 'angle'?"][..]),
        ("missing.xml", &["main.xml:2:", "'missing.xml'", "no such file"]),
        ("loop.xml", &["loop.xml:1:", "'loop.xml' is already included"]),
        ("empty.xml", &["main.xml:2:", "'empty.xml' contains no elements"]),
    ] {
        let message = load(file).unwrap_err();
        for part in parts {
            assert!(message.contains(part), "'{part}' is missing in {message}");
        }
    }
    check("<mujoco><include file='a.xml'/></mujoco>", &["a model given as text has no other files"]);
    check("<mujoco><include/></mujoco>", &["the attribute 'file' is missing"]);
}

/// A device or a pipe may never end, so it is not read.
#[cfg(unix)]
#[test]
fn what_is_no_file_is_not_read() {
    let folder = common::scratch("no-files");
    std::fs::create_dir_all(folder.join("folder")).unwrap();
    let made = std::process::Command::new("mkfifo").arg(folder.join("pipe")).status().unwrap();
    assert!(made.success());
    let main = folder.join("main.xml");
    for name in ["pipe", "folder", "/dev/null"] {
        for text in [
            format!("<mujoco><include file='{name}'/></mujoco>"),
            format!("<mujoco><asset><hfield name='h' file='{name}' size='1 1 1 1'/></asset></mujoco>"),
        ] {
            std::fs::write(&main, &text).unwrap();
            let (done, wait) = std::sync::mpsc::channel();
            let path = main.clone();
            std::thread::spawn(move || done.send(Model::from_xml_file(path).map(|_| ()).map_err(|e| e.to_string())));
            let result = wait.recv_timeout(std::time::Duration::from_secs(20)).expect("it does not wait for ever");
            let message = result.expect_err("an error");
            assert!(message.contains("expected a regular file"), "{text}: {message}");
        }
    }
    for name in ["pipe", "folder"].map(|name| folder.join(name)).into_iter().chain(["/dev/zero".into()]) {
        let (done, wait) = std::sync::mpsc::channel();
        std::thread::spawn(move || done.send(Model::from_xml_file(name).map(|_| ()).map_err(|e| e.to_string())));
        let result = wait.recv_timeout(std::time::Duration::from_secs(20)).expect("it does not wait for ever");
        let message = result.expect_err("an error");
        assert!(message.contains("cannot read the file: found a "), "{message}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// An unsupported default is refused where an element uses it, and only there.
#[test]
fn unsupported_defaults_are_refused_where_they_are_used() {
    let with = |default: &str, body: &str, rest: &str| {
        in_body(body)
            .replace("<worldbody>", &format!("<default>{default}</default><worldbody>"))
            .replace("</worldbody>", &format!("</worldbody>{rest}"))
    };
    let motor = "<actuator><motor joint='j'/></actuator>";
    let general = "<actuator><general joint='j'/></actuator>";
    for unused in [
        "<muscle force='5'/>",
        "<adhesion gain='5' ctrlrange='0 1'/>",
        "<dcmotor motorconst='1' resistance='2'/>",
        "<pid kp='5'/>",
        "<orientation kp='5'/>",
        "<general gaintype='user' biastype='user' dyntype='user'/>",
        "<general input='ff'/>",
        "<tendon springyield='1'/>",
        "<pair adhesion='1'/>",
        "<default class='a'><joint springyield='1'/><geom adhesion='1' type='sdf'/><motor delay='1'/></default>",
    ] {
        Model::from_xml_str(&with(unused, "", ""), "unused.xml").unwrap_or_else(|e| panic!("{e}"));
        let message = Model::from_xml_str(&with(unused, "", motor), "motor.xml").map_err(|e| e.to_string());
        assert!(message.is_ok() || unused.contains("delay"), "{unused}: {message:?}");
    }
    check(&with("<pid kp='5'/>", "", general), &["<pid>: only the actuators motor"]);
    check(
        &with("<general gaintype='user'/>", "", general),
        &["<general> attribute 'gaintype'", "constant and affine laws and muscles"],
    );
    check(&with("<muscle force='5'/>", "", general), &["<general> attribute 'lengthrange'"]);
    check(&with("<general input='pos vel'/>", "", general), &["'input'", "only one input"]);
    check(&with("<general delay='1'/>", "", motor), &["<general> attribute 'delay'", "'1' is not supported, only '0'"]);
    check(&with("<muscle delay='1'/>", "", motor), &["<muscle> attribute 'delay'"]);
    check(&with("<joint springyield='1'/>", "<joint/>", ""), &["'springyield'", "only '0'"]);
    check(&with("<geom adhesion='1'/>", "<geom size='1'/>", ""), &["<geom> attribute 'adhesion'"]);
    check(&with("<geom surfacevel='0 0 1'/>", "<geom size='1' surfacevel='0'/>", ""), &["'surfacevel'"]);
    let replaced =
        with("<default class='a'><geom adhesion='1'/></default>", "<geom class='a' size='1' adhesion='0'/>", "");
    assert!(Model::from_xml_str(&replaced, "replaced.xml").is_ok());
    // a misspelled name is a mistake even in a class that nothing uses
    check(&with("<general inptu='pos'/>", "", ""), &["did you mean 'input'?"]);
    check(&with("", "", "<actuator><general joint='j' input='poss'/></actuator>"), &["did you mean 'pos'?"]);
    check(&with("", "", "<actuator><general joint='j' input='pos vel'/></actuator>"), &["only one input is supported"]);
    // plugins that are declared but not used
    let declared =
        with("", "", "").replace("<default>", "<extension><plugin plugin='mujoco.pid'/></extension><default>");
    assert!(Model::from_xml_str(&declared, "declared.xml").is_ok());
    let instance =
        declared.replace("<plugin plugin='mujoco.pid'/>", "<plugin plugin='a'><instance name='i'/></plugin>");
    check(&instance, &["<instance name=\"i\">: plugins are not supported"]);
}
