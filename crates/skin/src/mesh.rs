//! From the field to vertices: the grid's cell, the surface, and its vertices on the field's zero.

use crate::field::Field;
use crate::figure::Figure;
use crate::grid::Grid;
use crate::layer::{Layer, layers};
use crate::nets::{Surface, surface};
use crate::solid::solids;
use glam::DVec3;

/// Radius of the thinnest part in cells. Thinner parts are thickened.
const THINNEST: f64 = 1.15;
/// Most points of all grids: 8 bytes each.
const MOST_POINTS: f64 = 6e6;
/// Rounds in which the cell is adjusted to the number of triangles.
const ROUNDS: usize = 4;
/// Fraction of the wanted triangles that is enough.
const CLOSE: f64 = 0.93;
/// Rounds in which vertices move along and onto the surface.
const RELAXATIONS: usize = 3;

/// A layer's surface on the zero of its field.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub layer: Layer,
    pub surface: Surface,
    pub normals: Vec<DVec3>,
    pub neighbors: Vec<Vec<u32>>,
}

/// The cell of the grid, m, with which the character has nearly this many triangles, and not more.
pub(crate) fn cell(figure: &Figure, triangles: usize) -> f64 {
    // surface nets have about 3 triangles per square of the cell's size
    let area: f64 = figure.parts.iter().map(|part| part.shape.area()).sum();
    let mut cell = (3.0 * area / triangles as f64).sqrt();
    let mut best: Option<f64> = None;
    for round in 0.. {
        let ratio = match size(figure, cell) {
            Size::TooFine(factor) => factor * factor,
            Size::Triangles(count) => count as f64 / triangles as f64,
        };
        if ratio <= 1.0 {
            best = Some(best.map_or(cell, |best| best.min(cell)));
        }
        if ratio <= 1.0 && ratio > CLOSE || round >= ROUNDS && best.is_some() {
            break;
        }
        cell *= (ratio.max(0.05) * 1.02).sqrt();
    }
    best.unwrap_or(cell)
}

/// Result of a cell size.
enum Size {
    Triangles(usize),
    /// The grid would have too many points. The cell should be larger by this factor.
    TooFine(f64),
}

fn size(figure: &Figure, cell: f64) -> Size {
    let thick = thick(figure, cell);
    let solids = solids(&thick);
    let field = Field::new(&thick, &solids);
    let layers = layers(&field, cell);
    let points: f64 = layers.iter().map(|layer| Grid::count(&field, layer, cell)).sum();
    if points > MOST_POINTS {
        return Size::TooFine(libm::cbrt(points / MOST_POINTS).max(1.01));
    }
    Size::Triangles(layers.iter().map(|layer| surface(&Grid::new(&field, layer, cell)).triangles.len()).sum())
}

/// The character with parts that are thick enough for a cell.
pub(crate) fn thick(figure: &Figure, cell: f64) -> Figure {
    figure.thickened(THINNEST * cell)
}

/// The surfaces of all layers.
pub(crate) fn pieces(field: &Field, cell: f64) -> Vec<Piece> {
    let pieces = layers(field, cell).into_iter().map(|layer| {
        let mut surface = surface(&Grid::new(field, &layer, cell));
        let neighbors = surface.neighbors();
        relax(field, &layer, &mut surface, &neighbors, cell);
        let normals = normals(field, &layer, &surface, cell);
        Piece { layer, surface, normals, neighbors }
    });
    pieces.filter(|piece| !piece.surface.triangles.is_empty()).collect()
}

/// Moves vertices along the surface to the middle of their neighbors, which evens out the triangles, and onto the surface.
fn relax(field: &Field, layer: &Layer, surface: &mut Surface, neighbors: &[Vec<u32>], cell: f64) {
    for round in 0..RELAXATIONS {
        let old = surface.points.clone();
        for (i, p) in surface.points.iter_mut().enumerate() {
            let near = layer.near(field, *p, 2.0 * cell);
            let mut at = *p;
            let gradient = layer.gradient(field, &near, at, 0.1 * cell);
            if round + 1 < RELAXATIONS && !neighbors[i].is_empty() {
                let sum: DVec3 = neighbors[i].iter().map(|k| old[*k as usize]).sum();
                let way = sum / neighbors[i].len() as f64 - at;
                at += 0.5 * (way - way.dot(gradient) * gradient);
            }
            let step = layer.distance(field, &near, at).clamp(-0.4 * cell, 0.4 * cell);
            *p = at - step * layer.gradient(field, &near, at, 0.1 * cell);
        }
    }
}

/// Unit normals: the gradient of the field, or the mean of the triangles where the field has a crease.
fn normals(field: &Field, layer: &Layer, surface: &Surface, cell: f64) -> Vec<DVec3> {
    let faces = surface.face_normals();
    let normal = |(p, face): (&DVec3, &DVec3)| {
        let near = layer.near(field, *p, 2.0 * cell);
        let gradient = layer.gradient(field, &near, *p, 0.15 * cell);
        let face = face.normalize_or(DVec3::Z);
        if gradient.dot(face) > 0.3 { gradient } else { face }
    };
    surface.points.iter().zip(&faces).map(normal).collect()
}
