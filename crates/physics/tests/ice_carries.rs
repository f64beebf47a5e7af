//! Promise: slippery ground carries bodies, in single precision too, for any shape and cone.
//!
//! The edges of a pyramid of friction are stiffer the flatter it is. In single precision, its sliding coefficients are at least
//! 0.01; see `docs/research/physics-agreement.md`.

use marathon_physics::lanes::Real;
use marathon_physics::{Group, Isa, Model, Sim, SimOptions, Variation, Work, with_lanes};

const SHAPES: [&str; 5] = [
    r#"type="sphere" size="0.1""#,
    r#"type="capsule" size="0.1 0.2" euler="90 0 0""#,
    r#"type="box" size="0.1 0.1 0.1""#,
    r#"type="cylinder" size="0.1 0.1""#,
    r#"type="ellipsoid" size="0.1 0.1 0.1""#,
];

/// Lowest height within a second and a half, after a drop from 0.2 m onto the ground, m; 0.1 at rest.
fn lowest<T: Real>(model: &Model, factor: Option<f64>) -> f64 {
    let sim = Sim::<T>::new(model, SimOptions::default()).expect("a simulation");
    let (mut group, mut work) = (Group::new(&sim), Work::new(&sim));
    group.reset_lane(&sim, 0, &model.qpos0, &vec![0.0; model.nv]);
    if let Some(friction) = factor {
        group.vary(&sim, 0, &Variation { friction, ..Variation::none(model) });
    }
    let mut low = f64::INFINITY;
    for _ in 0..750 {
        sim.step(&mut work, &mut group, 1);
        low = low.min(T::widen(group.qpos[2].get(0)));
    }
    low
}

fn model(shape: &str, cone: &str, friction: f64) -> Model {
    let xml = format!(
        r#"<mujoco><option cone="{cone}"/><default><geom friction="{friction} 0 0"/></default><worldbody>
        <geom type="plane" size="0 0 1"/><body pos="0 0 0.2"><freejoint/><geom {shape}/></body></worldbody></mujoco>"#
    );
    Model::from_xml_str(&xml, "ice.xml").expect("a model")
}

#[test]
fn ice_carries() {
    for shape in SHAPES {
        for cone in ["pyramidal", "elliptic"] {
            for friction in [0.0, 1e-5, 1e-3, 3e-3] {
                let ice = model(shape, cone, friction);
                let low = with_lanes!(Isa::best(), T => lowest::<T>(&ice, None));
                assert!(low > 0.09, "{shape}, {cone}, friction {friction}: {low} m");
            }
        }
    }
}

#[test]
fn ground_that_becomes_ice_carries() {
    for shape in SHAPES {
        for cone in ["pyramidal", "elliptic"] {
            let ground = model(shape, cone, 1.0);
            for factor in [0.0, 1e-3] {
                let single = with_lanes!(Isa::best(), T => lowest::<T>(&ground, Some(factor)));
                let double = lowest::<f64>(&ground, Some(factor));
                assert!(single.min(double) > 0.09, "{shape}, {cone}, factor {factor}: {single} m, {double} m");
            }
        }
    }
}
