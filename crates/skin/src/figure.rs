//! The character of a model in its reference pose: its bodies, and the geoms that become skin.

use crate::error::SkinError;
use crate::shape::Shape;
use glam::{DQuat, DVec3};
use marathon_physics::Model;
use marathon_physics::model::{Geom, GeomType, JointType};
use std::collections::BTreeMap;

/// Most joints of a skinned mesh: joint indices are bytes, and Bevy allows as many.
pub(crate) const MAX_JOINTS: usize = 256;
/// First of the geom groups that MuJoCo's viewer hides by default.
const FIRST_HIDDEN_GROUP: i32 = 3;
/// Radius of an edge as a fraction of the smallest half length.
const ROUND: f64 = 0.35;
/// MuJoCo's default color, which means that the model sets none.
const UNCHOSEN: [f32; 4] = [0.5, 0.5, 0.5, 1.0];
/// Largest coordinate of a model, m.
const FAR: f64 = 1e6;

/// A body of the character.
#[derive(Clone, Debug)]
pub(crate) struct Bone {
    /// Name of the body, or a name made from its number if it has none.
    pub name: String,
    /// Lower index.
    pub parent: Option<usize>,
    /// Position of its first joint, m, or of its frame if it has none.
    pub anchor: DVec3,
    /// Whether it turns about its anchor.
    pub turns: bool,
    /// Whether it has joints: without, it is a rigid part of its parent.
    pub moves: bool,
    /// Number of bodies directly below it.
    pub children: usize,
}

/// A geom that becomes skin.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub bone: usize,
    pub shape: Shape,
    /// sRGB, if the file sets a color.
    pub color: Option<[f64; 3]>,
}

/// A kinematic tree.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    pub bones: Vec<Bone>,
    pub parts: Vec<Part>,
    /// Number of joints between two bones.
    between: Vec<usize>,
}

impl Figure {
    /// The tree of the model's first joint, or else the first tree with a suitable geom.
    pub fn new(model: &Model) -> Result<Self, SkinError> {
        let name = || model.name.clone();
        let first = model.joints.first().map(|joint| model.bodies[joint.body].root_id);
        let trees = first.into_iter().chain((1..model.bodies.len()).filter(|i| model.bodies[*i].parent == 0));
        let mut with_skin = trees
            .filter(|root| (model.geoms.iter()).any(|geom| model.bodies[geom.body].root_id == *root && suitable(geom)));
        let Some(root) = with_skin.next() else {
            return Err(SkinError::NoGeoms { model: name(), found: found(model) });
        };
        let bodies: Vec<usize> = (1..model.bodies.len()).filter(|i| model.bodies[*i].root_id == root).collect();
        if bodies.len() > MAX_JOINTS {
            let root = model.bodies[root].name.clone();
            return Err(SkinError::TooManyBodies { model: name(), root, found: bodies.len(), max: MAX_JOINTS });
        }

        let places = places(model);
        let bone_of: BTreeMap<usize, usize> = bodies.iter().enumerate().map(|(bone, body)| (*body, bone)).collect();
        let bones: Vec<Bone> = bodies.iter().map(|body| bone(model, *body, &bone_of, &places)).collect();
        let mut parts = Vec::new();
        for body in &bodies {
            let geom_at = &model.geoms[model.bodies[*body].geom_start..][..model.bodies[*body].geom_count];
            for geom in shown(geom_at) {
                let (pos, turn) = places[*body];
                let (center, turn) = (pos + turn * DVec3::from_array(geom.pos), (turn * quat(geom.quat)).normalize());
                let Some(shape) = shape(geom, center, turn) else { continue };
                let (at, reach) = shape.bounds();
                if !(at.abs().max_element() < FAR && reach < FAR && reach > 0.0) {
                    return Err(SkinError::NotFinite { model: name(), geom: geom.name.clone() });
                }
                let [r, g, b, _] = geom.rgba.map(f64::from);
                let color = (geom.rgba != UNCHOSEN).then_some([r, g, b]);
                parts.push(Part { bone: bone_of[body], shape, color });
            }
        }
        let between = distances(&bones);
        Ok(Figure { bones, parts, between })
    }

    /// Number of joints on the way from one bone to another. Rigidly attached bones have none between them.
    pub fn between(&self, a: usize, b: usize) -> usize {
        self.between[a * self.bones.len() + b]
    }

    /// The bones from this one to the root, itself included.
    pub fn up(&self, bone: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(bone), |at| self.bones[*at].parent)
    }

    /// Whether one of two bones is above the other or both are the same.
    pub fn in_line(&self, a: usize, b: usize) -> bool {
        self.up(a).any(|at| at == b) || self.up(b).any(|at| at == a)
    }

    /// The lowest bone that is above or equal to both.
    pub fn fork(&self, a: usize, b: usize) -> usize {
        self.up(a).find(|at| self.up(b).any(|other| other == *at)).unwrap_or(0)
    }

    /// The same character with parts of at least this radius, m.
    pub fn thickened(&self, least: f64) -> Self {
        let parts = self.parts.iter().map(|part| Part { shape: part.shape.clone().thickened(least), ..part.clone() });
        Figure { parts: parts.collect(), ..self.clone() }
    }
}

fn suitable(geom: &Geom) -> bool {
    !matches!(geom.kind, GeomType::Plane | GeomType::Hfield | GeomType::Mesh) && geom.rgba[3] > 0.0
}

/// The geoms of a body that become skin: those that a viewer shows, or all if it shows only meshes or nothing.
fn shown(geoms: &[Geom]) -> impl Iterator<Item = &Geom> {
    let listed = |geom: &&Geom| suitable(geom) && geom.group < FIRST_HIDDEN_GROUP;
    let any = geoms.iter().any(|geom| listed(&geom));
    geoms.iter().filter(move |geom| if any { listed(geom) } else { suitable(geom) })
}

/// The geoms of a model without suitable ones, in words.
fn found(model: &Model) -> String {
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    for geom in &model.geoms {
        let place = if geom.body == 0 { " of the world" } else { "" };
        let clear = if geom.rgba[3] > 0.0 { "" } else { "transparent " };
        *kinds.entry(format!("{clear}{:?}{place}", geom.kind).to_lowercase()).or_default() += 1;
    }
    let words: Vec<String> = kinds.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    if words.is_empty() { "no geom at all".into() } else { words.join(", ") }
}

/// World poses of all bodies in the reference pose. Joints are at rest there, so they do not count.
fn places(model: &Model) -> Vec<(DVec3, DQuat)> {
    let mut places = vec![(DVec3::ZERO, DQuat::IDENTITY)];
    for body in model.bodies.iter().skip(1) {
        let (pos, turn): (DVec3, DQuat) = places[body.parent];
        places.push((pos + turn * DVec3::from_array(body.pos), (turn * quat(body.quat)).normalize()));
    }
    places
}

fn bone(model: &Model, body: usize, bone_of: &BTreeMap<usize, usize>, places: &[(DVec3, DQuat)]) -> Bone {
    let here = &model.bodies[body];
    let joints = &model.joints[here.joint_start..][..here.joint_count];
    let (pos, turn) = places[body];
    let local = joints.first().filter(|joint| joint.kind != JointType::Free).map_or([0.0; 3], |joint| joint.pos);
    Bone {
        name: if here.name.is_empty() { format!("body{body}") } else { here.name.clone() },
        parent: bone_of.get(&here.parent).copied(),
        anchor: pos + turn * DVec3::from_array(local),
        turns: joints.iter().any(|joint| matches!(joint.kind, JointType::Hinge | JointType::Ball)),
        moves: !joints.is_empty(),
        children: model.bodies.iter().filter(|other| other.parent == body).count(),
    }
}

fn shape(geom: &Geom, center: DVec3, turn: DQuat) -> Option<Shape> {
    let [x, y, z] = geom.size;
    Some(match geom.kind {
        GeomType::Sphere => Shape::ball(center, x),
        GeomType::Capsule => {
            let way = turn * DVec3::new(0.0, 0.0, y);
            Shape::Rod { ends: [center - way, center + way], radii: [x; 2] }
        }
        GeomType::Box => {
            let half = DVec3::new(x, y, z);
            Shape::Box { center, turn, half, round: ROUND * half.min_element() }
        }
        GeomType::Cylinder => Shape::Cylinder { center, turn, radius: x, half: y, round: ROUND * x.min(y) },
        GeomType::Ellipsoid => Shape::Ellipsoid { center, turn, semi: DVec3::new(x, y, z) },
        GeomType::Plane | GeomType::Hfield | GeomType::Mesh => return None,
    })
}

/// MuJoCo stores `[w, x, y, z]`.
fn quat(q: [f64; 4]) -> DQuat {
    DQuat::from_xyzw(q[1], q[2], q[3], q[0])
}

/// Joints between each pair of bones.
fn distances(bones: &[Bone]) -> Vec<usize> {
    let n = bones.len();
    let mut between = vec![0; n * n];
    // a parent comes before its children
    for a in 0..n {
        for b in 0..a {
            let step = usize::from(bones[a].moves);
            let steps = bones[a].parent.map_or(0, |parent| between[parent * n + b]) + step;
            between[a * n + b] = steps;
            between[b * n + a] = steps;
        }
    }
    between
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(body: &str) -> Model {
        let text = format!("<mujoco model='m'><worldbody><geom type='plane' size='1 1 1'/>{body}</worldbody></mujoco>");
        Model::from_xml_str(&text, "m.xml").expect("a model")
    }

    #[test]
    fn rigid_bodies_are_no_joint_apart() {
        let model = model(
            "<body name='a'><freejoint/><geom size='.1'/><body name='b' pos='1 0 0'><geom size='.1'/><body name='c' pos='1 0 0'>\
             <joint pos='-.5 0 0'/><geom size='.1'/></body></body><body name='d'><joint/><geom size='.1'/></body></body>",
        );
        let figure = Figure::new(&model).expect("a figure");
        let names: Vec<&str> = figure.bones.iter().map(|bone| bone.name.as_str()).collect();
        assert_eq!(names, ["a", "b", "c", "d"]);
        assert_eq!([(0, 1), (1, 2), (0, 2), (2, 3), (3, 3)].map(|(a, b)| figure.between(a, b)), [0, 1, 1, 2, 0]);
        assert_eq!(figure.bones[2].anchor, DVec3::new(1.5, 0.0, 0.0));
        assert_eq!((figure.fork(2, 3), figure.in_line(2, 0), figure.in_line(2, 3)), (0, true, false));
    }

    #[test]
    fn geoms_that_a_viewer_shows_come_first() {
        let both = "<geom size='.1' group='1'/><geom size='.2' group='3'/>";
        let hidden = "<geom size='.3' group='3'/>";
        let model = model(&format!("<body><joint/>{both}<body>{hidden}<geom size='.4' rgba='1 0 0 0'/></body></body>"));
        let figure = Figure::new(&model).expect("a figure");
        let radii: Vec<f64> = figure.parts.iter().map(|part| part.shape.bounds().1).collect();
        assert_eq!(radii, [0.1, 0.3]);
    }

    #[test]
    fn a_model_without_suitable_geoms_is_refused_by_name() {
        let model = model("<body name='a'><joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>");
        let error = Figure::new(&model).expect_err("no geoms").to_string();
        assert!(error.contains("model 'm'") && error.contains("found 1 plane of the world"), "{error}");
    }
}
