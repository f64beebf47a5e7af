//! The following camera keeps a character in the picture without shaking and without lag.

use crate::common;
use marathon_render::{Follow, Scene};

#[test]
fn follows_a_steady_run_without_lag_and_ignores_the_bobbing() {
    let model = common::model("shapes.xml");
    let scene = Scene::new(&model);
    let mut follow = Follow::new(&scene, 1, 640, 360);
    let dt = 1.0 / 30.0;
    let (mut offsets, mut heights) = (Vec::new(), Vec::new());
    for i in 0..240 {
        let t = f64::from(i) * dt;
        let mut qpos = model.qpos0.clone();
        qpos[0] = 3.0 * t;
        qpos[2] += 0.05 * (15.0 * t).sin();
        let frame = scene.frame(&[&qpos]).unwrap();
        let camera = follow.update(&frame, dt);
        if t > 4.0 {
            offsets.push(camera.target[0] - frame.agents()[0].com[0]);
            heights.push(camera.target[2]);
        }
    }
    let span = |values: &[f64]| {
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
        (low, high)
    };
    let (low, high) = span(&offsets);
    assert!(low > -0.02 && high < 0.02, "offset from {low} to {high} m");
    let (low, high) = span(&heights);
    assert!(high - low < 0.02, "the camera bobs by {} m", high - low);
}

#[test]
fn who_turns_aside_stays_in_the_picture_and_who_sways_does_not_move_it() {
    let model = common::model("shapes.xml");
    let scene = Scene::new(&model);
    let mut follow = Follow::new(&scene, 1, 640, 360);
    let dt = 1.0 / 30.0;
    let mut at = |y: f64, dt: f64| {
        let mut qpos = model.qpos0.clone();
        qpos[1] += y;
        follow.update(&scene.frame(&[&qpos]).unwrap(), dt).target[1]
    };
    let first = at(0.0, dt);
    for i in 0..60 {
        assert_eq!(at(0.9 * (f64::from(i) * 0.3).sin(), dt), first);
    }
    let mut last = first;
    for i in 0..300 {
        last = at(-0.1 * f64::from(i), dt);
    }
    assert!((last - first + 28.9).abs() < 0.2, "{last}");
    // after a jump in time, too, the start position is kept
    assert!((at(8.0, 5.0) - first - 7.0).abs() < 1e-9);
    assert!((at(0.0, 5.0) - first).abs() < 1e-9);
}

#[test]
fn first_frame_and_odd_time_steps_are_sane() {
    let model = common::model("shapes.xml");
    let scene = Scene::new(&model);
    let mut far = model.qpos0.clone();
    far[0] = 1000.0;
    let frame = scene.frame(&[&far, &far]).unwrap();
    let start = scene.frame(&[&model.qpos0, &model.qpos0]).unwrap();
    for dt in [0.0, 1e-6, 0.5, 10.0, -1.0, 1e300, f64::NAN, f64::INFINITY] {
        let mut follow = Follow::new(&scene, 2, 640, 360);
        let jump = follow.update(&frame, dt);
        assert!((jump.target[0] - frame.agents()[0].com[0]).abs() < 1e-6, "dt {dt}: {jump:?}");
        // a reset of the character must not move the camera beyond the two positions
        for _ in 0..50 {
            let camera = follow.update(&start, dt);
            assert!((-200.0..=1001.0).contains(&camera.target[0]), "dt {dt}: {camera:?}");
            assert!(camera.eye.iter().all(|x| x.is_finite()), "dt {dt}: {camera:?}");
        }
    }
    let nobody = scene.frame::<Vec<f64>>(&[]).unwrap();
    let camera = Follow::new(&scene, 0, 640, 360).update(&nobody, 0.1);
    assert!(camera.eye.iter().all(|x| x.is_finite()), "{camera:?}");
}
