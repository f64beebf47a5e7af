//! A mistake in an actuator, a tendon or an equality constraint is reported with its place and the nearest valid choice.

use crate::refusal::{check, with_section};
use marathon_physics::{Model, Sim, SimOptions};

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
