//! Convex hulls of meshes.

use super::Vec3;
use serde::{Deserialize, Serialize};

/// A convex polyhedron: the hull of a mesh, in the frame of the geoms that use it.
///
/// Coplanar triangles form one polygon, as in MuJoCo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hull {
    /// Corners in meters, each exactly a 32-bit number, as in MuJoCo.
    pub vertices: Vec<Vec3>,
    /// Indices of the corners of each face, counterclockwise from outside.
    pub polygons: Vec<Vec<u32>>,
    /// Unit normal of each polygon, out of the solid.
    pub normals: Vec<Vec3>,
    /// Polygons around each corner, in rising order.
    pub around: Vec<Vec<u32>>,
    /// Corners that share an edge of the triangulated hull with each corner.
    pub neighbors: Vec<Vec<u32>>,
}

impl Hull {
    /// A hull of these corners and faces. `edges` are further neighbors: the diagonals of a triangulation.
    pub(crate) fn new(vertices: Vec<Vec3>, polygons: Vec<Vec<u32>>, normals: Vec<Vec3>, edges: &[[u32; 2]]) -> Hull {
        let mut around = vec![Vec::new(); vertices.len()];
        let mut neighbors = vec![Vec::new(); vertices.len()];
        for (p, polygon) in polygons.iter().enumerate() {
            for (i, &a) in polygon.iter().enumerate() {
                around[a as usize].push(p as u32);
                let b = polygon[(i + 1) % polygon.len()];
                neighbors[a as usize].push(b);
                neighbors[b as usize].push(a);
            }
        }
        for &[a, b] in edges {
            neighbors[a as usize].push(b);
            neighbors[b as usize].push(a);
        }
        for list in &mut neighbors {
            list.sort_unstable();
            list.dedup();
        }
        Hull { vertices, polygons, normals, around, neighbors }
    }
}
