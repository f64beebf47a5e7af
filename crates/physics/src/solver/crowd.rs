//! Agents with many contacts between links ("crowds"): a sparse factorization instead of a low-rank correction.
//!
//! For every degree of freedom, the cost of the correction of [`coupled`](super::coupled) grows with the square of its
//! rows. A pile of bodies has hundreds of rows, but they connect few pairs of links. Beyond
//! [`MOST_COUPLED_ROWS`](crate::sim::MOST_COUPLED_ROWS) rows an agent is solved by a factorization of the whole matrix
//! `H = M + J' D J` ([`multifrontal`]). This does not affect the other stages of the solver or the other lanes.

use crate::algebra::spatial::*;
use crate::lanes::{MAX_LANES, Real, kernel_fn};
use crate::multifrontal::{self, Crowd, JointRow, NONE, RowTerms, Tie};
use crate::rows::{Block, Jacobian};
use crate::sim::Sim;
use crate::state::{Solver, Work, net_bias_force};

kernel_fn! {
    /// Finds the lanes with more than [`Sim::most_rows`] coupled rows and prepares their factorization.
    pub(crate) fn start<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>) -> T::Mask {
        let most = sim.most_rows;
        let coupled = || work.rows.blocks.iter().filter(|b| b.coupled);
        if coupled().map(|b| b.dim).sum::<usize>() <= most {
            return T::none();
        }
        let mut rows = [0; MAX_LANES];
        for b in coupled() {
            let bits = T::bits(b.on);
            for (lane, n) in rows.iter_mut().enumerate().take(T::LANES) {
                *n += if bits >> lane & 1 == 1 { b.dim } else { 0 };
            }
        }
        let mut crowded = 0;
        for (lane, n) in rows.iter().enumerate().take(T::LANES) {
            if *n > most {
                crowded |= 1 << lane;
            }
        }
        if crowded != 0 && work.solver.crowds.is_empty() {
            work.solver.crowds = vec![Crowd::new(); T::LANES];
        }
        for lane in (0..T::LANES).filter(|lane| crowded >> lane & 1 == 1) {
            prepare(sim, work, lane);
        }
        T::from_bits(crowded)
    }
}

/// Lists the connections between the links of a lane, and plans the factorization.
#[inline(always)]
fn prepare<T: Real>(sim: &Sim<T>, work: &mut Work<T>, lane: usize) {
    let Work { dofs, solver, rows, .. } = work;
    let Crowd { plan, numbers } = &mut solver.crowds[lane];
    numbers.resize(sim.links.len(), sim.model.nv);
    for (to, from) in numbers.axis.iter_mut().zip(dofs.iter()) {
        *to = from.axis.map(|x| x.get(lane));
    }
    numbers.ties.clear();
    numbers.rows.clear();
    plan.row_terms.clear();
    plan.terms.clear();
    let on_lane = |mask: T::Mask| T::bits(mask) >> lane & 1 == 1;
    for (index, b) in rows.blocks.iter_mut().enumerate() {
        b.moved = T::not(T::none());
        if !b.coupled || !on_lane(b.on) {
            continue;
        }
        match &b.jacobian {
            Jacobian::Points { sides, lin, ang } => {
                let link = |s: usize| sides[s].links.iter().find(|(_, lanes)| on_lane(*lanes)).map(|(l, _)| *l);
                let [Some(first), Some(second)] = [link(0), link(1)] else { continue };
                let v3 = |v: &V3<T>| v.map(|x| x.get(lane));
                let one = T::scalar(1.0);
                numbers.ties.push(Tie {
                    block: index,
                    links: [first, second],
                    slot: 0,
                    next: NONE,
                    dim: b.dim,
                    lin: [v3(&lin[0]), v3(&lin[1]), v3(&lin[2])],
                    ang: [v3(&ang[0]), v3(&ang[1]), v3(&ang[2])],
                    r: [v3(&sides[0].r), v3(&sides[1].r)],
                    sign: [-one, one],
                    w: [T::scalar(0.0); 21],
                    force: [T::scalar(0.0); 6],
                });
            }
            Jacobian::Joints(terms) => {
                let start = plan.terms.len();
                plan.terms.extend(terms.iter().map(|(dof, c)| (*dof, sim.dof_link[*dof], c.get(lane))));
                plan.row_terms.push(RowTerms { start, end: plan.terms.len(), enters: NONE, next: NONE });
                numbers.rows.push(JointRow { block: index, w: T::scalar(0.0), u0: b.u0[0].get(lane) });
            }
        }
    }
    plan.order(&sim.links, sim.trees, numbers.ties.iter().map(|t| t.links));
    for (i, tie) in numbers.ties.iter_mut().enumerate().rev() {
        // the link that is eliminated first comes first
        if plan.position[tie.links[1]] < plan.position[tie.links[0]] {
            tie.links.swap(0, 1);
            tie.r.swap(0, 1);
            tie.sign.swap(0, 1);
        }
        tie.next = std::mem::replace(&mut plan.fronts[tie.links[0]].tie, i);
    }
    plan.find_fronts(&sim.links, &mut numbers.ties);
    numbers.follow(plan);
    numbers.stale.fill(true);
}

kernel_fn! {
    /// Factorizes the system of the lanes `lanes`. Only recomputes the changes since their last factorization, by
    /// `stale` and [`Block::moved`].
    pub(crate) fn factorize<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, lanes: T::Mask) {
        let bits = T::bits(lanes);
        for lane in (0..T::LANES).filter(|lane| bits >> lane & 1 == 1) {
            let Work { motion, dofs, solver, rows, stats, .. } = work;
            let Solver { crowds, stale, in_contact, stiffness, .. } = solver;
            let (inertia, blocks) = (&motion.inertia, &rows.blocks);
            let Crowd { plan, numbers } = &mut crowds[lane];
            for (l, link) in sim.links.iter().enumerate().filter(|(l, _)| stale[*l]) {
                let rigid = sym6_of_inertia(&inertia[l].map(|x| x.get(lane)));
                numbers.stiffness[l] = rigid;
                if in_contact[l] {
                    for (sum, x) in numbers.stiffness[l].iter_mut().zip(&stiffness[l]) {
                        *sum += x.get(lane);
                    }
                }
                for d in link.dofs.clone() {
                    numbers.diag[d] = dofs[d].diag.get(lane);
                }
                numbers.stale[l] = true;
            }
            let moved = |b: &Block<T>| T::bits(b.moved) >> lane & 1 == 1;
            for tie in &mut numbers.ties {
                let b = &blocks[tie.block];
                if moved(b) {
                    for (w, x) in tie.w.iter_mut().zip(&b.stiffness).take(b.dim * (b.dim + 1) / 2) {
                        *w = x.get(lane);
                    }
                    tie.force = b.linear_force(&b.u0).map(|x| x.get(lane));
                    numbers.stale[tie.links[0]] = true;
                }
            }
            for (row, terms) in numbers.rows.iter_mut().zip(&plan.row_terms) {
                let b = &blocks[row.block];
                if moved(b) {
                    row.w = b.stiffness[0].get(lane);
                    if terms.enters != NONE {
                        numbers.stale[terms.enters] = true;
                    }
                }
            }
            stats.crowded += 1;
            stats.entries += multifrontal::factorize(&sim.links, plan, numbers);
        }
        for b in work.rows.blocks.iter_mut() {
            b.moved = T::none();
        }
    }
}

kernel_fn! {
    /// Solves for the forces of the current system in the lanes `lanes`, into `solution` and `link_acc`. For a
    /// residual, the forces on links are in `link_force`, and the forces of blocks and motion are left out.
    pub(crate) fn solve<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, lanes: T::Mask, residual: bool) {
        let bits = T::bits(lanes);
        for lane in (0..T::LANES).filter(|lane| bits >> lane & 1 == 1) {
            let Work { motion, dofs, forces, solver, .. } = work;
            let Solver { crowds, in_contact, wrench, link_force, solution, link_acc, .. } = solver;
            let Crowd { plan, numbers } = &mut crowds[lane];
            for (to, from) in numbers.rhs.iter_mut().zip(dofs.iter()) {
                *to = from.rhs.get(lane);
            }
            for l in 0..sim.links.len() {
                let from = if residual { link_force[l] } else { net_bias_force(&motion.bias_force, &forces.link_applied, l) };
                numbers.force[l] = from.map(|x| x.get(lane));
                if !residual && in_contact[l] {
                    for (f, w) in numbers.force[l].iter_mut().zip(&wrench[l]) {
                        *f += -w.get(lane);
                    }
                }
            }
            let zero = T::scalar(0.0);
            if !residual {
                for tie in &numbers.ties {
                    tie.exert(&mut numbers.force);
                }
            }
            for (force, row) in numbers.row_force.iter_mut().zip(&numbers.rows) {
                *force = if residual { zero } else { row.w * row.u0 };
            }
            multifrontal::solve(&sim.links, plan, numbers);
            for (to, from) in solution.iter_mut().zip(&numbers.next) {
                to.set(lane, *from);
            }
            for (to, from) in link_acc.iter_mut().zip(&numbers.acc) {
                for (x, y) in to.iter_mut().zip(from) {
                    x.set(lane, *y);
                }
            }
        }
    }
}
