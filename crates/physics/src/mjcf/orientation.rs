//! The five ways to write an orientation.

use super::compiler::Settings;
use super::document::Element;
use super::error::MjcfError;
use super::math::*;
use super::value::Attrs;
use crate::model::{Quat, Vec3};

const SPECIFIERS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// The orientation given by `quat`, `axisangle`, `euler`, `xyaxes` or `zaxis`, if any.
///
/// One element may use one of them; an element's own replaces that of its class.
pub(crate) fn orientation(attrs: &Attrs, settings: &Settings) -> Result<Option<Quat>, MjcfError> {
    let settings = settings.of(attrs.element);
    for element in attrs.chain() {
        let given: Vec<&str> = SPECIFIERS.into_iter().filter(|s| element.attr(s).is_some()).collect();
        if given.len() > 1 {
            return Err(element.invalid(format!("only one orientation is allowed; found {}", given.join(" and "))));
        }
    }
    let own = attrs.chain().rev().find_map(|e| SPECIFIERS.into_iter().find(|s| e.attr(s).is_some()).map(|s| (e, s)));
    own.map(|(element, specifier)| read(element, specifier, settings)).transpose()
}

fn read(element: &Element, specifier: &str, settings: &Settings) -> Result<Quat, MjcfError> {
    let attr = element.attr(specifier).expect("the caller found the attribute");
    let plain = Attrs::plain(element);
    let too_small = |what: &str| element.bad_value(attr, format!("{what} that is not zero"));
    match specifier {
        "quat" => {
            let quat: Quat = plain.array_or(specifier, IDENTITY)?;
            if !(quat_norm(quat) >= EPS) {
                return Err(too_small("a quaternion"));
            }
            Ok(normalized(quat))
        }
        "axisangle" => {
            let [x, y, z, angle] = plain.array_or(specifier, [0.0; 4])?;
            let axis = unit([x, y, z]).ok_or_else(|| too_small("an axis"))?;
            Ok(from_axis_angle(axis, settings.angle(angle)))
        }
        "euler" => Ok(from_euler(plain.array_or(specifier, [0.0; 3])?, settings)),
        "xyaxes" => {
            let [a, b, c, d, e, f] = plain.array_or(specifier, [0.0; 6])?;
            let x = unit([a, b, c]).ok_or_else(|| too_small("an x axis"))?;
            let y = [d, e, f];
            let y = sub(y, scale(x, dot(x, y)));
            let y = unit(y).ok_or_else(|| too_small("a y axis, not along the x axis,"))?;
            let z = unit(cross(x, y)).ok_or_else(|| too_small("a cross product of the axes"))?;
            Ok(from_axes(x, y, z))
        }
        _ => {
            let z = unit(plain.array_or(specifier, [0.0; 3])?).ok_or_else(|| too_small("a z axis"))?;
            Ok(from_z_axis(z))
        }
    }
}

/// Rotation by three angles of the file, about the axes of `eulerseq`.
pub(crate) fn from_euler(angles: Vec3, settings: &Settings) -> Quat {
    normalized(euler_product(angles, settings))
}

/// The same before it gets the length 1.
pub(crate) fn euler_product(angles: Vec3, settings: &Settings) -> Quat {
    let mut quat = IDENTITY;
    for (turn, angle) in settings.eulerseq.iter().zip(angles) {
        let mut axis = [0.0; 3];
        axis[turn.axis] = 1.0;
        let step = from_axis_angle(axis, settings.angle(angle));
        // rotating axes multiply from the right, fixed axes from the left
        quat = if turn.fixed { mul_quat(step, quat) } else { mul_quat(quat, step) };
    }
    quat
}
