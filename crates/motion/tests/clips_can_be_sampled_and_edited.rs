//! A clip's velocities match its positions, cycles continue without a seam, edits have their documented effect, and
//! files keep every bit.

use crate::common::{all_shipped, model, shipped, wave, waves};
use glam::{DQuat, DVec3};
use marathon_motion::kinematics::Pose;
use marathon_motion::{Clip, Cycle};
use marathon_physics::Model;

const CYCLES: [Cycle; 3] =
    [Cycle { pos: [1.3, 0.2], yaw: 0.0 }, Cycle { pos: [0.9, 0.0], yaw: 0.7 }, Cycle { pos: [-0.4, 0.0], yaw: -2.1 }];

fn qpos(clip: &Clip, time: f64) -> Vec<f64> {
    let mut out = vec![0.0; clip.layout().nq()];
    clip.qpos(time, &mut out);
    out
}

fn qvel(clip: &Clip, time: f64) -> Vec<f64> {
    let mut out = vec![0.0; clip.layout().nv()];
    clip.qvel(time, &mut out);
    out
}

/// The largest difference between two poses. Quaternions of opposite sign are equal.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let dot: f64 = (3..7).map(|k| a[k] * b[k]).sum();
    let sign = if dot < 0.0 { -1.0 } else { 1.0 };
    let off = |k: usize| if (3..7).contains(&k) { (a[k] - sign * b[k]).abs() } else { (a[k] - b[k]).abs() };
    (0..a.len()).map(off).fold(0.0, f64::max)
}

#[test]
fn positions_and_velocities_are_those_of_the_motion_sampled() {
    let model = model("humanoid");
    for cycle in CYCLES {
        let clip = waves(&model, 240, cycle);
        for i in 0..100 {
            let time = 0.0137 * f64::from(i) % 1.0;
            let off = difference(&qpos(&clip, time), &wave(&model, time, cycle));
            assert!(off < 5e-4, "{cycle:?} at {time}: {off}");
            // the true velocity, from differences of the motion
            let h = 1e-5;
            let (a, b) = (wave(&model, time - h, cycle), wave(&model, time + h, cycle));
            let ours = qvel(&clip, time);
            for k in 0..3 {
                assert!((ours[k] - (b[k] - a[k]) / (2.0 * h)).abs() < 5e-3, "{cycle:?} at {time}");
            }
            let turn = |q: &[f64]| DQuat::from_xyzw(q[4], q[5], q[6], q[3]).normalize();
            let angular = (turn(&a).conjugate() * turn(&b)).to_scaled_axis() / (2.0 * h);
            assert!((DVec3::from_slice(&ours[3..]) - angular).length() < 5e-3, "{cycle:?} at {time}");
            for joint in model.joints.iter().skip(1) {
                let truth = (b[joint.qpos_adr] - a[joint.qpos_adr]) / (2.0 * h);
                assert!((ours[joint.dof_adr] - truth).abs() < 5e-3, "{} at {time}", joint.name);
            }
        }
    }
}

#[test]
fn cycles_go_on_without_a_seam_in_both_directions() {
    let model = model("humanoid");
    for cycle in CYCLES {
        let clip = waves(&model, 60, cycle);
        for seam in [-2.0, -1.0, 0.0, 1.0, 2.0, 7.0] {
            let (before, after) = (qpos(&clip, seam - 1e-7), qpos(&clip, seam + 1e-7));
            assert!(difference(&before, &after) < 1e-5, "{cycle:?} at {seam}");
            let (before, after) = (qvel(&clip, seam - 1e-7), qvel(&clip, seam + 1e-7));
            let off = before.iter().zip(&after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-4, "{cycle:?} at {seam}: {off}");
        }
        // two cycles are one cycle twice
        let (one, two) = (qpos(&clip, 1.25), qpos(&clip, 2.25));
        let yaw = DQuat::from_rotation_z(cycle.yaw);
        let moved = yaw * DVec3::from_slice(&one) + DVec3::new(cycle.pos[0], cycle.pos[1], 0.0);
        assert!((moved - DVec3::from_slice(&two)).length() < 1e-9, "{cycle:?}");
        assert!((clip.phase(2.25) - 0.25).abs() < 1e-12 && (clip.phase(-0.75) - 0.25).abs() < 1e-12);
    }
}

#[test]
fn a_clip_that_ends_rests_in_its_last_frame() {
    let clip = shipped("marathon_man", "kick");
    let end = clip.duration();
    // sampled quaternions are normalized, those of the file have six digits
    assert!(difference(&qpos(&clip, end + 1.0), clip.frame(clip.frames() - 1)) < 1e-6);
    assert!(difference(&qpos(&clip, -1.0), clip.frame(0)) < 1e-6);
    assert!(qvel(&clip, end + 1e-9).iter().all(|v| *v == 0.0));
    assert_eq!(clip.phase(end + 1.0), 1.0);
    assert!(clip.is_over(end + 1e-9) && !clip.is_over(end));
}

#[test]
fn files_keep_every_bit() {
    for name in all_shipped("marathon_man") {
        let clip = shipped("marathon_man", &name);
        let again = Clip::parse("again.motion".as_ref(), &clip.to_bytes()).unwrap();
        assert_eq!(clip, again, "{name}");
        assert_eq!(clip.to_bytes(), again.to_bytes(), "{name}");
    }
    // numbers with all their digits
    let clip = waves(&model("humanoid"), 17, CYCLES[1]);
    assert_eq!(Clip::parse("again.motion".as_ref(), &clip.to_bytes()).unwrap(), clip);
}

#[test]
fn resampling_goes_through_the_frames_and_between_them_where_the_motion_was() {
    let model = model("humanoid");
    let cycle = CYCLES[1];
    let path = "waves".as_ref();
    let coarse = waves(&model, 20, cycle);
    let fine = coarse.resample(path, 0.01).unwrap();
    assert_eq!(fine.frames(), 100);
    for i in 0..20 {
        assert!(difference(fine.frame(5 * i), coarse.frame(i)) < 1e-9, "frame {i}");
    }
    let cubic = (0..100).map(|i| difference(fine.frame(i), &wave(&model, 0.01 * i as f64, cycle))).fold(0.0, f64::max);
    let linear = (0..100).map(|i| difference(&qpos(&coarse, 0.01 * i as f64), &wave(&model, 0.01 * i as f64, cycle)));
    assert!(cubic < 0.1 * linear.fold(0.0, f64::max), "{cubic}");
    // a cycle keeps its length
    let odd = coarse.resample(path, 0.03).unwrap();
    assert!((odd.duration() - 1.0).abs() < 1e-12 && odd.frames() == 33);
    assert!(coarse.resample(path, 0.9).is_err() && coarse.resample(path, f64::NAN).is_err());
}

#[test]
fn smoothing_takes_noise_away_and_leaves_what_is_slow() {
    let model = model("humanoid");
    let cycle = CYCLES[0];
    let clean = waves(&model, 200, cycle);
    let rows: Vec<Vec<f64>> = (0..200)
        .map(|i| {
            let mut row = clean.frame(i).to_vec();
            row[20] += if i % 2 == 0 { 0.02 } else { -0.02 };
            row
        })
        .collect();
    let layout = clean.layout().clone();
    let noisy = Clip::new("noisy".as_ref(), clean.about().clone(), layout, clean.dt(), Some(cycle), &rows).unwrap();
    let smooth = noisy.smooth("waves".as_ref(), 0.01).unwrap();
    let off = |clip: &Clip| (0..200).map(|i| difference(clip.frame(i), clean.frame(i))).fold(0.0, f64::max);
    assert!(off(&noisy) > 0.019 && off(&smooth) < 0.003, "{}, {}", off(&noisy), off(&smooth));
}

#[test]
fn trimming_keeps_the_frames_between() {
    let clip = shipped("marathon_man", "walk");
    let path = "walk".as_ref();
    let part = clip.trim(path, 10.0 * clip.dt(), 30.0 * clip.dt()).unwrap();
    assert_eq!(part.frames(), 21);
    assert!(part.cycle().is_none());
    for i in 0..=20 {
        assert_eq!(part.frame(i), clip.frame(10 + i));
    }
    let error = clip.trim(path, 0.5, 0.5).unwrap_err().to_string();
    assert!(error.starts_with("walk: trim: found 0.5 to 0.5 s, expected two or more frames"), "{error}");
}

/// Bodies of a mirrored pose are the mirror images of their partners.
fn assert_mirrored(model: &Model, clip: &Clip, mirrored: &Clip) {
    for i in 0..clip.frames() {
        let (a, b) = (Pose::of(model, clip.frame(i)), Pose::of(model, mirrored.frame(i)));
        for (k, body) in model.bodies.iter().enumerate().skip(1) {
            let other = body.name.replace("left", "\0").replace("right", "left").replace('\0', "right");
            let partner = model.bodies.iter().position(|body| body.name == other).expect("a partner");
            let image = a.pos[k] * DVec3::new(1.0, -1.0, 1.0);
            let off = (image - b.pos[partner]).length();
            assert!(off < 2e-3, "frame {i}, {}: {off}", body.name);
        }
    }
}

#[test]
fn a_mirror_exchanges_left_and_right_and_two_mirrors_do_nothing() {
    let path = "mirrored".as_ref();
    for (character, name) in [("marathon_man", "kick"), ("marathon_man", "walk_left"), ("humanoid", "run")] {
        let (model, clip) = (model(character), shipped(character, name));
        let mirrored = clip.mirror(path, &model).unwrap();
        assert_mirrored(&model, &clip, &mirrored);
        assert_eq!(mirrored.mirror(path, &model).unwrap(), clip);
    }
}

#[test]
fn at_the_origin_a_clip_begins_ahead_and_moves_as_before() {
    let model = model("humanoid");
    let clip = waves(&model, 50, CYCLES[1]);
    let moved = clip.at_origin("waves".as_ref()).unwrap();
    let first = moved.frame(0);
    assert!(first[0].abs() < 1e-12 && first[1].abs() < 1e-12);
    assert!((2.0 * f64::atan2(first[6], first[3])).abs() < 1e-12);
    let step = |clip: &Clip, i: f64| {
        let (a, b) = (qpos(clip, i * 0.02), qpos(clip, (i + 1.0) * 0.02));
        (DVec3::from_slice(&a) - DVec3::from_slice(&b)).length()
    };
    for i in 0..120 {
        let i = f64::from(i);
        assert!((step(&clip, i) - step(&moved, i)).abs() < 1e-9, "step {i}");
    }
}
