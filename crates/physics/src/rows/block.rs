//! Constraints of up to six rows between any two bodies, or over any set of joints.
//!
//! Contacts of moving bodies with each other and with terrain, equality constraints, limits of tendons and of ball
//! joints: whatever is not a contact with a level floor or a row of a single degree of freedom is a [`Block`]. A contact
//! block is a slot: every lane fills its slots in the order of its own contacts, so that two agents that touch the
//! ground with different limbs share a block. Lanes that leave a slot empty have stiffness zero in it.

use crate::lanes::Real;
use crate::solver::cone::Cone;
use crate::solver::{Move, Row, replace};
use crate::spatial::*;

/// Values of up to six rows.
pub(crate) type Rows<T> = [T; 6];

/// How a block's cost depends on its row values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cost {
    /// One row that pushes while its value is negative.
    Push,
    /// A friction pyramid: edges `u[0] +- mu[j] u[j + 1]` that push while negative.
    Pyramid,
    /// An elliptic friction cone.
    Elliptic,
    /// Every row pulls and pushes.
    Equal,
    /// One row whose force is bounded: dry friction.
    Dry,
}

/// What a block stands for: the readings look for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// Contacts, listed in [`Block::members`].
    Contacts,
    /// An equality constraint, by index in the model.
    Equality(usize),
    /// A limit of a tendon.
    TendonLimit(usize),
    /// The limit of the ball joint with this first degree of freedom.
    BallLimit(usize),
    /// Dry friction of a tendon.
    TendonFriction,
}

/// What the rows measure.
#[derive(Clone, Debug)]
pub(crate) enum Jacobian<T: Real> {
    /// Motion of a point of the second side relative to one of the first: linear along `lin` (rows 0 to 2), angular
    /// along `ang` (rows 3 to 5).
    Points { sides: [Side<T>; 2], lin: [V3<T>; 3], ang: [V3<T>; 3] },
    /// One row: a weighted sum over degrees of freedom.
    Joints(Vec<(usize, T)>),
}

/// One side of a [`Jacobian::Points`].
#[derive(Clone, Debug)]
pub(crate) struct Side<T: Real> {
    /// The links that carry the point, each with the lanes where it does; no link where the point stands still.
    pub links: Vec<(usize, T::Mask)>,
    /// The point, relative to the reference point of the link's tree.
    pub r: V3<T>,
}

/// A constraint of up to six rows.
#[derive(Clone, Debug)]
pub(crate) struct Block<T: Real> {
    pub jacobian: Jacobian<T>,
    pub cost: Cost,
    pub source: Source,
    pub dim: usize,
    /// Some lane's rows tie two links or several joints together, so that the block does not fit the tree.
    pub coupled: bool,
    pub on: T::Mask,
    /// Stiffness of the rows (of all edges of a pyramid: the first), 0 in lanes without this block.
    pub d: Rows<T>,
    /// Friction coefficients of rows 1 to 5; the bound of [`Cost::Dry`] is the first.
    pub mu: [T; 5],
    /// Regularized slope of an elliptic cone.
    pub slope: T,
    /// Minus the reference acceleration.
    pub u0: Rows<T>,
    /// `J a - aref` at the present point and at the Newton point.
    pub u: Rows<T>,
    pub next: Rows<T>,
    /// Force of the present point in the sense of the solver's first identity.
    pub force: Rows<T>,
    /// The force near the present point is `hold - stiffness u` (lower triangle, row by row).
    pub stiffness: [T; 21],
    pub hold: T,
    /// Which edges push; or (bottom, middle) zone of an elliptic cone; or (below the bound, positive).
    pub zones: [T::Mask; 10],
    /// Lanes whose stiffness has changed since [`crowd`](super::crowd) took note of it.
    pub moved: T::Mask,
    /// Lanes whose zones are those of the evaluation before.
    pub recalled: T::Mask,
    /// Of contacts: which slot of those with as many rows.
    pub slot: usize,
    /// Contacts in this slot: what to report the force for.
    pub members: Vec<(usize, T::Mask)>,
}

/// Index of entry (i, j), j <= i, of a packed lower triangle.
#[inline(always)]
pub(crate) const fn at(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

impl<T: Real> Block<T> {
    /// An empty block, to be filled in.
    pub fn new() -> Self {
        let z = T::zero();
        let side = || Side { links: Vec::with_capacity(T::LANES), r: [z; 3] };
        Block {
            jacobian: Jacobian::Points { sides: [side(), side()], lin: [[z; 3]; 3], ang: [[z; 3]; 3] },
            cost: Cost::Push,
            source: Source::Contacts,
            dim: 1,
            coupled: false,
            on: T::none(),
            d: [z; 6],
            mu: [z; 5],
            slope: z,
            u0: [z; 6],
            u: [z; 6],
            next: [z; 6],
            force: [z; 6],
            stiffness: [z; 21],
            hold: z,
            zones: [T::none(); 10],
            moved: T::none(),
            recalled: T::none(),
            slot: 0,
            members: Vec::new(),
        }
    }

    /// Starts the block anew: empty lanes, no members, everything zero; what it measures is still to be said.
    #[inline(always)]
    pub fn reset(&mut self, source: Source, cost: Cost, dim: usize) {
        let z = T::zero();
        self.source = source;
        self.cost = cost;
        self.dim = dim;
        self.coupled = true;
        self.on = T::none();
        self.d = [z; 6];
        self.mu = [z; 5];
        self.slope = z;
        self.u0 = [z; 6];
        self.hold = z;
        self.zones = [T::none(); 10];
        self.recalled = T::none();
        self.members.clear();
    }

    /// Takes over the zones of the same slot of the evaluation before, in the lanes where both hold the same contact.
    /// Contacts come last in `past`, by class and slot, and `at` walks along them. Not of an elliptic cone, whose linear model follows the acceleration.
    #[inline(always)]
    pub fn recall(&mut self, past: &[Block<T>], at: &mut usize) {
        match (self.source, self.cost) {
            (_, Cost::Equal) => self.recalled = self.on,
            (Source::Contacts, Cost::Push | Cost::Pyramid) => {
                let slot = |b: &Block<T>| (b.source == Source::Contacts, b.coupled, b.dim, b.slot);
                while past.get(*at).is_some_and(|former| slot(former) < slot(self)) {
                    *at += 1;
                }
                if let Some(former) = past.get(*at).filter(|former| slot(former) == slot(self)) {
                    self.recall_contacts(former);
                }
            }
            _ => {}
        }
    }

    #[inline(always)]
    fn recall_contacts(&mut self, past: &Block<T>) {
        for (pair, lanes) in &self.members {
            for (former, on) in &past.members {
                if former == pair {
                    self.recalled = T::or(self.recalled, T::and(*lanes, *on));
                }
            }
        }
        for k in 0..10 {
            self.zones[k] = T::and(self.recalled, past.zones[k]);
        }
    }

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

    /// Rows between two points, given by their links and places; the same links in the lanes `on`.
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

    /// Row values of motions of the links and accelerations of the joints.
    #[inline(always)]
    pub fn of_motion(&self, link_acc: &[V6<T>], joint_acc: &[T]) -> Rows<T> {
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
    pub fn total_wrench(&self, f: &Rows<T>, r: &V3<T>) -> V6<T> {
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

    /// Edges of the pyramid at `u`: pairs for each tangent.
    #[inline(always)]
    fn edge(&self, u: &Rows<T>, e: usize) -> T {
        let j = e / 2;
        if e.is_multiple_of(2) { self.mu[j].mul_add(u[j + 1], u[0]) } else { self.mu[j].neg_mul_add(u[j + 1], u[0]) }
    }

    fn edges(&self) -> usize {
        2 * (self.dim - 1)
    }

    /// Adds a force along an edge to row forces.
    #[inline(always)]
    fn add_edge(&self, f: &mut Rows<T>, e: usize, x: T) {
        let j = e / 2;
        f[0] += x;
        f[j + 1] =
            if e.is_multiple_of(2) { self.mu[j].mul_add(x, f[j + 1]) } else { self.mu[j].neg_mul_add(x, f[j + 1]) };
    }

    /// The force that the block exerts at `u`.
    #[inline(always)]
    pub fn true_force(&self, u: &Rows<T>) -> Rows<T> {
        let z = T::zero();
        let mut f = [z; 6];
        match self.cost {
            Cost::Push => f[0] = -(self.d[0] * u[0].min(z)),
            Cost::Equal => {
                for k in 0..self.dim {
                    f[k] = -(self.d[k] * u[k]);
                }
            }
            Cost::Dry => f[0] = -((self.d[0] * u[0]).max(-self.mu[0]).min(self.mu[0])),
            Cost::Pyramid => {
                for e in 0..self.edges() {
                    self.add_edge(&mut f, e, -(self.d[0] * self.edge(u, e).min(z)));
                }
            }
            Cost::Elliptic => {
                let cone = Cone::at(self, u);
                for k in 0..self.dim {
                    f[k] = T::masked(cone.bottom, -(self.d[k] * u[k]));
                }
                let normal = -(cone.weight * cone.excess * self.slope);
                f[0] = T::select(cone.middle, normal, f[0]);
                for k in 1..self.dim {
                    // against the sliding direction, in proportion to the normal force
                    let m = self.mu[k - 1];
                    let along = -(normal * m * (m * u[k]) * cone.inv_sliding);
                    f[k] = T::select(cone.middle, along, f[k]);
                }
            }
        }
        f
    }

    /// Force of the linear model of the present point, at `u`.
    #[inline(always)]
    pub fn linear_force(&self, u: &Rows<T>) -> Rows<T> {
        let mut f = [T::zero(); 6];
        for i in 0..self.dim {
            let mut sum = T::zero();
            for j in 0..self.dim {
                let w = if j <= i { self.stiffness[at(i, j)] } else { self.stiffness[at(j, i)] };
                sum = w.mul_add(u[j], sum);
            }
            f[i] = -sum;
        }
        f[0] += self.hold;
        f
    }

    /// Sets zones and the linear model at the present point in the lanes `live`; returns the lanes where they changed.
    #[inline(always)]
    pub fn activate(&mut self, live: T::Mask) -> T::Mask {
        let z = T::zero();
        let mut changed = T::none();
        match self.cost {
            Cost::Push => {
                let active = replace::<T>(live, T::and(self.u[0].lt(z), self.on), self.zones[0]);
                changed = T::xor(active, self.zones[0]);
                self.zones[0] = active;
                self.stiffness[0] = T::masked(active, self.d[0]);
            }
            Cost::Equal => {
                for k in 0..self.dim {
                    for j in 0..k {
                        self.stiffness[at(k, j)] = z;
                    }
                    self.stiffness[at(k, k)] = self.d[k];
                }
            }
            Cost::Dry => {
                let below = replace::<T>(live, (self.d[0] * self.u[0]).abs().lt(self.mu[0]), self.zones[0]);
                let positive = replace::<T>(live, z.lt(self.u[0]), self.zones[1]);
                changed = T::or(T::xor(below, self.zones[0]), T::xor(positive, self.zones[1]));
                self.zones[0] = below;
                self.zones[1] = positive;
                self.stiffness[0] = T::masked(below, self.d[0]);
                let bound = T::select(positive, -self.mu[0], self.mu[0]);
                self.hold = T::select(below, z, T::masked(self.on, bound));
            }
            Cost::Pyramid => {
                for k in 0..at(self.dim - 1, self.dim - 1) + 1 {
                    self.stiffness[k] = z;
                }
                for e in 0..self.edges() {
                    let pushes = T::and(self.edge(&self.u, e).lt(z), self.on);
                    let active = replace::<T>(live, pushes, self.zones[e]);
                    changed = T::or(changed, T::xor(active, self.zones[e]));
                    self.zones[e] = active;
                    let (s, j) = (T::masked(active, self.d[0]), e / 2 + 1);
                    let m = if e.is_multiple_of(2) { self.mu[j - 1] } else { -self.mu[j - 1] };
                    let sm = s * m;
                    self.stiffness[0] += s;
                    self.stiffness[at(j, 0)] += sm;
                    self.stiffness[at(j, j)] = sm.mul_add(m, self.stiffness[at(j, j)]);
                }
            }
            Cost::Elliptic => {
                let cone = Cone::at(self, &self.u);
                let bottom = replace::<T>(live, T::and(cone.bottom, self.on), self.zones[0]);
                let middle = replace::<T>(live, T::and(cone.middle, self.on), self.zones[1]);
                // on the curved part every move changes the model
                changed = T::or(T::xor(bottom, self.zones[0]), T::xor(middle, self.zones[1]));
                changed = T::or(changed, T::and(live, middle));
                self.zones[0] = bottom;
                self.zones[1] = middle;
                self.elliptic_stiffness(&cone, live);
            }
        }
        changed
    }

    /// Moves to the Newton point; returns the lanes where the linear model does not hold there.
    #[inline(always)]
    pub fn newton_point(&mut self, link_acc: &[V6<T>], joint_acc: &[T]) -> T::Mask {
        let z = T::zero();
        let ja = self.of_motion(link_acc, joint_acc);
        for k in 0..self.dim {
            self.next[k] = ja[k] + self.u0[k];
        }
        match self.cost {
            Cost::Equal => T::none(),
            Cost::Push => T::xor(T::and(self.next[0].lt(z), self.on), self.zones[0]),
            Cost::Dry => {
                let below = (self.d[0] * self.next[0]).abs().lt(self.mu[0]);
                let flipped = T::and(T::not(below), T::xor(z.lt(self.next[0]), self.zones[1]));
                T::and(self.on, T::or(T::xor(below, self.zones[0]), flipped))
            }
            Cost::Pyramid => {
                let mut changed = T::none();
                for e in 0..self.edges() {
                    let active = T::and(self.edge(&self.next, e).lt(z), self.on);
                    changed = T::or(changed, T::xor(active, self.zones[e]));
                }
                changed
            }
            Cost::Elliptic => {
                // on the curved part of the cone the model is never exact
                let cone = Cone::at(self, &self.next);
                let differs = T::or(T::xor(cone.bottom, self.zones[0]), T::or(cone.middle, self.zones[1]));
                T::and(self.on, differs)
            }
        }
    }

    /// Moves; returns the lanes whose linear model changed.
    #[inline(always)]
    pub fn advance(&mut self, step: &Move<T>) -> T::Mask {
        let linear = self.linear_force(&self.next);
        for i in 0..self.dim {
            self.u[i] = step.of(self.u[i], self.next[i]);
            self.force[i] = step.of(self.force[i], linear[i]);
        }
        self.activate(step.live())
    }

    /// Adds the block's force to the forces on links and joints.
    #[inline(always)]
    pub fn exert(&self, links: &mut [V6<T>], joints: &mut [T]) {
        match &self.jacobian {
            Jacobian::Joints(terms) => {
                for (dof, coefficient) in terms {
                    joints[*dof] = coefficient.mul_add(self.force[0], joints[*dof]);
                }
            }
            Jacobian::Points { sides, .. } => {
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
    }

    #[inline(always)]
    fn along(&self, f: &Rows<T>) -> T {
        let mut sum = T::zero();
        for k in 0..self.dim {
            sum = (self.next[k] - self.u[k]).mul_add(f[k], sum);
        }
        sum
    }
}

impl<T: Real> Row<T> for Block<T> {
    #[inline(always)]
    fn ends(&self) -> [T; 3] {
        [self.along(&self.force), self.along(&self.linear_force(&self.next)), self.along(&self.true_force(&self.u))]
    }

    #[inline(always)]
    fn slope(&self, alpha: T) -> [T; 2] {
        let z = T::zero();
        let (mut u, mut du) = ([z; 6], [z; 6]);
        for k in 0..self.dim {
            du[k] = self.next[k] - self.u[k];
            u[k] = du[k].mul_add(alpha, self.u[k]);
        }
        match self.cost {
            Cost::Push => {
                let pushing = T::masked(u[0].lt(z), self.d[0] * du[0]);
                [pushing * u[0], pushing * du[0]]
            }
            Cost::Equal => {
                let (mut s1, mut s2) = (z, z);
                for k in 0..self.dim {
                    let w = self.d[k] * du[k];
                    s1 = w.mul_add(u[k], s1);
                    s2 = w.mul_add(du[k], s2);
                }
                [s1, s2]
            }
            Cost::Dry => {
                let force = self.true_force(&u)[0];
                let below = (self.d[0] * u[0]).abs().lt(self.mu[0]);
                [-(du[0] * force), T::masked(below, self.d[0] * du[0]) * du[0]]
            }
            Cost::Pyramid => {
                let (mut s1, mut s2) = (z, z);
                for e in 0..self.edges() {
                    let (x, dx) = (self.edge(&u, e), self.edge(&du, e));
                    let pushing = T::masked(x.lt(z), dx);
                    s1 = pushing.mul_add(x, s1);
                    s2 = pushing.mul_add(dx, s2);
                }
                [self.d[0] * s1, self.d[0] * s2]
            }
            Cost::Elliptic => self.elliptic_slope(&u, &du),
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
