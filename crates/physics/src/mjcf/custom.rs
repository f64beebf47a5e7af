//! `<custom>` numbers, the geom of the obstacles, and `<keyframe>` states.

use super::document::Element;
use super::error::MjcfError;
use super::math::{EPS, IDENTITY, quat_norm};
use super::names::{Names, Registry};
use super::room::Room;
use super::settings::{entries, sections};
use super::value::{Attrs, numbers};
use crate::model::{Geom, GeomType, JointType, Keyframe, Model, Quat};

/// More keyframes or numbers than this are a mistake in the file.
const LARGEST: usize = 100_000;

/// `<custom><numeric>` by name, in document order.
pub(crate) fn numerics(root: &Element, room: &Room) -> Result<Vec<(String, Vec<f64>)>, MjcfError> {
    let elements = || entries(root, "custom").filter(|e| e.name == "numeric");
    Names::collect("numeric", elements())?;
    elements()
        .map(|element| {
            let name = element.text("name").filter(|n| !n.is_empty());
            let name = name.ok_or_else(|| element.invalid("the attribute 'name' is missing"))?;
            let mut data = match element.attr("data") {
                Some(attr) => numbers(element, attr, 0, usize::MAX)?,
                None => Vec::new(),
            };
            if let Some(attr) = element.attr("size") {
                let size = usize::try_from(Attrs::plain(element).integer_or("size", 0)?).unwrap_or(usize::MAX);
                if size < data.len() || size > LARGEST {
                    let expected = format!("an integer from {} to {LARGEST}", data.len());
                    return Err(element.bad_value(attr, expected));
                }
                room.take_for(element, size, size_of::<f64>())?;
                data.resize(size, 0.0);
            }
            if data.is_empty() {
                return Err(element.invalid("there are no numbers"));
            }
            Ok((name.to_owned(), data))
        })
        .collect()
}

/// Name of the `<text>` that names the geom of the obstacles.
pub(super) const OBSTACLES: &str = "marathon_obstacles";

/// The geom that stands for the obstacles of an agent: the one that `<custom><text name="marathon_obstacles">` names.
pub(crate) fn obstacles(root: &Element, names: &Registry, geoms: &[Geom]) -> Result<Option<usize>, MjcfError> {
    let mut texts = entries(root, "custom").filter(|e| e.name == "text" && e.text("name") == Some(OBSTACLES));
    let Some(element) = texts.next() else { return Ok(None) };
    if let Some(second) = texts.next() {
        return Err(second.invalid("there is already a text of this name"));
    }
    let geom = names.geoms.required(element, "data")?;
    if geoms[geom].body != 0 || geoms[geom].kind != GeomType::Sphere {
        let found = format!("'{}' is no sphere of the world", geoms[geom].name);
        return Err(element.invalid(format!("{found}; the geom that stands for obstacles must be one")));
    }
    Ok(Some(geom))
}

/// `<keyframe>`: what a key leaves out is the reference configuration at rest.
pub(crate) fn keyframes(root: &Element, model: &Model, room: &Room) -> Result<Vec<Keyframe>, MjcfError> {
    let elements = || entries(root, "keyframe").filter(|e| e.name == "key");
    Names::collect("keyframe", elements())?;
    let mocap = || model.bodies.iter().filter(|b| b.mocap);
    let reference = || Keyframe {
        name: String::new(),
        time: 0.0,
        qpos: model.qpos0.clone(),
        qvel: vec![0.0; model.nv],
        ctrl: vec![0.0; model.nu],
        act: vec![0.0; model.na],
        mpos: mocap().map(|b| b.pos).collect(),
        mquat: mocap().map(|b| b.quat).collect(),
    };
    let mocaps = mocap().count();
    let size = 300 + 8 * (model.nq + model.nv + model.nu + model.na + 7 * mocaps);
    let mut keys = Vec::new();
    for element in elements() {
        room.take_for(element, 1, size)?;
        let attrs = Attrs::plain(element);
        let mut key = reference();
        key.name = element.text("name").unwrap_or_default().to_owned();
        key.time = attrs.number_or("time", 0.0)?;
        for (name, values) in
            [("qpos", &mut key.qpos), ("qvel", &mut key.qvel), ("act", &mut key.act), ("ctrl", &mut key.ctrl)]
        {
            // as in MuJoCo, what a short list leaves out stays as it is
            attrs.overlay(name, 1, values)?;
        }
        let mut places = key.mpos.concat();
        let length = places.len();
        attrs.overlay("mpos", length, &mut places)?;
        key.mpos.iter_mut().zip(places.chunks_exact(3)).for_each(|(pos, given)| pos.copy_from_slice(given));
        let mut turns = key.mquat.concat();
        let length = turns.len();
        attrs.overlay("mquat", length, &mut turns)?;
        for (quat, given) in key.mquat.iter_mut().zip(turns.chunks_exact(4)) {
            quat.copy_from_slice(given);
            let length = quat_norm(*quat);
            if !(length >= EPS) {
                return Err(element.invalid("a quaternion of 'mquat' is zero"));
            }
            *quat = quat.map(|x| x / length);
        }
        for joint in &model.joints {
            let adr = match joint.kind {
                JointType::Free => joint.qpos_adr + 3,
                JointType::Ball => joint.qpos_adr,
                JointType::Slide | JointType::Hinge => continue,
            };
            let quat: Quat = std::array::from_fn(|i| key.qpos[adr + i]);
            let length = quat_norm(quat);
            // a quaternion of zeros is no rotation, as in MuJoCo
            let unit = if length >= EPS { quat.map(|x| x / length) } else { IDENTITY };
            key.qpos[adr..adr + 4].copy_from_slice(&unit);
        }
        keys.push(key);
    }
    // <size nkey> reserves room for more
    for section in sections(root, "size") {
        let Some(attr) = section.attr("nkey") else { continue };
        let count = usize::try_from(Attrs::plain(section).integer_or("nkey", 0)?).unwrap_or(usize::MAX);
        if count > LARGEST {
            return Err(section.bad_value(attr, format!("an integer from 0 to {LARGEST}")));
        }
        room.take_for(section, count.saturating_sub(keys.len()), size)?;
        keys.resize_with(keys.len().max(count), reference);
    }
    Ok(keys)
}
