//! Poses: the entities of a ragdoll's parts, and the transforms that a configuration `qpos` gives them.

use crate::axes::{place_to_game, to_game, turn_to_game, yaw_of};
use crate::ragdoll::{Anatomy, Part};
use crate::track::Track;
use bevy::prelude::*;
use marathon_physics::Model;
use marathon_physics::model::{Geom, GeomType, JointType};
use marathon_render::{GeomPose, Pose, Scene};

/// Transforms of the bodies of a model in a configuration, in the axes of its [`Track`]. `None` if a number is not finite.
pub fn places(model: &Model, qpos: &[f64]) -> Option<Vec<Transform>> {
    let pose = Scene::pose_from_qpos(model, qpos).ok()?;
    Some(pose.bodies.iter().map(|body| place_to_game(body.pos, body.quat)).collect())
}

/// Moves the parts of a ragdoll to the transforms of [`places`], if there are any.
pub fn put(
    anatomy: &Anatomy,
    track: &Track,
    places: Option<Vec<Transform>>,
    parts: &mut Query<&mut Transform, With<Part>>,
) {
    let inverse = track.inverse();
    for (entity, place) in anatomy.parts.iter().zip(places.into_iter().flatten()) {
        if let Ok(mut transform) = parts.get_mut(*entity) {
            let place = inverse * place;
            (transform.translation, transform.rotation) = (place.translation, place.rotation);
        }
    }
}

/// Spawns an entity for each body of a model, as a child of `ragdoll`, and returns them in the order of the model.
pub fn spawn_parts(commands: &mut Commands, model: &Model, ragdoll: Entity) -> Vec<Entity> {
    let name = |body: usize| match (model.bodies[body].name.as_str(), body) {
        ("", 0) => "world".to_string(),
        ("", _) => format!("body {body}"),
        (name, _) => name.to_string(),
    };
    (0..model.bodies.len())
        .map(|body| {
            let part = (Part { ragdoll, body }, Name::new(name(body)), Transform::default(), ChildOf(ragdoll));
            commands.spawn(part).id()
        })
        .collect()
}

/// Heading of a model's free body: angle of its forward axis along the ground, rad; 0 for planar characters.
pub fn heading(model: &Model, qpos: &[f64]) -> f64 {
    let free = model.joints.iter().find(|joint| joint.kind == JointType::Free);
    let turn = free.and_then(|free| qpos.get(free.qpos_adr + 3..free.qpos_adr + 7));
    let Some([w, x, y, z]) = turn else { return 0.0 };
    (2.0 * (x * y + w * z)).atan2(1.0 - 2.0 * (y * y + z * z))
}

/// Velocity of a model's free body between two configurations, along its forward axis and to its left, m/s. `None` for
/// planar characters.
pub fn own_velocity(model: &Model, from: &[f64], to: &[f64], seconds: f64) -> Option<[f32; 2]> {
    let free = model.joints.iter().find(|joint| joint.kind == JointType::Free)?;
    let way = [0, 1].map(|i| (to[free.qpos_adr + i] - from[free.qpos_adr + i]) / seconds);
    let (sin, cos) = heading(model, to).sin_cos();
    Some([way[0] * cos + way[1] * sin, way[1] * cos - way[0] * sin].map(|x| x as f32))
}

/// Half of the time between the two poses that give a velocity, s.
const MOMENT: f64 = 1e-5;

/// Poses just before and after a state, from which [`velocity`] has the velocity of any point. `None` if a number is not finite.
pub fn around(model: &Model, qpos: &[f64], qvel: &[f64]) -> Option<[Pose; 2]> {
    let pose = |seconds| Scene::pose_from_qpos(model, &advanced(model, qpos, qvel, seconds)).ok();
    Some([pose(-MOMENT)?, pose(MOMENT)?])
}

/// Velocity of a point between the two poses of [`around`], m/s.
pub fn velocity([before, after]: &[Pose; 2], point: impl Fn(&Pose) -> [f64; 3]) -> [f64; 3] {
    let (a, b) = (point(before), point(after));
    std::array::from_fn(|i| (b[i] - a[i]) / (2.0 * MOMENT))
}

/// Place and velocities of the root body, in the axes of the track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RootMotion {
    /// Transform.
    pub place: Transform,
    /// Velocity of the origin of the body, m/s.
    pub linear: Vec3,
    /// Angular velocity, rad/s.
    pub angular: Vec3,
}

/// Motion of the body that the first joint moves. `None` without a joint, or if a number is not finite.
pub fn root_motion(model: &Model, qpos: &[f64], qvel: &[f64]) -> Option<RootMotion> {
    let joint = model.joints.first()?;
    if let (JointType::Free, [x, y, z, a, b, c, d, ..], [u, v, w, p, q, r, ..]) = (joint.kind, qpos, qvel) {
        let place = place_to_game([*x, *y, *z], [*a, *b, *c, *d]);
        // the angular velocity is in the axes of the body
        let angular = place.rotation * to_game([*p, *q, *r]);
        return place.is_finite().then_some(RootMotion { place, linear: to_game([*u, *v, *w]), angular });
    }
    let around = around(model, qpos, qvel)?;
    let linear = to_game(velocity(&around, |pose| pose.bodies[joint.body].pos));
    let [before, after] = around.each_ref().map(|pose| pose.bodies[joint.body]);
    // twice the vector part of the turn from one to the other; q and -q are the same orientation
    let ([p, a, b, c], [q, x, y, z]) = (before.quat, after.quat);
    let sign = if p * q + a * x + b * y + c * z < 0.0 { -1.0 } else { 1.0 };
    let turn = [p * x - q * a + b * z - c * y, p * y - q * b + c * x - a * z, p * z - q * c + a * y - b * x];
    let angular = to_game(turn.map(|x| sign * x / MOMENT));
    let place = place_to_game(after.pos, after.quat);
    Some(RootMotion { place, linear, angular })
}

/// Orientation of the root body in the model's reference pose, and its heading there.
pub fn rest(model: &Model) -> [Quat; 2] {
    let rest = model.joints.first().map_or(Quat::IDENTITY, |joint| turn_to_game(model.bodies[joint.body].quat));
    let ahead = (rest * Vec3::X).with_y(0.0);
    let heading = if ahead.length() > 1e-2 { yaw_of(ahead) } else { 0.0 };
    [rest, Quat::from_rotation_y(heading)]
}

/// Radius of a ball around the root body that holds a model in any pose, m. `None` unless all its joints belong to one tree with
/// a free root.
pub fn reach(model: &Model) -> Option<f32> {
    let free = model.joints.first().filter(|joint| joint.kind == JointType::Free)?;
    let roots = model.joints.iter().filter(|joint| model.bodies[joint.body].parent == 0);
    if roots.count() != 1 {
        return None;
    }
    let slides = model.joints.iter().skip(1).any(|joint| joint.kind == JointType::Slide);
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let moving = model.geoms.iter().filter(|geom| model.bodies[geom.body].weld_id != 0);
    let far = moving.map(|geom| {
        let up = std::iter::successors(Some(geom.body), |body| Some(model.bodies[*body].parent));
        let way: f64 =
            up.take_while(|body| *body != free.body && *body != 0).map(|body| length(model.bodies[body].pos)).sum();
        way + length(geom.pos) + length(geom.size)
    });
    let far = far.fold(0.0, f64::max);
    (!slides && far > 0.0).then_some(far as f32)
}

/// A configuration after a moment at a velocity, to first order.
fn advanced(model: &Model, qpos: &[f64], qvel: &[f64], seconds: f64) -> Vec<f64> {
    let mut q = qpos.to_vec();
    for joint in &model.joints {
        let (at, dof) = (joint.qpos_adr, joint.dof_adr);
        let (slides, turn) = match joint.kind {
            JointType::Free => (3, Some((at + 3, dof + 3))),
            JointType::Ball => (0, Some((at, dof))),
            JointType::Slide | JointType::Hinge => (1, None),
        };
        for (q, v) in q.iter_mut().skip(at).zip(qvel.iter().skip(dof)).take(slides) {
            *q += v * seconds;
        }
        let Some((at, dof)) = turn else { continue };
        if let (Some([w, x, y, z]), Some([a, b, c])) = (q.get(at..at + 4), qvel.get(dof..dof + 3)) {
            // the angular velocity is in the axes of the body: q' = q w / 2
            let change = [-x * a - y * b - z * c, w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a];
            for (q, change) in q[at..at + 4].iter_mut().zip(change) {
                *q += 0.5 * seconds * change;
            }
        }
    }
    q
}

/// Lowest point of a geom. That of a mesh is its center.
pub fn lowest(geom: &Geom, pose: &GeomPose) -> [f64; 3] {
    // the vertical in the axes of the geom
    let up = pose.mat[2];
    let size = geom.size;
    let flat = (up[0] * up[0] + up[1] * up[1]).sqrt().max(1e-12);
    let end = |i: usize| if up[i] > 0.0 { -size[i] } else { size[i] };
    let along_z = if up[2] > 0.0 { -size[1] } else { size[1] };
    let local = match geom.kind {
        GeomType::Sphere => up.map(|u| -size[0] * u),
        GeomType::Capsule => [-size[0] * up[0], -size[0] * up[1], along_z - size[0] * up[2]],
        GeomType::Cylinder => [-size[0] * up[0] / flat, -size[0] * up[1] / flat, along_z],
        GeomType::Box => [end(0), end(1), end(2)],
        GeomType::Ellipsoid => {
            let scaled: [f64; 3] = std::array::from_fn(|i| size[i] * up[i]);
            let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-12);
            std::array::from_fn(|i| -size[i] * scaled[i] / length)
        }
        GeomType::Plane | GeomType::Hfield | GeomType::Mesh => [0.0; 3],
    };
    std::array::from_fn(|i| pose.pos[i] + (0..3).map(|k| pose.mat[i][k] * local[k]).sum::<f64>())
}

/// A configuration between two: coordinates linearly, quaternions along the shorter way.
pub fn mix(model: &Model, a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    let mut q: Vec<f64> = a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect();
    for joint in &model.joints {
        let at = match joint.kind {
            JointType::Free => joint.qpos_adr + 3,
            JointType::Ball => joint.qpos_adr,
            JointType::Slide | JointType::Hinge => continue,
        };
        let range = at..at + 4;
        let (Some(a), Some(b)) = (a.get(range.clone()), b.get(range.clone())) else { continue };
        // q and -q are the same orientation
        let sign = if a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
        for (q, (a, b)) in q[range].iter_mut().zip(a.iter().zip(b)) {
            *q = a + share * (sign * b - a);
        }
    }
    q
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_is_that_of_the_free_body() -> Result<(), Box<dyn std::error::Error>> {
        let text = "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>";
        let model = Model::from_xml_str(text, "ball")?;
        let turned = |x: f64, y: f64, angle: f64| [x, y, 3.0, (0.5 * angle).cos(), 0.0, 0.0, (0.5 * angle).sin()];
        assert!((heading(&model, &turned(1.0, 2.0, 1.2)) - 1.2).abs() < 1e-12);
        // the character runs along -x and faces -x, so its forward speed is positive
        let around = std::f64::consts::PI;
        let ahead = own_velocity(&model, &turned(0.0, 0.0, around), &turned(-0.1, 0.0, around), 0.05);
        let [ahead, left] = ahead.ok_or("it has a free body")?;
        assert!((ahead - 2.0).abs() < 1e-5 && left.abs() < 1e-5, "{ahead} {left}");
        let text =
            "<mujoco><worldbody><body><joint type='slide' axis='1 0 0'/><geom size='.1'/></body></worldbody></mujoco>";
        let model = Model::from_xml_str(text, "slider")?;
        assert_eq!((heading(&model, &[1.0]), own_velocity(&model, &[0.0], &[1.0], 0.1)), (0.0, None));
        Ok(())
    }

    #[test]
    fn a_reach_holds_every_pose() -> Result<(), Box<dyn std::error::Error>> {
        let of = |xml: &str| Model::from_xml_str(&format!("<mujoco><worldbody>{xml}</worldbody></mujoco>"), "reach");
        let arm = "<body pos='0 0 .5'><joint axis='0 1 0'/><geom type='capsule' size='.1 .2' pos='0 0 .3'/></body>";
        let model = of(&format!("<body pos='0 0 7'><freejoint/><geom size='.1'/>{arm}</body>"))?;
        let reach = reach(&model).ok_or("one root")?;
        assert!((1.0..1.2).contains(&reach), "{reach}");
        for xml in
            [arm, "<body><freejoint/><geom size='.1'/></body><body pos='3 0 0'><freejoint/><geom size='.1'/></body>"]
        {
            assert_eq!(super::reach(&of(xml)?), None);
        }
        Ok(())
    }

    #[test]
    fn quaternions_go_the_shorter_way() -> Result<(), Box<dyn std::error::Error>> {
        let xml = "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>";
        let model = Model::from_xml_str(xml, "ball")?;
        let mut a = model.qpos0.clone();
        let mut b = a.clone();
        (a[0], b[0]) = (1.0, 3.0);
        b[3..7].iter_mut().for_each(|x| *x = -*x);
        let q = mix(&model, &a, &b, 0.25);
        assert_eq!(q, [1.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        Ok(())
    }

    #[test]
    fn velocities_are_those_of_a_turning_body() -> Result<(), Box<dyn std::error::Error>> {
        let xml = "<mujoco><worldbody><body><freejoint/><geom size='.1' pos='0 0.5 0'/></body></worldbody></mujoco>";
        let model = Model::from_xml_str(xml, "ball")?;
        // turned by a quarter about z, so that its y axis is -x of the world; it turns about its own z, which is up
        let (half, qvel) = (0.5_f64.sqrt(), [1.0, 0.0, 2.0, 0.0, 0.0, 3.0]);
        let qpos = [0.0, 0.0, 1.0, half, 0.0, 0.0, half];
        let around = around(&model, &qpos, &qvel).ok_or("finite numbers")?;
        let v = velocity(&around, |pose| pose.geoms[0].pos);
        let expected = [1.0, -1.5, 2.0];
        assert!(v.iter().zip(expected).all(|(v, x)| (v - x).abs() < 1e-6), "{v:?}");
        Ok(())
    }

    #[test]
    fn the_root_moves_as_its_joints_say() -> Result<(), Box<dyn std::error::Error>> {
        let half = 0.5_f64.sqrt();
        let free = "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>";
        let plane = "<mujoco><worldbody><body><joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 0 1'/>\
            <joint axis='0 1 0'/><geom size='.1'/></body></worldbody></mujoco>";
        // a quarter about z, so that the y axis of the free body is -x of the world
        for (xml, qpos, qvel, linear, angular) in [
            (
                free,
                &[1.0, 2.0, 3.0, half, 0.0, 0.0, half][..],
                &[1.0, 0.5, 2.0, 0.0, 3.0, 0.0][..],
                [1.0, 0.5, 2.0],
                [-3.0, 0.0, 0.0],
            ),
            (plane, &[1.0, 3.0, 0.4][..], &[1.5, -0.5, 2.0][..], [1.5, 0.0, -0.5], [0.0, 2.0, 0.0]),
        ] {
            let model = Model::from_xml_str(xml, "root")?;
            let root = root_motion(&model, qpos, qvel).ok_or("finite numbers")?;
            let near = |v: Vec3, x: [f64; 3]| v.distance(to_game(x)) < 1e-4;
            assert!(near(root.linear, linear) && near(root.angular, angular), "{root:?}");
            let places = places(&model, qpos).ok_or("finite numbers")?;
            assert!(root.place.translation.distance(places[1].translation) < 1e-3, "{root:?}");
        }
        Ok(())
    }

    #[test]
    fn the_lowest_point_is_below_all_others() -> Result<(), Box<dyn std::error::Error>> {
        let turn = "euler='30 50 20'";
        let geoms = ["sphere", "capsule", "cylinder", "box", "ellipsoid"]
            .map(|kind| format!("<geom type='{kind}' size='.1 .2 .3' {turn}/>"))
            .concat();
        let xml = format!("<mujoco><worldbody><body><freejoint/>{geoms}</body></worldbody></mujoco>");
        let model = Model::from_xml_str(&xml, "shapes")?;
        let pose = Scene::pose_from_qpos(&model, &model.qpos0)?;
        // the size of the box around each along the vertical, by the row of the rotation that the vertical has
        let [x, y, z] = pose.geoms[0].mat[2].map(f64::abs);
        let expected = [
            0.1,
            0.1 + 0.2 * z,
            0.1 * (x * x + y * y).sqrt() + 0.2 * z,
            0.1 * x + 0.2 * y + 0.3 * z,
            (0.01 * x * x + 0.04 * y * y + 0.09 * z * z).sqrt(),
        ];
        for ((geom, pose), depth) in model.geoms.iter().zip(&pose.geoms).zip(expected) {
            let found = lowest(geom, pose)[2];
            assert!((found + depth).abs() < 1e-12, "{:?}: {found} and {depth}", geom.kind);
        }
        Ok(())
    }
}
