//! `<attach>`: a mistake is reported with its file and line and with the nearest name, and no file can ask for more than the budget.
//!
//! `mjcf_agrees_with_mujoco` compares the models `models/mjcf/attach*.xml` with MuJoCo's.

use marathon_physics::Model;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::spec::{Geom, Kind, ModelSpec};

/// A part that can be attached.
const PART: &str = "<mujoco model='part'>\n<default><geom size='.1'/><default class='thin'/></default>\n<worldbody>\n\
    <body name='arm'><joint name='hip'/><geom name='arm'/></body><frame name='tools'/></worldbody>\n\
    <actuator><motor name='hip' joint='hip'/></actuator></mujoco>";

/// A model around a world, with `part.xml` under the name `part`.
fn model(world: &str) -> String {
    format!("<mujoco><asset><model name='part' file='part.xml'/></asset>\n<worldbody>\n{world}\n</worldbody></mujoco>")
}

/// The model of a text and other files.
fn spec(xml: &str, files: &[(&str, &str)]) -> Result<ModelSpec, MjcfError> {
    ModelSpec::from_xml_str_with(xml, "main.xml", &|name| {
        let file = files.iter().find(|(file, _)| *file == name).map(|(_, text)| text.as_bytes().to_vec());
        file.ok_or_else(|| "there is no such file".to_owned())
    })
}

#[track_caller]
fn check(xml: &str, files: &[(&str, &str)], parts: &[&str]) {
    let message = match spec(xml, files).and_then(|spec| spec.compile()) {
        Ok(_) => panic!("accepted: {xml}"),
        Err(error) => error.to_string(),
    };
    for part in parts {
        assert!(message.contains(part), "'{part}' is missing in\n  {message}\nfor\n  {xml}");
    }
}

#[test]
fn mistakes_come_with_the_nearest_name() {
    let files = [("part.xml", PART)];
    for (attach, parts) in [
        ("<attach model='prat' prefix='p_'/>", &["'model': there is no model 'prat'", "did you mean 'part'?"][..]),
        ("<attach model='part' body='arn' prefix='p_'/>", &["'body': there is no body in the model 'arn'", "'arm'?"]),
        ("<attach model='part' frame='tool' prefix='p_'/>", &["'frame': there is no frame in", "'tools'?"]),
        ("<attach model='part' body=''  prefix='p_'/>", &["there is no body in the model ''"]),
        ("<attach model='part' body='arm'/>", &["<attach>: the attribute 'prefix' is missing"]),
        ("<attach model='part' body='arm' frame='tools' prefix=''/>", &["there are both 'body' and 'frame'"]),
        ("<attach prefix='p_'/>", &["'model', 'body' or 'frame' is missing"]),
        ("<attach body='later' prefix='p_'/><body name='later'/>", &["there is no body above this line 'later'"]),
        ("<attach model='part' prefx='p_'/>", &["has no attribute 'prefx'", "did you mean 'prefix'?"]),
        ("<attach model='part' prefix='p_'><geom/></attach>", &["<geom>: an <attach> contains no elements"]),
        ("<attach model='part' prefix='p_'/><geom class='p_thim'/>", &["default class 'p_thim'", "'p_thin'?"]),
        ("<body name='p_arm'/><attach model='part' prefix='p_'/>", &["there is already a body of this name"]),
    ] {
        check(&model(attach), &files, parts);
    }
    check(
        &model("<attach model='part' prefix='p_'/>"),
        &[],
        &["main.xml:1:", "model file 'part.xml': there is no such"],
    );
    for (asset, parts) in [
        ("<model name='part'/>", &["<model name=\"part\">: the attribute 'file' is missing"][..]),
        ("<model name='part' file='part.mjz'/>", &["'part.mjz'; expected a file that ends with .xml"]),
        ("<model name='part' file='part.xml' content_type='text/usd'/>", &["'text/usd'; expected 'text/xml'"]),
        ("<model name='part' fil='part.xml'/>", &["has no attribute 'fil'", "did you mean 'file'?"]),
    ] {
        let attached = model("<attach model='part' prefix='p_'/>");
        check(&attached.replace("<model name='part' file='part.xml'/>", asset), &files, parts);
    }
    // mistakes in the other file are found in it, even in sections that the model does not take over
    for (right, wrong, parts) in [
        ("<mujoco model", "<robot model", &["part.xml:1:", "expected <mujoco>"][..]),
        ("<geom name='arm'/>", "<geom name='arm' siez='1'/>", &["part.xml:4:", "did you mean 'size'?"]),
        (
            "<default class='thin'/>",
            "<default class='thin'><geom size='x'/></default>",
            &["part.xml:2:", "'size' is 'x'"],
        ),
        ("<worldbody>", "<option timestp='1'/><worldbody>", &["part.xml:3:", "did you mean 'timestep'?"]),
        ("<worldbody>", "<compiler fusestatic='true'/><worldbody>", &["part.xml:3:", "'fusestatic'"]),
        ("<frame name='tools'/>", "<composite/>", &["part.xml:4:", "<composite>"]),
    ] {
        let wrong = PART.replace(right, wrong);
        let wrong = if wrong.starts_with("<robot") { wrong.replace("</mujoco>", "</robot>") } else { wrong };
        check(&model("<attach model='part' prefix='p_'/>"), &[("part.xml", &wrong)], parts);
    }
}

#[test]
fn options_that_differ_are_an_error_if_the_model_says_so() {
    let part = PART.replace("<worldbody>", "<option timestep='.001' gravity='0 0 -1'/><worldbody>");
    let attach = model("<attach model='part' prefix='p_'/>");
    let with = |conflict: &str| {
        let option = format!("<compiler conflict='{conflict}'/><option gravity='0 0 -2'/>");
        attach.replace("<asset>", &format!("{option}<asset>"))
    };
    let options = |xml: &str| {
        let opt = spec(xml, &[("part.xml", &part)]).unwrap().compile().unwrap().opt;
        (opt.timestep, opt.gravity[2])
    };
    assert_eq!(options(&attach), (0.002, -9.81));
    assert_eq!(options(&with("warning")), (0.002, -2.0));
    let message = &["main.xml:3: <attach>: 'gravity' is '0 0 -2' in line 1 and '0 0 -1'", "part.xml:3", "conflict="];
    check(&with("merge"), &[("part.xml", &part)], message);
    check(&with("error"), &[("part.xml", &part)], message);
    check(&with("eror"), &[("part.xml", &part)], &["'conflict' is 'eror'", "did you mean 'error'?"]);
    let merged = with("merge").replace(" gravity='0 0 -2'", " timestep='.004' iterations='7'");
    assert_eq!(options(&merged), (0.001, -1.0));
}

#[test]
fn copies_are_bounded() {
    let attach = model("<attach model='part' prefix='p_'/>");
    let itself = model("<body name='b'><attach model='part' body='b' prefix='q'/></body>");
    check(&attach, &[("part.xml", &itself)], &["part.xml:1:", "a model attaches itself: part.xml > part.xml"]);
    let other = itself.replace("part.xml", "main.xml");
    check(&attach, &[("part.xml", &other), ("main.xml", &attach)], &["part.xml > main.xml > part.xml"]);

    // every model attaches the next one 20 times
    let twenty: String = (0..20).map(|i| format!("<attach model='m' prefix='p{i}'/>")).collect();
    let level = |i: usize| {
        format!("<mujoco><asset><model name='m' file='{i}.xml'/></asset><worldbody>{twenty}</worldbody></mujoco>")
    };
    let leaf = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>".to_owned();
    let files: Vec<(String, String)> =
        (1..8).map(|i| (format!("{i}.xml"), if i == 7 { leaf.clone() } else { level(i + 1) })).collect();
    let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (&**name, &**text)).collect();
    check(&level(1), &files, &["the model asks for", "'memory'"]);

    let one = |i: usize| level(i).replace(&twenty, "<attach model='m' prefix='p'/>");
    let files: Vec<(String, String)> = (1..30).map(|i| (format!("{i}.xml"), one(i + 1))).collect();
    let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (&**name, &**text)).collect();
    check(&one(1), &files, &["models are attached more than 20 deep"]);

    // elements that are nested in elements that are nested
    let deep = format!(
        "<mujoco><worldbody>{}<site name='end'/>{}</worldbody></mujoco>",
        "<frame>".repeat(150),
        "</frame>".repeat(150)
    );
    let nested =
        model(&format!("{}<attach model='part' prefix='p_'/>{}", "<frame>".repeat(100), "</frame>".repeat(100)));
    check(&nested, &[("part.xml", &deep)], &["elements are nested more than 200 deep"]);

    // sensors of nothing double with every copy, as in MuJoCo
    let clock = "<mujoco><worldbody><replicate count='40'><geom size='1'/></replicate></worldbody><sensor><clock/></sensor></mujoco>";
    check(clock, &[], &["<clock>: the model asks for"]);
}

#[test]
fn a_model_with_attached_parts_can_be_edited() {
    let files = [("parts/arm.xml", PART), ("parts/other.xml", "<mujoco><body name='in'/></mujoco>")];
    let xml = model("<geom name='floor' size='1'/><attach model='part' body='arm' prefix='p_'/>")
        .replace("part.xml", "parts/arm.xml")
        .replace("<asset>", "<default><geom size='.5' mass='3'/></default><asset>");
    let mut spec = spec(&xml, &files).unwrap();
    assert_eq!(spec.get(Kind::Actuator, "p_hip").unwrap().get("joint"), Some("p_hip"));
    spec.add_to("p_arm", Geom::sphere(0.2).name("hand")).unwrap();
    assert_eq!(spec.default_mut("p_main", "geom").unwrap().view().get("size"), Some(".1"));
    let model = spec.compile().unwrap();
    let sizes: Vec<f64> = model.geoms.iter().map(|geom| geom.size[0]).collect();
    assert_eq!(sizes, [1.0, 0.1, 0.2]);
    // the density of water, not the mass of the model's own class
    let water = 4000.0 / 3.0 * std::f64::consts::PI * (0.1f64.powi(3) + 0.2f64.powi(3));
    assert!((model.bodies[1].mass - water).abs() < 1e-9);
    let again = Model::from_xml_str(&spec.to_xml(), "written").unwrap();
    assert_eq!(again, model);
    assert_eq!(spec.remove(Kind::Body, "p_arm").unwrap(), ["<motor name=\"p_hip\">"]);
    assert_eq!(spec.compile().unwrap().nv, 0);
}

#[test]
fn masses_that_no_file_can_say_are_refused_by_readers() {
    let part = PART.replace("<worldbody>", "<compiler boundmass='7'/><worldbody>");
    let spec = spec(&model("<attach model='part' prefix='p_'/>"), &[("part.xml", &part)]).unwrap();
    assert_eq!(spec.compile().unwrap().bodies[1].mass, 7.0);
    let error = Model::from_xml_str(&spec.to_xml(), "written").unwrap_err().to_string();
    assert!(error.contains("<body name=\"p_arm\"> attribute 'masses'"), "{error}");
}
