//! MuJoCo's axes (x forward, y left, z up) and Bevy's (x forward here, y up, z right).
//!
//! Both are right-handed and in meters: `(x, y, z)` of the physics is `(x, z, -y)` of the game. The shapes of the physics
//! that have an axis have it along z, those of the game along y, so the same turn serves shapes and frames.

use bevy::math::{Quat, Vec3};
use bevy::transform::components::Transform;

/// A point or direction of the physics in the game's axes.
pub fn to_game(v: [f64; 3]) -> Vec3 {
    Vec3::new(v[0] as f32, v[2] as f32, -v[1] as f32)
}

/// A point or direction of the game in the axes of the physics.
pub fn to_physics(v: Vec3) -> [f64; 3] {
    [f64::from(v.x), -f64::from(v.z), f64::from(v.y)]
}

/// An orientation of the physics, `[w, x, y, z]`, in the game's axes.
pub fn turn_to_game(q: [f64; 4]) -> Quat {
    // a quaternion's vector part is an axis, which turns like any other
    let axis = to_game([q[1], q[2], q[3]]);
    Quat::from_xyzw(axis.x, axis.y, axis.z, q[0] as f32).normalize()
}

/// An orientation of the game in the axes of the physics, `[w, x, y, z]`.
pub fn turn_to_physics(q: Quat) -> [f64; 4] {
    let [x, y, z] = to_physics(q.xyz());
    [f64::from(q.w), x, y, z]
}

/// A place of the physics, a position and an orientation, in the game's axes.
pub fn place_to_game(pos: [f64; 3], quat: [f64; 4]) -> Transform {
    Transform::from_translation(to_game(pos)).with_rotation(turn_to_game(quat))
}

/// Angle about the vertical from +x to the level part of a direction of the game, rad.
pub fn yaw_of(direction: Vec3) -> f32 {
    (-direction.z).atan2(direction.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_vector_is_the_turn_of_the_vector() {
        let (s, c) = (0.6_f64.sqrt(), 0.4_f64.sqrt());
        let q = [c, s * 0.48, -s * 0.6, s * 0.64];
        // by the formula of Rodrigues in the axes of the physics: v + 2 w (u x v) + 2 u x (u x v)
        let (u, v) = ([q[1], q[2], q[3]], [0.3, -1.2, 0.7]);
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let (once, twice) = (cross(u, v), cross(u, cross(u, v)));
        let turned = std::array::from_fn(|i| v[i] + 2.0 * q[0] * once[i] + 2.0 * twice[i]);
        assert!(turn_to_game(q).mul_vec3(to_game(v)).distance(to_game(turned)) < 1e-6);
        assert_eq!(to_physics(to_game(v)).map(|x| x as f32), v.map(|x| x as f32));
        assert!(turn_to_physics(turn_to_game(q)).iter().zip(q).all(|(a, b)| (a - b).abs() < 1e-6));
    }
}
