//! A medium acts on boxes and ellipsoids as in MuJoCo.
//!
//! Bodies with every shape fall, turn and swing through a medium with wind, with every integrator. Double precision
//! follows MuJoCo's states, sensors and accelerations every ten steps. From MuJoCo's states, the other lane types find
//! the same accelerations up to their rounding.

use crate::motions::{Case, case, compare};

/// A body of every shape in flight, and a chain with two more bodies.
macro_rules! shapes {
    ($option:literal, $class:literal) => {
        concat!(
            "<option timestep=\"0.004\" ",
            $option,
            "/><default><geom contype=\"0\" conaffinity=\"0\" density=\"300\" fluidshape=\"ellipsoid\" ",
            $class,
            r#"/></default><asset><mesh name="wedge" vertex="0 0 0 .3 0 0 0 .2 0 0 0 .1"/></asset><worldbody>
            <body pos="0 0 1"><freejoint/><geom type="ellipsoid" size=".1 .2 .03"/></body>
            <body pos="1 0 1"><freejoint/><geom type="box" size=".1 .15 .02" pos="0.05 0 0.02" euler="10 20 0"/>
              <geom type="capsule" size=".03 .2" pos="0 0.1 0"/><body pos="-0.2 0 0"><geom type="ellipsoid" size="0.05 0.1 0.02" euler="0 30 0"/></body></body>
            <body pos="3 0 1" euler="0 0 30"><joint axis="1 0 0.2"/><geom type="cylinder" size=".04 .2" pos="0 0 -0.2" euler="10 0 0"/>
              <body pos="0 0 -0.4"><joint type="ball" damping="0.01"/><geom type="sphere" size="0.05"/><geom type="capsule" size="0.02" fromto="0 0 0 0.2 0 -0.1" fluidshape="none"/>
                <body pos="0.2 0 -0.1"><joint axis="0 1 0"/><geom type="box" size="0.08 0.05 0.01" pos="0.05 0 0" fluidshape="none"/></body></body></body>
            <body pos="4 0 1"><freejoint/><geom type="mesh" mesh="wedge"/></body></worldbody>"#,
        )
    };
}

/// Velocities of these bodies.
const FAST: &[f64] = &[
    1.0, -2.0, 0.5, 3.0, 5.0, -2.0, 0.5, 1.0, -1.0, -4.0, 2.0, 3.0, 2.0, 1.0, -3.0, 2.0, 1.0, 2.0, -1.0, 0.5, 3.0, 2.0,
    -2.0,
];

const CASES: &[Case] = &[
    Case { qvel: FAST, ..case("Euler", shapes!("density=\"20\" viscosity=\"0.1\" wind=\"1 0.5 -2\"", "")) },
    Case { qvel: FAST, ..case("Runge-Kutta", shapes!("integrator=\"RK4\" density=\"20\" viscosity=\"0.1\"", "")) },
    Case {
        qvel: FAST,
        ..case("implicit", shapes!("integrator=\"implicit\" density=\"20\" viscosity=\"0.1\" wind=\"1 0.5 -2\"", ""))
    },
    Case {
        qvel: FAST,
        ..case(
            "implicitfast",
            shapes!("integrator=\"implicitfast\" density=\"20\" viscosity=\"0.1\" wind=\"1 0.5 -2\"", ""),
        )
    },
    Case {
        qvel: FAST,
        ..case(
            "given coefficients",
            shapes!("integrator=\"implicit\" density=\"50\"", "fluidcoef=\"0.3 0.1 2 0.5 1.5\""),
        )
    },
    Case { qvel: FAST, ..case("some coefficients", shapes!("density=\"50\"", "fluidcoef=\"0.3 0.1\"")) },
    Case { qvel: FAST, ..case("viscosity only", shapes!("integrator=\"implicitfast\" viscosity=\"0.5\"", "")) },
    Case { qvel: FAST, ..case("no medium", shapes!("integrator=\"implicitfast\"", "")) },
    case(
        "a leaf, implicit",
        r#"<option timestep="0.003" density="1.225" viscosity="1.8e-5" integrator="implicit"/><default><geom type="ellipsoid" size=".025 .01 0.001"
            mass="1e-4" fluidshape="ellipsoid"/></default><worldbody><body euler="50 50 0"><freejoint/><geom pos=".025 0 0" euler="10 0 0"/>
            <geom pos="-.025 0 0" euler="-14 0 0" mass="1.2e-4"/></body></worldbody>"#,
    ),
    case(
        "a leaf, implicitfast",
        r#"<option timestep="0.003" density="1.225" viscosity="1.8e-5" integrator="implicitfast"/><default><geom type="ellipsoid" size=".025 .01 0.001"
            mass="1e-4" fluidshape="ellipsoid"/></default><worldbody><body euler="50 50 0"><freejoint/><geom pos=".025 0 0" euler="10 0 0"/>
            <geom pos="-.025 0 0" euler="-14 0 0" mass="1.2e-4"/></body></worldbody>"#,
    ),
];

#[test]
fn media_move_as_in_mujoco() {
    compare(CASES);
}
