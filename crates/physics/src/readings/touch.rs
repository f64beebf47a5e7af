//! Touch sensors.

use super::Readings;
use super::forces::ContactForce;
use super::rays::ray_shape;
use crate::algebra::spatial::into_axes;
use crate::lanes::Real;
use crate::rows::Source;

impl<T: Real> Readings<'_, T> {
    /// Normal forces of all contacts of a geom, with any other geom.
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

    /// Value of a touch sensor on a site, N, see [`Readings::touch_forces`]. The frames must be those from which the
    /// last physics step computed its forces.
    #[inline(always)]
    pub(super) fn site_touch(&self, site: usize) -> T {
        let mut total = T::zero();
        for row in &self.work.rows.contacts {
            total += self.felt(site, &self.floor_contact(row));
        }
        for block in self.work.rows.blocks.iter() {
            if block.source != Source::Contacts {
                continue;
            }
            for (index, on) in &block.members {
                if let Some(contact) = self.pair_contact(block, *index, *on) {
                    total += self.felt(site, &contact);
                }
            }
        }
        total
    }

    /// Contribution of one contact to a site's value.
    #[inline(always)]
    fn felt(&self, site: usize, c: &ContactForce<T>) -> T {
        let s = &self.sim.model.sites[site];
        let body = |g: usize| self.sim.model.geoms[g].body;
        let [first, second] = [body(c.geoms[0]) == s.body, body(c.geoms[1]) == s.body];
        if !first && !second {
            return T::zero();
        }
        let mount = &self.sim.sites[site];
        let axes = self.work.motion.axes(mount);
        let size = [T::lit(s.size[0]), T::lit(s.size[1]), T::lit(s.size[2])];
        let start = into_axes(&axes, &self.arm_from(mount, Some(c.tree), &c.point));
        let normal = into_axes(&axes, &c.normal);
        let ray = if second { [-normal[0], -normal[1], -normal[2]] } else { normal };
        let hit = ray_shape(s.kind, &size, &start, &ray);
        T::masked(T::and(c.on, T::not(hit.dist.lt(T::zero()))), c.push.max(T::zero()))
    }
}
