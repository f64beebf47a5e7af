//! Recordings with different rest poses, floors and up axes give the same motion.

use crate::common::bvh::{ARMS, HIPS, JOINTS, Layout, Rest, Truth, usual, y_up};
use crate::common::{all_shipped, model};
use glam::{DQuat, DVec3};
use marathon_motion::import::{Reading, Up};
use marathon_motion::{Animation, Mapping, fit, import, retarget};
use std::f64::consts::{FRAC_PI_2, PI};

/// Positions of an animation's joints in a frame, and their rotations from the rest pose.
fn shown(animation: &Animation, frame: usize) -> (Vec<DVec3>, Vec<DQuat>) {
    let quat = |q: &[f64]| DQuat::from_xyzw(q[1], q[2], q[3], q[0]);
    let qpos = animation.clip().frame(frame);
    let (mut places, mut turns, mut rests) = (Vec::new(), Vec::<DQuat>::new(), Vec::<DQuat>::new());
    for (i, bone) in animation.skeleton().bones.iter().enumerate() {
        let local = quat(&qpos[3 + 4 * i..]);
        match bone.parent {
            Some(up) => {
                places.push(places[up] + turns[up] * DVec3::from_array(bone.offset));
                turns.push(turns[up] * local);
                rests.push(rests[up] * quat(&bone.rest));
            }
            None => {
                places.push(DVec3::from_slice(qpos));
                turns.push(local);
                rests.push(quat(&bone.rest));
            }
        }
    }
    let turned = turns.iter().zip(&rests).map(|(turn, rest)| *turn * rest.conjugate()).collect();
    (places, turned)
}

/// Mean position error of the joints, m, and mean rotation error of trunk and legs, degrees, except for heading and
/// start position. Arms may have another rest pose: retargeting compares their directions.
fn off(truth: &Truth, animation: &Animation) -> (f64, f64) {
    // the model's reference pose faces +x
    let hips = |places: &[DVec3]| (places[HIPS[0]] - places[HIPS[1]]).with_z(0.0).normalize();
    let order: Vec<usize> = JOINTS
        .iter()
        .map(|(name, ..)| animation.skeleton().bones.iter().position(|bone| bone.name == *name).expect("a joint"))
        .collect();
    let ordered = |frame: usize| {
        let (places, turns) = shown(animation, frame);
        (order.iter().map(|i| places[*i]).collect::<Vec<_>>(), order.iter().map(|i| turns[*i]).collect::<Vec<_>>())
    };
    let heading = |at: DVec3| at.y.atan2(at.x);
    // the heading of the whole recording, from the frame in which the hips are most level
    let level = (0..truth.clip.frames()).max_by(|a, b| {
        let flat = |frame: usize| {
            let places = truth.places(&truth.pose(frame));
            (places[HIPS[0]] - places[HIPS[1]]).with_z(0.0).length()
        };
        flat(*a).total_cmp(&flat(*b))
    });
    let level = level.expect("frames");
    let yaw = heading(hips(&truth.places(&truth.pose(level)))) - heading(hips(&ordered(level).0));
    let world = DQuat::from_rotation_z(yaw);
    let start = truth.places(&truth.pose(0))[0] - world * ordered(0).0[0];
    let shift = start.with_z(0.0);
    // rotations are relative to the rest pose, which has its own heading
    let (_, there) = ordered(level);
    let here = truth.turns(&truth.pose(level));
    let face = |turn: DQuat| heading((turn * DVec3::X).with_z(0.0));
    let rest = DQuat::from_rotation_z(face(world.conjugate() * here[0]) - face(there[0]));
    let (mut way, mut angle, mut count, mut turned) = (0.0, 0.0, 0.0, 0.0);
    for frame in (0..truth.clip.frames()).step_by(3) {
        let pose = truth.pose(frame);
        let (places, turns) = ordered(frame);
        let (wanted, bodies) = (truth.places(&pose), truth.turns(&pose));
        for i in 0..JOINTS.len() {
            way += (world * places[i] + shift - wanted[i]).length();
            count += 1.0;
            if !ARMS.contains(&i) {
                angle += (world * turns[i] * rest).angle_between(bodies[i]).to_degrees();
                turned += 1.0;
            }
        }
    }
    (way / count, angle / turned)
}

/// Layouts of files, each with a description.
fn layouts() -> Vec<(&'static str, Layout)> {
    let z_up = DQuat::IDENTITY;
    vec![
        ("usual", usual()),
        ("bones along x", Layout { rest: Rest::Along(DVec3::X), ..usual() }),
        ("bones along z", Layout { rest: Rest::Along(DVec3::Z), ..usual() }),
        ("bones along -y, in meters", Layout { rest: Rest::Along(DVec3::NEG_Y), unit: 1.0, ..usual() }),
        ("z up", Layout { world: z_up, ..usual() }),
        (
            "motion with z up, rest with y up",
            Layout { world: z_up, rest: Rest::Standing, rest_turned: false, ..usual() },
        ),
        ("bones along x, z up", Layout { rest: Rest::Along(DVec3::X), world: z_up, ..usual() }),
        ("floor at -1 m", Layout { floor: -1.0, ..usual() }),
        ("floor at 3 m", Layout { floor: 3.0, ..usual() }),
        ("twisted pelvis", Layout { rest: Rest::Twisted(90.0), ..usual() }),
        (
            "bones along z, floor at 3 m, z up",
            Layout { rest: Rest::Along(DVec3::Z), floor: 3.0, world: z_up, ..usual() },
        ),
    ]
}

#[test]
fn every_shipped_motion_is_found_upright_in_every_layout() {
    let mut bad = Vec::new();
    for name in all_shipped("marathon_man") {
        let truth = Truth::of(&name);
        for (what, layout) in layouts() {
            let animation = import::any("m.bvh".as_ref(), truth.bvh(&layout).as_bytes()).unwrap();
            let (distance, angle) = off(&truth, &animation);
            println!("{name}, {what}: {:.1} cm, {angle:.1} degrees", 1e2 * distance);
            if distance > 0.05 || angle > 15.0 {
                bad.push(format!("{name}, {what}: {:.1} cm, {angle:.1} degrees", 1e2 * distance));
            }
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

#[test]
fn retargeted_recordings_show_the_motion_within_5_cm_and_15_degrees() {
    let man = model("marathon_man");
    for name in ["walk", "kick"] {
        let truth = Truth::of(name);
        for (what, layout) in layouts().into_iter().filter(|(what, _)| name == "walk" || *what == "bones along x") {
            let animation = import::any("m.bvh".as_ref(), truth.bvh(&layout).as_bytes()).unwrap();
            let mapping = Mapping::built_in("m.bvh".as_ref(), animation.skeleton(), &man).unwrap();
            let clip = retarget("m.bvh".as_ref(), &animation, &man, &mapping).unwrap();
            let fit = fit("m.bvh".as_ref(), &animation, &man, &mapping, &clip).unwrap();
            let clip = clip.at_origin("m".as_ref()).unwrap();
            let wanted = truth.clip.at_origin("m".as_ref()).unwrap();
            let (mut joints, mut height) = (0.0, 0.0_f64);
            for i in 0..clip.frames() {
                let (a, b) = (clip.frame(i), wanted.frame(i));
                joints += a[7..].iter().zip(&b[7..]).map(|(a, b)| (a - b).abs()).sum::<f64>() / (a.len() - 7) as f64;
                height = height.max((a[2] - b[2]).abs());
            }
            let joints = (joints / clip.frames() as f64).to_degrees();
            println!("{name}, {what}: joints {joints:.1} degrees, height {height:.3} m, {fit:?}");
            assert!(joints < 10.0 && height < 0.05, "{name}, {what}: {joints} degrees, {height} m");
            assert!(fit.warnings().is_empty(), "{name}, {what}: {fit:?}");
        }
    }
}

#[test]
fn options_say_which_way_is_up_and_where_the_floor_is() {
    let truth = Truth::of("walk");
    let turned = [
        (Up::X, DQuat::from_rotation_y(FRAC_PI_2)),
        (Up::Y, y_up()),
        (Up::Z, DQuat::IDENTITY),
        (Up::NegX, DQuat::from_rotation_y(-FRAC_PI_2)),
        (Up::NegY, DQuat::from_rotation_x(FRAC_PI_2)),
        (Up::NegZ, DQuat::from_rotation_x(PI)),
    ];
    for (up, world) in turned {
        for rest in [Rest::Standing, Rest::Along(DVec3::X)] {
            let text = truth.bvh(&Layout { world, rest, floor: -0.05, ..usual() });
            let reading = Reading { up: Some(up), floor: Some(-0.05), ..Reading::default() };
            let read = import::read("m.bvh".as_ref(), text.as_bytes(), &reading).unwrap();
            let (distance, angle) = off(&truth, &read.animation);
            assert!(distance < 0.02 && angle < 15.0, "{up}, {rest:?}: {distance} m, {angle} degrees");
            assert!(read.notes.is_empty(), "{:?}", read.notes);
        }
    }
}

#[test]
fn what_the_file_does_not_say_is_told() {
    let truth = Truth::of("walk");
    let text = truth.bvh(&Layout { world: DQuat::IDENTITY, floor: 3.0, ..usual() });
    let read = import::read("m.bvh".as_ref(), text.as_bytes(), &Reading::default()).unwrap();
    let [up, floor] = &read.notes[..] else { panic!("{:?}", read.notes) };
    assert!(up.starts_with("z points up, as the motion shows; --up "), "{up}");
    assert!(floor.starts_with("the floor is at 3.0") || floor.starts_with("the floor is at 2.9"), "{floor}");
    let usual = import::read("m.bvh".as_ref(), truth.bvh(&usual()).as_bytes(), &Reading::default()).unwrap();
    assert_eq!(usual.notes, Vec::<String>::new());
}
