//! Heights of the ground.

use super::Readings;
use crate::lanes::Real;
use crate::model::{Geom, GeomType, Model};

impl Model {
    /// Geoms that do not move and that one may stand on: planes, then height fields.
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
    /// Height at (x, y) of a plane, or of a height field that lies level, m, and the lanes in which the geom covers that
    /// place. Every agent has its own ground; beyond the border of a field, its height is that of the nearest place.
    ///
    /// A tilted field is taken for a level one, and a geom of another type for a plane.
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

    /// Height of the ground at (x, y), m, of the model's [`grounds`](Model::grounds): the highest of those that cover the
    /// place. Beyond all of them, that of the nearest place of the first; 0 if there are none.
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
