//! Height fields, and contacts of a height field with a box.
//!
//! Each cell of the grid is two prisms down to the base, and each prism closer than the margin makes one contact.
//! MuJoCo finds it by iteration. For a sphere or capsule that is exact while the center (the capsule's axis) is outside
//! the prism. Inside, and for boxes that overlap the prism, MuJoCo's tolerance is 1e-6, while the shortest way out is
//! exact here. Where parallel features touch, MuJoCo's contact point within them is arbitrary. A box has its contact in
//! the middle of the common area.

use super::prism::Prism;
use super::*;
use crate::lanes::{MAX_LANES, kernel_fn};
use crate::model::HField;

/// Heights over a grid, in the field's frame: columns along x, rows along y, centered at the origin.
#[derive(Clone, Debug)]
pub(crate) struct HeightField<S: Real> {
    pub rows: usize,
    pub cols: usize,
    /// Half the extent along x and y.
    pub(super) half: [S; 2],
    /// Size of a cell, and its inverse.
    pub(super) cell: [S; 2],
    pub(super) per_cell: [S; 2],
    /// Depth of the base below the origin.
    pub base: S,
    /// Heights, row by row.
    pub heights: Vec<S>,
    /// The largest of the heights.
    pub top: S,
    /// Normals of the walls of a cell's two prisms.
    walls: [[[S; 2]; 3]; 2],
}

impl<S: Real> HeightField<S> {
    /// A model's field.
    pub(crate) fn new(field: &HField) -> Self {
        let [x, y, scale, base] = field.size;
        let elevations = field.data.iter().map(|z| f64::from(*z) * scale);
        let lines = [field.ncol, field.nrow].map(|n| (n - 1) as f64);
        let cell = [2.0 * x / lines[0], 2.0 * y / lines[1]];
        // the diagonal goes from the lower left to the upper right
        let slant = (cell[0] * cell[0] + cell[1] * cell[1]).sqrt();
        let diagonal = [cell[1] / slant, -cell[0] / slant];
        let upper_left = [[-1.0, 0.0], diagonal, [0.0, 1.0]];
        let lower_right = [[0.0, -1.0], [1.0, 0.0], [-diagonal[0], -diagonal[1]]];
        HeightField {
            rows: field.nrow,
            cols: field.ncol,
            half: [x, y].map(S::lit),
            cell: cell.map(S::lit),
            per_cell: cell.map(|c| S::lit(1.0 / c)),
            base: S::lit(base),
            top: S::lit(elevations.clone().fold(0.0, f64::max)),
            heights: elevations.map(S::lit).collect(),
            walls: [upper_left, lower_right].map(|prism| prism.map(|wall| wall.map(S::lit))),
        }
    }

    /// The same grid with other elevations, m.
    ///
    /// # Panics
    /// If their number differs from that of the grid.
    pub(crate) fn with_elevations(&self, elevations: &[f32]) -> Self {
        assert_eq!(elevations.len(), self.rows * self.cols, "one elevation per point of the grid");
        let elevations = elevations.iter().map(|z| f64::from(*z));
        HeightField {
            top: S::lit(elevations.clone().fold(0.0, f64::max)),
            heights: elevations.map(S::lit).collect(),
            ..self.clone()
        }
    }
}

impl<S: Real<Scalar = S>> HeightField<S> {
    /// Height of the surface at a position in the field's frame. Beyond the border, the height at the nearest position.
    #[inline(always)]
    pub(crate) fn elevation(&self, at: [S; 2]) -> S {
        let (mut first, mut part) = ([0; 2], [S::zero(); 2]);
        for (i, lines) in [self.cols, self.rows].into_iter().enumerate() {
            let last = (lines - 1) as f64;
            let lines_in = ((at[i] + self.half[i]) * self.per_cell[i]).max(S::zero()).min(S::lit(last));
            let line = S::widen(lines_in.floor()).max(0.0).min(last - 1.0);
            first[i] = line as usize;
            part[i] = lines_in - S::lit(line);
        }
        let height = |column: usize, row: usize| self.heights[(first[1] + row) * self.cols + first[0] + column];
        let (corner, across, [x, y]) = (height(0, 0), height(1, 1), part);
        // the diagonal goes from the lower left to the upper right
        let (right, upper) = (height(1, 0), height(0, 1));
        let lower_right = y.mul_add(across - right, x.mul_add(right - corner, corner));
        let upper_left = x.mul_add(across - upper, y.mul_add(upper - corner, corner));
        S::select(y.lt(x), lower_right, upper_left)
    }

    /// Whether a position in the field's frame is within its border.
    #[inline(always)]
    pub(crate) fn covers(&self, at: [S; 2]) -> S::Mask {
        S::and(at[0].abs().lt(self.half[0]), at[1].abs().lt(self.half[1]))
    }
}

/// A height field with a pose: the same grid in every lane, with separate heights.
#[derive(Clone, Copy)]
pub(crate) struct Terrain<'a, T: Real> {
    /// One per lane.
    pub fields: [&'a HeightField<T::Scalar>; MAX_LANES],
    pub center: V3<T>,
    pub axes: Rot<T>,
}

/// Cells of the grid, lane by lane.
pub(super) struct Window {
    /// The first along x and along y.
    first: [[u32; 2]; MAX_LANES],
    /// Number of cells from there on.
    count: [[u32; 2]; MAX_LANES],
    /// The next cell to visit: its lane, and its indices along x and y.
    lane: usize,
    step: [u32; 2],
}

/// Cells side by side, regardless of their lane. Windows differ in size, and a lane that waited for the largest one
/// would be mostly idle.
pub(super) struct Cells<T: Real> {
    /// The lane of each cell.
    pub owner: [i32; MAX_LANES],
    len: usize,
    col: [T::Scalar; MAX_LANES],
    row: [T::Scalar; MAX_LANES],
    /// Index of the lower left corner among the heights.
    start: [usize; MAX_LANES],
}

impl<T: Real> Cells<T> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        let zero = [T::Scalar::default(); MAX_LANES];
        Cells { owner: [0; MAX_LANES], len: 0, col: zero, row: zero, start: [0; MAX_LANES] }
    }

    /// Lanes that hold a cell.
    #[inline(always)]
    pub(super) fn on(&self) -> T::Mask {
        T::from_bits(((1u64 << self.len) - 1) as u32)
    }
}

impl<'a, T: Real> Terrain<'a, T> {
    /// Cells within `extent` of `center` (in the field's frame) along each axis, in the lanes `near`.
    #[inline(always)]
    pub(super) fn window(&self, center: &V3<T>, extent: &V3<T>, near: T::Mask) -> Window {
        let zero = T::zero();
        let field = self.fields[0];
        let mut window = Window { first: [[0; 2]; MAX_LANES], count: [[0; 2]; MAX_LANES], lane: 0, step: [0; 2] };
        for (i, lines) in [field.cols, field.rows].into_iter().enumerate() {
            let last = T::lit((lines - 1) as f64);
            let (half, scale) = (T::splat(field.half[i]), T::splat(field.per_cell[i]));
            let from = ((center[i] - extent[i] + half) * scale).floor();
            let to = -((-(center[i] + extent[i] + half)) * scale).floor();
            // written so that NaN finds no cell
            let on = T::and(near, T::and(from.lt(last), zero.lt(to)));
            let first = T::masked(on, from.max(zero));
            let count = T::masked(on, to.min(last) - first);
            for lane in 0..T::LANES {
                window.first[lane][i] = T::widen(first.get(lane)) as u32;
                window.count[lane][i] = T::widen(count.get(lane)) as u32;
            }
        }
        window
    }

    /// Fills `cells` with the next cells of a window: lane after lane, row after row. Returns whether there are any.
    #[inline(always)]
    pub(super) fn next_cells(&self, window: &mut Window, cells: &mut Cells<T>) -> bool {
        let field = self.fields[0];
        cells.len = 0;
        while window.lane < T::LANES {
            let lane = window.lane;
            let ([x, y], [cols, rows]) = (window.first[lane], window.count[lane]);
            while cols > 0 && window.step[1] < rows {
                let k = cells.len;
                if k == T::LANES {
                    return true;
                }
                let (col, row) = (x + window.step[0], y + window.step[1]);
                cells.owner[k] = lane as i32;
                cells.col[k] = T::scalar(f64::from(col));
                cells.row[k] = T::scalar(f64::from(row));
                cells.start[k] = row as usize * field.cols + col as usize;
                cells.len = k + 1;
                window.step[0] += 1;
                if window.step[0] == cols {
                    window.step = [0, window.step[1] + 1];
                }
            }
            window.lane += 1;
            window.step = [0; 2];
        }
        cells.len > 0
    }

    /// The two prisms of each cell: the upper left half, then the lower right. Coordinates are relative to `center`,
    /// the center in the order of the cells.
    #[inline(always)]
    pub(super) fn prisms(&self, cells: &Cells<T>, center: &V3<T>) -> [Prism<'a, T>; 2] {
        let field = self.fields[0];
        let mut heights = [[T::Scalar::default(); MAX_LANES]; 4];
        for k in 0..cells.len {
            let at = cells.start[k];
            let own = &self.fields[cells.owner[k] as usize].heights[at..at + field.cols + 2];
            heights[0][k] = own[0];
            heights[1][k] = own[1];
            heights[2][k] = own[field.cols];
            heights[3][k] = own[field.cols + 1];
        }
        let one = T::lit(1.0);
        let (col, row) = (T::load(&cells.col[..T::LANES]), T::load(&cells.row[..T::LANES]));
        let (x, y) = (
            [self.line(0, col, center), self.line(0, col + one, center)],
            [self.line(1, row, center), self.line(1, row + one, center)],
        );
        let mut corners = [[T::zero(); 3]; 4];
        for (i, z) in heights.iter().enumerate() {
            corners[i] = [x[i % 2], y[i / 2], T::load(&z[..T::LANES]) - center[2]];
        }
        let [lower_left, lower_right, upper_left, upper_right] = corners;
        let base = -T::splat(field.base) - center[2];
        [
            Prism { top: [upper_left, lower_left, upper_right], walls: &field.walls[0], base },
            Prism { top: [lower_left, lower_right, upper_right], walls: &field.walls[1], base },
        ]
    }

    /// Coordinate of a grid line along an axis, relative to `center`.
    #[inline(always)]
    fn line(&self, axis: usize, number: T, center: &V3<T>) -> T {
        let field = self.fields[0];
        T::splat(field.cell[axis]).mul_add(number, -T::splat(field.half[axis])) - center[axis]
    }
}

kernel_fn! {
    /// Finds the contacts of a height field and a box and appends them.
    pub(crate) fn field_box<'a, S>(a: &'a Terrain<'a, S>, b: &'a Cuboid<S>, margin: S, out: &'a mut Touches<S>) {
        let center = into_axes(&a.axes, &sub3(&b.center, &a.center));
        let mut arms = [[S::zero(); 3]; 3];
        let mut extent = [margin; 3];
        for k in 0..3 {
            arms[k] = scale3(&into_axes(&a.axes, &b.axes[k]), b.half[k]);
            for i in 0..3 {
                extent[i] += arms[k][i].abs();
            }
        }
        let mut window = a.window(&center, &extent, S::not(S::none()));
        let mut cells = Cells::new();
        while !out.is_full() && a.next_cells(&mut window, &mut cells) {
            for prism in a.prisms(&cells, &center) {
                if S::any(prism.highest().lt(-extent[2])) {
                    continue;
                }
                let Some(gap) = prism.gap_to_box(&arms, &b.half, margin) else { continue };
                let pos = rotate_add(&a.axes, &gap.pos, &b.center);
                out.push(Touch::new(gap.dist, pos, rotate(&a.axes, &gap.normal), margin));
            }
        }
    }
}
