//! Contacts between any two geoms: moving bodies with each other, and with terrain.
//!
//! Every pair is culled by bounding balls in all lanes at once; what comes near goes through [`crate::narrow`]. A
//! contact then takes the next free slot of its own lane, in the order of the pairs, so that the rows of a lane depend
//! on that lane alone.

use super::params::ContactParams;
use crate::lanes::Real;
use crate::model::{Cone, Geom, GeomType, Model};
use crate::narrow::{self, Touch, Touches};
use crate::rigid::BodyMount;
use crate::sim::{Mount, Sim};
use crate::solver::block::{Block, Cost, Jacobian, Source};
use crate::solver::softness::{Softness, impedance, softness};
use crate::spatial::*;
use crate::work::{Group, Work};

/// Function that finds the contacts of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Test {
    PlaneSphere,
    PlaneCapsule,
    PlaneBox,
    PlaneCylinder,
    PlaneEllipsoid,
    SphereSphere,
    SphereCapsule,
    SphereBox,
    SphereCylinder,
    CapsuleCapsule,
    CapsuleBox,
    BoxBox,
    FieldCapsule,
    FieldBox,
}

impl Test {
    fn of(a: GeomType, b: GeomType) -> Option<Test> {
        use GeomType as G;
        Some(match (a, b) {
            (G::Plane, G::Sphere) => Test::PlaneSphere,
            (G::Plane, G::Capsule) => Test::PlaneCapsule,
            (G::Plane, G::Box) => Test::PlaneBox,
            (G::Plane, G::Cylinder) => Test::PlaneCylinder,
            (G::Plane, G::Ellipsoid) => Test::PlaneEllipsoid,
            (G::Sphere, G::Sphere) => Test::SphereSphere,
            (G::Sphere, G::Capsule) => Test::SphereCapsule,
            (G::Sphere, G::Box) => Test::SphereBox,
            (G::Sphere, G::Cylinder) => Test::SphereCylinder,
            (G::Capsule, G::Capsule) => Test::CapsuleCapsule,
            (G::Capsule, G::Box) => Test::CapsuleBox,
            (G::Box, G::Box) => Test::BoxBox,
            (G::Hfield, G::Sphere | G::Capsule) => Test::FieldCapsule,
            (G::Hfield, G::Box) => Test::FieldBox,
            _ => return None,
        })
    }
}

/// What decides whether a pair can touch at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cull {
    /// Balls around both.
    Balls,
    /// The first is a plane.
    Plane,
    /// The first is a height field: nothing touches it above its highest point.
    Field,
}

/// Two geoms that may touch.
#[derive(Clone, Debug)]
pub(crate) struct PairSpec<C> {
    /// In MuJoCo's order: the normal points from the first to the second.
    pub geoms: [usize; 2],
    links: [Option<usize>; 2],
    sizes: [[C; 3]; 2],
    test: Test,
    /// Height field of the first.
    field: usize,
    cull: Cull,
    /// Distance beyond which they cannot touch: of the centers, or of the second's center from the plane.
    reach: C,
    margin: C,
    dim: usize,
    cost: Cost,
    friction: [C; 5],
    /// Regularized slope of an elliptic cone.
    slope: C,
    soft: Softness<C>,
    /// Stiffness of the rows in units of the first row's.
    ratios: [C; 6],
}

impl<C> PairSpec<C> {
    /// Contacts of a class share slots.
    pub fn class(&self) -> (bool, usize) {
        (self.coupled(), self.dim)
    }

    /// The geom that moves, of a pair with the static world.
    pub fn moving(&self) -> usize {
        self.geoms[if self.links[1].is_some() { 1 } else { 0 }]
    }

    /// Both geoms move.
    pub fn coupled(&self) -> bool {
        self.links[0].is_some() && self.links[1].is_some()
    }
}

/// Adds a pair of geoms. Returns false if their contacts are not simulated.
pub(super) fn add<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    geoms: [usize; 2],
    links: [Option<usize>; 2],
    params: &ContactParams,
    out: &mut Vec<PairSpec<T::Scalar>>,
) -> bool {
    let c = T::scalar;
    let [a, b] = geoms.map(|g| &model.geoms[g]);
    let Some(test) = Test::of(a.kind, b.kind) else { return false };
    // planes and fields that move are not simulated
    if matches!(a.kind, GeomType::Plane | GeomType::Hfield) && mounts[a.body].body != 0 {
        return false;
    }
    let invweight = model.bodies[a.body].invweight0[0] + model.bodies[b.body].invweight0[0];
    let (impratio, friction) = (model.opt.impratio, params.friction);
    let mu = friction[0] / impratio.sqrt();
    let mut ratios = [1.0; 6];
    let (cost, diag) = match (params.condim, model.opt.cone) {
        (1, _) => (Cost::Push, invweight),
        // the edges of a pyramid share R = 2 mu^2 (1 + mu0^2) / impedance (MuJoCo's mj_makeImpedance)
        (_, Cone::Pyramidal) => (Cost::Pyramid, 2.0 * mu * mu * invweight * (1.0 + friction[0] * friction[0])),
        (_, Cone::Elliptic) => {
            for k in 1..6 {
                ratios[k] = impratio * (friction[k - 1] / friction[0]).powi(2);
            }
            (Cost::Elliptic, invweight)
        }
    };
    let cull = match a.kind {
        GeomType::Plane => Cull::Plane,
        GeomType::Hfield => Cull::Field,
        _ => Cull::Balls,
    };
    let radius = |g: &Geom| narrow::bounding_radius(g.kind, &g.size);
    out.push(PairSpec {
        geoms,
        links,
        sizes: [a.size.map(c), b.size.map(c)],
        test,
        field: a.hfield.unwrap_or(0),
        cull,
        reach: c(if cull == Cull::Balls { radius(a) } else { 0.0 } + radius(b) + params.margin),
        margin: c(params.margin),
        dim: params.condim,
        cost,
        friction: friction.map(c),
        slope: c(mu),
        soft: softness::<T>(model, &params.solref, &params.solimp, params.margin, diag),
        ratios: ratios.map(c),
    });
    true
}

/// Height field in lane precision, with its place in the world.
#[derive(Clone, Debug)]
pub(crate) struct Field<C: Real> {
    pub grid: narrow::height::HeightField<C>,
}

impl<C: Real> Field<C> {
    /// The same grid with other elevations, m.
    ///
    /// # Panics
    /// If their number is not that of the grid.
    pub fn with_elevations(&self, elevations: &[f32]) -> Self {
        let grid = &self.grid;
        assert_eq!(elevations.len(), grid.rows * grid.cols, "one elevation per point of the grid");
        let top = elevations.iter().fold(0.0f64, |m, x| m.max(f64::from(*x)));
        let heights = elevations.iter().map(|x| C::lit(f64::from(*x))).collect();
        Field { grid: narrow::height::HeightField { heights, top: C::lit(top), ..grid.clone() } }
    }
}

/// Height fields of a model.
pub(crate) fn fields<C: Real>(model: &Model) -> Vec<Field<C>> {
    model
        .hfields
        .iter()
        .map(|h| {
            let heights: Vec<C> = h.data.iter().map(|x| C::lit(f64::from(*x) * h.size[2])).collect();
            let top = h.data.iter().fold(0.0f64, |m, x| m.max(f64::from(*x))) * h.size[2];
            Field {
                grid: narrow::height::HeightField {
                    rows: h.nrow,
                    cols: h.ncol,
                    half: [C::lit(h.size[0]), C::lit(h.size[1])],
                    base: C::lit(h.size[3]),
                    heights,
                    top: C::lit(top),
                },
            }
        })
        .collect()
}

/// Where the slots of the present class begin, and how many of them each lane has filled.
struct Slots<T: Real> {
    class: (bool, usize),
    first: usize,
    filled: T,
}

/// Finds the contacts of all pairs and writes their blocks.
#[inline(always)]
pub(crate) fn collide_pairs<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    for touching in work.touching_bodies.iter_mut() {
        *touching = T::none();
    }
    let mut slots = Slots { class: (false, 0), first: work.blocks.len(), filled: T::zero() };
    for (i, pair) in sim.contacts.pairs.iter().enumerate() {
        if pair.class() != slots.class {
            slots = Slots { class: pair.class(), first: work.blocks.len(), filled: T::zero() };
        }
        // everything relative to the reference point of one of the moving geoms' trees
        let base = pair.links[1].or(pair.links[0]).map_or(0, |l| sim.links[l].tree);
        let a = center_of(sim, work, &sim.geoms[pair.geoms[0]], base);
        let b = center_of(sim, work, &sim.geoms[pair.geoms[1]], base);
        let reach = T::splat(pair.reach);
        let near = match pair.cull {
            Cull::Balls => narrow::near(&a, &b, reach),
            Cull::Plane | Cull::Field => {
                let mut point = a;
                let normal = axis_of(work, &sim.geoms[pair.geoms[0]]);
                if pair.cull == Cull::Field {
                    let top = group.ground_top(sim, pair.field);
                    for i in 0..3 {
                        point[i] = normal[i].mul_add(top, point[i]);
                    }
                }
                narrow::plane::near_plane(&narrow::Plane { point, normal }, &b, reach)
            }
        };
        if !T::any(near) {
            continue;
        }
        touch_pair(sim, group, work, i, base, [&a, &b], near, &mut slots);
    }
}

/// Center of a geom relative to the reference point of tree `base`.
#[inline(always)]
fn center_of<T: Real>(sim: &Sim<T>, work: &Work<T>, m: &Mount<T::Scalar>, base: usize) -> V3<T> {
    match m.link {
        None => sub3(&splat3(&m.pos), &work.reference[base]),
        Some(l) => {
            let p = rotate_add(&work.rot[l], &splat3(&m.pos), &work.pos[l]);
            match sim.links[l].tree {
                t if t == base => p,
                t => add3(&p, &sub3(&work.reference[t], &work.reference[base])),
            }
        }
    }
}

#[inline(always)]
fn axes_of<T: Real>(work: &Work<T>, m: &Mount<T::Scalar>) -> Rot<T> {
    match m.link {
        None => [splat3(&m.rot[0]), splat3(&m.rot[1]), splat3(&m.rot[2])],
        Some(l) => compose(&work.rot[l], &m.rot),
    }
}

#[inline(always)]
fn axis_of<T: Real>(work: &Work<T>, m: &Mount<T::Scalar>) -> V3<T> {
    match m.link {
        None => splat3(&m.rot[2]),
        Some(l) => rotate(&work.rot[l], &splat3(&m.rot[2])),
    }
}

/// Narrow phase of one pair.
#[allow(clippy::too_many_arguments)]
#[inline(always)]
fn touch_pair<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &mut Work<T>,
    index: usize,
    base: usize,
    centers: [&V3<T>; 2],
    near: T::Mask,
    slots: &mut Slots<T>,
) {
    let pair = &sim.contacts.pairs[index];
    let [ma, mb] = pair.geoms.map(|g| &sim.geoms[g]);
    let margin = T::splat(pair.margin);
    let sizes: [V3<T>; 2] = [splat3(&pair.sizes[0]), splat3(&pair.sizes[1])];
    let sphere = |i: usize| narrow::Sphere { center: *centers[i], radius: sizes[i][0] };
    let capsule =
        |i: usize, axis: V3<T>| narrow::Capsule { center: *centers[i], axis, radius: sizes[i][0], half: sizes[i][1] };
    let block = |i: usize, axes: Rot<T>| narrow::Block { center: *centers[i], axes, half: sizes[i] };
    let cylinder =
        |i: usize, axes: Rot<T>| narrow::Cylinder { center: *centers[i], axes, radius: sizes[i][0], half: sizes[i][1] };
    let plane = || narrow::Plane { point: *centers[0], normal: axis_of(work, ma) };
    match pair.test {
        Test::PlaneSphere => {
            let t = narrow::plane::plane_sphere(&plane(), &sphere(1), margin);
            add_touch(sim, group, work, index, base, &t, slots);
        }
        Test::PlaneCapsule => {
            for t in narrow::plane::plane_capsule(&plane(), &capsule(1, axis_of(work, mb)), margin) {
                add_touch(sim, group, work, index, base, &t, slots);
            }
        }
        Test::PlaneBox => {
            for t in narrow::plane::plane_box(&plane(), &block(1, axes_of(work, mb)), margin) {
                add_touch(sim, group, work, index, base, &t, slots);
            }
        }
        Test::PlaneCylinder => {
            for t in narrow::plane::plane_cylinder(&plane(), &cylinder(1, axes_of(work, mb)), margin) {
                add_touch(sim, group, work, index, base, &t, slots);
            }
        }
        Test::PlaneEllipsoid => {
            let t = narrow::plane::plane_ellipsoid(&plane(), &block(1, axes_of(work, mb)), margin);
            add_touch(sim, group, work, index, base, &t, slots);
        }
        Test::SphereSphere => {
            let t = narrow::round::sphere_sphere(&sphere(0), &sphere(1), margin);
            add_touch(sim, group, work, index, base, &t, slots);
        }
        Test::SphereCapsule => {
            let t = narrow::round::sphere_capsule(&sphere(0), &capsule(1, axis_of(work, mb)), margin);
            add_touch(sim, group, work, index, base, &t, slots);
        }
        Test::SphereBox => {
            let t = narrow::round::sphere_box(&sphere(0), &block(1, axes_of(work, mb)), margin);
            add_touch(sim, group, work, index, base, &t, slots);
        }
        Test::SphereCylinder => {
            let t = narrow::round::sphere_cylinder(&sphere(0), &cylinder(1, axes_of(work, mb)), margin);
            add_touch(sim, group, work, index, base, &t, slots);
        }
        Test::CapsuleCapsule => {
            let (a, b) = (capsule(0, axis_of(work, ma)), capsule(1, axis_of(work, mb)));
            for t in narrow::round::capsule_capsule(&a, &b, margin) {
                add_touch(sim, group, work, index, base, &t, slots);
            }
        }
        Test::CapsuleBox | Test::BoxBox | Test::FieldCapsule | Test::FieldBox => {
            one_by_one(sim, group, work, index, base, centers, near, slots);
        }
    }
}

/// Narrow phase of shapes that need branches: lane by lane, on the lanes that are near.
#[allow(clippy::too_many_arguments)]
#[inline(always)]
fn one_by_one<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &mut Work<T>,
    index: usize,
    base: usize,
    centers: [&V3<T>; 2],
    near: T::Mask,
    slots: &mut Slots<T>,
) {
    let pair = &sim.contacts.pairs[index];
    let [ma, mb] = pair.geoms.map(|g| &sim.geoms[g]);
    let axes = [axes_of(work, ma), axes_of(work, mb)];
    let mut found = std::mem::take(&mut work.touches);
    let mut count = 0;
    let bits = T::bits(near);
    let mut lane_touches = Touches::<T::Scalar>::new();
    for lane in 0..T::LANES {
        if bits & (1 << lane) == 0 {
            continue;
        }
        let pick = |v: &V3<T>| [v[0].get(lane), v[1].get(lane), v[2].get(lane)];
        let center = |i: usize| pick(centers[i]);
        let turned = |i: usize| [pick(&axes[i][0]), pick(&axes[i][1]), pick(&axes[i][2])];
        let capsule = |i: usize| narrow::Capsule {
            center: center(i),
            axis: pick(&axes[i][2]),
            radius: pair.sizes[i][0],
            half: pair.sizes[i][1],
        };
        let block = |i: usize| narrow::Block { center: center(i), axes: turned(i), half: pair.sizes[i] };
        lane_touches.clear();
        match pair.test {
            Test::CapsuleBox => {
                narrow::capsule_box::capsule_box(&capsule(0), &block(1), pair.margin, &mut lane_touches);
            }
            Test::BoxBox => narrow::box_box::box_box(&block(0), &block(1), pair.margin, &mut lane_touches),
            test => {
                let field = &group.ground(sim, lane, pair.field).grid;
                let terrain = narrow::height::Terrain { field, center: center(0), axes: turned(0) };
                if test == Test::FieldBox {
                    narrow::height::field_box(&terrain, &block(1), pair.margin, &mut lane_touches);
                } else {
                    let mut shape = capsule(1);
                    if sim.model.geoms[pair.geoms[1]].kind == GeomType::Sphere {
                        shape.half = T::scalar(0.0);
                    }
                    narrow::height::field_capsule(&terrain, &shape, pair.margin, &mut lane_touches);
                }
            }
        }
        gather(&lane_touches, lane, &mut found, &mut count);
    }
    for t in found.iter().take(count) {
        add_touch(sim, group, work, index, base, t, slots);
    }
    work.touches = found;
}

/// Puts one lane's contacts into that lane of `found`, of which `count` are in use.
#[inline(always)]
fn gather<T: Real>(touches: &Touches<T::Scalar>, lane: usize, found: &mut Vec<Touch<T>>, count: &mut usize) {
    for (k, t) in touches.as_slice().iter().enumerate() {
        if k == *count {
            if found.len() <= k {
                found.push(Touch::none());
            }
            found[k] = Touch::none();
            *count += 1;
        }
        let touch = &mut found[k];
        touch.on = T::or(touch.on, T::from_bits(1 << lane));
        touch.dist.set(lane, t.dist);
        for i in 0..3 {
            touch.pos[i].set(lane, t.pos[i]);
            touch.normal[i].set(lane, t.normal[i]);
            touch.tangent[i].set(lane, t.tangent[i]);
        }
    }
}

/// Writes the rows of a contact into the next free slot of each lane that has it.
#[inline(always)]
fn add_touch<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &mut Work<T>,
    index: usize,
    base: usize,
    touch: &Touch<T>,
    slots: &mut Slots<T>,
) {
    if T::any(touch.on) {
        write_slot(sim, group, work, index, base, touch, slots);
    }
}

fn write_slot<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    work: &mut Work<T>,
    index: usize,
    base: usize,
    touch: &Touch<T>,
    slots: &mut Slots<T>,
) {
    T::enter(WriteSlot { sim, group, work, index, base, touch, slots });
}

struct WriteSlot<'a, T: Real> {
    sim: &'a Sim<T>,
    group: &'a Group<T>,
    work: &'a mut Work<T>,
    index: usize,
    base: usize,
    touch: &'a Touch<T>,
    slots: &'a mut Slots<T>,
}

impl<T: Real> crate::lanes::Kernel<T> for WriteSlot<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let WriteSlot { sim, group, work, index, base, touch, slots } = self;
        let pair = &sim.contacts.pairs[index];
        let (zero, one) = (T::zero(), T::lit(1.0));
        work.stats.contacts += T::bits(touch.on).count_ones() as u64;
        let mut links = pair.links;
        let mut normal = touch.normal;
        let mut t1 = touch.tangent;
        let mut t2 = cross(&normal, &t1);
        if links[1].is_none() {
            // the side that moves comes second
            links.swap(0, 1);
            normal = negate(&normal);
            t1 = negate(&t1);
            t2 = negate(&t2);
        }
        report(pair, work, touch.on);

        // points relative to the reference of each side's own tree, and their velocity
        let mut points = [touch.pos; 2];
        let mut velocity = [[zero; 3]; 2];
        let mut spin = [[zero; 3]; 2];
        for s in 0..2 {
            let Some(l) = links[s] else { continue };
            let tree = sim.links[l].tree;
            if tree != base {
                points[s] = add3(&points[s], &sub3(&work.reference[base], &work.reference[tree]));
            }
            let v = &work.vel[l];
            velocity[s] = cross_add(&ang(v), &points[s], &lin(v));
            spin[s] = ang(v);
        }
        let v = sub3(&velocity[1], &velocity[0]);
        let w = sub3(&spin[1], &spin[0]);

        let violation = touch.dist - T::splat(pair.soft.margin);
        let (imp, mut d) = impedance(&pair.soft, violation);
        if let (Some(factor), Cost::Pyramid) = (group.friction(), pair.cost) {
            d *= pyramid_share(T::splat(pair.friction[0]), factor);
        }
        let b = T::splat(pair.soft.b);
        let frame = [normal, t1, t2];
        let mut u0 = [zero; 6];
        for k in 0..pair.dim {
            let rate = if k < 3 { dot(&frame[k], &v) } else { dot(&frame[k - 3], &w) };
            u0[k] = rate * b;
        }
        u0[0] += imp * violation * T::splat(pair.soft.k);

        // every lane's next free slot
        let mut left = touch.on;
        let mut slot = slots.first;
        let mut number = zero;
        while T::any(left) {
            let here = T::and(left, slots.filled.lt(number + T::lit(0.5)));
            if T::any(here) {
                if slot == work.blocks.len() {
                    let new = work.blocks.add();
                    open(&mut work.blocks[new], pair);
                }
                let block = &mut work.blocks[slot];
                fill(block, here, pair, &points, &frame, d, &u0, group.friction());
                for (s, link) in links.iter().enumerate() {
                    if let (Some(l), Jacobian::Points { sides, .. }) = (link, &mut block.jacobian) {
                        join::<T>(&mut sides[s].links, *l, here);
                    }
                }
                join::<T>(&mut block.members, index, here);
            }
            left = T::and(left, T::not(here));
            slot += 1;
            number += one;
        }
        slots.filled += T::masked(touch.on, one);
    }
}

/// Ratio of an edge's stiffness at `factor` times the friction to that at the model's: `R` is in proportion to
/// `mu^2 (1 + mu0^2)`.
#[inline(always)]
pub(super) fn pyramid_share<T: Real>(mu0: T, factor: T) -> T {
    let one = T::lit(1.0);
    let square = mu0 * mu0;
    let varied = square * (factor * factor);
    (one + square).div((factor * factor) * (one + varied))
}

/// Marks who touches what.
#[inline(always)]
fn report<T: Real>(pair: &PairSpec<T::Scalar>, work: &mut Work<T>, on: T::Mask) {
    match pair.links {
        [Some(_), Some(_)] => {
            for g in pair.geoms {
                work.touching_bodies[g] = T::or(work.touching_bodies[g], on);
            }
        }
        [Some(_), None] => work.touch_ground(pair.geoms[0], on),
        _ => work.touch_ground(pair.geoms[1], on),
    }
}

#[inline(always)]
fn negate<T: Real>(v: &V3<T>) -> V3<T> {
    [-v[0], -v[1], -v[2]]
}

/// Adds lanes to the entry of `key`.
#[inline(always)]
fn join<T: Real>(entries: &mut Vec<(usize, T::Mask)>, key: usize, lanes: T::Mask) {
    for (k, m) in entries.iter_mut() {
        if *k == key {
            *m = T::or(*m, lanes);
            return;
        }
    }
    entries.push((key, lanes));
}

/// Makes an empty contact slot of a pair's class.
#[inline(always)]
fn open<T: Real>(block: &mut Block<T>, pair: &PairSpec<T::Scalar>) {
    let z = [T::zero(); 3];
    block.reset(Source::Contacts, pair.cost, pair.dim);
    block.coupled = pair.coupled();
    block.tie_points([z; 3], [z; 3], [(None, z); 2], T::none());
}

/// Writes a contact into the lanes `here` of a slot.
#[allow(clippy::too_many_arguments)]
#[inline(always)]
fn fill<T: Real>(
    block: &mut Block<T>,
    here: T::Mask,
    pair: &PairSpec<T::Scalar>,
    points: &[V3<T>; 2],
    frame: &[V3<T>; 3],
    d: T,
    u0: &[T; 6],
    friction: Option<T>,
) {
    block.on = T::or(block.on, here);
    for k in 0..pair.dim {
        block.d[k] = T::select(here, d * T::splat(pair.ratios[k]), block.d[k]);
        block.u0[k] = T::select(here, u0[k], block.u0[k]);
    }
    for k in 0..pair.dim - 1 {
        let mu = T::splat(pair.friction[k]);
        block.mu[k] = T::select(here, friction.map_or(mu, |f| mu * f), block.mu[k]);
    }
    let slope = T::splat(pair.slope);
    block.slope = T::select(here, friction.map_or(slope, |f| slope * f), block.slope);
    if let Jacobian::Points { sides, lin, ang } = &mut block.jacobian {
        for k in 0..3 {
            for i in 0..3 {
                lin[k][i] = T::select(here, frame[k][i], lin[k][i]);
                if pair.dim > 3 {
                    ang[k][i] = T::select(here, frame[k][i], ang[k][i]);
                }
            }
        }
        for (side, point) in sides.iter_mut().zip(points) {
            for i in 0..3 {
                side.r[i] = T::select(here, point[i], side.r[i]);
            }
        }
    }
}
