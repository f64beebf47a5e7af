//! Touch sensors.

use super::Readings;
use super::rays::ray_shape;
use crate::lanes::Real;
use crate::spatial::into_axes;

impl<T: Real> Readings<'_, T> {
    /// Normal forces of all contacts of a geom, with whatever it touches.
    #[inline(always)]
    pub(super) fn geom_touch(&self, geom: usize) -> T {
        let mut total = T::zero();
        for c in self.contact_forces() {
            if c.geoms.contains(&geom) {
                total += T::masked(c.on, c.push);
            }
        }
        total
    }

    /// Normal forces of the contacts of a site's body that are felt in the site's volume: those from whose point the
    /// ray against the force on the body meets the volume, which those inside it always do.
    #[inline(always)]
    pub(super) fn site_touch(&self, site: usize) -> T {
        let s = &self.sim.model.sites[site];
        let mount = &self.sim.sites[site];
        let axes = self.work.axes(mount);
        let size = [T::lit(s.size[0]), T::lit(s.size[1]), T::lit(s.size[2])];
        let mut total = T::zero();
        for c in self.contact_forces() {
            let [first, second] = c.geoms.map(|g| self.sim.model.geoms[g].body == s.body);
            if !first && !second {
                continue;
            }
            let start = into_axes(&axes, &self.arm_from(mount, Some(c.tree), &c.point));
            let normal = into_axes(&axes, &c.normal);
            let ray = if second { [-normal[0], -normal[1], -normal[2]] } else { normal };
            let hit = ray_shape(s.kind, &size, &start, &ray);
            let felt = T::and(c.on, T::not(hit.dist.lt(T::zero())));
            total += T::masked(felt, c.push.max(T::zero()));
        }
        total
    }
}
