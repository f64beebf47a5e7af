//! A height field and a sphere or capsule.
//!
//! All lanes look at the faces of their prisms at once, each at those of its own window on the grid. That tells most
//! of them apart: too far away, or an end of the capsule over the top face. What is left (edges, and segments that have
//! sunk in) needs branches and goes prism by prism.

use super::height::{Step, Terrain};
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
            // any unit vector will do where there is no gap
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

/// Finds the contacts of a height field and a capsule, or a sphere (a capsule with `half` zero), in the lanes `near`, and
/// appends them to `out`.
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
    // level and across the segment; zero if that is upright
    let flat2 = arm[0].mul_add(arm[0], arm[1] * arm[1]);
    let inv = one.div(T::select(zero.lt(flat2), flat2, one).sqrt());
    let across = [-arm[1] * inv, arm[0] * inv];

    gaps.clear();
    let window = a.window(&center, &extent, near);
    let mut step = Step::default();
    loop {
        let in_row = window.has_row(step);
        if !T::any(in_row) {
            break;
        }
        loop {
            let on = T::and(in_row, window.has_col(step));
            if !T::any(on) {
                break;
            }
            for prism in a.cell(&window, step, &center, on) {
                let on = T::and(on, T::not(prism.highest().lt(-extent[2])));
                if !T::any(on) {
                    continue;
                }
                let glance = prism.glance(&arm, reach, on);
                let mut unclear = T::bits(glance.unclear);
                if unclear != 0 {
                    unclear &= !T::bits(is_beside(&prism, &across, reach));
                }
                collect(&prism, &arm, reach, &glance.gap, [T::bits(glance.over), unclear], gaps);
            }
            step.col += 1;
        }
        step = Step { col: 0, row: step.row + 1 };
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

/// Adds the gaps of one prism: those found, and those of the lanes that have to be looked at one by one.
#[inline(always)]
fn collect<T: Real>(
    prism: &Prism<T>,
    arm: &V3<T>,
    limit: T,
    found: &Gap<T>,
    [over, unclear]: [u32; 2],
    gaps: &mut Gaps<T>,
) {
    let mut left = over | unclear;
    while left != 0 {
        let lane = left.trailing_zeros() as usize;
        left &= left - 1;
        if over >> lane & 1 == 1 {
            let normal = pick(&found.normal, lane);
            gaps.push(lane, Gap { dist: found.dist.get(lane), normal, along: found.along.get(lane) });
        } else if let Some(gap) = gap(&prism.lane(lane), &pick(arm, lane), limit.get(lane)) {
            gaps.push(lane, gap);
        }
    }
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
