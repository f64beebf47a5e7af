//! How a robot stands: the pose, the ground under it, and the bodies that carry it.

use glam::{DQuat, DVec3};
use marathon_motion::kinematics::Pose;
use marathon_physics::model::{Geom, GeomType, JointType, Model};

/// The value of an option that follows from the model.
pub const AUTO: &str = "auto";
/// The value of `feet` for a robot that has none, such as one on wheels.
const NO_FEET: &str = "none";
/// Keyframes that hold a standing pose, by preference.
const POSES: [&str; 4] = ["spawn", "knees_bent", "home", "stand"];
/// The value of `pose` for the reference pose of a model with keyframes.
const REFERENCE: &str = "reference";
/// Gymnasium's number for the pose at the start.
const INIT_QPOS: &str = "init_qpos";
/// Part of a joint's range that the reference pose keeps from its ends.
const MARGIN: f64 = 0.05;
/// A limb reaches the ground if its end is at most this part of the root's height above it.
const REACH: f64 = 0.15;
/// Least cosine of the slope of a plane that is ground.
const LEVEL: f64 = 0.99;
/// Largest distance of a wheel's center from its axis, as a part of its radius.
const CENTERED: f64 = 0.1;
/// Directions in which a mesh has to reach equally far to be a wheel.
const DIRECTIONS: usize = 16;
/// Without legs the root or its neighbors lie on the ground, this close (part of the height, and meters).
const LYING: f64 = 0.02;

/// The coordinates of the root of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Root {
    /// A free joint.
    Free {
        /// First coordinate.
        qpos: usize,
        /// First velocity.
        dof: usize,
    },
    /// Two slides along x and z and a hinge about y.
    Planar {
        /// Coordinate of the slide along z.
        height: usize,
    },
}

/// A body that carries the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Foot {
    /// The body, with those that are welded to it.
    pub body: usize,
    /// Its geoms near the ground.
    pub geoms: Vec<usize>,
    /// Its lowest point in the standing pose, in the body's frame, m.
    pub sole: [f64; 3],
    /// The same in the world, m.
    pub place: [f64; 3],
    /// Whether it is to the right of the root, which faces +x.
    pub right: bool,
}

/// A number of things: `1 joint`, `2 joints`.
pub fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// The joints of the root and the body that they move, or why there are none.
pub fn root(model: &Model) -> Result<(usize, Root), String> {
    if let Some(joint) = model.joints.iter().find(|joint| joint.kind == JointType::Free) {
        return Ok((joint.body, Root::Free { qpos: joint.qpos_adr, dof: joint.dof_adr }));
    }
    let first = model.bodies.iter().position(|body| body.joint_count > 0);
    let Some(body) = first.filter(|body| model.bodies[model.bodies[*body].parent].weld_id == 0) else {
        return Err("nothing in it moves".into());
    };
    let own = &model.joints[model.bodies[body].joint_start..][..model.bodies[body].joint_count];
    let pose = Pose::of(model, &model.qpos0);
    let actuated = |joint: usize| model.actuators.iter().any(|a| a.joint() == Some(joint));
    let along = |kind: JointType, axis: DVec3| {
        let at = |joint: usize| model.joints[joint].kind == kind && pose.axes[joint].dot(axis).abs() > 0.99;
        (0..own.len()).map(|i| model.bodies[body].joint_start + i).find(|joint| at(*joint) && !actuated(*joint))
    };
    let slides = along(JointType::Slide, DVec3::X).zip(along(JointType::Slide, DVec3::Z));
    match slides.zip(along(JointType::Hinge, DVec3::Y)) {
        Some(((_, z), _)) => Ok((body, Root::Planar { height: model.joints[z].qpos_adr })),
        None => Err("its root is fixed: expected a free joint, or slides along x and z and a hinge about y".into()),
    }
}

/// The standing pose, where it comes from, and whether the model's author has chosen it. `name`: the keyframe, or `auto`.
pub fn pose(model: &Model, name: &str) -> Result<(Vec<f64>, String, bool), String> {
    let key = |name: &str| model.keyframes.iter().find(|key| key.name == name);
    let unknown = || {
        let known: Vec<&str> =
            model.keyframes.iter().map(|key| key.name.as_str()).filter(|name| !name.is_empty()).collect();
        let known = match known.as_slice() {
            [] => "; the model has no keyframes with names".to_owned(),
            known => format!(" or a keyframe of the model: {}", known.join(", ")),
        };
        format!("pose is '{name}', expected auto, reference{known}")
    };
    let chosen = match name {
        AUTO => POSES.iter().find_map(|name| key(name)).or(model.keyframes.first()),
        REFERENCE => None,
        name => Some(key(name).ok_or_else(unknown)?),
    };
    if let Some(found) = chosen {
        return Ok((found.qpos.clone(), format!("keyframe '{}'", found.name), true));
    }
    let given = model.numerics.iter().find(|(name, qpos)| name == INIT_QPOS && qpos.len() == model.nq);
    if let Some((_, qpos)) = given.filter(|_| name == AUTO) {
        return Ok((qpos.clone(), format!("the model's {INIT_QPOS}"), true));
    }
    let mut qpos = model.qpos0.clone();
    let mut moved = 0;
    for joint in model.joints.iter().filter(|joint| joint.limited && joint.kind.dofs() == 1) {
        let [low, high] = joint.range;
        let margin = MARGIN * (high - low);
        let inside = qpos[joint.qpos_adr].max(low + margin).min(high - margin);
        moved += usize::from(inside != qpos[joint.qpos_adr]);
        qpos[joint.qpos_adr] = inside;
    }
    let moved = if moved > 0 {
        format!(
            ", {} moved into {} range{}",
            counted(moved, "joint"),
            if moved == 1 { "its" } else { "their" },
            if moved == 1 { "" } else { "s" }
        )
    } else {
        String::new()
    };
    Ok((qpos, format!("the reference pose{moved}"), false))
}

/// Whether a geom can touch the ground: by its own masks, or in a pair of the file.
pub fn collides(model: &Model, geom: usize) -> bool {
    let own = &model.geoms[geom];
    let paired = || model.pairs.iter().any(|pair| pair.geoms.contains(&geom));
    own.contype != 0 || own.conaffinity != 0 || paired()
}

/// The orientation of a geom in the world.
fn turn(pose: &Pose, geom: &Geom) -> DQuat {
    let [w, x, y, z] = geom.quat;
    pose.quat[geom.body] * DQuat::from_xyzw(x, y, z, w)
}

/// The lowest point of a geom, m.
fn lowest(model: &Model, pose: &Pose, geom: &Geom) -> DVec3 {
    let turn = turn(pose, geom);
    let center = pose.point(geom.body, DVec3::from_array(geom.pos));
    // downward, in the geom's own axes
    let down = turn.inverse() * DVec3::NEG_Z;
    let [a, b, _] = geom.size;
    let size = DVec3::from_array(geom.size);
    let local = match geom.kind {
        GeomType::Sphere => a * down,
        GeomType::Capsule => a * down + DVec3::Z * b * sign(down.z),
        GeomType::Ellipsoid => {
            let scaled = size * down;
            size * scaled / scaled.length().max(f64::MIN_POSITIVE)
        }
        GeomType::Cylinder => {
            let side = DVec3::new(down.x, down.y, 0.0);
            let radial = if side.length() > 1e-9 { a * side / side.length() } else { DVec3::ZERO };
            radial + DVec3::Z * b * sign(down.z)
        }
        GeomType::Mesh if geom.hull.is_some() => {
            let corners = geom.hull.map_or(&[][..], |hull| &model.hulls[hull].vertices);
            let far = |v: &[f64; 3]| DVec3::from_array(*v).dot(down);
            corners.iter().max_by(|a, b| far(a).total_cmp(&far(b))).map_or(DVec3::ZERO, |v| DVec3::from_array(*v))
        }
        GeomType::Box | GeomType::Mesh | GeomType::Plane | GeomType::Hfield => {
            size * DVec3::new(sign(down.x), sign(down.y), sign(down.z))
        }
    };
    center + turn * local
}

/// 1, -1, or 0 near 0.
fn sign(x: f64) -> f64 {
    if x.abs() < 1e-9 { 0.0 } else { x.signum() }
}

/// Moving bodies with what is welded to them.
fn geoms_of(model: &Model, body: usize) -> impl Iterator<Item = usize> {
    (0..model.geoms.len()).filter(move |g| model.bodies[model.geoms[*g].body].weld_id == body && collides(model, *g))
}

/// Whether a body is a wheel: it turns without end about the axis of round geoms.
pub fn is_wheel(model: &Model, pose: &Pose, body: usize) -> bool {
    let own = &model.bodies[body];
    let joint = own.joint_start;
    if own.joint_count != 1 || model.joints[joint].kind != JointType::Hinge || model.joints[joint].limited {
        return false;
    }
    let axis = pose.axes[joint];
    let rolls = |g: usize| {
        let geom = &model.geoms[g];
        let off = pose.point(geom.body, DVec3::from_array(geom.pos)) - pose.anchors[joint];
        let centered = off.cross(axis).length() < CENTERED * geom.size[0];
        match geom.kind {
            GeomType::Sphere | GeomType::Ellipsoid => centered,
            GeomType::Cylinder => centered && (turn(pose, geom) * DVec3::Z).dot(axis).abs() > LEVEL,
            GeomType::Mesh => geom.hull.is_some_and(|hull| {
                let turn = turn(pose, geom);
                is_round(model.hulls[hull].vertices.iter().map(|v| off + turn * DVec3::from_array(*v)), axis)
            }),
            _ => false,
        }
    };
    let mut geoms = geoms_of(model, body).peekable();
    geoms.peek().is_some() && geoms.all(rolls)
}

/// Whether points, given from a place on an axis, reach equally far from it in all directions across.
fn is_round(points: impl Iterator<Item = DVec3>, axis: DVec3) -> bool {
    let (u, v) = axis.any_orthonormal_pair();
    let mut reach = [0.0f64; DIRECTIONS];
    for point in points {
        for (i, reach) in reach.iter_mut().enumerate() {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * i as f64 / DIRECTIONS as f64);
            *reach = reach.max(point.dot(u) * cos + point.dot(v) * sin);
        }
    }
    let (least, most) = reach.iter().fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(*x), b.max(*x)));
    least > (1.0 - CENTERED) * most
}

/// How a robot stands.
#[derive(Clone, Debug)]
pub struct Stance {
    /// Configuration, with the lowest point on the ground.
    pub qpos: Vec<f64>,
    /// Height of the root's body above the ground, m.
    pub height: f64,
    /// The feet from front to back, the left one first.
    pub feet: Vec<Foot>,
}

/// Puts the robot on the ground and finds its feet. `names`: bodies, or `auto`.
pub fn stand(model: &Model, root: (usize, Root), mut qpos: Vec<f64>, names: &str) -> Result<Stance, String> {
    let (body, joints) = root;
    let of_robot = |body: usize| model.bodies[body].root_id == model.bodies[root.0].root_id;
    let mut pose = Pose::of(model, &qpos);
    let bottom = |pose: &Pose, g: usize| lowest(model, pose, &model.geoms[g]);
    let own: Vec<usize> =
        (0..model.geoms.len()).filter(|g| of_robot(model.geoms[*g].body) && collides(model, *g)).collect();
    let Some(low) = own.iter().map(|g| bottom(&pose, *g).z).min_by(f64::total_cmp) else {
        return Err("none of its geoms can touch the ground".into());
    };
    let ground = ground_height(model);
    match joints {
        Root::Free { qpos: first, .. } => qpos[first + 2] -= low - ground,
        Root::Planar { height } => qpos[height] -= low - ground,
    }
    pose = Pose::of(model, &qpos);
    let height = pose.pos[body].z - ground;
    if !(height > 1e-3) {
        return Err(format!("its root is {height:.3} m above the ground in the standing pose, expected more than 0"));
    }

    let moving = |b: usize| model.bodies[b].weld_id == b && model.bodies[b].dof_count > 0;
    // the moving body that carries another one
    let carrier = |b: usize| model.bodies[model.bodies[b].parent].weld_id;
    let mut carries = vec![false; model.bodies.len()];
    (1..model.bodies.len()).filter(|b| moving(*b)).for_each(|b| carries[carrier(b)] = true);
    let sole = |b: usize| geoms_of(model, b).map(|g| bottom(&pose, g)).min_by(|a, b| a.z.total_cmp(&b.z));
    let ends: Vec<usize> = match names {
        AUTO => (1..model.bodies.len())
            .filter(|b| moving(*b) && of_robot(*b) && *b != body && !carries[*b] && !is_wheel(model, &pose, *b))
            .filter(|b| sole(*b).is_some_and(|p| p.z - ground <= REACH * height))
            .collect(),
        NO_FEET => Vec::new(),
        names => names.split(',').map(|name| named_foot(model, name.trim())).collect::<Result<_, _>>()?,
    };
    if let Some((_, twice)) = ends.iter().enumerate().find(|(i, b)| ends[..*i].contains(b)) {
        return Err(format!("feet has '{}' twice", model.bodies[*twice].name));
    }
    let mut feet = Vec::new();
    for b in ends {
        let Some(point) = sole(b) else {
            return Err(format!("feet has '{}', which has no geom that can touch the ground", model.bodies[b].name));
        };
        let near = |g: &usize| bottom(&pose, *g).z - point.z <= 0.1 * height;
        let local = pose.quat[b].inverse() * (point - pose.pos[b]);
        feet.push(Foot {
            body: b,
            geoms: geoms_of(model, b).filter(near).collect(),
            sole: local.to_array(),
            place: point.to_array(),
            right: point.y < pose.pos[body].y,
        });
    }
    // with the trunk on the ground, limbs do not carry it
    let lies = geoms_of(model, body).any(|g| bottom(&pose, g).z - ground <= (LYING * height).max(5e-3));
    if lies && names == AUTO {
        feet.clear();
    }
    let ahead = pose.pos[body].x;
    feet.sort_by(|a, b| {
        let order = |foot: &Foot| (((foot.place[0] - ahead) / (0.2 * height)).round(), foot.place[1]);
        let ((ax, ay), (bx, by)) = (order(a), order(b));
        bx.total_cmp(&ax).then(by.total_cmp(&ay))
    });
    Ok(Stance { qpos, height, feet })
}

fn named_foot(model: &Model, name: &str) -> Result<usize, String> {
    let found = model.bodies.iter().position(|body| body.name == name && body.weld_id != 0);
    found.map(|b| model.bodies[b].weld_id).ok_or_else(|| {
        if let Some(geom) = model.geoms.iter().find(|geom| geom.name == name) {
            return format!(
                "feet has '{name}', a geom of the body '{}'; expected bodies",
                model.bodies[geom.body].name
            );
        }
        let near = marathon_physics::hint::nearest(name, model.bodies.iter().skip(1).map(|b| b.name.as_str()));
        let hint = near.map_or(String::new(), |near| format!("; did you mean '{near}'?"));
        format!("feet has '{name}', expected none or bodies of the model that move{hint}")
    })
}

/// Height of the highest level plane of the world, m; 0 without one.
pub fn ground_height(model: &Model) -> f64 {
    let pose = Pose::of(model, &model.qpos0);
    let planes = model.geoms.iter().filter(|geom| is_floor(model, &pose, geom));
    planes.map(|g| pose.point(g.body, DVec3::from_array(g.pos)).z).max_by(f64::total_cmp).unwrap_or(0.0)
}

/// Whether the world has ground: a level plane or a height field.
pub fn has_ground(model: &Model) -> bool {
    let pose = Pose::of(model, &model.qpos0);
    let is_field = |geom: &Geom| geom.kind == GeomType::Hfield && model.bodies[geom.body].weld_id == 0;
    model.geoms.iter().any(|geom| is_field(geom) || is_floor(model, &pose, geom))
}

/// Whether a geom is a level plane of the world. Walls are planes, too.
fn is_floor(model: &Model, pose: &Pose, geom: &Geom) -> bool {
    geom.kind == GeomType::Plane && model.bodies[geom.body].weld_id == 0 && (turn(pose, geom) * DVec3::Z).z > LEVEL
}

/// When each foot steps: the part of the clock's turn by which it is late. Feet that follow each other alternate, and so do the
/// two sides: a walk on two feet, a trot on four, a tripod on six.
pub fn phases(feet: &[Foot]) -> Vec<f64> {
    let mut order = [0usize; 2];
    feet.iter()
        .map(|foot| {
            let side = usize::from(foot.right);
            let rank = order[side];
            order[side] += 1;
            0.5 * ((rank + side) % 2) as f64
        })
        .collect()
}
