//! From a hull's triangles to its flat sides.
//!
//! Triangles in exactly one plane are one facet, and corners inside a facet or on an edge of two are left out, as Qhull does.
//! Facets side by side whose normals fall into one cell of a grid of angles are one polygon, as in MuJoCo.

use super::grid::Grid;
use super::{Triangles, hull};
use crate::model::vector::{add, cross, norm, sub};
use crate::model::{Hull, Vec3};
use std::collections::HashMap;
use std::f64::consts::PI;

/// Width of a cell of the grid of angles, rad.
const CELL: f64 = 0.01;

/// The convex hull of a mesh, over the numbers of its vertices.
#[derive(Clone, Debug)]
pub(crate) struct Skin {
    /// Triangles, counterclockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Flat sides, counterclockwise from outside.
    polygons: Vec<Vec<u32>>,
}

impl Skin {
    /// The hull of a mesh in the file's frame. `most`: the largest number of vertices.
    ///
    /// # Errors
    /// The vertices have no hull of positive volume, or it takes too long to find.
    pub fn new(mesh: &Triangles, most: Option<usize>) -> Result<Skin, String> {
        let vertices = &mesh.vertices;
        let grid = Grid::new(vertices);
        let facets = facets(&grid, &hull::triangles(vertices, &grid, most)?);
        let fan = |f: &Vec<u32>| (1..f.len() - 1).map(|i| [f[0], f[i], f[i + 1]]).collect::<Vec<_>>();
        let triangles = facets.iter().flat_map(fan).collect();
        let at = |v: u32| vertices[v as usize].map(f64::from);
        let cells: Vec<[i32; 2]> = facets.iter().map(|f| cell(normal(f, at))).collect();
        let polygons = islands(&facets, |a, b| cells[a] == cells[b]);
        Ok(Skin { triangles, polygons })
    }

    /// The hull in the frame of the geoms that use it. `vertices`: all vertices of the mesh in that frame.
    pub fn hull(&self, vertices: &[Vec3], mirrored: bool) -> Hull {
        let mut used: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let number: HashMap<u32, u32> = used.iter().enumerate().map(|(i, v)| (*v, i as u32)).collect();
        let renamed = |v: &u32| number[v];
        let mut polygons: Vec<Vec<u32>> = self.polygons.iter().map(|p| p.iter().map(renamed).collect()).collect();
        if mirrored {
            polygons.iter_mut().for_each(|p| p.reverse());
        }
        let corners: Vec<Vec3> = used.iter().map(|v| vertices[*v as usize]).collect();
        let normals = polygons.iter().map(|p| normal(p, |v| corners[v as usize])).collect();
        let edges: Vec<[u32; 2]> = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|e| e.map(|v| number[&v]))
            .collect();
        // MuJoCo keeps vertices in single precision
        Hull::new(corners.iter().map(|v| v.map(|x| f64::from(x as f32))).collect(), polygons, normals, &edges)
    }
}

/// Unit normal of a polygon: the sum of the areas that its edges span with its first corner (Newell's method).
fn normal(polygon: &[u32], at: impl Fn(u32) -> Vec3) -> Vec3 {
    let first = at(polygon[0]);
    let mut sum = [0.0; 3];
    for pair in polygon[1..].windows(2) {
        sum = add(sum, cross(sub(at(pair[0]), first), sub(at(pair[1]), first)));
    }
    let length = norm(sum);
    sum.map(|x| x / length)
}

/// Cell of a unit normal in the grid of azimuth and polar angle.
fn cell(normal: Vec3) -> [i32; 2] {
    let round = |angle: f64| libm::round(angle / CELL) as i32;
    // adding zero removes the sign of a zero, on which the angle depends
    let [x, y, z] = normal.map(|x| x + 0.0);
    if z.abs() > 1.0 - 1e-7 {
        return [0, if z < 0.0 { round(PI) } else { 0 }];
    }
    [round(libm::atan2(y, x)), round(libm::acos(z))]
}

/// Facets of a hull: its triangles joined where they are in exactly one plane, without corners that are not extreme.
fn facets(grid: &Grid, triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let corners: Vec<Vec<u32>> = triangles.iter().map(|t| t.to_vec()).collect();
    let in_plane = |a: usize, b: usize| triangles[b].iter().all(|&v| grid.volume(triangles[a], v) == 0);
    let mut facets = islands(&corners, in_plane);
    // extreme points belong to three facets or more
    let mut count = vec![0u8; grid.len()];
    for &corner in facets.iter().flatten() {
        count[corner as usize] = count[corner as usize].saturating_add(1);
    }
    for facet in &mut facets {
        facet.retain(|v| count[*v as usize] > 2);
    }
    facets
}

/// Joins neighbors for which `alike` holds, and returns the outlines of the unions. The polygons form a closed surface. A union
/// with more than one outline stays in parts.
fn islands(polygons: &[Vec<u32>], alike: impl Fn(usize, usize) -> bool) -> Vec<Vec<u32>> {
    let owners = Owners::new(polygons);
    let neighbor = |[a, b]: [u32; 2]| owners.of([b, a]);
    let mut island = vec![usize::MAX; polygons.len()];
    let mut members: Vec<Vec<usize>> = Vec::new();
    for start in 0..polygons.len() {
        if island[start] != usize::MAX {
            continue;
        }
        island[start] = members.len();
        let mut list = vec![start];
        let mut at = 0;
        while let Some(&i) = list.get(at) {
            at += 1;
            for j in edges(&polygons[i]).filter_map(neighbor) {
                if island[j] == usize::MAX && alike(i, j) {
                    island[j] = members.len();
                    list.push(j);
                }
            }
        }
        members.push(list);
    }
    let mut outlines = Vec::new();
    for list in members {
        let inner = |edge: &[u32; 2]| neighbor(*edge).is_some_and(|j| island[j] == island[list[0]]);
        let rim = list.iter().flat_map(|i| edges(&polygons[*i])).filter(|edge| !inner(edge));
        match outline(rim.collect()) {
            Some(outline) if list.len() > 1 => outlines.push(outline),
            _ => outlines.extend(list.iter().map(|i| polygons[*i].clone())),
        }
    }
    outlines
}

/// The polygon of each directed edge of a closed surface.
struct Owners {
    /// Edges in rising order of their first point, then of their second one.
    edges: Vec<([u32; 2], usize)>,
    /// First edge from each point.
    starts: Vec<usize>,
}

impl Owners {
    fn new(polygons: &[Vec<u32>]) -> Owners {
        let points = polygons.iter().flatten().max().map_or(0, |v| *v as usize + 1);
        let mut list: Vec<([u32; 2], usize)> =
            polygons.iter().enumerate().flat_map(|(i, polygon)| edges(polygon).map(move |edge| (edge, i))).collect();
        list.sort_unstable();
        let mut starts = vec![0; points + 1];
        for ([from, _], _) in &list {
            starts[*from as usize + 1] += 1;
        }
        for i in 0..points {
            starts[i + 1] += starts[i];
        }
        Owners { edges: list, starts }
    }

    fn of(&self, edge: [u32; 2]) -> Option<usize> {
        let from = edge[0] as usize;
        let edges = &self.edges[self.starts[from]..self.starts[from + 1]];
        edges.binary_search_by_key(&edge[1], |(edge, _)| edge[1]).ok().map(|i| edges[i].1)
    }
}

fn edges(polygon: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..polygon.len()).map(|i| [polygon[i], polygon[(i + 1) % polygon.len()]])
}

/// The closed path over all edges, if they are one path that meets no point twice.
fn outline(rim: Vec<[u32; 2]>) -> Option<Vec<u32>> {
    let first = rim.first()?[0];
    let next: HashMap<u32, u32> = rim.iter().map(|[a, b]| (*a, *b)).collect();
    let mut path = vec![first];
    let mut at = *next.get(&first)?;
    while at != first && path.len() < rim.len() {
        path.push(at);
        at = *next.get(&at)?;
    }
    (at == first && path.len() == rim.len()).then_some(path)
}
