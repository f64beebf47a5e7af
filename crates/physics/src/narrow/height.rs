//! A height field and a sphere, capsule or box.
//!
//! Each cell of the grid is two prisms down to the base, and each prism that comes closer than the margin makes one
//! contact. MuJoCo finds it by iteration. For a sphere or capsule that is exact while the center (the capsule's axis) is
//! outside of the prism; inside, and for boxes that overlap the prism, MuJoCo's tolerance is 1e-6, while the shortest
//! way out is exact here. Where parallel features touch, MuJoCo's place among theirs is arbitrary; a box has its contact
//! in the middle of the common area.

use super::prism::Prism;
use super::*;
use crate::lanes::kernel_fn;
use crate::model::HField;

/// Heights over a grid, in the field's frame: columns along x, rows along y, centered at the origin.
#[derive(Clone, Debug)]
pub(crate) struct HeightField<S: Real> {
    pub rows: usize,
    pub cols: usize,
    /// Half the extent along x and y.
    pub half: [S; 2],
    /// Depth of the base below the origin.
    pub base: S,
    /// Heights, row by row.
    pub heights: Vec<S>,
    /// The largest of the heights.
    pub top: S,
}

/// A height field in its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Terrain<'a, S: Real> {
    pub field: &'a HeightField<S>,
    pub center: V3<S>,
    pub axes: Rot<S>,
}

kernel_fn! {
    /// Finds the contacts of a height field and a capsule, or a sphere (a capsule with `half` zero), and appends them.
    pub(crate) fn field_capsule<'a, S>(a: &'a Terrain<'a, S>, b: &'a Capsule<S>, margin: S, out: &'a mut Touches<S>) {
        let center = into_axes(&a.axes, &sub3(&b.center, &a.center));
        let arm = scale3(&into_axes(&a.axes, &b.axis), b.half);
        let reach = b.radius + margin;
        let extent = [arm[0].abs() + reach, arm[1].abs() + reach, arm[2].abs() + reach];
        let Some(window) = a.field.window(&center, &extent) else { return };
        // level and across the segment; zero if that is upright
        let flat2 = arm[0].mul_add(arm[0], arm[1] * arm[1]);
        let inv = if less(S::zero(), flat2) { flat2.sqrt().recip() } else { S::zero() };
        let across = [-arm[1] * inv, arm[0] * inv];
        let base = -a.field.base - center[2];
        for r in window.rows[0]..window.rows[1] {
            for c in window.cols[0]..window.cols[1] {
                for top in a.field.cell(r, c, &center) {
                    if is_below(&top, -extent[2]) || is_beside(&top, &across, reach) {
                        continue;
                    }
                    let Some(gap) = (Prism { top, base }).gap(&arm, reach) else { continue };
                    let dist = gap.dist - b.radius;
                    let local = axpy3(&gap.normal, dist.mul_add(S::lit(-0.5), -b.radius), &scale3(&arm, gap.along));
                    let pos = rotate_add(&a.axes, &local, &b.center);
                    out.push(Touch::new(dist, pos, rotate(&a.axes, &gap.normal), margin));
                }
                if out.is_full() {
                    return;
                }
            }
        }
    }
}

kernel_fn! {
    /// Finds the contacts of a height field and a box and appends them.
    pub(crate) fn field_box<'a, S>(a: &'a Terrain<'a, S>, b: &'a Block<S>, margin: S, out: &'a mut Touches<S>) {
        let center = into_axes(&a.axes, &sub3(&b.center, &a.center));
        let mut arms = [[S::zero(); 3]; 3];
        let mut extent = [margin; 3];
        for k in 0..3 {
            arms[k] = scale3(&into_axes(&a.axes, &b.axes[k]), b.half[k]);
            for i in 0..3 {
                extent[i] += arms[k][i].abs();
            }
        }
        let Some(window) = a.field.window(&center, &extent) else { return };
        let base = -a.field.base - center[2];
        for r in window.rows[0]..window.rows[1] {
            for c in window.cols[0]..window.cols[1] {
                for top in a.field.cell(r, c, &center) {
                    if is_below(&top, -extent[2]) {
                        continue;
                    }
                    let Some(gap) = (Prism { top, base }).gap_to_box(&arms, &b.half, margin) else { continue };
                    let pos = rotate_add(&a.axes, &gap.pos, &b.center);
                    out.push(Touch::new(gap.dist, pos, rotate(&a.axes, &gap.normal), margin));
                }
                if out.is_full() {
                    return;
                }
            }
        }
    }
}

/// Cells of the grid, first and past the last.
struct Window {
    rows: [usize; 2],
    cols: [usize; 2],
}

impl<S: Real> HeightField<S> {
    /// A model's field.
    pub(crate) fn new(field: &HField) -> Self {
        let [x, y, scale, base] = field.size;
        let elevations = field.data.iter().map(|z| f64::from(*z) * scale);
        HeightField {
            rows: field.nrow,
            cols: field.ncol,
            half: [S::lit(x), S::lit(y)],
            base: S::lit(base),
            top: S::lit(elevations.clone().fold(0.0, f64::max)),
            heights: elevations.map(S::lit).collect(),
        }
    }

    /// The same grid with other elevations, m.
    ///
    /// # Panics
    /// If their number is not that of the grid.
    pub(crate) fn with_elevations(&self, elevations: &[f32]) -> Self {
        assert_eq!(elevations.len(), self.rows * self.cols, "one elevation per point of the grid");
        let elevations = elevations.iter().map(|z| f64::from(*z));
        HeightField {
            top: S::lit(elevations.clone().fold(0.0, f64::max)),
            heights: elevations.map(S::lit).collect(),
            ..self.clone()
        }
    }

    /// The cells that come within `extent` of `center` along each axis, if there are any.
    #[inline(always)]
    fn window(&self, center: &V3<S>, extent: &V3<S>) -> Option<Window> {
        if less(self.top, center[2] - extent[2]) || less(center[2] + extent[2], -self.base) {
            return None;
        }
        let cols = cells(center[0], extent[0], self.half[0], self.cols)?;
        let rows = cells(center[1], extent[1], self.half[1], self.rows)?;
        Some(Window { rows, cols })
    }

    /// The tops of a cell's two prisms, relative to `center`: the upper left half, then the lower right.
    #[inline(always)]
    fn cell(&self, r: usize, c: usize, center: &V3<S>) -> [[V3<S>; 3]; 2] {
        let (upper_left, lower_left) = (self.vertex(r + 1, c, center), self.vertex(r, c, center));
        let (upper_right, lower_right) = (self.vertex(r + 1, c + 1, center), self.vertex(r, c + 1, center));
        [[upper_left, lower_left, upper_right], [lower_left, lower_right, upper_right]]
    }

    /// A grid point relative to `center`.
    #[inline(always)]
    fn vertex(&self, row: usize, col: usize, center: &V3<S>) -> V3<S> {
        [
            grid_line(self.half[0], self.cols, col) - center[0],
            grid_line(self.half[1], self.rows, row) - center[1],
            self.heights[row * self.cols + col] - center[2],
        ]
    }
}

/// Whether a prism with these upper corners is all below a height.
#[inline(always)]
fn is_below<S: Real>(top: &[V3<S>; 3], height: S) -> bool {
    less(top[0][2].max(top[1][2]).max(top[2][2]), height)
}

/// Whether a prism with these upper corners is farther than `reach` from the vertical plane through the origin.
#[inline(always)]
fn is_beside<S: Real>(top: &[V3<S>; 3], normal: &[S; 2], reach: S) -> bool {
    let (a, b, c) = (offset(&top[0], normal), offset(&top[1], normal), offset(&top[2], normal));
    less(reach, a.min(b).min(c)) || less(a.max(b).max(c), -reach)
}

/// Distance of a point from the vertical plane through the origin with this normal.
#[inline(always)]
fn offset<S: Real>(point: &V3<S>, normal: &[S; 2]) -> S {
    point[0].mul_add(normal[0], point[1] * normal[1])
}

/// Coordinate of line `i` of `n`.
#[inline(always)]
fn grid_line<S: Real>(half: S, n: usize, i: usize) -> S {
    (half + half).div(S::lit((n - 1) as f64)).mul_add(S::lit(i as f64), -half)
}

/// The cells between `lines` lines that come within `reach` of `center`, if there are any.
#[inline(always)]
fn cells<S: Real>(center: S, reach: S, half: S, lines: usize) -> Option<[usize; 2]> {
    let last = (lines - 1) as f64;
    let scale = S::lit(last).div(half + half);
    let from = S::widen(((center - reach + half) * scale).floor().get(0));
    let to = S::widen((-((-(center + reach + half)) * scale).floor()).get(0));
    // written so that NaN finds no cell
    if from < last && to > 0.0 { Some([from.max(0.0) as usize, to.min(last) as usize]) } else { None }
}
