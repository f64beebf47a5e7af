//! Mapping files: assignment of skeleton joints to bodies of a model.
//!
//! | entry | meaning |
//! |---|---|
//! | `mapping` | version of the format, 1 |
//! | `model` | name of the model |
//! | `hips` | the bodies of the left and the right thigh, in this order: they define the character's front and the length of its legs |
//! | `soles` | bodies that stand: they do not slide while they touch the ground |
//! | `smooth` | factor on the smoothing of the result and on the laws of its center of mass and its balance; default 1, 0 for recordings that are already smooth |
//! | `parts` | by name of a body, geom or site of the model: the joint that it follows |
//!
//! A part has:
//!
//! | entry | meaning |
//! |---|---|
//! | `joint` | joint of the skeleton: its own name, or a general name that matches many skeletons, such as `left_hip` |
//! | `toward`, `share` | a second joint, and the fraction from the first to the second at which the part's orientation lies, 0 to 1 |
//! | `rotation` | weight of its orientation, 1/rad; default 1; geoms and sites have none |
//! | `position` | weight of its position, 1/m; default 0 |
//! | `rest` | `[w, x, y, z]`, a rotation of the part's reference orientation, in the model's axes, that matches the skeleton's rest pose. By default, the part is rotated so that the bone to the next part points as in the skeleton |

use crate::error::MotionError;
use crate::limits;
use crate::roles;
use crate::skeleton::Skeleton;
use marathon_physics::Model;
use marathon_physics::hint::{did_you_mean, nearest};
use marathon_physics::model::JointType;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    mapping: u64,
    model: String,
    hips: [String; 2],
    #[serde(default)]
    soles: Vec<String>,
    #[serde(default)]
    smooth: Option<f64>,
    parts: BTreeMap<String, Row>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    joint: String,
    #[serde(default)]
    toward: Option<String>,
    #[serde(default)]
    share: Option<f64>,
    #[serde(default)]
    rotation: Option<f64>,
    #[serde(default)]
    position: Option<f64>,
    #[serde(default)]
    rest: Option<[f64; 4]>,
}

/// A part of the model and the joint that it follows.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// Body, or the body that the geom or site is on.
    pub body: usize,
    /// Position of the part in the body's frame. For a body, that of its first joint.
    pub local: [f64; 3],
    /// Whether it is the body itself.
    pub whole: bool,
    pub joint: usize,
    /// The second joint and its share.
    pub toward: Option<(usize, f64)>,
    pub rotation: f64,
    pub position: f64,
    pub rest: Option<[f64; 4]>,
}

/// The bodies of a model that stand, by index: those of Marathon's built-in mapping, or else all bodies named as feet.
pub fn soles(model: &Model) -> Vec<usize> {
    let built_in = BUILT_IN.iter().find(|(name, _)| *name == model.name);
    let file = built_in.and_then(|(_, text)| serde_json::from_str::<Document>(text).ok());
    let stands = |name: &String| match &file {
        Some(file) => file.soles.contains(name),
        None => name.to_ascii_lowercase().contains("foot"),
    };
    (1..model.bodies.len()).filter(|i| stands(&model.bodies[*i].name)).collect()
}

/// A mapping from the joints of a skeleton to the bodies of a model.
#[derive(Clone, Debug)]
pub struct Mapping {
    /// Parts in the order of the model's bodies, followed by points on them.
    pub(crate) parts: Vec<Part>,
    /// Parts of the thighs.
    pub(crate) hips: [usize; 2],
    /// Bodies that stand.
    pub(crate) soles: Vec<usize>,
    /// Factor on the smoothing of the result, and on the laws of its center of mass and its balance.
    pub(crate) smooth: f64,
    /// Additional factor on the balance law.
    pub(crate) balance: f64,
}

/// Built-in mappings by the model's name. Their joints are those of [`roles`].
const BUILT_IN: [(&str, &str); 3] = [
    ("marathon_man", marathon_assets::text("motions/mappings/marathon_man.json")),
    ("humanoid", marathon_assets::text("motions/mappings/humanoid.json")),
    ("walker2d", marathon_assets::text("motions/mappings/walker2d.json")),
];

impl Mapping {
    /// The built-in mapping for a model, if there is one. The path of the motion is for messages.
    ///
    /// # Errors
    /// If there is none, or the skeleton's joints have unknown names.
    pub fn built_in(path: &Path, skeleton: &Skeleton, model: &Model) -> Result<Self, MotionError> {
        let found = BUILT_IN.iter().find(|(name, _)| *name == model.name);
        let Some((_, text)) = found else {
            let known: Vec<&str> = BUILT_IN.iter().map(|(name, _)| *name).collect();
            let problem = format!("there is no built-in mapping for it, only for {}; write one", known.join(", "));
            return Err(MotionError::model(path, &model.name, problem));
        };
        Self::parse(path, text.as_bytes(), skeleton, model)
    }

    /// A mapping in which every body with a joint follows the joint of its own name, by orientation only, without
    /// smoothing.
    ///
    /// # Errors
    /// If the skeleton lacks a body's name, or a hip is not a body.
    pub fn by_name(path: &Path, skeleton: &Skeleton, model: &Model, hips: [&str; 2]) -> Result<Self, MotionError> {
        let rows = model.bodies.iter().filter(|body| body.joint_count > 0).map(|body| {
            let name = serde_json::to_string(&body.name).expect("texts can be written");
            format!("{name}: {{\"joint\": {name}}}")
        });
        let name = serde_json::to_string(&model.name).expect("texts can be written");
        let parts = rows.collect::<Vec<_>>().join(", ");
        let text =
            format!("{{\"mapping\": 1, \"model\": {name}, \"hips\": {hips:?}, \"smooth\": 0, \"parts\": {{{parts}}}}}");
        Self::parse(path, text.as_bytes(), skeleton, model)
    }

    /// The joints that a mapping's bodies follow, each with the name of the first body that follows it. This identifies
    /// the joints of a skeleton whose names are not known. The path is used in messages.
    ///
    /// # Errors
    /// If the text is malformed.
    pub fn known_as(path: &Path, bytes: &[u8]) -> Result<BTreeMap<String, String>, MotionError> {
        let file: Document = limits::read_json(path, bytes)?;
        let mut names = BTreeMap::new();
        for (body, row) in file.parts.into_iter().filter(|(_, row)| row.toward.is_none()) {
            names.entry(row.joint).or_insert(body);
        }
        Ok(names)
    }

    /// Sets the factor on the balance law: only ground contacts can change the angular momentum. The default is 1.
    /// Larger values make the result more physical and less like the recording.
    pub fn balanced(self, factor: f64) -> Self {
        Mapping { balance: factor, ..self }
    }

    /// The bodies that stand, by index.
    pub fn soles(&self) -> &[usize] {
        &self.soles
    }

    /// Reads a mapping for a skeleton and a model. The path is for messages.
    ///
    /// # Errors
    /// If the text is malformed, or names something that the skeleton or the model lacks.
    pub fn parse(path: &Path, bytes: &[u8], skeleton: &Skeleton, model: &Model) -> Result<Self, MotionError> {
        let file: Document = limits::read_json(path, bytes)?;
        if file.mapping != 1 {
            return Err(MotionError::value(path, "mapping", file.mapping, "version 1 of the format"));
        }
        if file.model != model.name {
            return Err(MotionError::value(path, "model", format!("{:?}", file.model), format!("{:?}", model.name)));
        }
        let mut parts = Vec::new();
        for (name, row) in &file.parts {
            parts.push((name.clone(), part(path, name, row, skeleton, model)?));
        }
        parts.sort_by_key(|(_, part)| (part.body, !part.whole));
        let hip = |name: &String| {
            parts.iter().position(|(known, part)| known == name && part.whole).ok_or_else(|| {
                let hint = did_you_mean(nearest(name, parts.iter().map(|(name, _)| name.as_str())));
                MotionError::value(path, "hips", name, format!("bodies that are among the parts{hint}"))
            })
        };
        let hips = [hip(&file.hips[0])?, hip(&file.hips[1])?];
        let soles = file.soles.iter().map(|name| {
            let names = || model.bodies.iter().map(|body| body.name.as_str());
            names().position(|known| known == name).ok_or_else(|| {
                let hint = did_you_mean(nearest(name, names()));
                MotionError::value(path, "soles", name, format!("bodies of the model{hint}"))
            })
        });
        let soles = soles.collect::<Result<_, _>>()?;
        let smooth = file.smooth.unwrap_or(1.0);
        if !(0.0..=100.0).contains(&smooth) {
            return Err(MotionError::value(path, "smooth", smooth, "a factor from 0 to 100"));
        }
        Ok(Mapping { smooth, balance: 1.0, parts: parts.into_iter().map(|(_, part)| part).collect(), hips, soles })
    }
}

fn part(path: &Path, name: &str, row: &Row, skeleton: &Skeleton, model: &Model) -> Result<Part, MotionError> {
    let key = |field: &str| format!("parts.{name}.{field}");
    let joint = |field: &str, wanted: &str| {
        let names = || skeleton.bones.iter().map(|bone| bone.name.as_str());
        roles::find(skeleton, wanted).ok_or_else(|| {
            let hint = did_you_mean(nearest(wanted, names()));
            let all = names().map(|name| name.escape_debug().to_string()).collect::<Vec<_>>().join(", ");
            let expected = format!("a joint of the skeleton{hint}; it has {all}");
            MotionError::value(path, &key(field), format!("{wanted:?}"), expected)
        })
    };
    let weight = |field: &str, value: Option<f64>, default: f64| match value.unwrap_or(default) {
        value if (0.0..=1000.0).contains(&value) => Ok(value),
        value => Err(MotionError::value(path, &key(field), value, "a weight from 0 to 1000")),
    };
    let (body, local, whole) = find(path, name, model)?;
    let toward = match (&row.toward, row.share) {
        (Some(other), share) => {
            let share = share.unwrap_or(0.5);
            if !(0.0..=1.0).contains(&share) {
                return Err(MotionError::value(path, &key("share"), share, "a number from 0 to 1"));
            }
            Some((joint("toward", other)?, share))
        }
        (None, Some(share)) => {
            return Err(MotionError::value(path, &key("share"), share, "a joint in toward beside it"));
        }
        (None, None) => None,
    };
    if let Some(rest) = row.rest.filter(|q| !((q.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-3)) {
        return Err(MotionError::value(path, &key("rest"), format!("{rest:?}"), "a unit quaternion [w, x, y, z]"));
    }
    Ok(Part {
        body,
        local,
        whole,
        joint: joint("joint", &row.joint)?,
        toward,
        rotation: if whole { weight("rotation", row.rotation, 1.0)? } else { 0.0 },
        position: weight("position", row.position, if whole { 0.0 } else { 1.0 })?,
        rest: row.rest,
    })
}

/// Finds a body, geom or site by name: its body, its position there, and whether it is the body itself.
fn find(path: &Path, name: &str, model: &Model) -> Result<(usize, [f64; 3], bool), MotionError> {
    if let Some(body) = model.bodies.iter().position(|body| body.name == name).filter(|body| *body > 0) {
        let joint = &model.joints[model.bodies[body].joint_start..][..model.bodies[body].joint_count];
        let joint = joint.first().filter(|joint| joint.kind != JointType::Free);
        return Ok((body, joint.map_or([0.0; 3], |joint| joint.pos), true));
    }
    if let Some(geom) = model.geoms.iter().find(|geom| geom.name == name) {
        return Ok((geom.body, geom.pos, false));
    }
    if let Some(site) = model.sites.iter().find(|site| site.name == name) {
        return Ok((site.body, site.pos, false));
    }
    let names = model.bodies.iter().map(|body| body.name.as_str());
    let names = names.chain(model.geoms.iter().map(|geom| geom.name.as_str()));
    let hint = did_you_mean(nearest(name, names.chain(model.sites.iter().map(|site| site.name.as_str()))));
    Err(MotionError::value(path, "parts", format!("{name:?}"), format!("a body, geom or site of {}{hint}", model.name)))
}
