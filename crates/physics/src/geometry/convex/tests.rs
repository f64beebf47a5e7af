//! Contract: the contacts of convex shapes are MuJoCo's, with its default settings.
//!
//! Each pair of shapes has hundreds of random poses, with and without a margin. The number of contacts, their distances,
//! positions and normals agree with those of the `mujoco` package. Poses in which displacements of 1e-9 change MuJoCo's
//! own answer are left out. Smooth shapes agree within MuJoCo's tolerance of 1e-6, shapes with corners to the last digits.
//! Single precision agrees with double precision within its rounding.
//!
//! Without MuJoCo: every depth is that of the contact's normal, and no other direction has a much smaller one.

use super::vector::*;
use super::*;
use crate::geometry::Sphere;
use crate::geometry::height::HeightField;
use crate::geometry::round::sphere_cylinder;
use crate::geometry::tests::common;
use crate::model::{HField, Hull};
use serde_json::{Value, json};

/// States per pair of shapes and margin.
const STATES: usize = 200;

/// A contact: distance, position, normal.
type Numbers = [f64; 7];
/// Positions and rotations (row by row) of both shapes.
type Poses = [[f64; 12]; 2];

fn search<S: Number>(several: bool) -> Search<S> {
    Search { tolerance: S::lit(1e-6), iterations: 35, several }
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn array<const N: usize>(v: &Value) -> [f64; N] {
    numbers(v).try_into().expect("as many numbers")
}

/// The hull that MuJoCo made of a mesh.
fn compiled_hull(mesh: &Value) -> Option<Hull> {
    let lists = |name: &str| mesh[name].as_array().map(|l| l.iter().map(numbers).collect::<Vec<_>>());
    let vertices = lists("vertices")?.into_iter().map(|v| [v[0], v[1], v[2]]).collect();
    let normals = lists("normals")?.into_iter().map(|v| [v[0], v[1], v[2]]).collect();
    let polygons = lists("polygons")?.iter().map(|p| p.iter().map(|i| *i as u32).collect()).collect();
    Some(Hull::new(vertices, polygons, normals, &[]))
}

/// The form of a geom of the oracle's job. `None` for planes and height fields.
fn form<'a, S: Number>(geom: &Value, hull: Option<&'a Polyhedron<S>>) -> Option<Form<'a, S>> {
    let size: Vec<S> =
        geom["size"].as_array().map_or(Vec::new(), |_| numbers(&geom["size"]).into_iter().map(S::lit).collect());
    Some(match geom["type"].as_str().expect("a type") {
        "sphere" => Form::Sphere { radius: size[0] },
        "capsule" => Form::Capsule { radius: size[0], half: size[1] },
        "ellipsoid" => Form::Ellipsoid { half: [size[0], size[1], size[2]] },
        "cylinder" => Form::Cylinder { radius: size[0], half: size[1] },
        "box" => Form::Cuboid { half: [size[0], size[1], size[2]] },
        "mesh" => Form::Hull(hull.expect("a hull")),
        _ => return None,
    })
}

/// Contacts of the shapes of a job in every pose. With `round`, the poses are rounded to single precision.
fn contacts<S: Number>(job: &Value, answer: &Value, poses: &[Poses], round: bool) -> Vec<Vec<Numbers>> {
    let hulls = [0, 1].map(|i| compiled_hull(&answer["meshes"][i]).map(|h| Polyhedron::<S>::new(&h)));
    let [first, second] = [&job["geoms"][0], &job["geoms"][1]];
    let margin = S::lit(job["margin"].as_f64().expect("a number"));
    let search = search(job["multiccd"] != false);
    let field = first["heights"].as_array().map(|rows| {
        let rows: Vec<Vec<f64>> = rows.iter().map(numbers).collect();
        let data = rows.concat().iter().map(|x| *x as f32).collect();
        HeightField::<S>::new(&HField {
            name: "field".into(),
            nrow: rows.len(),
            ncol: rows[0].len(),
            size: array(&first["size"]),
            data,
        })
    });
    let (mut scratch, mut touches) = (Scratch::new(), Touches::new());
    let mut out = Vec::new();
    for pose in poses {
        let from = [pose[0][0] + 0.125, pose[0][1], pose[0][2]];
        let rounded = |x: f64| S::lit(if round { f64::from(x as f32) } else { x });
        let center = |i: usize| [0, 1, 2].map(|k| rounded(pose[i][k] - from[k]));
        let axes = |i: usize| [0, 1, 2].map(|j| [0, 1, 2].map(|k| rounded(pose[i][3 + 3 * k + j])));
        let form_b = form(second, hulls[1].as_ref()).expect("a convex shape");
        let b = Solid { center: center(1), axes: axes(1), form: form_b };
        touches.clear();
        if let Some(field) = &field {
            let place = (field, &center(0), &axes(0));
            field_convex(place, &b, margin, &search, &mut scratch, &mut touches);
        } else if let Some(form) = form(first, hulls[0].as_ref()) {
            let a = Solid { center: center(0), axes: axes(0), form };
            convex(&a, &b, margin, &search, &mut scratch, &mut touches);
        } else {
            let plane = Plane { point: center(0), normal: axes(0)[2] };
            plane_hull(&plane, &b, margin, &mut scratch, &mut touches);
        }
        let list = touches.as_slice().iter().map(|t| {
            let [p, n] = [t.pos.map(|x| S::widen(x)), t.normal.map(|x| S::widen(x))];
            [S::widen(t.dist), p[0] + from[0], p[1] + from[1], p[2] + from[2], n[0], n[1], n[2]]
        });
        out.push(list.collect());
    }
    out
}

/// Bounds of the differences of two contacts.
#[derive(Clone, Copy)]
struct Bounds {
    dist: f64,
    pos: f64,
    normal: f64,
}

/// Shapes with corners, spheres and capsules: only rounding differs.
const EXACT: Bounds = Bounds { dist: 1e-9, pos: 1e-8, normal: 1e-8 };
/// Smooth shapes: MuJoCo's error in depth is up to 1e-6, and the normal's goes with its root.
const SMOOTH: Bounds = Bounds { dist: 2e-6, pos: 2e-3, normal: 2e-2 };
const SINGLE: Bounds = Bounds { dist: 2e-5, pos: 5e-3, normal: 3e-2 };

impl Bounds {
    fn hold(&self, a: &Numbers, b: &Numbers) -> bool {
        let part = |from: usize, to: usize| (from..to).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
        part(0, 1) < self.dist && part(1, 4) < self.pos && part(4, 7) < self.normal
    }

    /// Whether two lists have the same contacts, and whether they have them in the same order.
    fn compare(&self, got: &[Numbers], want: &[Numbers]) -> [bool; 2] {
        if got.len() != want.len() {
            return [false; 2];
        }
        let mut left = want.to_vec();
        let mut same = true;
        for g in got {
            match left.iter().position(|w| self.hold(g, w)) {
                Some(at) => drop(left.remove(at)),
                None => same = false,
            }
        }
        [same, got.iter().zip(want).all(|(g, w)| self.hold(g, w))]
    }
}

/// Numbers of states.
#[derive(Debug, Default)]
struct Outcome {
    touching: usize,
    ambiguous: usize,
    /// Of the others: those with another number of contacts, other contacts, or the same in another order.
    miscounted: usize,
    different: usize,
    reordered: usize,
    /// Single against double precision.
    single_miscounted: usize,
    single_different: usize,
}

fn compare(job: &Value, answer: &Value, bounds: Bounds) -> Outcome {
    let states = answer["states"].as_array().expect("states");
    let poses: Vec<Poses> = states.iter().map(|s| [array(&s["geoms"][0]), array(&s["geoms"][1])]).collect();
    let got = contacts::<f64>(job, answer, &poses, false);
    let rounded = contacts::<f64>(job, answer, &poses, true);
    let single = contacts::<f32>(job, answer, &poses, true);
    let mut out = Outcome::default();
    for (i, state) in states.iter().enumerate() {
        let want: Vec<Numbers> = state["contacts"].as_array().expect("a list").iter().map(array).collect();
        if state["ambiguous"] == true {
            out.ambiguous += 1;
            continue;
        }
        out.touching += usize::from(!want.is_empty());
        let [same, ordered] = bounds.compare(&got[i], &want);
        let miscounted = got[i].len() != want.len();
        out.miscounted += usize::from(miscounted);
        out.different += usize::from(!same && !miscounted);
        out.reordered += usize::from(same && !ordered);
        let [same, _] = SINGLE.compare(&single[i], &rounded[i]);
        let miscounted = single[i].len() != rounded[i].len();
        out.single_miscounted += usize::from(miscounted);
        out.single_different += usize::from(!same && !miscounted);
    }
    out
}

/// Compares pairs of shapes. At most `percent` of the states may differ.
fn check(pairs: &[([Value; 2], Bounds)], percent: usize) {
    let margins = [0.0, 0.02];
    let jobs: Vec<(Value, Bounds)> = pairs
        .iter()
        .flat_map(|(geoms, bounds)| {
            margins.map(|m| (json!({"geoms": geoms, "margin": m, "states": STATES, "seed": 7}), *bounds))
        })
        .collect();
    let answers = common::oracle("convex_contacts.py", &json!(jobs.iter().map(|j| &j.0).collect::<Vec<_>>()));
    let mut failures = Vec::new();
    for ((job, bounds), answer) in jobs.iter().zip(answers.as_array().expect("an answer per job")) {
        let out = compare(job, answer, *bounds);
        let name = |i: usize| job["geoms"][i]["type"].as_str().expect("a type");
        let line = format!("{} and {}, margin {}: {out:?}", name(0), name(1), job["margin"]);
        println!("{line}");
        let certain = STATES - out.ambiguous;
        let fits = out.touching > STATES / 3
            && 200 * out.miscounted <= certain
            && 100 * (out.miscounted + out.different) <= percent * certain
            && 100 * out.reordered <= 4 * certain
            && 100 * out.single_miscounted <= 3 * certain
            && 100 * out.single_different <= 12 * certain;
        if !fits {
            failures.push(line);
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

fn ball() -> Value {
    json!({"type": "sphere", "size": [0.1]})
}
fn limb() -> Value {
    json!({"type": "capsule", "size": [0.07, 0.2]})
}
fn egg() -> Value {
    json!({"type": "ellipsoid", "size": [0.1, 0.15, 0.2]})
}
fn lens() -> Value {
    json!({"type": "ellipsoid", "size": [0.12, 0.05, 0.1]})
}
fn can() -> Value {
    json!({"type": "cylinder", "size": [0.1, 0.15]})
}
fn coin() -> Value {
    json!({"type": "cylinder", "size": [0.15, 0.03]})
}
fn brick() -> Value {
    json!({"type": "box", "size": [0.1, 0.15, 0.2]})
}
fn plane() -> Value {
    json!({"type": "plane", "size": [1, 1, 1]})
}
/// A mesh of eight corners.
fn crate_mesh() -> Value {
    let side = |k: usize, half: f64| if k == 0 { -half } else { half };
    let corners: Vec<[f64; 3]> =
        (0..8).map(|i| [side(i & 1, 0.1), side(i >> 1 & 1, 0.15), side(i >> 2 & 1, 0.08)]).collect();
    json!({"type": "mesh", "vertices": corners})
}
fn wedge() -> Value {
    json!({"type": "mesh", "vertices": [[0.15, 0.1, -0.1], [-0.15, 0.12, -0.1], [0.0, -0.2, -0.1], [0.02, 0.01, 0.2]]})
}
/// A mesh of 42 corners: an icosahedron and the middles of its edges, on a stretched sphere.
fn stone() -> Value {
    let t = (1.0 + 5f64.sqrt()) / 2.0;
    let mut corners: Vec<[f64; 3]> = Vec::new();
    for (x, y) in [(-1.0, t), (1.0, t), (-1.0, -t), (1.0, -t)] {
        corners.extend([[x, y, 0.0], [0.0, x, y], [y, 0.0, x]]);
    }
    let square = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
    let ends = corners.clone();
    for (i, a) in ends.iter().enumerate() {
        let beside = ends[..i].iter().filter(|b| square(a, b) < 4.1);
        corners.extend(beside.map(|b| [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]))));
    }
    let on_sphere = |v: [f64; 3]| {
        let k = 0.15 / square(&v, &[0.0; 3]).sqrt();
        [k * v[0], 0.9 * k * v[1], 1.2 * k * v[2]]
    };
    json!({"type": "mesh", "vertices": corners.into_iter().map(on_sphere).collect::<Vec<_>>()})
}
fn field() -> Value {
    let wave = |r: usize, c: usize| 0.5 + 0.3 * ((r * r + 3 * c) as f32).sin() + 0.2 * ((5 * c + r) as f32).cos();
    let height = |r: usize, c: usize| if c > 5 { 0.5 } else { wave(r, c).clamp(0.0, 1.0) };
    let rows: Vec<Vec<f32>> = (0..7).map(|r| (0..9).map(|c| height(r, c)).collect()).collect();
    json!({"type": "hfield", "size": [0.6, 0.5, 0.15, 0.1], "heights": rows})
}

#[test]
fn ellipsoids_agree_with_mujoco() {
    let pairs = [[ball(), egg()], [limb(), egg()], [egg(), lens()], [egg(), can()], [egg(), brick()], [egg(), stone()]];
    check(&pairs.map(|p| (p, SMOOTH)), 1);
}

#[test]
fn cylinders_agree_with_mujoco() {
    let pairs = [[limb(), can()], [can(), coin()], [can(), brick()], [can(), crate_mesh()], [coin(), stone()]];
    check(&pairs.map(|p| (p, SMOOTH)), 4);
}

#[test]
fn meshes_agree_with_mujoco() {
    let round = [[ball(), crate_mesh()], [ball(), stone()], [limb(), crate_mesh()], [limb(), stone()]];
    let boxes = [[brick(), crate_mesh()], [brick(), stone()], [brick(), wedge()]];
    let meshes = [[crate_mesh(), wedge()], [stone(), crate_mesh()], [stone(), stone()]];
    let planes = [[plane(), crate_mesh()], [plane(), wedge()], [plane(), stone()]];
    let pairs: Vec<_> = round.into_iter().chain(boxes).chain(meshes).chain(planes).map(|p| (p, EXACT)).collect();
    check(&pairs, 2);
}

#[test]
fn height_fields_and_convex_shapes_agree_with_mujoco() {
    let pairs = [[field(), egg()], [field(), can()], [field(), stone()], [field(), crate_mesh()]];
    check(&pairs.map(|p| (p, SMOOTH)), 6);
}

/// A hash of two numbers, from -1 to 1.
fn noise(i: usize, k: usize) -> f64 {
    let mut z = ((i as u64) << 32 | k as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A random rotation.
fn rotation(i: usize) -> Rot<f64> {
    let q = [0, 1, 2, 3].map(|k| noise(i, 100 + k));
    crate::algebra::spatial::quat_to_rot(&q)
}

const UPRIGHT: Rot<f64> = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A box as a hull.
fn block(half: [f64; 3]) -> Hull {
    let corner = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 1 { half[k] } else { -half[k] });
    let polygons = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let normals = [0, 1, 2].iter().flat_map(|&k| {
        [-1.0, 1.0].map(|side| {
            let mut n = [0.0; 3];
            n[k] = side;
            n
        })
    });
    Hull::new((0..8).map(corner).collect(), polygons.map(|p| p.to_vec()).to_vec(), normals.collect(), &[])
}

fn list(a: &Solid<f64>, b: &Solid<f64>, margin: f64, several: bool) -> Vec<Touch<f64>> {
    let (mut scratch, mut out) = (Scratch::new(), Touches::new());
    convex(a, b, margin, &search(several), &mut scratch, &mut out);
    out.as_slice().to_vec()
}

/// Every depth is that of the contact's normal, and no other direction has a much smaller one.
#[test]
fn depths_are_those_of_support_planes() {
    let hull = Polyhedron::new(&block([0.1, 0.12, 0.07]));
    let forms = [
        Form::Sphere { radius: 0.1 },
        Form::Capsule { radius: 0.05, half: 0.1 },
        Form::Ellipsoid { half: [0.1, 0.15, 0.08] },
        Form::Cylinder { radius: 0.1, half: 0.12 },
        Form::Cuboid { half: [0.1, 0.08, 0.12] },
        Form::Hull(&hull),
    ];
    let directions: Vec<V3<f64>> = (0..1000).map(|i| unit(&[noise(i, 1), noise(i, 2), noise(i, 3)])).collect();
    let mut touching = 0;
    for (x, first) in forms.iter().enumerate() {
        for (y, second) in forms.iter().enumerate().skip(x) {
            for i in 0..40 {
                let a = Solid { center: [0.0; 3], axes: rotation(i), form: *first };
                let place = unit(&[noise(i, 10), noise(i, 11), noise(i, 12)]);
                let center = scale(&place, 0.17 + 0.04 * noise(i, 13));
                let b = Solid { center, axes: rotation(i + 1000), form: *second };
                let Some(touch) = list(&a, &b, 0.0, false).first().copied() else { continue };
                let depth = |n: &V3<f64>| {
                    let (p, q) = (a.shape().support(n), b.shape().support(&neg(n)));
                    dot(n, &sub(&p.point, &q.point))
                };
                assert!(-touch.dist < depth(&touch.normal) + 1e-9, "forms {x} and {y}, pose {i}");
                // deep smooth shapes end at the cap of iterations
                let error = if -touch.dist > 0.04 { 1e-4 } else { 2e-6 };
                for n in &directions {
                    assert!(depth(n) > -touch.dist - error, "forms {x} and {y}, pose {i}: {} in {n:?}", depth(n));
                }
                touching += 1;
            }
        }
    }
    assert!(touching > 300, "{touching}");
}

#[test]
fn a_cylinder_stands_on_four_points() {
    let a = Solid { center: [0.0; 3], axes: UPRIGHT, form: Form::Cylinder { radius: 0.2, half: 0.1 } };
    let b = Solid { center: [0.0, 0.0, 0.199], axes: UPRIGHT, form: Form::Cylinder { radius: 0.1, half: 0.1 } };
    let touches = list(&a, &b, 0.0, true);
    assert_eq!(touches.len(), 4);
    for t in &touches {
        assert!((t.dist + 0.001).abs() < 1e-12 && (t.pos[2] - 0.0995).abs() < 1e-12);
        assert!((norm(&[t.pos[0], t.pos[1], 0.0]) - 0.1).abs() < 1e-12 && t.normal == [0.0, 0.0, 1.0]);
    }
    assert_eq!(list(&a, &b, 0.0, false).len(), 1, "without multiccd");
    // apart, but within the margin
    let above = Solid { center: [0.0, 0.0, 0.21], ..b };
    assert_eq!(list(&a, &above, 0.02, true).len(), 4);
    assert!(list(&a, &above, 0.02, true).iter().all(|t| (t.dist - 0.01).abs() < 1e-12));
    assert!(list(&a, &above, 0.005, true).is_empty());
}

#[test]
fn a_hull_of_a_box_touches_like_the_box() {
    let hull = Polyhedron::new(&block([0.1, 0.2, 0.3]));
    for i in 0..50 {
        let (center, axes) = ([0.11 + 0.02 * noise(i, 5), 0.02, 0.3], rotation(i));
        let solid = |form| Solid { center, axes, form };
        let other = Solid { center: [0.0; 3], axes: UPRIGHT, form: Form::Cuboid { half: [0.15; 3] } };
        let [x, y] =
            [Form::Hull(&hull), Form::Cuboid { half: [0.1, 0.2, 0.3] }].map(|f| list(&other, &solid(f), 0.0, false));
        assert_eq!(x.len(), y.len());
        for (x, y) in x.iter().zip(&y) {
            assert!((x.dist - y.dist).abs() < 1e-9, "pose {i}: {} and {}", x.dist, y.dist);
        }
    }
}

/// A sphere is also found by the closed form.
#[test]
fn a_sphere_touches_a_cylinder_as_in_closed_form() {
    for i in 0..200 {
        let (center, axes) = ([0.18 * noise(i, 1), 0.18 * noise(i, 2), 0.22 * noise(i, 3)], rotation(i));
        let a = Solid { center, axes: UPRIGHT, form: Form::Sphere { radius: 0.05 } };
        let b = Solid { center: [0.0; 3], axes, form: Form::Cylinder { radius: 0.1, half: 0.15 } };
        let sphere = Sphere { center, axis: UPRIGHT[2], radius: 0.05 };
        let cylinder = crate::geometry::Cylinder { center: [0.0; 3], axes, radius: 0.1, half: 0.15 };
        let want = sphere_cylinder(&sphere, &cylinder, 0.02);
        let got = list(&a, &b, 0.02, true);
        assert_eq!(got.len(), usize::from(want.on), "pose {i}");
        if let Some(got) = got.first() {
            // overlapping, both shapes are searched with MuJoCo's tolerance
            let error = if want.dist < -0.05 { 2e-6 } else { 1e-9 };
            assert!((got.dist - want.dist).abs() < error, "pose {i}: {} and {}", got.dist, want.dist);
        }
    }
}

#[test]
fn shapes_without_numbers_do_not_touch() {
    let nan = Solid { center: [f64::NAN; 3], axes: UPRIGHT, form: Form::Cylinder { radius: 0.1, half: 0.1 } };
    let far = Solid { center: [1e300, 0.0, 0.0], axes: UPRIGHT, form: Form::Ellipsoid { half: [0.1; 3] } };
    let same = Solid { center: [0.0; 3], axes: UPRIGHT, form: Form::Cuboid { half: [0.1; 3] } };
    for (a, b) in [(&nan, &same), (&same, &nan), (&far, &same), (&nan, &nan)] {
        let touches = list(a, b, 0.01, true);
        assert!(touches.iter().all(|t| t.dist.is_nan() || t.dist.abs() < 1.0), "{touches:?}");
    }
}

#[test]
fn shapes_with_coinciding_centers_touch() {
    let forms = [
        Form::Cuboid { half: [0.1, 0.15, 0.2] },
        Form::Cylinder { radius: 0.1, half: 0.15 },
        Form::Ellipsoid { half: [0.1, 0.15, 0.2] },
    ];
    for first in forms {
        for second in forms {
            let a = Solid { center: [0.0; 3], axes: UPRIGHT, form: first };
            let b = Solid { center: [0.0, 0.0, 1e-9], axes: UPRIGHT, form: second };
            let touches = list(&a, &b, 0.0, true);
            assert!(!touches.is_empty(), "{first:?} and {second:?}");
            for t in touches {
                // the directions have no meaning, and deep smooth shapes end at the cap of iterations
                assert!(
                    (t.dist + 0.2).abs() < 5e-3 && (norm(&t.normal) - 1.0).abs() < 1e-12,
                    "{first:?} {second:?}: {t:?}"
                );
            }
        }
    }
}
