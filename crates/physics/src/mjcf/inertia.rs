//! Mass and inertia of bodies: from `<inertial>` or from their geoms, then bounded, balanced and scaled.

use super::compiler::Settings;
use super::compiler::Tristate;
use super::error::MjcfError;
use super::math::*;
use super::tree::BodySpec;

/// Fills in mass, inertial frame and principal moments of all bodies.
pub(crate) fn compile(bodies: &mut [BodySpec], settings: &Settings) -> Result<(), MjcfError> {
    for body in bodies.iter_mut().skip(1) {
        if let Some(inertial) = &body.inertial {
            (body.mass, body.iframe, body.inertia) = (inertial.mass, inertial.frame, inertial.moments);
        }
        let own = settings.of(body.element);
        let infer = match own.inertiafromgeom {
            Tristate::True => true,
            Tristate::False => false,
            Tristate::Auto => body.inertial.is_none(),
        };
        if infer {
            from_geoms(body, own)?;
        }
        check(body, own)?;
    }
    check_moving(bodies)?;
    let total: f64 = bodies.iter().map(|b| b.mass).sum();
    if settings.settotalmass > 0.0 && total > 0.0 {
        let factor = settings.settotalmass / total.max(MIN_VAL);
        for body in bodies.iter_mut() {
            body.mass *= factor;
            body.inertia = scale(body.inertia, factor);
        }
    }
    Ok(())
}

/// Adds up the geoms of the body. A body without any keeps its `<inertial>`.
fn from_geoms(body: &mut BodySpec, settings: &Settings) -> Result<(), MjcfError> {
    let [low, high] = settings.inertiagrouprange;
    let mut parts = Vec::new();
    for geom in body.geoms.iter().filter(|g| (low..=high).contains(&g.shape.group)) {
        let (mass, inertia) = geom.mass_and_inertia()?;
        if mass > 0.0 {
            parts.push((mass, inertia, geom.shape.frame));
        }
    }
    match parts.as_slice() {
        [] => {}
        // the frame of a single geom is kept as it is
        &[(mass, inertia, frame)] => (body.mass, body.inertia, body.iframe) = (mass, inertia, frame),
        parts => {
            body.mass = parts.iter().map(|(mass, ..)| mass).sum();
            let weighted = parts.iter().fold([0.0; 3], |sum, (mass, _, frame)| add(sum, scale(frame.pos, *mass)));
            body.iframe.pos = scale(weighted, 1.0 / body.mass);
            let mut full = [0.0; 6];
            for (mass, inertia, frame) in parts {
                let own = rotate_diagonal(frame.quat, *inertia);
                let shift = offset_inertia(*mass, sub(frame.pos, body.iframe.pos));
                for (sum, (a, b)) in full.iter_mut().zip(own.into_iter().zip(shift)) {
                    *sum += a + b;
                }
            }
            (body.inertia, body.iframe.quat) = principal_axes(full);
            if !(body.inertia[2] >= EPS) {
                return Err(body.element.invalid("the inertia that follows from the geoms is not positive"));
            }
        }
    }
    Ok(())
}

/// Inertia of a point mass at `r`: the parallel axis theorem's second term.
fn offset_inertia(mass: f64, r: [f64; 3]) -> [f64; 6] {
    let [x, y, z] = r;
    [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z].map(|v| v * mass)
}

/// Bounds from below, the triangle inequality, and finite positive values.
fn check(body: &mut BodySpec, settings: &Settings) -> Result<(), MjcfError> {
    let element = body.inertial.as_ref().map_or(body.element, |i| i.element);
    body.mass = body.mass.max(settings.boundmass);
    body.inertia = body.inertia.map(|x| x.max(settings.boundinertia));
    if !body.mass.is_finite() || !body.inertia.iter().chain(&body.iframe.pos).all(|x| x.is_finite()) {
        return Err(element.invalid("the mass or inertia is too large"));
    }
    if body.mass < 0.0 || body.inertia.iter().any(|x| *x < 0.0) {
        return Err(element.invalid("mass and inertia must not be negative"));
    }
    let [a, b, c] = body.inertia;
    if a + b < c || a + c < b || b + c < a {
        if !settings.balanceinertia {
            let message = format!(
                "the moments of inertia {a} {b} {c} belong to no body: two of them must add up to at least the \
                 third; the compiler's balanceinertia=\"true\" replaces them by their mean"
            );
            return Err(element.invalid(message));
        }
        body.inertia = [(a + b + c) / 3.0; 3];
    }
    Ok(())
}

/// Every body with joints, or something rigidly attached to it, must have mass and inertia.
fn check_moving(bodies: &[BodySpec]) -> Result<(), MjcfError> {
    let mut heavy: Vec<bool> =
        bodies.iter().map(|b| b.mass >= MIN_VAL && b.inertia.iter().all(|x| *x >= MIN_VAL)).collect();
    // children come after their parents, so a backward pass carries the answer to the joint
    for i in (1..bodies.len()).rev() {
        if heavy[i] && bodies[i].joints.is_empty() {
            heavy[bodies[i].parent] = true;
        }
    }
    match (1..bodies.len()).find(|&i| !heavy[i] && !bodies[i].joints.is_empty()) {
        Some(i) => {
            let message = "a body that moves needs mass and inertia: give it a geom with mass or an <inertial>";
            Err(bodies[i].element.invalid(message))
        }
        None => Ok(()),
    }
}
