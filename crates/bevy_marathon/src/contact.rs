//! Gives each character the solids around it: obstacles of the app, and the limbs of other characters.
//!
//! The lanes of the physics know nothing of each other, so a character sees the limbs of others as solids that it cannot move. So
//! that both keep their share of the momentum, they move at the velocity that both would have after an inelastic impact. Characters
//! that begin an episode inside each other pass through each other until they are apart.

use crate::axes::{to_game, to_physics, turn_to_physics};
use crate::characters::PoseSample;
use crate::marathon::{Marathon, RagdollState};
use crate::obstacle::{Collides, Obstacle, ObstacleMotion};
use crate::pose;
use crate::ragdoll::Anatomy;
use crate::track::Tracks;
use bevy::math::Affine3A;
use bevy::prelude::*;
use marathon_physics::model::{Geom, GeomType};
use marathon_physics::{Model, ObstacleShape};
use marathon_render::GeomPose;
use std::ops::Range;
use std::time::Duration;

/// Distance up to which a character gets a solid, m.
const NEAR: f32 = 0.5;
/// Speed from which an obstacle counts as put elsewhere, m/s.
const JUMP: f32 = 60.0;

/// A solid in the world's axes.
struct Solid {
    shape: ObstacleShape,
    /// Radius of a ball around it, m.
    radius: f32,
    place: Vec3,
    turn: Quat,
    linear: Vec3,
    angular: Vec3,
    /// Time that its place belongs to.
    time: Duration,
    /// Whose limb it is, and the tree of bodies that it belongs to.
    owner: Option<(Entity, Tree)>,
}

/// Bodies that move together.
#[derive(Clone, Copy)]
struct Tree {
    root: usize,
    mass: f32,
    place: Vec3,
    velocity: Vec3,
}

/// A character that collides.
struct Body {
    entity: Entity,
    key: RagdollState,
    collides: Collides,
    track: Affine3A,
    time: Duration,
    trees: Vec<Tree>,
    /// A ball around it.
    center: Vec3,
    radius: f32,
    /// Whether its episode begins.
    fresh: bool,
    /// Its limbs among the solids.
    limbs: Range<usize>,
}

/// Pairs of characters that pass through each other.
#[derive(Default)]
pub(crate) struct Passing(Vec<[Entity; 2]>);

/// Tells the physics of each character what is around it.
pub(crate) fn feel(
    mut marathon: ResMut<Marathon>,
    time: Res<Time<Fixed>>,
    (transforms, tracks): (TransformHelper, Tracks),
    mut obstacles: Query<(Entity, &Obstacle, &mut ObstacleMotion)>,
    ragdolls: Query<(Entity, &RagdollState, &Anatomy, &Collides)>,
    mut passing: Local<Passing>,
) {
    let dt = time.timestep().as_secs_f32();
    let (mut solids, mut apps) = (Vec::new(), Vec::new());
    for (entity, obstacle, mut motion) in &mut obstacles {
        let Ok(place) = transforms.compute_global_transform(entity) else { continue };
        apps.extend(solid_of(obstacle, &place, &mut motion, marathon.now, dt));
    }
    let mut all = Vec::new();
    for (entity, key, anatomy, collides) in ragdolls.iter().filter(|(.., collides)| collides.any()) {
        let awake = marathon.slot(*key).is_some_and(|slot| slot.asleep.is_none());
        if let (true, Some(track)) = (awake, tracks.get(entity)) {
            all.push((entity, *key, anatomy, *collides, track.affine()));
        }
    }
    let balls: Vec<(Vec3, f32)> =
        all.iter().map(|(_, key, anatomy, _, track)| ball(&marathon, *key, anatomy, track)).collect();
    let (mut bodies, mut alone) = (Vec::new(), Vec::new());
    for (i, (entity, key, anatomy, collides, track)) in all.into_iter().enumerate() {
        // most characters of a crowd touch nothing: their limbs need not be known
        let (center, reach) = balls[i];
        let meets = |place: Vec3, radius: f32| center.distance(place) < reach + radius + NEAR;
        let others = || balls.iter().enumerate().any(|(j, (place, radius))| j != i && meets(*place, *radius));
        let near = apps.iter().any(|solid: &Solid| meets(solid.place, solid.radius)) || collides.characters && others();
        let sample = marathon.slot(key).and_then(|slot| slot.history.back()).filter(|_| near);
        let around = sample.and_then(|s| Some((s, pose::around(&anatomy.model, &s.qpos, &s.qvel)?)));
        match around {
            Some((sample, around)) => {
                bodies.push(body(entity, &anatomy.model, track, &around, (&key, collides, sample), &mut solids));
            }
            None => alone.push(key),
        }
    }
    solids.extend(apps);
    for key in alone {
        if let Some(batch) = marathon.batch(key) {
            batch.feel(key.lane, &[]);
        }
    }
    passing.update(&bodies, &solids);
    for own in &bodies {
        let mut near: Vec<(f32, &Solid)> =
            solids.iter().filter_map(|solid| Some((own.distance(solid, &passing)?, solid))).collect();
        // the nearest ones if there are too many; the order of the rest does not depend on the order of entities
        near.sort_by(|(a, x), (b, y)| {
            a.total_cmp(b)
                .then_with(|| x.place.to_array().partial_cmp(&y.place.to_array()).unwrap_or(std::cmp::Ordering::Equal))
        });
        near.truncate(marathon_physics::Obstacle::MOST);
        let told: Vec<marathon_physics::Obstacle> = near.into_iter().map(|(_, solid)| own.sees(solid)).collect();
        if let Some(batch) = marathon.batch(own.key) {
            batch.feel(own.key.lane, &told);
        }
    }
}

/// A ball that holds a character in any pose: around its root body, or without bounds if it has several.
fn ball(marathon: &Marathon, key: RagdollState, anatomy: &Anatomy, track: &Affine3A) -> (Vec3, f32) {
    let reach = marathon.kinds.get(key.kind).and_then(|kind| kind.reach);
    let sample = marathon.slot(key).and_then(|slot| slot.history.back());
    let root = || sample?.qpos.get(anatomy.model.joints.first()?.qpos_adr..)?.first_chunk::<3>().copied();
    match (reach, root()) {
        (Some(reach), Some(root)) => (track.transform_point3(to_game(root)), reach),
        _ => (Vec3::ZERO, f32::INFINITY),
    }
}

/// An obstacle of the app with its velocity since the last tick.
fn solid_of(
    obstacle: &Obstacle,
    place: &GlobalTransform,
    motion: &mut ObstacleMotion,
    time: Duration,
    dt: f32,
) -> Option<Solid> {
    let (scale, turn, place) = place.to_scale_rotation_translation();
    let (shape, radius) = obstacle.shape(scale, &mut motion.field)?;
    if !(place.is_finite() && turn.is_finite()) {
        return None;
    }
    let (mut linear, mut angular) = (Vec3::ZERO, Vec3::ZERO);
    if let Some((before, turned)) = motion.last.filter(|_| dt > 0.0) {
        let way = place - before;
        if way.length() < JUMP * dt {
            let change = turn * turned.inverse();
            // the shorter of the two ways around
            let change = if change.w < 0.0 { -change } else { change };
            (linear, angular) = (way / dt, change.to_scaled_axis() / dt);
        }
    }
    motion.last = Some((place, turn));
    Some(Solid { shape, radius, place, turn, linear, angular, time, owner: None })
}

/// A character, whose limbs become solids if it collides with others.
fn body(
    entity: Entity,
    model: &Model,
    track: Affine3A,
    around: &[marathon_render::Pose; 2],
    (key, collides, sample): (&RagdollState, Collides, &PoseSample),
    solids: &mut Vec<Solid>,
) -> Body {
    let velocity = |point: &dyn Fn(&marathon_render::Pose) -> [f64; 3]| {
        track.transform_vector3(to_game(pose::velocity(around, point)))
    };
    let (pose, time, first) = (&around[1], sample.time, solids.len());
    let root =
        |body: usize| std::iter::successors(Some(body), |b| Some(model.bodies[*b].parent).filter(|p| *p > 0)).last();
    let trees: Vec<Tree> = (1..model.bodies.len())
        .filter(|b| model.bodies[*b].parent == 0 && model.bodies[*b].weld_id != 0)
        .map(|root| Tree {
            root,
            mass: model.bodies[root].subtree_mass as f32,
            place: track.transform_point3(to_game(pose.bodies[root].pos)),
            velocity: velocity(&|pose| pose.bodies[root].pos),
        })
        .collect();
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for (index, geom) in model.geoms.iter().enumerate() {
        let collides_at_all = geom.contype != 0 || geom.conaffinity != 0;
        let Some((shape, radius)) = limb(geom).filter(|_| collides_at_all && model.bodies[geom.body].weld_id != 0)
        else {
            continue;
        };
        let GeomPose { pos, mat } = &pose.geoms[index];
        let place = track.transform_point3(to_game(*pos));
        (low, high) = (low.min(place - radius), high.max(place + radius));
        if !collides.characters {
            continue;
        }
        let column = |c: usize| track.transform_vector3(to_game([mat[0][c], mat[1][c], mat[2][c]]));
        // the axes of the physics are x, -z, y
        let turn = Quat::from_mat3(&Mat3::from_cols(column(0), column(2), -column(1))).normalize();
        let linear = velocity(&|pose| pose.geoms[index].pos);
        let tree = root(geom.body).and_then(|root| trees.iter().find(|tree| tree.root == root));
        let owner = tree.map(|tree| (entity, *tree));
        solids.push(Solid { shape, radius, place, turn, linear, angular: Vec3::ZERO, time, owner });
    }
    let (center, radius) =
        if low.is_finite() { (0.5 * (low + high), 0.5 * (high - low).length()) } else { (Vec3::ZERO, 0.0) };
    let (fresh, limbs) = (sample.fresh, first..solids.len());
    Body { entity, key: *key, collides, track, time, trees, center, radius, fresh, limbs }
}

/// The solid of a geom for others, and the radius of a ball around it. Shapes that obstacles do not have become similar ones.
fn limb(geom: &Geom) -> Option<(ObstacleShape, f32)> {
    let [x, y, z] = geom.size;
    // a box in a cylinder whose corners are on its surface
    let inner = std::f64::consts::FRAC_1_SQRT_2;
    let (shape, radius) = match geom.kind {
        GeomType::Sphere => (ObstacleShape::Sphere { radius: x }, x),
        GeomType::Capsule => (ObstacleShape::Capsule { radius: x, half_length: y }, x + y),
        GeomType::Ellipsoid => (ObstacleShape::Sphere { radius: (x * y * z).cbrt() }, x.max(y).max(z)),
        GeomType::Cylinder if y > x => (ObstacleShape::Capsule { radius: x, half_length: y - x }, y),
        GeomType::Cylinder => (ObstacleShape::Box { half_size: [inner * x, inner * x, y] }, x + y),
        GeomType::Box | GeomType::Mesh => (ObstacleShape::Box { half_size: geom.size }, (x * x + y * y + z * z).sqrt()),
        GeomType::Plane | GeomType::Hfield => return None,
    };
    (radius > 0.0).then_some((shape, radius as f32))
}

impl Passing {
    fn has(&self, a: Entity, b: Entity) -> bool {
        self.0.contains(&[a.min(b), a.max(b)])
    }

    /// Finds the pairs that are inside each other as one of them begins, and those that still are.
    fn update(&mut self, bodies: &[Body], solids: &[Solid]) {
        let mut next = Vec::new();
        for (i, a) in bodies.iter().enumerate() {
            for b in &bodies[i + 1..] {
                let began = a.fresh || b.fresh || self.has(a.entity, b.entity);
                let near = || a.center.distance(b.center) < a.radius + b.radius;
                if began && near() && overlap(&solids[a.limbs.clone()], &solids[b.limbs.clone()]) {
                    next.push([a.entity.min(b.entity), a.entity.max(b.entity)]);
                }
            }
        }
        self.0 = next;
    }
}

/// Whether a ball around a solid of one list meets one around a solid of the other.
fn overlap(a: &[Solid], b: &[Solid]) -> bool {
    a.iter().any(|a| b.iter().any(|b| a.place.distance(b.place) < a.radius + b.radius))
}

impl Body {
    /// Distance to a solid that it may touch.
    fn distance(&self, solid: &Solid, passing: &Passing) -> Option<f32> {
        let felt = match &solid.owner {
            Some((owner, _)) if *owner == self.entity => false,
            Some((owner, _)) => self.collides.characters && !passing.has(self.entity, *owner),
            None => self.collides.obstacles,
        };
        let distance = self.center.distance(solid.place) - self.radius - solid.radius;
        (felt && distance < NEAR).then_some(distance)
    }

    /// A solid in the axes of its physics, at the time of its state.
    fn sees(&self, solid: &Solid) -> marathon_physics::Obstacle {
        let mut linear = solid.linear;
        if let Some((_, other)) = solid.owner {
            let own = self.trees.iter().min_by(|a, b| {
                let [a, b] = [a, b].map(|tree| tree.place.distance_squared(solid.place));
                a.total_cmp(&b)
            });
            if let Some(own) = own.filter(|own| own.mass + other.mass > 0.0) {
                linear += own.mass / (own.mass + other.mass) * (own.velocity - other.velocity);
            }
        }
        let ahead = self.time.as_secs_f32() - solid.time.as_secs_f32();
        let place = solid.place + solid.linear * ahead;
        let turn = Quat::from_scaled_axis(solid.angular * ahead) * solid.turn;
        let inverse = self.track.inverse();
        let (_, back, _) = inverse.to_scale_rotation_translation();
        let vector = |v: Vec3| to_physics(back * v);
        marathon_physics::Obstacle {
            shape: solid.shape.clone(),
            pos: to_physics(inverse.transform_point3(place)),
            quat: turn_to_physics(back * turn),
            velocity: vector(linear),
            angular_velocity: vector(solid.angular),
        }
    }
}
