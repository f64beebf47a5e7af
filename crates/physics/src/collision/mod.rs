//! Contacts: which geoms may touch, where they do, and the rows that follow.
//!
//! The list of pairs is made once per model ([`Contacts`]). Points of spheres, capsules and boxes above a level plane
//! are the common case and have their own list ([`floor`]); everything else is listed by [`pairs`] and
//! found by [`meet`].

mod clearance;
mod floor;
mod meet;
mod pairs;
mod params;
mod slots;

pub(crate) use clearance::Clearances;
pub(crate) use floor::collide_floor;
pub(crate) use meet::collide_pairs;

use crate::lanes::Real;
use crate::model::{Geom, GeomType, Model};
use crate::rigid::BodyMount;
use crate::sim::{SimError, SimOptions};
use floor::Candidate;
use pairs::PairSpec;
use params::{ContactParams, label};

/// Everything that may touch.
#[derive(Clone, Debug)]
pub(crate) struct Contacts<C> {
    /// Points above level planes.
    pub floor: Vec<Candidate<C>>,
    /// Other pairs of geoms, those of a kind next to each other.
    pub pairs: Vec<PairSpec<C>>,
    /// Geoms of those pairs.
    pub paired: Vec<Paired<C>>,
    /// Some are [hard](crate::rigid::is_hard).
    pub hard: bool,
}

/// A geom that meets others.
#[derive(Clone, Debug)]
pub(crate) struct Paired<C> {
    pub geom: usize,
    /// Length on either side of the center along the third axis, of a capsule; else 0, and it is a ball that bounds it.
    pub half: C,
}

impl<C> Contacts<C> {
    /// No contacts.
    pub fn none() -> Self {
        Contacts { floor: Vec::new(), pairs: Vec::new(), paired: Vec::new(), hard: false }
    }
}

/// Lists the contacts of a model; refuses those that are not simulated.
pub(crate) fn contacts<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    link_of: &[Option<usize>],
    options: &SimOptions,
) -> Result<Contacts<T::Scalar>, SimError> {
    let mut out = Contacts::none();
    let refuse = |what: String, remedy: &str| {
        Err(SimError::Unsupported { model: model.name.clone(), what, remedy: remedy.into() })
    };
    let link = |g: usize| link_of[mounts[model.geoms[g].body].body];
    for i in 0..model.geoms.len() {
        for j in i + 1..model.geoms.len() {
            let Some(params) = ContactParams::of(model, mounts, i, j) else { continue };
            match (link(i), link(j)) {
                (None, None) => continue,
                // what a declared pair of one link exerts on one geom it takes from the other
                (Some(a), Some(b)) if a == b => continue,
                (Some(_), Some(_)) if options.ground_contacts_only => continue,
                _ => {}
            }
            // in the order of MuJoCo's shape types
            let (a, b) = if rank(model.geoms[i].kind) <= rank(model.geoms[j].kind) { (i, j) } else { (j, i) };
            if floor::add::<T>(model, mounts, (a, b), link(b), &params, &mut out) {
                continue;
            }
            if !pairs::add::<T>(model, mounts, [a, b], [link(a), link(b)], &params, &mut out) {
                let (ka, kb) = (model.geoms[a].kind, model.geoms[b].kind);
                return refuse(
                    format!("contact of the {ka:?} {} with the {kb:?} {}", label(model, a), label(model, b)),
                    "use spheres, capsules or boxes, or turn the contact off with contype and conaffinity",
                );
            }
        }
    }
    // the candidates of a geom are neighbors; the order of planes within a geom stays
    out.floor.sort_by_key(|c| c.geom);
    // slots of one class are filled together
    out.pairs.sort_by_key(|p| p.class());
    let mut paired: Vec<usize> = out.pairs.iter().flat_map(|p| p.geoms).collect();
    paired.sort_unstable();
    paired.dedup();
    let half = |g: &Geom| if g.kind == GeomType::Capsule { g.size[1] } else { 0.0 };
    out.paired = paired.into_iter().map(|g| Paired { geom: g, half: T::scalar(half(&model.geoms[g])) }).collect();
    Ok(out)
}

/// Place in MuJoCo's order of shape types.
fn rank(kind: GeomType) -> usize {
    match kind {
        GeomType::Plane => 0,
        GeomType::Hfield => 1,
        GeomType::Sphere => 2,
        GeomType::Capsule => 3,
        GeomType::Ellipsoid => 4,
        GeomType::Cylinder => 5,
        GeomType::Box => 6,
        GeomType::Mesh => 7,
    }
}
