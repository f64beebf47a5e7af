//! Contacts between moving geoms and the static floor.
//!
//! A moving geom meets a plane in points that are known in advance: a sphere in one, a capsule in two, a box in its
//! corners. Each is a [`Candidate`]; all lanes walk the same list, and a lane that does not touch gets stiffness zero.

use crate::lanes::Real;
use crate::model::{Geom, GeomType, Model, Pair};
use crate::rigid::{self, BodyMount, quat_to_rot};
use crate::sim::{Sim, SimError, SimOptions, Softness, softness};
use crate::solver::{ContactRow, impedance};
use crate::spatial::*;
use crate::work::Work;

/// A point of a moving geom that may touch a level plane.
#[derive(Clone, Debug)]
pub(crate) struct Candidate<C> {
    pub link: usize,
    /// Geom index in the model.
    pub geom: usize,
    /// Center of the sphere that touches (radius 0 for a box corner), in the link's frame.
    pub point: [C; 3],
    pub radius: C,
    /// Capsule axis in the link's frame: the first tangent is its projection.
    pub axis: Option<[C; 3]>,
    /// Center of the box that this is a corner of, and the number of the corner among its eight.
    pub corner: Option<([C; 3], usize)>,
    /// Height of the plane.
    pub height: C,
    /// Friction along the two tangents; zero for a frictionless contact.
    pub mu: [C; 2],
    pub soft: Softness<C>,
}

/// Parameters of a contact between two geoms.
struct ContactParams {
    condim: usize,
    friction: [f64; 2],
    solref: [f64; 2],
    solimp: [f64; 5],
    /// Distance below which the constraint acts. (A gap only makes MuJoCo report contacts beyond it, without force.)
    margin: f64,
}

impl ContactParams {
    /// MuJoCo's combination rule: the geom of higher priority decides, equals are mixed.
    fn combine(a: &Geom, b: &Geom) -> Self {
        let margin = a.margin + b.margin;
        if a.priority != b.priority {
            let g = if a.priority > b.priority { a } else { b };
            let friction = [g.friction[0]; 2];
            return ContactParams { condim: g.condim, friction, solref: g.solref, solimp: g.solimp, margin };
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
        let friction = [a.friction[0].max(b.friction[0]); 2];
        ContactParams { condim: a.condim.max(b.condim), friction, solref, solimp, margin }
    }

    fn declared(pair: &Pair) -> Self {
        ContactParams {
            condim: pair.condim,
            friction: [pair.friction[0], pair.friction[1]],
            solref: pair.solref,
            solimp: pair.solimp,
            margin: pair.margin,
        }
    }
}

/// Lists the points where moving geoms may touch static planes; refuses collisions that are not simulated.
pub(crate) fn floor_candidates<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    link_of: &[Option<usize>],
    options: &SimOptions,
) -> Result<Vec<Candidate<T::Scalar>>, SimError> {
    let mut out = Vec::new();
    let link = |g: &Geom| link_of[mounts[g.body].body];
    for (i, a) in model.geoms.iter().enumerate() {
        for (j, b) in model.geoms.iter().enumerate().skip(i + 1) {
            let declared = model.pairs.iter().find(|p| p.geoms == [i, j] || p.geoms == [j, i]);
            if declared.is_none() && !may_collide(model, mounts, i, j) {
                continue;
            }
            let (fixed, moving, g) = match (link(a), link(b)) {
                (None, None) => continue,
                (None, Some(_)) => (a, b, j),
                (Some(_), None) => (b, a, i),
                (Some(_), Some(_)) if options.ground_contacts_only => continue,
                (Some(_), Some(_)) => {
                    return Err(SimError::Unsupported {
                        model: model.name.clone(),
                        what: format!("contact between the moving geoms {} and {}", label(model, i), label(model, j)),
                        remedy: "change their contype/conaffinity, or ask for ground contacts only".into(),
                    });
                }
            };
            let params = declared.map_or_else(|| ContactParams::combine(a, b), ContactParams::declared);
            add_candidates::<T>(model, mounts, fixed, moving, g, link(moving).expect("it moves"), &params, &mut out)?;
        }
    }
    // the candidates of a geom are neighbors; the order of planes within a geom stays
    out.sort_by_key(|c| c.geom);
    Ok(out)
}

/// "'name'", or the number of a nameless geom.
fn label(model: &Model, geom: usize) -> String {
    match model.geoms[geom].name.as_str() {
        "" => format!("#{geom} of body '{}'", model.bodies[model.geoms[geom].body].name),
        name => format!("'{name}'"),
    }
}

/// MuJoCo's filters: masks, same body, parent and child, excluded bodies.
fn may_collide(model: &Model, mounts: &[BodyMount], i: usize, j: usize) -> bool {
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
    !model.excludes.contains(&pair)
}

#[allow(clippy::too_many_arguments)]
fn add_candidates<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    fixed: &Geom,
    moving: &Geom,
    geom: usize,
    link: usize,
    params: &ContactParams,
    out: &mut Vec<Candidate<T::Scalar>>,
) -> Result<(), SimError> {
    let refuse = |what: String, remedy: &str| {
        Err(SimError::Unsupported { model: model.name.clone(), what, remedy: remedy.into() })
    };
    let static_index = model.geoms.iter().position(|g| std::ptr::eq(g, fixed)).unwrap_or(0);
    if fixed.kind != GeomType::Plane {
        return refuse(
            format!(
                "contact of the static {:?} {} with {}",
                fixed.kind,
                label(model, static_index),
                label(model, geom)
            ),
            "only planes are simulated as static geometry",
        );
    }
    let mount = &mounts[fixed.body];
    let plane = rigid::compose(&(mount.pos, mount.rot), &(fixed.pos, quat_to_rot(&fixed.quat)));
    if plane.1[2][2] < 1.0 - 1e-12 {
        return refuse(format!("the tilted plane {}", label(model, static_index)), "only level planes are simulated");
    }
    if params.condim != 1 && params.condim != 3 {
        return refuse(
            format!(
                "condim {} of the contact between {} and {}",
                params.condim,
                label(model, static_index),
                label(model, geom)
            ),
            "use condim 1 or 3",
        );
    }

    let mu = if params.condim == 1 { [0.0; 2] } else { params.friction };
    let invweight = model.bodies[moving.body].invweight0[0] + model.bodies[fixed.body].invweight0[0];
    // pyramid edges share R = 2 mu^2 (1 + mu^2) / invweight-scaled impedance (MuJoCo's mj_makeImpedance)
    let diag = if params.condim == 1 {
        // four coinciding edges of a flat pyramid carry a quarter each
        4.0 * invweight
    } else {
        2.0 * mu[0] * mu[0] / model.opt.impratio * invweight * (1.0 + mu[0] * mu[0])
    };
    let soft = softness::<T>(model, &params.solref, &params.solimp, params.margin, diag);

    let on_link = &mounts[moving.body];
    let frame = rigid::compose(&(on_link.pos, on_link.rot), &(moving.pos, quat_to_rot(&moving.quat)));
    let c3 = |v: [f64; 3]| [T::scalar(v[0]), T::scalar(v[1]), T::scalar(v[2])];
    let base = Candidate {
        link,
        geom,
        point: c3(frame.0),
        radius: T::scalar(moving.size[0]),
        axis: None,
        corner: None,
        height: T::scalar(plane.0[2]),
        mu: mu.map(T::scalar),
        soft,
    };
    match moving.kind {
        GeomType::Sphere => out.push(base),
        GeomType::Capsule => {
            let axis = frame.1[2];
            for side in [1.0, -1.0] {
                let h = side * moving.size[1];
                let point = [frame.0[0] + h * axis[0], frame.0[1] + h * axis[1], frame.0[2] + h * axis[2]];
                out.push(Candidate { point: c3(point), axis: Some(c3(axis)), ..base.clone() });
            }
        }
        GeomType::Box => {
            for i in 0..8 {
                let sign = |bit: usize, x: f64| if i & bit != 0 { x } else { -x };
                let local = [sign(1, moving.size[0]), sign(2, moving.size[1]), sign(4, moving.size[2])];
                let at = rigid::rotate(&frame.1, &local);
                let point = [frame.0[0] + at[0], frame.0[1] + at[1], frame.0[2] + at[2]];
                out.push(Candidate {
                    point: c3(point),
                    radius: T::scalar(0.0),
                    corner: Some((c3(frame.0), i)),
                    ..base.clone()
                });
            }
        }
        other => {
            return refuse(
                format!("contact of the {other:?} {} with the floor", label(model, geom)),
                "use spheres, capsules or boxes, or turn its contacts off",
            );
        }
    }
    Ok(())
}

/// Finds the contacts with the floor and writes their rows.
#[inline(always)]
pub(crate) fn collide<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    let zero = T::zero();
    work.contacts.clear();
    // corners of the present box that are already in contact, per lane
    let mut corners = zero;
    for (i, c) in sim.floor.iter().enumerate() {
        let tree = sim.links[c.link].tree;
        let (rot, pos, reference) = (&work.rot[c.link], &work.pos[c.link], &work.reference[tree]);
        let p: V3<T> = splat3(&c.point);
        let base = pos[2] + (reference[2] - T::splat(c.height));
        let height = rot[0][2].mul_add(p[0], rot[1][2].mul_add(p[1], rot[2][2].mul_add(p[2], base)));
        let dist = height - T::splat(c.radius);
        let mut on = dist.lt(T::splat(c.soft.margin));
        if let Some((center, number)) = &c.corner {
            // MuJoCo keeps the first four corners that are below the margin and not above the center
            if *number == 0 {
                corners = zero;
            }
            let q: V3<T> = splat3(center);
            let middle = rot[0][2].mul_add(q[0], rot[1][2].mul_add(q[1], rot[2][2].mul_add(q[2], base)));
            on = T::and(on, T::not(middle.lt(height)));
            on = T::and(on, corners.lt(T::lit(3.5)));
            corners += T::masked(on, T::lit(1.0));
        }
        work.touching[i] = on;
        work.normal_force[i] = zero;
        if !T::any(on) {
            continue;
        }
        work.touched[i] = T::or(work.touched[i], on);
        work.stats.contacts += T::bits(on).count_ones() as u64;
        work.stats.contact_rows += 1;
        let x = rot[0][0].mul_add(p[0], rot[1][0].mul_add(p[1], rot[2][0].mul_add(p[2], pos[0])));
        let y = rot[0][1].mul_add(p[0], rot[1][1].mul_add(p[1], rot[2][1].mul_add(p[2], pos[1])));
        // the contact point lies midway between the two surfaces
        let r = [x, y, dist.mul_add(T::lit(0.5), T::splat(c.height) - reference[2])];
        let (tx, ty) = tangent(c.axis.as_ref(), rot);
        let violation = dist - T::splat(c.soft.margin);
        let (imp, d) = impedance(&c.soft, violation);
        let vel = &work.vel[c.link];
        let v = cross_add(&ang(vel), &r, &lin(vel));
        let (v1, v2) = (v[0].mul_add(tx, v[1] * ty), v[1].mul_add(tx, -(v[0] * ty)));
        let b = T::splat(c.soft.b);
        let u0 = [v[2].mul_add(b, imp * violation * T::splat(c.soft.k)), v1 * b, v2 * b];
        work.contacts.push(ContactRow {
            link: c.link,
            candidate: i,
            r,
            tx,
            ty,
            mu: c.mu,
            d: T::masked(on, d),
            u0,
            u: u0,
            next: u0,
            force: [zero; 3],
            active: [T::none(); 4],
            on,
        });
    }
}

/// First tangent of the contact frame in the plane: the capsule's axis, else MuJoCo's choice, y.
#[inline(always)]
fn tangent<T: Real>(axis: Option<&[T::Scalar; 3]>, rot: &Rot<T>) -> (T, T) {
    let (zero, one) = (T::zero(), T::lit(1.0));
    match axis {
        None => (zero, one),
        Some(axis) => {
            let a = rotate(rot, &splat3(axis));
            let n2 = a[0].mul_add(a[0], a[1] * a[1]);
            // an upright capsule has no direction in the plane
            let ok = T::lit(1e-12).lt(n2);
            let inv = one.div(T::select(ok, n2, one).sqrt());
            (T::select(ok, a[0] * inv, one), T::select(ok, a[1] * inv, zero))
        }
    }
}
