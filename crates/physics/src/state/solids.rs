//! The obstacles of a lane group, in the precision of its lanes.

use super::obstacle::{Obstacle, ObstacleShape};
use crate::algebra::spatial::*;
use crate::geometry::bounding_radius;
use crate::geometry::height::HeightField;
use crate::lanes::Real;
use crate::model::{GeomType, HField};
use std::sync::Arc;

/// An obstacle in the precision of the lanes.
#[derive(Clone, Debug)]
pub(crate) struct Solid<S: Real> {
    pub kind: GeomType,
    /// In MJCF's order; height fields have none.
    pub size: V3<S>,
    pub field: Option<Field<S>>,
    pub pos: V3<S>,
    pub quat: [S; 4],
    pub axes: Rot<S>,
    pub velocity: V3<S>,
    pub spin: V3<S>,
}

/// A height field as it was given, and as the lanes use it.
#[derive(Clone, Debug)]
pub(crate) struct Field<S: Real> {
    given: Arc<HField>,
    pub grid: Arc<HeightField<S>>,
}

impl<S: Real<Scalar = S>> Solid<S> {
    /// An obstacle, whose height field may be among those that are already `known`.
    fn of<T: Real<Scalar = S>>(obstacle: &Obstacle, known: &[Field<S>]) -> Self {
        let v3 = |v: [f64; 3]| v.map(T::scalar);
        let mut field = None;
        let (kind, size) = match &obstacle.shape {
            ObstacleShape::Sphere { radius } => (GeomType::Sphere, [*radius, 0.0, 0.0]),
            ObstacleShape::Capsule { radius, half_length } => (GeomType::Capsule, [*radius, *half_length, 0.0]),
            ObstacleShape::Box { half_size } => (GeomType::Box, *half_size),
            ObstacleShape::HField(given) => {
                let same = known.iter().find(|known| Arc::ptr_eq(&known.given, given)).cloned();
                let new = || Field { given: given.clone(), grid: Arc::new(HeightField::new(given)) };
                field = Some(same.unwrap_or_else(new));
                (GeomType::Hfield, [0.0; 3])
            }
        };
        let quat = obstacle.quat.map(T::scalar);
        let (velocity, spin) = (v3(obstacle.velocity), v3(obstacle.angular_velocity));
        Solid { kind, size: v3(size), field, pos: v3(obstacle.pos), quat, axes: quat_to_rot(&quat), velocity, spin }
    }

    fn widened<T: Real<Scalar = S>>(&self) -> Obstacle {
        let v3 = |v: &V3<S>| v.map(T::widen);
        let size = v3(&self.size);
        let shape = match (self.kind, &self.field) {
            (_, Some(field)) => ObstacleShape::HField(field.given.clone()),
            (GeomType::Sphere, None) => ObstacleShape::Sphere { radius: size[0] },
            (GeomType::Capsule, None) => ObstacleShape::Capsule { radius: size[0], half_length: size[1] },
            _ => ObstacleShape::Box { half_size: size },
        };
        let (velocity, angular_velocity) = (v3(&self.velocity), v3(&self.spin));
        Obstacle { shape, pos: v3(&self.pos), quat: self.quat.map(T::widen), velocity, angular_velocity }
    }

    /// Radius of a ball around it.
    fn radius<T: Real<Scalar = S>>(&self) -> f64 {
        let Some(field) = &self.field else { return bounding_radius(self.kind, &self.size.map(T::widen)) };
        let [x, y, _, base] = field.given.size;
        let height = T::widen(field.grid.top).max(base);
        (x * x + y * y + height * height).sqrt()
    }
}

/// Balls around obstacles, one per lane, and how they move.
#[derive(Clone, Debug)]
pub(crate) struct Balls<T: Real> {
    pub center: V3<T>,
    pub radius: T,
    pub velocity: V3<T>,
    pub spin: V3<T>,
}

/// The obstacles of every agent of a group.
#[derive(Clone, Debug)]
pub(crate) struct Solids<T: Real> {
    /// By lane.
    pub own: Vec<Vec<Solid<T::Scalar>>>,
    /// By the number of the obstacle in its lane.
    pub balls: Vec<Balls<T>>,
    /// By lane.
    moving: Vec<bool>,
}

/// Coordinate of the ball of an obstacle that a lane does not have: out of reach.
const NOWHERE: f64 = 1e10;

impl<T: Real> Solids<T> {
    /// No obstacles.
    pub fn new() -> Self {
        Solids { own: vec![Vec::new(); T::LANES], balls: Vec::new(), moving: vec![false; T::LANES] }
    }

    /// Whether no agent has an obstacle.
    pub fn is_empty(&self) -> bool {
        self.own.iter().all(Vec::is_empty)
    }

    /// Sets the obstacles of a lane. Their quaternions stay as they are.
    pub fn set(&mut self, lane: usize, obstacles: &[Obstacle]) {
        // the same field is usually set again at every decision, for every agent
        let mut known: Vec<Field<T::Scalar>> = Vec::new();
        if obstacles.iter().any(|o| matches!(o.shape, ObstacleShape::HField(_))) {
            known.extend(self.own.iter().flatten().filter_map(|solid| solid.field.clone()));
        }
        let own = &mut self.own[lane];
        own.clear();
        own.extend(obstacles.iter().map(|obstacle| Solid::of::<T>(obstacle, &known)));
        let moves = |solid: &Solid<T::Scalar>| solid.velocity.iter().chain(&solid.spin).any(|x| T::widen(*x) != 0.0);
        self.moving[lane] = own.iter().any(moves);
        self.surround(lane);
    }

    /// The obstacles of a lane, where they are now.
    pub fn get(&self, lane: usize) -> Vec<Obstacle> {
        self.own[lane].iter().map(Solid::widened::<T>).collect()
    }

    /// Lanes in which a ball about `center`, relative to `base`, is within `reach` of obstacle `k`.
    #[inline(always)]
    pub fn near(&self, k: usize, base: &V3<T>, center: &V3<T>, reach: T) -> T::Mask {
        let ball = &self.balls[k];
        let d = sub3(&sub3(&ball.center, base), center);
        let reach = ball.radius + reach;
        dot(&d, &d).lt(reach * reach)
    }

    /// The same for any obstacle.
    #[inline(always)]
    pub fn any_near(&self, base: &V3<T>, center: &V3<T>, reach: T) -> T::Mask {
        (0..self.balls.len()).fold(T::none(), |near, k| T::or(near, self.near(k, base, center, reach)))
    }

    /// Moves all by one step of `dt` seconds.
    pub fn advance(&mut self, dt: T::Scalar) {
        if !self.moving.contains(&true) {
            return;
        }
        for (lane, own) in self.own.iter_mut().enumerate() {
            for (solid, ball) in own.iter_mut().zip(&mut self.balls) {
                for i in 0..3 {
                    solid.pos[i] = solid.velocity[i].mul_add(dt, solid.pos[i]);
                    ball.center[i].set(lane, solid.pos[i]);
                }
                // an angular velocity in the obstacle's own axes
                let spin = [0, 1, 2].map(|i| dot(&solid.axes[i], &solid.spin));
                solid.quat = integrate_quat(&solid.quat, &spin, dt);
                solid.axes = quat_to_rot(&solid.quat);
            }
        }
    }

    /// Computes the balls of a lane from its obstacles.
    fn surround(&mut self, lane: usize) {
        let (zero, count) = (T::zero(), self.own.iter().map(Vec::len).max().unwrap_or(0));
        let none = Balls { center: [T::lit(NOWHERE); 3], radius: zero, velocity: [zero; 3], spin: [zero; 3] };
        self.balls.resize(count, none);
        let (nowhere, zero) = (T::scalar(NOWHERE), T::scalar(0.0));
        for (number, ball) in self.balls.iter_mut().enumerate() {
            let solid = self.own[lane].get(number);
            let radius = solid.map(Solid::radius::<T>);
            ball.radius.set(lane, radius.map_or(zero, T::scalar));
            for i in 0..3 {
                ball.center[i].set(lane, solid.map_or(nowhere, |solid| solid.pos[i]));
                ball.velocity[i].set(lane, solid.map_or(zero, |solid| solid.velocity[i]));
                ball.spin[i].set(lane, solid.map_or(zero, |solid| solid.spin[i]));
            }
        }
    }
}
