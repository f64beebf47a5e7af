//! Geoms that may touch: the list of possible contacts, created once per model.
//!
//! Points of spheres, capsules and boxes above a level plane are the common case and have their own list
//! ([`floor_points`]). [`pairs`] lists everything else.

use super::broad::Broad;
use super::contact_params::{ContactParams, declared, label, may_collide};
use super::floor_points::{self, FloorPoint};
use super::link::Mount;
use super::options::{SimError, SimOptions};
use super::pairs::{self, Cull, GeomPair, GeomPairOf, PairSpec, Paired, ShapePair};
use super::weld::BodyMount;
use crate::budget::{MEMORY, OverBudget};
use crate::lanes::Real;
use crate::model::{Geom, GeomType, Model};
use std::collections::{BTreeMap, BTreeSet};

/// All possible contacts.
#[derive(Clone, Debug)]
pub(crate) struct Contacts<C> {
    /// Points above level planes.
    pub floor: Vec<FloorPoint<C>>,
    /// Other pairs of geoms, sorted by kind.
    pub pairs: Vec<GeomPair>,
    /// Parameters of those pairs, by kind.
    pub specs: Vec<PairSpec<C>>,
    /// Geoms of those pairs.
    pub paired: Vec<Paired<C>>,
    /// Whether each group [keeps](crate::state::Group) the distances of pairs.
    pub kept: bool,
    /// Least [reach](PairSpec::reach) of two geoms that balls bound.
    pub least_reach: C,
    /// Per pair: its number among those of convex shapes of which a group keeps poses.
    pub search: Vec<Option<u32>>,
    /// Number of these.
    pub searches: usize,
    /// Links and, after those, mocap bodies of which such a geom is [turning](Paired::turning).
    pub turning: Vec<usize>,
    /// Whether some are [hard](super::weights::is_hard).
    pub hard: bool,
    /// The broad phase of those pairs, if they are many.
    pub broad: Option<Broad<C>>,
}

/// Maximum number of geoms that may collide: the time to compare them grows with the square of their number.
const MOST_GEOMS: usize = 50_000;
/// Bytes per pair, including the overhead of growing the list, sorting it and the broad phase.
const PAIR: usize = 4 * size_of::<GeomPair>();
/// Number of pairs between two checks of the memory.
const LOOK: usize = 1 << 16;

impl<C: Real> Contacts<C> {
    /// No contacts.
    pub fn none() -> Self {
        Contacts {
            floor: Vec::new(),
            pairs: Vec::new(),
            specs: Vec::new(),
            paired: Vec::new(),
            kept: false,
            least_reach: C::zero(),
            search: Vec::new(),
            searches: 0,
            turning: Vec::new(),
            hard: false,
            broad: None,
        }
    }
}

impl<C> Contacts<C> {
    /// Checks the memory of the lists against the limit, once per `LOOK` pairs.
    fn check(&self) -> Result<(), OverBudget> {
        match self.pairs.len() % LOOK {
            0 => MEMORY.check((self.pairs.len() * PAIR + self.specs.len() * 2 * size_of::<PairSpec<C>>()) as f64),
            _ => Ok(()),
        }
    }

    /// A pair by its index.
    #[inline(always)]
    pub fn pair<'a>(&'a self, geoms: &[Mount<C>], index: usize) -> GeomPairOf<'a, C> {
        let pair = &self.pairs[index];
        let ends = pair.geoms.map(|g| g as usize);
        let spec = &self.specs[pair.spec as usize];
        GeomPairOf { geoms: ends, links: ends.map(|g| geoms[g].link), spec }
    }
}

/// Lists the contacts of a model. Refuses unsupported ones. `link_of` numbers the moving bodies, `tree_of` their trees.
pub(super) fn contacts<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    link_of: &[Option<usize>],
    tree_of: &[usize],
    options: &SimOptions,
) -> Result<Contacts<T::Scalar>, SimError> {
    // one function: the pairs of shapes in order
    let mut out = Contacts::none();
    if !(model.opt.flags.contact && model.opt.flags.constraint) {
        return Ok(out);
    }
    let refuse = |what: String, remedy: &str| {
        Err(SimError::Unsupported { model: model.name.clone(), what, remedy: remedy.into() })
    };
    let link = |g: usize| link_of[mounts[model.geoms[g].body].body];
    let excluded: BTreeSet<[usize; 2]> = model.excludes.iter().copied().collect();
    let declared = declared(model);
    let kinds = kinds(model, mounts, link);
    // common parameters of pairs of two kinds; a crowd has few kinds of geoms
    let mut known: BTreeMap<[usize; 2], u32> = BTreeMap::new();
    // visual geoms never collide
    let mut able: Vec<bool> = model.geoms.iter().map(|g| g.contype != 0 || g.conaffinity != 0).collect();
    declared.keys().flatten().for_each(|g| able[*g] = true);
    let able: Vec<usize> = (0..able.len()).filter(|g| able[*g]).collect();
    if able.len() > MOST_GEOMS {
        return refuse(
            format!("contact of {} geoms", able.len()),
            &format!("at most {MOST_GEOMS} may collide; turn contacts off with contype and conaffinity"),
        );
    }
    for (at, i) in able.iter().copied().enumerate() {
        for j in able[at + 1..].iter().copied() {
            let declared = declared.get(&[i, j]);
            if declared.is_none() && !may_collide(model, mounts, &excluded, i, j) {
                continue;
            }
            match (link(i), link(j)) {
                (None, None) => continue,
                // forces of a declared pair within one link cancel
                (Some(a), Some(b)) if a == b => continue,
                (Some(_), Some(_)) if options.ground_contacts_only => continue,
                _ => {}
            }
            // in the order of MuJoCo's shape types
            let (a, b) = if rank(model.geoms[i].kind) <= rank(model.geoms[j].kind) { (i, j) } else { (j, i) };
            let (a, b) = if model.obstacles == Some(b) { (b, a) } else { (a, b) };
            let geoms = [a as u32, b as u32];
            let tree = |g: usize| link(g).map(|l| tree_of[l]);
            let across = tree(a) != tree(b);
            out.check().map_err(|over| SimError::Budget { model: model.name.clone(), over })?;
            if let (None, Some(spec)) = (declared, known.get(&[kinds[a], kinds[b]])) {
                out.pairs.push(GeomPair { geoms, spec: *spec, across });
                continue;
            }
            let declarations = declared.map_or(vec![None], |numbers| numbers.iter().copied().map(Some).collect());
            for number in declarations {
                let params = ContactParams::of::<T>(model, i, j, number);
                if floor_points::add::<T>(model, mounts, (a, b), link(b), &params, &mut out.floor, &mut out.hard) {
                    continue;
                }
                if !pairs::add::<T>(model, mounts, [a, b], [link(a), link(b)], &params, &mut out.specs, &mut out.hard) {
                    let (ka, kb) = (model.geoms[a].kind, model.geoms[b].kind);
                    return refuse(
                        format!("contact of the {ka:?} {} with the {kb:?} {}", label(model, a), label(model, b)),
                        "fix planes and height fields to the world, or turn the contact off with contype and conaffinity",
                    );
                }
                let spec = out.specs.len() as u32 - 1;
                if !model.opt.flags.nativeccd && out.specs[spec as usize].shapes.iterates() {
                    let (ka, kb) = (model.geoms[a].kind, model.geoms[b].kind);
                    let (first, second) = (label(model, a), label(model, b));
                    return refuse(
                        format!("nativeccd=\"disable\" with contact of the {ka:?} {first} with the {kb:?} {second}"),
                        "remove the flag: libccd, which it selects, finds other contacts",
                    );
                }
                out.pairs.push(GeomPair { geoms, spec, across });
                if number.is_none() {
                    known.insert([kinds[a], kinds[b]], spec);
                }
            }
        }
    }
    // the candidates of a geom are adjacent; the order of planes within a geom stays
    out.floor.sort_by_key(|c| c.geom);
    // slots of one class are filled together
    out.pairs.sort_by_key(|p| out.specs[p.spec as usize].class());
    let mut meets = vec![false; model.geoms.len()];
    out.pairs.iter().flat_map(|p| p.geoms).for_each(|g| meets[g as usize] = true);
    let carrier = |g: usize| link(g).or(mounts[model.geoms[g].body].mocap.map(|k| tree_of.len() + k));
    list_geoms::<T>(model, &meets, carrier, &mut out);
    let group = |g: usize| link(g).map(|l| tree_of[l]);
    out.broad = Broad::of(&out.paired, &out.pairs, &out.specs, tree_of.iter().max().map_or(0, |t| t + 1), group);
    out.kept = out.broad.is_none() && (1..=MOST_KEPT).contains(&out.pairs.len());
    let balls = out.specs.iter().filter(|spec| spec.cull == Cull::Balls);
    out.least_reach = balls.fold(T::scalar(f64::INFINITY), |least, spec| spec.reach.min(least));
    Ok(out)
}

/// Lists the geoms of pairs, and the links and mocap bodies whose turns matter.
fn list_geoms<T: Real>(
    model: &Model,
    meets: &[bool],
    carrier: impl Fn(usize) -> Option<usize>,
    out: &mut Contacts<T::Scalar>,
) {
    let mut whole = vec![false; model.geoms.len()];
    for pair in &out.pairs {
        let convex = out.specs[pair.spec as usize].shapes == ShapePair::Convex;
        if convex {
            pair.geoms.iter().for_each(|g| whole[*g as usize] = true);
        }
        let seen = convex && out.searches < MOST_SEEN;
        out.search.push(seen.then_some(out.searches as u32));
        out.searches += usize::from(seen);
    }
    for g in (0..meets.len()).filter(|g| meets[*g]) {
        let geom = &model.geoms[g];
        let half = if geom.kind == GeomType::Capsule { geom.size[1] } else { 0.0 };
        let turning = match carrier(g) {
            Some(l) if whole[g] && !matches!(geom.kind, GeomType::Capsule | GeomType::Sphere) => {
                let known = out.turning.iter().position(|x| *x == l);
                let i = known.unwrap_or_else(|| {
                    out.turning.push(l);
                    out.turning.len() - 1
                });
                Some((i, T::scalar(pairs::radius(model, geom))))
            }
            _ => None,
        };
        out.paired.push(Paired { geom: g, half: T::scalar(half), turning });
    }
}

/// Largest number of pairs whose distances, and of pairs of convex shapes whose poses are kept: every group has memory for them.
const MOST_KEPT: usize = 1 << 14;
const MOST_SEEN: usize = 1 << 11;

/// Number of geoms from which a model counts as a crowd.
const CROWD: usize = 200;

/// Rounds a number to twelve digits.
fn rounded(x: f64) -> f64 {
    const LOST: u64 = 1 << 12;
    f64::from_bits((x.to_bits() + LOST / 2) & !(LOST - 1))
}

/// Numbers of the geoms' kinds. Equal geoms of equal moving bodies have the same kind, regardless of names and parents.
/// In a crowd, inverse weights that differ only by rounding count as equal. Otherwise copies of a body at other
/// positions would all have different kinds.
fn kinds(model: &Model, mounts: &[BodyMount], link: impl Fn(usize) -> Option<usize>) -> Vec<usize> {
    let mut numbers: BTreeMap<Vec<u64>, usize> = BTreeMap::new();
    let mut kind = |(index, g): (usize, &Geom)| {
        let body = &model.bodies[g.body];
        let alone = if link(index).is_some() { 0 } else { index as u64 + 1 };
        let hull = g.hull.map_or(0, |h| h as u64 + 1);
        let mut key = vec![alone, hull, g.kind as u64, g.condim as u64, g.priority as u64];
        let single = [g.margin, g.solmix, body.mass];
        let shape = [&g.size[..], &g.pos, &g.quat, &g.friction, &g.solref, &g.solimp, &single];
        let [w, v] = body.invweight0;
        let weights = [w, v, mounts[g.body].spread];
        let weights = if model.geoms.len() < CROWD { weights } else { weights.map(rounded) };
        let carrier = [&weights[..], &body.ipos, &body.iquat, &body.inertia];
        key.extend(shape.into_iter().chain(carrier).flatten().map(|x| x.to_bits()));
        let next = numbers.len();
        *numbers.entry(key).or_insert(next)
    };
    model.geoms.iter().enumerate().map(&mut kind).collect()
}

/// Rank in MuJoCo's order of shape types.
pub(crate) fn rank(kind: GeomType) -> usize {
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

#[cfg(test)]
mod tests {
    use crate::model::Model;
    use crate::sim::{Sim, SimOptions};

    #[test]
    fn contacts_that_need_libccd_are_refused() {
        let load = |fixed: &str, moving: &str| {
            let text = format!(
                r#"<mujoco><option><flag nativeccd="disable"/></option><asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset>
                <worldbody><geom name="f" {fixed}/><body><freejoint/><geom name="m" {moving}/></body></worldbody></mujoco>"#
            );
            let model = Model::from_xml_str(&text, "libccd").expect("a model");
            Sim::<f32>::new(&model, SimOptions::default()).map(|_| ()).map_err(|e| e.to_string())
        };
        let shape = |kind: &str| format!(r#"type="{kind}" size="0.1 0.1 0.1""#);
        for kind in ["sphere", "capsule", "ellipsoid", "cylinder", "box"] {
            assert_eq!(load(&shape("plane"), &shape(kind)), Ok(()), "{kind}");
            let error = load(r#"type="hfield" hfield="h""#, &shape(kind)).unwrap_err();
            assert!(error.contains("nativeccd=\"disable\" with contact of the Hfield 'f' with the"), "{error}");
        }
        for kind in ["sphere", "box"] {
            assert_eq!(load(&shape("box"), &shape(kind)), Ok(()), "{kind}");
        }
        let error = load(&shape("box"), &shape("cylinder")).unwrap_err();
        assert!(error.contains("contact of the Cylinder 'm' with the Box 'f'"), "{error}");
    }
}
