//! The integrators `implicit` and `implicitfast` move models as in MuJoCo, in a medium and without one.
//!
//! Small models with every kind of joint, actuators, tendons and constraints spin fast. Double precision follows
//! MuJoCo's states, sensors and accelerations every ten steps.

use crate::motions::{Case, case, compare};

/// A chain of every kind of joint on a body that `$root` moves, an arm beside it, and a body that stands alone.
macro_rules! chain {
    ($option:literal, $root:literal, $more:literal) => {
        concat!(
            "<option gravity=\"0.5 1 -4\" timestep=\"0.004\" ",
            $option,
            r#"/><default><geom contype="0" conaffinity="0"/></default><worldbody><site name="post" pos="0.2 -0.3 1.4"/><body name="root" pos="0 0 1">"#,
            $root,
            r#"<geom type="box" size=".1 .2 .3"/><site name="hub" pos="0.1 0.1 0.2"/>
              <body pos=".3 0 .1"><joint name="h" axis="1 2 0" damping=".5" stiffness="3" armature="0.01"/><joint name="s" type="slide" axis="0 1 1"
                damping="2" stiffness="40"/><geom type="capsule" size=".05 .2" pos=".1 0 .1"/><site name="a" pos="0.1 0.1 0.2"/>
                <body pos="0 .3 0"><joint name="b" type="ball" damping=".1" stiffness="1" pos="0 .05 0"/>
                  <geom type="ellipsoid" size=".1 .05 .15"/><site name="e" pos="0 0.1 0"/></body></body>
              <body name="arm" pos="-.2 0 0" euler="10 20 30"><joint name="k" axis="0 1 0.3" frictionloss="0.1"/><joint name="l" axis="1 0 0" pos="0 0.05 0"/>
                <geom type="capsule" size=".04" fromto="0 0 0 -0.3 0.1 0"/><body pos="-0.3 0 0"><geom size="0.06" pos="0 0 0.1"/></body>
                <site name="d" pos="-0.2 0 0.1"/></body></body>
            <body pos="3 0 0"><freejoint/><geom type="box" size=".3 .1 .05"/><geom size="0.1" pos="0.2 0.1 0.1"/></body>
            <body pos="6 0 0"><freejoint/><geom type="box" size=".2 .1 .05"/></body>
            <body pos="4 0 0"><joint type="slide" axis="1 0 0" damping="1"/><joint type="slide" axis="0 1 0"/><joint axis="0 0 1"/><geom size=".1"/></body></worldbody>"#,
            $more,
        )
    };
}

/// Velocities for a chain on a free body.
const FREE: &[f64] = &[
    0.3, -0.2, 0.5, 2.0, -3.0, 1.0, 2.0, 0.3, 3.0, -1.0, 2.0, 1.0, -2.0, 1.0, 0.5, -0.5, 4.0, 2.0, -5.0, 0.5, 0.0, 1.0,
    1.0, 2.0, 3.0, 0.4, -0.6, 2.0,
];
/// Velocities for a chain on a turntable.
const FIXED: &[f64] = &[
    2.0, 2.0, 0.3, 3.0, -1.0, 2.0, 1.0, -2.0, 1.0, 0.5, -0.5, 4.0, 2.0, -5.0, 0.5, 0.0, 1.0, 1.0, 2.0, 3.0, 0.4, -0.6,
    2.0,
];

const CASES: &[Case] = &[
    Case { qvel: FREE, ..case("implicit in flight", chain!(r#"integrator="implicit""#, "<freejoint/>", "")) },
    Case {
        qvel: FREE,
        ctrl: &[0.5, -0.7, 0.4, 0.3, 0.2, 0.6],
        ..case(
            "implicit in a medium, with actuators and tendons",
            chain!(
                r#"integrator="implicit" density="20" viscosity="0.3" wind="1 0.5 -2""#,
                "<freejoint/>",
                r#"<tendon><spatial name="t" damping="3" stiffness="5"><site site="e"/><site site="hub"/><site site="d"/></spatial>
                <fixed name="f" damping="0.3" armature="0.02"><joint joint="h" coef="1"/><joint joint="s" coef="-2"/></fixed>
                <spatial armature="0.1"><site site="post"/><site site="e"/></spatial></tendon>
                <actuator><velocity joint="h" kv="0.3"/><position tendon="t" kp="20" kv="1"/><damper site="d" kv="2" gear="0 0 1 0.1 0 0" ctrlrange="0 1"/>
                <general joint="k" dyntype="filter" dynprm="0.1" gaintype="affine" gainprm="1 0.2 -0.3" biastype="affine" biasprm="0 -1 -0.2"/>
                <position site="e" refsite="post" kp="3" kv="0.4" gear="0.5 1 0 0 0 0"/><velocity joint="l" kv="5" forcerange="-0.2 0.2"/></actuator>
                <sensor><e_kinetic/><accelerometer site="e"/><force site="a"/></sensor>"#
            ),
        )
    },
    Case {
        qvel: FIXED,
        ..case(
            "implicit with constraints",
            chain!(
                r#"integrator="implicit""#,
                r#"<joint axis="0.2 0 1" damping="0.05"/>"#,
                r#"<equality><joint joint1="k" joint2="h"/><connect body1="arm" anchor="-0.3 0 0"/></equality>
                <tendon><spatial range="0.2 0.5"><site site="post"/><site site="a"/></spatial></tendon>"#
            ),
        )
    },
    Case {
        qvel: FIXED,
        ..case(
            "implicit with a low cap",
            chain!(
                r#"integrator="implicit" iterations="2" density="20""#,
                r#"<joint axis="0.2 0 1" damping="0.05"/>"#,
                r#"<equality><joint joint1="k" joint2="h"/></equality>"#
            ),
        )
    },
    Case {
        qvel: FIXED,
        ctrl: &[1.0, 3.0, 0.5],
        ..case(
            "implicit with bounded forces on joints",
            chain!(
                r#"integrator="implicit" viscosity="0.1""#,
                r#"<joint axis="0.2 0 1" damping="0.05"/>"#,
                r#"<default><joint actuatorfrcrange="-0.3 0.3"/></default><actuator><velocity joint="h" kv="3"/>
                <position site="e" refsite="post" kp="30" kv="2" gear="0.5 1 0 0 0 0"/><position joint="k" kp="2" kv="1"/></actuator>"#
            ),
        )
    },
    Case {
        qvel: FREE,
        ..case(
            "implicitfast in a medium",
            chain!(r#"integrator="implicitfast" density="20" viscosity="0.3" wind="1 0.5 -2""#, "<freejoint/>", ""),
        )
    },
    Case {
        qvel: FIXED,
        ctrl: &[0.5, -0.7, 0.4],
        ..case(
            "implicitfast in a medium, with actuators and tendons",
            chain!(
                r#"integrator="implicitfast" density="30""#,
                r#"<joint axis="0.2 0 1" damping="0.05"/>"#,
                r#"<tendon><spatial name="t" damping="3" stiffness="5"><site site="e"/><site site="hub"/><site site="d"/></spatial></tendon>
                <actuator><velocity joint="h" kv="0.3"/><position tendon="t" kp="20" kv="1"/><damper site="d" kv="2" gear="0 0 1 0.1 0 0" ctrlrange="0 1"/></actuator>"#
            ),
        )
    },
    Case {
        qvel: FREE,
        ..case(
            "no passive forces in a medium",
            chain!(
                r#"integrator="implicitfast" density="30""#,
                "<freejoint/>",
                r#"<option><flag spring="disable" damper="disable"/></option>"#
            ),
        )
    },
];

#[test]
fn implicit_integrators_move_as_in_mujoco() {
    compare(CASES);
}
