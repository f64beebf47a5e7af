//! Where the geoms of pairs are, and how far each pair is from touching.
//!
//! Between evaluations of the forces geoms move by millimeters, and most pairs are much farther apart. A tested pair is skipped until
//! its two geoms together have moved as far as they were apart. This is conservative, so contacts are the same, to the bit, as if every
//! pair were tested every time. It also holds after any change of the state from outside: movements are differences of positions.

use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::sim::{Contacts, Sim};

/// Distance at which a pair counts as touching, as a fraction of its reach: far above the rounding of distances and
/// movements.
const SAFETY: f64 = 1e-3;
/// Largest clearance that is kept, as a fraction of the pair's reach.
const MOST: f64 = 64.0;
/// Movements are summed over this many evaluations at most, and up to this multiple of the least reach of a pair. So the rounding of a
/// sum is a small part of the safety.
const SUMMED: usize = 64;
const FAR: f64 = 32.0;
/// Part that is taken off a clearance with a sum of movements, as a fraction of the pair's reach: more than the rounding of both.
const CREEP: f64 = 1e-5;

/// The places of geoms and the clearances of pairs of one group of agents.
#[derive(Clone, Debug)]
pub(crate) struct GeomPlaces<T: Real> {
    /// Centers of the geoms in pairs, relative to their trees' reference points; for static geoms, in the world.
    pub centers: Vec<V3<T>>,
    /// Their third axes: a plane's normal, a capsule's direction.
    pub directions: Vec<V3<T>>,
    /// Axes of the links and mocap bodies whose turns matter, see `Paired::turning`.
    turned: Vec<Rot<T>>,
    /// Reference points of the trees.
    references: Vec<V3<T>>,
    /// Per pair: the sum of movements up to which its geoms cannot touch, m.
    safe: Vec<T>,
    /// Per pair of convex shapes.
    seen: Vec<Seen<T>>,
    /// Sums of movements: per geom the longest of any of its points, relative to its tree, m; per tree that of the reference point, m.
    ways: Vec<T>,
    shifts: Vec<T>,
    /// Last movement, per link or mocap body: of a point at 1 m by its turn, at most, m.
    turns: Vec<T>,
    /// Evaluations since the sums were zero, and the longest of the sums, m.
    evaluations: usize,
    longest: T,
}

impl<T: Real> GeomPlaces<T> {
    /// Without memory.
    pub fn none() -> Self {
        GeomPlaces {
            centers: Vec::new(),
            directions: Vec::new(),
            turned: Vec::new(),
            references: Vec::new(),
            safe: Vec::new(),
            seen: Vec::new(),
            ways: Vec::new(),
            shifts: Vec::new(),
            turns: Vec::new(),
            evaluations: 0,
            longest: T::zero(),
        }
    }

    /// Without knowledge of a group.
    pub fn new(sim: &Sim<T>) -> Self {
        let (z, geoms) = (T::zero(), sim.geoms.len());
        let Contacts { pairs, searches, turning, kept, .. } = &sim.contacts;
        let (pairs, searches, turning, trees) =
            if *kept { (pairs.len(), *searches, turning.len(), sim.trees) } else { (0, 0, 0, 0) };
        GeomPlaces {
            centers: vec![[z; 3]; geoms],
            directions: vec![[z; 3]; geoms],
            turned: vec![[[z; 3]; 3]; turning],
            references: vec![[z; 3]; trees],
            safe: vec![T::lit(-1.0); pairs],
            seen: vec![Seen::nothing(); searches],
            ways: vec![z; geoms],
            shifts: vec![z; trees],
            turns: vec![z; turning],
            evaluations: 0,
            longest: T::zero(),
        }
    }

    /// Memory of one agent's part, bytes.
    pub fn bytes(sim: &Sim<T>) -> usize {
        let Contacts { pairs, searches, turning, kept, .. } = &sim.contacts;
        if !kept {
            return 0;
        }
        let numbers = 7 * sim.geoms.len() + pairs.len() + 13 * searches + 10 * turning.len() + 4 * sim.trees;
        numbers * size_of::<T::Scalar>()
    }

    /// Whether these are places of the model's geoms.
    pub fn fit(&self, sim: &Sim<T>) -> bool {
        self.centers.len() == sim.geoms.len() && self.safe.len() == sim.contacts.pairs.len()
    }

    /// Records where a tree's reference point is.
    #[inline(always)]
    pub fn refer(&mut self, tree: usize, reference: &V3<T>) {
        let shift = sub3(reference, &self.references[tree]);
        self.shifts[tree] += dot(&shift, &shift).sqrt();
        self.longest = self.shifts[tree].max(self.longest);
        self.references[tree] = *reference;
    }

    /// Records the axes of number `i` of those whose turns matter.
    #[inline(always)]
    pub fn turn(&mut self, i: usize, rot: &Rot<T>) {
        self.turns[i] = chord(rot, &self.turned[i]);
        self.turned[i] = *rot;
    }

    /// Records where a capsule is, or another geom that a ball bounds. `half` is the half length of the capsule along its axis. No point
    /// of a capsule moves farther than one of its ends.
    #[inline(always)]
    pub fn follow(&mut self, geom: usize, center: &V3<T>, axis: &V3<T>, half: T) {
        let (shift, turn) = (sub3(center, &self.centers[geom]), sub3(axis, &self.directions[geom]));
        let along = (half * dot(&shift, &turn)).abs();
        let square = (half * half).mul_add(dot(&turn, &turn), along.mul_add(T::lit(2.0), dot(&shift, &shift)));
        self.ways[geom] += square.sqrt();
        self.longest = self.ways[geom].max(self.longest);
        self.put(geom, center, axis);
    }

    /// Adds the movement of a geom's points, up to `radius` from its center, by turn number `i`.
    #[inline(always)]
    pub fn follow_turn(&mut self, geom: usize, i: usize, radius: T) {
        self.ways[geom] = radius.mul_add(self.turns[i], self.ways[geom]);
        self.longest = self.ways[geom].max(self.longest);
    }

    /// Records where a geom is.
    #[inline(always)]
    pub fn put(&mut self, geom: usize, center: &V3<T>, axis: &V3<T>) {
        self.centers[geom] = *center;
        self.directions[geom] = *axis;
    }

    /// Ends the recording of an evaluation's movements. Long sums are taken off all clearances, and cleared.
    #[inline(always)]
    pub fn settle(&mut self, sim: &Sim<T>) {
        self.evaluations += 1;
        let far = T::splat(sim.contacts.least_reach) * T::lit(FAR);
        if self.evaluations < SUMMED && !T::any(far.lt(self.longest)) {
            return;
        }
        for index in 0..self.safe.len() {
            let reach = T::splat(sim.contacts.pair(&sim.geoms, index).reach);
            let way = reach.mul_add(T::lit(CREEP), self.way(sim, index));
            self.safe[index] -= way;
        }
        self.ways.fill(T::zero());
        self.shifts.fill(T::zero());
        (self.evaluations, self.longest) = (0, T::zero());
    }

    /// Sum of a pair's movements.
    #[inline(always)]
    fn way(&self, sim: &Sim<T>, index: usize) -> T {
        let pair = &sim.contacts.pairs[index];
        let [a, b] = pair.geoms.map(|g| g as usize);
        let way = self.ways[a] + self.ways[b];
        if pair.across { way + self.shift(sim, [a, b]) } else { way }
    }

    /// Sum of the movements of the trees of two geoms.
    #[inline(always)]
    fn shift(&self, sim: &Sim<T>, geoms: [usize; 2]) -> T {
        let links = geoms.into_iter().filter_map(|g| sim.geoms[g].link);
        links.fold(T::zero(), |sum, link| sum + self.shifts[sim.links[link].tree])
    }

    /// Lanes in which a pair is too far apart to touch.
    #[inline(always)]
    pub fn apart(&self, sim: &Sim<T>, index: usize) -> T::Mask {
        // a NaN compares false
        self.way(sim, index).lt(self.safe[index])
    }

    /// The lower bound of a pair's distance beyond the margin that is known.
    #[inline(always)]
    pub fn known(&self, sim: &Sim<T>, index: usize) -> T {
        // there is nothing of other models
        self.safe.get(index).map_or(T::lit(f64::NEG_INFINITY), |safe| *safe - self.way(sim, index))
    }

    /// Records a lower bound of the distance of a pair beyond its margin.
    #[inline(always)]
    pub fn remember(&mut self, sim: &Sim<T>, index: usize, distance: T, reach: T) {
        self.safe[index] = self.way(sim, index) + (reach * T::lit(MOST)).min(clearance(distance, reach));
    }

    /// A lower bound of the distance beyond the margin of convex pair number `i`, from what was seen. Points of the second geom are up
    /// to `radius` from its center.
    #[inline(always)]
    pub fn left(&self, i: usize, pose: &RelativePose<T>, radius: T) -> T {
        let seen = &self.seen[i];
        seen.distance - pose.from(&seen.pose, radius)
    }

    /// Records what a search has found in some lanes.
    #[inline(always)]
    pub fn see(&mut self, i: usize, lanes: T::Mask, pose: &RelativePose<T>, distance: T) {
        let seen = &mut self.seen[i];
        seen.distance = T::select(lanes, distance, seen.distance);
        for k in 0..3 {
            seen.pose.center[k] = T::select(lanes, pose.center[k], seen.pose.center[k]);
            for j in 0..3 {
                seen.pose.axes[k][j] = T::select(lanes, pose.axes[k][j], seen.pose.axes[k][j]);
            }
        }
    }
}

/// The pose of the second geom of a pair relative to the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RelativePose<T> {
    center: V3<T>,
    axes: Rot<T>,
}

impl<T: Real> RelativePose<T> {
    #[inline(always)]
    pub fn new(centers: &[V3<T>; 2], axes: &[Rot<T>; 2]) -> Self {
        let center = into_axes(&axes[0], &sub3(&centers[1], &centers[0]));
        RelativePose { center, axes: axes[1].map(|axis| into_axes(&axes[0], &axis)) }
    }

    /// Longest movement of a point up to `radius` from the second geom's center from another pose to this one.
    #[inline(always)]
    fn from(&self, other: &Self, radius: T) -> T {
        let shift = sub3(&self.center, &other.center);
        dot(&shift, &shift).sqrt() + radius * chord(&self.axes, &other.axes)
    }
}

/// Distance by which a turn between two frames moves a point at 1 m, at most. A turn by an angle a changes the matrix by the norm
/// sqrt(8) sin(a / 2), and moves the point by 2 sin(a / 2).
#[inline(always)]
fn chord<T: Real>(a: &Rot<T>, b: &Rot<T>) -> T {
    let mut square = T::zero();
    for k in 0..3 {
        let d = sub3(&a[k], &b[k]);
        square += dot(&d, &d);
    }
    (square * T::lit(0.5)).sqrt()
}

/// Result of the last search between two convex shapes. Neighbors in a tree move much, but little relative to each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<T> {
    pose: RelativePose<T>,
    /// A lower bound of the distance beyond the margin at this pose, m. Negative if the shapes may touch.
    distance: T,
}

impl<T: Real> Seen<T> {
    fn nothing() -> Self {
        let z = T::zero();
        Seen { pose: RelativePose { center: [z; 3], axes: [[z; 3]; 3] }, distance: T::lit(-1.0) }
    }
}

/// Distance of a pair from touching, if `distance` is its distance beyond the margin. Negative if it may touch.
#[inline(always)]
pub(crate) fn clearance<T: Real>(distance: T, reach: T) -> T {
    reach.neg_mul_add(T::lit(SAFETY), distance)
}
