//! Points on a grid of integers, on which the side of a plane is exact.
//!
//! A coordinate has 40 bits relative to the largest one of its mesh, and a 32-bit float has 24. Only numbers that are 65,000 times
//! smaller than the largest lose digits.

use crate::model::Vec3;

/// Bits of the largest coordinate.
const BITS: i32 = 40;

/// Points of a mesh, scaled to integers.
pub(super) struct Grid {
    points: Vec<[i64; 3]>,
}

/// A plane through three points of a grid, with what a fast test of its side needs.
#[derive(Clone, Copy)]
pub(super) struct Plane {
    corners: [u32; 3],
    /// Normal of any length, rounded.
    normal: Vec3,
    /// One over its length.
    inverse: f64,
    /// Products with the normal below this may have a wrong sign.
    doubt: f64,
}

impl Grid {
    /// Scales finite points.
    pub fn new(vertices: &[[f32; 3]]) -> Grid {
        let largest = vertices.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
        let exponent = if largest > 0.0 { libm::ilogb(f64::from(largest)) } else { 0 };
        // a power of two keeps all digits
        let scale = |x: f32| libm::rint(libm::scalbn(f64::from(x), BITS - 1 - exponent)) as i64;
        Grid { points: vertices.iter().map(|v| v.map(scale)).collect() }
    }

    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// A coordinate of a point.
    pub fn coordinate(&self, point: u32, axis: usize) -> i64 {
        self.points[point as usize][axis]
    }

    fn from(&self, a: u32, b: u32) -> [i64; 3] {
        let (a, b) = (self.points[a as usize], self.points[b as usize]);
        [b[0] - a[0], b[1] - a[1], b[2] - a[2]]
    }

    /// Twice the area of a triangle, rounded.
    pub fn area(&self, [a, b, c]: [u32; 3]) -> f64 {
        let n = wide_cross(self.from(a, b), self.from(a, c)).map(|x| x as f64);
        (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt()
    }

    /// Six times the signed volume of a tetrahedron: positive if `p` is on the side from which the corners run counterclockwise.
    /// Coordinates of 40 bits make it fit into 126 bits.
    pub fn volume(&self, [a, b, c]: [u32; 3], p: u32) -> i128 {
        let n = wide_cross(self.from(a, b), self.from(a, c));
        let d = self.from(a, p).map(i128::from);
        n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
    }

    /// The plane through three points that are not on a line.
    pub fn plane(&self, corners: [u32; 3]) -> Plane {
        let [a, b, c] = corners;
        let (u, v) = (self.from(a, b).map(|x| x as f64), self.from(a, c).map(|x| x as f64));
        let products = [[1, 2], [2, 0], [0, 1]].map(|[i, j]: [usize; 2]| [u[i] * v[j], u[j] * v[i]]);
        let normal = products.map(|[p, q]| p - q);
        let size: f64 = products.iter().flatten().map(|p| p.abs()).sum();
        let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
        // rounding of the normal times the longest vector between two points
        let doubt = 8.0 * f64::EPSILON * size * (1i64 << (BITS + 1)) as f64;
        Plane { corners, normal, inverse: if length > 0.0 { 1.0 / length } else { 0.0 }, doubt }
    }

    /// Distance of a point in front of a plane, rounded; the sign is exact.
    pub fn distance(&self, plane: &Plane, p: u32) -> f64 {
        let d = self.from(plane.corners[0], p).map(|x| x as f64);
        let along = plane.normal[0] * d[0] + plane.normal[1] * d[1] + plane.normal[2] * d[2];
        if along.abs() > plane.doubt {
            return along * plane.inverse;
        }
        self.volume(plane.corners, p) as f64 * plane.inverse
    }
}

fn wide_cross(a: [i64; 3], b: [i64; 3]) -> [i128; 3] {
    let (a, b) = (a.map(i128::from), b.map(i128::from));
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
