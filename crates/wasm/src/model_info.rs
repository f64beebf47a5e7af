//! Models and tasks as JSON.

use marathon_envs::Spec;
use marathon_physics::Model;
use marathon_physics::model::GeomType;
use serde_json::{Value, json};

/// Facts of a model for pages.
pub fn model(model: &Model) -> Value {
    let actuators = model.actuators.iter().map(|actuator| {
        let [low, high] = if actuator.ctrl_limited { actuator.ctrl_range } else { [-1.0, 1.0] };
        json!({ "name": actuator.name, "low": low, "high": high })
    });
    let bodies = model.bodies.iter().map(|body| json!({ "name": body.name, "parent": body.parent, "mass": body.mass }));
    let geoms = model.geoms.iter().map(|geom| {
        json!({
            "name": geom.name, "kind": kind(geom.kind), "body": geom.body, "size": geom.size, "rgba": geom.rgba,
            "field": geom.hfield, "group": geom.group,
        })
    });
    let fields = model.hfields.iter().enumerate().map(|(i, field)| {
        let geom = model.geoms.iter().find(|geom| geom.hfield == Some(i));
        json!({
            "rows": field.nrow, "cols": field.ncol, "radius": [field.size[0], field.size[1]],
            "pos": geom.map_or([0.0; 3], |geom| geom.pos),
        })
    });
    json!({
        "nq": model.nq,
        "nv": model.nv,
        "actuators": actuators.collect::<Vec<_>>(),
        "bodies": bodies.collect::<Vec<_>>(),
        "geoms": geoms.collect::<Vec<_>>(),
        "fields": fields.collect::<Vec<_>>(),
        "timestep": model.opt.timestep,
    })
}

/// Facts of a task for pages.
pub fn spec(spec: &Spec) -> Value {
    let command = spec
        .command
        .iter()
        .map(|range| json!({ "name": range.name, "low": range.low, "high": range.high, "unit": range.unit }));
    let range = |i: usize| spec.action_range(i);
    json!({
        "id": spec.id,
        "obs": spec.obs,
        "act": spec.act,
        "action_names": spec.action_names,
        "action_low": (0..spec.act).map(|i| range(i)[0]).collect::<Vec<_>>(),
        "action_high": (0..spec.act).map(|i| range(i)[1]).collect::<Vec<_>>(),
        "dt": spec.dt,
        "frame_skip": spec.frame_skip,
        "max_episode_steps": spec.max_episode_steps,
        "reward_terms": spec.reward_terms,
        "info": spec.info,
        "command": command.collect::<Vec<_>>(),
        "nq": spec.nq,
        "nv": spec.nv,
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
