//! Assembly of a front: the stiffness of its link, its contacts and rows, and the remainders of other fronts.

use super::numbers::Numbers;
use super::plan::{Front, NONE, Plan};
use super::tie::Tie;
use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::rows::at;
use crate::sim::Link;

/// Rows and columns of a packed symmetric matrix.
const PACKED: [[usize; 6]; 6] = [
    [0, 3, 4, 6, 7, 8],
    [3, 1, 5, 9, 10, 11],
    [4, 5, 2, 12, 13, 14],
    [6, 9, 12, 15, 18, 19],
    [7, 10, 13, 18, 16, 20],
    [8, 11, 14, 19, 20, 17],
];

/// Fills a front: the link's own stiffness, its contacts and rows, and the remainders of other fronts.
#[inline(always)]
pub(crate) fn assemble<S: Real>(links: &[Link<S>], plan: &Plan<S>, n: &mut Numbers<S>, l: usize) {
    let front = &plan.fronts[l];
    let stride = front.stride;
    let (before, rest) = n.matrix.split_at_mut(front.matrix);
    let f = &mut rest[..front.size * stride];
    f.fill(S::zero());
    for (i, row) in PACKED.iter().enumerate() {
        for (j, k) in row.iter().enumerate() {
            f[i * stride + j] = n.stiffness[l][*k];
        }
    }
    let mut t = front.tie;
    while t != NONE {
        add_tie(f, stride, &n.ties[t]);
        t = n.ties[t].next;
    }
    let mut row = front.row;
    while row != NONE {
        // rows come last
        let members = &plan.rows[front.rows..front.rows + front.row_count];
        let place = 6 * (1 + front.links) + members.iter().position(|r| *r == row).unwrap_or(0);
        f[place * stride + place] += n.rows[row].w;
        row = plan.row_terms[row].next;
    }
    let mut child = front.child;
    while child != NONE {
        let rest = &plan.fronts[child];
        let from = &before[rest.matrix..rest.matrix + rest.size * rest.stride];
        add_rest(f, stride, plan, rest, from, links[child].parent.is_none());
        child = rest.sibling;
    }
}

/// Adds the stiffness of a contact. With the points' motions `P' a`, `P = [r x; 1]`, it is `P W P'` on both sides.
#[inline(always)]
fn add_tie<S: Real>(f: &mut [S], stride: usize, tie: &Tie<S>) {
    if tie.dim > 3 {
        return add_turning_tie(f, stride, tie);
    }
    // the rows' stiffness in world axes
    let mut world = [[S::zero(); 3]; 3];
    for i in 0..tie.dim {
        let mut h = [S::zero(); 3];
        for j in 0..tie.dim {
            let w = if j <= i { tie.w[at(i, j)] } else { tie.w[at(j, i)] };
            for c in 0..3 {
                h[c] = tie.lin[j][c].mul_add(w, h[c]);
            }
        }
        for a in 0..3 {
            for b in 0..3 {
                world[a][b] = tie.lin[i][a].mul_add(h[b], world[a][b]);
            }
        }
    }
    // moments of the columns: entry [c] is r x column c
    let moments = [0, 1].map(|s| [0, 1, 2].map(|c| cross(&tie.r[s], &world[c])));
    let place = [0, tie.slot];
    for (s, t) in tie.blocks() {
        let (rows, columns) = (place[s], place[t]);
        let negative = s != t;
        let mut add = |i: usize, j: usize, x: S| {
            let entry = &mut f[(rows + i) * stride + columns + j];
            *entry += if negative { -x } else { x };
        };
        for i in 0..3 {
            // [r] W [r]' has the rows of r x (W [r]'), and W is symmetric
            let turned = cross(&tie.r[t], &[moments[s][0][i], moments[s][1][i], moments[s][2][i]]);
            for j in 0..3 {
                add(i, j, turned[j]);
                add(i, 3 + j, moments[s][j][i]);
                add(3 + i, j, moments[t][i][j]);
                add(3 + i, 3 + j, world[i][j]);
            }
        }
    }
}

/// The same with rows that measure rotation.
#[inline(always)]
fn add_turning_tie<S: Real>(f: &mut [S], stride: usize, tie: &Tie<S>) {
    let mut columns = [[[S::zero(); 6]; 6]; 2];
    for (s, column) in columns.iter_mut().enumerate() {
        for (k, g) in column.iter_mut().enumerate().take(tie.dim) {
            *g = tie.wrench(s, k);
        }
    }
    let place = [0, tie.slot];
    for (s, t) in tie.blocks() {
        for k in 0..tie.dim {
            let mut h = [S::zero(); 6];
            for m in 0..tie.dim {
                let w = if m <= k { tie.w[at(k, m)] } else { tie.w[at(m, k)] };
                h = axpy6(&columns[t][m], w, &h);
            }
            for i in 0..6 {
                for j in 0..6 {
                    let entry = &mut f[(place[s] + i) * stride + place[t] + j];
                    *entry = columns[s][k][i].mul_add(h[j], *entry);
                }
            }
        }
    }
}

/// Adds the remainder of a front to its target.
#[inline(always)]
fn add_rest<S: Real>(f: &mut [S], stride: usize, plan: &Plan<S>, rest: &Front, from: &[S], root: bool) {
    let blocks = 1 + rest.links + rest.row_count;
    let places = &plan.places[rest.places..rest.places + blocks];
    let start =
        |block: usize| if block <= rest.links { 6 * block } else { 6 * (1 + rest.links) + block - 1 - rest.links };
    let width = |block: usize| if block <= rest.links { 6 } else { 1 };
    for a in usize::from(root)..blocks {
        if places[a] == NONE {
            continue;
        }
        for b in a..blocks {
            if places[b] == NONE {
                continue;
            }
            let (rows, columns) = (start(a), start(b));
            let (to, across) = (places[a], places[b]);
            if to < across {
                for i in 0..width(a) {
                    let source = &from[(rows + i) * rest.stride + columns..][..width(b)];
                    let sink = &mut f[(to + i) * stride + across..][..width(b)];
                    for (x, y) in sink.iter_mut().zip(source) {
                        *x += *y;
                    }
                }
                continue;
            }
            for i in 0..width(a) {
                for j in 0..width(b) {
                    if a == b && j < i {
                        continue;
                    }
                    let x = from[(rows + i) * rest.stride + columns + j];
                    // the transpose also has a place, above the diagonal of a diagonal block
                    if to > across {
                        f[(across + j) * stride + to + i] += x;
                    } else {
                        f[(to + i) * stride + to + j] += x;
                        if a != b || i != j {
                            f[(to + j) * stride + to + i] += x;
                        }
                    }
                }
            }
        }
    }
}
