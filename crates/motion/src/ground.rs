//! Points of a model that can touch flat ground at `z = 0`.

use crate::kinematics::Pose;
use crate::rotation::quat;
use glam::{DMat3, DQuat, DVec3};
use marathon_physics::model::{GeomType, Model};

/// A part of a geom that can touch the ground in one point: a ball, a corner, the rim of a disc.
#[derive(Clone, Debug)]
pub(crate) struct Touch {
    pub body: usize,
    /// Center in the body's frame.
    pub center: DVec3,
    shape: Shape,
}

#[derive(Clone, Debug)]
enum Shape {
    Ball(f64),
    /// Orientation in the body's frame, semi-axes.
    Ellipsoid(DQuat, DVec3),
    /// Axis in the body's frame, radius.
    Disc(DVec3, f64),
}

impl Touch {
    /// All colliding moving geoms of a model.
    pub fn all(model: &Model) -> Vec<Touch> {
        let mut touches = Vec::new();
        for geom in &model.geoms {
            let fixed = model.bodies[geom.body].weld_id == 0;
            if fixed || geom.contype | geom.conaffinity == 0 {
                continue;
            }
            let turn = quat(&geom.quat);
            let size = DVec3::from_array(geom.size);
            let mut add = |offset: DVec3, shape: Shape| {
                let center = DVec3::from_array(geom.pos) + turn * offset;
                touches.push(Touch { body: geom.body, center, shape });
            };
            let ends = [DVec3::Z * size.y, DVec3::NEG_Z * size.y];
            match geom.kind {
                GeomType::Sphere => add(DVec3::ZERO, Shape::Ball(size.x)),
                GeomType::Capsule => ends.into_iter().for_each(|end| add(end, Shape::Ball(size.x))),
                GeomType::Cylinder => ends.into_iter().for_each(|end| add(end, Shape::Disc(turn * DVec3::Z, size.x))),
                GeomType::Ellipsoid => add(DVec3::ZERO, Shape::Ellipsoid(turn, size)),
                GeomType::Box => {
                    for corner in 0..8u32 {
                        let sign = |bit: u32| if corner >> bit & 1 == 0 { 1.0 } else { -1.0 };
                        add(size * DVec3::new(sign(0), sign(1), sign(2)), Shape::Ball(0.0));
                    }
                }
                GeomType::Plane | GeomType::Hfield | GeomType::Mesh => {}
            }
        }
        touches
    }

    /// The lowest point in the world.
    pub fn lowest(&self, pose: &Pose) -> DVec3 {
        let turn = pose.quat[self.body];
        let down = match &self.shape {
            Shape::Ball(radius) => DVec3::NEG_Z * *radius,
            Shape::Ellipsoid(local, size) => {
                let axes = DMat3::from_quat(turn * *local);
                let along = axes.transpose() * DVec3::NEG_Z * *size;
                axes * (along * *size) / along.length().max(1e-12)
            }
            Shape::Disc(axis, radius) => {
                let axis = turn * *axis;
                let flat = DVec3::NEG_Z + axis.z * axis;
                flat * (radius / flat.length().max(1e-9))
            }
        };
        pose.point(self.body, self.center) + down
    }
}
