//! Constraints of up to six rows between any two bodies, or over any set of joints.
//!
//! Contacts of moving bodies with each other and with terrain, equality constraints, limits of tendons and of ball
//! joints: whatever is not a contact with a level floor or a row of a single degree of freedom is a [`Block`]. A contact
//! block is a slot: every lane fills its slots in the order of its own contacts, so that two agents that touch the
//! ground with different limbs share a block. Lanes that leave a slot empty have stiffness zero in it.

use super::jacobian::{Jacobian, Side};
use crate::lanes::Real;
use crate::sim::Cost;

/// Values of up to six rows.
pub(crate) type RowValues<T> = [T; 6];

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
    pub d: RowValues<T>,
    /// Friction coefficients of rows 1 to 5; the bound of [`Cost::Dry`] is the first.
    pub mu: [T; 5],
    /// Regularized slope of an elliptic cone.
    pub slope: T,
    /// Minus the reference acceleration.
    pub u0: RowValues<T>,
    /// `J a - aref` at the present point and at the Newton point.
    pub u: RowValues<T>,
    pub next: RowValues<T>,
    /// Force of the present point in the sense of the solver's first identity.
    pub force: RowValues<T>,
    /// The force near the present point is `hold - stiffness u` (lower triangle, row by row).
    pub stiffness: [T; 21],
    pub hold: T,
    /// Which edges push; or (bottom, middle) zone of an elliptic cone; or (below the bound, positive).
    pub zones: [T::Mask; 10],
    /// Lanes whose stiffness has changed since the sparse factorization took note of it.
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
}
