//! A ray hits a shape where the closed form says: on the surface, at the first hit, with the right normal. It misses
//! only what it does not touch.

use marathon_render::Shape;

type V = [f64; 3];

/// Deterministic numbers in -1..1 (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self, size: f64) -> V {
        [size * self.next(), size * self.next(), size * self.next()]
    }
}

fn at(o: V, d: V, t: f64) -> V {
    [o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]]
}

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(v: V) -> V {
    let n = dot(v, v).sqrt();
    v.map(|x| x / n)
}

/// Negative inside, positive outside, zero on the surface; for sphere, capsule, box and cylinder a length.
fn implicit(shape: Shape, p: V) -> f64 {
    let [x, y, z] = p;
    match shape {
        Shape::Sphere { radius } => dot(p, p).sqrt() - radius,
        Shape::Capsule { radius, half } => {
            let rest = z - z.clamp(-half, half);
            (x * x + y * y + rest * rest).sqrt() - radius
        }
        Shape::Box { half } => (0..3).map(|i| p[i].abs() - half[i]).fold(f64::NEG_INFINITY, f64::max),
        Shape::Ellipsoid { semi } => (0..3).map(|i| (p[i] / semi[i]).powi(2)).sum::<f64>().sqrt() - 1.0,
        Shape::Cylinder { radius, half } => ((x * x + y * y).sqrt() - radius).max(z.abs() - half),
    }
}

const SHAPES: [Shape; 6] = [
    Shape::Sphere { radius: 0.7 },
    Shape::Capsule { radius: 0.3, half: 0.8 },
    Shape::Box { half: [0.3, 0.5, 0.9] },
    Shape::Ellipsoid { semi: [0.2, 0.6, 1.0] },
    Shape::Cylinder { radius: 0.6, half: 0.3 },
    Shape::Cylinder { radius: 0.2, half: 0.9 },
];

#[test]
fn random_rays_meet_every_shape_where_its_equation_says() {
    for shape in SHAPES {
        let mut random = Random(7);
        let (mut hits, mut misses) = (0, 0);
        for _ in 0..4000 {
            let o = random.vector(3.0);
            if implicit(shape, o) < 0.05 {
                continue;
            }
            // aim near the shape, so that hits and near misses both occur
            let aim = random.vector(1.1);
            let d = unit([aim[0] - o[0], aim[1] - o[1], aim[2] - o[2]]);
            let walk = |end: f64| (0..600).map(move |i| end * f64::from(i) / 600.0);
            match shape.intersect(o, d) {
                Some(hit) => {
                    hits += 1;
                    let p = at(o, d, hit.distance);
                    assert!(
                        hit.distance > 0.0 && implicit(shape, p).abs() < 1e-9,
                        "{shape:?}: {p:?} is off the surface"
                    );
                    let before = walk(hit.distance - 1e-6).map(|t| implicit(shape, at(o, d, t))).fold(1.0, f64::min);
                    assert!(before > 0.0, "{shape:?}: the ray was inside before its hit");

                    let n = hit.normal;
                    assert!((dot(n, n) - 1.0).abs() < 1e-12 && dot(n, d) <= 1e-12, "{shape:?}: normal {n:?}");
                    // steepest ascent of the equation; not defined on edges, where two normals are right
                    let h = 1e-6;
                    let slope = |i: usize| {
                        let (mut a, mut b) = (p, p);
                        a[i] += h;
                        b[i] -= h;
                        implicit(shape, a) - implicit(shape, b)
                    };
                    let gradient = unit([slope(0), slope(1), slope(2)]);
                    let edge = match shape {
                        Shape::Box { half } => (0..3).filter(|&i| p[i].abs() > half[i] - 1e-5).count() > 1,
                        Shape::Cylinder { radius, half } => {
                            (p[0] * p[0] + p[1] * p[1]).sqrt() > radius - 1e-5 && p[2].abs() > half - 1e-5
                        }
                        _ => false,
                    };
                    assert!(edge || dot(gradient, n) > 1.0 - 1e-6, "{shape:?}: normal {n:?}, expected {gradient:?}");
                }
                None => {
                    misses += 1;
                    let least = walk(8.0).map(|t| implicit(shape, at(o, d, t))).fold(1.0, f64::min);
                    assert!(least > -1e-9, "{shape:?}: missed although the ray goes {least} deep");
                }
            }
        }
        assert!(hits > 500 && misses > 500, "{shape:?}: {hits} hits, {misses} misses");
    }
}

#[test]
fn axis_aligned_rays_have_exact_distances() {
    let cases: [(Shape, V, V, f64, V); 9] = [
        (SHAPES[0], [-2.0, 0.0, 0.0], [1.0, 0.0, 0.0], 1.3, [-1.0, 0.0, 0.0]),
        // 3-4-5: 0.42 off axis, 0.56 before the middle
        (SHAPES[0], [0.42, -2.0, 0.0], [0.0, 1.0, 0.0], 1.44, [0.6, -0.8, 0.0]),
        (SHAPES[1], [0.0, 0.0, 3.0], [0.0, 0.0, -1.0], 1.9, [0.0, 0.0, 1.0]),
        (SHAPES[1], [0.18, 0.0, -3.0], [0.0, 0.0, 1.0], 1.96, [0.6, 0.0, -0.8]),
        (SHAPES[1], [0.0, 2.0, 0.8], [0.0, -1.0, 0.0], 1.7, [0.0, 1.0, 0.0]),
        (SHAPES[2], [0.1, 2.0, 0.2], [0.0, -1.0, 0.0], 1.5, [0.0, 1.0, 0.0]),
        (SHAPES[3], [0.0, 0.0, 2.0], [0.0, 0.0, -1.0], 1.0, [0.0, 0.0, 1.0]),
        (SHAPES[4], [0.3, 0.4, 2.0], [0.0, 0.0, -1.0], 1.7, [0.0, 0.0, 1.0]),
        (SHAPES[4], [0.36, -2.0, 0.1], [0.0, 1.0, 0.0], 1.52, [0.6, -0.8, 0.0]),
    ];
    for (shape, o, d, distance, normal) in cases {
        let hit = shape.intersect(o, d).unwrap_or_else(|| panic!("{shape:?} from {o:?} must be hit"));
        assert!((hit.distance - distance).abs() < 1e-12, "{shape:?} from {o:?}: {}", hit.distance);
        assert!((0..3).all(|i| (hit.normal[i] - normal[i]).abs() < 1e-12), "{shape:?} from {o:?}: {:?}", hit.normal);
    }
}

#[test]
fn nothing_is_met_from_inside_or_behind() {
    for shape in SHAPES {
        let mut random = Random(3);
        for _ in 0..200 {
            let d = unit(random.vector(1.0));
            assert_eq!(shape.intersect([0.01, -0.02, 0.03], d), None, "{shape:?} from inside along {d:?}");
            // start beyond the shape and look away from it
            assert_eq!(shape.intersect(d.map(|x| 2.0 * x), d), None, "{shape:?} behind the ray along {d:?}");
        }
    }
}
