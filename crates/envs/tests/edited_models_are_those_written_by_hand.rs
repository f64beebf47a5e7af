//! Tasks that edit the model of their figure get the bits of a model written by hand. Edits are a course in place of the floor,
//! actuators for roles without a body, and servos in place of motors.

use marathon_envs::{Options, agent};
use marathon_physics::Model;

const FIGURES: [(&str, &str, &str); 3] = [
    (
        "TerrainHopper-v0",
        include_str!("../../../assets/agents/hopper.xml"),
        r#"nrow="2" ncol="1121" size="56 0.4 1 8""#,
    ),
    (
        "TerrainWalker2d-v0",
        include_str!("../../../assets/agents/walker2d.xml"),
        r#"nrow="2" ncol="1121" size="56 0.4 1 8""#,
    ),
    ("TerrainAnt-v0", include_str!("../../../assets/agents/ant.xml"), r#"nrow="33" ncol="1121" size="56 8 1 8""#),
];

/// The text with the one place changed where `old` stands.
fn changed(text: &str, old: &str, new: &str) -> String {
    assert_eq!(text.matches(old).count(), 1, "{old}");
    text.replace(old, new)
}

/// Motors on a tendon that does not pull at a joint.
fn idle(joint: &str, names: &[String]) -> String {
    let motors: String = names
        .iter()
        .map(|name| format!(r#"<motor name="{name}" tendon="idle" ctrllimited="true" ctrlrange="-1 1"/>"#))
        .collect();
    format!(
        r#"<tendon><fixed name="idle"><joint joint="{joint}" coef="0"/></fixed></tendon><actuator>{motors}</actuator></mujoco>"#
    )
}

#[track_caller]
fn same(id: &str, options: &Options, text: &str) {
    let model = agent(id).unwrap().with_options(options).unwrap().model().unwrap();
    let by_hand = Model::from_xml_str(text, id).unwrap();
    assert!(model == by_hand, "{id}");
}

#[test]
fn a_course_takes_the_place_of_the_floor() {
    for (id, text, grid) in FIGURES {
        let floor = r#"type="plane" size="0 0 1""#;
        let text = changed(text, floor, r#"type="hfield" hfield="course" pos="50 0 0""#);
        let text = changed(&text, "</asset>", &format!(r#"<hfield name="course" {grid}/></asset>"#));
        same(id, &Options::new(), &text);

        // the adversary, and the reference runner before it
        let joint = if id == "TerrainAnt-v0" { "hip_1" } else { "rootx" };
        let adversary = Options::new().with("course", "adversary");
        let builder = ["ground".to_owned()];
        same(id, &adversary, &changed(&text, "</mujoco>", &idle(joint, &builder)));
        let level = agent(&id.replace("Terrain", "")).unwrap();
        let theirs = level.facts().actions.into_iter().map(|name| format!("reference_{name}"));
        let others: Vec<String> = theirs.chain(builder).collect();
        same(id, &adversary.with("builder", "regret"), &changed(&text, "</mujoco>", &idle(joint, &others)));
    }
}

#[test]
fn a_commander_has_actuators_that_move_nothing() {
    let names = ["told_velocity", "told_jump"].map(str::to_owned);
    let text = changed(FIGURES[0].1, "</mujoco>", &idle("rootx", &names));
    same("HopperController-v0", &Options::new().with("commander", "adversary"), &text);
}

#[test]
fn marathon_man_has_servos_in_place_of_motors() {
    let text = include_str!("../../../assets/agents/marathon_man.xml");
    let torque = Options::new().with("control", "torque");
    same("MarathonManWalk-v0", &torque, text);
    // every servo of the original's drive bounds its force at 2.5 times its strength
    let mut text = changed(text, r#"damping="1" stiffness="1" "#, "");
    let from = text.find("<actuator>").unwrap() + "<actuator>".len();
    text.truncate(text.find("</actuator>").unwrap());
    let original = text.split_off(from);
    let rest = include_str!("../../../assets/agents/marathon_man.xml").split_once("</actuator>").unwrap().1;
    let servo = Options::new().with("control", "servo");
    let strengths: Vec<f64> = agent("MarathonManWalk-v0")
        .unwrap()
        .with_options(&servo)
        .unwrap()
        .model()
        .unwrap()
        .actuators
        .iter()
        .map(|actuator| actuator.gain[0])
        .collect();
    let names: Vec<&str> = original.split("<motor name=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!((names.len(), strengths.len()), (21, 21));
    for (name, strength) in names.iter().zip(strengths) {
        let bound = 2.5 * strength;
        text += &format!(
            r#"<general name="{name}" joint="{name}" gainprm="{strength}" biastype="affine" biasprm="0 -1 -1" forcerange="-{bound} {bound}"/>"#
        );
    }
    same("MarathonManWalk-v0", &servo, &format!("{text}</actuator>{rest}"));
}
