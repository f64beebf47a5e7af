//! Triangle meshes, and where a ray meets them.

use glam::{DVec3, Vec3};
use marathon_physics::model::Mesh;

/// Most triangles of a leaf of the tree of boxes.
const LEAF: usize = 4;
/// Cosine of the angle up to which two faces look like one round surface.
const ROUND: f32 = 0.8;

/// A triangle mesh in a tree of boxes, about the center of its own box.
#[derive(Debug)]
pub(crate) struct Triangles {
    nodes: Vec<Node>,
    faces: Vec<Face>,
    /// Center of its box in the frame of the geom, m.
    pub center: DVec3,
    /// Half lengths of its box, m.
    pub half: DVec3,
}

/// A box. One with faces has no children.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// First face, or first of two neighboring children.
    first: u32,
    faces: u32,
}

#[derive(Clone, Copy, Debug)]
struct Face {
    corner: Vec3,
    edges: [Vec3; 2],
    /// Of the surface at the corners.
    normals: [Vec3; 3],
}

impl Triangles {
    /// `None` for a mesh without faces.
    pub fn new(mesh: &Mesh) -> Option<Self> {
        if mesh.faces.is_empty() {
            return None;
        }
        let points: Vec<Vec3> = mesh.vertices.iter().copied().map(Vec3::from_array).collect();
        let used = || mesh.faces.iter().flatten().map(|i| points[*i as usize]);
        let (low, high) = used().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
        let center = 0.5 * (low + high);
        let corners: Vec<[Vec3; 3]> = mesh.faces.iter().map(|face| face.map(|i| points[i as usize] - center)).collect();
        let normals = normals(&corners, &mesh.faces, points.len());
        let mut order: Vec<u32> = (0..corners.len() as u32).collect();
        let nodes = tree(&corners, &mut order);
        let face = |i: u32| {
            let ([a, b, c], normals) = (corners[i as usize], normals[i as usize]);
            Face { corner: a, edges: [b - a, c - a], normals }
        };
        Some(Triangles {
            nodes,
            faces: order.into_iter().map(face).collect(),
            center: center.as_dvec3(),
            half: (0.5 * (high - low)).as_dvec3(),
        })
    }

    /// First meeting of the ray `o + t d`, `t > 0`, with the surface from either side, and the normal on the side of the ray.
    pub fn enter(&self, o: DVec3, d: DVec3) -> Option<(f64, DVec3)> {
        let (t, face, [u, v]) = self.meet(o, d, false)?;
        let [first, second, third] = face.normals;
        let normal = (first * (1.0 - u - v) + second * u + third * v).as_dvec3().normalize_or(-d);
        let flat = face.edges[0].cross(face.edges[1]).as_dvec3();
        Some((t, if flat.dot(d) > 0.0 { -normal } else { normal }))
    }

    /// Whether such a ray meets the surface.
    pub fn stops(&self, o: DVec3, d: DVec3) -> bool {
        self.meet(o, d, true).is_some()
    }

    /// The first face that a ray meets, or `any`, with the weights of its second and third corner.
    fn meet(&self, o: DVec3, d: DVec3, any: bool) -> Option<(f64, &Face, [f32; 2])> {
        // from near the box, so that single precision suffices
        let start = (o.length() - self.half.length()).max(0.0);
        let (o, d) = ((o + start * d).as_vec3(), d.as_vec3());
        let inverse = d.recip();
        let mut nearest = (f32::INFINITY, None);
        let mut stack = [0_u32; 64];
        let mut count = usize::from(self.nodes[0].reached(o, inverse, f32::INFINITY).is_some());
        while count > 0 {
            count -= 1;
            let node = &self.nodes[stack[count] as usize];
            let first = node.first as usize;
            if node.faces > 0 {
                for face in &self.faces[first..first + node.faces as usize] {
                    if let Some((t, weights)) = face.meet(o, d)
                        && t < nearest.0
                    {
                        nearest = (t, Some((face, weights)));
                    }
                }
                if any && nearest.1.is_some() {
                    break;
                }
                continue;
            }
            let one = self.nodes[first].reached(o, inverse, nearest.0);
            let other = self.nodes[first + 1].reached(o, inverse, nearest.0);
            let mut open = |child: usize| {
                stack[count] = child as u32;
                count += 1;
            };
            match (one, other) {
                // the nearer one is looked at first
                (Some(a), Some(b)) => {
                    let swapped = usize::from(b < a);
                    open(first + 1 - swapped);
                    open(first + swapped);
                }
                (Some(_), None) => open(first),
                (None, Some(_)) => open(first + 1),
                (None, None) => {}
            }
        }
        let (face, weights) = nearest.1?;
        Some((start + f64::from(nearest.0), face, weights))
    }
}

impl Node {
    /// Distance at which a ray is in the box, if that is below `most`.
    #[inline(always)]
    fn reached(&self, o: Vec3, inverse: Vec3, most: f32) -> Option<f32> {
        let (a, b) = ((self.low - o) * inverse, (self.high - o) * inverse);
        // a ray along a side gives NaN, which these leave out
        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element().min(most);
        (enter <= leave).then_some(enter)
    }
}

impl Face {
    /// Distance and weights of the second and third corner (Moller and Trumbore, 1997).
    #[inline(always)]
    fn meet(&self, o: Vec3, d: Vec3) -> Option<(f32, [f32; 2])> {
        let [a, b] = self.edges;
        let across = d.cross(b);
        let volume = a.dot(across);
        if volume == 0.0 {
            return None;
        }
        let from = o - self.corner;
        let u = from.dot(across) / volume;
        let over = from.cross(a);
        let v = d.dot(over) / volume;
        let t = b.dot(over) / volume;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some((t, [u, v]))
    }
}

/// Normals at the corners of the faces: means over the faces at a point that bend little.
fn normals(corners: &[[Vec3; 3]], faces: &[[u32; 3]], points: usize) -> Vec<[Vec3; 3]> {
    // as long as the face is large
    let flat: Vec<Vec3> = corners.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); points];
    for (i, face) in faces.iter().enumerate() {
        face.iter().for_each(|point| around[*point as usize].push(i as u32));
    }
    let normal = |face: usize, point: u32| {
        let own = flat[face].normalize_or_zero();
        let near = around[point as usize].iter().map(|other| flat[*other as usize]);
        near.filter(|other| other.normalize_or_zero().dot(own) > ROUND).sum::<Vec3>().normalize_or(own)
    };
    faces.iter().enumerate().map(|(i, face)| face.map(|point| normal(i, point))).collect()
}

/// A tree of boxes over the faces, which it sorts: halves along the longest side.
fn tree(corners: &[[Vec3; 3]], order: &mut [u32]) -> Vec<Node> {
    let middle = |face: u32| corners[face as usize].iter().sum::<Vec3>();
    let mut nodes = vec![Node { low: Vec3::ZERO, high: Vec3::ZERO, first: 0, faces: 0 }];
    let mut open = vec![(0, 0, order.len())];
    while let Some((node, from, to)) = open.pop() {
        let part = &mut order[from..to];
        let all = |part: &[u32]| part.iter().flat_map(|face| corners[*face as usize]).collect::<Vec<_>>();
        let (low, high) =
            all(part).into_iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
        if part.len() <= LEAF {
            nodes[node] = Node { low, high, first: from as u32, faces: part.len() as u32 };
            continue;
        }
        let axis = (high - low).max_position();
        let half = part.len() / 2;
        let along = |face: &u32| middle(*face)[axis];
        part.select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
        nodes[node] = Node { low, high, first: nodes.len() as u32, faces: 0 };
        for (from, to) in [(from, from + half), (from + half, to)] {
            open.push((nodes.len(), from, to));
            nodes.push(nodes[0]);
        }
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of `n` by `2 n` faces with radius 0.5 m, about (1, 0, 0).
    fn ball(n: u32) -> Mesh {
        let point = |i: u32, j: u32| {
            let (a, b) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(2 * n));
            let (a, b) = (std::f64::consts::PI * a, std::f64::consts::TAU * b);
            let (r, z) = (0.5 * libm::sin(a), 0.5 * libm::cos(a));
            [1.0 + (r * libm::cos(b)) as f32, (r * libm::sin(b)) as f32, z as f32]
        };
        let at = |i: u32, j: u32| i * 2 * n + j % (2 * n);
        let vertices = (0..=n).flat_map(|i| (0..2 * n).map(move |j| (i, j))).map(|(i, j)| point(i, j)).collect();
        let faces = (0..n).flat_map(|i| (0..2 * n).map(move |j| (i, j))).flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        });
        Mesh { name: "ball".into(), vertices, faces: faces.collect() }
    }

    #[test]
    fn rays_meet_a_ball_of_triangles_like_a_ball() {
        let triangles = Triangles::new(&ball(40)).expect("faces");
        assert!((triangles.center - DVec3::X).length() < 1e-6 && (triangles.half - 0.5).length() < 2e-3);
        let mut met = 0;
        for i in 0..200 {
            let (y, z) = (0.013 * f64::from(i % 20) - 0.12, 0.05 * f64::from(i / 20) - 0.2);
            for (o, d) in [(DVec3::new(-30.0, y, z), DVec3::X), (DVec3::new(y, 4.0, z), -DVec3::Y)] {
                let (t, normal) = triangles.enter(o, d).expect("the ball is there");
                let at = o + t * d;
                assert!((at.length() - 0.5).abs() < 2e-3, "{at}");
                assert!(normal.dot(at.normalize()) > 0.99, "{normal} at {at}");
                met += 1;
            }
        }
        assert_eq!(met, 400);
        assert!(triangles.stops(DVec3::new(-3.0, 0.1, 0.0), DVec3::X));
        assert!(!triangles.stops(DVec3::new(-3.0, 0.6, 0.0), DVec3::X));
        assert!(triangles.enter(DVec3::new(-3.0, 0.6, 0.0), DVec3::X).is_none());
        assert!(triangles.enter(DVec3::new(3.0, 0.0, 0.0), DVec3::X).is_none());
    }

    #[test]
    fn edges_of_a_box_stay_sharp() {
        // two sides of a box that share an edge
        let vertices =
            vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0]];
        let faces = vec![[0, 2, 1], [0, 3, 2], [0, 1, 5], [0, 5, 4]];
        let triangles = Triangles::new(&Mesh { name: String::new(), vertices, faces }).expect("faces");
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) - triangles.center;
        let (_, below) = triangles.enter(at(0.4, 0.01, -1.0), DVec3::Z).expect("a side");
        assert!((below + DVec3::Z).length() < 1e-6, "{below}");
        let (_, front) = triangles.enter(at(0.4, -1.0, 0.01), DVec3::Y).expect("a side");
        assert!((front + DVec3::Y).length() < 1e-6, "{front}");
    }
}
