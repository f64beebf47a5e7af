//! Surfaces that are made apart, because limbs overlap in the reference pose.
//!
//! Both legs of a planar walker can be in the same place. One surface around both could not move. Each such limb becomes a closed
//! surface of its own, with a socket: the fillet to the body that it hangs from.

use crate::field::Field;
use crate::figure::Figure;
use crate::solid::{Kind, Solid};
use glam::DVec3;

/// Depth of a socket below the surface of the body that a limb hangs from, as a fraction of the grid's cell.
const INSET: f64 = 0.12;
/// Distance of two limbs that one surface can tell apart, in cells.
const CLEAR: f64 = 1.3;
/// Points of an axis that are compared with other limbs.
const POINTS: u32 = 9;

/// Solids with one surface.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    /// The bones whose surface it is.
    pub bones: Vec<bool>,
    /// The solids, each with its inset, m.
    pub solids: Vec<(usize, f64)>,
    /// Solids of the layer itself, and the largest distance from them that the surface has, m. `None`: no socket.
    pub socket: Option<(Vec<usize>, f64)>,
}

impl Layer {
    /// Signed distance to the layer, m, by those of its solids that are listed.
    pub fn distance(&self, field: &Field, near: &[(usize, f64)], p: DVec3) -> f64 {
        let whole = field.distance(near, p);
        match &self.socket {
            Some((own, reach)) if whole < 1e3 * reach => whole.max(field.sharp(own.iter().copied(), p) - reach),
            _ => whole,
        }
    }

    /// Direction in which the distance grows, by central differences over `step`; zero where there is none.
    pub fn gradient(&self, field: &Field, near: &[(usize, f64)], p: DVec3, step: f64) -> DVec3 {
        let slope =
            |axis: DVec3| self.distance(field, near, p + step * axis) - self.distance(field, near, p - step * axis);
        DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).normalize_or_zero()
    }

    /// The solids that can matter within `reach` of a point.
    pub fn near(&self, field: &Field, p: DVec3, reach: f64) -> Vec<(usize, f64)> {
        let close = |solid: &Solid| solid.bounds.0.distance(p) - solid.bounds.1 < reach + field.widest;
        self.solids.iter().copied().filter(|(i, _)| close(&field.solids[*i])).collect()
    }
}

/// The layers of a character for a grid with cells of this size: first the one with the root.
pub(crate) fn layers(field: &Field, cell: f64) -> Vec<Layer> {
    let (figure, solids) = (field.figure, field.solids);
    let cut = cuts(figure, solids, cell);
    // the layer of a bone is that of the nearest cut above it
    let top = |bone: usize| figure.up(bone).find(|at| cut[*at]).unwrap_or(0);
    let tops: Vec<usize> = (0..figure.bones.len()).filter(|bone| *bone == 0 || cut[*bone]).collect();
    let layers = tops.into_iter().map(|root| {
        let bones: Vec<bool> = (0..figure.bones.len()).map(|bone| top(bone) == root).collect();
        // what joins a limb to its body is the limb's
        let owner = |solid: &Solid| top(solid.bones[0].max(solid.bones[1]));
        let own: Vec<usize> = (0..solids.len()).filter(|i| owner(&solids[*i]) == root).collect();
        let mut listed: Vec<(usize, f64)> = own.iter().map(|i| (*i, 0.0)).collect();
        let above = figure.up(root).skip(1).find(|at| solids.iter().any(|solid| solid.bones == [*at; 2]));
        let socket = above.map(|above| {
            let body = (0..solids.len()).filter(|i| solids[*i].bones.contains(&above) && !own.contains(i));
            let body: Vec<usize> = body.filter(|i| figure.in_line(owner(&solids[*i]), above)).collect();
            let body: Vec<usize> = body.into_iter().filter(|i| owner(&solids[*i]) == top(above)).collect();
            let widths = body.iter().flat_map(|a| own.iter().map(|b| field.width(*a, *b)));
            let reach = widths.fold(cell, f64::max);
            listed.extend(body.iter().map(|i| (*i, INSET * cell)));
            (own.clone(), reach)
        });
        Layer { bones, solids: listed, socket }
    });
    layers.filter(|layer| !layer.solids.is_empty()).collect()
}

/// Marks the bones at which a limb is cut off: the first bones of two limbs that touch each other away from the body that
/// both hang from.
fn cuts(figure: &Figure, solids: &[Solid], cell: f64) -> Vec<bool> {
    let mut cut = vec![false; figure.bones.len()];
    let parts: Vec<&Solid> = solids.iter().filter(|solid| solid.kind == Kind::Part).collect();
    for a in &parts {
        for b in &parts {
            let (x, y) = (a.bones[0], b.bones[0]);
            if figure.in_line(x, y) || a.bounds.0.distance(b.bounds.0) > a.bounds.1 + b.bounds.1 + CLEAR * cell {
                continue;
            }
            let fork = figure.fork(x, y);
            let body: Vec<&&Solid> = parts.iter().filter(|solid| figure.between(solid.bones[0], fork) == 0).collect();
            let axis = a.shape.axis();
            let touches = (0..POINTS).any(|i| {
                let p = axis.ends[0].lerp(axis.ends[1], f64::from(i) / f64::from(POINTS - 1));
                let outside = body.iter().all(|solid| solid.shape.sample(p).distance > 0.5 * axis.radius);
                outside && b.shape.sample(p).distance - axis.radius < CLEAR * cell
            });
            if touches {
                for bone in [x, y] {
                    if let Some(first) = figure.up(bone).take_while(|at| *at != fork).last() {
                        cut[first] = true;
                    }
                }
            }
        }
    }
    cut
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::solids;
    use marathon_physics::Model;

    fn walker(apart: f64) -> Figure {
        let leg = |y: f64| {
            format!(
                "<body pos='0 {y} 0'><joint axis='0 1 0'/><geom type='capsule' fromto='0 0 0 0 0 -.5' size='.05'/>
                 <body pos='0 0 -.5'><joint axis='0 1 0'/><geom type='capsule' fromto='0 0 0 0 0 -.5' size='.05'/></body></body>"
            )
        };
        let text = format!(
            "<mujoco><worldbody><body><freejoint/><geom type='capsule' fromto='0 0 0 0 0 .5' size='.07'/>{}{}</body>\
             </worldbody></mujoco>",
            leg(apart),
            leg(-apart)
        );
        Figure::new(&Model::from_xml_str(&text, "m.xml").expect("a model")).expect("a figure")
    }

    #[test]
    fn limbs_in_one_place_get_surfaces_of_their_own() {
        for (apart, expected) in [(0.0, 3), (0.03, 3), (0.2, 1)] {
            let figure = walker(apart);
            let solids = solids(&figure);
            let field = Field::new(&figure, &solids);
            let layers = layers(&field, 0.02);
            assert_eq!(layers.len(), expected, "{apart} m apart");
            for bone in 0..figure.bones.len() {
                assert_eq!(layers.iter().filter(|layer| layer.bones[bone]).count(), 1);
            }
        }
    }

    #[test]
    fn a_socket_stays_near_its_limb() {
        let figure = walker(0.0);
        let solids = solids(&figure);
        let field = Field::new(&figure, &solids);
        let layers = layers(&field, 0.02);
        let leg = &layers[1];
        let inside = |p: DVec3| leg.distance(&field, &leg.near(&field, p, 1.0), p) < 0.0;
        assert!(inside(DVec3::new(0.0, 0.0, -0.3)));
        assert!(!inside(DVec3::new(0.0, 0.0, 0.4)), "the trunk has its own surface");
    }
}
