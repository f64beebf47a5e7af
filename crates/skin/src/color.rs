//! Vertex colors: the model's own, or one per group of bodies, darkened where the surface is hidden from the sky.

use crate::field::Field;
use crate::figure::Figure;
use crate::layer::Layer;
use crate::mesh::Piece;
use crate::solid::Kind;
use glam::DVec3;

/// sRGB of trunk, limbs, and the ends of limbs, for models without colors.
const PALETTE: [[f64; 3]; 3] = [[0.79, 0.26, 0.18], [0.83, 0.62, 0.47], [0.95, 0.91, 0.84]];
/// Factors on the brightness of the same groups, for models with one color.
const TINT: [f64; 3] = [0.86, 1.0, 1.12];
/// Width of the border between two colors, in cells.
const BORDER: f64 = 0.5;
/// Length of the rays of ambient occlusion, in cells.
const DEPTH: f64 = 5.0;
/// Passes of smoothing of the occlusion over the mesh.
const PASSES: usize = 3;
/// Points along the normal that ambient occlusion samples.
const TAPS: i32 = 5;
/// Darkest ambient occlusion.
const DARKEST: f64 = 0.45;

/// Group of bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Group {
    Trunk,
    Limb,
    End,
}

/// Linear RGB of each part of a character.
pub(crate) fn of_parts(figure: &Figure) -> Vec<DVec3> {
    let mut own = figure.parts.iter().map(|part| part.color);
    let first = own.next().flatten();
    let one = own.all(|color| color == first);
    let color = |i: usize| {
        let group = group(figure, i) as usize;
        let part = figure.parts[i].color;
        match part {
            Some(color) if one => linear(color) * TINT[group],
            Some(color) => linear(color),
            None => linear(PALETTE[group]),
        }
    };
    (0..figure.parts.len()).map(|i| color(i).clamp(DVec3::ZERO, DVec3::ONE)).collect()
}

/// Linear RGB of the vertices of a piece, with ambient occlusion.
pub(crate) fn of_piece(field: &Field, parts: &[DVec3], piece: &Piece, cell: f64) -> Vec<DVec3> {
    let points = piece.surface.points.iter();
    let mut open: Vec<f64> =
        points.clone().zip(&piece.normals).map(|(p, n)| openness(field, *p, *n, DEPTH * cell)).collect();
    for _ in 0..PASSES {
        let mean = |i: usize| {
            let around: f64 = piece.neighbors[i].iter().map(|k| open[*k as usize]).sum();
            0.4 * open[i] + 0.6 * around / piece.neighbors[i].len().max(1) as f64
        };
        open = (0..open.len()).map(mean).collect();
    }
    points.zip(open).map(|(p, open)| open * base(field, &piece.layer, parts, *p, cell)).collect()
}

/// Linear RGB of a point of the surface.
fn base(field: &Field, layer: &Layer, parts: &[DVec3], p: DVec3, cell: f64) -> DVec3 {
    let mut near: Vec<(f64, DVec3)> = Vec::new();
    let solids = layer.solids.iter().map(|(i, _)| &field.solids[*i]);
    for solid in solids.filter(|solid| solid.kind != Kind::Ball) {
        if solid.bounds.0.distance(p) - solid.bounds.1 < 2.0 * field.widest + 2.0 * cell {
            let sample = solid.shape.sample(p);
            let [from, to] = solid.parts.map(|part| parts[part]);
            let width = BORDER * cell / solid.length.max(cell);
            let share = (0.5 + 0.5 * (sample.along - solid.split) / width).clamp(0.0, 1.0);
            near.push((sample.distance, from.lerp(to, share)));
        }
    }
    let least = near.iter().fold(f64::INFINITY, |least, (distance, _)| least.min(*distance));
    let (mut color, mut sum) = (DVec3::ZERO, 0.0);
    for (distance, own) in near {
        let weight = libm::exp((least - distance) / (BORDER * cell));
        color += weight * own;
        sum += weight;
    }
    if sum > 0.0 { color / sum } else { DVec3::splat(0.5) }
}

/// Ambient occlusion by the distance field (Evans, "Fast approximations for global illumination on dynamic scenes", 2006):
/// 1 where the surface is open, less where other parts are nearer than a flat surface would be.
fn openness(field: &Field, p: DVec3, normal: DVec3, depth: f64) -> f64 {
    let (mut hidden, mut whole, mut weight) = (0.0, 0.0, 1.0);
    for tap in 1..=TAPS {
        let height = depth * f64::from(tap) / f64::from(TAPS);
        let q = p + height * normal;
        let close =
            field.solids.iter().enumerate().filter(|(_, solid)| solid.bounds.0.distance(q) - solid.bounds.1 < height);
        let clear = field.sharp(close.map(|(i, _)| i), q).min(height);
        hidden += weight * (height - clear).max(0.0) / height;
        whole += weight;
        weight *= 0.75;
    }
    (1.0 - 1.1 * hidden / whole).clamp(DARKEST, 1.0)
}

/// The group of a part: the trunk is the root and bodies with several others below them, ends are the last bodies: heads,
/// hands and feet.
fn group(figure: &Figure, part: usize) -> Group {
    let here = &figure.parts[part];
    let bone = &figure.bones[here.bone];
    let below = |bone: usize| (0..figure.bones.len()).any(|at| figure.bones[at].parent == Some(bone));
    if here.bone > 0 && !below(here.bone) {
        return Group::End;
    }
    match here.bone == 0 || bone.children > 1 {
        true => Group::Trunk,
        false => Group::Limb,
    }
}

/// sRGB to linear light (IEC 61966-2-1).
fn linear(color: [f64; 3]) -> DVec3 {
    let channel = |value: f64| {
        let value = value.clamp(0.0, 1.0);
        if value <= 0.04045 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
    };
    DVec3::from_array(color.map(channel))
}
