//! Selection of colliding geoms, and their contact parameters.

use super::weld::BodyMount;
use crate::lanes::Real;
use crate::model::{Cone, Geom, Model, Pair};
use std::collections::{BTreeMap, BTreeSet};

/// Smallest friction coefficient (MuJoCo's `mjMINMU`).
const LEAST_FRICTION: f64 = 1e-5;
/// Smallest sliding coefficient of a pyramid in single precision. The stiffness of its edges grows with the inverse square, and
/// bodies sink through the ground at 1e-3.
const LEAST_OF_PYRAMIDS: f64 = 1e-2;

/// Smallest sliding coefficient of contacts in a precision.
pub(crate) fn least_sliding<T: Real>(elliptic: bool) -> f64 {
    if elliptic || T::EPSILON < 1e-10 { LEAST_FRICTION } else { LEAST_OF_PYRAMIDS }
}

/// Parameters of a contact between two geoms.
pub(super) struct ContactParams {
    /// Number of the declared pair, if it is one.
    pub declared: Option<usize>,
    pub condim: usize,
    /// Two sliding, one torsional, two rolling coefficients.
    pub friction: [f64; 5],
    pub solref: [f64; 2],
    pub solimp: [f64; 5],
    /// Distance below which the constraint acts. (A gap only makes MuJoCo report contacts beyond it, without force.)
    pub margin: f64,
}

impl ContactParams {
    /// Contact parameters of the colliding geoms `i` and `j` in a precision, from the declared pair with that number if there is
    /// one.
    pub fn of<T: Real>(model: &Model, i: usize, j: usize, declared: Option<usize>) -> Self {
        let mut params = match declared {
            Some(number) => ContactParams { declared, ..ContactParams::declared(&model.pairs[number]) },
            None => ContactParams::combine(&model.geoms[i], &model.geoms[j]),
        };
        if let Some(all) = &model.opt.contact_override {
            params.margin = all.margin;
            params.solref = all.solref;
            params.solimp = all.solimp;
            params.friction = all.friction;
        }
        params.friction = params.friction.map(|f| f.max(LEAST_FRICTION));
        let least = least_sliding::<T>(model.opt.cone == Cone::Elliptic);
        params.friction[..2].iter_mut().for_each(|f| *f = f.max(least));
        params
    }

    /// MuJoCo's combination rule: the geom of higher priority wins; equal priorities are mixed.
    fn combine(a: &Geom, b: &Geom) -> Self {
        let margin = a.margin + b.margin;
        if a.priority != b.priority {
            let g = if a.priority > b.priority { a } else { b };
            let friction = spread(&g.friction);
            return ContactParams {
                declared: None,
                condim: g.condim,
                friction,
                solref: g.solref,
                solimp: g.solimp,
                margin,
            };
        }
        const TINY: f64 = 1e-15;
        let mix = match (a.solmix >= TINY, b.solmix >= TINY) {
            (true, true) => a.solmix / (a.solmix + b.solmix),
            (false, false) => 0.5,
            (true, false) => 1.0,
            (false, true) => 0.0,
        };
        let blend = |x: f64, y: f64| mix * x + (1.0 - mix) * y;
        let standard = a.solref[0] > 0.0 && b.solref[0] > 0.0;
        let mut solref = [0.0; 2];
        for i in 0..2 {
            let (x, y) = (a.solref[i], b.solref[i]);
            solref[i] = if standard { blend(x, y) } else { x.min(y) };
        }
        let mut solimp = [0.0; 5];
        for i in 0..5 {
            solimp[i] = blend(a.solimp[i], b.solimp[i]);
        }
        let mut friction = [0.0; 3];
        for i in 0..3 {
            friction[i] = a.friction[i].max(b.friction[i]);
        }
        ContactParams {
            declared: None,
            condim: a.condim.max(b.condim),
            friction: spread(&friction),
            solref,
            solimp,
            margin,
        }
    }

    fn declared(pair: &Pair) -> Self {
        ContactParams {
            declared: None,
            condim: pair.condim,
            friction: pair.friction,
            solref: pair.solref,
            solimp: pair.solimp,
            margin: pair.margin,
        }
    }
}

/// A geom's sliding, torsional and rolling friction as a contact's five coefficients.
fn spread(f: &[f64; 3]) -> [f64; 5] {
    [f[0], f[0], f[1], f[2], f[2]]
}

/// The numbers of the declared pairs by their geoms, the lower number first. Filters do not apply to them. A pair that is
/// declared twice touches twice.
pub(super) fn declared(model: &Model) -> BTreeMap<[usize; 2], Vec<usize>> {
    let mut pairs: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
    for (number, pair) in model.pairs.iter().enumerate() {
        let [i, j] = pair.geoms;
        pairs.entry([i.min(j), i.max(j)]).or_default().push(number);
    }
    pairs
}

/// MuJoCo's filters: masks, same body, parent and child, `excluded` bodies.
pub(super) fn may_collide(
    model: &Model,
    mounts: &[BodyMount],
    excluded: &BTreeSet<[usize; 2]>,
    i: usize,
    j: usize,
) -> bool {
    let (a, b) = (&model.geoms[i], &model.geoms[j]);
    if a.contype & b.conaffinity == 0 && b.contype & a.conaffinity == 0 {
        return false;
    }
    let (wa, wb) = (mounts[a.body].body, mounts[b.body].body);
    if wa == wb {
        return false;
    }
    let parent = |w: usize| mounts[model.bodies[w].parent].body;
    if model.opt.flags.filterparent && wa != 0 && wb != 0 && (parent(wa) == wb || parent(wb) == wa) {
        return false;
    }
    let pair = [a.body.min(b.body), a.body.max(b.body)];
    !excluded.contains(&pair)
}

/// "'name'", or the index of a nameless geom.
pub(super) fn label(model: &Model, geom: usize) -> String {
    match model.geoms[geom].name.as_str() {
        "" => match model.bodies[model.geoms[geom].body].name.as_str() {
            "" => format!("#{geom}"),
            body => format!("#{geom} of body '{body}'"),
        },
        name => format!("'{name}'"),
    }
}
