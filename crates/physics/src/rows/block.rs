//! Constraints of up to six rows between any two bodies, or over any set of joints.
//!
//! A [`Block`] is any constraint other than contacts with a level floor and rows of a single degree of freedom.
//! Examples are contacts of moving bodies with each other and with terrain, equality constraints, and limits of tendons
//! and ball joints. A contact block is a slot. Every lane fills its slots in the order of its own contacts, so two
//! agents that touch the ground with different limbs share a block. Lanes with an empty slot have stiffness zero in it.

use super::jacobian::{Jacobian, Side};
use crate::lanes::Real;
use crate::sim::Cost;

/// Values of up to six rows.
pub(crate) type RowValues<T> = [T; 6];

/// The constraint of a block, for the readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// Contacts, listed in [`Block::members`].
    Contacts,
    /// An equality constraint, by index in the model.
    Equality(usize),
    /// A limit of a tendon: the upper one, or the lower one.
    TendonLimit { tendon: usize, upper: bool },
    /// The limit of the ball joint with this first degree of freedom.
    BallLimit(usize),
    /// Dry friction of a tendon.
    TendonFriction(usize),
    /// Armature of a tendon. It is no constraint: the solver finds its inertial force like that of a soft row.
    TendonInertia,
}

/// A constraint of up to six rows.
#[derive(Clone, Debug)]
pub(crate) struct Block<T: Real> {
    pub jacobian: Jacobian<T>,
    pub cost: Cost,
    pub source: Source,
    pub dim: usize,
    /// Whether some lane's rows connect two links or several joints, so that the block does not fit the tree.
    pub coupled: bool,
    pub on: T::Mask,
    /// Stiffness of the rows (of all edges of a pyramid: the first), 0 in lanes without this block.
    pub d: RowValues<T>,
    /// Friction coefficients of rows 1 to 5. The first is the bound of [`Cost::Dry`].
    pub mu: [T; 5],
    /// Regularized slope of an elliptic cone.
    pub slope: T,
    /// Negative reference acceleration.
    pub u0: RowValues<T>,
    /// `J a - aref` at the current point and at the Newton point.
    pub u: RowValues<T>,
    pub next: RowValues<T>,
    /// Force at the current point in the sense of the solver's first identity.
    pub force: RowValues<T>,
    /// The force near the current point is `hold - stiffness u` (lower triangle, row by row).
    pub stiffness: [T; 21],
    pub hold: T,
    /// Pushing edges; or the (bottom, middle) zone of an elliptic cone; or (below the bound, positive).
    pub zones: [T::Mask; 10],
    /// Lanes whose stiffness has changed since the last update of the sparse factorization.
    pub moved: T::Mask,
    /// Lanes whose zones come from the previous evaluation.
    pub recalled: T::Mask,
    /// For contacts: the index of the slot among those with as many rows.
    pub slot: usize,
    /// Contacts in this slot, whose forces are reported.
    pub members: Vec<(usize, T::Mask)>,
}

/// Index of entry (i, j), j <= i, of a packed lower triangle.
#[inline(always)]
pub(crate) const fn at(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

impl<T: Real> Block<T> {
    /// Creates an empty block.
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

    /// Resets the block: empty lanes, no members, everything zero. Its Jacobian must still be set.
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

    /// Takes the zones of the same slot from the previous evaluation, in the lanes where both hold the same contact.
    /// Contacts come last in `past`, by class and slot, and `at` advances along them. Elliptic cones are excluded,
    /// because their linear model depends on the acceleration.
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
}
