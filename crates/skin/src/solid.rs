//! The solids that the surface is made of: the character's parts, balls at joints, and links across gaps.
//!
//! MJCF models leave gaps: a head floats above the shoulders, a shin ends above the foot. A link fills the gap between
//! two neighbors. Parallel parts, such as the capsules of a trunk, are linked over their whole length.

use crate::figure::{Bone, Figure, Part};
use crate::shape::{Axis, Shape, nearest_on};
use glam::DVec3;

/// Radius of a ball at a joint, as a fraction of the thinner part: linear blending thins joints.
const BALL: f64 = 1.04;
/// Radius of a link's end as a fraction of its part's radius.
const LINK: f64 = 0.95;
/// Largest radius of a link's end as a fraction of the radius at its other end.
const TAPER: f64 = 1.45;
/// Largest gap that a link fills, as a multiple of the larger radius.
const WIDEST_GAP: f64 = 4.0;
/// Overlap of two parts that needs no link, as a fraction of the smaller radius.
const OVERLAP: f64 = 0.35;
/// The same for parallel parts.
const PARALLEL_OVERLAP: f64 = 1.2;
/// Cosine of the largest angle between parallel parts.
const PARALLEL: f64 = 0.85;

/// Radius of the neck of a ball, as a fraction of the smaller radius.
const NECK: f64 = 0.8;
/// Radius of a link where it meets a thinner part, as a multiple of that part's radius: shoulders are wider than arms.
const SHOULDER: f64 = 1.2;
/// Radii of a limb at the joint that it hangs from and at its other end, as multiples of the geom's.
const LIMB: [f64; 2] = [1.12, 0.9];
/// Half length of the end of a link that meets the middle of a part, as a multiple of the other part's radius.
const SPREAD: f64 = 1.1;
/// Cosine of the smallest angle at which a link meets the middle of a part.
const ACROSS: f64 = 0.5;
/// Cosine of the smallest angle between a part and a link that leaves its end along it.
const ASKEW: f64 = 0.95;
/// Length over which such a link slopes down to its part otherwise, as a multiple of the part's radius: shoulders slope to the neck.
const SLOPE: f64 = 2.0;

/// Purpose of a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Part,
    Ball,
    Link,
}

/// A solid that belongs to one bone, or to one at each end.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub kind: Kind,
    pub shape: Shape,
    /// Bones at the first and the second end.
    pub bones: [usize; 2],
    /// Part whose color the first and the second end have.
    pub parts: [usize; 2],
    /// Place along the solid where the second bone takes over, 0 to 1.
    pub split: f64,
    /// Length along the solid, m.
    pub length: f64,
    /// Radius of the thinner end, m.
    pub radius: f64,
    /// A ball that holds it.
    pub bounds: (DVec3, f64),
}

impl Solid {
    fn new(kind: Kind, shape: Shape, bones: [usize; 2], parts: [usize; 2]) -> Self {
        let Axis { ends, radius } = shape.axis();
        let bounds = shape.bounds();
        Solid { kind, bones, parts, split: 0.5, length: ends[0].distance(ends[1]), radius, bounds, shape }
    }
}

/// All solids of a character: first its parts in their order, then balls and links.
pub(crate) fn solids(figure: &Figure) -> Vec<Solid> {
    let mut solids: Vec<Solid> = (figure.parts.iter().enumerate())
        .map(|(i, part)| Solid::new(Kind::Part, tapered(figure, part), [part.bone; 2], [i; 2]))
        .collect();
    let axes: Vec<Axis> = solids.iter().map(|solid| solid.shape.axis()).collect();
    let mut more = Vec::new();
    for bone in 0..figure.bones.len() {
        let own = parts_of(figure, bone);
        more.extend(spanning(&own, &axes).into_iter().filter_map(|pair| link(figure, &axes, pair)));
        let above = figure.up(bone).skip(1).map(|at| parts_of(figure, at)).find(|parts| !parts.is_empty());
        let Some(pair) = above.and_then(|above| nearest_pair(&above, &own, &axes)) else { continue };
        more.extend(link(figure, &axes, pair));
        more.extend(ball(figure, &figure.bones[bone], &solids, pair));
    }
    solids.extend(more);
    solids
}

/// The shape of a part. Limbs become thicker at the joint that they hang from and thinner at the other end, as those of
/// animals are.
fn tapered(figure: &Figure, part: &Part) -> Shape {
    let bone = &figure.bones[part.bone];
    let Shape::Rod { ends, radii: [a, b] } = part.shape else { return part.shape.clone() };
    let length = ends[0].distance(ends[1]);
    let near = ends.map(|end| end.distance(bone.anchor));
    let limb = bone.parent.is_some() && bone.turns && bone.children > 0;
    if !limb || a != b || length < 3.0 * a || near[0].min(near[1]) > a + 0.2 * length {
        return part.shape.clone();
    }
    let factors = if near[0] <= near[1] { LIMB } else { [LIMB[1], LIMB[0]] };
    Shape::Rod { ends, radii: factors.map(|factor| factor * a) }
}

fn parts_of(figure: &Figure, bone: usize) -> Vec<usize> {
    (0..figure.parts.len()).filter(|i| figure.parts[*i].bone == bone).collect()
}

/// Space between the surfaces of two parts, m; negative if they overlap.
fn gap(a: &Axis, b: &Axis) -> f64 {
    let [p, q] = closest(a.ends, b.ends);
    p.distance(q) - a.radius - b.radius
}

/// The pairs of a tree over the parts of one bone with the smallest gaps (Kruskal).
fn spanning(parts: &[usize], axes: &[Axis]) -> Vec<[usize; 2]> {
    let mut pairs: Vec<(f64, [usize; 2])> = Vec::new();
    for (i, a) in parts.iter().enumerate() {
        pairs.extend(parts[..i].iter().map(|b| (gap(&axes[*b], &axes[*a]), [*b, *a])));
    }
    pairs.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let mut group: Vec<usize> = (0..axes.len()).collect();
    let mut tree = Vec::new();
    for (_, [a, b]) in pairs {
        let (from, to) = (group[a], group[b]);
        if from != to {
            group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
            tree.push([a, b]);
        }
    }
    tree
}

/// The pair with the smallest gap, one part from each list.
fn nearest_pair(above: &[usize], below: &[usize], axes: &[Axis]) -> Option<[usize; 2]> {
    let pairs = above.iter().flat_map(|a| below.iter().map(move |b| [*a, *b]));
    pairs.min_by(|[a, b], [c, d]| gap(&axes[*a], &axes[*b]).total_cmp(&gap(&axes[*c], &axes[*d])))
}

/// The link between two parts; `None` if they overlap enough, or are far apart.
fn link(figure: &Figure, axes: &[Axis], parts: [usize; 2]) -> Option<Solid> {
    let bones = parts.map(|part| figure.parts[part].bone);
    let [a, b] = parts.map(|part| axes[part]);
    let (small, large) = (a.radius.min(b.radius), a.radius.max(b.radius));
    let space = gap(&a, &b);
    if space > WIDEST_GAP * large {
        return None;
    }
    let mut solid = match side_by_side(&a, &b) {
        Some([from, to]) if apart(from, to) - a.radius - b.radius > -PARALLEL_OVERLAP * small => {
            let shape = Shape::Sheet { from, to, radii: [a.radius, b.radius] };
            Solid::new(Kind::Link, shape, bones, parts)
        }
        None if space > -OVERLAP * small => {
            let long = |axis: &Axis| axis.ends[0].distance(axis.ends[1]) > 0.5 * axis.radius;
            let most = if long(&a) && long(&b) { LINK * TAPER } else { NECK };
            let radii = [a.radius, b.radius].map(|r| (LINK * r).min(most * small));
            let radii = match b.radius < a.radius && most > 1.0 {
                true => [radii[0], (SHOULDER * b.radius).min(radii[0])],
                false => radii,
            };
            Solid::new(Kind::Link, between(&a, &b, ends_at(figure, parts, &a, &b), radii), bones, parts)
        }
        _ => return None,
    };
    // the skin bends at the joint
    if let Some(joint) = bones.into_iter().max().filter(|_| bones[0] != bones[1]) {
        let [from, to] = solid.shape.axis().ends;
        solid.split = nearest_on(from, to, figure.bones[joint].anchor).clamp(0.2, 0.8);
    }
    Some(solid)
}

/// Ends of a link: the nearest points of both axes, or those nearest to the joint if the lower part begins there, as an arm
/// does at the shoulder.
fn ends_at(figure: &Figure, parts: [usize; 2], a: &Axis, b: &Axis) -> [DVec3; 2] {
    let [above, below] = parts.map(|part| figure.parts[part].bone);
    let joint = figure.bones[below].anchor;
    let on = |axis: &Axis, p: DVec3| axis.ends[0].lerp(axis.ends[1], nearest_on(axis.ends[0], axis.ends[1], p));
    let start = on(b, joint);
    if above == below || !figure.bones[below].turns || start.distance(joint) > b.radius {
        return closest(a.ends, b.ends);
    }
    [on(a, start), start]
}

/// A link between two parts. Where the end of one meets the middle of the other, it spreads there, as an ankle does over a foot.
fn between(a: &Axis, b: &Axis, [p, q]: [DVec3; 2], radii: [f64; 2]) -> Shape {
    let spread = |axis: &Axis, at: DVec3, other: &Axis, reach: f64| {
        let length = axis.ends[0].distance(axis.ends[1]);
        let way = (axis.ends[1] - axis.ends[0]).normalize_or_zero();
        // a ball, such as a head, has a round neck
        if other.ends[0] == other.ends[1] {
            return [at; 2];
        }
        let place = (at - axis.ends[0]).dot(way);
        [place - reach, place + reach].map(|x| axis.ends[0] + x.clamp(0.0, length) * way)
    };
    // cosine of the angle between a part and the link; 1 for a ball
    let angle = |axis: &Axis| {
        let way = (axis.ends[1] - axis.ends[0]).normalize_or(q - p);
        way.dot((q - p).normalize_or_zero()).abs()
    };
    match (angle(a), angle(b)) {
        (x, _) if (ACROSS..ASKEW).contains(&x) && b.radius < a.radius => {
            Shape::Sheet { from: spread(a, p, b, SLOPE * a.radius), to: [q; 2], radii }
        }
        (x, y) if x >= ACROSS && y < ACROSS => {
            Shape::Sheet { from: [p; 2], to: spread(b, q, a, SPREAD * a.radius), radii }
        }
        (x, y) if x < ACROSS && y >= ACROSS => {
            Shape::Sheet { from: spread(a, p, b, SPREAD * b.radius), to: [q; 2], radii }
        }
        _ => Shape::Rod { ends: [p, q], radii },
    }
}

/// The larger distance between the ends of two segments, m.
fn apart(a: [DVec3; 2], b: [DVec3; 2]) -> f64 {
    a[0].distance(b[0]).max(a[1].distance(b[1]))
}

/// The axes of two parallel parts that lie beside each other, in one direction; the longer one is cut to twice the
/// shorter one.
fn side_by_side(a: &Axis, b: &Axis) -> Option<[[DVec3; 2]; 2]> {
    let (u, v) = (a.ends[1] - a.ends[0], b.ends[1] - b.ends[0]);
    let (long, short) = (u.length().max(v.length()), u.length().min(v.length()));
    if short < 0.3 * a.radius.min(b.radius) || u.dot(v).abs() < PARALLEL * u.length() * v.length() {
        return None;
    }
    let second = if u.dot(v) < 0.0 { [b.ends[1], b.ends[0]] } else { b.ends };
    let way = u.normalize();
    let place = |p: DVec3| (p - a.ends[0]).dot(way);
    let overlap = u.length().min(place(second[1])) - place(second[0]).max(0.0);
    if overlap < 0.5 * short {
        return None;
    }
    let cut = |ends: [DVec3; 2], to: [DVec3; 2]| {
        let [from, till] = to.map(|p| nearest_on(ends[0], ends[1], p));
        let spare = (0.5 * short / long).min(0.5);
        [(from - spare).max(0.0), (till + spare).min(1.0)].map(|t| ends[0].lerp(ends[1], t))
    };
    match u.length() > 2.0 * v.length() {
        true => Some([cut(a.ends, second), second]),
        false if v.length() > 2.0 * u.length() => Some([a.ends, cut(second, a.ends)]),
        false => Some([a.ends, second]),
    }
}

/// A ball at the joint between two parts, if both reach it.
fn ball(figure: &Figure, bone: &Bone, solids: &[Solid], parts: [usize; 2]) -> Option<Solid> {
    let radius = BALL * solids[parts[0]].radius.min(solids[parts[1]].radius);
    let near = |part: &usize| solids[*part].shape.sample(bone.anchor).distance < 0.4 * radius;
    let bones = parts.map(|part| figure.parts[part].bone);
    let shape = Shape::ball(bone.anchor, radius);
    (bone.turns && parts.iter().all(near)).then(|| Solid::new(Kind::Ball, shape, bones, parts))
}

/// The nearest points of two segments (Ericson, Real-Time Collision Detection, 5.1.9).
fn closest([p1, q1]: [DVec3; 2], [p2, q2]: [DVec3; 2]) -> [DVec3; 2] {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, b, c, f) = (d1.length_squared(), d2.length_squared(), d1.dot(d2), d1.dot(r), d2.dot(r));
    const POINT: f64 = 1e-18;
    let (s, t) = if a <= POINT {
        (0.0, if e <= POINT { 0.0 } else { (f / e).clamp(0.0, 1.0) })
    } else if e <= POINT {
        ((-c / a).clamp(0.0, 1.0), 0.0)
    } else {
        let denominator = a * e - b * b;
        // the middle of parallel segments keeps both sides alike
        let s = if denominator > 1e-9 * a * e { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.5 };
        let t = (b * s + f) / e;
        let t = t.clamp(0.0, 1.0);
        (((b * t - c) / a).clamp(0.0, 1.0), t)
    };
    [p1 + s * d1, p2 + t * d2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_physics::Model;

    fn of(body: &str) -> (Figure, Vec<Solid>) {
        let text = format!("<mujoco><worldbody><body name='a'><freejoint/>{body}</body></worldbody></mujoco>");
        let figure = Figure::new(&Model::from_xml_str(&text, "m.xml").expect("a model")).expect("a figure");
        let solids = solids(&figure);
        (figure, solids)
    }

    #[test]
    fn nearest_points_are_nearer_than_all_others() {
        let rows = [
            [DVec3::ZERO, DVec3::X, DVec3::new(0.5, 1.0, -1.0), DVec3::new(0.5, 1.0, 1.0)],
            [DVec3::ZERO, DVec3::X, DVec3::new(2.0, 1.0, 0.0), DVec3::new(3.0, 5.0, 0.0)],
            [DVec3::ZERO, DVec3::X, DVec3::new(0.2, 1.0, 0.0), DVec3::new(5.0, 1.0, 0.0)],
            [DVec3::ZERO, DVec3::ZERO, DVec3::Y, DVec3::new(1.0, 1.0, 1.0)],
        ];
        for [a, b, c, d] in rows {
            let [p, q] = closest([a, b], [c, d]);
            for i in 0..=20 {
                for k in 0..=20 {
                    let (x, y) = (a.lerp(b, f64::from(i) / 20.0), c.lerp(d, f64::from(k) / 20.0));
                    assert!(p.distance(q) <= x.distance(y) + 1e-12, "{a} {b} {c} {d}");
                }
            }
        }
    }

    #[test]
    fn a_floating_head_gets_a_neck() {
        let (_, solids) =
            of("<geom type='capsule' fromto='0 -.1 0 0 .1 0' size='.06'/><geom size='.09' pos='0 0 .25'/>");
        assert_eq!(solids.len(), 3);
        assert_eq!(solids[2].kind, Kind::Link);
        let middle = solids[2].shape.sample(DVec3::new(0.0, 0.0, 0.11));
        assert!(middle.distance < -0.03, "{middle:?}");
        // a head that rests on the shoulders has none
        let (_, solids) =
            of("<geom type='capsule' fromto='0 -.1 0 0 .1 0' size='.06'/><geom size='.09' pos='0 0 .1'/>");
        assert_eq!(solids.len(), 2);
    }

    #[test]
    fn parallel_parts_are_linked_over_their_length() {
        let stacked = "<geom type='capsule' fromto='0 -.1 0 0 .1 0' size='.06'/>\
                       <geom type='capsule' fromto='0 .1 .15 0 -.1 .15' size='.05'/>";
        let (_, solids) = of(stacked);
        let edge = solids[2].shape.sample(DVec3::new(0.0, 0.1, 0.08));
        assert!(edge.distance < -0.04, "the sheet reaches the ends: {edge:?}");
    }

    #[test]
    fn a_joint_has_a_ball_that_belongs_to_both_bones() {
        let (figure, solids) = of(
            "<geom type='capsule' fromto='0 0 0 0 0 -.3' size='.05'/><body name='b' pos='0 0 -.33'><joint axis='0 1 0'/>\
             <geom type='capsule' fromto='0 0 -.03 0 0 -.3' size='.04'/></body>",
        );
        let balls: Vec<&Solid> = solids.iter().filter(|solid| solid.kind == Kind::Ball).collect();
        assert_eq!(balls.len(), 1);
        assert_eq!((balls[0].bones, balls[0].bounds.0), ([0, 1], figure.bones[1].anchor));
        assert!((balls[0].radius - BALL * 0.04).abs() < 1e-12);
    }
}
