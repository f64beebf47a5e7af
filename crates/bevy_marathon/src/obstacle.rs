//! Solids of the app that characters feel, and which characters feel what.

use crate::height_field::{HeightField, LaneField};
use bevy::prelude::*;
use marathon_physics::ObstacleShape;

/// A solid of the app that characters feel: a wall, a step, a platform, terrain, a body of another physics engine. It is where its
/// [`GlobalTransform`] is, with its scale. Move it by its [`Transform`] in [`FixedUpdate`], and it pushes and carries what
/// touches it. Characters cannot move it.
///
/// Characters with [`Collides::obstacles`] feel it. It is not drawn by itself. An obstacle with a size that is not a length above
/// 0 is not felt.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_marathon::prelude::*;
/// fn build(mut commands: Commands, assets: Res<AssetServer>) {
///     commands.spawn((Obstacle::Cuboid { half_size: Vec3::new(0.1, 1.0, 2.0) }, Transform::from_xyz(5.0, 1.0, 0.0)));
///     let policy = CharacterPolicy(assets.load("policies/MarathonManController.safetensors"));
///     commands.spawn((Ragdoll::agent("MarathonManController"), policy, Collides::ALL));
/// }
/// ```
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, PartialEq)]
#[require(Transform, ObstacleMotion)]
pub enum Obstacle {
    /// A ball.
    Sphere {
        /// Its radius, m.
        radius: f32,
    },
    /// The points within `radius` of a segment along the y axis.
    Capsule {
        /// Its radius, m.
        radius: f32,
        /// Half the length of the segment, m.
        half_length: f32,
    },
    /// A box.
    Cuboid {
        /// Half its extent along each axis, m.
        half_size: Vec3,
    },
    /// Terrain. The agent's own floor stays where it is: terrain carries where it is higher.
    HeightField(HeightField),
}

impl Obstacle {
    /// Its shape in the axes of the physics at a scale, and the radius of a ball around it. `None` if a size is not a length above 0.
    /// The terrain of the last call is in `last`.
    pub(crate) fn shape(&self, scale: Vec3, last: &mut Option<LaneField>) -> Option<(ObstacleShape, f32)> {
        let (signed, scale) = (scale, scale.abs());
        let (size, shape, radius): (Vec3, _, _) = match *self {
            Obstacle::HeightField(ref field) => {
                let (field, radius) = field.for_lanes(signed, last)?;
                return Some((ObstacleShape::HField(field), radius));
            }
            Obstacle::Sphere { radius } => {
                let radius = radius * scale.max_element();
                (Vec3::splat(radius), ObstacleShape::Sphere { radius: radius.into() }, radius)
            }
            Obstacle::Capsule { radius, half_length } => {
                let (radius, half) = (radius * scale.x.max(scale.z), half_length * scale.y);
                let shape = ObstacleShape::Capsule { radius: radius.into(), half_length: half.into() };
                (Vec3::new(radius, half, radius), shape, radius + half)
            }
            Obstacle::Cuboid { half_size } => {
                let half = half_size * scale;
                // the axes of the physics are x, -z, y
                (half, ObstacleShape::Box { half_size: [half.x, half.z, half.y].map(f64::from) }, half.length())
            }
        };
        (size.is_finite() && size.min_element() > 0.0).then_some((shape, radius))
    }
}

/// Where an [`Obstacle`] was in the last tick. The plugin writes it.
#[derive(Component, Clone, Debug, Default)]
pub struct ObstacleMotion {
    pub(crate) last: Option<(Vec3, Quat)>,
    pub(crate) field: Option<LaneField>,
}

/// Solids that a [`Ragdoll`](crate::Ragdoll) touches besides its ground: none by default. Insert it together with the
/// ragdoll, which enters the simulation with it. Later changes can only turn things off and on that were on then.
///
/// ```
/// # use bevy_marathon::prelude::*;
/// assert_eq!(Collides::ALL, Collides { obstacles: true, characters: true });
/// ```
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct Collides {
    /// The [`Obstacle`]s of the app.
    pub obstacles: bool,
    /// Other characters that collide with characters, prefabs included. Each moves the other by its mass.
    pub characters: bool,
}

impl Collides {
    /// Obstacles and other characters.
    pub const ALL: Collides = Collides { obstacles: true, characters: true };

    /// Whether it touches anything.
    pub const fn any(self) -> bool {
        self.obstacles || self.characters
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_have_their_scale_and_the_axes_of_the_physics() {
        let cuboid = Obstacle::Cuboid { half_size: Vec3::new(1.0, 2.0, 3.0) };
        let shape_of = |obstacle: &Obstacle, scale: Vec3| obstacle.shape(scale, &mut None);
        let (shape, radius) = shape_of(&cuboid, Vec3::new(1.0, 1.0, -2.0)).expect("lengths above 0");
        assert_eq!(shape, ObstacleShape::Box { half_size: [1.0, 6.0, 2.0] });
        assert_eq!(radius, 41.0_f32.sqrt());
        let capsule = Obstacle::Capsule { radius: 0.5, half_length: 1.0 };
        let shape = shape_of(&capsule, Vec3::new(1.0, 3.0, 2.0)).map(|(shape, _)| shape);
        assert_eq!(shape, Some(ObstacleShape::Capsule { radius: 1.0, half_length: 3.0 }));
        assert_eq!(shape_of(&Obstacle::Sphere { radius: 0.0 }, Vec3::ONE), None);
        assert_eq!(shape_of(&Obstacle::Sphere { radius: f32::NAN }, Vec3::ONE), None);
        assert_eq!(shape_of(&cuboid, Vec3::ZERO), None);
    }
}
