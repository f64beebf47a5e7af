//! The convex hull of points: quickhull with exact tests of sides.
//!
//! The point farthest from the hull so far is added until none is outside. Source: C. Barber, D. Dobkin, H. Huhdanpaa, "The Quickhull
//! algorithm for convex hulls", 1996. A point in the plane of a face is not outside, so the hull stays a closed surface
//! whatever the points are.

use super::grid::{Grid, Plane};
use crate::model::Vec3;
use crate::model::vector::{MIN_VAL, cross, dot, norm, sub};
use std::collections::BinaryHeap;

const NONE: u32 = u32::MAX;
/// Most tests of a point against a face: about a second.
const MOST_WORK: u64 = 300_000_000;
/// Most corners.
const MOST_CORNERS: usize = 1 << 16;

struct Face {
    corners: [u32; 3],
    /// Face beyond the edge from each corner to the next.
    beyond: [u32; 3],
    plane: Plane,
    /// First point outside; [`Hull::next`] has the others.
    outside: u32,
    farthest: u32,
    distance: f64,
    alive: bool,
    /// Mark of the search for faces that see a point.
    seen: u32,
}

/// A face with points outside, by the distance of the farthest one.
#[derive(PartialEq)]
struct Candidate {
    distance: f64,
    face: u32,
    farthest: u32,
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.distance.total_cmp(&other.distance).then(other.face.cmp(&self.face))
    }
}

/// An edge of the faces that see a point, and the face beyond it.
#[derive(Clone, Copy)]
struct Horizon {
    from: u32,
    to: u32,
    beyond: u32,
}

struct Hull<'a> {
    grid: &'a Grid,
    faces: Vec<Face>,
    /// Places of faces that are gone.
    free: Vec<u32>,
    /// Next point outside of the same face.
    next: Vec<u32>,
    candidates: BinaryHeap<Candidate>,
    /// New face that starts at a point of the horizon.
    starts: Vec<u32>,
    mark: u32,
    work: u64,
}

/// Triangles of the convex hull, counterclockwise from outside. Some of their corners may lie inside a flat side; [`super::polygons`]
/// leaves these out. `most`: number of points after which the search ends.
///
/// # Errors
/// The points have no hull of positive volume, or the search takes too long.
pub(super) fn triangles(vertices: &[[f32; 3]], grid: &Grid, most: Option<usize>) -> Result<Vec<[u32; 3]>, String> {
    check_extent(vertices)?;
    let mut hull = Hull {
        grid,
        faces: Vec::new(),
        free: Vec::new(),
        next: vec![NONE; grid.len()],
        candidates: BinaryHeap::new(),
        starts: vec![NONE; grid.len()],
        mark: 0,
        work: 0,
    };
    hull.begin()?;
    let mut points = 4;
    while most.is_none_or(|most| points < most) {
        let Some(face) = hull.farthest() else { break };
        hull.add(face)?;
        points += 1;
        if points > MOST_CORNERS {
            return Err(format!("its convex hull has more than {MOST_CORNERS} corners; limit them with maxhullvert"));
        }
    }
    Ok(hull.faces.iter().filter(|f| f.alive).map(|f| f.corners).collect())
}

/// Refuses points that are the same, on a line or in a plane, as MuJoCo does.
fn check_extent(vertices: &[[f32; 3]]) -> Result<(), String> {
    let at = |i: usize| vertices[i].map(f64::from);
    let first = at(0);
    let vectors = || (1..vertices.len()).map(|i| sub(at(i), first));
    let Some(edge) = vectors().find(|v| norm(*v) > MIN_VAL) else {
        return Err(flat("all vertices are the same point; use a small sphere"));
    };
    let long = norm(edge);
    let normal = |v: Vec3| Some(cross(edge, v)).filter(|n| norm(*n) > MIN_VAL * long * norm(v));
    let Some(normal) = vectors().filter(|v| norm(*v) >= MIN_VAL).find_map(normal) else {
        return Err(flat("all vertices are on one line; use a thin capsule"));
    };
    let normal = normal.map(|x| x / norm(normal));
    if vectors().all(|v| dot(normal, v).abs() <= MIN_VAL * long) { Err(in_plane()) } else { Ok(()) }
}

fn flat(what: &str) -> String {
    format!("it has no convex hull: {what}")
}

fn in_plane() -> String {
    flat("all vertices are in one plane; use a plane or a thin box")
}

impl Hull<'_> {
    /// The first tetrahedron: extreme points that span much.
    fn begin(&mut self) -> Result<(), String> {
        let grid = self.grid;
        let all = || 0..grid.len() as u32;
        let extremes: Vec<[u32; 2]> = (0..3)
            .filter_map(|k| {
                let low = all().min_by_key(|p| grid.coordinate(*p, k))?;
                let high = all().rev().max_by_key(|p| grid.coordinate(*p, k))?;
                (grid.coordinate(low, k) < grid.coordinate(high, k)).then_some([low, high])
            })
            .collect();
        let Some(&[a, b]) = extremes.first() else { return Err(in_plane()) };
        let few = || extremes.iter().flatten().copied();
        let area = |p: &u32| grid.area([a, b, *p]);
        let best = few().max_by(|p, q| area(p).total_cmp(&area(q))).filter(|p| area(p) > 0.0);
        let c = best.or_else(|| all().max_by(|p, q| area(p).total_cmp(&area(q))).filter(|p| area(p) > 0.0));
        let Some(c) = c else { return Err(in_plane()) };
        let volume = |p: &u32| grid.volume([a, b, c], *p).unsigned_abs();
        let best = few().max_by_key(volume).filter(|p| volume(p) > 0);
        let Some(d) = best.or_else(|| all().max_by_key(volume).filter(|p| volume(p) > 0)) else {
            return Err(in_plane());
        };
        // the fourth point is behind the first face
        let (b, c) = if grid.volume([a, b, c], d) > 0 { (c, b) } else { (b, c) };
        for (corners, beyond) in
            [([a, b, c], [1, 2, 3]), ([b, a, d], [0, 3, 2]), ([c, b, d], [0, 1, 3]), ([a, c, d], [0, 2, 1])]
        {
            self.face(corners, beyond);
        }
        let points: Vec<u32> = all().filter(|p| ![a, b, c, d].contains(p)).collect();
        self.share(&points, &[0, 1, 2, 3])
    }

    fn face(&mut self, corners: [u32; 3], beyond: [u32; 3]) -> u32 {
        let plane = self.grid.plane(corners);
        let (outside, farthest, distance) = (NONE, NONE, 0.0);
        let face = Face { corners, beyond, plane, outside, farthest, distance, alive: true, seen: 0 };
        if let Some(place) = self.free.pop() {
            self.faces[place as usize] = face;
            return place;
        }
        self.faces.push(face);
        self.faces.len() as u32 - 1
    }

    /// Gives each point to a face that it is outside of; the others are inside the hull.
    fn share(&mut self, points: &[u32], faces: &[u32]) -> Result<(), String> {
        for &point in points {
            for &index in faces {
                self.work += 1;
                let face = &mut self.faces[index as usize];
                let distance = self.grid.distance(&face.plane, point);
                if distance > 0.0 {
                    self.next[point as usize] = face.outside;
                    face.outside = point;
                    if distance > face.distance {
                        (face.distance, face.farthest) = (distance, point);
                    }
                    break;
                }
            }
            if self.work > MOST_WORK {
                return Err("its convex hull takes too long to find; simplify the mesh".to_owned());
            }
        }
        for &face in faces {
            let Face { distance, farthest, .. } = self.faces[face as usize];
            if distance > 0.0 {
                self.candidates.push(Candidate { distance, face, farthest });
            }
        }
        Ok(())
    }

    /// The face with the point that is farthest outside.
    fn farthest(&mut self) -> Option<u32> {
        while let Some(Candidate { face, farthest, .. }) = self.candidates.pop() {
            let current = &self.faces[face as usize];
            if current.alive && current.farthest == farthest {
                return Some(face);
            }
        }
        None
    }

    /// Replaces all faces that see the farthest point of a face by faces from the horizon to that point.
    fn add(&mut self, first: u32) -> Result<(), String> {
        let point = self.faces[first as usize].farthest;
        let (visible, horizon) = self.visible(first, point);
        let mut points = Vec::new();
        for &index in &visible {
            let face = &mut self.faces[index as usize];
            face.alive = false;
            let mut p = face.outside;
            while p != NONE {
                if p != point {
                    points.push(p);
                }
                p = self.next[p as usize];
            }
        }
        self.free.extend(&visible);
        let mut made = Vec::with_capacity(horizon.len());
        for edge in &horizon {
            let index = self.face([edge.from, edge.to, point], [edge.beyond, NONE, NONE]);
            self.starts[edge.from as usize] = index;
            let beyond = &mut self.faces[edge.beyond as usize];
            if let Some(k) = (0..3).find(|k| beyond.corners[*k] == edge.to) {
                beyond.beyond[k] = index;
            }
            made.push(index);
        }
        for (edge, &index) in horizon.iter().zip(&made) {
            let following = self.starts[edge.to as usize];
            self.faces[index as usize].beyond[1] = following;
            self.faces[following as usize].beyond[2] = index;
        }
        self.share(&points, &made)
    }

    /// Faces that see a point, and the edges around them.
    fn visible(&mut self, first: u32, point: u32) -> (Vec<u32>, Vec<Horizon>) {
        self.mark += 1;
        self.faces[first as usize].seen = self.mark;
        let (mut visible, mut horizon) = (vec![first], Vec::new());
        let mut at = 0;
        while let Some(&index) = visible.get(at) {
            at += 1;
            let Face { corners, beyond, .. } = self.faces[index as usize];
            for k in 0..3 {
                let other = &mut self.faces[beyond[k] as usize];
                if other.seen == self.mark {
                    continue;
                }
                self.work += 1;
                if self.grid.distance(&other.plane, point) > 0.0 {
                    other.seen = self.mark;
                    visible.push(beyond[k]);
                } else {
                    horizon.push(Horizon { from: corners[k], to: corners[(k + 1) % 3], beyond: beyond[k] });
                }
            }
        }
        (visible, horizon)
    }
}
