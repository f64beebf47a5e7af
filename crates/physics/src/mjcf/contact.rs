//! `<contact>`: declared geom pairs and excluded body pairs.

use super::defaults::Defaults;
use super::document::Element;
use super::error::MjcfError;
use super::names::{Names, Registry};
use super::settings::entries;
use super::solver_params::{SOLIMP, SOLREF};
use super::value::Attrs;
use crate::model::{Geom, GeomType, Pair};

/// Parameters of a `<pair>`; they do not depend on the geoms.
fn parameters(attrs: &Attrs) -> Result<Pair, MjcfError> {
    let condim = attrs.integer_or("condim", 3)?;
    if !matches!(condim, 1 | 3 | 4 | 6) {
        return Err(attrs.element.invalid(format!("condim is {condim}; expected 1, 3, 4 or 6")));
    }
    Ok(Pair {
        geoms: [0; 2],
        condim: condim as usize,
        friction: attrs.partial_or("friction", [1.0, 1.0, 0.005, 0.0001, 0.0001])?,
        solref: attrs.partial_or("solref", SOLREF)?,
        solimp: attrs.partial_or("solimp", SOLIMP)?,
        margin: attrs.number_or("margin", 0.0)?,
        gap: attrs.number_or("gap", 0.0)?,
    })
}

/// Checks the values of a `<pair>` that sets defaults.
pub(crate) fn check_default(attrs: &Attrs) -> Result<(), MjcfError> {
    parameters(attrs).map(|_| ())
}

/// Declared pairs, ordered by their bodies; within a pair the geom of the lower body comes first.
pub(crate) fn pairs(
    root: &Element,
    defaults: &Defaults,
    names: &Registry,
    geoms: &[Geom],
) -> Result<Vec<Pair>, MjcfError> {
    let elements = || entries(root, "contact").filter(|e| e.name == "pair");
    Names::collect("contact pair", elements())?;
    let mut pairs = Vec::new();
    for element in elements() {
        let mut pair = parameters(&defaults.attrs(element, None)?)?;
        pair.geoms = [names.geoms.required(element, "geom1")?, names.geoms.required(element, "geom2")?];
        let missing = |g: &usize| geoms[*g].kind == GeomType::Mesh && geoms[*g].mesh.is_none();
        if let Some(geom) = pair.geoms.iter().find(|g| missing(g)) {
            let name = &geoms[*geom].name;
            return Err(element.invalid(format!("geom '{name}' collides, but the file of its mesh is missing")));
        }
        if geoms[pair.geoms[0]].body > geoms[pair.geoms[1]].body {
            pair.geoms.reverse();
        }
        pairs.push(pair);
    }
    pairs.sort_by_key(|p| p.geoms.map(|g| geoms[g].body));
    Ok(pairs)
}

/// Excluded body pairs, lower body first, in ascending order.
pub(crate) fn excludes(root: &Element, names: &Registry) -> Result<Vec<[usize; 2]>, MjcfError> {
    let elements = || entries(root, "contact").filter(|e| e.name == "exclude");
    Names::collect("contact exclude", elements())?;
    let mut excludes = Vec::new();
    for element in elements() {
        let mut pair = [names.bodies.required(element, "body1")?, names.bodies.required(element, "body2")?];
        pair.sort_unstable();
        excludes.push(pair);
    }
    excludes.sort_unstable();
    Ok(excludes)
}
