//! Feet of skins that stand still on screen while they carry weight.
//!
//! Feet of a simulated character slide a little. The legs of its skin are bent so that a foot in contact keeps its place on the
//! screen, and its error fades in the swing. Only the skin changes: the physics does not know.
//! After Daniel Holden, <https://theorangeduck.com/page/code-vs-data-driven-displacement>.

use crate::ragdoll::{Anatomy, Episode};
use bevy::math::{DQuat, DVec2, DVec3};
use bevy::prelude::*;
use marathon_motion::{Keyframe, SkeletonPoser};
use marathon_physics::Model;
use marathon_physics::model::{Geom, GeomType, JointType};
use std::f64::consts::{LN_2, PI};

/// Half-life of the error of a foot in the swing, s.
const RELEASE: f64 = 0.1;
/// Seconds without contact until a foot lets go, if it has risen by this height since, m: a standing foot loses contact for some
/// decisions without rising.
const HOLD: f64 = 0.03;
const RISEN: f64 = 0.008;
/// Error beyond which a foot lets go, m.
const REACH: f64 = 0.2;
/// Speed from which on a foot truly slides, m/s.
const SLIDE: f64 = 0.8;
/// Bend of the knee that is left at full stretch, as length of the leg, m.
const BENT: f64 = 0.005;
/// Largest way down of the skin for a foot that is out of reach, m, and its half-life, s.
const SINK: [f64; 2] = [0.03, 0.15];
/// Largest change of the knee's angle by the lock, rad/s: 2.5 degrees in a frame of 1/60 s.
const KNEE_RATE: f64 = 2.6;
/// Distance that a foot moves in one frame from which on the lock starts again, m.
const CUT: f64 = 0.5;
/// Longest frame with locked feet, s: in fast motion they would lag behind.
const LONGEST: f64 = 0.1;
/// Cosine of the tilt of the root up to which feet are locked: not in flips, on the ground or on the way up.
const UPRIGHT: f64 = 0.75;
/// Height by which another point of a sole must be lower to become the one that stands, m.
const LOWER: f64 = 0.004;
/// Sine of the knee's bend below which its axis is that of an earlier frame.
const STRAIGHT: f64 = 0.05;

/// Whether the feet of a [`Skin`](crate::look::Skin) stand still on screen while they carry weight. The physics does not change.
///
/// It works for legs of a thigh, a shin and a foot that each have a joint; other characters keep their pose.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct FootLock {
    /// Whether it is on. Off by default: knees still jump by up to 5 degrees in a frame, and walking feet still slide.
    pub on: bool,
}

/// Position, m, and orientation, `[w, x, y, z]`, of a body in MuJoCo's axes.
type BodyPose = ([f64; 3], [f64; 4]);

/// State of a ragdoll in a frame.
pub(crate) struct Stance<'a> {
    pub bodies: &'a [BodyPose],
    pub episode: Option<&'a Episode>,
    /// Simulated seconds since the last frame.
    pub dt: f64,
}

/// The legs of a skin.
#[derive(Debug, Default)]
pub(crate) struct Legs {
    legs: Vec<Leg>,
    root: usize,
    episode: u64,
    /// How far the skin is below the bodies, m.
    sunk: f64,
}

/// A leg of two bones and a foot.
#[derive(Debug)]
struct Leg {
    /// Bones of thigh, shin and foot.
    bones: [usize; 3],
    /// Body of the foot.
    foot: usize,
    /// Points of the sole in its frame, m.
    sole: Vec<DVec3>,
    /// Bits of [`Episode::feet`].
    bits: u32,
    state: State,
}

#[derive(Debug, Default)]
struct State {
    /// The point of the sole that stands, and where, level, m.
    lock: Option<(usize, DVec2)>,
    /// Level difference between the foot on the screen and that of the physics, m, and its rate, m/s.
    offset: DVec2,
    rate: DVec2,
    /// The ankle of the last frame, and its points, m. None at first.
    last: Option<(DVec3, Vec<DVec3>)>,
    /// Seconds without contact.
    off: f64,
    /// Height of the lowest point of the sole at the last contact, m.
    floor: f64,
    /// Angle by which the lock opens the knee, rad.
    opened: f64,
    /// Axis of the knee in the frame of the shin's bone.
    axis: Option<DVec3>,
}

/// Bones in the world: positions and orientations.
struct Bones {
    places: Vec<DVec3>,
    turns: Vec<DQuat>,
}

impl Legs {
    /// The legs that a skin has in common with the model of its ragdoll.
    pub fn of(anatomy: &Anatomy, poser: &SkeletonPoser) -> Self {
        let model = &*anatomy.model;
        let bodies = |geom: &str| model.geoms.iter().find(|known| known.name == geom).map(|geom| geom.body);
        let mut legs: Vec<Leg> = Vec::new();
        for (bit, foot) in anatomy.feet.iter().enumerate().take(u32::BITS as usize) {
            let Some(foot) = bodies(foot) else { continue };
            match legs.iter_mut().find(|leg| leg.foot == foot) {
                Some(leg) => leg.bits |= 1 << bit,
                None => legs.extend(Leg::of(model, poser, foot, 1 << bit)),
            }
        }
        Legs { legs, root: model.joints.first().map_or(1, |joint| joint.body), episode: 0, sunk: 0.0 }
    }

    /// Bends the legs of a pose so that feet in contact stay where they are on the screen.
    pub fn stand(&mut self, poser: &SkeletonPoser, frame: &mut Keyframe, stance: &Stance) {
        let Some((_, root)) = stance.bodies.get(self.root) else { return };
        let number = stance.episode.map_or(0, |episode| episode.number);
        if number != self.episode || stance.dt > LONGEST {
            self.episode = number;
            self.legs.iter_mut().for_each(|leg| leg.state = State::default());
        }
        let upright = (quat(root) * DVec3::Z).z > UPRIGHT;
        let powered = stance.episode.is_some_and(|episode| !episode.down);
        let feet = stance.episode.map_or(0, |episode| episode.feet);
        let bones = Bones::of(poser, frame);
        let mut lacks = 0.0_f64;
        for leg in &mut self.legs {
            let contact = upright && powered && feet & leg.bits != 0;
            lacks = lacks.max(leg.follow(&bones, stance, contact));
        }
        let [most, half_life] = SINK;
        self.sunk += (lacks.min(most) - self.sunk) * (1.0 - (-LN_2 * stance.dt / half_life).exp());
        frame.root[2] -= self.sunk;
        for leg in &mut self.legs {
            leg.bend(&bones, frame, poser, self.sunk, stance.dt);
        }
    }
}

impl Leg {
    /// The leg above a foot, if the model has one and the skin follows it.
    fn of(model: &Model, poser: &SkeletonPoser, foot: usize, bits: u32) -> Option<Self> {
        let shin = model.bodies[foot].parent;
        let thigh = model.bodies[shin].parent;
        let turns = |body: usize| {
            model
                .joints
                .iter()
                .any(|joint| joint.body == body && matches!(joint.kind, JointType::Hinge | JointType::Ball))
        };
        // a thigh hangs from a trunk, not from the world
        let chain = [thigh, shin, foot];
        if chain.contains(&0) || model.bodies[thigh].parent == 0 || !chain.iter().all(|body| turns(*body)) {
            return None;
        }
        let skeleton = poser.skeleton();
        let bone_of = |body: usize| (0..skeleton.bones.len()).find(|bone| poser.body_of(*bone) == Some(body));
        let bones = [bone_of(thigh)?, bone_of(shin)?, bone_of(foot)?];
        let above = |low: usize, high: usize| {
            std::iter::successors(skeleton.bones[low].parent, |bone| skeleton.bones[*bone].parent)
                .any(|bone| bone == high)
        };
        if !above(bones[1], bones[0]) || !above(bones[2], bones[1]) {
            return None;
        }
        let sole: Vec<DVec3> = model.geoms.iter().filter(|geom| geom.body == foot).flat_map(ends).collect();
        (!sole.is_empty()).then(|| Leg { bones, foot, sole, bits, state: State::default() })
    }

    /// Takes in a frame. `contact`: the foot carries weight, and may be locked. Returns what the leg lacks to reach it, m.
    fn follow(&mut self, bones: &Bones, stance: &Stance, contact: bool) -> f64 {
        let Some((_, turn)) = stance.bodies.get(self.foot) else { return 0.0 };
        let [hip, knee, ankle] = self.bones.map(|bone| bones.places[bone]);
        let points: Vec<DVec3> = self.sole.iter().map(|point| ankle + quat(turn) * *point).collect();
        if stance.dt > 0.0 {
            self.state.follow(ankle, points, stance.dt, contact);
        }
        if self.state.lock.is_none() {
            return 0.0;
        }
        let most = (hip.distance(knee) + knee.distance(ankle) - 2.0 * BENT).max(hip.distance(ankle));
        ((ankle + self.state.offset.extend(0.0) - hip).length() - most).max(0.0)
    }

    /// Bends the leg of a skin that has sunk, so that its foot is where it is to be.
    fn bend(&mut self, bones: &Bones, frame: &mut Keyframe, poser: &SkeletonPoser, sunk: f64, dt: f64) {
        let offset = self.state.offset.extend(0.0);
        if offset.length() < 1e-5 && self.state.opened.abs() < 1e-5 && sunk < 1e-5 {
            return;
        }
        let Some(bend) = Bend::of(bones, self.bones, sunk, &mut self.state.axis) else { return };
        let length = bend.reach(offset, &mut self.state.opened, dt);
        let share = bend.share(offset, length);
        let to = match share {
            Some(share) => bend.foot + share * offset,
            // the knee follows more slowly than the foot
            None => (bend.foot + offset).normalize_or_zero() * length,
        };
        if let Some(share) = share.filter(|share| *share < 1.0) {
            self.state.slip(share);
        }
        bend.apply(bones, self.bones, poser, frame, to, length);
    }
}

impl State {
    /// Takes in a frame: the foot is locked, follows its lock, or fades to where the physics has it.
    fn follow(&mut self, ankle: DVec3, points: Vec<DVec3>, dt: f64, contact: bool) {
        let Some((before, old)) = self.last.replace((ankle, points.clone())) else { return };
        if ankle.distance(before) > CUT {
            *self = State { last: self.last.take(), ..State::default() };
            return;
        }
        self.off = if contact { 0.0 } else { self.off + dt };
        let lowest = (0..points.len()).min_by(|a, b| points[*a].z.total_cmp(&points[*b].z)).unwrap_or(0);
        if contact {
            self.floor = points[lowest].z;
        }
        let stands = self.off < HOLD || (points[lowest].z - self.floor).abs() < RISEN;
        let velocity = |point: usize| (points[point] - old[point]).truncate() / dt;
        let slides = |point: usize| velocity(point).length() > SLIDE;
        if let Some((point, place)) = self.lock {
            let error = place - points[point].truncate();
            let holds = stands && error.length() < REACH && !slides(point);
            if holds {
                (self.offset, self.rate) = (error, -velocity(point));
                // the foot rolls on: another point stands where it is on the screen
                if points[lowest].z < points[point].z - LOWER {
                    self.lock = Some((lowest, points[lowest].truncate() + error));
                }
                return;
            }
            self.lock = None;
        }
        self.fade(dt);
        if contact && !slides(lowest) {
            self.lock = Some((lowest, points[lowest].truncate() + self.offset));
        }
    }

    /// The error of a free foot in a frame, a critically damped spring.
    fn fade(&mut self, dt: f64) {
        let y = 2.0 * LN_2 / RELEASE;
        let j = self.rate + self.offset * y;
        let rest = (-y * dt).exp();
        self.offset = rest * (self.offset + j * dt);
        self.rate = rest * (self.rate - j * (y * dt));
    }

    /// A leg that cannot reach its foot takes it along: a share of the error is left.
    fn slip(&mut self, share: f64) {
        if let Some((_, place)) = &mut self.lock {
            *place -= (1.0 - share) * self.offset;
        }
        self.offset *= share;
    }
}

/// The triangle of a leg in the pose of the physics.
struct Bend {
    /// From the hip to the knee, from the knee to the ankle, and from the hip to the ankle.
    thigh: DVec3,
    shin: DVec3,
    leg: DVec3,
    /// From the hip of a skin that has sunk to the ankle, m.
    foot: DVec3,
    /// A turn of the shin about it bends the knee.
    axis: DVec3,
}

impl Bend {
    /// The triangle of three bones. None for a leg that has been straight in all frames.
    fn of(bones: &Bones, [thigh, shin, foot]: [usize; 3], sunk: f64, axis: &mut Option<DVec3>) -> Option<Self> {
        let [hip, knee, ankle] = [thigh, shin, foot].map(|bone| bones.places[bone]);
        let (upper, lower) = (knee - hip, ankle - knee);
        let cross = upper.cross(lower);
        if cross.length() > STRAIGHT * upper.length() * lower.length() {
            *axis = Some(bones.turns[shin].conjugate() * cross.normalize());
        }
        let axis = bones.turns[shin] * (*axis)?;
        let leg = ankle - hip;
        Some(Bend { thigh: upper, shin: lower, leg, foot: leg + sunk * DVec3::Z, axis })
    }

    /// Angle inside the knee at a length of the leg, rad: pi if it is straight.
    fn knee(&self, length: f64) -> f64 {
        let (a, b) = (self.thigh.length(), self.shin.length());
        ((a * a + b * b - length * length) / (2.0 * a * b)).clamp(-1.0, 1.0).acos()
    }

    /// Length of the leg at an angle inside the knee, m.
    fn length(&self, knee: f64) -> f64 {
        let (a, b) = (self.thigh.length(), self.shin.length());
        (a * a + b * b - 2.0 * a * b * knee.cos()).max(0.0).sqrt()
    }

    /// Length of the leg to a foot at this distance from its pose, m: softly limited towards full stretch, and in the knee's rate.
    /// `opened` is what the knee was opened by, rad.
    fn reach(&self, offset: DVec3, opened: &mut f64, dt: f64) -> f64 {
        let (pose, wanted) = (self.leg.length(), (self.foot + offset).length());
        let room = (self.thigh.length() + self.shin.length() - BENT - pose).max(0.0);
        let more = wanted - pose;
        let more = match more > 0.0 {
            true if room > 1e-6 => room * (1.0 - (-more / room).exp()),
            true => 0.0,
            false => more,
        };
        let own = self.knee(pose);
        let change = self.knee(pose + more) - own;
        let most = KNEE_RATE * dt;
        let knee = (own + *opened + (change - *opened).clamp(-most, most)).clamp(0.1, PI);
        *opened = knee - own;
        self.length(knee)
    }

    /// The share of a foot's offset at which the leg has a length, nearest to all of it. None if there is none from 0 to 1.
    fn share(&self, offset: DVec3, length: f64) -> Option<f64> {
        let (a, b) = (offset.length_squared(), self.foot.dot(offset));
        let c = self.foot.length_squared() - length * length;
        if (a + 2.0 * b + c).abs() < 1e-9 {
            return Some(1.0);
        }
        let root = (b * b - a * c).max(0.0).sqrt();
        let fits = |share: &f64| (0.0..=1.0).contains(share) && b * b >= a * c;
        [(-b + root) / a, (-b - root) / a].into_iter().filter(fits).max_by(f64::total_cmp)
    }

    /// Bends the knee to a length of the leg, and turns the thigh to where the foot is to be from the hip. The foot keeps its
    /// orientation.
    fn apply(
        &self,
        bones: &Bones,
        [thigh, shin, foot]: [usize; 3],
        poser: &SkeletonPoser,
        frame: &mut Keyframe,
        to: DVec3,
        length: f64,
    ) {
        let bend = DQuat::from_axis_angle(self.axis, self.knee(self.leg.length()) - self.knee(length));
        let bent = self.thigh + bend * self.shin;
        let (Some(from), Some(to)) = (bent.try_normalize(), to.try_normalize()) else { return };
        let swing = DQuat::from_rotation_arc(from, to);
        let above =
            |bone: usize| poser.skeleton().bones[bone].parent.map_or(DQuat::IDENTITY, |parent| bones.turns[parent]);
        let mut set = |bone: usize, turn: DQuat| {
            let turn = turn.normalize();
            frame.rotations[bone] = [turn.w, turn.x, turn.y, turn.z];
        };
        set(thigh, above(thigh).conjugate() * swing * bones.turns[thigh]);
        set(shin, above(shin).conjugate() * bend * bones.turns[shin]);
        set(foot, (swing * bend * above(foot)).conjugate() * bones.turns[foot]);
    }
}

impl Bones {
    /// The bones of a pose.
    fn of(poser: &SkeletonPoser, frame: &Keyframe) -> Self {
        let (mut places, mut turns) = (Vec::new(), Vec::new());
        for (bone, turn) in poser.skeleton().bones.iter().zip(&frame.rotations) {
            let (place, above) = match bone.parent {
                Some(parent) => (places[parent], turns[parent]),
                None => (DVec3::from_array(frame.root), DQuat::IDENTITY),
            };
            let offset = bone.parent.map_or(DVec3::ZERO, |_| poser.scale() * DVec3::from_array(bone.offset));
            places.push(place + above * offset);
            turns.push(above * quat(turn));
        }
        Bones { places, turns }
    }
}

/// Where a geom of a foot may touch the ground, but for its radius, in the frame of its body, m.
fn ends(geom: &Geom) -> Vec<DVec3> {
    let turn = quat(&geom.quat);
    let at = |x: f64, y: f64, z: f64| DVec3::from_array(geom.pos) + turn * DVec3::new(x, y, z);
    let [x, y, z] = geom.size;
    let corners = |x: f64, y: f64, z: f64| {
        let sides = [-1.0, 1.0];
        sides.into_iter().flat_map(move |a| sides.into_iter().map(move |b| (a * x, b * y, -z))).collect::<Vec<_>>()
    };
    match geom.kind {
        GeomType::Sphere => vec![at(0.0, 0.0, 0.0)],
        GeomType::Capsule => vec![at(0.0, 0.0, -y), at(0.0, 0.0, y)],
        GeomType::Cylinder => vec![at(0.0, 0.0, -y), at(0.0, 0.0, y)],
        GeomType::Box | GeomType::Ellipsoid => corners(x, y, z).into_iter().map(|(x, y, z)| at(x, y, z)).collect(),
        GeomType::Plane | GeomType::Hfield | GeomType::Mesh => Vec::new(),
    }
}

fn quat([w, x, y, z]: &[f64; 4]) -> DQuat {
    DQuat::from_xyzw(*x, *y, *z, *w).normalize()
}
