//! Samples of a layer on a grid, prepared so that surface nets give a closed surface.

use crate::field::Field;
use crate::layer::Layer;
use glam::DVec3;

/// Points of a block along each axis. A block shares one list of near solids.
const BLOCK: usize = 8;

/// Signed distances on a regular grid. The outermost points are outside.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    pub origin: DVec3,
    pub cell: f64,
    /// Points along x, y and z.
    pub size: [usize; 3],
    /// Distances, x fastest.
    pub values: Vec<f64>,
}

impl Grid {
    /// Number of points of the grid around a layer.
    pub fn count(field: &Field, layer: &Layer, cell: f64) -> f64 {
        let (_, size) = frame(field, layer, cell);
        size.iter().product()
    }

    pub fn new(field: &Field, layer: &Layer, cell: f64) -> Self {
        let (origin, size) = frame(field, layer, cell);
        let size = size.map(|n| n as usize);
        let far = 10.0 * cell;
        let mut grid = Grid { origin, cell, size, values: vec![far; size[0] * size[1] * size[2]] };
        let blocks = size.map(|n| n.div_ceil(BLOCK));
        let radius = 0.5 * (BLOCK - 1) as f64 * cell * 3.0_f64.sqrt();
        for block in 0..blocks[0] * blocks[1] * blocks[2] {
            let first = [block % blocks[0], block / blocks[0] % blocks[1], block / blocks[0] / blocks[1]];
            let first = first.map(|i| i * BLOCK);
            let center = grid.point(first.map(|i| i as f64 + 0.5 * (BLOCK - 1) as f64));
            let near = layer.near(field, center, radius + cell);
            if near.is_empty() {
                continue;
            }
            let last = [0, 1, 2].map(|axis| size[axis].min(first[axis] + BLOCK));
            for z in first[2]..last[2] {
                for y in first[1]..last[1] {
                    for x in first[0]..last[0] {
                        let p = grid.point([x, y, z].map(|i| i as f64));
                        let at = grid.index([x, y, z]);
                        grid.values[at] = layer.distance(field, &near, p).min(far);
                    }
                }
            }
        }
        grid.disambiguate();
        grid
    }

    /// Position of a place on the grid, in cells, m.
    pub fn point(&self, place: [f64; 3]) -> DVec3 {
        self.origin + self.cell * DVec3::from_array(place)
    }

    /// Index of a point in [`Grid::values`].
    pub fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// Steps in [`Grid::values`] to the next point along x, y and z.
    pub fn steps(&self) -> [usize; 3] {
        [1, self.size[0], self.size[0] * self.size[1]]
    }

    /// Fills points until inside and outside are well composed (Latecki, "3D well-composed pictures", 1997): two inside
    /// points of a square or a cube that touch only at its diagonal would give edges with four triangles.
    fn disambiguate(&mut self) {
        let steps = self.steps();
        let filled = -1e-3 * self.cell;
        let interior = |n: usize| 1..n - 2;
        let mut changed = true;
        while changed {
            changed = false;
            for z in interior(self.size[2]) {
                for y in interior(self.size[1]) {
                    for x in interior(self.size[0]) {
                        let at = self.index([x, y, z]);
                        let inside = |i: usize| self.values[i] < 0.0;
                        let mut fill = None;
                        for (u, v) in [(0, 1), (1, 2), (0, 2)] {
                            let (a, b, c, d) = (at, at + steps[u], at + steps[v], at + steps[u] + steps[v]);
                            let odd = inside(a) == inside(d) && inside(b) == inside(c) && inside(a) != inside(b);
                            if odd {
                                let pair = if inside(a) { [b, c] } else { [a, d] };
                                fill = fill.or(Some(self.nearer(pair)));
                            }
                        }
                        for flip in 0..4 {
                            let corner =
                                |bits: usize| at + (0..3).map(|axis| (bits >> axis & 1) * steps[axis]).sum::<usize>();
                            let (a, b) = (corner(flip), corner(7 - flip));
                            let others = (0..8).filter(|bits| *bits != flip && *bits != 7 - flip);
                            let lonely = |side: bool| {
                                inside(a) == side
                                    && inside(b) == side
                                    && others.clone().all(|o| inside(corner(o)) != side)
                            };
                            if lonely(true) {
                                fill = fill.or(Some(self.nearer([corner(flip ^ 1), corner(flip ^ 2)])));
                            } else if lonely(false) {
                                fill = fill.or(Some(self.nearer([a, b])));
                            }
                        }
                        if let Some(point) = fill {
                            self.values[point] = filled;
                            changed = true;
                        }
                    }
                }
            }
        }
    }

    /// The point of two that is nearer to the surface.
    fn nearer(&self, [a, b]: [usize; 2]) -> usize {
        if self.values[a] <= self.values[b] { a } else { b }
    }
}

/// Origin and number of points of the grid around a layer. The middle of the layer is that of a cell, so both halves of a
/// symmetric character are cut alike.
fn frame(field: &Field, layer: &Layer, cell: f64) -> (DVec3, [f64; 3]) {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let own = layer.solids.iter().filter(|(_, inset)| *inset == 0.0);
    for (i, _) in own {
        let (center, radius) = field.solids[*i].bounds;
        let radius = DVec3::splat(radius + field.widest);
        low = low.min(center - radius);
        high = high.max(center + radius);
    }
    let middle = 0.5 * (low + high);
    // an even number of points, with room for cells outside
    let half = ((high - middle) / cell).ceil() + 3.0;
    (middle - cell * (half - 0.5), (2.0 * half).to_array())
}
