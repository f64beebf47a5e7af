//! A height field and a sphere or capsule.
//!
//! The cells that the lanes need are distributed over all lanes, and all lanes check the faces of their prisms at once.
//! That decides most prisms: too far away, or an end of the capsule over the top face. The rest (edges, and segments
//! inside) needs branches and is processed prism by prism.

use super::height::{Cells, Terrain};
use super::prism::{Gap, Prism, gap};
use super::*;
use crate::lanes::MAX_LANES;

/// Gaps of one pair, lane by lane in the order of the lane's cells.
#[derive(Clone, Debug)]
pub(crate) struct Gaps<T: Real> {
    items: Vec<(T::Mask, Gap<T>)>,
    counts: [usize; MAX_LANES],
}

impl<T: Real> Gaps<T> {
    pub(crate) fn new() -> Self {
        Gaps { items: Vec::with_capacity(CAPACITY), counts: [0; MAX_LANES] }
    }

    #[inline(always)]
    fn clear(&mut self) {
        self.items.clear();
        self.counts = [0; MAX_LANES];
    }

    /// Adds a lane's gap if there is room.
    #[inline(always)]
    fn push(&mut self, lane: usize, gap: Gap<T::Scalar>) {
        let k = self.counts[lane];
        if k == CAPACITY {
            return;
        }
        if k == self.items.len() {
            let zero = T::zero();
            // any unit vector works without a gap
            self.items.push((T::none(), Gap { dist: zero, normal: [zero, zero, T::lit(1.0)], along: zero }));
        }
        self.counts[lane] += 1;
        let (on, item) = &mut self.items[k];
        *on = T::or(*on, T::from_bits(1 << lane));
        item.dist.set(lane, gap.dist);
        item.along.set(lane, gap.along);
        for i in 0..3 {
            item.normal[i].set(lane, gap.normal[i]);
        }
    }
}

/// Finds the contacts of a height field and a capsule, or a sphere (a capsule with `half` zero), in the lanes `near`,
/// and appends them to `out`.
#[inline(always)]
pub(crate) fn field_capsule<T: Real>(
    a: &Terrain<T>,
    b: &Capsule<T>,
    margin: T,
    near: T::Mask,
    gaps: &mut Gaps<T>,
    out: &mut Vec<Touch<T>>,
) {
    let (zero, one) = (T::zero(), T::lit(1.0));
    let center = into_axes(&a.axes, &sub3(&b.center, &a.center));
    let arm = scale3(&into_axes(&a.axes, &b.axis), b.half);
    let reach = b.radius + margin;
    let extent = [arm[0].abs() + reach, arm[1].abs() + reach, arm[2].abs() + reach];
    // horizontal and perpendicular to the segment; zero for an upright one
    let flat2 = arm[0].mul_add(arm[0], arm[1] * arm[1]);
    let inv = one.div(T::select(zero.lt(flat2), flat2, one).sqrt());
    let across = [-arm[1] * inv, arm[0] * inv];

    gaps.clear();
    let mut window = a.window(&center, &extent, near);
    let mut cells = Cells::new();
    while a.next_cells(&mut window, &mut cells) {
        let owner = &cells.owner;
        let arm = rearrange3(&arm, owner);
        let across = [across[0].rearrange(owner), across[1].rearrange(owner)];
        let (reach, lowest) = (reach.rearrange(owner), -extent[2].rearrange(owner));
        let prisms = a.prisms(&cells, &rearrange3(&center, owner));
        let glances = [prisms[0].glance(&arm, reach), prisms[1].glance(&arm, reach)];
        let (mut over, mut unclear) = ([0; 2], [0; 2]);
        for (k, prism) in prisms.iter().enumerate() {
            let glance = &glances[k];
            let on = T::and(cells.on(), T::not(prism.highest().lt(lowest)));
            over[k] = T::bits(T::and(on, glance.over));
            let left = T::and(on, glance.unclear);
            if T::any(left) {
                unclear[k] = T::bits(T::and(left, T::not(is_beside(prism, &across, reach))));
            }
        }
        let mut left = over[0] | over[1] | unclear[0] | unclear[1];
        while left != 0 {
            let at = left.trailing_zeros() as usize;
            left &= left - 1;
            let lane = owner[at] as usize;
            for (k, prism) in prisms.iter().enumerate() {
                if over[k] >> at & 1 == 1 {
                    gaps.push(lane, glances[k].gap.lane(at));
                } else if unclear[k] >> at & 1 == 1
                    && let Some(gap) = gap(&prism.lane(at), &pick(&arm, at), reach.get(at))
                {
                    gaps.push(lane, gap);
                }
            }
        }
    }

    for (on, gap) in &gaps.items {
        let dist = gap.dist - b.radius;
        let local = axpy3(&gap.normal, dist.mul_add(T::lit(-0.5), -b.radius), &scale3(&arm, gap.along));
        let pos = rotate_add(&a.axes, &local, &b.center);
        let mut touch = Touch::new(dist, pos, rotate(&a.axes, &gap.normal), margin);
        touch.on = T::and(touch.on, *on);
        out.push(touch);
    }
}

/// Permutes the lanes of a vector.
#[inline(always)]
fn rearrange3<T: Real>(v: &V3<T>, from: &[i32; MAX_LANES]) -> V3<T> {
    [v[0].rearrange(from), v[1].rearrange(from), v[2].rearrange(from)]
}

/// Lanes in which a prism is farther than `reach` from the vertical plane through the origin with this normal.
#[inline(always)]
fn is_beside<T: Real>(prism: &Prism<T>, normal: &[T; 2], reach: T) -> T::Mask {
    let [a, b, c] = &prism.top;
    let (a, b, c) = (offset(a, normal), offset(b, normal), offset(c, normal));
    T::or(reach.lt(a.min(b).min(c)), a.max(b).max(c).lt(-reach))
}

/// Distance of a point from the vertical plane through the origin with this normal.
#[inline(always)]
fn offset<T: Real>(point: &V3<T>, normal: &[T; 2]) -> T {
    point[0].mul_add(normal[0], point[1] * normal[1])
}
