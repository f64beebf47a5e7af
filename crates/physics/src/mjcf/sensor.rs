//! `<sensor>`: what is measured, and on what.

use super::document::Element;
use super::error::MjcfError;
use super::names::{Names, Registry};
use super::room::Room;
use super::settings::entries;
use super::value::Attrs;
use crate::model::{GeomType, JointType, Model, Sensor, SensorObject, SensorType};

/// Object that a sensor element is attached to, which decides the attributes.
#[derive(Clone, Copy, PartialEq)]
enum Target {
    Site,
    /// A site, or a geom.
    TouchSite,
    /// A hinge or slide.
    Joint,
    /// A hinge or slide with limits.
    JointLimit,
    Ball,
    Actuator,
    Tendon,
    /// A tendon with limits.
    TendonLimit,
    Body,
    /// `objtype` and `objname`, and `reftype` and `refname` if there are any.
    Frame,
    /// A frame and a site.
    Inside,
    /// Two geoms or bodies.
    Pair,
    /// Any of several objects on either side.
    Contact,
    /// The whole model.
    None,
    /// Anything else; not looked up.
    Other,
}

/// Elements with the quantity, the target and the number of values; 0 values: depends on other attributes.
const SENSORS: &[(&str, SensorType, Target, usize)] = &[
    ("touch", SensorType::Touch, Target::TouchSite, 1),
    ("accelerometer", SensorType::Accelerometer, Target::Site, 3),
    ("velocimeter", SensorType::Velocimeter, Target::Site, 3),
    ("gyro", SensorType::Gyro, Target::Site, 3),
    ("force", SensorType::Force, Target::Site, 3),
    ("torque", SensorType::Torque, Target::Site, 3),
    ("magnetometer", SensorType::Magnetometer, Target::Site, 3),
    ("camprojection", SensorType::Unsupported, Target::Site, 2),
    ("rangefinder", SensorType::RangeFinder, Target::Site, 0),
    ("jointpos", SensorType::JointPos, Target::Joint, 1),
    ("jointvel", SensorType::JointVel, Target::Joint, 1),
    ("tendonpos", SensorType::TendonPos, Target::Tendon, 1),
    ("tendonvel", SensorType::TendonVel, Target::Tendon, 1),
    ("actuatorpos", SensorType::ActuatorPos, Target::Actuator, 1),
    ("actuatorvel", SensorType::ActuatorVel, Target::Actuator, 1),
    ("actuatorfrc", SensorType::ActuatorFrc, Target::Actuator, 1),
    ("jointactuatorfrc", SensorType::JointActuatorFrc, Target::Joint, 1),
    ("tendonactuatorfrc", SensorType::TendonActuatorFrc, Target::Tendon, 1),
    ("ballquat", SensorType::BallQuat, Target::Ball, 4),
    ("ballangvel", SensorType::BallAngVel, Target::Ball, 3),
    ("jointlimitpos", SensorType::JointLimitPos, Target::JointLimit, 1),
    ("jointlimitvel", SensorType::JointLimitVel, Target::JointLimit, 1),
    ("jointlimitfrc", SensorType::JointLimitFrc, Target::JointLimit, 1),
    ("tendonlimitpos", SensorType::TendonLimitPos, Target::TendonLimit, 1),
    ("tendonlimitvel", SensorType::TendonLimitVel, Target::TendonLimit, 1),
    ("tendonlimitfrc", SensorType::TendonLimitFrc, Target::TendonLimit, 1),
    ("framepos", SensorType::FramePos, Target::Frame, 3),
    ("framequat", SensorType::FrameQuat, Target::Frame, 4),
    ("framexaxis", SensorType::FrameXAxis, Target::Frame, 3),
    ("frameyaxis", SensorType::FrameYAxis, Target::Frame, 3),
    ("framezaxis", SensorType::FrameZAxis, Target::Frame, 3),
    ("framelinvel", SensorType::FrameLinVel, Target::Frame, 3),
    ("frameangvel", SensorType::FrameAngVel, Target::Frame, 3),
    ("framelinacc", SensorType::FrameLinAcc, Target::Frame, 3),
    ("frameangacc", SensorType::FrameAngAcc, Target::Frame, 3),
    ("subtreecom", SensorType::SubtreeCom, Target::Body, 3),
    ("subtreelinvel", SensorType::SubtreeLinVel, Target::Body, 3),
    ("subtreeangmom", SensorType::SubtreeAngMom, Target::Body, 3),
    ("insidesite", SensorType::InsideSite, Target::Inside, 1),
    ("distance", SensorType::Distance, Target::Pair, 1),
    ("normal", SensorType::Normal, Target::Pair, 3),
    ("fromto", SensorType::FromTo, Target::Pair, 6),
    ("contact", SensorType::Contact, Target::Contact, 0),
    ("e_potential", SensorType::PotentialEnergy, Target::None, 1),
    ("e_kinetic", SensorType::KineticEnergy, Target::None, 1),
    ("clock", SensorType::Clock, Target::None, 1),
    ("tactile", SensorType::Unsupported, Target::Other, 0),
    ("user", SensorType::Unsupported, Target::Other, 0),
    ("plugin", SensorType::Unsupported, Target::Other, 0),
];

/// Fields of a `contact` sensor in their order, with the values of each per contact.
const CONTACT_FIELDS: &[(&str, usize)] = &[
    ("found", 1),
    ("force", 3),
    ("torque", 3),
    ("dist", 1),
    ("pos", 3),
    ("normal", 3),
    ("tangent", 3),
    ("linvel", 3),
    ("angvel", 3),
];
/// Fields of a `rangefinder`.
const RAY_FIELDS: &[(&str, usize)] =
    &[("dist", 1), ("dir", 3), ("origin", 3), ("point", 3), ("normal", 3), ("depth", 1)];

/// Compiles all sensors.
pub(crate) fn compile(root: &Element, names: &Registry, model: &Model, room: &Room) -> Result<Vec<Sensor>, MjcfError> {
    Names::collect("sensor", entries(root, "sensor"))?;
    let mut sensors = Vec::new();
    let mut adr = 0;
    for element in entries(root, "sensor") {
        let sensor = sensor(element, names, model, adr)?;
        // agents store the values in vectors of up to 16 numbers
        room.take_for(element, sensor.dim, 16 * size_of::<f64>())?;
        adr += sensor.dim;
        sensors.push(sensor);
    }
    Ok(sensors)
}

fn sensor(element: &Element, names: &Registry, model: &Model, adr: usize) -> Result<Sensor, MjcfError> {
    let Some(&(_, mut kind, target, dim)) = SENSORS.iter().find(|(name, ..)| *name == element.name) else {
        return Err(element.unsupported(None, "this sensor is not supported"));
    };
    let attrs = Attrs::plain(element);
    let (mut object, mut reference) = objects(element, target, names, model)?;
    let (mut intprm, dim) = if dim > 0 { ([0; 3], dim) } else { variable(element)? };
    if kind == SensorType::InsideSite {
        intprm[0] = i32::from(attrs.flag_or("enclosed", false)?);
    }
    // delayed or decimated readings, and readings of meshes that were not read are not computed
    let interval: [f64; 2] = attrs.partial_or("interval", [0.0; 2])?;
    let unknown = |object| match object {
        SensorObject::Geom(g) => model.geoms[g].kind == GeomType::Mesh && model.geoms[g].mesh.is_none(),
        _ => false,
    };
    if attrs.number_or("delay", 0.0)? != 0.0 || interval != [0.0; 2] || unknown(object) || unknown(reference) {
        kind = SensorType::Unsupported;
    }
    if kind == SensorType::Unsupported {
        (object, reference, intprm) = (SensorObject::None, SensorObject::None, [0; 3]);
    }
    let cutoff = attrs.number_or("cutoff", 0.0)?;
    if let Some(attr) = element.attr("cutoff").filter(|_| cutoff < 0.0) {
        return Err(element.bad_value(attr, "a number that is not negative"));
    }
    Ok(Sensor {
        name: element.text("name").unwrap_or_default().to_owned(),
        element: element.name.clone(),
        kind,
        object,
        reference,
        intprm,
        adr,
        dim,
        cutoff,
    })
}

/// The object of a sensor, and its second one if there is one.
fn objects(
    element: &Element,
    target: Target,
    names: &Registry,
    model: &Model,
) -> Result<(SensorObject, SensorObject), MjcfError> {
    let site = || names.sites.required(element, "site").map(SensorObject::Site);
    let object = match target {
        Target::Site if element.attr("camera").is_some() && element.name == "rangefinder" => {
            let reason = "a range finder on a camera is not supported; put it on a site";
            return Err(element.unsupported(Some("camera"), reason));
        }
        Target::Site => site()?,
        Target::TouchSite => match element.text("site").and_then(|site| names.geoms.get(site)) {
            // a touch sensor may name a geom where there is no such site
            Some(geom) if element.text("site").and_then(|site| names.sites.get(site)).is_none() => {
                SensorObject::Geom(geom)
            }
            _ => site()?,
        },
        Target::Joint | Target::JointLimit | Target::Ball => joint(element, target, names, model)?,
        Target::Actuator => SensorObject::Actuator(names.actuators.required(element, "actuator")?),
        Target::Tendon | Target::TendonLimit => {
            let tendon = names.tendons.required(element, "tendon")?;
            let t = &model.tendons[tendon];
            if target == Target::TendonLimit && !t.limited {
                return Err(element.invalid(format!("the tendon '{}' has no limit", t.name)));
            }
            SensorObject::Tendon(tendon)
        }
        Target::Body => SensorObject::Body(names.bodies.required(element, "body")?),
        Target::Frame => {
            let object = frame(element, names, "objtype", "objname")?;
            let relative = element.attr("reftype").is_some() || element.attr("refname").is_some();
            let reference = if relative { frame(element, names, "reftype", "refname")? } else { SensorObject::None };
            return Ok((object, reference));
        }
        Target::Inside => return Ok((frame(element, names, "objtype", "objname")?, site()?)),
        Target::Pair => {
            let side = |geom, body| match one_of(element, names, &[geom, body])? {
                SensorObject::None => Err(element.invalid(format!("'{geom}' or '{body}' is missing"))),
                object => Ok(object),
            };
            return Ok((side("geom1", "body1")?, side("geom2", "body2")?));
        }
        Target::Contact => {
            let first = one_of(element, names, &["geom1", "body1", "subtree1", "site"])?;
            return Ok((first, one_of(element, names, &["geom2", "body2", "subtree2"])?));
        }
        Target::None | Target::Other => SensorObject::None,
    };
    Ok((object, SensorObject::None))
}

/// A joint of the kind that the sensor needs.
fn joint(element: &Element, target: Target, names: &Registry, model: &Model) -> Result<SensorObject, MjcfError> {
    let index = names.joints.required(element, "joint")?;
    let joint = &model.joints[index];
    let scalar = matches!(joint.kind, JointType::Hinge | JointType::Slide);
    let wrong = |what: &str| Err(element.invalid(format!("the joint '{}' {what}", joint.name)));
    match target {
        Target::Ball if joint.kind != JointType::Ball => wrong("is not a ball joint"),
        Target::Joint if !scalar => wrong("is neither a hinge nor a slide"),
        Target::JointLimit if !joint.limited => wrong("has no limit"),
        _ => Ok(SensorObject::Joint(index)),
    }
}

/// The object that one of several attributes names, each its own kind of object; more than one is an error.
fn one_of(element: &Element, names: &Registry, attributes: &[&str]) -> Result<SensorObject, MjcfError> {
    let mut given = attributes.iter().filter(|name| element.attr(name).is_some());
    let Some(name) = given.next() else { return Ok(SensorObject::None) };
    if let Some(other) = given.next() {
        return Err(element.invalid(format!("there are both '{name}' and '{other}'")));
    }
    Ok(match name.trim_end_matches(['1', '2']) {
        "geom" => SensorObject::Geom(names.geoms.required(element, name)?),
        "body" => SensorObject::Body(names.bodies.required(element, name)?),
        "subtree" => SensorObject::XBody(names.bodies.required(element, name)?),
        _ => SensorObject::Site(names.sites.required(element, name)?),
    })
}

/// The frame that a pair of attributes names, such as `objtype` and `objname`.
fn frame(element: &Element, names: &Registry, kind: &str, name: &str) -> Result<SensorObject, MjcfError> {
    #[derive(Clone, Copy)]
    enum Kind {
        Body,
        XBody,
        Geom,
        Site,
        Camera,
    }
    let kinds = [
        ("body", Kind::Body),
        ("xbody", Kind::XBody),
        ("geom", Kind::Geom),
        ("site", Kind::Site),
        ("camera", Kind::Camera),
    ];
    let Some(kind) = Attrs::plain(element).keyword(kind, &kinds)? else {
        return Err(element.invalid(format!("the attribute '{kind}' is missing")));
    };
    Ok(match kind {
        Kind::Body => SensorObject::Body(names.bodies.required(element, name)?),
        Kind::XBody => SensorObject::XBody(names.bodies.required(element, name)?),
        Kind::Geom => SensorObject::Geom(names.geoms.required(element, name)?),
        Kind::Site => SensorObject::Site(names.sites.required(element, name)?),
        Kind::Camera => SensorObject::Camera(names.cameras.required(element, name)?),
    })
}

/// Parameters and number of values of the sensors for which they depend on their attributes.
fn variable(element: &Element) -> Result<([i32; 3], usize), MjcfError> {
    const LARGEST: i32 = 100_000;
    let attrs = Attrs::plain(element);
    let count = |name: &str, least: i32| {
        let value = attrs.integer_or(name, least)?;
        match element.attr(name) {
            Some(attr) if !(least..=LARGEST).contains(&value) => {
                Err(element.bad_value(attr, format!("an integer from {least} to {LARGEST}")))
            }
            _ => Ok(value),
        }
    };
    match element.name.as_str() {
        "contact" => {
            let (mask, size) = fields(element, CONTACT_FIELDS)?;
            let reductions = [("none", 0), ("mindist", 1), ("maxforce", 2), ("netforce", 3)];
            let reduce = attrs.keyword("reduce", &reductions)?.unwrap_or(0);
            let contacts = count("num", 1)?;
            Ok(([mask, reduce, contacts], size * contacts as usize))
        }
        "rangefinder" => fields(element, RAY_FIELDS).map(|(mask, size)| ([mask, 0, 0], size)),
        "user" => Ok(([0; 3], count("dim", 0)? as usize)),
        // these need a mesh or a plugin, which the rest of the model cannot have
        _ => Err(element.unsupported(None, "this sensor is not supported")),
    }
}

/// Bit mask and number of values of the fields in `data`; without it the first field alone.
fn fields(element: &Element, known: &[(&str, usize)]) -> Result<(i32, usize), MjcfError> {
    let Some(attr) = element.attr("data").filter(|a| !a.value.trim_ascii().is_empty()) else {
        return Ok((1, known[0].1));
    };
    let (mut mask, mut size, mut next) = (0, 0, 0);
    for field in attr.value.split_ascii_whitespace() {
        let place = known.iter().position(|(name, _)| *name == field).filter(|place| *place >= next);
        let names = known.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        let place = place.ok_or_else(|| element.bad_value(attr, format!("some of {names}, in this order")))?;
        (mask, size, next) = (mask | 1 << place, size + known[place].1, place + 1);
    }
    Ok((mask, size))
}
