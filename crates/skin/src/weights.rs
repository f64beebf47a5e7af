//! Skin weights: how far each vertex follows each bone.

use crate::field::{Field, REACH};
use crate::layer::Layer;
use crate::solid::Solid;
use glam::DVec3;

/// Distance over which the weight of a bone falls by a factor e, as a fraction of its radius at the vertex.
const SOFTNESS: f64 = 0.45;
/// Passes of Laplacian smoothing over the mesh.
const PASSES: usize = 4;
/// Bones per vertex.
pub(crate) const INFLUENCES: usize = 4;

/// The bones of a vertex and their weights in 255ths, largest first. Bones without weight are bone 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Influences {
    pub bones: [u8; INFLUENCES],
    pub weights: [u8; INFLUENCES],
}

/// Influences of the vertices of a layer's surface.
pub(crate) fn influences(
    field: &Field,
    layer: &Layer,
    points: &[DVec3],
    neighbors: &[Vec<u32>],
    cell: f64,
) -> Vec<Influences> {
    let rows: Vec<(usize, Vec<f64>)> = points.iter().map(|p| near(field, layer, *p, cell)).collect();
    let mut weights: Vec<Vec<f64>> = rows.iter().map(|(_, row)| row.clone()).collect();
    for _ in 0..PASSES {
        let smooth = |i: usize| {
            let (nearest, _) = rows[i];
            let share = 1.0 / neighbors[i].len().max(1) as f64;
            let mean = |bone: usize| {
                let around: f64 = neighbors[i].iter().map(|k| weights[*k as usize][bone]).sum();
                0.5 * weights[i][bone] + 0.5 * share * around
            };
            let allowed = |bone: usize| field.figure.between(bone, nearest) <= REACH;
            (0..field.figure.bones.len()).map(|bone| if allowed(bone) { mean(bone) } else { 0.0 }).collect()
        };
        weights = (0..points.len()).map(smooth).collect();
    }
    weights.iter().map(|row| rounded(row)).collect()
}

/// The nearest bone of a point, and the weights of all bones.
fn near(field: &Field, layer: &Layer, p: DVec3, cell: f64) -> (usize, Vec<f64>) {
    let figure = field.figure;
    let mut nearest: Vec<(f64, f64)> = vec![(f64::INFINITY, 0.0); figure.bones.len()];
    for (i, _) in layer.near(field, p, 4.0 * field.widest + 4.0 * cell) {
        let solid = &field.solids[i];
        for (end, bone) in solid.bones.into_iter().enumerate() {
            let distance = distance_to_end(solid, end, p);
            if distance < nearest[bone].0 {
                nearest[bone] = (distance, solid.radius);
            }
        }
    }
    // a limb with a surface of its own also follows the body that it hangs from
    let top = layer.bones.iter().position(|own| *own).unwrap_or(0);
    let related = |bone: usize| layer.bones[bone] || figure.up(top).any(|at| at == bone);
    let bones = (0..figure.bones.len()).filter(|bone| related(*bone));
    let first = bones.min_by(|a, b| nearest[*a].0.total_cmp(&nearest[*b].0)).unwrap_or(0);
    let (least, radius) = nearest[first];
    let weight = |bone: usize| {
        let (distance, own) = nearest[bone];
        if distance.is_infinite() || !related(bone) || figure.between(first, bone) > REACH {
            return f64::from(bone == first);
        }
        let soft = SOFTNESS * radius.min(own).max(0.5 * cell);
        libm::exp(-(distance - least).max(0.0) / soft)
    };
    let row: Vec<f64> = (0..figure.bones.len()).map(weight).collect();
    let sum: f64 = row.iter().sum();
    (first, row.into_iter().map(|weight| weight / sum).collect())
}

/// Distance to the part of a solid that belongs to the bone at its first (0) or second (1) end, m.
fn distance_to_end(solid: &Solid, end: usize, p: DVec3) -> f64 {
    let sample = solid.shape.sample(p);
    if solid.bones[0] == solid.bones[1] {
        return sample.distance;
    }
    let beyond = if end == 0 { sample.along - solid.split } else { solid.split - sample.along };
    sample.distance.max(0.0) + solid.length * beyond.max(0.0)
}

/// The largest weights in 255ths, whose sum is 255.
fn rounded(row: &[f64]) -> Influences {
    let mut order: Vec<usize> = (0..row.len()).filter(|bone| row[*bone] > 0.0).collect();
    order.sort_by(|a, b| row[*b].total_cmp(&row[*a]).then(a.cmp(b)));
    order.truncate(INFLUENCES);
    let sum: f64 = order.iter().map(|bone| row[*bone]).sum();
    let mut out = Influences::default();
    let mut left = 255_i32;
    for (i, bone) in order.iter().enumerate().rev() {
        let share = if i == 0 { left } else { (255.0 * row[*bone] / sum + 0.5) as i32 };
        left -= share;
        out.weights[i] = share as u8;
        out.bones[i] = if share > 0 { *bone as u8 } else { 0 };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Figure;
    use crate::layer::layers;
    use crate::solid::solids;
    use marathon_physics::Model;

    #[test]
    fn rounded_weights_sum_to_one_and_keep_the_largest() {
        let odd = rounded(&[0.1, 0.0, 0.301, 0.2, 0.399, 0.0001]);
        assert_eq!(odd.bones, [4, 2, 3, 0]);
        assert_eq!(odd.weights.iter().map(|w| u32::from(*w)).sum::<u32>(), 255);
        assert!(odd.weights.is_sorted_by(|a, b| a >= b));
        let one = rounded(&[0.0, 1.0]);
        assert_eq!((one.bones, one.weights), ([1, 0, 0, 0], [255, 0, 0, 0]));
    }

    /// A leg of four bodies in line, with joints every 0.5 m.
    #[test]
    fn weights_change_over_at_the_joints() {
        let text = "<mujoco><worldbody><body><freejoint/><geom type='capsule' fromto='0 0 0 .5 0 0' size='.05'/>
          <body pos='.5 0 0'><joint/><geom type='capsule' fromto='0 0 0 .5 0 0' size='.05'/>
          <body pos='.5 0 0'><joint/><geom type='capsule' fromto='0 0 0 .5 0 0' size='.05'/>
          <body pos='.5 0 0'><joint/><geom type='capsule' fromto='0 0 0 .5 0 0' size='.05'/></body></body></body></body>
          </worldbody></mujoco>";
        let figure = Figure::new(&Model::from_xml_str(text, "m.xml").expect("a model")).expect("a figure");
        let solids = solids(&figure);
        let field = Field::new(&figure, &solids);
        let layer = &layers(&field, 0.02)[0];
        let at = |x: f64| near(&field, layer, DVec3::new(x, 0.05, 0.0), 0.02).1;
        assert!(at(0.25)[0] > 0.99 && at(0.75)[1] > 0.99 && at(1.75)[3] > 0.99);
        for joint in [0.5, 1.0, 1.5] {
            let row = at(joint);
            let bone = (2.0 * joint) as usize;
            // limbs taper, so the thicker end is nearer
            assert!(row[bone - 1] > 0.3 && row[bone] > 0.3, "{joint}: {row:?}");
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        // the fourth body is three joints from the first
        assert_eq!(at(0.01)[3], 0.0);
    }
}
