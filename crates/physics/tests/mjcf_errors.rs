//! A mistake in a model file is reported with its file, line, element and attribute, and with the nearest valid name.
//!
//! Unsupported elements that would change the dynamics are refused in the same way. Nothing is skipped silently. Each
//! row below is a model with one mistake, and the required parts of the message.

#[cfg(unix)]
mod common;
#[path = "common/refusal.rs"]
mod refusal;

use marathon_physics::mjcf::MjcfErrorKind;
use marathon_physics::{Model, Sim, SimOptions};

/// The message for a model given as text.
fn message(xml: &str) -> String {
    match Model::from_xml_str(xml, "bad.xml") {
        Ok(_) => panic!("accepted: {xml}"),
        Err(error) => error.to_string(),
    }
}

#[track_caller]
fn check(xml: &str, parts: &[&str]) {
    let message = message(xml);
    for part in parts {
        assert!(message.contains(part), "'{part}' is missing in\n  {message}\nfor\n  {xml}");
    }
}

/// A model around something in a body that has a geom of its own.
fn in_body(content: &str) -> String {
    format!(
        "<mujoco>\n<worldbody>\n<body name=\"b\">\n<geom name=\"g\" size=\"1\"/><joint name=\"j\"/><site name=\"s\"/>\n{content}\n</body>\n</worldbody>\n</mujoco>"
    )
}

/// A model around a section next to a world with a body, joint, geom and site.
fn with_section(content: &str) -> String {
    in_body("").replace("</worldbody>", &format!("</worldbody>\n{content}"))
}

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

/// MuJoCo's rules for the paths of spatial tendons.
#[test]
fn paths_of_strings() {
    let shapes = "<site name='e' pos='1 0 0'/><geom name='ball' size='1'/><geom name='box' type='box' size='1 1 1'/>";
    let path = |attrs: &str, parts: &str| {
        let section = format!("<tendon><spatial name='t' {attrs}>{parts}</spatial></tendon>");
        with_section(&section).replace("<joint name=", &format!("{shapes}<joint name="))
    };
    let (s, e, ball) = ("<site site='s'/>", "<site site='e'/>", "<geom geom='ball'/>");
    let pulley = "<pulley divisor='2'/>";
    for (parts, expected) in [
        (String::new(), "<spatial name=\"t\">: the path of a spatial tendon needs at least two parts"),
        (s.to_owned(), "<site>: a site needs a neighbor that is not a pulley"),
        (format!("{s}{pulley}{s}{e}"), "<site>: a site needs a neighbor that is not a pulley"),
        (format!("{s}{s}"), "<site>: the next site of the path is the same"),
        (format!("{s}{e}{pulley}"), "<pulley>: the path ends with a pulley"),
        (format!("{s}{e}{pulley}{pulley}{s}{e}"), "<pulley>: a pulley follows another pulley"),
        (format!("{ball}{s}{e}"), "<geom>: a geom of the path needs a site before it and one after it"),
        (format!("{s}{ball}"), "<geom>: a geom of the path needs a site before it and one after it"),
        (format!("{s}{ball}{ball}{e}"), "<geom>: a geom of the path needs a site before it and one after it"),
        (format!("{s}<geom geom='box'/>{e}"), "<geom>: the geom 'box' is neither a sphere nor a cylinder"),
        (format!("{s}<geom geom='bal'/>{e}"), "there is no geom 'bal'; did you mean 'ball'?"),
        (format!("{s}<geom geom='ball' sidesite='x'/>{e}"), "there is no site 'x'"),
        (format!("{s}<site/>"), "<site>: the attribute 'site' is missing"),
        (format!("<pulley/>{s}{e}"), "<pulley>: the attribute 'divisor' is missing"),
        (format!("<pulley divisor='0'/>{s}{e}"), "<pulley> attribute 'divisor' is '0'; expected a positive number"),
        (format!("<pulley divisor='-1'/>{s}{e}"), "attribute 'divisor' is '-1'; expected a positive number"),
        (format!("{s}<joint joint='j' coef='1'/>"), "<joint>"),
    ] {
        check(&path("", &parts), &["bad.xml:", expected]);
    }
    let good = format!("{pulley}{s}{e}");
    assert!(Model::from_xml_str(&path("", &good), "good.xml").is_ok(), "a path may start with a pulley");
    check(&path("width='0'", &good), &["attribute 'width' is '0'; expected a positive number"]);
    check(&path("range='2 1' limited='true'", &good), &["range"]);
    check(&path("springlength='2 1'", &good), &["'springlength' goes from 2 to 1"]);
    check(&path("armature='-1'", &good), &["armature must not be negative"]);
    check(&path("armature='1'", &format!("{s}{ball}{e}")), &["a tendon with armature cannot wrap around a geom"]);
}

#[test]
fn tendons_and_equality_constraints() {
    let tendon = |content: &str| with_section(&format!("<tendon>{content}</tendon>"));
    check(&tendon("<fixed name='t'/>"), &["bad.xml:8:", "<fixed name=\"t\">: the tendon runs over no joint"]);
    check(&tendon("<fixed><joint joint='j'/></fixed>"), &["<joint>: the attribute 'coef' is missing"]);
    check(&tendon("<fixed><joint joint='k' coef='1'/></fixed>"), &["there is no joint 'k'", "did you mean 'j'?"]);
    let twice = "<fixed><joint joint='j' coef='1'/><joint joint='j' coef='1'/></fixed>";
    check(&tendon(twice), &["the joint 'j' is repeated"]);
    let ball = tendon("<fixed><joint joint='j' coef='1'/></fixed>").replace("name=\"j\"", "name='j' type='ball'");
    check(&ball, &["the joint 'j' is neither a hinge nor a slide"]);
    let one = |attrs: &str| tendon(&format!("<fixed {attrs}><joint joint='j' coef='1'/></fixed>"));
    check(&one("springlength='2 1'"), &["'springlength' goes from 2 to 1"]);
    check(&one("springlength='1 2 3'"), &["'springlength' is '1 2 3'"]);
    check(&one("armature='-1'"), &["armature must not be negative"]);
    check(&one("limited='true'"), &["'range' goes from 0 to 0"]);
    check(&one("stifness='1'"), &["did you mean 'stiffness'?"]);
    check("<mujoco><default>\n<tendon springlength='a'/></default></mujoco>", &["bad.xml:2:", "'springlength' is 'a'"]);

    let equality = |content: &str| with_section(&format!("<equality>{content}</equality>"));
    check(&equality("<connect body1='b'/>"), &["bad.xml:8:", "<connect>: the attribute 'anchor' is missing"]);
    check(&equality("<connect body1='b' body2='c' anchor='0 0 0'/>"), &["there is no body 'c'", "did you mean 'b'?"]);
    check(&equality("<connect body1='b' body2='b' anchor='0 0 0'/>"), &["both ends are the same"]);
    check(&equality("<connect body1='b' anchor='0 0'/>"), &["expected 3 numbers"]);
    check(&equality("<weld site1='s'/>"), &["the attribute 'site2' is missing"]);
    check(&equality("<weld/>"), &["the attribute 'body1' is missing"]);
    check(&equality("<weld site1='s' site2='s' anchor='0 0 0'/>"), &["both sites and 'anchor'"]);
    check(&equality("<weld body1='b' relpose='0 0 0 1e-300 0 0 0'/>"), &["the quaternion of 'relpose'"]);
    check(&equality("<joint joint1='j' joint2='j'/>"), &["both ends are the same"]);
    check(&equality("<joint joint1='j' polycoef='1 2 3 4 5 6'/>"), &["up to 5 numbers"]);
    check(&equality("<joint joint1='j' active='yes'/>"), &["expected one of false, true"]);
    check(&equality("<tendon tendon1='t'/>"), &["there is no tendon 't'"]);
    check(
        &equality("<joint name='x' joint1='j'/><joint name='x' joint1='j'/>"),
        &["already a constraint of this name"],
    );
    check("<mujoco><default>\n<equality solref='a'/></default></mujoco>", &["bad.xml:2:", "up to 2 numbers"]);
    check("<mujoco><default><equality anchor='0 0 0'/></default></mujoco>", &["has no attribute 'anchor'"]);
}

#[test]
fn activations() {
    let actuator = |content: &str| with_section(&format!("<actuator>{content}</actuator>"));
    check(&actuator("<motor joint='j' jointinparent='j'/>"), &["there are both 'joint' and 'jointinparent'"]);
    check(&actuator("<motor tendon='t'/>"), &["there is no tendon 't'"]);
    check(&actuator("<general joint='j' actrange='0 1'/>"), &["a range of activations, but no activation"]);
    check(&actuator("<general joint='j' dyntype='filter' actlimited='true'/>"), &["'actrange' goes from 0 to 0"]);
    check(&actuator("<general joint='j' dyntype='filter' actdim='2'/>"), &["'actdim' is '2'; expected 1"]);
    check(&actuator("<general joint='j' dyntype='filtr'/>"), &["did you mean 'filter'?"]);
    check(&actuator("<position joint='j' timeconst='-1'/>"), &["timeconst must not be negative"]);
    check(&actuator("<position joint='j' inheritrange='1'/>"), &["'inheritrange' needs a range of 'j'"]);
    check(
        &actuator("<intvelocity joint='j' inheritrange='1' actrange='0 1'/>"),
        &["both 'actrange' and 'inheritrange'"],
    );
    check(&actuator("<damper joint='j' kv='1'/>"), &["'ctrlrange' goes from 0 to 0"]);
    check(&actuator("<damper joint='j' kv='1' ctrlrange='-1 1'/>"), &["control range of a damper"]);
    check(&actuator("<damper joint='j' kv='-1' ctrlrange='0 1'/>"), &["kv must not be negative"]);
    check(&actuator("<cylinder joint='j' bias='1'/>"), &["'bias' is '1'; expected 3 numbers"]);
    check(&actuator("<motor joint='j' armature='-1'/>"), &["armature must not be negative"]);
    let key = "<keyframe><key act='1'/></keyframe>";
    check(&with_section(key), &["'act' is '1'"]);
    check(&with_section("<keyframe><key mpos='1 2 3'/></keyframe>"), &["'mpos' is '1 2 3'"]);
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

/// Sites that an actuator acts on.
#[test]
fn sites_of_actuators() {
    for (motor, parts) in [
        ("site='t'", &["there is no site 't'", "did you mean 's'?"][..]),
        ("site='s' refsite='t'", &["there is no site 't'"]),
        ("site='s' joint='j'", &["there are both 'joint' and 'site'"]),
        ("joint='j' refsite='s'", &["'refsite' needs 'site', but there is 'joint'"]),
        ("site='s' slidersite='s'", &["'slidersite' needs 'cranksite', but there is 'site'"]),
        ("joint='j' cranklength='1'", &["'cranklength' needs 'cranksite', but there is 'joint'"]),
        ("cranksite='s' cranklength='1'", &["the attribute 'slidersite' is missing"]),
        ("cranksite='s' slidersite='t' cranklength='1'", &["there is no site 't'"]),
        ("cranksite='s' slidersite='s'", &["'cranklength' is 0; it must be positive"]),
        ("cranksite='s' slidersite='s' cranklength='-1'", &["'cranklength' is -1; it must be positive"]),
        ("site='s' damping='1'", &["'damping' needs a joint or a tendon"]),
        ("cranksite='s' slidersite='s' cranklength='1' armature='1'", &["'armature' needs a joint or a tendon"]),
    ] {
        check(&with_section(&format!("<actuator><motor {motor}/></actuator>")), parts);
    }
    let servo = "<actuator><position site='s' inheritrange='1'/></actuator>";
    check(&with_section(servo), &["'inheritrange' needs a hinge, a slide or a tendon"]);
}

/// Contacts that an actuator pulls at.
#[test]
fn adhesion() {
    for (actuator, expected) in [
        ("<adhesion/>", "the attribute 'body' is missing"),
        ("<adhesion body='c' ctrlrange='0 1'/>", "there is no body 'c'"),
        ("<adhesion body='b' gain='-1' ctrlrange='0 1'/>", "gain must not be negative"),
        ("<adhesion body='b' ctrlrange='-1 1'/>", "the control range of adhesion must not be negative"),
        ("<adhesion body='b'/>", "'ctrlrange' goes from 0 to 0"),
        ("<adhesion joint='j' ctrlrange='0 1'/>", "<adhesion> has no attribute 'joint'"),
        ("<motor body='b'/>", "<motor> has no attribute 'body'"),
    ] {
        check(&with_section(&format!("<actuator>{actuator}</actuator>")), &[expected]);
    }
    let body = "<worldbody><body name='b'><joint name='j'/><geom name='g' size='1'/></body></worldbody>";
    for (model, expected) in [
        (
            body.to_owned() + "<actuator><general body='b' biastype='affine' biasprm='0 0 1'/></actuator>",
            "feedback on the contacts of body 'b'",
        ),
        (body.replace("size", "gap='0.1' size") + "<actuator><general body='b'/></actuator>", "with gaps"),
        (
            body.replace("'j'", "'j' actuatorfrcrange='-1 1'") + "<actuator><general body='b'/></actuator>",
            "actuatorfrcrange of joint 'j'",
        ),
    ] {
        let model = Model::from_xml_str(&format!("<mujoco>{model}</mujoco>"), "adhesion.xml").expect("a model");
        let error = Sim::<f64>::new(&model, SimOptions::default()).expect_err("it is refused").to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// Armature of tendons that the simulator refuses.
#[test]
fn armature_of_tendons() {
    let model = |option: &str, joints: &str| {
        let arm = |name: &str, more: &str| format!("<body><joint name='{name}'/><geom size='1'/>{more}</body>");
        let tree = arm("trunk", &(arm("left", "") + &arm("right", "")));
        let terms: String = joints.split(' ').map(|j| format!("<joint joint='{j}' coef='1'/>")).collect();
        let text = format!(
            "<mujoco><option {option}/><worldbody>{tree}</worldbody><tendon><fixed name='t' armature='1'>{terms}</fixed></tendon></mujoco>"
        );
        let model = Model::from_xml_str(&text, "tendon.xml").expect("a model");
        Sim::<f64>::new(&model, SimOptions::default()).map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(model("", "trunk left"), Ok(()));
    assert_eq!(model("iterations='3'", "left right"), Ok(()));
    let branches = model("", "right trunk left").expect_err("it is refused");
    assert!(branches.contains("armature of tendon 't' on several branches and on what carries them"), "{branches}");
    let sweeps = model("noslip_iterations='3'", "left right").expect_err("it is refused");
    assert!(sweeps.contains("armature of tendon 't' with noslip_iterations"), "{sweeps}");
}

/// Numbers of muscles.
#[test]
fn muscles() {
    let muscle = |attributes: &str| {
        with_section(&format!("<actuator><muscle joint='j' lengthrange='0 1' {attributes}/></actuator>"))
    };
    Model::from_xml_str(&muscle("force='0' range='0.5 0.6' tausmooth='1'"), "muscle.xml").expect("a muscle");
    for (attributes, expected) in [
        ("range='1 1'", "the range of the muscle goes from 1 to 1; the first must be smaller"),
        ("lmin='1'", "lmin is 1 and lmax is 1.6; 1 must be between them"),
        ("lmax='1'", "lmin is 0.5 and lmax is 1; 1 must be between them"),
        ("scale='0'", "scale of the muscle is 0; it must be positive"),
        ("vmax='0'", "vmax of the muscle is 0; it must be positive"),
        ("fpmax='0'", "fpmax of the muscle is 0; it must be positive"),
        ("fvmax='0'", "fvmax of the muscle is 0; it must be positive"),
        ("tausmooth='-1'", "tausmooth must not be negative"),
        ("force='1 2'", "'force'"),
        ("site='s'", "<muscle> has no attribute 'site'"),
    ] {
        check(&muscle(attributes), &[expected]);
    }
    let limited = |compiler: &str, joint: &str| {
        format!(
            "<mujoco><compiler><lengthrange {compiler}/></compiler><worldbody><body><joint name='j' {joint}/><geom size='1'/></body>\
             </worldbody><actuator><muscle joint='j'/></actuator></mujoco>"
        )
    };
    for (compiler, joint) in [("uselimit='true'", "range='0 1'"), ("mode='none'", "")] {
        Model::from_xml_str(&limited(compiler, joint), "limited.xml").expect("a muscle");
    }
    let class = "<default><muscle lengthrange='0 1'/></default><actuator><muscle joint='j'/></actuator>";
    check(&with_section(class), &["<muscle> has no attribute 'lengthrange'"]);
    for (compiler, joint) in [("uselimit='true'", ""), ("", "range='0 1'")] {
        check(&limited(compiler, joint), &["<muscle> attribute 'lengthrange'", "uselimit"]);
    }
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
