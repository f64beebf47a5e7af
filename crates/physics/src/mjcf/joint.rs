//! `<joint>` and `<freejoint>`.

use super::compiler::Settings;
use super::document::Element;
use super::error::MjcfError;
use super::limit::{check_limit, check_switch, is_limited};
use super::math::{EPS, Frame, rotate, unit};
use super::solver_params::{SOLIMP, SOLREF};
use super::value::{Attrs, polynomial};
use crate::model::{JointType, SolImp, SolRef, Vec3};

const TYPES: [(&str, JointType); 4] =
    [("free", JointType::Free), ("ball", JointType::Ball), ("slide", JointType::Slide), ("hinge", JointType::Hinge)];

/// A joint as the file describes it, angles in radians, in the frame of its body.
pub(crate) struct JointSpec<'a> {
    pub element: &'a Element,
    pub kind: JointType,
    pub pos: Vec3,
    pub axis: Vec3,
    pub reference: f64,
    pub spring_reference: f64,
    pub limited: bool,
    pub range: [f64; 2],
    pub margin: f64,
    pub stiffness: (f64, [f64; 2]),
    pub damping: (f64, [f64; 2]),
    pub armature: f64,
    pub frictionloss: f64,
    /// Time constant and damping ratio from which stiffness and damping follow.
    pub springdamper: Option<[f64; 2]>,
    pub solref_limit: SolRef,
    pub solimp_limit: SolImp,
    pub solref_friction: SolRef,
    pub solimp_friction: SolImp,
    pub actuator_force_range: Option<[f64; 2]>,
    pub actuator_gravcomp: bool,
    pub group: i32,
}

impl JointSpec<'_> {
    /// Number of coordinates in `qpos` and of velocities in `qvel`.
    pub fn sizes(&self) -> (usize, usize) {
        match self.kind {
            JointType::Free => (7, 6),
            JointType::Ball => (4, 3),
            JointType::Slide | JointType::Hinge => (1, 1),
        }
    }

    /// `<freejoint>`: a free joint that no default touches.
    pub fn free(element: &Element) -> Result<JointSpec<'_>, MjcfError> {
        let attrs = Attrs::plain(element);
        Ok(JointSpec {
            element,
            kind: JointType::Free,
            pos: [0.0; 3],
            axis: [0.0, 0.0, 1.0],
            reference: 0.0,
            spring_reference: 0.0,
            limited: false,
            range: [0.0; 2],
            margin: 0.0,
            stiffness: (0.0, [0.0; 2]),
            damping: (0.0, [0.0; 2]),
            armature: 0.0,
            frictionloss: 0.0,
            springdamper: None,
            solref_limit: SOLREF,
            solimp_limit: SOLIMP,
            solref_friction: SOLREF,
            solimp_friction: SOLIMP,
            actuator_force_range: None,
            actuator_gravcomp: false,
            group: attrs.integer_or("group", 0)?,
        })
    }

    /// `<joint>` with its defaults; `frame` is that of enclosing `<frame>` elements.
    pub fn read<'a>(attrs: &Attrs<'a>, frame: &Frame, settings: &Settings) -> Result<JointSpec<'a>, MjcfError> {
        let settings = settings.of(attrs.element);
        let element = attrs.element;
        let kind = attrs.keyword("type", &TYPES)?.unwrap_or(JointType::Hinge);
        let scalar = matches!(kind, JointType::Hinge | JointType::Slide);
        let angle = |x: f64| if kind == JointType::Slide { x } else { settings.angle(x) };
        let mut axis: Vec3 = attrs.array_or("axis", [0.0, 0.0, 1.0])?;
        if scalar {
            axis = rotate(frame.quat, axis);
            axis = unit(axis).ok_or_else(|| element.invalid(format!("the axis is shorter than {EPS:e}")))?;
        } else {
            axis = [0.0, 0.0, 1.0];
        }
        let pos = attrs.array_or("pos", [0.0; 3])?;
        let range = attrs.array_or("range", [0.0; 2])?;
        let limited = is_limited(attrs, "limited", range)? && kind != JointType::Free;
        let force_range = attrs.array_or("actuatorfrcrange", [0.0; 2])?;
        let force_limited = is_limited(attrs, "actuatorfrclimited", force_range)?;
        let reference = attrs.number_or("ref", 0.0)?;
        let spring_reference = attrs.number_or("springref", 0.0)?;
        let spec = JointSpec {
            element,
            kind,
            pos: if kind == JointType::Free { [0.0; 3] } else { frame.point(pos) },
            axis,
            reference: if kind == JointType::Hinge { settings.angle(reference) } else { reference },
            spring_reference: if kind == JointType::Hinge {
                settings.angle(spring_reference)
            } else {
                spring_reference
            },
            limited,
            // as in MuJoCo, a range that does not apply is not converted
            range: if limited { range.map(angle) } else { range },
            margin: attrs.number_or("margin", 0.0)?,
            stiffness: polynomial(attrs, "stiffness")?,
            damping: polynomial(attrs, "damping")?,
            armature: attrs.number_or("armature", 0.0)?,
            frictionloss: attrs.number_or("frictionloss", 0.0)?,
            springdamper: Some(attrs.array_or("springdamper", [0.0; 2])?).filter(|s| s[0] > 0.0 && s[1] > 0.0),
            solref_limit: attrs.partial_or("solreflimit", SOLREF)?,
            solimp_limit: attrs.partial_or("solimplimit", SOLIMP)?,
            solref_friction: attrs.partial_or("solreffriction", SOLREF)?,
            solimp_friction: attrs.partial_or("solimpfriction", SOLIMP)?,
            actuator_force_range: (force_limited && scalar).then_some(force_range),
            actuator_gravcomp: attrs.flag_or("actuatorgravcomp", false)?,
            group: attrs.integer_or("group", 0)?,
        };
        Ok(spec)
    }

    /// Checks what only a joint of the model, not a default, must fulfill.
    pub fn check(&self, attrs: &Attrs, settings: &Settings) -> Result<(), MjcfError> {
        if self.kind == JointType::Free {
            return Ok(());
        }
        if self.kind == JointType::Ball {
            check_switch(attrs, "limited", "range", self.range, settings)?;
            // without a second number, the largest angle is 0, as in MuJoCo
            if self.limited && self.range[0] != 0.0 {
                return Err(self.element.invalid("the range of a ball joint must start with 0"));
            }
        } else {
            check_limit(attrs, "limited", "range", self.range, settings)?;
            let force = attrs.array_or("actuatorfrcrange", [0.0; 2])?;
            check_limit(attrs, "actuatorfrclimited", "actuatorfrcrange", force, settings)?;
        }
        Ok(())
    }
}
