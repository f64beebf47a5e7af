//! Surface nets (Gibson, "Constrained elastic surface nets", 1998): one vertex per cell that the surface crosses, one
//! quadrilateral per edge of the grid that it crosses.
//!
//! The crate `fast-surface-nets` does the same, but its surfaces are not always closed: the grid has to be prepared, and then
//! 100 lines are left. It also needs glam and ndshape in other versions than Marathon.

use crate::grid::Grid;
use glam::DVec3;

/// A closed surface.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    pub points: Vec<DVec3>,
    /// Counterclockwise, seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The surface on which the grid's values are zero.
pub(crate) fn surface(grid: &Grid) -> Surface {
    let steps = grid.steps();
    let [nx, ny, nz] = grid.size;
    let inside = |i: usize| grid.values[i] < 0.0;
    let mut out = Surface::default();
    // number of the vertex in the cell above each point
    let mut vertex = vec![u32::MAX; grid.values.len()];
    for z in 0..nz - 1 {
        for y in 0..ny - 1 {
            for x in 0..nx - 1 {
                let at = grid.index([x, y, z]);
                if let Some(place) = mean_crossing(grid, at) {
                    vertex[at] = out.points.len() as u32;
                    out.points.push(grid.point([x, y, z].map(|i| i as f64)) + grid.cell * place);
                }
            }
        }
    }
    for z in 1..nz - 1 {
        for y in 1..ny - 1 {
            for x in 1..nx - 1 {
                let at = grid.index([x, y, z]);
                for axis in 0..3 {
                    if inside(at) == inside(at + steps[axis]) {
                        continue;
                    }
                    let (u, v) = (steps[(axis + 1) % 3], steps[(axis + 2) % 3]);
                    let quad = [at - u - v, at - v, at, at - u].map(|cell| vertex[cell]);
                    out.add(quad, inside(at));
                }
            }
        }
    }
    out
}

/// The mean of the places where the surface crosses the edges of a cell, in cells; `None` if it crosses none.
fn mean_crossing(grid: &Grid, at: usize) -> Option<DVec3> {
    let steps = grid.steps();
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for corner in 0..8_usize {
        let offset = (0..3).map(|axis| (corner >> axis & 1) * steps[axis]).sum::<usize>();
        let a = grid.values[at + offset];
        for axis in (0..3).filter(|axis| corner >> axis & 1 == 0) {
            let b = grid.values[at + offset + steps[axis]];
            if (a < 0.0) != (b < 0.0) {
                let place = DVec3::new((corner & 1) as f64, (corner >> 1 & 1) as f64, (corner >> 2) as f64);
                sum += place + a / (a - b) * axes[axis];
                count += 1.0;
            }
        }
    }
    (count > 0.0).then(|| sum / count)
}

impl Surface {
    /// Adds a quadrilateral as two triangles, split along its shorter diagonal.
    fn add(&mut self, quad: [u32; 4], outward: bool) {
        let [a, b, c, d] = if outward { quad } else { [quad[3], quad[2], quad[1], quad[0]] };
        let point = |i: u32| self.points[i as usize];
        if point(a).distance_squared(point(c)) <= point(b).distance_squared(point(d)) {
            self.triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            self.triangles.extend([[a, b, d], [b, c, d]]);
        }
    }

    /// The vertices that share an edge with each vertex, in ascending order.
    pub fn neighbors(&self) -> Vec<Vec<u32>> {
        let mut neighbors = vec![Vec::new(); self.points.len()];
        for [a, b, c] in &self.triangles {
            for (i, k) in [(a, b), (b, c), (c, a)] {
                // the other direction comes with the triangle on the other side
                neighbors[*i as usize].push(*k);
            }
        }
        neighbors.iter_mut().for_each(|list| list.sort_unstable());
        neighbors
    }

    /// Sums of the normals of the triangles at each vertex, weighted by area.
    pub fn face_normals(&self) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; self.points.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.points[i as usize]);
            let normal = (b - a).cross(c - a);
            triangle.iter().for_each(|i| normals[*i as usize] += normal);
        }
        normals
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Field;
    use crate::figure::Figure;
    use crate::layer::layers;
    use crate::solid::solids;
    use marathon_physics::Model;
    use std::collections::BTreeMap;

    fn cut(body: &str, cell: f64) -> Surface {
        let text = format!("<mujoco><worldbody><body><freejoint/>{body}</body></worldbody></mujoco>");
        let figure = Figure::new(&Model::from_xml_str(&text, "m.xml").expect("a model")).expect("a figure");
        let solids = solids(&figure);
        let field = Field::new(&figure, &solids);
        surface(&Grid::new(&field, &layers(&field, cell)[0], cell))
    }

    fn volume(surface: &Surface) -> f64 {
        let of = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|i| surface.points[i as usize]);
            a.dot(b.cross(c)) / 6.0
        };
        surface.triangles.iter().map(of).sum()
    }

    #[test]
    fn a_ball_has_its_volume_and_faces_outward() {
        let ball = cut("<geom size='.5'/>", 0.04);
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.125;
        assert!((volume(&ball) / exact - 1.0).abs() < 0.03, "{} {exact}", volume(&ball));
        // Euler's formula for a closed surface without holes
        assert_eq!(ball.points.len(), ball.triangles.len() / 2 + 2);
    }

    /// Balls at many places that nearly touch, so that the grid has squares and cubes of all kinds.
    #[test]
    fn every_edge_has_two_triangles_whatever_the_field() {
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 40) as f64 / f64::from(1 << 24)
        };
        for _ in 0..40 {
            let ball = |r: [f64; 4]| format!("<geom size='{}' pos='{} {} {}'/>", 0.02 + 0.06 * r[3], r[0], r[1], r[2]);
            let body: String = (0..60).map(|_| ball(std::array::from_fn(|_| 0.6 * random()))).collect();
            let surface = cut(&body, 0.03);
            let mut edges: BTreeMap<(u32, u32), i32> = BTreeMap::new();
            for [a, b, c] in &surface.triangles {
                for (i, k) in [(a, b), (b, c), (c, a)] {
                    *edges.entry((*i, *k)).or_default() += 1;
                }
            }
            assert!(edges.iter().all(|((a, b), n)| *n == 1 && edges.get(&(*b, *a)) == Some(&1)));
        }
    }
}
