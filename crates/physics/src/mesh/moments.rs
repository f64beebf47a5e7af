//! Area, volume, center and second moments of a triangle mesh.
//!
//! The solid is a sum of pyramids over the triangles. Their common apex is the centroid of the surface, weighted by area. Source of
//! the moments of a tetrahedron: F. Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor", 2004; the terms here are
//! added up in MuJoCo's order.

use crate::model::Vec3;
use crate::model::vector::{MIN_VAL, add, cross, dot, norm, scale, sub};

/// The rule for what is inside a mesh (`inertia`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Inside {
    /// The convex hull.
    Convex,
    /// The inside of a closed, well oriented surface.
    Exact,
    /// Every pyramid counts with the absolute value of its volume.
    Legacy,
    /// Nothing: the mass is spread over the surface.
    Shell,
}

impl Inside {
    /// Area of a triangle of a shell, else volume of the pyramid over it. `arm`: from the apex to the triangle's center.
    fn weight(self, arm: Vec3, normal: Vec3, area: f64) -> f64 {
        match self {
            Inside::Shell => area,
            Inside::Legacy => (dot(arm, normal) * area / 3.0).abs(),
            Inside::Exact | Inside::Convex => dot(arm, normal) * area / 3.0,
        }
    }
}

/// Volume (or area of a shell), center of mass, and moments about it for density 1: `[xx, yy, zz, xy, xz, yz]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments {
    pub volume: f64,
    pub center: Vec3,
    pub inertia: [f64; 6],
}

/// Center, unit normal and area of a triangle; the area of a very small one is 0.
fn triangle([a, b, c]: [Vec3; 3]) -> (Vec3, Vec3, f64) {
    let center = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
    let normal = cross(sub(b, a), sub(c, a));
    let length = norm(normal);
    if length < MIN_VAL { (center, normal, 0.0) } else { (center, normal.map(|x| x / length), 0.5 * length) }
}

/// Centroid and area of a surface.
fn centroid(vertices: &[Vec3], faces: &[[u32; 3]]) -> (Vec3, f64) {
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for face in faces {
        let (center, _, area) = triangle(face.map(|v| vertices[v as usize]));
        sum = add(sum, scale(center, area));
        total += area;
    }
    (if total >= MIN_VAL { sum.map(|x| x / total) } else { sum }, total)
}

/// Integrates over a mesh. `solid`: the faces of the solid, which are those of the hull for [`Inside::Convex`], else `surface`.
///
/// # Errors
/// The reason why the mesh has no mass.
pub(crate) fn moments(
    vertices: &[Vec3],
    surface: &[[u32; 3]],
    solid: &[[u32; 3]],
    inside: Inside,
) -> Result<Moments, String> {
    let (apex, area) = centroid(vertices, surface);
    if !(area >= MIN_VAL) {
        return Err(format!("the area of its surface is {area:e}, expected at least {MIN_VAL:e}"));
    }
    let (mut center, mut total) = ([0.0; 3], 0.0);
    for face in solid {
        let (middle, normal, area) = triangle(face.map(|v| vertices[v as usize]));
        let weight = inside.weight(sub(middle, apex), normal, area);
        total += weight;
        for k in 0..3 {
            center[k] += weight * (middle[k] * 3.0 / 4.0 + apex[k] / 4.0);
        }
    }
    if !(total >= MIN_VAL) {
        let hint = if total < 0.0 { "its triangles face inward" } else { "inertia=\"shell\" weighs its surface" };
        return Err(format!("its volume is {total:e}, expected at least {MIN_VAL:e}; {hint}"));
    }
    let center = center.map(|x| x / total);
    let (volume, inertia) = second_moments(vertices, solid, center, inside);
    Ok(Moments { volume, center, inertia })
}

fn second_moments(vertices: &[Vec3], faces: &[[u32; 3]], center: Vec3, inside: Inside) -> (f64, [f64; 6]) {
    const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    let mut products = [0.0; 6];
    let mut total = 0.0;
    for face in faces {
        let corners = face.map(|v| sub(vertices[v as usize], center));
        let (middle, normal, area) = triangle(corners);
        let volume = inside.weight(middle, normal, area);
        total += volume;
        let share = volume / if inside == Inside::Shell { 12.0 } else { 20.0 };
        let [d, e, f] = corners;
        for (product, (i, j)) in products.iter_mut().zip(ENTRIES) {
            *product += share
                * (2.0 * (d[i] * d[j] + e[i] * e[j] + f[i] * f[j])
                    + d[i] * e[j]
                    + d[j] * e[i]
                    + d[i] * f[j]
                    + d[j] * f[i]
                    + e[i] * f[j]
                    + e[j] * f[i]);
        }
    }
    let [xx, yy, zz, xy, xz, yz] = products;
    (total, [yy + zz, xx + zz, xx + yy, -xy, -xz, -yz])
}

/// Two corners of an edge that two faces pass in the same direction, if any; faces that are too small are left out.
pub(crate) fn inconsistent_edge(vertices: &[Vec3], faces: &[[u32; 3]]) -> Option<[u32; 2]> {
    let large = faces.iter().filter(|f| triangle(f.map(|v| vertices[v as usize])).2 > MIN_VAL.sqrt());
    let mut edges: Vec<[u32; 2]> = large.flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    edges.sort_unstable();
    edges.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0])
}
