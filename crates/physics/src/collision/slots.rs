//! Slots of pair contacts. A contact takes the next free slot of its own lane, in the order of the pairs, so that the
//! rows of a lane depend on that lane only.

use crate::algebra::spatial::*;
use crate::geometry::Touch;
use crate::lanes::{Real, kernel_fn};
use crate::rows::{Block, Jacobian, Source};
use crate::sim::{Cost, GeomPairOf, PairSpec, ShapePair, Sim, impedance, least_sliding};
use crate::state::{Group, Work};

/// The slots of the current class of pairs: the first one, and how many of them each lane has filled.
pub(super) struct Slots<T: Real> {
    class: (bool, usize),
    first: usize,
    filled: T,
    /// The static geom under the coming contacts, if it moves.
    pub(super) carrier: Option<Carrier<T>>,
}

/// The motion of a geom that no joint moves.
#[derive(Clone, Copy)]
pub(super) struct Carrier<T: Real> {
    /// Relative to the reference point of the contacts' positions.
    pub center: V3<T>,
    /// Of its center.
    pub velocity: V3<T>,
    pub spin: V3<T>,
}

impl<T: Real> Slots<T> {
    pub(super) fn new() -> Self {
        Slots { class: (false, 0), first: 0, filled: T::zero(), carrier: None }
    }

    /// A slot, with its number in its class, such that no lane of `lanes` has a free slot before it. `blocks` slots
    /// exist.
    #[inline(always)]
    fn least(&self, lanes: T::Mask, blocks: usize) -> (usize, T) {
        // a linear search is faster for few slots
        if blocks < self.first + 8 {
            return (self.first, T::zero());
        }
        let bits = T::bits(lanes);
        let filled = |lane: usize| T::widen(self.filled.get(lane)) as usize;
        let least = (0..T::LANES).filter(|l| bits >> l & 1 == 1).map(filled).min().unwrap_or(0);
        (self.first + least, T::lit(least as f64))
    }

    /// Starts a class of pairs. Its new slots begin at block `next`.
    #[inline(always)]
    pub(super) fn turn_to(&mut self, class: (bool, usize), next: usize) {
        if class != self.class {
            *self = Slots { class, first: next, filled: T::zero(), carrier: None };
        }
    }
}

/// The pair of a contact, and the tree whose reference point its position is relative to.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub index: usize,
    pub base: usize,
}

/// The rows of a contact, before they are in a slot.
struct ContactRows<T: Real> {
    /// Relative to the reference of each side's own tree.
    points: [V3<T>; 2],
    /// Normal and tangents.
    frame: [V3<T>; 3],
    d: T,
    u0: [T; 6],
    /// Factor of the friction coefficients.
    friction: Option<T>,
}

kernel_fn! {
    /// Writes the rows of a contact into the next free slot of each lane that has it.
    pub(super) fn write_contact<'a, T>(
        sim: &'a Sim<T>,
        group: &'a Group<T>,
        work: &'a mut Work<T>,
        slots: &'a mut Slots<T>,
        place: Place,
        touch: &'a Touch<T>,
    ) {
        let pair = &sim.contacts.pair(&sim.geoms, place.index);
        let one = T::lit(1.0);
        work.stats.contacts += T::bits(touch.on).count_ones() as u64;
        report(pair, work, touch);
        let mut links = pair.links;
        let t2 = cross(&touch.normal, &touch.tangent);
        let mut frame = [touch.normal, touch.tangent, t2];
        if links[1].is_none() {
            // the moving side comes second
            links.swap(0, 1);
            frame = [neg3(&frame[0]), neg3(&frame[1]), neg3(&frame[2])];
        }
        let rows = rows(sim, group, work, (place, slots.carrier), touch, &links, frame);

        // every lane's next free slot
        let mut left = touch.on;
        let (mut slot, mut number) = slots.least(touch.on, work.rows.blocks.len());
        while T::any(left) {
            let here = T::and(left, slots.filled.lt(number + T::lit(0.5)));
            if T::any(here) {
                if slot == work.rows.blocks.len() {
                    let new = work.rows.blocks.add();
                    open(&mut work.rows.blocks[new], pair, slot - slots.first);
                }
                let block = &mut work.rows.blocks[slot];
                fill(block, here, pair, &rows);
                for (s, link) in links.iter().enumerate() {
                    if let (Some(l), Jacobian::Points { sides, .. }) = (link, &mut block.jacobian) {
                        join::<T>(&mut sides[s].links, *l, here);
                    }
                }
                join::<T>(&mut block.members, place.index, here);
            }
            left = T::and(left, T::not(here));
            slot += 1;
            number += one;
        }
        slots.filled += T::masked(touch.on, one);
    }
}

/// Rows of a contact in the frame `frame`. Joints move at least its second side.
#[inline(always)]
fn rows<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &Work<T>,
    (place, carrier): (Place, Option<Carrier<T>>),
    touch: &Touch<T>,
    links: &[Option<usize>; 2],
    frame: [V3<T>; 3],
) -> ContactRows<T> {
    let pair = &sim.contacts.pair(&sim.geoms, place.index);
    let zero = T::zero();
    let mut points = [touch.pos; 2];
    let mut velocity = [[zero; 3]; 2];
    let mut spin = [[zero; 3]; 2];
    for s in 0..2 {
        let Some(l) = links[s] else { continue };
        let tree = sim.links[l].tree;
        if tree != place.base {
            points[s] = add3(&points[s], &sub3(&work.motion.reference[place.base], &work.motion.reference[tree]));
        }
        let v = &work.motion.vel[l];
        velocity[s] = cross_add(&ang(v), &points[s], &lin(v));
        spin[s] = ang(v);
    }
    if let Some(Carrier { center, velocity: own, spin: turn }) = carrier {
        velocity[0] = cross_add(&turn, &sub3(&touch.pos, &center), &own);
        spin[0] = turn;
    }
    let v = sub3(&velocity[1], &velocity[0]);
    let w = sub3(&spin[1], &spin[0]);

    let least = || T::lit(least_sliding::<T>(pair.cost == Cost::Elliptic)).div(T::splat(pair.friction[0]));
    let friction = group.friction().map(|factor| factor.max(least()));
    let violation = touch.dist - T::splat(pair.soft.margin);
    let (imp, mut d) = impedance(&pair.soft, violation);
    if let (Some(factor), Cost::Pyramid) = (friction, pair.cost) {
        d *= pyramid_share(T::splat(pair.friction[0]), factor);
    }
    if let Some(weights) = group.weights() {
        d *= weights.contact(pair.geoms.map(|g| sim.model.geoms[g].body));
    }
    let b = T::splat(pair.soft.b);
    let mut u0 = [zero; 6];
    for k in 0..pair.dim {
        let rate = if k < 3 { dot(&frame[k], &v) } else { dot(&frame[k - 3], &w) };
        u0[k] = rate * b;
    }
    u0[0] += imp * violation * T::splat(pair.soft.k);
    ContactRows { points, frame, d, u0, friction }
}

/// Ratio of an edge's stiffness at `factor` times the friction to that at the model's friction. `R` is proportional to
/// `mu^2 (1 + mu0^2)`.
#[inline(always)]
pub(super) fn pyramid_share<T: Real>(mu0: T, factor: T) -> T {
    let one = T::lit(1.0);
    let square = mu0 * mu0;
    let varied = square * (factor * factor);
    (one + square).div((factor * factor) * (one + varied))
}

/// Vertical component of the normal from which an obstacle carries what touches it: 45 degrees.
const CARRIES: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Marks the touching geoms. An obstacle counts as ground where it carries the geom, else as another body.
#[inline(always)]
fn report<T: Real>(pair: &GeomPairOf<T::Scalar>, work: &mut Work<T>, touch: &Touch<T>) {
    let on = touch.on;
    if pair.shapes == ShapePair::Obstacles {
        let carried = T::and(on, T::lit(CARRIES).lt(touch.normal[2]));
        work.contacts.touch_ground(pair.moving(), carried);
        let beside = &mut work.contacts.touching_bodies[pair.moving()];
        *beside = T::or(*beside, T::and(on, T::not(carried)));
    } else if pair.coupled {
        for g in pair.geoms {
            work.contacts.touching_bodies[g] = T::or(work.contacts.touching_bodies[g], on);
        }
    } else {
        work.contacts.touch_ground(pair.moving(), on);
    }
}

/// Adds lanes to the entry of `key`.
#[inline(always)]
fn join<T: Real>(entries: &mut Vec<(usize, T::Mask)>, key: usize, lanes: T::Mask) {
    for (k, m) in entries.iter_mut() {
        if *k == key {
            *m = T::or(*m, lanes);
            return;
        }
    }
    entries.push((key, lanes));
}

/// Makes an empty contact slot of a pair's class.
#[inline(always)]
fn open<T: Real>(block: &mut Block<T>, pair: &PairSpec<T::Scalar>, slot: usize) {
    let z = [T::zero(); 3];
    block.reset(Source::Contacts, pair.cost, pair.dim);
    block.coupled = pair.coupled;
    block.slot = slot;
    block.tie_points([z; 3], [z; 3], [(None, z); 2], T::none());
}

/// Writes a contact into the lanes `here` of a slot.
#[inline(always)]
fn fill<T: Real>(block: &mut Block<T>, here: T::Mask, pair: &PairSpec<T::Scalar>, rows: &ContactRows<T>) {
    block.on = T::or(block.on, here);
    for k in 0..pair.dim {
        block.d[k] = T::select(here, rows.d * T::splat(pair.ratios[k]), block.d[k]);
        block.u0[k] = T::select(here, rows.u0[k], block.u0[k]);
    }
    let factor = rows.friction.unwrap_or(T::lit(1.0));
    for k in 0..pair.dim - 1 {
        block.mu[k] = T::select(here, T::splat(pair.friction[k]) * factor, block.mu[k]);
    }
    block.slope = T::select(here, T::splat(pair.slope) * factor, block.slope);
    if let Jacobian::Points { sides, lin, ang } = &mut block.jacobian {
        for k in 0..3 {
            for i in 0..3 {
                lin[k][i] = T::select(here, rows.frame[k][i], lin[k][i]);
                if pair.dim > 3 {
                    ang[k][i] = T::select(here, rows.frame[k][i], ang[k][i]);
                }
            }
        }
        for (side, point) in sides.iter_mut().zip(&rows.points) {
            for i in 0..3 {
                side.r[i] = T::select(here, point[i], side.r[i]);
            }
        }
    }
}
