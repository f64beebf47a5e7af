//! `<sensor>`: what is measured, and on what.

use super::document::Element;
use super::error::MjcfError;
use super::names::{Names, Registry};
use super::settings::entries;
use super::value::Attrs;
use crate::model::{Sensor, SensorObject, SensorType};

/// What a sensor element is attached to, and with which attribute.
#[derive(Clone, Copy, PartialEq)]
enum Target {
    Site,
    /// A site, or a geom.
    TouchSite,
    Joint,
    Actuator,
    Tendon,
    Body,
    /// `objtype` and `objname`.
    Frame,
    /// Anything else; not looked up.
    Other,
}

/// Elements with the quantity, the target and the number of values; 0 values: depends on other attributes.
const SENSORS: &[(&str, SensorType, Target, usize)] = &[
    ("touch", SensorType::Touch, Target::TouchSite, 1),
    ("accelerometer", SensorType::Accelerometer, Target::Site, 3),
    ("velocimeter", SensorType::Velocimeter, Target::Site, 3),
    ("gyro", SensorType::Gyro, Target::Site, 3),
    ("force", SensorType::Unsupported, Target::Site, 3),
    ("torque", SensorType::Unsupported, Target::Site, 3),
    ("magnetometer", SensorType::Unsupported, Target::Site, 3),
    ("camprojection", SensorType::Unsupported, Target::Site, 2),
    ("rangefinder", SensorType::Unsupported, Target::Other, 1),
    ("jointpos", SensorType::JointPos, Target::Joint, 1),
    ("jointvel", SensorType::JointVel, Target::Joint, 1),
    ("tendonpos", SensorType::Unsupported, Target::Tendon, 1),
    ("tendonvel", SensorType::Unsupported, Target::Tendon, 1),
    ("actuatorpos", SensorType::Unsupported, Target::Actuator, 1),
    ("actuatorvel", SensorType::Unsupported, Target::Actuator, 1),
    ("actuatorfrc", SensorType::ActuatorFrc, Target::Actuator, 1),
    ("jointactuatorfrc", SensorType::Unsupported, Target::Joint, 1),
    ("tendonactuatorfrc", SensorType::Unsupported, Target::Tendon, 1),
    ("ballquat", SensorType::Unsupported, Target::Joint, 4),
    ("ballangvel", SensorType::Unsupported, Target::Joint, 3),
    ("jointlimitpos", SensorType::Unsupported, Target::Joint, 1),
    ("jointlimitvel", SensorType::Unsupported, Target::Joint, 1),
    ("jointlimitfrc", SensorType::Unsupported, Target::Joint, 1),
    ("tendonlimitpos", SensorType::Unsupported, Target::Tendon, 1),
    ("tendonlimitvel", SensorType::Unsupported, Target::Tendon, 1),
    ("tendonlimitfrc", SensorType::Unsupported, Target::Tendon, 1),
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
    ("subtreeangmom", SensorType::Unsupported, Target::Body, 3),
    ("insidesite", SensorType::Unsupported, Target::Site, 1),
    ("distance", SensorType::Unsupported, Target::Other, 1),
    ("normal", SensorType::Unsupported, Target::Other, 3),
    ("fromto", SensorType::Unsupported, Target::Other, 6),
    ("contact", SensorType::Unsupported, Target::Other, 0),
    ("e_potential", SensorType::Unsupported, Target::Other, 1),
    ("e_kinetic", SensorType::Unsupported, Target::Other, 1),
    ("clock", SensorType::Unsupported, Target::Other, 1),
    ("tactile", SensorType::Unsupported, Target::Other, 0),
    ("user", SensorType::Unsupported, Target::Other, 0),
    ("plugin", SensorType::Unsupported, Target::Other, 0),
];

/// Values per contact of the fields of a `contact` sensor.
const CONTACT_FIELDS: [(&str, usize); 7] =
    [("found", 1), ("force", 3), ("torque", 3), ("dist", 1), ("pos", 3), ("normal", 3), ("tangent", 3)];

/// Compiles all sensors.
pub(crate) fn compile(root: &Element, names: &Registry) -> Result<Vec<Sensor>, MjcfError> {
    Names::collect("sensor", entries(root, "sensor"))?;
    let mut sensors = Vec::new();
    let mut adr = 0;
    for element in entries(root, "sensor") {
        let sensor = sensor(element, names, adr)?;
        adr += sensor.dim;
        sensors.push(sensor);
    }
    Ok(sensors)
}

fn sensor(element: &Element, names: &Registry, adr: usize) -> Result<Sensor, MjcfError> {
    let Some(&(_, mut kind, target, dim)) = SENSORS.iter().find(|(name, ..)| *name == element.name) else {
        return Err(element.unsupported(None, "this sensor is not supported"));
    };
    let attrs = Attrs::plain(element);
    let mut object = match target {
        Target::Site => SensorObject::Site(names.sites.required(element, "site")?),
        Target::TouchSite => match element.text("site").and_then(|site| names.geoms.get(site)) {
            // a touch sensor may name a geom where there is no such site
            Some(geom) if element.text("site").and_then(|site| names.sites.get(site)).is_none() => {
                SensorObject::Geom(geom)
            }
            _ => SensorObject::Site(names.sites.required(element, "site")?),
        },
        Target::Joint => SensorObject::Joint(names.joints.required(element, "joint")?),
        Target::Actuator => SensorObject::Actuator(names.actuators.required(element, "actuator")?),
        Target::Tendon => {
            names.tendons.required(element, "tendon")?;
            SensorObject::None
        }
        Target::Body => SensorObject::Body(names.bodies.required(element, "body")?),
        Target::Frame => frame(element, names)?,
        Target::Other => SensorObject::None,
    };
    // relative, delayed or decimated readings are not computed
    let filtered = |name: &str| attrs.number_or(name, 0.0).map(|x| x != 0.0);
    let interval: [f64; 2] = attrs.partial_or("interval", [0.0; 2])?;
    if element.attr("reftype").is_some() || filtered("delay")? || interval != [0.0; 2] {
        kind = SensorType::Unsupported;
    }
    if kind == SensorType::Unsupported {
        object = SensorObject::None;
    }
    Ok(Sensor {
        name: element.text("name").unwrap_or_default().to_owned(),
        element: element.name.clone(),
        kind,
        object,
        adr,
        dim: if dim > 0 { dim } else { variable_dim(element)? },
        cutoff: attrs.number_or("cutoff", 0.0)?,
    })
}

/// The object of a frame sensor.
fn frame(element: &Element, names: &Registry) -> Result<SensorObject, MjcfError> {
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
    let Some(kind) = Attrs::plain(element).keyword("objtype", &kinds)? else {
        return Err(element.invalid("the attribute 'objtype' is missing"));
    };
    Ok(match kind {
        Kind::Body => SensorObject::Body(names.bodies.required(element, "objname")?),
        Kind::XBody => SensorObject::XBody(names.bodies.required(element, "objname")?),
        Kind::Geom => SensorObject::Geom(names.geoms.required(element, "objname")?),
        Kind::Site => SensorObject::Site(names.sites.required(element, "objname")?),
        Kind::Camera => SensorObject::Camera(names.cameras.required(element, "objname")?),
    })
}

/// Number of values of the sensors for which it depends on their attributes.
fn variable_dim(element: &Element) -> Result<usize, MjcfError> {
    const LARGEST: i32 = 1_000_000;
    let attrs = Attrs::plain(element);
    let count = |name: &str, default: i32| {
        let value = attrs.integer_or(name, default)?;
        match element.attr(name) {
            Some(attr) if !(0..=LARGEST).contains(&value) => {
                Err(element.bad_value(attr, format!("an integer from 0 to {LARGEST}")))
            }
            _ => Ok(value as usize),
        }
    };
    match element.name.as_str() {
        "contact" => {
            let Some(attr) = element.attr("data") else { return count("num", 1) };
            let mut size = 0;
            for field in attr.value.split_ascii_whitespace() {
                let known = CONTACT_FIELDS.iter().find(|(name, _)| *name == field);
                let names = CONTACT_FIELDS.map(|(name, _)| name).join(", ");
                size += known.ok_or_else(|| element.bad_value(attr, format!("some of {names}")))?.1;
            }
            Ok(size * count("num", 1)?)
        }
        "user" => count("dim", 0),
        // these need a mesh or a plugin, which the rest of the model cannot have
        _ => Err(element.unsupported(None, "this sensor is not supported")),
    }
}
