//! Inverse dynamics equals MuJoCo's `mj_inverse` without contacts, and so do momentum and center of mass. A character
//! thrown into the air flies freely, and the ground carries one that stands.

use crate::common::{self, model, oracle, rows, shipped, waves};
use marathon_motion::dynamics::{Motion, inverse};
use marathon_motion::{About, Clip, Cycle, Layout, contacts, efforts, soles};
use marathon_physics::Model;
use serde_json::json;

#[test]
fn forces_and_momentum_are_mujocos() {
    for name in ["marathon_man", "humanoid", "walker2d"] {
        let model = model(name);
        let clips = if name == "walker2d" {
            vec![shipped(name, "run")]
        } else {
            vec![shipped(name, "run"), waves(&model, 40, Cycle { pos: [1.0, 0.5], yaw: 0.7 })]
        };
        for clip in clips {
            let unit = |qpos: &[f64]| {
                let mut qpos = qpos.to_vec();
                if model.nq > model.nv {
                    let length = qpos[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
                    qpos[3..7].iter_mut().for_each(|x| *x /= length);
                }
                qpos
            };
            let frames: Vec<[Vec<f64>; 3]> = (0..clip.frames())
                .map(|i| [unit(clip.frame(i)), clip.velocity(i).to_vec(), clip.acceleration(i)])
                .collect();
            let path = common::file(&format!("assets/agents/{name}.xml"));
            let answer = oracle("motion_forces.py", &json!({ "model": path, "states": frames }));
            let (forces, momenta) = (rows(&answer["qfrc_inverse"]), rows(&answer["momentum"]));
            for (i, [qpos, qvel, qacc]) in frames.iter().enumerate() {
                let ours = inverse(&model, qpos, qvel, qacc);
                let size = forces[i].iter().fold(1.0_f64, |most, force| most.max(force.abs()));
                for (dof, (ours, theirs)) in ours.iter().zip(&forces[i]).enumerate() {
                    assert!((ours - theirs).abs() < 1e-9 * size, "{name} {i} dof {dof}: {ours}, MuJoCo {theirs}");
                }
                let (com, velocity, spin) = Motion::of(&model, qpos, qvel, qacc).momentum(&model);
                let ours = [com, velocity, spin].map(|v| v.to_array()).concat();
                for (k, (ours, theirs)) in ours.iter().zip(&momenta[i]).enumerate() {
                    assert!((ours - theirs).abs() < 1e-9, "{name} {i} momentum {k}: {ours}, MuJoCo {theirs}");
                }
            }
        }
    }
}

/// A box of 2 kg with a heavy arm and a motor of 3 N m between them. A function of time sets its height.
fn thrown_box(height: impl Fn(f64) -> f64) -> (Model, Clip) {
    box_with_arm(0.5, height)
}

/// The same with the length of the arm in meters.
fn box_with_arm(length: f64, height: impl Fn(f64) -> f64) -> (Model, Clip) {
    let xml = format!(
        "<mujoco model='box'><worldbody><body name='box'><freejoint name='root'/><geom type='box' size='.5 .5 .1' mass='2'/>\
        <body name='arm'><joint name='arm' axis='0 1 0'/><geom type='capsule' fromto='0 0 0 {length} 0 0' size='.02' mass='1'/>\
        </body></body></worldbody><actuator><motor joint='arm' ctrllimited='true' ctrlrange='-1 1' gear='3'/></actuator></mujoco>"
    );
    let model = Model::from_xml_str_with(&xml, "box.xml", &|_| Err(String::new())).expect("a model");
    let row = |i: usize| vec![0.0, 0.0, height(i as f64 / 60.0), 1.0, 0.0, 0.0, 0.0, 0.0];
    let rows: Vec<Vec<f64>> = (0..30).map(row).collect();
    let about = About { model: "box".into(), ..About::default() };
    let clip = Clip::new("box".as_ref(), about, Layout::of(&model), 1.0 / 60.0, None, &rows).expect("a clip");
    (model, clip)
}

#[test]
fn a_thrown_figure_flies_and_a_floating_one_is_carried_by_nothing() {
    let (model, thrown) = thrown_box(|t| 2.0 + 1.5 * t - 0.5 * 9.81 * t * t);
    let found = efforts("thrown".as_ref(), &thrown, &model).expect("efforts");
    let [flight] = &found.flights[..] else { panic!("{:?}", found.flights) };
    assert!((flight.acceleration[2] + 9.81).abs() < 1e-6, "{flight:?}");
    assert!(flight.gained.iter().all(|gained| gained.abs() < 1e-9), "{flight:?}");
    // one-sided differences at the ends give half of the acceleration
    let (model, floating) = thrown_box(|_| 2.0);
    let found = efforts("floating".as_ref(), &floating, &model).expect("efforts");
    assert!((found.missing.value - 1.0).abs() < 1e-6, "{:?}", found.missing);
    assert!(found.flights[0].acceleration[2].abs() < 1e-9);
}

#[test]
fn the_ground_carries_what_lies_on_it_and_the_arm_takes_its_torque() {
    let (model, lying) = thrown_box(|_| 0.1);
    let found = efforts("lying".as_ref(), &lying, &model).expect("efforts");
    assert!(found.missing.value < 0.01, "{:?}", found.missing);
    // the arm's own weight at half of its length: 1 kg at 0.25 m
    let [arm] = &found.joints[..] else { panic!("{:?}", found.joints) };
    assert!(arm.joint == "arm" && (arm.needed - 9.81 * 0.25).abs() < 0.01 && arm.strength == 3.0, "{arm:?}");
    assert_eq!(arm.beyond, 0.0);
}

#[test]
fn nothing_holds_what_leans_out_beyond_its_support() {
    // the arm's middle is at half of its length: the center of mass at a sixth, and the box's edge at 0.5 m
    let moment = |length: f64| {
        let (model, leaning) = box_with_arm(length, |_| 0.1);
        efforts("leaning".as_ref(), &leaning, &model).expect("efforts").unbalanced.value
    };
    let [within, beyond, far] = [2.4, 4.0, 6.0].map(moment);
    assert!(within < 0.01, "{within}");
    // a sixth to a quarter of it counts as a missing force instead, by the weights of the same least squares
    for (found, exact) in [(beyond, 4.0 / 6.0 - 0.5), (far, 6.0 / 6.0 - 0.5)] {
        assert!(found > 0.7 * exact && found < exact, "{found} of {exact}");
    }
}

#[test]
fn walking_needs_no_more_than_the_ground_and_the_motors_have() {
    let model = model("marathon_man");
    let walk = shipped("marathon_man", "walk");
    let found = efforts("walk".as_ref(), &walk, &model).expect("efforts");
    assert_eq!(found.joints.len(), 21);
    assert!(found.flights.is_empty());
    let stands = contacts("walk".as_ref(), &walk, &model, &soles(&model)).expect("contacts");
    let alone = |foot: usize| stands.iter().filter(|stands| stands[foot] && !stands[1 - foot]).count();
    assert_eq!(stands.len(), walk.frames());
    assert!(stands.iter().all(|stands| stands[0] || stands[1]), "a walk never flies");
    assert!(alone(0) > 10 && alone(1) > 10, "each leg swings: {} and {}", alone(0), alone(1));
}
