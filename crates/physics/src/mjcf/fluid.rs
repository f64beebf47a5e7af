//! `fluidshape="ellipsoid"`: coefficients of the medium's forces on a geom.

use super::error::MjcfError;
use super::value::Attrs;
use crate::model::{EllipsoidFluid, GeomType, Vec3};
use std::f64::consts::PI;

/// Blunt, slender and angular drag, Kutta and Magnus lift, unless the file gives others.
const COEFFICIENTS: [f64; 5] = [0.5, 0.25, 1.5, 1.0, 1.0];

/// The coefficients in the file, if the medium takes the geom for an ellipsoid.
pub(crate) fn read(attrs: &Attrs) -> Result<Option<[f64; 5]>, MjcfError> {
    let ellipsoid = attrs.keyword("fluidshape", &[("none", false), ("ellipsoid", true)])?.unwrap_or(false);
    let coefficients = attrs.partial_or("fluidcoef", COEFFICIENTS)?;
    Ok(ellipsoid.then_some(coefficients))
}

/// The coefficients of a geom; `None` if it has no volume. Those of the medium that moves along are Tuckerman's, for an ellipsoid with the geom's
/// lengths ("Inertia factors of ellipsoids for use in airship design", 1925).
pub(crate) fn ellipsoid(
    kind: GeomType,
    size: Vec3,
    [blunt, slender, angular, kutta, magnus]: [f64; 5],
) -> Option<EllipsoidFluid> {
    let [a, b, _] = size;
    let semiaxes = match kind {
        GeomType::Sphere => [a; 3],
        GeomType::Capsule => [a, a, a + b],
        GeomType::Cylinder => [a, a, b],
        _ => size,
    };
    if semiaxes.iter().any(|s| !(*s > 0.0)) {
        return None;
    }
    let of = |k: usize| [semiaxes[k], semiaxes[(k + 1) % 3], semiaxes[(k + 2) % 3]];
    let volume = 4.0 / 3.0 * PI * semiaxes[0] * semiaxes[1] * semiaxes[2];
    let kappa = [0, 1, 2].map(|k| kappa(of(k)));
    let virtual_mass = kappa.map(|k| volume * k / f64::max(f64::EPSILON, 2.0 - k));
    let virtual_inertia = [0, 1, 2].map(|k| {
        let [_, y, z] = of(k).map(|x| x * x);
        let more = kappa[(k + 2) % 3] - kappa[(k + 1) % 3];
        let (apart, sum) = (y - z, y + z);
        let below = (2.0 * apart - sum * more).abs();
        volume * apart * apart * more.abs() / f64::max(f64::EPSILON, below) / 5.0
    });
    let (drag, lift) = ([blunt, slender, angular], [kutta, magnus]);
    Some(EllipsoidFluid { semiaxes, drag, lift, virtual_mass, virtual_inertia })
}

/// Nodes of the 15-point Gauss-Kronrod rule on [0, 1/2]: as in MuJoCo, with eight digits.
const NODES: [f64; 8] = [0.00427231, 0.02544604, 0.06756779, 0.12923441, 0.20695638, 0.29707742, 0.39610752, 0.5];
/// Their weights.
const WEIGHTS: [f64; 8] =
    [0.01146766, 0.03154605, 0.05239501, 0.07032663, 0.08450236, 0.09517529, 0.10221647, 0.10474107];

/// `xyz` times the integral of `1 / sqrt((x^2 + l)^3 (y^2 + l) (z^2 + l))` over all `l > 0`, with MuJoCo's quadrature.
fn kappa([x, y, z]: Vec3) -> f64 {
    let scale = libm::pow(x * x * x * y * z, 0.4);
    let over = [x, y, z].map(|d| 1.0 / (d * d));
    let mut sum = 0.0;
    for i in 0..15 {
        let node = NODES[i.min(14 - i)];
        let (t, weight) = (if i < 8 { node } else { 1.0 - node }, WEIGHTS[i.min(14 - i)]);
        // l = t^3 / (1 - t)^2
        let rest = 1.0 - t;
        let l = scale * (t * t * t / (rest * rest));
        let rate = scale * (t * t * (3.0 - t) / (rest * rest * rest));
        let [dx, dy, dz] = over.map(|o| 1.0 + l * o);
        sum += rate / (dx * (dx * dy * dz).sqrt()) * weight;
    }
    sum * over[0]
}
