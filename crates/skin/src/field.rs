//! The distance to several solids, with fillets between neighbors.
//!
//! A fillet is a polynomial smooth minimum of third degree (Inigo Quilez, iquilezles.org/articles/smin), scaled by the
//! angle between the two surfaces: parallel surfaces, such as those of two capsules in line, do not swell (after Gourmel
//! and others, "A gradient-based implicit blend", 2013).

use crate::figure::Figure;
use crate::solid::Solid;
use glam::DVec3;

/// Width of a fillet as a fraction of the thinner radius, for bones in line with at most one joint between them.
const FILLET: f64 = 1.6;
/// The same with two joints between them.
const FAR_FILLET: f64 = 0.8;
/// The same for two bones that hang from a third, such as both thighs.
const SIBLING_FILLET: f64 = 0.4;
/// Joints between two bones beyond which their parts do not blend.
pub(crate) const REACH: usize = 2;

/// Solids with fillets.
#[derive(Clone, Debug)]
pub(crate) struct Field<'a> {
    pub figure: &'a Figure,
    pub solids: &'a [Solid],
    /// Width of the fillet between each two solids, m; 0: none.
    widths: Vec<f64>,
    /// The largest width, m.
    pub widest: f64,
}

/// Distance to one of the solids near a point.
#[derive(Clone, Copy)]
struct Near {
    solid: usize,
    distance: f64,
    gradient: DVec3,
}

impl<'a> Field<'a> {
    pub fn new(figure: &'a Figure, solids: &'a [Solid]) -> Self {
        let n = solids.len();
        let mut widths = vec![0.0; n * n];
        for (i, a) in solids.iter().enumerate() {
            for (k, b) in solids[..i].iter().enumerate() {
                let width = factor(figure, a, b) * a.radius.min(b.radius);
                widths[i * n + k] = width;
                widths[k * n + i] = width;
            }
        }
        let widest = widths.iter().copied().fold(0.0, f64::max);
        Field { figure, solids, widths, widest }
    }

    /// Width of the fillet between two solids, m.
    pub fn width(&self, a: usize, b: usize) -> f64 {
        self.widths[a * self.solids.len() + b]
    }

    /// Signed distance to some of the solids, m, without fillets.
    pub fn sharp(&self, which: impl IntoIterator<Item = usize>, p: DVec3) -> f64 {
        which.into_iter().fold(f64::INFINITY, |least, i| least.min(self.solids[i].shape.sample(p).distance))
    }

    /// Signed distance to some of the solids, m, each of which is moved inward by its own amount. Infinite without
    /// solids.
    pub fn distance(&self, which: &[(usize, f64)], p: DVec3) -> f64 {
        const MANY: usize = 32;
        let mut near = [Near { solid: 0, distance: 0.0, gradient: DVec3::ZERO }; MANY];
        let mut count = 0;
        let mut least = f64::INFINITY;
        for (solid, inset) in which {
            let sample = self.solids[*solid].shape.sample(p);
            let distance = sample.distance + inset;
            least = least.min(distance);
            // only these can change the result
            if distance < least + self.widest {
                if count == MANY {
                    count = keep(&mut near, least + self.widest);
                }
                if count < MANY {
                    near[count] = Near { solid: *solid, distance, gradient: sample.gradient };
                    count += 1;
                }
            }
        }
        let near = &near[..count];
        let mut result = least;
        for a in near {
            let mut fourth = 0.0;
            for b in near {
                let width = self.width(a.solid, b.solid);
                let apart = (a.distance - b.distance).abs();
                if b.solid != a.solid && apart < width {
                    let share = 1.0 - apart / width;
                    let angle = 0.5 * (1.0 - a.gradient.dot(b.gradient));
                    let fillet = width / 6.0 * share * share * share * angle * (2.0 - angle);
                    fourth += fillet * fillet * (fillet * fillet);
                }
            }
            // a smooth maximum: solids that nearly coincide, as at joints, do not add up
            result = result.min(a.distance - fourth.sqrt().sqrt());
        }
        result
    }
}

/// Moves the solids nearer than `limit` to the front. Returns their number.
fn keep(near: &mut [Near], limit: f64) -> usize {
    let mut count = 0;
    for i in 0..near.len() {
        if near[i].distance < limit {
            near.swap(count, i);
            count += 1;
        }
    }
    count
}

/// Width of the fillet between two solids as a fraction of the thinner radius.
fn factor(figure: &Figure, a: &Solid, b: &Solid) -> f64 {
    let pairs = a.bones.iter().flat_map(|x| b.bones.iter().map(move |y| (*x, *y)));
    let of = |(x, y)| match (figure.between(x, y), figure.in_line(x, y)) {
        (0, _) | (1, true) => FILLET,
        (2, true) => FAR_FILLET,
        (1 | 2, false) => SIBLING_FILLET,
        _ => 0.0,
    };
    debug_assert_eq!(REACH, 2);
    pairs.map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::solids;
    use marathon_physics::Model;

    /// A chain of four bodies, bent so that the last capsule runs beside the first one, 2 mm apart.
    const CHAIN: &str =
        "<mujoco><worldbody><body name='a'><freejoint/><geom type='capsule' fromto='0 0 0 1 0 0' size='.05'/>
      <body pos='1 0 0'><joint/><geom type='capsule' fromto='0 0 0 0 .5 0' size='.05'/>
      <body pos='0 .5 0'><joint/><geom type='capsule' fromto='0 0 0 0 0 .5' size='.05'/>
      <body pos='0 0 .5'><joint/><geom type='capsule' fromto='-.2 -.398 -.5 -.8 -.398 -.5' size='.05'/>
      </body></body></body></body></worldbody></mujoco>";

    fn at(field: &Field, p: DVec3) -> [f64; 2] {
        let all: Vec<(usize, f64)> = (0..field.solids.len()).map(|i| (i, 0.0)).collect();
        [field.distance(&all, p), field.sharp(0..field.solids.len(), p)]
    }

    #[test]
    fn neighbors_have_a_fillet_and_strangers_have_none() {
        let model = Model::from_xml_str(CHAIN, "m.xml").expect("a model");
        let figure = Figure::new(&model).expect("a figure");
        let parts: Vec<Solid> = solids(&figure).into_iter().take(4).collect();
        let field = Field::new(&figure, &parts);
        // in the corner between the first and the second capsule
        let [smooth, sharp] = at(&field, DVec3::new(0.945, 0.055, 0.0));
        assert!(smooth < sharp - 1e-3 && smooth > sharp - 0.05, "{smooth} {sharp}");
        // between the first and the last capsule, three joints apart
        let [smooth, sharp] = at(&field, DVec3::new(0.5, 0.051, 0.0));
        assert_eq!(smooth, sharp);
        assert_eq!(field.width(0, 3), 0.0);
        assert!((field.width(0, 1) - FILLET * 0.045).abs() < 1e-12);
    }

    #[test]
    fn capsules_in_line_do_not_swell() {
        let text = "<mujoco><worldbody><body><freejoint/><geom type='capsule' fromto='0 0 0 0 0 1' size='.05'/>
          <body pos='0 0 1'><joint/><geom type='capsule' fromto='0 0 0 0 0 1' size='.05'/></body></body></worldbody></mujoco>";
        let model = Model::from_xml_str(text, "m.xml").expect("a model");
        let figure = Figure::new(&model).expect("a figure");
        let parts: Vec<Solid> = solids(&figure).into_iter().take(2).collect();
        let field = Field::new(&figure, &parts);
        let [smooth, sharp] = at(&field, DVec3::new(0.05, 0.0, 1.0));
        assert!((smooth - sharp).abs() < 1e-9, "{smooth} {sharp}");
    }

    /// Neither order nor splitting of the list changes the distance.
    #[test]
    fn the_order_of_solids_does_not_matter() {
        let model = Model::from_xml_str(CHAIN, "m.xml").expect("a model");
        let figure = Figure::new(&model).expect("a figure");
        let all = solids(&figure);
        let field = Field::new(&figure, &all);
        let forward: Vec<(usize, f64)> = (0..all.len()).map(|i| (i, 0.0)).collect();
        let backward: Vec<(usize, f64)> = forward.iter().rev().copied().collect();
        for i in 0..1000 {
            let p = DVec3::new((i % 10) as f64 * 0.13, (i / 10 % 10) as f64 * 0.07, (i / 100) as f64 * 0.06);
            let (a, b) = (field.distance(&forward, p), field.distance(&backward, p));
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }
}
