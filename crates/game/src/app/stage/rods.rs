//! The shapes of characters as rods, which a ray or a ball meets.

use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy_marathon::axes::{to_game, turn_to_game};
use bevy_marathon::look::FollowCamera;
use bevy_marathon::{Anatomy, Part, Ragdoll};
use marathon_physics::model::{Geom, GeomType};

/// Finds what is under the cursor: shapes of the physics, whatever the characters wear.
#[derive(SystemParam)]
pub struct Picking<'w, 's> {
    cameras: Query<'w, 's, (&'static Camera, &'static GlobalTransform), With<FollowCamera>>,
    actors: Query<'w, 's, (Entity, &'static Anatomy), With<Ragdoll>>,
    parts: Query<'w, 's, &'static GlobalTransform, With<Part>>,
}

/// A body under the cursor.
#[derive(Clone, Copy, Debug)]
pub struct Picked {
    /// Whose it is.
    pub ragdoll: Entity,
    /// Index of the body in its model.
    pub body: usize,
    /// Where the ray meets it.
    pub at: Vec3,
    /// Direction of the ray.
    pub direction: Dir3,
}

impl Picking<'_, '_> {
    /// The ray below a point of the window.
    pub fn ray(&self, cursor: Vec2) -> Option<Ray3d> {
        let (camera, at) = self.cameras.iter().next()?;
        camera.viewport_to_world(at, cursor).ok()
    }

    /// The direction of the camera.
    pub fn forward(&self) -> Option<Dir3> {
        self.cameras.iter().next().map(|(_, at)| at.forward())
    }

    /// The body below a point of the window, where the screen shows it.
    pub fn at(&self, cursor: Vec2) -> Option<Picked> {
        let ray = self.ray(cursor)?;
        let shown = |anatomy: &Anatomy, body: usize| self.parts.get(*anatomy.parts.get(body)?).ok().copied();
        let of = |(ragdoll, anatomy)| rods(ragdoll, anatomy, |body| shown(anatomy, body));
        let rods: Vec<Rod> = self.actors.iter().flat_map(of).collect();
        let (rod, at) = hit(&rods, ray)?;
        Some(Picked { ragdoll: rod.ragdoll, body: rod.body, at, direction: ray.direction })
    }
}

/// A shape of a character in the world: a rod with a radius, which a sphere is too; others by the rod within them.
pub struct Rod {
    /// Whose it is.
    pub ragdoll: Entity,
    /// Index of the body in its model.
    pub body: usize,
    /// The ends of its axis.
    pub ends: [Vec3; 2],
    /// Its radius, m.
    pub radius: f32,
}

/// Rods of all geoms of a character whose bodies are at the given places.
pub fn rods(ragdoll: Entity, anatomy: &Anatomy, place: impl Fn(usize) -> Option<GlobalTransform>) -> Vec<Rod> {
    let mut rods = Vec::new();
    for geom in anatomy.model.geoms.iter().filter(|g| anatomy.model.bodies[g.body].weld_id != 0) {
        let (Some(part), Some((half, radius))) = (place(geom.body), rod(geom)) else { continue };
        let center = part.transform_point(to_game(geom.pos));
        let along = part.rotation() * (turn_to_game(geom.quat) * Vec3::Y) * half;
        rods.push(Rod { ragdoll, body: geom.body, ends: [center - along, center + along], radius });
    }
    rods
}

/// Half the length of a geom's axis, and its radius.
fn rod(geom: &Geom) -> Option<(f32, f32)> {
    let [x, y, z] = geom.size.map(|s| s as f32);
    match geom.kind {
        GeomType::Sphere => Some((0.0, x)),
        GeomType::Capsule | GeomType::Cylinder => Some((y, x)),
        GeomType::Ellipsoid | GeomType::Box => {
            let radius = x.min(y).max(0.5 * x.max(y));
            Some(((z - radius).max(0.0), radius))
        }
        GeomType::Plane | GeomType::Hfield | GeomType::Mesh => None,
    }
}

/// The point of a rod's axis that is nearest to a point.
pub fn nearest_on(rod: &Rod, point: Vec3) -> Vec3 {
    let [a, b] = rod.ends;
    let along = b - a;
    let share = if along.length_squared() > 0.0 { (point - a).dot(along) / along.length_squared() } else { 0.0 };
    a + along * share.clamp(0.0, 1.0)
}

/// The first rod that a ray meets, and where.
fn hit(rods: &[Rod], ray: Ray3d) -> Option<(&Rod, Vec3)> {
    let mut best: Option<(f32, &Rod, Vec3)> = None;
    for rod in rods {
        // the ray's closest approach, by turns: two lines are near each other after a few
        let mut at = nearest_on(rod, ray.origin);
        let mut reach = 0.0;
        for _ in 0..8 {
            reach = (at - ray.origin).dot(*ray.direction).max(0.0);
            at = nearest_on(rod, ray.get_point(reach));
        }
        let distance = ray.get_point(reach).distance(at);
        // a finger is thicker than a ray
        if distance < rod.radius * 1.15 + 0.02 && best.as_ref().is_none_or(|(nearest, ..)| reach < *nearest) {
            best = Some((reach, rod, ray.get_point(reach - rod.radius)));
        }
    }
    best.map(|(_, rod, at)| (rod, at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_meet_the_nearest_rod() {
        let rod = |x: f32, body| Rod {
            ragdoll: Entity::PLACEHOLDER,
            body,
            ends: [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0)],
            radius: 0.1,
        };
        let rods = [rod(5.0, 1), rod(3.0, 2), rod(4.0, 3)];
        let ray = |y: f32| Ray3d::new(Vec3::new(0.0, y, 0.0), Dir3::X);
        let (first, at) = hit(&rods, ray(0.5)).expect("it is in the way");
        assert!(first.body == 2 && at.distance(Vec3::new(2.9, 0.5, 0.0)) < 0.02, "{at}");
        assert!(hit(&rods, ray(1.3)).is_none());
        // beyond the end, within the cap
        assert!(hit(&rods, ray(1.08)).is_some());
    }
}
