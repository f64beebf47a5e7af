//! Height fields as slabs, one per piece of ground that is level or slopes evenly.

use std::ops::Range;

use glam::{DMat3, DVec3};
use marathon_physics::model::HField;

use crate::shape::{Shape, Solid};

/// Thickness of a slab, m. Larger steps between neighbors would show gaps.
const THICKNESS: f64 = 0.3;
/// Largest distance from an agent along x at which ground is drawn, m. Beyond it is haze.
const REACH: f64 = 24.0;
/// Width of the stripes across the ground, m. They show the speed of a character.
const STRIPE: f64 = 1.0;
/// Elevations that differ by less count as equal, m.
const SAME: f64 = 1e-6;

/// A height field with its pose.
pub(crate) struct Terrain<'a> {
    pub field: &'a HField,
    /// Elevations by rows, m above its center. `None` for the model's own.
    pub elevations: Option<&'a [f32]>,
    pub pos: DVec3,
    /// Columns are its axes in the world.
    pub rot: DMat3,
    /// Cells farther from the middle along y are not drawn, m.
    pub half_width: f64,
    /// Light and dark stripes.
    pub colors: [DVec3; 2],
}

impl Terrain<'_> {
    /// Appends the slabs near `x` in the world.
    pub fn add_to(&self, solids: &mut Vec<Solid>, x: f64) {
        for row in 0..self.field.nrow.saturating_sub(1) {
            if self.point(row, 0).y >= self.half_width || self.point(row + 1, 0).y <= -self.half_width {
                continue;
            }
            let mut from = 0;
            while from + 1 < self.field.ncol {
                let mut to = from + 1;
                while to + 1 < self.field.ncol && self.goes_on(row, from, to) {
                    to += 1;
                }
                let slab = self.slab(row, from..to);
                if (slab.pos.x - x).abs() < REACH {
                    solids.push(slab);
                }
                from = to;
            }
        }
    }

    /// Size of a cell along x and y, m.
    fn cell(&self) -> [f64; 2] {
        let [x, y, ..] = self.field.size;
        [2.0 * x / (self.field.ncol - 1) as f64, 2.0 * y / (self.field.nrow - 1) as f64]
    }

    /// A point of the grid in the field's frame.
    fn point(&self, row: usize, col: usize) -> DVec3 {
        let ([half_x, half_y, top, _], [dx, dy], i) = (self.field.size, self.cell(), row * self.field.ncol + col);
        let z = match self.elevations {
            Some(own) => f64::from(own[i]),
            None => f64::from(self.field.data[i]) * top,
        };
        let y = row as f64 * dy - half_y;
        // a profile is the same at every y
        let y = if self.field.nrow == 2 { y.clamp(-self.half_width, self.half_width) } else { y };
        DVec3::new(col as f64 * dx - half_x, y, z)
    }

    /// Height differences of a cell along x at its lower and upper edge, and along y at its left edge.
    fn rises(&self, row: usize, col: usize) -> [f64; 3] {
        let z = |i: usize, j: usize| self.point(row + i, col + j).z;
        [z(0, 1) - z(0, 0), z(1, 1) - z(1, 0), z(1, 0) - z(0, 0)]
    }

    /// Whether a slab that starts with one cell of a row can include another cell, in the same stripe.
    fn goes_on(&self, row: usize, from: usize, next: usize) -> bool {
        let stripe = |col: usize| ((self.pos.x + self.point(row, col).x + SAME) / STRIPE).floor();
        let same = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < SAME);
        stripe(from) == stripe(next) && same(self.rises(row, from), self.rises(row, next))
    }

    /// The slab under some cells of a row. Its upper face goes through their corners if these lie in a plane.
    fn slab(&self, row: usize, cols: Range<usize>) -> Solid {
        let corner = |i: usize, col: usize| self.point(row + i, col);
        let (a, b, c, d) = (corner(0, cols.start), corner(0, cols.end), corner(1, cols.start), corner(1, cols.end));
        let (along, across) = (0.5 * (b - a + d - c), 0.5 * (c - a + d - b));
        let normal = along.cross(across).normalize();
        let x = along.normalize();
        let rot = DMat3::from_cols(x, normal.cross(x), normal);
        let middle = 0.25 * (a + b + c + d) - 0.5 * THICKNESS * normal;
        let half = [0.5 * along.length(), 0.5 * across.length(), 0.5 * THICKNESS];
        let dark = ((self.pos.x + a.x + SAME) / STRIPE).floor() as i64 & 1;
        let pos = self.pos + self.rot * middle;
        Solid::new(Shape::Box { half }, pos, self.rot * rot, self.colors[dark as usize], 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(rows: usize, data: &[f32]) -> HField {
        let ncol = data.len() / rows;
        let size = [0.05 * (ncol - 1) as f64, 1.0, 2.0, 0.5];
        HField { name: String::new(), nrow: rows, ncol, size, data: data.to_vec() }
    }

    fn slabs(field: &HField, elevations: Option<&[f32]>) -> Vec<Solid> {
        let colors = [DVec3::ZERO, DVec3::ONE];
        let terrain = Terrain { field, elevations, pos: DVec3::Z, rot: DMat3::IDENTITY, half_width: 0.9, colors };
        let mut out = Vec::new();
        terrain.add_to(&mut out, 0.0);
        out
    }

    /// Height at which a ray from above hits the slabs.
    fn height(slabs: &[Solid], x: f64, y: f64) -> f64 {
        let hits = slabs.iter().filter_map(|slab| slab.enter(DVec3::new(x, y, 10.0), -DVec3::Z));
        10.0 - hits.map(|(t, _)| t).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn slabs_are_where_the_field_is() {
        // a level piece, a slope of four cells, a step of one
        let row = [0.0, 0.0, 0.0, 0.05, 0.1, 0.15, 0.2, 0.5, 0.5];
        let field = field(2, &[row, row].concat());
        let slabs = slabs(&field, None);
        let z = |cell: f64| height(&slabs, 0.1 * (cell - 4.0), 0.3);
        let expected = [(0.5, 1.0), (3.0, 1.1), (5.5, 1.35), (6.5, 1.7), (7.5, 2.0)];
        assert!(
            expected.iter().all(|(cell, height)| (z(*cell) - height).abs() < 1e-6),
            "{:?}",
            expected.map(|e| z(e.0))
        );
        // the middle of the field is at x = 0, where a stripe ends, too
        assert!(slabs.len() <= 5 && slabs.iter().any(|slab| slab.color == DVec3::ONE));
    }

    #[test]
    fn ground_of_an_agents_own_is_drawn_in_place_of_the_models() {
        let field = field(3, &[0.5; 9]);
        assert!((height(&slabs(&field, None), 0.02, 0.2) - 2.0).abs() < 1e-9);
        let own = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let slabs = slabs(&field, Some(&own));
        assert!((height(&slabs, 0.02, -0.5) - 1.0).abs() < 1e-9 && (height(&slabs, 0.02, 0.5) - 1.5).abs() < 1e-9);
    }
}
