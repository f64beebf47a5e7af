//! A height field and a convex shape.
//!
//! The field is a row of prisms, two per cell, and every prism is a convex shape of its own.

use super::super::height::HeightField;
use super::super::{CAPACITY, Rot, V3};
use super::gjk::Search;
use super::manifold::Contact;
use super::pair::{Pair, Scratch};
use super::support::{Form, Solid};
use super::vector::*;

/// Finds the contacts of a height field and a convex shape.
pub(super) fn field_convex<S: Number>(
    field: &HeightField<S>,
    place: (&V3<S>, &Rot<S>),
    solid: &Solid<S>,
    margin: S,
    search: &Search<S>,
    scratch: &mut Scratch<S>,
    mut report: impl FnMut(Contact<S>),
) {
    let (center, axes) = place;
    let local = Solid {
        center: into_local(axes, &sub(&solid.center, center)),
        axes: [0, 1, 2].map(|k| into_local(axes, &solid.axes[k])),
        form: solid.form,
    };
    let [low, high] = bounds(&local, margin);
    let [columns, rows] = [(0, field.cols), (1, field.rows)].map(|(k, lines)| {
        let line = |x: S| S::widen((x + field.half[k]) * field.per_cell[k]);
        let last = (lines - 1) as f64;
        let (first, end) = (line(low[k]).floor(), line(high[k]).ceil());
        // NaN finds no cell
        if first < last && end > 0.0 { first.max(0.0) as usize..end.min(last) as usize } else { 0..0 }
    });
    let mut found = 0;
    for row in rows {
        for column in columns.clone() {
            for half in 0..2 {
                let corners = prism(field, row, column, half);
                let highest = corners[5][2].max(corners[4][2]).max(corners[3][2]);
                if highest < low[2] || high[2] < -field.base {
                    continue;
                }
                let form = Form::Prism(corners);
                let prism = Solid { center: [S::zero(); 3], axes: *axes, form };
                let mut take = |contact: Contact<S>| {
                    let pos = add(&turn(axes, &contact.pos), center);
                    report(Contact { dist: contact.dist, pos, normal: turn(axes, &contact.normal) });
                    found += 1;
                };
                let pair = Pair { solids: [&prism, &local], margin, several: false, search };
                pair.contacts(scratch, &mut take);
                if found == CAPACITY {
                    return;
                }
            }
        }
    }
}

/// The box around a shape and its margin.
fn bounds<S: Number>(solid: &Solid<S>, margin: S) -> [V3<S>; 2] {
    let mut shape = solid.shape();
    let (zero, one) = (S::zero(), S::lit(1.0));
    let mut out = [[zero; 3]; 2];
    for k in 0..3 {
        let mut direction = [zero; 3];
        direction[k] = one;
        out[1][k] = shape.support(&direction).point[k] + margin;
        direction[k] = -one;
        out[0][k] = shape.support(&direction).point[k] - margin;
    }
    out
}

/// Corners of one of the two prisms of a cell, in MuJoCo's order.
fn prism<S: Number>(field: &HeightField<S>, row: usize, column: usize, half: usize) -> [V3<S>; 6] {
    let places = [[row + 1, column], [row, column], [row + 1, column + 1], [row, column + 1]];
    let mut corners = [[S::zero(); 3]; 6];
    for k in 0..3 {
        let [row, column] = places[half + k];
        let x = field.cell[0] * S::lit(column as f64) - field.half[0];
        let y = field.cell[1] * S::lit(row as f64) - field.half[1];
        corners[k] = [x, y, -field.base];
        corners[3 + k] = [x, y, field.heights[row * field.cols + column]];
    }
    corners
}
