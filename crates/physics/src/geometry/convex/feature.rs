//! Faces and edges of shapes at a contact.

use super::super::V3;
use super::gjk::Vertex;
use super::support::{Form, Solid};
use super::vector::*;

/// Cosine of the angle up to which two faces count as opposed, and a direction as a normal.
pub(super) const FACE_TOLERANCE: f64 = 0.996;
/// Sine of the angle up to which an edge counts as parallel to a face.
pub(super) const EDGE_TOLERANCE: f64 = 0.0888;
/// Corners of a cylinder's cap.
const CAP: usize = 16;

/// The corners of a shape that are part of the difference's closest face: one, an edge, or a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Feature<S> {
    index: [i32; 3],
    points: [V3<S>; 3],
    /// Number of different corners.
    pub count: usize,
}

impl<S: Number> Feature<S> {
    /// The corners of one side of a face of the difference.
    pub(super) fn new(vertices: &[Vertex<S>; 3], side: usize) -> Self {
        let mut index = vertices.map(|v| v.index[side]);
        let mut points = vertices.map(|v| v.core[side]);
        let count = if index[0] == index[1] {
            (index[1], points[1]) = (index[2], points[2]);
            if index[0] == index[2] { 1 } else { 2 }
        } else if index[2] == index[0] || index[2] == index[1] {
            2
        } else {
            3
        };
        Feature { index, points, count }
    }
}

/// A face: its outward normal, and its number.
pub(super) type Face<S> = (V3<S>, u32);

/// An edge: its unit direction, and its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge<S> {
    pub direction: V3<S>,
    pub ends: [V3<S>; 2],
}

impl<S: Number> Edge<S> {
    fn new(from: &V3<S>, to: &V3<S>) -> Self {
        Edge { direction: unit(&sub(to, from)), ends: [*from, *to] }
    }
}

impl<S: Number> Solid<'_, S> {
    /// Lists the faces around a feature. `outward` is the contact's direction out of the shape.
    pub(super) fn faces(&self, feature: &Feature<S>, outward: &V3<S>, out: &mut Vec<Face<S>>) {
        out.clear();
        match self.form {
            Form::Cuboid { .. } => self.box_faces(feature, outward, out),
            Form::Cylinder { .. } if feature.count == 1 => {
                let bottom = feature.index[0] == 1;
                let axis = self.axes[2];
                out.push((if bottom { neg(&axis) } else { axis }, u32::from(bottom)));
            }
            Form::Hull(hull) => {
                let corners = &feature.index[..feature.count];
                let most = [usize::MAX, 2, 1][feature.count - 1];
                let shared = |p: &u32| corners[1..].iter().all(|v| hull.around(*v as usize).contains(p));
                let found = hull.around(corners[0] as usize).iter().filter(|p| shared(p)).take(most);
                out.extend(found.map(|&p| (turn(&self.axes, &hull.normals[p as usize]), p)));
            }
            _ => {}
        }
    }

    /// The faces of a box on which all corners lie. If they are too few for the feature, the face along `outward`.
    fn box_faces(&self, feature: &Feature<S>, outward: &V3<S>, out: &mut Vec<Face<S>>) {
        let corners = &feature.index[..feature.count];
        for axis in 0..3 {
            let side = corners[0] >> axis & 1;
            if corners.iter().all(|c| c >> axis & 1 == side) {
                out.push(self.box_face(axis, side == 1));
            }
        }
        if out.len() != 4 - feature.count {
            out.clear();
            let local = unit(&into_local(&self.axes, outward));
            let close = S::lit(FACE_TOLERANCE);
            let axis = (0..3).find(|&k| close < local[k].abs());
            out.extend(axis.map(|k| self.box_face(k, S::zero() < local[k])));
        }
    }

    fn box_face(&self, axis: usize, upper: bool) -> Face<S> {
        let normal = if upper { self.axes[axis] } else { neg(&self.axes[axis]) };
        (normal, 2 * axis as u32 + u32::from(!upper))
    }

    /// Lists the edges at a feature. `witness` is the shape's point of the contact, without the margin.
    pub(super) fn edges(&self, feature: &Feature<S>, witness: &V3<S>, out: &mut Vec<Edge<S>>) {
        out.clear();
        let [first, second, _] = &feature.points;
        match self.form {
            Form::Cuboid { .. } | Form::Hull(_) if feature.count == 2 => out.push(Edge::new(first, second)),
            Form::Cuboid { half } => {
                for axis in 0..3 {
                    let other = Self::corner(&half, feature.index[0] ^ 1 << axis);
                    out.push(Edge::new(first, &self.outer(&other)));
                }
            }
            Form::Hull(hull) => {
                let corner = feature.index[0] as u32;
                for &p in hull.around(corner as usize) {
                    let polygon = hull.polygon(p as usize);
                    let at = polygon.iter().position(|v| *v == corner).unwrap_or(0);
                    let before = polygon[(at + polygon.len() - 1) % polygon.len()];
                    out.push(Edge::new(first, &self.outer(&hull.vertices[before as usize])));
                }
            }
            Form::Cylinder { half, .. } => {
                // from the rim point to the other cap
                let axis = self.axes[2];
                let direction = if feature.index[0] == 1 { axis } else { neg(&axis) };
                out.push(Edge { direction, ends: [*first, along(first, &direction, half + half)] });
            }
            Form::Capsule { half, .. } => {
                let axis = self.axes[2];
                let at = dot(&axis, &sub(witness, &self.center));
                let ends = [along(witness, &axis, -half - at), along(witness, &axis, half - at)];
                out.push(Edge { direction: axis, ends });
            }
            _ => {}
        }
    }

    /// Corners of a face, clockwise seen from outside.
    pub(super) fn outline(&self, face: u32, out: &mut Vec<V3<S>>) {
        out.clear();
        match self.form {
            Form::Cuboid { half } => {
                let corners = BOX_FACES[face as usize];
                out.extend(corners.iter().map(|c| self.outer(&Self::corner(&half, *c))));
            }
            Form::Cylinder { radius, half } => {
                let top = face == 0;
                for k in 0..CAP {
                    let (x, y) = CAP_CORNERS[k];
                    let y = if top { -y } else { y };
                    let local = [radius * S::lit(x), radius * S::lit(y), if top { half } else { -half }];
                    out.push(self.outer(&local));
                }
            }
            Form::Hull(hull) => {
                let corners = hull.polygon(face as usize).iter().rev();
                out.extend(corners.map(|v| self.outer(&hull.vertices[*v as usize])));
            }
            _ => {}
        }
    }
}

/// Corners of the faces of a box: upper and lower along each axis. Bit `k` is the side along axis `k`.
const BOX_FACES: [[i32; 4]; 6] = [[7, 3, 1, 5], [2, 6, 4, 0], [2, 3, 7, 6], [4, 5, 1, 0], [6, 7, 5, 4], [3, 2, 0, 1]];

/// Cosine and sine of a quarter of a right angle, and of half of one, to 15 digits. The last digits are MuJoCo's: they
/// decide between quadrilaterals of equal area.
const LONG: f64 = 0.923_879_532_511_287;
const SHORT: f64 = 0.382_683_432_365_090;
#[expect(clippy::approx_constant, reason = "MuJoCo's digits")]
const HALF: f64 = 0.707_106_781_186_548;
#[expect(clippy::approx_constant, reason = "MuJoCo's digits")]
const LESS: f64 = 0.707_106_781_186_547;
/// Corners of a cap of radius 1, counterclockwise.
const CAP_CORNERS: [(f64, f64); CAP] = [
    (1.0, 0.0),
    (LONG, SHORT),
    (HALF, HALF),
    (SHORT, LONG),
    (0.0, 1.0),
    (-SHORT, LONG),
    (-LESS, HALF),
    (-LONG, SHORT),
    (-1.0, 0.0),
    (-LONG, -SHORT),
    (-HALF, -HALF),
    (-SHORT, -LONG),
    (0.0, -1.0),
    (SHORT, -LONG),
    (LESS, -HALF),
    (LONG, -SHORT),
];
