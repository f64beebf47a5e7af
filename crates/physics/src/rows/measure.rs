//! Row values of a [`Block`] from the motion of links and joints, and the effect of its forces on them.

use super::block::{Block, RowValues};
use super::jacobian::{Jacobian, Side};
use crate::algebra::spatial::*;
use crate::lanes::Real;

impl<T: Real> Block<T> {
    /// One row: a weighted sum over degrees of freedom.
    #[inline(always)]
    pub fn tie_joints(&mut self, terms: impl Iterator<Item = (usize, T)>) {
        if let Jacobian::Points { .. } = &self.jacobian {
            self.jacobian = Jacobian::Joints(Vec::new());
        }
        if let Jacobian::Joints(list) = &mut self.jacobian {
            list.clear();
            list.extend(terms);
        }
    }

    /// Rows between two points, given by their links and offsets. The links are the same in the lanes `on`.
    #[inline(always)]
    pub fn tie_points(&mut self, lin: [V3<T>; 3], ang: [V3<T>; 3], points: [(Option<usize>, V3<T>); 2], on: T::Mask) {
        if let Jacobian::Joints(_) = &self.jacobian {
            let side = || Side { links: Vec::with_capacity(T::LANES), r: [T::zero(); 3] };
            self.jacobian = Jacobian::Points { sides: [side(), side()], lin, ang };
        }
        if let Jacobian::Points { sides, lin: l, ang: a } = &mut self.jacobian {
            *l = lin;
            *a = ang;
            for (side, (link, r)) in sides.iter_mut().zip(points) {
                side.links.clear();
                side.links.extend(link.map(|l| (l, on)));
                side.r = r;
            }
        }
    }

    /// Row values for motions of the links and accelerations of the joints.
    #[inline(always)]
    pub fn of_motion(&self, link_acc: &[V6<T>], joint_acc: &[T]) -> RowValues<T> {
        let z = T::zero();
        let mut u = [z; 6];
        match &self.jacobian {
            Jacobian::Joints(terms) => {
                for (dof, coefficient) in terms {
                    u[0] = coefficient.mul_add(joint_acc[*dof], u[0]);
                }
            }
            Jacobian::Points { sides, lin, ang: turn } => {
                let a = sides[0].motion(link_acc);
                let b = sides[1].motion(link_acc);
                let v = sub3(&sides[1].velocity(&b), &sides[0].velocity(&a));
                for k in 0..self.dim.min(3) {
                    u[k] = dot(&lin[k], &v);
                }
                if self.dim > 3 {
                    let w = sub3(&ang(&b), &ang(&a));
                    for k in 3..self.dim {
                        u[k] = dot(&turn[k - 3], &w);
                    }
                }
            }
        }
        u
    }

    /// Motion direction of row `k` as a wrench about a reference point, for a side whose point is at `r`.
    #[inline(always)]
    pub fn wrench(&self, k: usize, r: &V3<T>) -> V6<T> {
        let z = T::zero();
        match &self.jacobian {
            Jacobian::Points { lin, .. } if k < 3 => {
                let t = cross(r, &lin[k]);
                [t[0], t[1], t[2], lin[k][0], lin[k][1], lin[k][2]]
            }
            Jacobian::Points { ang, .. } => [ang[k - 3][0], ang[k - 3][1], ang[k - 3][2], z, z, z],
            Jacobian::Joints(_) => [z; 6],
        }
    }

    /// Total wrench of row forces on a side whose point is at `r`.
    #[inline(always)]
    pub fn total_wrench(&self, f: &RowValues<T>, r: &V3<T>) -> V6<T> {
        let z = T::zero();
        let Jacobian::Points { lin, ang, .. } = &self.jacobian else { return [z; 6] };
        let (mut force, mut torque) = ([z; 3], [z; 3]);
        for i in 0..3 {
            for k in 0..self.dim.min(3) {
                force[i] = lin[k][i].mul_add(f[k], force[i]);
            }
            for k in 3..self.dim {
                torque[i] = ang[k - 3][i].mul_add(f[k], torque[i]);
            }
        }
        let t = cross_add(r, &force, &torque);
        [t[0], t[1], t[2], force[0], force[1], force[2]]
    }

    /// The degrees of freedom that the block acts on directly, with their coefficients.
    #[inline(always)]
    pub fn joint_terms(&self) -> &[(usize, T)] {
        match &self.jacobian {
            Jacobian::Joints(terms) => terms,
            Jacobian::Points { .. } => &[],
        }
    }

    /// Adds the block's force to the forces on links.
    #[inline(always)]
    pub fn exert_on_links(&self, links: &mut [V6<T>]) {
        let Jacobian::Points { sides, .. } = &self.jacobian else { return };
        for (s, side) in sides.iter().enumerate() {
            let w = self.total_wrench(&self.force, &side.r);
            for (link, lanes) in &side.links {
                for i in 0..6 {
                    let x = T::masked(*lanes, w[i]);
                    links[*link][i] += if s == 0 { -x } else { x };
                }
            }
        }
    }
}

impl<T: Real> Side<T> {
    /// Motion of the link that carries the point.
    #[inline(always)]
    fn motion(&self, link_acc: &[V6<T>]) -> V6<T> {
        let mut m = [T::zero(); 6];
        for (link, lanes) in &self.links {
            for i in 0..6 {
                m[i] = T::select(*lanes, link_acc[*link][i], m[i]);
            }
        }
        m
    }

    #[inline(always)]
    fn velocity(&self, m: &V6<T>) -> V3<T> {
        cross_add(&ang(m), &self.r, &lin(m))
    }
}
