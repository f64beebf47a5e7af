//! A half-space and a convex hull.

use super::super::{Plane, V3};
use super::clip::quadrilateral;
use super::manifold::Contact;
use super::polyhedron::Polyhedron;
use super::support::Solid;
use super::vector::*;

/// Finds the contacts of a plane and a hull: the lowest corner, and up to three others of the polygon around it that
/// faces the plane. Corners above the hull's center are left out.
pub(super) fn plane_hull<S: Number>(
    plane: &Plane<S>,
    solid: &Solid<S>,
    hull: &Polyhedron<S>,
    margin: S,
    corners: &mut Vec<V3<S>>,
    mut add: impl FnMut(Contact<S>),
) {
    let normal = plane.normal;
    let mut touch = |local: &V3<S>, first: bool| -> bool {
        let point = solid.outer(local);
        let dist = dot(&normal, &sub(&point, &plane.point));
        if margin < dist || (!first && S::zero() < dot(&normal, &sub(&point, &solid.center))) {
            return false;
        }
        add(Contact { dist, pos: along(&point, &normal, dist * S::lit(-0.5)), normal });
        true
    };
    let down = into_local(&solid.axes, &neg(&normal));
    let lowest = hull.farthest(&down, None);
    if !touch(&hull.vertices[lowest], true) {
        return;
    }
    let (mut facing, mut least) = (None, S::lit(1.0));
    for &p in hull.around(lowest) {
        let cos = -dot(&down, &hull.normals[p as usize]);
        if cos < least {
            (facing, least) = (Some(p), cos);
        }
    }
    let Some(polygon) = facing.map(|p| hull.polygon(p as usize)) else { return };
    corners.clear();
    corners.extend(polygon.iter().map(|v| hull.vertices[*v as usize]));
    let start = polygon.iter().position(|v| *v as usize == lowest).unwrap_or(0);
    let n = corners.len();
    let chosen = if n > 4 { quadrilateral(corners, start, 1) } else { [0, 1, 2, 3].map(|k| (start + k) % n) };
    for &i in &chosen[1..n.min(4)] {
        touch(&corners[i], false);
    }
}
