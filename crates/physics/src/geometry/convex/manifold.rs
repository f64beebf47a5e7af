//! Several contacts of one pair: the faces or edges at the closest points, clipped against each other.

use super::super::{TINY, V3};
use super::clip::{clip, quadrilateral};
use super::feature::{EDGE_TOLERANCE, Edge, FACE_TOLERANCE, Face, Feature};
use super::gjk::Vertex;
use super::support::{Form, Solid};
use super::vector::*;

/// A contact of two shapes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact<S> {
    pub dist: S,
    pub pos: V3<S>,
    /// From the first shape to the second.
    pub normal: V3<S>,
}

/// Memory that is kept between calls.
#[derive(Clone, Debug, Default)]
pub(super) struct Polygons<S> {
    faces: [Vec<Face<S>>; 2],
    edges: Vec<Edge<S>>,
    reference: Vec<V3<S>>,
    pub(super) polygon: Vec<V3<S>>,
    clipped: Vec<V3<S>>,
}

impl<S: Number> Polygons<S> {
    pub(super) fn new() -> Self {
        let faces = [Vec::new(), Vec::new()];
        Polygons { faces, edges: Vec::new(), reference: Vec::new(), polygon: Vec::new(), clipped: Vec::new() }
    }

    /// Finds the contacts of two shapes from a face of their difference and its points on the shapes. Returns false if
    /// there is only the contact at those points.
    pub(super) fn contacts(
        &mut self,
        solids: [&Solid<S>; 2],
        vertices: &[Vertex<S>; 3],
        witness: &[V3<S>; 2],
        margin: S,
        mut add: impl FnMut(Contact<S>),
    ) -> bool {
        let [a, b] = solids;
        let features = [Feature::new(vertices, 0), Feature::new(vertices, 1)];
        let outward = sub(&witness[0], &witness[1]);
        a.faces(&features[0], &outward, &mut self.faces[0]);
        b.faces(&features[1], &neg(&outward), &mut self.faces[1]);
        if let Some((first, second)) = self.opposed(&outward) {
            a.outline(first.1, &mut self.reference);
            b.outline(second.1, &mut self.polygon);
            return self.cut(&first.0, &second.0, &neg(&second.0), false, margin, &mut add);
        }
        let [few, many] = [features[0].count, features[1].count];
        if few < 3 && !self.faces[1].is_empty() && (few <= many || self.faces[0].is_empty()) {
            a.edges(&features[0], &witness[0], &mut self.edges);
            if let Some((edge, face)) = self.edge_on_face(1, &neg(&outward)) {
                b.outline(face.1, &mut self.reference);
                self.take_edge(&edge);
                if matches!(a.form, Form::Capsule { .. }) {
                    for end in &mut self.polygon {
                        *end = along(end, &face.0, S::lit(0.5) * margin);
                    }
                }
                return self.cut(&face.0, &neg(&face.0), &neg(&face.0), true, margin, &mut add);
            }
        }
        if many < 3 {
            b.edges(&features[1], &witness[1], &mut self.edges);
            if let Some((edge, face)) = self.edge_on_face(0, &outward) {
                a.outline(face.1, &mut self.reference);
                self.take_edge(&edge);
                return self.cut(&face.0, &neg(&face.0), &face.0, true, margin, &mut add);
            }
        }
        false
    }

    /// The faces that are opposed most, among those that face the contact.
    fn opposed(&self, outward: &V3<S>) -> Option<(Face<S>, Face<S>)> {
        let least = S::lit(EDGE_TOLERANCE) * norm(outward);
        let mut most = S::lit(-FACE_TOLERANCE);
        let mut found = None;
        for first in &self.faces[0] {
            if !(least < dot(&first.0, outward)) {
                continue;
            }
            for second in &self.faces[1] {
                let cos = dot(&first.0, &second.0);
                if cos < most && dot(&second.0, outward) < -least {
                    most = cos;
                    found = Some((*first, *second));
                }
            }
        }
        found
    }

    /// The first edge that is parallel to a face of shape `side` that faces `outward`.
    fn edge_on_face(&self, side: usize, outward: &V3<S>) -> Option<(Edge<S>, Face<S>)> {
        for face in &self.faces[side] {
            if !(S::lit(TINY) < dot(&face.0, outward)) {
                continue;
            }
            let parallel = |e: &&Edge<S>| dot(&e.direction, &face.0).abs() < S::lit(EDGE_TOLERANCE);
            if let Some(edge) = self.edges.iter().find(parallel) {
                return Some((*edge, *face));
            }
        }
        None
    }

    fn take_edge(&mut self, edge: &Edge<S>) {
        self.polygon.clear();
        self.polygon.extend(edge.ends);
    }

    /// Clips the polygon against the reference face with normal `face`. A contact's distance is measured along `-across`
    /// from the point to its projection on the face. Returns whether a point is left.
    fn cut(
        &mut self,
        face: &V3<S>,
        across: &V3<S>,
        normal: &V3<S>,
        edge: bool,
        margin: S,
        add: &mut impl FnMut(Contact<S>),
    ) -> bool {
        clip(&self.reference, face, &mut self.polygon, &mut self.clipped);
        let corner = self.reference[0];
        self.polygon.retain(|p| !(margin < dot(&sub(p, &corner), face)));
        let points = &self.polygon;
        let chosen: &[usize] = match points.len() {
            0 => return false,
            n if edge && n > 2 => &farthest(points),
            n if n > 4 => &quadrilateral(points, 0, n),
            n => &[0, 1, 2, 3][..n],
        };
        for &i in chosen {
            let p = &points[i];
            let foot = along(p, face, -dot(&sub(p, &corner), face));
            let dist = dot(&sub(&foot, p), across);
            let other = along(&foot, across, -dist);
            add(Contact { dist, pos: middle(&foot, &other), normal: *normal });
        }
        true
    }
}

/// The two points that are farthest apart.
fn farthest<S: Number>(points: &[V3<S>]) -> [usize; 2] {
    let (mut found, mut most) = ([0, 1], S::zero());
    for i in 0..points.len() {
        for j in i + 1..points.len() {
            let d = sub(&points[j], &points[i]);
            if most < dot(&d, &d) {
                (found, most) = ([i, j], dot(&d, &d));
            }
        }
    }
    found
}
