//! Poses: the entities of a ragdoll's parts, and the transforms that a configuration `qpos` gives them.

use crate::axes::place_to_game;
use crate::ragdoll::{Anatomy, Part};
use bevy::prelude::*;
use marathon_physics::Model;
use marathon_physics::model::JointType;
use marathon_render::Scene;

/// Transforms of the bodies of a model in a configuration, in the axes of the ragdoll. `None` if a number is not finite.
pub fn places(model: &Model, qpos: &[f64]) -> Option<Vec<Transform>> {
    let pose = Scene::pose_from_qpos(model, qpos).ok()?;
    Some(pose.bodies.iter().map(|body| place_to_game(body.pos, body.quat)).collect())
}

/// Moves the parts of a ragdoll to the transforms of [`places`], if there are any.
pub fn put(anatomy: &Anatomy, places: Option<Vec<Transform>>, parts: &mut Query<&mut Transform, With<Part>>) {
    for (entity, place) in anatomy.parts.iter().zip(places.into_iter().flatten()) {
        if let Ok(mut transform) = parts.get_mut(*entity) {
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
}
