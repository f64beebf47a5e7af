//! Facts of a model as JSON.

use marathon_physics::Model;
use marathon_physics::model::GeomType;
use serde_json::{Value, json};

/// Facts of a model for pages: bodies, geoms, actuators and height fields, in SI units.
pub fn facts(model: &Model) -> Value {
    let actuators = model.actuators.iter().map(|actuator| {
        let [low, high] = if actuator.ctrl_limited { actuator.ctrl_range } else { [-1.0, 1.0] };
        json!({ "name": actuator.name, "low": low, "high": high })
    });
    let bodies = model.bodies.iter().map(|body| json!({ "name": body.name, "parent": body.parent, "mass": body.mass }));
    let geoms = model.geoms.iter().map(|geom| {
        json!({
            "name": geom.name, "kind": kind(geom.kind), "body": geom.body, "size": geom.size, "rgba": geom.rgba,
            "field": geom.hfield, "mesh": geom.mesh, "group": geom.group,
        })
    });
    let fields = model.hfields.iter().enumerate().map(|(i, field)| {
        let geom = model.geoms.iter().find(|geom| geom.hfield == Some(i));
        json!({
            "rows": field.nrow, "cols": field.ncol, "radius": [field.size[0], field.size[1]],
            "pos": geom.map_or([0.0; 3], |geom| geom.pos),
        })
    });
    let meshes = model.meshes.iter().map(|mesh| json!({ "vertices": mesh.vertices.len(), "faces": mesh.faces.len() }));
    json!({
        "nq": model.nq,
        "nv": model.nv,
        "actuators": actuators.collect::<Vec<_>>(),
        "bodies": bodies.collect::<Vec<_>>(),
        "geoms": geoms.collect::<Vec<_>>(),
        "fields": fields.collect::<Vec<_>>(),
        "meshes": meshes.collect::<Vec<_>>(),
        "timestep": model.opt.timestep,
    })
}

/// MJCF's name of a shape.
fn kind(kind: GeomType) -> &'static str {
    match kind {
        GeomType::Plane => "plane",
        GeomType::Hfield => "hfield",
        GeomType::Sphere => "sphere",
        GeomType::Capsule => "capsule",
        GeomType::Ellipsoid => "ellipsoid",
        GeomType::Cylinder => "cylinder",
        GeomType::Box => "box",
        GeomType::Mesh => "mesh",
    }
}
