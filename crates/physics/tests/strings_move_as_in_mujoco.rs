//! Spatial tendons act as in MuJoCo.
//!
//! Small models with strings through sites, over pulleys and around geoms move under springs, dampers, friction, limits
//! and actuators with every integrator. Double precision follows MuJoCo's states, sensors and accelerations every ten
//! steps. From MuJoCo's states, the other lane types find the same accelerations up to their rounding.

use crate::motions::{Case, case, compare};

/// Two arms on a turntable, and posts to tie them to.
macro_rules! arms {
    ($more:literal) => {
        concat!(
            r#"<default><geom contype="0" conaffinity="0"/><joint damping="0.05" armature="0.005"/></default>
            <worldbody><site name="post" pos="0.2 0.3 0.5"/><site name="peg" pos="-0.3 0 0.4"/>
            <body><joint name="turn" axis="0.2 0 1"/><geom size="0.1" mass="1"/><site name="hub" pos="0 0.1 0.15"/>
              <body pos="0.1 0 0"><joint name="right" axis="0 1 0" springref="20"/>
                <geom type="capsule" size="0.02" fromto="0 0 0 0.3 0 0"/><site name="r1" pos="0.1 0 0.03"/><site name="r2" pos="0.28 0 0.03"/>
                <body pos="0.3 0 0"><joint name="hand" axis="0 1 0"/>
                  <geom name="wrist" size="0.05"/>
                  <geom type="capsule" size="0.02" fromto="0.06 0 0 0.2 0 0"/><site name="h" pos="0.15 0 0.02"/>
                  <site name="cap" pos="0 0 0.06"/><site name="core" pos="0.01 0 0.01"/></body></body>
              <body pos="-0.1 0 0"><joint name="left" type="ball"/>
                <geom type="capsule" size="0.02" fromto="0 0 0 -0.3 0 0"/><site name="l" pos="-0.25 0 0.03"/></body>
            </body>"#,
            $more,
        )
    };
}

const CASES: &[Case] = &[
    case(
        "a spring rests at its length in the spring configuration",
        arms!(
            r#"</worldbody><tendon><spatial stiffness="40" damping="0.3"><site site="r2"/><site site="hub"/><site site="l"/></spatial>
            </tendon>"#
        ),
    ),
    case(
        "a dead band and a pulley",
        arms!(
            r#"</worldbody><tendon><spatial stiffness="60" springlength="0.3 0.5"><site site="post"/><site site="r1"/><site site="r2"/>
            <pulley divisor="2"/><site site="l"/><site site="peg"/></spatial></tendon>"#
        ),
    ),
    case(
        "Runge-Kutta",
        arms!(
            r#"</worldbody><option integrator="RK4"/><tendon><spatial stiffness="100" damping="1" springlength="0.2"><site site="post"/>
            <site site="h"/><site site="l"/></spatial></tendon>"#
        ),
    ),
    Case {
        ctrl: &[2.0, 0.4, -0.5, 1.0],
        ..case(
            "every actuator",
            arms!(
                r#"</worldbody><tendon><spatial name="a"><site site="post"/><site site="r2"/></spatial>
                <spatial name="b" damping="0.1"><site site="l"/><site site="hub"/><site site="h"/></spatial>
                <spatial name="c"><site site="r1"/><site site="peg"/></spatial></tendon>
                <actuator><motor tendon="a" gear="3"/><position name="servo" tendon="b" kp="30" kv="1"/><velocity tendon="c" kv="2" gear="0.5"/>
                <general tendon="a" dyntype="filter" dynprm="0.05" gaintype="affine" gainprm="5 1 -0.2" biastype="affine" biasprm="0 -3 -0.1"
                 forcerange="-4 4"/></actuator>
                <sensor><tendonpos tendon="a"/><tendonvel tendon="b"/><actuatorpos actuator="servo"/><tendonactuatorfrc tendon="a"/>
                <tendonactuatorfrc tendon="c"/><jointactuatorfrc joint="right"/><e_potential/><e_kinetic/></sensor>"#
            ),
        )
    },
    Case {
        ctrl: &[0.3, -0.2],
        qvel: &[1.0, 2.0, -3.0, 0.5, 0.2, -1.0],
        ..case(
            "implicitfast with damping across branches",
            arms!(
                r#"</worldbody><option integrator="implicitfast" timestep="0.005"/><tendon>
                <spatial name="a" damping="20"><site site="l"/><site site="hub"/><site site="h"/></spatial>
                <spatial name="b"><site site="r1"/><site site="peg"/></spatial>
                <fixed name="f" damping="0.5"><joint joint="right" coef="1"/><joint joint="hand" coef="-2"/></fixed></tendon>
                <actuator><velocity tendon="b" kv="30" gear="0.5"/><position tendon="f" kp="3" kv="0.4" forcerange="-1 1"/></actuator>"#
            ),
        )
    },
    Case {
        qvel: &[1.0, 0.0, 0.0, 5.0, 2.0, -4.0, 0.5, 0.0, 0.0, 0.0, 3.0, 1.0, 2.0],
        ..case(
            "implicitfast with a free body",
            r#"<option integrator="implicitfast" gravity="0 0 -1"/><worldbody><site name="post" pos="0 0 1"/>
            <body><freejoint/><geom type="box" size="0.1 0.2 0.05"/><geom size="0.05" pos="0.2 0.1 0"/><site name="a" pos="0.2 0.1 0.05"/>
            </body><body pos="0.5 0 0"><freejoint/><geom type="box" size="0.1 0.05 0.15"/><site name="b" pos="0 0.05 0.1"/>
            <body pos="0 0.1 0"><joint axis="1 0 0" damping="0.1"/><geom size="0.04" pos="0 0.1 0"/></body></body></worldbody>
            <tendon><spatial damping="30"><site site="post"/><site site="a"/><site site="b"/></spatial></tendon>"#,
        )
    },
    Case {
        qvel: &[1.0, 2.0, -3.0, 0.5, 0.2, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..case(
            "implicitfast with a low cap",
            arms!(
                r#"<geom type="plane" size="2 2 1" pos="0 0 -0.3" conaffinity="1"/><body pos="0 0 -0.22"><freejoint/><geom size="0.1" contype="1"/></body></worldbody><option integrator="implicitfast" iterations="2"/>
                <tendon><spatial damping="20" range="0.3 0.6"><site site="l"/><site site="hub"/><site site="h"/></spatial></tendon>"#
            ),
        )
    },
    Case {
        qvel: &[3.0, 2.0, -3.0, 0.5, 0.2, -1.0],
        ctrl: &[0.3],
        ..case(
            "armature with damped joints",
            arms!(
                r#"</worldbody><tendon><spatial armature="0.3" stiffness="20" damping="0.1"><site site="post"/><site site="h"/></spatial>
                <spatial armature="0.1" frictionloss="0.2"><site site="r2"/><site site="peg"/><site site="r1"/></spatial>
                <spatial name="two branches" armature="0.2"><site site="l"/><site site="r1"/></spatial>
                <fixed name="f" armature="0.05" range="-0.1 0.3"><joint joint="turn" coef="0.5"/><joint joint="hand" coef="-2"/></fixed></tendon>
                <actuator><motor tendon="f" armature="0.02" gear="2"/></actuator>
                <sensor><e_kinetic/><e_potential/><force site="h"/><torque site="r1"/><framelinacc objtype="site" objname="h"/>
                <accelerometer site="l"/><tendonvel tendon="f"/></sensor>"#
            ),
        )
    },
    Case {
        qvel: &[3.0, 2.0, -3.0, 0.5, 0.2, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ctrl: &[0.1],
        ..case(
            "armature with implicitfast and contacts",
            arms!(
                r#"<geom type="plane" size="2 2 1" pos="0 0 -0.3" conaffinity="1"/><body pos="0 0 -0.22"><freejoint/><geom size="0.1" contype="1"/></body></worldbody>
                <option integrator="implicitfast"/><tendon><spatial name="s" armature="0.3" damping="2"><site site="post"/><site site="h"/></spatial>
                <fixed armature="0.05"><joint joint="right" coef="0.5"/><joint joint="hand" coef="-2"/></fixed></tendon>
                <actuator><position tendon="s" kp="20" kv="2"/></actuator>"#
            ),
        )
    },
    Case {
        qvel: &[1.0, 2.0, -3.0, 0.5, 0.2, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..case(
            "armature with a low cap, Newton",
            arms!(
                r#"<geom type="plane" size="2 2 1" pos="0 0 -0.3" conaffinity="1"/><body pos="0 0 -0.22"><freejoint/><geom size="0.1" contype="1"/></body></worldbody>
                <option iterations="2" solver="Newton"/>
                <tendon><spatial armature="0.2" range="0.3 0.6"><site site="l"/><site site="hub"/><site site="h"/></spatial>
                <fixed armature="0.05" frictionloss="0.3"><joint joint="turn" coef="0.5"/><joint joint="hand" coef="-2"/></fixed></tendon>"#
            ),
        )
    },
    Case {
        qvel: &[1.0, 2.0, -3.0, 0.5, 0.2, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..case(
            "armature with a low cap, CG",
            arms!(
                r#"<geom type="plane" size="2 2 1" pos="0 0 -0.3" conaffinity="1"/><body pos="0 0 -0.22"><freejoint/><geom size="0.1" contype="1"/></body></worldbody>
                <option iterations="49" tolerance="1e-14" solver="CG"/>
                <tendon><spatial armature="0.2" range="0.3 0.6"><site site="l"/><site site="hub"/><site site="h"/></spatial>
                <fixed armature="0.05" frictionloss="0.3"><joint joint="turn" coef="0.5"/><joint joint="hand" coef="-2"/></fixed></tendon>"#
            ),
        )
    },
    Case {
        qvel: &[0.3, 0.2, 0.0, 1.0, -0.5, 2.0, 1.0, 0.5, 0.2, -1.0],
        ..case(
            "armature on a body in flight, with Runge-Kutta",
            r#"<option integrator="RK4" gravity="0 0 -1"/><worldbody><site name="post" pos="-1 0 0.3"/><body><freejoint/>
            <geom type="capsule" size="0.04" fromto="0 0 0 0 0 -1"/><site name="a" pos="0.1 0 -0.3"/>
            <site name="b" pos="0.05 -0.08 -1.1"/><body pos="0 0 -1"><joint axis="0 -1 0" stiffness="20"/>
            <geom type="capsule" size="0.03" fromto="0 0 0 -0.6 0 0"/><body pos="-0.6 0 0"><joint type="ball" stiffness="20" armature="0.2"/>
            <site name="c" pos="0.03 0.1 0.15"/><geom type="box" size="0.03 0.1 0.15" pos="0 0 -0.05"/></body></body></body></worldbody>
            <tendon><spatial armature="9"><site site="a"/><site site="b"/><site site="c"/></spatial>
            <spatial armature="0.5"><site site="post"/><site site="c"/></spatial></tendon><sensor><e_kinetic/></sensor>"#,
        )
    },
    Case {
        qvel: &[0.5, -1.0, 2.0],
        ..case(
            "armature on a body of slides",
            r#"<worldbody><site name="post"/><body pos="1 0 0"><joint type="slide" damping="0.1"/><joint type="slide" axis="1 0 0"/>
            <joint axis="0 1 0"/><geom size="0.1" mass="1"/><site name="a" pos="0 0 0.05"/></body></worldbody>
            <tendon><spatial armature="5" stiffness="100" springlength="0.5"><site site="post"/><site site="a"/></spatial></tendon>"#,
        )
    },
    Case {
        qvel: &[3.0, 2.0, -3.0, 0.5, 0.2, -1.0],
        ..case(
            "limits and dry friction",
            arms!(
                r#"</worldbody><tendon><spatial name="a" range="0.3 0.5" margin="0.01"><site site="l"/><site site="hub"/><site site="r2"/></spatial>
                <spatial frictionloss="2"><site site="post"/><site site="h"/></spatial>
                <spatial name="b" limited="true" range="0 0.45" solreflimit="0.01 1"><site site="peg"/><site site="h"/></spatial></tendon>
                <sensor><tendonlimitpos tendon="b"/><tendonlimitvel tendon="b"/><tendonlimitfrc tendon="b"/><tendonlimitfrc tendon="a"/></sensor>"#
            ),
        )
    },
    Case {
        qvel: &[1.0, 2.0, -1.0, 0.5, 0.2, -1.0],
        ..case(
            "tied lengths",
            arms!(
                r#"</worldbody><tendon><spatial name="a"><site site="l"/><site site="hub"/></spatial>
                <spatial name="b"><site site="post"/><site site="r2"/></spatial>
                <spatial name="c"><site site="r1"/><site site="h"/></spatial>
                <fixed name="f"><joint joint="turn" coef="0.3"/></fixed></tendon>
                <equality><tendon tendon1="a"/><tendon tendon1="b" tendon2="f" polycoef="0 0.5 0.3"/>
                <tendon tendon1="f" tendon2="c" polycoef="0 1"/></equality>"#
            ),
        )
    },
    Case {
        qvel: &[0.0, 2.0, 12.0, 0.0, 0.0, 0.0],
        ..case(
            "around a wrist",
            arms!(
                r#"</worldbody><tendon><spatial name="over" stiffness="80" springlength="0.2"><site site="r1"/><geom geom="wrist" sidesite="cap"/>
            <site site="h"/></spatial>
            <spatial name="any" stiffness="50" springlength="0.1" damping="0.1"><site site="r1"/><geom geom="wrist"/><site site="h"/></spatial>
            </tendon><sensor><tendonpos tendon="over"/><tendonvel tendon="over"/><tendonpos tendon="any"/></sensor>"#
            ),
        )
    },
    case(
        "through a ring",
        arms!(
            r#"</worldbody><tendon><spatial name="in" stiffness="80" springlength="0.1"><site site="r1"/><geom geom="wrist" sidesite="core"/>
            <site site="h"/></spatial></tendon><sensor><tendonpos tendon="in"/><tendonvel tendon="in"/></sensor>"#
        ),
    ),
    Case {
        qvel: &[4.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        steps: 600,
        ..case(
            "around poles and balls that start and end to touch",
            r#"<default><joint damping="0.05" armature="0.002"/></default><worldbody><site name="anchor" pos="0 0 1"/><site name="side" pos="-0.1 0 0.3"/><site name="inner" pos="0.52 0 0.52"/>
            <geom name="pole" type="cylinder" size="0.08 0.5" pos="0 0 0.6" euler="90 20 0" contype="0" conaffinity="0"/>
            <geom name="tube" type="cylinder" size="0.1 0.5" pos="0.5 0 0.5" euler="90 0 10" contype="0" conaffinity="0"/>
            <body pos="0.02 0 0"><joint name="x" type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="slide" axis="0 1 0"/>
              <geom size="0.05" mass="1"/><site name="load" pos="0 0 0.05"/></body>
            <body pos="0.9 0 0.2"><joint axis="0 1 0"/><geom type="capsule" size="0.02" fromto="0 0 0 0.3 0 0" contype="0" conaffinity="0"/>
              <geom name="ball" size="0.07" pos="0.15 0.02 0" mass="0.2" contype="0" conaffinity="0"/>
              <site name="tip" pos="0.3 0 0.02"/>
              <body pos="0.3 0 0"><joint type="ball"/><geom size="0.04" pos="0.1 0 0"/><site name="end" pos="0.1 0 0.02"/></body></body>
            </worldbody><option integrator="implicitfast"/><tendon>
            <spatial name="a" stiffness="60" damping="0.5" springlength="0.4"><site site="anchor"/><geom geom="pole"/><site site="load"/></spatial>
            <spatial name="b" stiffness="5" damping="0.2" springlength="0.9"><site site="anchor"/><geom geom="pole" sidesite="side"/><site site="end"/></spatial>
            <spatial name="c" stiffness="10" springlength="0.2"><site site="load"/><geom geom="tube" sidesite="inner"/><site site="tip"/>
              <geom geom="ball"/><site site="anchor"/></spatial></tendon>
            <sensor><tendonpos tendon="a"/><tendonpos tendon="b"/><tendonpos tendon="c"/><tendonvel tendon="c"/></sensor>"#,
        )
    },
    case(
        "strings without length and strings that nothing moves",
        arms!(
            r#"<site name="hub2" pos="0 0 0"/><body><site name="still"/></body></worldbody>
            <tendon><spatial name="a" stiffness="10" damping="1"><site site="post"/><site site="peg"/></spatial>
            <spatial name="b" stiffness="5"><site site="hub2"/><site site="still"/><site site="r1"/></spatial>
            <spatial name="c" stiffness="5" range="0.01 0.02"><site site="r1"/><site site="r2"/></spatial></tendon>
            <sensor><tendonpos tendon="a"/><tendonvel tendon="a"/></sensor>"#
        ),
    ),
    Case {
        ctrl: &[6.0, 3.0, -8.0, -1.0],
        ..case(
            "bounded sums of forces",
            arms!(
                r#"</worldbody><option integrator="implicitfast"/><tendon>
                <spatial name="a" actuatorfrcrange="-1 2"><site site="post"/><site site="r2"/></spatial>
                <spatial name="b" actuatorfrcrange="-3 1"><site site="l"/><site site="hub"/></spatial></tendon>
                <actuator><motor tendon="a" forcerange="-1 1.5"/><velocity tendon="a" kv="2" gear="0.5"/>
                <motor tendon="b"/><general tendon="b" gaintype="affine" gainprm="2 0 1" forcerange="-1 9"/></actuator>
                <sensor><tendonactuatorfrc tendon="a"/><tendonactuatorfrc tendon="b"/></sensor>"#
            ),
        )
    },
    case(
        "switched off",
        arms!(
            r#"</worldbody><option><flag spring="disable" limit="disable" damper="disable"/></option>
            <tendon><spatial stiffness="10" damping="1" range="0.1 0.2"><site site="post"/><site site="h"/></spatial></tendon>"#
        ),
    ),
];

#[test]
fn strings_move_as_in_mujoco() {
    compare(CASES);
}
