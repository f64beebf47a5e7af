//! The rows of all lanes: their inward passes, forces and islands.

use crate::algebra::planar::{Full, Planar, Space};
use crate::algebra::spatial::*;
use crate::dynamics::{accelerate, factorize};
use crate::lanes::{Real, kernel_fn};
use crate::rows::{Block, FloorRow, Jacobian, Source};
use crate::sim::{Cost, NoSlip, Sim};
use crate::solver::capped::for_each_diagonal;
use crate::solver::{coupled, newton};
use crate::state::{Law, MOST_ROWS, Patch, Place, Slip, SlipLane, Work};

/// Classes of rows in the order of the sweeps: dry friction of degrees of freedom, of tendons, contacts.
const DOFS: usize = 0;
const TENDONS: usize = 1;
const CONTACTS: usize = 2;

/// Lists the friction rows of every lane in the order of the sweeps.
pub(super) fn prepare<T: Real>(sim: &Sim<T>, work: &mut Work<T>, slip: &mut Slip<T>) {
    let Some(settings) = &sim.no_slip else { return };
    slip.lanes.iter_mut().for_each(SlipLane::clear);
    slip.held = T::none();
    if sim.planar {
        planar_list(sim, settings, work, slip);
    } else {
        full_list(sim, settings, work, slip);
    }
    for lane in slip.lanes.iter_mut() {
        finish(settings, lane);
    }
}

/// Finds the islands, and sorts the patches.
fn finish(settings: &NoSlip, lane: &mut SlipLane) {
    for tree in 0..lane.island.len() {
        // earlier trees already have their roots
        let root = if settings.islands { lane.island[lane.island[tree]] } else { 0 };
        lane.island[tree] = root;
        if root != tree {
            lane.softness[root] += lane.softness[tree];
            lane.mass[root] += lane.mass[tree];
        }
    }
    for p in lane.patches.iter_mut() {
        p.tree = lane.island[p.tree];
    }
    // stable: the contacts of a pair of geoms keep their order
    lane.patches.sort_by_key(|p| p.order);
}

kernel_fn! {
    fn full_list<'a, T>(sim: &'a Sim<T>, settings: &'a NoSlip, work: &'a mut Work<T>, slip: &'a mut Slip<T>) {
        list::<T, Full>(sim, settings, work, slip);
    }
}
kernel_fn! {
    fn planar_list<'a, T>(sim: &'a Sim<T>, settings: &'a NoSlip, work: &'a mut Work<T>, slip: &'a mut Slip<T>) {
        list::<T, Planar>(sim, settings, work, slip);
    }
}

#[inline(always)]
fn list<T: Real, S: Space>(sim: &Sim<T>, settings: &NoSlip, work: &mut Work<T>, slip: &mut Slip<T>) {
    others(sim, work, slip);
    masses::<T, S>(sim, work, slip);
    for (d, dof) in work.dofs.iter().enumerate() {
        for (index, lane) in slip.lanes.iter_mut().enumerate() {
            lane.pivots[d] = wide::<T>(&dof.pivot, index);
        }
    }
    if settings.islands {
        let lanes = &mut slip.lanes;
        for_each_diagonal::<T, S>(sim, work, &mut slip.composite, |tree, x| {
            for (index, lane) in lanes.iter_mut().enumerate() {
                lane.mass[tree] += wide::<T>(&x, index);
            }
        });
    }
    for i in 0..work.rows.dry.len() {
        dry::<T, S>(sim, work, slip, i);
    }
    for i in 0..work.rows.contacts.len() {
        floor::<T, S>(sim, settings, work, slip, i);
    }
    for i in 0..work.rows.blocks.len() {
        block::<T, S>(sim, settings, work, slip, i);
    }
}

fn wide<T: Real>(x: &T, lane: usize) -> f64 {
    T::widen(x.get(lane))
}

/// Numbers of the lanes in a mask.
fn lanes_of<T: Real>(mask: T::Mask) -> impl Iterator<Item = usize> {
    let bits = T::bits(mask);
    (0..T::LANES).filter(move |lane| bits >> lane & 1 == 1)
}

/// Cost of the softness of a row with stiffness `d` and force `f`.
fn softness(f: f64, d: f64) -> f64 {
    if f == 0.0 { 0.0 } else { 0.5 * f * f / d }
}

/// Adds the softness of limits, which have no friction.
fn others<T: Real>(sim: &Sim<T>, work: &Work<T>, slip: &mut Slip<T>) {
    for row in &work.rows.limits {
        slip.held = T::or(slip.held, row.on);
        for lane in lanes_of::<T>(row.on) {
            let cost = softness(wide::<T>(&row.force, lane), wide::<T>(&row.d, lane));
            slip.lanes[lane].softness[sim.links[row.link].tree] += cost;
        }
    }
}

/// Factorizes the mass matrix. If the solver stopped early, its accelerations do not match its forces, and MuJoCo
/// continues with those of the forces.
#[inline(always)]
fn masses<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, slip: &mut Slip<T>) {
    for row in &work.rows.contacts {
        slip.held = T::or(slip.held, row.on);
    }
    for b in work.rows.blocks.iter() {
        slip.held = T::or(slip.held, b.on);
    }
    if !work.rows.dry.is_empty() {
        slip.held = T::not(T::none());
    }
    work.solver.stale.fill(true);
    for ((dof, armature), force) in work.dofs.iter_mut().zip(&sim.armature).zip(&work.forces.qfrc_passive_actuator) {
        (dof.diag, dof.rhs) = (T::splat(*armature), *force);
    }
    if sim.capped.is_none() {
        factorize::<T, S>(sim, work, false);
        return;
    }
    newton::apply_forces::<T, S>(work);
    factorize::<T, S>(sim, work, false);
    accelerate::<T, S>(sim, work);
    let solver = &mut work.solver;
    for (a, x) in solver.qacc.iter_mut().zip(&solver.solution) {
        *a = T::select(slip.held, *x, *a);
    }
}

/// Dry friction of a degree of freedom.
#[inline(always)]
fn dry<T: Real, S: Space>(sim: &Sim<T>, work: &Work<T>, slip: &mut Slip<T>, i: usize) {
    let row = &work.rows.dry[i];
    let u = if sim.capped.is_some() { work.solver.qacc[row.dof] + row.u0 } else { row.u };
    slip.on_path.fill(false);
    slip.on_path[row.link] = true;
    coupled::mark_up(sim, &mut slip.on_path);
    coupled::clear(sim, &mut slip.rhs, &mut slip.link_force, &slip.on_path);
    slip.rhs[row.dof] = T::lit(1.0);
    carry::<T, S>(sim, work, slip, 0);
    let (tree, loss) = (sim.links[row.link].tree, T::widen(row.loss));
    for lane in 0..T::LANES {
        let (force, d) = (wide::<T>(&row.force, lane), wide::<T>(&row.d, lane));
        let mut p = patch(Place::Dry(i), Law::Dry, [DOFS, i, 0, 0, 0, 0], tree, 1);
        (p.force[0], p.bound[0], p.residual[0]) = (force, loss, wide::<T>(&u, lane));
        slip.lanes[lane].softness[tree] += softness(force, d);
        add(sim, slip, lane, p);
    }
}

/// A contact with the floor.
#[inline(always)]
fn floor<T: Real, S: Space>(sim: &Sim<T>, settings: &NoSlip, work: &Work<T>, slip: &mut Slip<T>, i: usize) {
    let row = &work.rows.contacts[i];
    let tree = sim.links[row.link].tree;
    let edges = row.edge_forces();
    for lane in lanes_of::<T>(row.on) {
        let d = wide::<T>(&row.d, lane);
        slip.lanes[lane].softness[tree] += edges.iter().map(|f| softness(wide::<T>(f, lane), d)).sum::<f64>();
    }
    slip.on_path.fill(false);
    slip.on_path[row.link] = true;
    coupled::mark_up(sim, &mut slip.on_path);
    for k in 0..2 {
        coupled::clear(sim, &mut slip.rhs, &mut slip.link_force, &slip.on_path);
        slip.link_force[row.link] = unit_wrench(row, k + 1).map(|x| -x);
        carry::<T, S>(sim, work, slip, k);
    }
    let u = if sim.capped.is_some() { add3(&row.of_motion(&work.solver.link_acc[row.link]), &row.u0) } else { row.u };
    let order = contact(settings.order(&sim.model, [row.plane, row.geom], sim.contacts.floor[row.candidate].declared));
    for lane in lanes_of::<T>(row.on) {
        let mu = [0, 1].map(|k| wide::<T>(&row.mu[k], lane));
        // the pyramid of a frictionless contact is flat
        if mu == [0.0; 2] {
            continue;
        }
        let mut p = patch(Place::Floor(i), Law::Pyramid, order, tree, 2);
        for k in 0..2 {
            p.mu[k] = mu[k];
            p.residual[k] = wide::<T>(&u[k + 1], lane);
            let [up, down] = [0, 1].map(|side| wide::<T>(&edges[2 * k + side], lane));
            (p.force[k], p.bound[k]) = (0.5 * (up - down), 0.5 * (up + down));
        }
        add(sim, slip, lane, p);
    }
}

/// Wrench of a unit force along row `k`.
#[inline(always)]
fn unit_wrench<T: Real>(row: &FloorRow<T>, k: usize) -> V6<T> {
    let mut force = [T::zero(); 3];
    force[k] = T::lit(1.0);
    row.wrench(&force)
}

/// Any other constraint: its softness, the trees that it connects, and its friction.
#[inline(always)]
fn block<T: Real, S: Space>(sim: &Sim<T>, settings: &NoSlip, work: &Work<T>, slip: &mut Slip<T>, i: usize) {
    let b = &work.rows.blocks[i];
    let pyramid = b.cost == Cost::Pyramid;
    let edges = if pyramid { b.edge_forces() } else { [T::zero(); 10] };
    let mut trees = [0; crate::lanes::MAX_LANES];
    for lane in lanes_of::<T>(b.on) {
        let rows = &mut slip.lanes[lane];
        trees[lane] = connect(sim, b, lane, rows);
        let cost = if pyramid {
            let d = wide::<T>(&b.d[0], lane);
            edges.iter().map(|f| softness(wide::<T>(f, lane), d)).sum::<f64>()
        } else {
            (0..b.dim).map(|k| softness(wide::<T>(&b.force[k], lane), wide::<T>(&b.d[k], lane))).sum::<f64>()
        };
        rows.softness[trees[lane]] += cost;
    }
    let (law, first, dim) = match b.cost {
        Cost::Push | Cost::Equal => return,
        Cost::Dry => (Law::Dry, 0, 1),
        Cost::Pyramid => (Law::Pyramid, 1, b.dim - 1),
        Cost::Elliptic => (Law::Ellipsoid, 1, b.dim - 1),
    };
    coupled::mark_path(sim, b, &mut slip.on_path);
    for k in 0..dim {
        coupled::clear(sim, &mut slip.rhs, &mut slip.link_force, &slip.on_path);
        coupled::exert(b, first + k, &mut slip.rhs, &mut slip.link_force);
        carry::<T, S>(sim, work, slip, k);
    }
    let mut u = b.u;
    if sim.capped.is_some() {
        u = b.of_motion(&work.solver.link_acc, &work.solver.qacc);
        for k in 0..b.dim {
            u[k] += b.u0[k];
        }
    }
    for lane in lanes_of::<T>(b.on) {
        let order = match b.source {
            Source::Contacts => order(sim, settings, b, lane),
            _ => [TENDONS, i, 0, 0, 0, 0],
        };
        let mut p = patch(Place::Block(i), law, order, trees[lane], dim);
        for k in 0..dim {
            p.mu[k] = wide::<T>(&b.mu[k], lane);
            p.residual[k] = wide::<T>(&u[first + k], lane);
            p.force[k] = wide::<T>(&b.force[first + k], lane);
            if pyramid {
                let [up, down] = [0, 1].map(|side| wide::<T>(&edges[2 * k + side], lane));
                (p.force[k], p.bound[k]) = (0.5 * (up - down), 0.5 * (up + down));
            }
        }
        match law {
            Law::Dry => p.bound[0] = p.mu[0],
            Law::Ellipsoid => p.bound[0] = wide::<T>(&b.force[0], lane),
            Law::Pyramid => {}
        }
        add(sim, slip, lane, p);
    }
}

/// Merges the islands that a block connects in a lane. Returns one of its trees.
fn connect<T: Real>(sim: &Sim<T>, b: &Block<T>, lane: usize, rows: &mut SlipLane) -> usize {
    let mut tree = None;
    let mut touch = |link: usize| {
        let next = sim.links[link].tree;
        rows.unite(*tree.get_or_insert(next), next);
    };
    match &b.jacobian {
        Jacobian::Points { sides, .. } => {
            let on_lane = |mask: T::Mask| T::bits(mask) >> lane & 1 == 1;
            for (link, lanes) in sides.iter().flat_map(|s| &s.links) {
                if on_lane(*lanes) {
                    touch(*link);
                }
            }
        }
        Jacobian::Joints(terms) => terms.iter().for_each(|(dof, _)| touch(sim.dof_link[*dof])),
    }
    tree.unwrap_or(0)
}

/// Key of a contact in a lane.
fn order<T: Real>(sim: &Sim<T>, settings: &NoSlip, b: &Block<T>, lane: usize) -> [usize; 6] {
    let member = b.members.iter().find(|(_, lanes)| T::bits(*lanes) >> lane & 1 == 1);
    let index = member.map_or(0, |(index, _)| *index);
    let pair = sim.contacts.pair(&sim.geoms, index);
    contact(settings.order(&sim.model, pair.geoms, pair.declared))
}

/// Key of a contact.
fn contact([a, b, c, d, e]: [usize; 5]) -> [usize; 6] {
    [CONTACTS, a, b, c, d, e]
}

fn patch(place: Place, law: Law, order: [usize; 6], tree: usize, dim: usize) -> Patch {
    let zero = [0.0; MOST_ROWS];
    Patch {
        place,
        law,
        order,
        tree,
        dim,
        dof: 0,
        column: 0,
        dofs: 0,
        force: zero,
        bound: zero,
        mu: zero,
        residual: zero,
        matrix: [zero; MOST_ROWS],
    }
}

/// Inward pass of the current forces, as column `k`.
#[inline(always)]
fn carry<T: Real, S: Space>(sim: &Sim<T>, work: &Work<T>, slip: &mut Slip<T>, k: usize) {
    let nv = sim.model.nv;
    let Slip { rhs, link_force, on_path, columns, .. } = slip;
    coupled::carry_inward::<T, S>(sim, work, (rhs, link_force), on_path, &mut columns[k * nv..(k + 1) * nv]);
}

/// Adds a patch with its columns to a lane. Its path may be shorter than that of all lanes together.
fn add<T: Real>(sim: &Sim<T>, slip: &mut Slip<T>, lane: usize, mut p: Patch) {
    let (nv, columns) = (sim.model.nv, &slip.columns);
    let rows = &mut slip.lanes[lane];
    (p.dof, p.column) = (rows.dofs.len(), rows.columns.len());
    for link in sim.links.iter().zip(&slip.on_path).filter(|(_, on)| **on).map(|(link, _)| link) {
        for d in link.dofs.clone() {
            let mut column = [0.0; MOST_ROWS];
            for k in 0..p.dim {
                column[k] = wide::<T>(&columns[k * nv + d], lane);
            }
            if column == [0.0; MOST_ROWS] {
                continue;
            }
            rows.dofs.push(d);
            rows.columns.extend(&column[..p.dim]);
            for i in 0..p.dim {
                for j in 0..p.dim {
                    p.matrix[i][j] += column[i] * (rows.pivots[d] * column[j]);
                }
            }
        }
    }
    p.dofs = rows.dofs.len() - p.dof;
    rows.patches.push(p);
}
