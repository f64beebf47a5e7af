//! Comparison of simulated motions with their clips, with known results.

use marathon_motion::{Places, Tracking};
use marathon_physics::Model;

/// A pelvis that travels, with a chest above it and two legs that end in feet.
const XML: &str = r#"<mujoco model="legs"><worldbody>
  <body name="pelvis" pos="0 0 1"><freejoint/>
    <geom type="sphere" size="0.1"/>
    <body name="chest" pos="0 0 0.3"><joint name="waist" axis="0 1 0"/><geom type="sphere" size="0.1" pos="0 0 0.2"/></body>
    <body name="left_foot" pos="0 0.1 -0.9"><joint name="left" axis="0 1 0"/>
      <geom type="capsule" size="0.05" fromto="-0.1 0 -0.05 0.1 0 -0.05"/></body>
    <body name="right_foot" pos="0 -0.1 -0.9"><joint name="right" axis="0 1 0"/>
      <geom type="capsule" size="0.05" fromto="-0.1 0 -0.05 0.1 0 -0.05"/></body>
  </body>
</worldbody></mujoco>"#;

fn model() -> Model {
    Model::from_xml_str(XML, "legs").unwrap()
}

/// A pose at `x`, turned by `pitch` about the lateral axis.
fn pose(model: &Model, x: f64, pitch: f64) -> Vec<f64> {
    let mut qpos = model.qpos0.clone();
    qpos[0] = x;
    qpos[3..7].copy_from_slice(&[libm::cos(0.5 * pitch), 0.0, libm::sin(0.5 * pitch), 0.0]);
    qpos
}

#[test]
fn places_are_seen_from_the_pelvis() {
    let model = model();
    let tracking = Tracking::new(&model);
    let (here, there) = (tracking.places(&pose(&model, 0.0, 0.0)), tracking.places(&pose(&model, 5.0, 0.0)));
    // chest and its end, feet and their ends
    assert_eq!(here.len(), 6);
    assert!(here.iter().zip(&there).all(|(a, b)| a.distance(*b) < 1e-12), "travelling makes no difference");
    assert!((here[1].z - 0.5).abs() < 1e-12 && (here[3].z + 0.95).abs() < 1e-12, "{here:?}");
}

#[test]
fn the_pose_error_forgives_delays_and_counts_every_point() {
    let model = model();
    let tracking = Tracking::new(&model);
    let wave = |delay: f64, bend: f64| -> Vec<Places> {
        let at = |i: usize| {
            let mut qpos = pose(&model, 0.0, 0.0);
            qpos[7] = 0.5 * libm::sin(0.2 * (i as f64 - delay).max(0.0));
            qpos[8] = bend;
            tracking.places(&qpos)
        };
        (0..100).map(at).collect()
    };
    let clip = wave(0.0, 0.0);
    assert!(tracking.pose_error(&clip, &clip).unwrap() < 1e-12);
    // without warping, a delay of 5 of 31 frames costs 0.04 m
    let late = tracking.pose_error(&wave(5.0, 0.0), &clip).unwrap();
    assert!(late < 3e-3, "{late}");
    // one of the six points is 0.05 m from its joint, which is bent by 60 degrees: it is 0.05 m off
    let bent = tracking.pose_error(&wave(0.0, std::f64::consts::FRAC_PI_3), &clip).unwrap();
    assert!((bent - 0.05 / 6.0).abs() < 1e-9, "{bent}");
    assert_eq!(tracking.pose_error(&[], &clip), None);
}

#[test]
fn flips_are_counted_when_they_are_complete() {
    let model = model();
    let tracking = Tracking::new(&model);
    let turned = |to: f64| -> Vec<Vec<f64>> {
        (0..=100).map(|i| pose(&model, 0.0, to * std::f64::consts::TAU * f64::from(i) / 100.0)).collect()
    };
    for (turns, flips) in [(0.1, 0), (0.6, 0), (1.0, 1), (-2.0, 2), (-2.6, 2)] {
        assert_eq!(tracking.flips(&turned(turns)), flips, "{turns} turns");
    }
    // leaning forward and back is not a flip if the pelvis was never upside down
    let rocking: Vec<Vec<f64>> = (0..100).map(|i| pose(&model, 0.0, 1.5 * libm::sin(0.3 * f64::from(i)))).collect();
    assert_eq!(tracking.flips(&rocking), 0);
}

#[test]
fn slides_are_the_way_of_soles_that_stand() {
    let model = model();
    let tracking = Tracking::new(&model);
    let dt = 0.025;
    // 0.1 m/s for half a second on the ground, then a jump, then half a second of standing
    let frame = |i: usize| {
        let mut qpos = pose(&model, 0.1 * dt * i.min(20) as f64, 0.0);
        qpos[2] = if (20..30).contains(&i) { 1.3 } else { 1.0 };
        qpos
    };
    let frames: Vec<Vec<f64>> = (0..50).map(frame).collect();
    let mut slides = tracking.slides(&frames, dt);
    slides.sort_by(f64::total_cmp);
    // two ends of two feet, twice
    assert_eq!(slides.len(), 8, "{slides:?}");
    assert!(slides[..4].iter().all(|way| *way < 1e-12), "{slides:?}");
    assert!(slides[4..].iter().all(|way| (way - 0.0475).abs() < 1e-9), "{slides:?}");
    assert!(tracking.slides(&[], dt).is_empty());
}
