//! Hulls of random and degenerate points, and readers of broken files.

use super::polygons::Skin;
use super::{Format, Triangles, builtin, read};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

/// Numbers from a small generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    }

    fn point(&mut self) -> [f32; 3] {
        [self.next() as f32, self.next() as f32, self.next() as f32]
    }
}

fn cloud(vertices: Vec<[f32; 3]>) -> Triangles {
    Triangles { vertices, faces: Vec::new() }
}

/// Checks that a hull is a closed convex surface around all points.
fn check(mesh: &Triangles, skin: &Skin) {
    let at = |v: u32| mesh.vertices[v as usize].map(f64::from);
    let size = mesh.vertices.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
    let mut edges: BTreeMap<[u32; 2], i32> = BTreeMap::new();
    for &[a, b, c] in &skin.triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            *edges.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
        }
    }
    assert!(edges.values().all(|sum| *sum == 0), "a closed surface");
    let corners: BTreeSet<u32> = skin.triangles.iter().flatten().copied().collect();
    assert_eq!(corners.len() + skin.triangles.len(), edges.len() + 2, "Euler's formula");
    let hull = skin.hull(&mesh.vertices.iter().map(|v| v.map(f64::from)).collect::<Vec<_>>(), false);
    for (polygon, normal) in hull.polygons.iter().zip(&hull.normals) {
        let length: f64 = normal.iter().map(|x| x * x).sum();
        assert!((length - 1.0).abs() < 1e-12, "{polygon:?}: {normal:?}");
        let level = |p: [f64; 3]| (0..3).map(|k| normal[k] * p[k]).sum::<f64>();
        let height = polygon.iter().map(|v| level(hull.vertices[*v as usize])).fold(f64::NEG_INFINITY, f64::max);
        // a polygon may bend by a cell of the grid of angles
        let outside = (0..mesh.vertices.len() as u32).map(|v| level(at(v)) - height).fold(f64::NEG_INFINITY, f64::max);
        assert!(outside <= 0.03 * f64::from(size), "{outside}");
    }
}

#[test]
fn the_hull_of_a_cube_has_eight_corners_and_six_sides() {
    let mut random = Random(7);
    // a grid on the surface of a cube, points inside, and all of them twice
    let mut points = Vec::new();
    for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
        let (u, v) = (i as f32 / 4.0 - 1.0, j as f32 / 4.0 - 1.0);
        points.extend([[u, v, 1.0], [u, v, -1.0], [u, 1.0, v], [u, -1.0, v], [1.0, u, v], [-1.0, u, v]]);
    }
    points.extend((0..200).map(|_| random.point()));
    points.extend(points.clone());
    for shift in 0..20 {
        points.rotate_left(37 * shift);
        let mesh = cloud(points.clone());
        let skin = Skin::new(&mesh, None).unwrap();
        check(&mesh, &skin);
        let hull = skin.hull(&mesh.vertices.iter().map(|v| v.map(f64::from)).collect::<Vec<_>>(), false);
        assert_eq!((hull.vertices.len(), hull.polygons.len(), skin.triangles.len()), (8, 6, 12));
        assert!(hull.polygons.iter().all(|p| p.len() == 4) && hull.around.iter().all(|p| p.len() == 3));
    }
}

#[test]
fn hulls_of_many_points_are_found_in_time() {
    let mut random = Random(3);
    for n in [10, 100, 1000, 10_000, 60_000] {
        for round in [false, true] {
            let point = |_| {
                let p = random.point();
                let length = p.iter().map(|x| x * x).sum::<f32>().sqrt();
                if round { p.map(|x| x / length) } else { p }
            };
            let mesh = cloud((0..n).map(point).collect());
            let begun = Instant::now();
            let skin = Skin::new(&mesh, None).unwrap();
            let took = begun.elapsed();
            println!("{n} points, round {round}: {} triangles in {took:?}", skin.triangles.len());
            assert!(took.as_secs_f64() < 10.0);
            // the check takes quadratic time
            if n <= 1000 {
                check(&mesh, &skin);
            }
        }
    }
}

#[test]
fn a_limit_of_vertices_keeps_the_farthest() {
    let mesh = builtin::make(builtin::Builtin::Sphere, &[3.0]).unwrap();
    for most in [4, 5, 20, 100] {
        let skin = Skin::new(&mesh, Some(most)).unwrap();
        check_closed(&skin, most);
    }
}

fn check_closed(skin: &Skin, most: usize) {
    let corners: BTreeSet<u32> = skin.triangles.iter().flatten().copied().collect();
    assert!(corners.len() <= most && skin.triangles.len() == 2 * corners.len() - 4);
}

#[test]
fn points_without_volume_are_refused_by_name() {
    let mut random = Random(5);
    let same = cloud(vec![[1.0, 2.0, 3.0]; 50]);
    let line = cloud((0..50).map(|_| random.next() as f32).map(|t| [t, 2.0 * t, -4.0 * t]).collect());
    let plane = cloud((0..50).map(|_| random.point()).map(|[x, y, _]| [x, y, 1.0]).collect());
    for (mesh, reason) in [(same, "the same point"), (line, "on one line"), (plane, "in one plane")] {
        let error = Skin::new(&mesh, None).unwrap_err();
        assert!(error.contains(reason), "{error}");
    }
}

#[test]
fn builtin_shapes_are_closed() {
    use builtin::Builtin::{Cone, Hemisphere, Sphere, Supersphere, Supertorus};
    for (shape, params) in [
        (Sphere, &[2.0][..]),
        (Hemisphere, &[3.0]),
        (Cone, &[7.0, 0.0]),
        (Cone, &[7.0, 0.5]),
        (Supersphere, &[9.0, 0.5, 1.5]),
        (Supertorus, &[8.0, 0.3, 1.0, 0.7]),
    ] {
        let mesh = builtin::make(shape, params).unwrap();
        mesh.check().unwrap();
        let vertices: Vec<_> = mesh.vertices.iter().map(|v| v.map(f64::from)).collect();
        assert_eq!(super::moments::inconsistent_edge(&vertices, &mesh.faces), None);
        check(&mesh, &Skin::new(&mesh, None).unwrap());
    }
    for (shape, params) in
        [(Sphere, &[5.0][..]), (Cone, &[2.0, 0.0]), (Supersphere, &[1e4, 1.0, 1.0]), (Hemisphere, &[])]
    {
        assert!(builtin::make(shape, params).is_err(), "{shape:?}");
    }
}

const FORMATS: [Format; 3] = [Format::Stl, Format::Obj, Format::Msh];

/// A tetrahedron in a format.
fn tetrahedron(format: Format) -> Vec<u8> {
    let points = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = [[0u32, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let floats = |p: [f32; 3]| p.map(f32::to_le_bytes).concat();
    match format {
        Format::Stl => {
            let face =
                |f: &[u32; 3]| [vec![0; 12], f.map(|v| floats(points[v as usize])).concat(), vec![0; 2]].concat();
            [vec![b' '; 80], 4i32.to_le_bytes().to_vec(), faces.iter().flat_map(face).collect()].concat()
        }
        Format::Obj => {
            let vertex = |[x, y, z]: &[f32; 3]| format!("v {x} {y} {z}\n");
            let face = |f: &[u32; 3]| format!("f {}\n", f.map(|v| format!("{}//1", v + 1)).join(" "));
            let text: String = points.iter().map(vertex).chain(faces.iter().map(face)).collect();
            text.into_bytes()
        }
        Format::Msh => {
            let words = |f: &[u32; 3]| f.map(u32::to_le_bytes).concat();
            let header = [4i32, 0, 0, 4].map(i32::to_le_bytes).concat();
            [header, points.map(floats).concat(), faces.iter().flat_map(words).collect()].concat()
        }
    }
}

#[test]
fn a_tetrahedron_is_the_same_in_all_formats() {
    let volume = |mesh: &Triangles| {
        let at = |v: u32| mesh.vertices[v as usize].map(f64::from);
        let vertices: Vec<_> = (0..mesh.vertices.len() as u32).map(at).collect();
        super::moments::moments(&vertices, &mesh.faces, &mesh.faces, super::moments::Inside::Exact).unwrap().volume
    };
    for format in FORMATS {
        let mesh = read(format, &tetrahedron(format)).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.faces.len()), (4, 4));
        assert!((volume(&mesh) - 1.0 / 6.0).abs() < 1e-15);
    }
}

#[test]
fn broken_files_are_refused_with_a_place() {
    for format in [Format::Stl, Format::Msh] {
        let bytes = tetrahedron(format);
        for end in 0..bytes.len() {
            assert!(read(format, &bytes[..end]).unwrap_err().contains("expected"), "{format:?} {end}");
        }
    }
    let changed = |format: Format, at: usize, word: [u8; 4]| {
        let mut bytes = tetrahedron(format);
        bytes[at..at + 4].copy_from_slice(&word);
        read(format, &bytes).unwrap_err()
    };
    let nan = f32::NAN.to_le_bytes();
    for (error, parts) in [
        (changed(Format::Stl, 96, nan), ["byte 96", "finite"]),
        (changed(Format::Stl, 80, 10_000_000i32.to_le_bytes()), ["found 10000000 triangles", "expected 1 to 200000"]),
        (changed(Format::Msh, 16, nan), ["vertex 0", "finite"]),
        (changed(Format::Msh, 64, [9, 0, 0, 0]), ["face 0 is [9, 2, 1]", "only 4 vertices"]),
        (changed(Format::Msh, 64, [255; 4]), ["byte 64", "vertex -1"]),
        (changed(Format::Msh, 0, i32::MAX.to_le_bytes()), ["2147483647 vertices", "expected at most"]),
        (changed(Format::Msh, 4, [3, 0, 0, 0]), ["found 3 normals", "expected none or 4"]),
        (read(Format::Stl, b"solid cube\nfacet normal 0 0 0\n").unwrap_err(), ["text STL", "binary STL"]),
        (read(Format::Obj, b"v 1 2 x\n").unwrap_err(), ["line 1: found 'x'", "expected a coordinate"]),
        (read(Format::Obj, b"v 1 2 nan\n").unwrap_err(), ["line 1: found 'nan'", "expected a coordinate"]),
        (read(Format::Obj, b"v 1 2 3\n\nf 1 0 1\n").unwrap_err(), ["line 3: found '0'", "the number of a vertex"]),
        (read(Format::Obj, b"v 1 2 3\nf 1 1 7\n").unwrap_err(), ["line 2: found the vertex 7", "only 1"]),
        (read(Format::Obj, b"v 1 2 3\nf -2 1 1\n").unwrap_err(), ["line 2: found '-2'", "the number of a vertex"]),
        (read(Format::Obj, b"").unwrap_err(), ["found 0 vertices", "at least 4"]),
    ] {
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
}

#[test]
fn polygons_of_an_obj_file_become_triangles() {
    let faces = |text: &str| read(Format::Obj, text.as_bytes()).unwrap().faces;
    let points = "v 0 0 0\nv 4 0 0\nv 4 1 0\nv 0 1 0\nv 9 9 9\n";
    // the shorter diagonal of a quad
    assert_eq!(faces(&format!("{points}f 1 2 3 4")), [[0, 1, 3], [1, 2, 3]]);
    assert_eq!(faces(&format!("{points}f 1/1 2/2/2 -3//3 # f 4")), [[0, 1, 2]]);
    // a hollow polygon: the triangles cover it exactly
    let hollow = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.5 0\nv 0 2 0\nf 1 2 3 4 5\n";
    let area = |[a, b, c]: &[u32; 3]| {
        let at = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.5], [0.0, 2.0]];
        let [p, q, r] = [a, b, c].map(|v| at[*v as usize]);
        ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / 2.0
    };
    let cut = faces(hollow);
    assert!(cut.len() == 3 && cut.iter().all(|t| area(t) > 0.0), "{cut:?}");
    assert_eq!(cut.iter().map(area).sum::<f64>(), 2.5);
    // only the first object has faces
    assert_eq!(faces(&format!("g a\n{points}o b\nf 1 2 3\nf 1 3 4\ng c\nf 1 2 4\n")).len(), 2);
}

proptest! {
    #[test]
    fn any_bytes_are_a_mesh_or_an_error(kind in 0usize..3, bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        if let Ok(mesh) = read(FORMATS[kind], &bytes) {
            prop_assert!(mesh.check().is_ok());
        }
    }

    #[test]
    fn changed_files_are_a_mesh_or_an_error(
        kind in 0usize..3,
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = tetrahedron(FORMATS[kind]);
        for (place, byte) in changes {
            let at = place.index(bytes.len());
            bytes[at] = byte;
        }
        if let Ok(mesh) = read(FORMATS[kind], &bytes) {
            let _ = Skin::new(&mesh, None);
        }
    }

    /// Points on a coarse grid: many of them are in one plane, on one line or the same.
    #[test]
    fn hulls_of_degenerate_points(points in proptest::collection::vec([-2i8..3, -2i8..3, -2i8..3], 4..60), scale in -30i32..30) {
        let scale = 2f32.powi(scale) * 1.1;
        let mesh = cloud(points.iter().map(|p| p.map(|x| f32::from(x) * scale)).collect());
        if let Ok(skin) = Skin::new(&mesh, None) {
            check(&mesh, &skin);
        }
    }
}
