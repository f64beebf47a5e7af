//! Actuators at sites, slider-cranks, muscles and adhesion act as in MuJoCo.
//!
//! Small models move under every kind of actuator on these targets and under muscles on any target, with every
//! integrator. Double precision follows
//! MuJoCo's states, sensors, accelerations and actuator forces every ten steps. From MuJoCo's states, the other lane
//! types find the same accelerations up to their rounding.

use crate::motions::{Case, case, compare};
use marathon_physics::Model;
use marathon_physics::spec::{Actuator, Kind, ModelSpec};

/// An arm with a ball joint on a turntable, and another arm on the same turntable.
macro_rules! arms {
    ($more:literal) => {
        concat!(
            r#"<default><geom contype="0" conaffinity="0"/><joint damping="0.05" armature="0.005"/></default>
            <worldbody><site name="post" pos="0.2 0.3 0.5" euler="20 40 -60"/>
            <body euler="0 0 30"><joint name="turn" axis="0.2 0 1"/><geom size="0.1" mass="1"/>
              <site name="hub" pos="0 0.1 0.15" euler="90 10 0"/>
              <body pos="0.1 0 0"><joint name="right" axis="0 1 0"/>
                <geom type="capsule" size="0.02" fromto="0 0 0 0.3 0 0"/><site name="elbow" pos="0.28 0 0.03" euler="0 30 10"/>
                <body pos="0.3 0 0"><joint name="hand" axis="0 1 0"/>
                  <geom type="capsule" size="0.02" fromto="0.06 0 0 0.2 0 0"/>
                  <body pos="0.2 0 0" euler="10 20 30"><geom size="0.03"/><site name="tip" pos="0.02 0 0.02" euler="-40 0 70"/></body></body></body>
              <body pos="-0.1 0 0"><joint name="left" type="ball"/>
                <geom type="capsule" size="0.02" fromto="0 0 0 -0.3 0 0"/><site name="l" pos="-0.25 0 0.03" euler="50 60 70"/></body>
            </body>"#,
            $more,
        )
    };
}

const CASES: &[Case] = &[
    Case {
        ctrl: &[0.5, -0.3],
        qvel: &[1.0, -1.0, 2.0, 0.5, 0.2, -1.0, 1.0, -2.0, 0.3, 1.0, 2.0],
        ..case(
            "gravity compensation by actuators",
            arms!(
                r#"<body pos="1 0 0" gravcomp="1"><joint name="arm" axis="0 1 0" actuatorgravcomp="true" actuatorfrcrange="-0.5 0.2"/>
                <geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0"/><body pos="0.3 0 0" gravcomp="0.7"><joint name="wrist" axis="0 1 0.3"/>
                <geom type="capsule" size="0.03" fromto="0 0 0 0.2 0 0.1"/><body pos="0.2 0 0.1" gravcomp="-0.2"><joint type="ball" actuatorgravcomp="true"/>
                <geom size="0.05" pos="0.05 0 0"/></body></body></body></worldbody><option integrator="implicit"/>
                <actuator><motor joint="arm" gear="0.3"/><velocity joint="wrist" kv="0.1"/></actuator>
                <sensor><jointactuatorfrc joint="arm"/><jointactuatorfrc joint="wrist"/></sensor>"#
            ),
        )
    },
    case(
        "gravity compensation by actuators without actuators",
        r#"<worldbody><body gravcomp="1"><joint axis="0 1 0" actuatorgravcomp="true"/><geom size="0.1" pos="0.2 0 0"/><body gravcomp="1" pos="0.3 0 0">
        <joint axis="0 1 0"/><geom size="0.1" pos="0.2 0 0"/></body></body></worldbody>"#,
    ),
    Case {
        ctrl: &[0.5, -0.3, 0.8, 1.0],
        qvel: &[1.0, -1.0, 2.0, 0.5, 0.2, -1.0],
        ..case(
            "along the axes of a site",
            arms!(
                r#"</worldbody><actuator><motor name="m" site="tip" gear="1 2 -1 0.3 0 0.2"/><motor site="l" gear="0 0 0 0.1 -0.2 0.3"/>
                <damper name="d" site="elbow" kv="2" gear="0 0 1" ctrlrange="0 1"/><motor site="post" gear="1 1 1 1 1 1"/></actuator>
                <sensor><actuatorpos actuator="m"/><actuatorvel actuator="m"/><actuatorfrc actuator="d"/><actuatorvel actuator="d"/>
                <jointactuatorfrc joint="hand"/><force site="tip"/><torque site="elbow"/></sensor>"#
            ),
        )
    },
    Case {
        ctrl: &[0.3, -0.5, 0.2, 0.4, -0.3],
        ..case(
            "along the axes of another site",
            arms!(
                r#"</worldbody><actuator><position name="p" site="tip" refsite="post" kp="20" kv="1" gear="1 0.5 0"/>
                <position name="t" site="l" refsite="elbow" kp="0.5" kv="0.02" gear="0 0 0 1 0.3 0.1"/>
                <velocity name="v" site="tip" refsite="hub" kv="0.5" gear="0 0 1 0.1 0 0" forcerange="-1 0.3"/>
                <general site="tip" refsite="elbow" dyntype="filter" dynprm="0.05" gaintype="affine" gainprm="2 1 -0.2" biastype="affine"
                 biasprm="0.1 -3 -0.1" gear="0 1 0 0 0.5 0"/>
                <intvelocity name="i" site="hub" refsite="l" kp="5" kv="0.1" gear="0 0 1" actrange="-1 1" /></actuator>
                <sensor><actuatorpos actuator="p"/><actuatorvel actuator="p"/><actuatorfrc actuator="p"/><actuatorpos actuator="t"/>
                <actuatorvel actuator="t"/><actuatorpos actuator="v"/><actuatorfrc actuator="v"/><actuatorpos actuator="i"/>
                <jointactuatorfrc joint="turn"/><jointactuatorfrc joint="right"/></sensor>"#
            ),
        )
    },
    Case {
        // of all angles that are the same orientation, the one nearest to the target counts, for servos of nothing but turns
        ctrl: &[-1.5, 2.5, 9.0, -4.0],
        ..case(
            "targets more than half a turn away",
            arms!(
                r#"</worldbody><actuator><position site="l" refsite="elbow" kp="0.5" kv="0.02" gear="0 0 0 0.1 0.2 0"/>
                <position name="b" site="tip" refsite="post" kp="0.3" timeconst="0.1" gear="0 0 0 0 1 0"/>
                <position site="tip" refsite="post" kp="0.1" gear="0.01 0 0 0 1 0"/>
                <general site="tip" refsite="elbow" biastype="affine" gainprm="0.2" biasprm="0.1 -0.1 -0.01" gear="0 0 0 0 0 1"/></actuator>
                <sensor><actuatorpos actuator="b"/><actuatorfrc actuator="b"/></sensor>"#
            ),
        )
    },
    Case {
        qvel: &[3.0, 2.0, -3.0, 4.0, 2.0, -3.0],
        ctrl: &[0.3, -0.5, 0.2],
        ..case(
            "implicitfast with damping at sites",
            arms!(
                r#"</worldbody><option integrator="implicitfast" timestep="0.005"/><actuator><velocity site="tip" refsite="l" kv="5" gear="1 1 0"/>
                <position site="tip" kp="0" kv="0.3" gear="0 0 0 0 1 1"/><velocity site="elbow" refsite="post" kv="3" gear="1 0 0 0.5" forcerange="-1 2"/>
                </actuator>"#
            ),
        )
    },
    Case {
        ctrl: &[0.6, 0.1],
        ..case(
            "damping ratio at sites",
            arms!(
                r#"</worldbody><option integrator="RK4"/><actuator><position site="tip" refsite="post" kp="20" dampratio="0.7" gear="1 2 0"/>
                <position cranksite="elbow" slidersite="post" cranklength="0.9" kp="30" dampratio="1"/></actuator>"#
            ),
        )
    },
    Case {
        qvel: &[1.0, 0.0, 0.0, 3.0, 2.0, -2.0, 0.5, 0.0, 0.0, 0.0, 3.0, 1.0],
        ctrl: &[0.1, 3.0, 1.0],
        ..case(
            "free bodies",
            r#"<option integrator="implicitfast" gravity="0 0 -1"/><worldbody><site name="post" pos="0 0 1"/>
            <body><freejoint/><geom type="box" size="0.1 0.2 0.05"/><geom size="0.05" pos="0.2 0.1 0"/><site name="a" pos="0.2 0.1 0.05" euler="10 20 30"/>
            </body><body pos="0.5 0 0"><freejoint/><geom type="box" size="0.1 0.05 0.15"/><site name="b" pos="0 0.05 0.1" euler="0 70 0"/></body></worldbody>
            <actuator><position site="a" refsite="b" kp="100" kv="20" gear="1 0 1 0 0.1 0"/><motor site="b" gear="0 0 1 0.1 0 0"/>
            <velocity site="a" kv="0.3" gear="0 0 0 1 0 0"/></actuator>"#,
        )
    },
    Case {
        qvel: &[4.0, 1.0],
        ctrl: &[0.4, 0.2, 0.0],
        steps: 500,
        ..case(
            "slider-cranks, with rods that start and end to reach",
            r#"<worldbody><site name="rail" pos="0.6 0 0" euler="0 -90 5"/><site name="far" pos="0.9 0.1 0" euler="0 -80 0"/>
            <body><joint axis="0 1 0" damping="0.01"/><geom type="capsule" size="0.02" fromto="0 0 0 0.2 0 0" contype="0"/><site name="end" pos="0.2 0 0.01"/>
            <body pos="0.2 0 0"><joint axis="0 1 0.2"/><geom type="capsule" size="0.02" fromto="0 0 0 0.15 0.05 0" contype="0"/>
            <site name="tip" pos="0.15 0.05 0"/><site name="own" euler="0 90 0"/></body></body></worldbody>
            <default><position cranklength="0.5"/></default>
            <actuator><position name="a" cranksite="end" slidersite="rail" kp="30" kv="0.5" gear="1.5"/>
            <motor name="b" cranksite="tip" slidersite="far" cranklength="0.12" gear="-2"/>
            <motor name="c" cranksite="end" slidersite="own" cranklength="0.3"/></actuator>
            <sensor><actuatorpos actuator="a"/><actuatorvel actuator="a"/><actuatorfrc actuator="a"/><actuatorpos actuator="b"/><actuatorvel actuator="b"/>
            <actuatorpos actuator="c"/><actuatorvel actuator="c"/></sensor>"#,
        )
    },
    Case {
        ctrl: &[20.0, -30.0],
        qvel: &[1.0, -1.0, 2.0, 0.5, 0.2, -1.0],
        ..case(
            "bounded sums of forces",
            arms!(
                r#"</worldbody><default><joint actuatorfrcrange="-1 2"/></default><actuator><motor site="tip" gear="0 0 1"/>
                <motor joint="right"/></actuator><sensor><jointactuatorfrc joint="right"/><jointactuatorfrc joint="hand"/></sensor>"#
            ),
        )
    },
    Case {
        ctrl: &[0.8, 0.3, 1.5, 0.6, 0.5, -0.4],
        qvel: &[3.0, -2.0, 4.0, 0.5, 0.2, -1.0],
        steps: 600,
        ..case(
            "muscles",
            arms!(
                r#"</worldbody><compiler><lengthrange uselimit="true"/></compiler><tendon><spatial name="s" limited="true" range="0.1 0.6"><site site="post"/><site site="elbow"/></spatial>
                <fixed name="f"><joint joint="right" coef="1"/><joint joint="hand" coef="-0.4"/></fixed></tendon><actuator>
                <muscle name="a" joint="right" force="8" lengthrange="-1.5 1"/><muscle name="b" tendon="s" force="30" tausmooth="0.3" timeconst="0.05 0.1"/>
                <muscle name="c" tendon="f" scale="20" lengthrange="-0.4 0.2" vmax="3" gear="1.2"/>
                <general name="d" joint="hand" dyntype="muscle" dynprm="0.02 0.1" gaintype="muscle" gainprm="0.7 1.2 4 1 0.3 1.9 5 1 1.5"
                 biastype="affine" biasprm="0.1 -1 -0.02" lengthrange="-2 2"/>
                <general name="e" site="tip" refsite="post" gear="1 0 1" gaintype="affine" gainprm="1 2 0" biastype="muscle" biasprm="0.7 1.2 4 1 0.3 1.4 5 1 1.5"
                 lengthrange="-0.5 0.1"/>
                <muscle name="g" cranksite="tip" slidersite="hub" cranklength="1" force="3" lengthrange="-1.3 -0.9"/></actuator>
                <sensor><actuatorfrc actuator="a"/><actuatorfrc actuator="b"/><actuatorfrc actuator="c"/><actuatorfrc actuator="d"/>
                <actuatorfrc actuator="e"/><actuatorfrc actuator="g"/><actuatorpos actuator="c"/></sensor>"#
            ),
        )
    },
    Case {
        ctrl: &[0.9, 1.0, 0.5, 0.8],
        qvel: &[3.0, -2.0, 4.0, 0.5, 0.2, -1.0],
        ..case(
            "implicitfast with muscles",
            arms!(
                r#"</worldbody><option integrator="implicitfast" timestep="0.005"/><tendon><spatial name="s"><site site="post"/><site site="elbow"/></spatial></tendon>
                <actuator><muscle joint="right" force="20" lengthrange="-1.5 1" vmax="0.8" timeconst="0.01 0.02"/>
                <muscle tendon="s" force="50" lengthrange="0.2 0.7" vmax="1"/>
                <general site="tip" refsite="hub" gear="1 0 0" gaintype="muscle" gainprm="0.7 1.2 20 1 0.3 1.9 2 1 1.5" lengthrange="-0.2 0.5"/>
                <general joint="hand" gaintype="muscle" gainprm="0.7 1.2 6 1 0.3 1.9 2 1 1.5" lengthrange="-2 2" forcerange="-2 0.1"/></actuator>"#
            ),
        )
    },
    Case {
        ctrl: &[0.7, 1.0],
        ..case(
            "Runge-Kutta with muscles",
            arms!(
                r#"</worldbody><option integrator="RK4"/><actuator><muscle joint="right" force="20" lengthrange="-1.5 1" tausmooth="0.1"/>
                <general joint="hand" dyntype="muscle" dynprm="0.03 0.05" gainprm="0.5" actlimited="true" actrange="0 0.6" actearly="true"/></actuator>"#
            ),
        )
    },
    Case {
        ctrl: &[9.0, 3.0],
        qvel: &[0.1, 0.2, 0.0, 0.0, 0.3, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2, 0.5],
        ..case(
            "adhesion",
            r#"<option gravity="0.5 0 -2"/><worldbody><geom type="plane" size="2 2 1" pos="0 0 -0.3"/><geom name="wall" type="box" size="1 1 0.1" pos="0 0 0.5" euler="0 4 0"/>
            <body name="sticks" pos="0 0 0.301"><freejoint/><geom size="0.1"/><geom size="0.1" pos="0.3 0 -0.02"/><geom size="0.05" pos="0 0.3 0.05" friction="0.4"/></body>
            <body name="rests" pos="0 1 -0.2"><freejoint/><geom type="box" size="0.2 0.1 0.1"/>
              <body pos="0 0 0.2"><joint name="hinge" axis="1 0 0" damping="0.1"/><geom type="capsule" size="0.05" fromto="0 -0.1 0 0 0.1 0"/></body></body></worldbody>
            <actuator><adhesion name="a" body="sticks" gain="4" ctrlrange="0 8"/><adhesion name="b" body="rests" ctrlrange="0 3" forcerange="0 2"/></actuator>
            <sensor><actuatorfrc actuator="a"/><actuatorfrc actuator="b"/><actuatorpos actuator="a"/><jointactuatorfrc joint="hinge"/></sensor>"#,
        )
    },
    Case {
        ctrl: &[6.0, 2.0],
        qvel: &[0.1, 0.2, 0.0, 0.0, 0.3, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2],
        ..case(
            "adhesion with elliptic cones, of two bodies and of frictionless ones",
            r#"<option cone="elliptic" integrator="implicitfast" gravity="0 0 -3"/><worldbody><geom type="plane" size="2 2 1" euler="3 0 0"/>
            <body name="sticks" pos="0 0 0.099"><freejoint/><geom size="0.1" condim="1"/></body>
            <body name="top" pos="0.02 0 0.299"><freejoint/><geom type="sphere" size="0.1" condim="6"/></body></worldbody>
            <actuator><adhesion body="sticks" ctrlrange="0 8"/><general body="top" dyntype="filter" dynprm="0.1" gainprm="2"/></actuator>"#,
        )
    },
    Case {
        ctrl: &[2.0],
        ..case(
            "without actuation",
            arms!(
                r#"</worldbody><option integrator="implicitfast"><flag actuation="disable"/></option><actuator><position name="p" site="tip" refsite="post" kp="20" kv="1" gear="1 0.5 0"/></actuator>
                <sensor><actuatorpos actuator="p"/><actuatorvel actuator="p"/><actuatorfrc actuator="p"/></sensor>"#
            ),
        )
    },
];

#[test]
fn actuators_move_as_in_mujoco() {
    compare(CASES);
}

/// Names of sites in actuators follow the sites.
#[test]
fn edited_sites() {
    let text = |arm: &str, post: &str| {
        format!(
            r#"<mujoco><worldbody><site name="{post}" pos="1 0 0"/><body><joint/><geom size="1"/><site name="{arm}" pos="0 1 0"/></body></worldbody>
            <actuator><motor name="m" site="{arm}" refsite="{post}" gear="1 2 3 4 5 6"/>
            <motor name="c" cranksite="{arm}" slidersite="{post}" cranklength="2"/></actuator></mujoco>"#
        )
    };
    let mut spec = ModelSpec::from_xml_str(&text("arm", "post"), "model").expect("a model");
    for (old, new) in [("arm", "hand"), ("post", "wall")] {
        spec.get_mut(Kind::Site, old).expect("a site").set("name", new).expect("a free name");
    }
    let by_hand = Model::from_xml_str(&text("hand", "wall"), "model").expect("a model");
    assert!(spec.compile().expect("a model") == by_hand);
    assert!(Model::from_xml_str(&spec.to_xml(), "model").expect("a model") == by_hand);
    assert_eq!(spec.remove(Kind::Site, "wall").expect("a site").len(), 2, "both actuators go with the site");
    let mut spec = ModelSpec::from_xml_str(&text("hand", "wall"), "model").expect("a model");
    spec.replace("m", Actuator::motor("m").site("hand", [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).reference_site("wall"))
        .expect("an actuator");
    spec.replace("c", Actuator::motor("c").slider_crank("hand", "wall", 2.0)).expect("an actuator");
    assert!(spec.compile().expect("a model") == by_hand);
}
