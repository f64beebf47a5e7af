//! The paths of spatial tendons: read, checked, and measured in the reference configuration.

use super::document::Element;
use super::error::MjcfError;
use super::math::{add, axes, dot, norm, scale, sub};
use super::names::Registry;
use super::pose::{Pose, motion};
use super::room::Room;
use super::value::numbers;
use crate::geometry::wrap::{unit3, wrap};
use crate::model::{GeomType, Model, PathPart, PathSpan, TendonKind, Vec3};
use std::collections::BTreeMap;

/// Memory of the kernels for a degree of freedom that one end of a span moves with.
const LEVER: usize = 32;

/// Reads the path of a spatial tendon. `heavy`: whether the tendon has armature.
pub(crate) fn read(
    element: &Element,
    names: &Registry,
    model: &Model,
    heavy: bool,
    room: &Room,
) -> Result<TendonKind, MjcfError> {
    let mut path = Vec::with_capacity(element.children.len());
    for part in &element.children {
        path.push(match part.name.as_str() {
            "site" => PathPart::Site(names.sites.required(part, "site")?),
            "geom" => wrapped(part, names, model)?,
            _ => pulley(part)?,
        });
    }
    for (i, part) in element.children.iter().enumerate() {
        let before = i.checked_sub(1).map(|i| &path[i]);
        check(part, before, &path[i], path.get(i + 1), heavy)?;
    }
    if path.len() < 2 {
        return Err(element.invalid("the path of a spatial tendon needs at least two parts"));
    }
    let kind = TendonKind::Spatial(path);
    for span in kind.spans() {
        let bodies = span.sites.map(|s| model.sites[s].body);
        let dofs: usize = bodies.iter().map(|b| model.dofs_of_body(*b).len()).sum();
        let geom = span.wrap.map_or(0, |(g, _)| 2 * model.dofs_of_body(model.geoms[g].body).len() + dofs);
        room.take_for(element, dofs + geom + 16, LEVER)?;
    }
    Ok(kind)
}

/// A geom to wrap around.
fn wrapped(part: &Element, names: &Registry, model: &Model) -> Result<PathPart, MjcfError> {
    let geom = names.geoms.required(part, "geom")?;
    if !matches!(model.geoms[geom].kind, GeomType::Sphere | GeomType::Cylinder) {
        let name = &model.geoms[geom].name;
        return Err(part.invalid(format!("the geom '{name}' is neither a sphere nor a cylinder")));
    }
    let given = part.text("sidesite").is_some_and(|s| !s.is_empty());
    let side = if given { Some(names.sites.required(part, "sidesite")?) } else { None };
    Ok(PathPart::Geom { geom, side })
}

fn pulley(part: &Element) -> Result<PathPart, MjcfError> {
    let Some(attr) = part.attr("divisor") else {
        return Err(part.invalid("the attribute 'divisor' is missing"));
    };
    let divisor = numbers(part, attr, 1, 1)?[0];
    if !(divisor > 0.0) {
        return Err(part.bad_value(attr, "a positive number"));
    }
    Ok(PathPart::Pulley { divisor })
}

/// MuJoCo's rules for the neighbors of a part.
fn check(
    element: &Element,
    before: Option<&PathPart>,
    part: &PathPart,
    after: Option<&PathPart>,
    heavy: bool,
) -> Result<(), MjcfError> {
    let is_pulley = |p: Option<&PathPart>| matches!(p, Some(PathPart::Pulley { .. }));
    let is_site = |p: Option<&PathPart>| matches!(p, Some(PathPart::Site(_)));
    match part {
        PathPart::Pulley { .. } if is_pulley(before) => Err(element.invalid("a pulley follows another pulley")),
        PathPart::Pulley { .. } if after.is_none() => Err(element.invalid("the path ends with a pulley")),
        PathPart::Site(_) if (before.is_none() || is_pulley(before)) && (after.is_none() || is_pulley(after)) => {
            Err(element.invalid("a site needs a neighbor that is not a pulley"))
        }
        PathPart::Site(site) if after == Some(&PathPart::Site(*site)) => {
            Err(element.invalid("the next site of the path is the same"))
        }
        PathPart::Geom { .. } if !is_site(before) || !is_site(after) => {
            Err(element.invalid("a geom of the path needs a site before it and one after it"))
        }
        PathPart::Geom { .. } if heavy => Err(element.invalid("a tendon with armature cannot wrap around a geom")),
        _ => Ok(()),
    }
}

/// A point of a body, in the world.
type Point = (usize, Vec3);

/// The straight pieces of a span, and its length before it is divided.
fn pieces(model: &Model, pose: &Pose, span: &PathSpan) -> (Vec<[Point; 2]>, f64) {
    let site = |s: usize| (model.sites[s].body, pose.body[model.sites[s].body].point(model.site_frame(s).0));
    let ends = span.sites.map(site);
    let distance = |a: &Point, b: &Point| norm(sub(b.1, a.1));
    if let Some((geom, side)) = span.wrap {
        let body = model.geoms[geom].body;
        let (pos, quat) = model.geom_frame(geom);
        let frame = pose.body[body].compose(&super::math::Frame { pos, quat });
        let from_center = |p: Vec3| sub(p, frame.pos);
        let side = side.map(|s| from_center(site(s).1));
        let (radius, cylinder) = (model.geoms[geom].size[0], model.geoms[geom].kind == GeomType::Cylinder);
        let found = wrap(&ends.map(|e| from_center(e.1)), &axes(frame.quat), radius, cylinder, side.as_ref());
        if found.on {
            let [first, last] = found.points.map(|p| (body, add(p, frame.pos)));
            let length = distance(&ends[0], &first) + found.length + distance(&last, &ends[1]);
            return (vec![[ends[0], first], [last, ends[1]]], length);
        }
    }
    (vec![ends], distance(&ends[0], &ends[1]))
}

/// Length of a spatial tendon.
pub(crate) fn length(model: &Model, pose: &Pose, kind: &TendonKind) -> f64 {
    kind.spans().iter().map(|span| pieces(model, pose, span).1 / span.divisor).sum()
}

/// Moment arms of a spatial tendon, as `(dof, arm)`, for every dof that moves one part of the path against another.
pub(crate) fn moments(model: &Model, pose: &Pose, kind: &TendonKind) -> Vec<(usize, f64)> {
    let mut arms: BTreeMap<usize, f64> = BTreeMap::new();
    for span in kind.spans() {
        for [from, to] in pieces(model, pose, &span).0 {
            let along = scale(unit3(&sub(to.1, from.1)), 1.0 / span.divisor);
            let [first, last] = model.dofs_between([from.0, to.0]);
            for (dofs, point, sign) in [(first, from.1, -1.0), (last, to.1, 1.0)] {
                for dof in dofs {
                    let arm = dot(motion(model, pose, dof, point).linear, along);
                    *arms.entry(dof).or_default() += sign * arm;
                }
            }
        }
    }
    arms.into_iter().collect()
}
