//! Meshes that are made from parameters (`builtin` and `params`), with MuJoCo's vertices in MuJoCo's order.

use super::{MAX_FACES, Triangles, too_many};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A shape that can be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Builtin {
    /// An icosahedron, subdivided.
    Sphere,
    /// A quarter of an octahedron's faces, subdivided, with a flat bottom.
    Hemisphere,
    /// A frustum or a pyramid.
    Cone,
    /// A superellipsoid.
    Supersphere,
    /// A supertoroid.
    Supertorus,
}

/// Makes a mesh. Lengths are 1; `scale` of the mesh changes that.
///
/// # Errors
/// An error about the parameters: those found and those expected.
pub(crate) fn make(shape: Builtin, params: &[f64]) -> Result<Triangles, String> {
    let expected = |what: &str| format!("'params' is {params:?}, expected {what}");
    match (shape, params) {
        (Builtin::Sphere, &[n]) if (0.0..5.0).contains(&n) => Ok(sphere(n as usize)),
        (Builtin::Sphere, _) => Err(expected("the number of subdivisions, 0 to 4")),
        (Builtin::Hemisphere, &[n]) if (0.0..11.0).contains(&n) => Ok(hemisphere(n as usize)),
        (Builtin::Hemisphere, _) => Err(expected("the resolution, 0 to 10")),
        (Builtin::Cone, &[n, top]) if (3.0..1e5).contains(&n) && (0.0..=1e6).contains(&top) => {
            Ok(cone(n as usize, top))
        }
        (Builtin::Cone, _) => Err(expected("the number of edges from 3 and the radius of the top from 0")),
        (Builtin::Supersphere, &[n, e, s]) if (3.0..1e5).contains(&n) && e >= 0.0 && s >= 0.0 => {
            let n = n as usize;
            too_many("faces", 2 * n * (n - 1), MAX_FACES)?;
            Ok(supersphere(n, e, s))
        }
        (Builtin::Supersphere, _) => Err(expected("the resolution from 3 and two exponents from 0")),
        (Builtin::Supertorus, &[n, radius, s, t])
            if (3.0..1e5).contains(&n) && radius > 0.0 && radius <= 1.0 && s > 0.0 && t > 0.0 =>
        {
            let n = n as usize;
            too_many("faces", 2 * n * n, MAX_FACES)?;
            Ok(supertorus(n, radius, s, t))
        }
        (Builtin::Supertorus, _) => {
            Err(expected("the resolution from 3, the radius of the tube up to 1 and two positive exponents"))
        }
    }
}

/// Each triangle of an icosahedron becomes four, in single precision as in MuJoCo.
fn sphere(subdivisions: usize) -> Triangles {
    let phi = ((1.0 + 5f64.sqrt()) / 2.0) as f32;
    let length = (1.0 + f64::from(phi * phi)).sqrt();
    let [i, p] = [1.0, phi].map(|x| (f64::from(x) / length) as f32);
    let mut vertices = vec![
        [-i, p, 0.0],
        [i, p, 0.0],
        [-i, -p, 0.0],
        [i, -p, 0.0],
        [0.0, -i, p],
        [0.0, i, p],
        [0.0, -i, -p],
        [0.0, i, -p],
        [p, 0.0, -i],
        [p, 0.0, i],
        [-p, 0.0, -i],
        [-p, 0.0, i],
    ];
    let mut faces: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..subdivisions {
        let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                let (p, q) = (vertices[a as usize], vertices[b as usize]);
                let m = [0, 1, 2].map(|k| (p[k] + q[k]) / 2.0);
                let length = (m[0] * m[0] + m[1] * m[1] + m[2] * m[2]).sqrt();
                vertices.push(m.map(|x: f32| x / length));
                vertices.len() as u32 - 1
            })
        };
        let cut = |&[a, b, c]: &[u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        faces = faces.iter().flat_map(cut).collect();
    }
    Triangles { vertices, faces }
}

/// Rows of points from the pole to the equator, with a center for the bottom.
fn hemisphere(resolution: usize) -> Triangles {
    const EQUATOR: [[f64; 3]; 4] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    let mut vertices = vec![[0.0f32, 0.0, 1.0]];
    for row in 0..=resolution {
        let down = (row + 1) as f64 / (resolution + 1) as f64;
        for side in 0..4 {
            let end = |side: usize| {
                let [x, y, z] = EQUATOR[side % 4];
                [down * x, down * y, 1.0 + down * (z - 1.0)]
            };
            let (start, end) = (end(side), end(side + 1));
            for i in 0..=row {
                let p = [0, 1, 2].map(|k| start[k] + i as f64 * ((end[k] - start[k]) / (row + 1) as f64));
                let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
                vertices.push(p.map(|x| (x / length) as f32));
            }
        }
    }
    vertices.push([0.0; 3]);
    let mut faces: Vec<[usize; 3]> = vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]];
    for row in 0..resolution {
        let (upper, lower) = (2 * row * (row + 1) + 1, 2 * (row + 1) * (row + 2) + 1);
        let (above, below) = (4 * (row + 1), 4 * (row + 2));
        for (side, i) in (0..4).flat_map(|side| (0..row + 2).map(move |i| (side, i))) {
            let (a, b) = (i + (row + 1) * side, i + (row + 2) * side);
            faces.push([upper + a % above, lower + b % below, lower + (b + 1) % below]);
            if i < row + 1 {
                faces.push([upper + a % above, lower + (b + 1) % below, upper + (a + 1) % above]);
            }
        }
    }
    let (start, count) = (2 * resolution * (resolution + 1) + 1, 4 * (resolution + 1));
    faces.extend((0..count).map(|i| [start + i, vertices.len() - 1, start + (i + 1) % count]));
    Triangles { vertices, faces: faces.iter().map(|f| f.map(|v| v as u32)).collect() }
}

/// A polygon below, and one of another size or a point above. The faces are those of the convex hull.
fn cone(edges: usize, top: f64) -> Triangles {
    let ring = |radius: f64, z: f32, from: usize| {
        (from..from + edges).map(move |i| {
            let (sine, cosine) = libm::sincos(2.0 * i as f64 * PI / edges as f64);
            [(radius * cosine) as f32, (radius * sine) as f32, z]
        })
    };
    let mut vertices: Vec<[f32; 3]> = ring(1.0, -1.0, 0).collect();
    if top > 0.0 {
        vertices.extend(ring(top, 1.0, edges));
    } else {
        vertices.push([0.0, 0.0, 1.0]);
    }
    Triangles { vertices, faces: Vec::new() }
}

/// Cosine and sine of an angle, their size raised to a power.
fn powers(angle: f64, power: f64) -> [f64; 2] {
    let (sine, cosine) = libm::sincos(angle);
    [cosine, sine].map(|x| libm::copysign(libm::pow(x.abs(), power), x))
}

fn supersphere(n: usize, e: f64, s: f64) -> Triangles {
    let mut vertices = vec![[0.0f32, 0.0, -1.0]];
    for i in 1..n {
        let [across, up] = powers(-PI / 2.0 + i as f64 * PI / n as f64, s);
        vertices.extend((0..n).map(|j| {
            let [x, y] = powers(-PI + j as f64 * 2.0 * PI / n as f64, e);
            [(across * x) as f32, (across * y) as f32, up as f32]
        }));
    }
    vertices.push([0.0, 0.0, 1.0]);
    let at = |ring: usize, j: usize| 1 + ring * n + j % n;
    let mut faces: Vec<[usize; 3]> = (0..n).map(|j| [0, at(0, j + 1), at(0, j)]).collect();
    for (i, j) in (0..n - 2).flat_map(|i| (0..n).map(move |j| (i, j))) {
        faces.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
        faces.push([at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
    }
    faces.extend((0..n).map(|j| [at(n - 2, j), at(n - 2, j + 1), vertices.len() - 1]));
    Triangles { vertices, faces: faces.iter().map(|f| f.map(|v| v as u32)).collect() }
}

fn supertorus(n: usize, radius: f64, s: f64, t: f64) -> Triangles {
    let angle = |i: usize| 2.0 * PI * i as f64 / n as f64;
    let mut vertices = Vec::with_capacity(n * n);
    let mut faces = Vec::with_capacity(2 * n * n);
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let ([x, y], [out, up]) = (powers(angle(i), t), powers(angle(j), s));
        let across = 1.0 + radius * out;
        vertices.push([(across * x) as f32, (across * y) as f32, (radius * up) as f32]);
        let at = |i: usize, j: usize| (i % n * n + j % n) as u32;
        faces.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
        faces.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    }
    Triangles { vertices, faces }
}
