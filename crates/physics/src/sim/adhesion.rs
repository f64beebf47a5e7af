//! Adhesion: actuators that pull a body towards what it touches.

use crate::model::{Model, Transmission};

/// An actuator on the contacts of a body.
#[derive(Clone, Debug)]
pub(crate) struct AdhesionSpec {
    /// Index of the actuator.
    pub actuator: usize,
    /// Whether each geom belongs to the body.
    pub geoms: Vec<bool>,
}

/// The adhesive bodies, if actuators act at all.
pub(super) fn adhesions(model: &Model) -> Vec<AdhesionSpec> {
    let spec = |(actuator, a): (usize, &crate::model::Actuator)| match a.transmission {
        Transmission::Body(body) => {
            Some(AdhesionSpec { actuator, geoms: model.geoms.iter().map(|g| g.body == body).collect() })
        }
        _ => None,
    };
    if model.opt.flags.actuation { model.actuators.iter().enumerate().filter_map(spec).collect() } else { Vec::new() }
}
