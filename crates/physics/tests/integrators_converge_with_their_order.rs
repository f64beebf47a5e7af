//! Promise: half the time step gives half the error with Euler, implicit and implicitfast, and a sixteenth with Runge-Kutta.
//!
//! The motions are smooth: a chain of every kind of joint on a tumbling body, with springs, dampers, motors with
//! activations and a medium, and a free top. The reference is Runge-Kutta with a far smaller step.

use crate::common::numbers::distance;
use marathon_physics::model::Integrator;
use marathon_physics::{Group, Model, Sim, SimOptions, Work};

const CHAIN: &str = r#"<mujoco>
  <option gravity="0.5 1 -4"/>
  <worldbody>
    <body pos="0 0 1"><freejoint/><geom type="box" size=".1 .2 .3" contype="0" conaffinity="0"/>
      <body pos=".3 0 .1"><joint name="h" axis="1 2 0" damping=".5" stiffness="3"/><joint name="s" type="slide" axis="0 1 1"
            damping="2" stiffness="40"/><geom type="capsule" size=".05 .2" pos=".1 0 .1" contype="0" conaffinity="0"/>
        <body pos="0 .3 0"><joint name="b" type="ball" damping=".1" stiffness="1" pos="0 .05 0"/>
          <geom type="ellipsoid" size=".1 .05 .15" contype="0" conaffinity="0"/></body></body></body>
    <body pos="3 0 0"><freejoint/><geom type="box" size=".3 .1 .05" contype="0" conaffinity="0"/></body>
  </worldbody>
  <actuator>
    <general joint="h" dyntype="filter" dynprm=".2" gainprm="3"/>
    <general joint="s" dyntype="integrator" gainprm="2"/>
    <velocity joint="h" kv=".3"/>
    <motor joint="b" gear=".1 .2 .1 0 0 0"/>
  </actuator>
</mujoco>"#;

/// Positions and velocities after 0.64 s.
fn play(integrator: Integrator, step: f64) -> Vec<f64> {
    let mut model = Model::from_xml_str(CHAIN, "chain").unwrap_or_else(|e| panic!("{e}"));
    model.opt.timestep = step;
    model.opt.integrator = integrator;
    (model.opt.density, model.opt.viscosity) = (50.0, 0.5);
    let sim = Sim::<f64>::new(&model, SimOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let (mut work, mut group) = (Work::new(&sim), Group::new(&sim));
    let qvel: Vec<f64> = (0..model.nv).map(|d| 2.0 * (1.3 * d as f64 + 0.5).sin()).collect();
    group.reset_lane(&sim, 0, &model.qpos0, &qvel);
    group.ctrl.copy_from_slice(&[0.5, -0.7, 0.4, 0.6]);
    sim.step(&mut work, &mut group, (0.64 / step).round() as usize);
    [group.qpos.clone(), group.qvel.clone(), group.act.clone()].concat()
}

#[test]
fn integrators_converge_with_their_order() {
    let euler = [Integrator::Euler, Integrator::Implicit, Integrator::ImplicitFast].map(|integrator| (integrator, 1.0));
    let truth = play(Integrator::Rk4, 6.25e-4);
    for (integrator, order) in euler.into_iter().chain([(Integrator::Rk4, 4.0)]) {
        let steps = if integrator == Integrator::Rk4 { [0.02, 0.01, 0.005] } else { [0.002, 0.001, 0.0005] };
        let errors = steps.map(|h| distance(&play(integrator, h), &truth, 0.0));
        for pair in errors.windows(2) {
            let found = (pair[0] / pair[1]).log2();
            println!("{integrator:?}: errors {errors:?}, order {found:.3}");
            assert!((found - order).abs() < 0.25, "{integrator:?}: errors {errors:?}, order {found}, not {order}");
        }
    }
}
