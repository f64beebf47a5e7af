//! The depth of two convex shapes by the expanding polytope algorithm.
//!
//! A polytope of support points around the origin grows towards the boundary of the shapes' difference, always at its
//! face closest to the origin. That face ends as the closest part of the boundary.

use super::super::{TINY, V3};
use super::gjk::{Couple, Nearest, Search, Vertex, is_single};
use super::vector::*;

/// A triangle of the polytope.
#[derive(Clone, Copy, Debug)]
struct Face<S> {
    corners: [u32; 3],
    /// The faces at the edges from corner 0 to 1, 1 to 2, 2 to 0.
    beside: [u32; 3],
    /// The face's point closest to the origin: its outward normal times its distance.
    foot: V3<S>,
    /// Square of the distance.
    square: S,
    place: Place,
}

/// Where a face stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// It may be the closest one; the index in the list of those.
    Candidate(u32),
    /// It is part of the polytope, but cannot be the closest one.
    Kept,
    /// It has been replaced.
    Removed,
}

/// The expanding polytope; its memory is kept between calls.
#[derive(Clone, Debug)]
pub(super) struct Polytope<S> {
    vertices: Vec<Vertex<S>>,
    faces: Vec<Face<S>>,
    /// Faces that may be closest to the origin.
    candidates: Vec<u32>,
    /// Edges between faces that the new vertex sees and others: the other face, and the number of its edge.
    horizon: Vec<(u32, u8)>,
    stack: Vec<(u32, u8)>,
    center: V3<S>,
}

/// The face that was found.
pub(super) struct Depth<S> {
    pub depth: S,
    /// Points of the shapes at the face's foot.
    pub witness: [V3<S>; 2],
    /// The corners of the face.
    pub vertices: [Vertex<S>; 3],
}

/// Corners and neighbors of the faces of the first polytope around a segment: the ends are corners 0 and 1.
const AROUND_SEGMENT: [([u32; 3], [u32; 3]); 6] = [
    ([0, 2, 3], [1, 3, 2]),
    ([0, 4, 2], [2, 4, 0]),
    ([0, 3, 4], [0, 5, 1]),
    ([1, 3, 2], [5, 0, 4]),
    ([1, 2, 4], [3, 1, 5]),
    ([1, 4, 3], [4, 2, 3]),
];
/// The same for a triangle of corners 0 to 2; corner 4 is on the side of its normal, 3 on the other.
const ABOUT_TRIANGLE: [([u32; 3], [u32; 3]); 6] = [
    ([4, 0, 1], [1, 3, 2]),
    ([4, 2, 0], [2, 4, 0]),
    ([4, 1, 2], [0, 5, 1]),
    ([3, 1, 0], [5, 0, 4]),
    ([3, 0, 2], [3, 1, 5]),
    ([3, 2, 1], [4, 2, 3]),
];
/// The same for a tetrahedron.
const TETRAHEDRON: [([u32; 3], [u32; 3]); 4] =
    [([0, 1, 2], [1, 3, 2]), ([0, 3, 1], [2, 3, 0]), ([0, 2, 3], [0, 3, 1]), ([3, 2, 1], [2, 0, 1])];

/// Bounds of what rounding leaves of zero.
struct Zero<S> {
    /// Square of the smallest distance of a face of the first polytope.
    near: S,
    /// A vertex at least this much (a squared length) beyond a face sees it.
    beyond: S,
    /// Difference of the bounds at which a search among corners ends.
    gap: S,
    /// The support plane may be this much below the face in the first iteration.
    below: S,
}

impl<S: Number> Zero<S> {
    fn new() -> Self {
        let [near, beyond, gap, below] =
            if is_single::<S>() { [1e-14, 1e-10, 1e-7, 1e-6] } else { [TINY * TINY, TINY, TINY, 1e-10] };
        Zero { near: S::lit(near), beyond: S::lit(beyond), gap: S::lit(gap), below: S::lit(below) }
    }
}

/// Finds the depth of two overlapping shapes from the simplex at the end of [`nearest`](super::gjk::nearest). `None` if
/// the polytope degenerates: then there is no contact.
pub(super) fn depth<S: Number>(
    couple: &mut Couple<S>,
    search: &Search<S>,
    start: &Nearest<S>,
    polytope: &mut Polytope<S>,
) -> Option<Depth<S>> {
    let zero = Zero::new();
    polytope.begin(couple, start, &zero)?;
    let face = polytope.expand(couple, search, &zero)?;
    Some(polytope.read(&face))
}

impl<S: Number> Polytope<S> {
    pub(super) fn new() -> Self {
        Polytope {
            vertices: Vec::new(),
            faces: Vec::new(),
            candidates: Vec::new(),
            horizon: Vec::new(),
            stack: Vec::new(),
            center: [S::zero(); 3],
        }
    }

    fn clear(&mut self) {
        self.vertices.clear();
        self.faces.clear();
        self.candidates.clear();
        self.horizon.clear();
    }

    /// Builds the first polytope.
    fn begin(&mut self, couple: &mut Couple<S>, start: &Nearest<S>, zero: &Zero<S>) -> Option<()> {
        self.clear();
        let simplex = &start.simplex;
        let triangle = match start.count {
            2 => match self.around_segment(couple, &[simplex[0], simplex[1]], zero) {
                Ok(()) => None,
                Err(triangle) => Some(triangle?),
            },
            3 => Some([simplex[0], simplex[1], simplex[2]]),
            4 => self.tetrahedron(simplex, zero).err(),
            _ => return None,
        };
        if let Some(triangle) = triangle {
            self.clear();
            self.about_triangle(couple, &triangle, zero)?;
        }
        for i in 0..self.faces.len() {
            self.faces[i].place = Place::Candidate(i as u32);
            self.candidates.push(i as u32);
        }
        Some(())
    }

    /// Two pyramids over three support points around a segment. Otherwise a face that contains the origin, if any.
    fn around_segment(
        &mut self,
        couple: &mut Couple<S>,
        ends: &[Vertex<S>; 2],
        zero: &Zero<S>,
    ) -> Result<(), Option<[Vertex<S>; 3]>> {
        self.center = middle(&ends[0].point, &ends[1].point);
        self.vertices.extend(ends);
        let edge = sub(&ends[1].point, &ends[0].point);
        // the axis that is most perpendicular
        let mut least = 0;
        for i in 1..3 {
            if edge[i].abs() < edge[least].abs() {
                least = i;
            }
        }
        let mut axis = [S::zero(); 3];
        axis[least] = S::lit(1.0);
        let mut direction = cross(&axis, &edge);
        let about = scale(&edge, S::lit(1.0).div(norm(&edge)));
        for _ in 0..3 {
            let vertex = couple.support(&unit(&direction));
            self.vertices.push(vertex);
            direction = third_of_turn(&about, &direction);
        }
        self.attach_all(&AROUND_SEGMENT, zero).map_err(Some)?;
        let at = |i: usize| self.vertices[i].point;
        if !pierces(&at(0), &at(1), [&at(2), &at(3), &at(4)]) {
            return Err(None);
        }
        Ok(())
    }

    /// Two pyramids over a triangle.
    fn about_triangle(&mut self, couple: &mut Couple<S>, corners: &[Vertex<S>; 3], zero: &Zero<S>) -> Option<()> {
        let [a, b, c] = corners.map(|v| v.point);
        self.center = scale(&add(&add(&a, &b), &c), S::lit(1.0 / 3.0));
        let normal = cross(&sub(&b, &a), &sub(&c, &a));
        if norm(&normal) < S::lit(TINY) {
            return None;
        }
        let normal = unit(&normal);
        self.vertices.extend(corners);
        for direction in [neg(&normal), normal] {
            let apex = couple.support(&direction);
            if contains(&a, &b, &c, &apex.point) {
                return None;
            }
            self.vertices.push(apex);
        }
        self.attach_all(&ABOUT_TRIANGLE, zero).ok()
    }

    /// The simplex itself. Otherwise a face that contains the origin, or the closest one to an origin outside.
    fn tetrahedron(&mut self, corners: &[Vertex<S>; 4], zero: &Zero<S>) -> Result<(), [Vertex<S>; 3]> {
        let [a, b, c, d] = corners.map(|v| v.point);
        self.center = scale(&add(&add(&add(&a, &b), &c), &d), S::lit(0.25));
        self.vertices.extend(corners);
        self.attach_all(&TETRAHEDRON, zero)?;
        let inside = same_side(&a, &b, &c, &d)
            && same_side(&b, &c, &d, &a)
            && same_side(&c, &d, &a, &b)
            && same_side(&d, &a, &b, &c);
        if inside {
            return Ok(());
        }
        let mut closest = self.faces[0];
        for face in &self.faces {
            if face.square < closest.square {
                closest = *face;
            }
        }
        Err(self.corners(&closest))
    }

    fn corners(&self, face: &Face<S>) -> [Vertex<S>; 3] {
        face.corners.map(|i| self.vertices[i as usize])
    }

    /// Adds the faces of the first polytope, unless one of them contains the origin.
    fn attach_all(&mut self, faces: &[([u32; 3], [u32; 3])], zero: &Zero<S>) -> Result<(), [Vertex<S>; 3]> {
        for &(corners, beside) in faces {
            let square = self.attach(corners, beside);
            if square < zero.near {
                return Err(corners.map(|i| self.vertices[i as usize]));
            }
        }
        Ok(())
    }

    /// Adds a face and returns the square of its distance; zero for a face without area.
    fn attach(&mut self, corners: [u32; 3], beside: [u32; 3]) -> S {
        let [a, b, c] = corners.map(|i| self.vertices[i as usize].point);
        let (mut foot, mut square) = ([S::zero(); 3], S::zero());
        if let Some(found) = foot_of(&c, &b, &a) {
            foot = found;
            if dot(&foot, &sub(&a, &self.center)) < S::zero() {
                foot = neg(&foot);
            }
            square = dot(&foot, &foot);
        }
        self.faces.push(Face { corners, beside, foot, square, place: Place::Kept });
        square
    }

    /// Expands the polytope. Returns the face closest to the origin.
    fn expand(&mut self, couple: &mut Couple<S>, search: &Search<S>, zero: &Zero<S>) -> Option<Face<S>> {
        let discrete = couple.is_discrete();
        let tolerance = if discrete { zero.gap } else { search.tolerance };
        let most_faces = 6 * search.iterations.max(1);
        let mut best: Option<Face<S>> = None;
        let mut upper: Option<S> = None;
        for iteration in 0..search.iterations {
            let Some(index) = self.closest() else { break };
            let face = self.faces[index as usize];
            if upper.is_some_and(|upper| upper * upper < face.square) {
                break;
            }
            best = Some(face);
            if !(S::zero() < face.square) {
                break;
            }
            let lower = face.square.sqrt();
            let new = couple.support(&scale(&face.foot, S::lit(1.0).div(lower)));
            let bound = dot(&face.foot, &new.point).div(lower);
            let most = upper.map_or(bound, |upper| bound.min(upper));
            upper = Some(most);
            if bound - lower < tolerance {
                if iteration == 0 && bound < lower - zero.below {
                    return None;
                }
                break;
            }
            if discrete && self.vertices.iter().any(|v| v.index == new.index) {
                break;
            }
            self.vertices.push(new);
            self.find_horizon(index, &new.point, zero.beyond);
            if self.horizon.len() < 3 {
                return None;
            }
            if self.faces.len() + self.horizon.len() > most_faces {
                break;
            }
            self.fan(face.square, most * most)?;
            if self.candidates.is_empty() {
                break;
            }
        }
        best
    }

    /// The candidate closest to the origin.
    fn closest(&self) -> Option<u32> {
        let mut found: Option<u32> = None;
        for &i in &self.candidates {
            if found.is_none_or(|best| self.faces[i as usize].square < self.faces[best as usize].square) {
                found = Some(i);
            }
        }
        found
    }

    /// Removes a face.
    fn remove(&mut self, index: u32) {
        let face = &mut self.faces[index as usize];
        if let Place::Candidate(at) = face.place {
            self.candidates.swap_remove(at as usize);
            if let Some(&moved) = self.candidates.get(at as usize) {
                self.faces[moved as usize].place = Place::Candidate(at);
            }
        }
        self.faces[index as usize].place = Place::Removed;
    }

    /// Number of the edge of face `index` that starts at a corner.
    fn edge_from(&self, index: u32, corner: u32) -> u8 {
        let corners = &self.faces[index as usize].corners;
        if corners[0] == corner {
            0
        } else if corners[1] == corner {
            1
        } else {
            2
        }
    }

    /// Removes the faces that `point` sees, beginning with face `first`, and lists the edges around them.
    fn find_horizon(&mut self, first: u32, point: &V3<S>, beyond: S) {
        self.horizon.clear();
        self.stack.clear();
        self.remove(first);
        self.look_beside(first, [2, 1, 0]);
        while let Some((index, edge)) = self.stack.pop() {
            let face = &self.faces[index as usize];
            if face.place == Place::Removed {
                continue;
            }
            if !(beyond < dot(&face.foot, point) - face.square) {
                self.horizon.push((index, edge));
                continue;
            }
            self.remove(index);
            let edge = usize::from(edge);
            self.look_beside(index, [(edge + 2) % 3, (edge + 1) % 3]);
        }
    }

    /// Puts the neighbors at some edges of a face on the stack. The last one is looked at first.
    fn look_beside<const N: usize>(&mut self, index: u32, edges: [usize; N]) {
        let face = self.faces[index as usize];
        for edge in edges {
            let other = face.beside[edge];
            self.stack.push((other, self.edge_from(other, face.corners[(edge + 1) % 3])));
        }
    }

    /// Connects the last vertex with the horizon. Faces between the bounds become candidates. `None` if a face has no
    /// area.
    fn fan(&mut self, lower: S, upper: S) -> Option<()> {
        let (first, edges) = (self.faces.len() as u32, self.horizon.len() as u32);
        let apex = self.vertices.len() as u32 - 1;
        for k in 0..edges {
            let (other, edge) = self.horizon[k as usize];
            let neighbor = &mut self.faces[other as usize];
            let edge = usize::from(edge);
            let (from, to) = (neighbor.corners[edge], neighbor.corners[(edge + 1) % 3]);
            neighbor.beside[edge] = first + k;
            let sides = [first + (k + edges - 1) % edges, other, first + (k + 1) % edges];
            let square = self.attach([apex, to, from], sides);
            if !(S::zero() < square) {
                return None;
            }
            if !(square < lower) && !(upper < square) {
                self.faces[(first + k) as usize].place = Place::Candidate(self.candidates.len() as u32);
                self.candidates.push(first + k);
            }
        }
        Some(())
    }

    /// The points of the shapes at a face's foot.
    fn read(&self, face: &Face<S>) -> Depth<S> {
        let vertices = self.corners(face);
        let [a, b, c] = &vertices;
        let weights = affine(&a.point, &b.point, &c.point, &face.foot);
        let witness = [0, 1].map(|side| combine([&a.on[side], &b.on[side], &c.on[side]], &weights));
        Depth { depth: face.square.sqrt(), witness, vertices }
    }
}

/// The point of a plane through three points that is closest to the origin. `None` if they are on a line.
fn foot_of<S: Number>(a: &V3<S>, b: &V3<S>, c: &V3<S>) -> Option<V3<S>> {
    let (ab, ac, bc) = (sub(b, a), sub(c, a), sub(c, b));
    let ways = [(cross(&bc, &ab), b), (cross(&ab, &ac), a), (cross(&ac, &bc), c)];
    for (i, (normal, corner)) in ways.iter().enumerate() {
        let (reach, square) = (dot(normal, corner), dot(normal, normal));
        if square == S::zero() {
            return None;
        }
        if i == 2 || (reach != S::zero() && S::lit(TINY) < square) {
            return Some(scale(normal, reach.div(square)));
        }
    }
    None
}

/// Weights of a triangle's corners whose sum is a point of its plane.
fn affine<S: Number>(a: &V3<S>, b: &V3<S>, c: &V3<S>, p: &V3<S>) -> [S; 3] {
    let normal = cross(&sub(b, a), &sub(c, a));
    let mut k = 0;
    for i in 1..3 {
        if normal[k].abs() < normal[i].abs() {
            k = i;
        }
    }
    let (pa, pb, pc) = (sub(a, p), sub(b, p), sub(c, p));
    let areas = [cross(&pb, &pc)[k], cross(&pc, &pa)[k], cross(&pa, &pb)[k]];
    areas.map(|x| x.div(normal[k]))
}

/// Whether a triangle contains a point.
fn contains<S: Number>(a: &V3<S>, b: &V3<S>, c: &V3<S>, p: &V3<S>) -> bool {
    let weights = affine(a, b, c, p);
    if weights.iter().any(|w| *w < S::zero()) {
        return false;
    }
    norm(&sub(&combine([a, b, c], &weights), p)) < S::lit(TINY)
}

/// Whether the origin and `d` are on the same side of a plane through three points.
fn same_side<S: Number>(a: &V3<S>, b: &V3<S>, c: &V3<S>, d: &V3<S>) -> bool {
    let zero = S::zero();
    let normal = cross(&sub(b, a), &sub(c, a));
    let (x, y) = (dot(&normal, &sub(d, a)), -dot(&normal, a));
    (zero < x && zero < y) || (x < zero && y < zero)
}

/// Whether the line from `p` to `q` goes through a triangle.
fn pierces<S: Number>(p: &V3<S>, q: &V3<S>, triangle: [&V3<S>; 3]) -> bool {
    let zero = S::zero();
    let line = sub(q, p);
    let [a, b, c] = triangle.map(|x| sub(x, p));
    let volumes = [(&a, &b), (&b, &c), (&c, &a)].map(|(x, y)| dot(x, &cross(y, &line)));
    volumes.iter().all(|v| !(*v < zero)) || volumes.iter().all(|v| !(zero < *v))
}

/// A vector after a third of a turn about a unit axis.
fn third_of_turn<S: Number>(axis: &V3<S>, v: &V3<S>) -> V3<S> {
    let cos = S::lit(-0.5);
    let sin = S::lit(3f64.sqrt() / 2.0);
    let part = dot(axis, v) * S::lit(1.5);
    add(&along(&scale(v, cos), &cross(axis, v), sin), &scale(axis, part))
}
