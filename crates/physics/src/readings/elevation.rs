//! Heights of the ground.

use super::Readings;
use crate::lanes::Real;
use crate::model::{Geom, GeomType, Model};

impl Model {
    /// Static geoms that serve as ground: planes, then height fields.
    pub fn grounds(&self) -> Vec<usize> {
        let still = |kind: GeomType| {
            let ground = move |g: &usize| {
                let Geom { kind: own, contype, conaffinity, body, .. } = self.geoms[*g];
                own == kind && self.bodies[body].weld_id == 0 && (contype != 0 || conaffinity != 0)
            };
            (0..self.geoms.len()).filter(ground)
        };
        still(GeomType::Plane).chain(still(GeomType::Hfield)).collect()
    }
}

impl<T: Real> Readings<'_, T> {
    /// Height at (x, y) of a plane or a level height field, m, and the lanes in which the geom covers that position.
    /// Every agent has its own ground. Beyond the border of a field, the height is that of the nearest position.
    ///
    /// Tilted fields are treated as level, and geoms of other types as planes.
    #[inline(always)]
    pub fn elevation(&self, geom: usize, x: T, y: T) -> (T, T::Mask) {
        let (center, axes) = (self.geom_pos(geom), self.geom_axes(geom));
        let (dx, dy) = (x - center[0], y - center[1]);
        let Some(field) = self.sim.model.geoms[geom].hfield else {
            let normal = axes[2];
            let slope = (normal[0] * dx + normal[1] * dy).div(normal[2]);
            return (center[2] - slope, T::not(T::none()));
        };
        let along = [axes[0][0] * dx + axes[0][1] * dy, axes[1][0] * dx + axes[1][1] * dy];
        let (mut height, mut covered) = (T::zero(), 0);
        for lane in 0..T::LANES {
            let own = self.group.ground(self.sim, lane, field);
            let at = [along[0].get(lane), along[1].get(lane)];
            height.set(lane, own.elevation(at));
            covered |= T::Scalar::bits(own.covers(at)) << lane;
        }
        (height + center[2], T::from_bits(covered))
    }

    /// Height of the ground at (x, y), m: the highest of the model's [`grounds`](Model::grounds) that cover the
    /// position. Beyond all of them, the nearest height of the first one; 0 without grounds.
    #[inline(always)]
    pub fn ground_height(&self, grounds: &[usize], x: T, y: T) -> T {
        let mut height = T::zero();
        for (i, geom) in grounds.iter().enumerate() {
            let (own, on) = self.elevation(*geom, x, y);
            height = if i == 0 { own } else { T::select(on, height.max(own), height) };
        }
        height
    }
}
