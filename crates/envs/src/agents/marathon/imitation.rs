//! Shared code of all characters that imitate a clip: start states, DeepMimic's reward, and the distance from the clip.
//!
//! The reward is `0.5 pose + 0.05 velocity + 0.15 end_effectors + 0.2 root + 0.1 center_of_mass`. Each term is
//! `exp(-scale error)` with the scales 2, 0.1, 10, 5 and 10 (DeepMimicCore/scenes/SceneImitate.cpp). The errors are:
//!
//! - `pose`, `velocity`: weighted sum of squared joint angles and of squared joint velocities, with DeepMimic's
//!   weights.
//! - `end_effectors`: mean squared distance of feet and hands, relative to the root.
//! - `root`: squared distance + 0.1 squared angle + 0.01 squared velocity + 0.001 squared angular velocity.
//! - `center_of_mass`: 0.1 squared velocity.
//!
//! A ball joint of DeepMimic is two or three hinges here. For small angles, their squares add up to the square of its
//! angle. The mean over the end effectors is DeepMimic's.

use marathon_physics::lanes::Real;

use crate::agent::options::Choice;
use crate::agent::{Following, Frame, Obs, Part, Senses, Start, Terms};

/// Memory size of a character that follows a clip.
pub(super) const MEMORY: usize = START_ROW + 1;
/// Slot of the memory that counts the episode's decisions.
const DECISIONS: usize = Following::SLOTS;
/// Slot of the memory that holds the clip row in which the episode started.
const START_ROW: usize = DECISIONS + 1;
/// Largest height of the center of a trunk part that lies on the ground in a clip, m.
const LYING: f64 = 0.16;
/// A failure before this time is attributed to the start of the episode, s.
pub(super) const EARLY: f64 = 2.0;
/// After a later failure, an episode starts up to this long before it, s.
const BEFORE: f64 = 1.0;

/// Terms of DeepMimic's reward: name, weight, scale, and whether the term covers the pose only (not position and
/// speed).
pub(super) const TERMS: [(&str, f64, f64, bool); 5] = [
    ("pose", 0.5, 2.0, true),
    ("velocity", 0.05, 0.1, false),
    ("end_effectors", 0.15, 10.0, true),
    ("root", 0.2, 5.0, false),
    ("center_of_mass", 0.1, 10.0, false),
];

/// The data that the reward needs about a character.
pub(super) struct Anatomy {
    /// The root part, to which others are relative.
    pub root: Part,
    /// Number of parts. They are the first ones in the facts.
    pub parts: usize,
    /// Feet and hands.
    pub ends: &'static [Part],
    /// DeepMimic's weight of each hinge, in the order of `qpos` after the root's joints.
    pub weights: &'static [f64],
    /// Sum of DeepMimic's weights of root and joints. A joint counts once, however many hinges it has.
    pub total: f64,
    /// Index of the first hinge in `qpos`.
    pub qpos: usize,
    /// Index of the first hinge in `qvel`.
    pub qvel: usize,
}

/// Start of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartAt {
    /// A random decision of the clip.
    Random,
    /// The beginning of the clip.
    First,
    /// More often where episodes fail. Half of the episodes after a failure start where the failed one did, if it
    /// failed early, or in the second before it failed. A quarter of the others start at the clip's beginning, where a
    /// deployed policy starts. The rest are random.
    Adaptive,
}

impl Choice for StartAt {
    const EXPECTED: &'static str = "random, first or adaptive";
    const NAMED: &'static [(Self, &'static str)] =
        &[(StartAt::Random, "random"), (StartAt::First, "first"), (StartAt::Adaptive, "adaptive")];
}

impl StartAt {
    /// Puts the character into its clip, or into one of several clips. `dt` is the time between decisions, s. `limit`
    /// is the number of decisions after which an episode is truncated.
    pub(super) fn begin(self, start: &mut Start, dt: f64, limit: usize) {
        let again = (self == StartAt::Adaptive).then(|| try_again(start, dt, limit)).flatten();
        let row = again.unwrap_or_else(|| {
            let clips: Vec<_> = start.clips().collect();
            let clip = if clips.len() == 1 { 0 } else { start.random.whole(0, clips.len() - 1) };
            let rows = clips[clip].clone();
            match self {
                StartAt::First => rows.start,
                StartAt::Adaptive if start.random.whole(0, 3) == 0 => rows.start,
                _ => start.random.whole(rows.start, rows.end - 1),
            }
        });
        start.start_in_clip(row);
        start.memory[START_ROW] = row as f64;
    }
}

/// The row to start from in half of the episodes after a failure.
fn try_again(start: &mut Start, dt: f64, limit: usize) -> Option<usize> {
    let [row, made, begun] = [Following::ROW, DECISIONS, START_ROW].map(|slot| start.previous[slot] as usize);
    let at_its_end = start.clips().any(|rows| row + 1 == rows.end);
    let failed = made > 0 && made < limit && !at_its_end;
    if !failed || start.random.whole(0, 1) == 0 {
        return None;
    }
    // a run cycle is shorter than a second, so an earlier row of the clip need not have led to the failure
    match (made as f64) * dt < EARLY {
        true => Some(begun),
        false => {
            let before = start.random.whole(0, (BEFORE / dt).round() as usize);
            Some(start.row_before(row, before))
        }
    }
}

/// Updates the memory after a decision.
#[inline(always)]
pub(super) fn remember<T: Real>(s: &Senses<T>, memory: &mut [T]) {
    s.follow(memory);
    memory[DECISIONS] += T::lit(1.0);
}

/// Adds the terms of DeepMimic's reward. `sharpness` multiplies the scales of the pose terms; it is 1 in DeepMimic.
#[inline(always)]
pub(super) fn add_terms<T: Real>(s: &Senses<T>, anatomy: &Anatomy, sharpness: f64, terms: &mut Terms<T>) {
    for ((name, weight, ..), value) in TERMS.into_iter().zip(values(s, anatomy, sharpness)) {
        terms.add(name, weight, value);
    }
}

/// The weighted sum of all terms, and that of the pose terms.
#[inline(always)]
pub(super) fn similarity<T: Real>(s: &Senses<T>, anatomy: &Anatomy) -> [T; 2] {
    let [mut all, mut posture] = [T::zero(); 2];
    for ((_, weight, _, of_pose), value) in TERMS.into_iter().zip(values(s, anatomy, 1.0)) {
        all = value.mul_add(T::lit(weight), all);
        if of_pose {
            posture = value.mul_add(T::lit(weight), posture);
        }
    }
    [all, posture]
}

/// Values of the terms, without their weights.
#[inline(always)]
fn values<T: Real>(s: &Senses<T>, anatomy: &Anatomy, sharpness: f64) -> [T; TERMS.len()] {
    let mut values = errors(s, anatomy);
    for ((_, _, scale, of_pose), value) in TERMS.into_iter().zip(&mut values) {
        let scale = if of_pose { sharpness * scale } else { scale };
        *value = (*value * T::lit(-scale)).exp();
    }
    values
}

/// Errors of the terms.
#[inline(always)]
fn errors<T: Real>(s: &Senses<T>, anatomy: &Anatomy) -> [T; 5] {
    let Anatomy { root, ends, weights, total, .. } = *anatomy;
    let (clip, r) = (s.reference(0), s.readings());
    let gap = sub(s.position(root), clip.position(root));
    let spin = sub(s.angular_velocity(root), clip.angular_velocity(root));
    let turn2 = angle2(s, root);
    let (mut pose, mut velocity) = (turn2, norm2(spin));
    for (i, weight) in weights.iter().enumerate() {
        let q = r.qpos(anatomy.qpos + i) - clip.qpos(anatomy.qpos + i);
        let v = r.qvel(anatomy.qvel + i) - clip.qvel(anatomy.qvel + i);
        pose = (q * q).mul_add(T::lit(*weight), pose);
        velocity = (v * v).mul_add(T::lit(*weight), velocity);
    }
    let mut apart = T::zero();
    for part in ends {
        // heights are compared above the ground, not relative to the root
        let [x, y, z] = sub(sub(s.position(*part), clip.position(*part)), gap);
        apart += norm2([x, y, z + gap[2]]);
    }
    let slip = sub(s.linear_velocity(root), clip.linear_velocity(root));
    let place =
        norm2(spin).mul_add(T::lit(0.001), norm2(slip).mul_add(T::lit(0.01), turn2.mul_add(T::lit(0.1), norm2(gap))));
    let drift = norm2(sub(s.center_of_mass_velocity(), clip.center_of_mass_velocity()));
    let share = T::lit(1.0 / total);
    [pose * share, velocity * share, apart * T::lit(1.0 / ends.len() as f64), place, drift * T::lit(0.1)]
}

/// Squared angle between a part and the clip's, rad^2.
#[inline(always)]
pub(super) fn angle2<T: Real>(s: &Senses<T>, part: Part) -> T {
    let (a, b) = (s.axes(part), s.reference(0).axes(part));
    // for the rotation between them: trace = 2 cos + 1, axis = 2 sin times the unit axis
    let mut trace = T::zero();
    let mut axis = [T::zero(); 3];
    for k in 0..3 {
        let [x, y, z] = a[k];
        let [u, v, w] = b[k];
        trace += x.mul_add(u, y.mul_add(v, z * w));
        axis[0] += y.mul_add(w, -(z * v));
        axis[1] += z.mul_add(u, -(x * w));
        axis[2] += x.mul_add(v, -(y * u));
    }
    let angle = norm2(axis).sqrt().atan2(trace - T::lit(1.0));
    angle * angle
}

/// Mean distance of the parts from the clip's, m. The distances are relative to the root if `from_root`, otherwise in
/// the world.
#[inline(always)]
pub(super) fn distance<T: Real>(s: &Senses<T>, anatomy: &Anatomy, from_root: bool) -> T {
    distance_from(s, &s.reference(0), anatomy, from_root)
}

/// The same for a frame of the clip.
#[inline(always)]
pub(super) fn distance_from<T: Real>(s: &Senses<T>, clip: &Frame<'_, T>, anatomy: &Anatomy, from_root: bool) -> T {
    let mut gap = [T::zero(); 3];
    if from_root {
        gap = sub(s.position(anatomy.root), clip.position(anatomy.root));
    }
    let mut sum = T::zero();
    for part in (0..anatomy.parts).map(Part) {
        sum += norm2(sub(sub(s.position(part), clip.position(part)), gap)).sqrt();
    }
    sum * T::lit(1.0 / anatomy.parts as f64)
}

/// Mean absolute error of the hinges' angles, rad.
#[inline(always)]
pub(super) fn joint_error<T: Real>(s: &Senses<T>, anatomy: &Anatomy) -> T {
    let (clip, r, mut error) = (s.reference(0), s.readings(), T::zero());
    for i in anatomy.qpos..anatomy.qpos + anatomy.weights.len() {
        error += (r.qpos(i) - clip.qpos(i)).abs();
    }
    error * T::lit(1.0 / anatomy.weights.len() as f64)
}

/// Lanes in which a trunk part touched the ground while the clip's does not.
#[inline(always)]
pub(super) fn fallen<T: Real>(s: &Senses<T>, trunk: &[Part]) -> T::Mask {
    let (mut fallen, clip) = (T::none(), s.reference(0));
    for part in trunk {
        let upright = T::lit(LYING).lt(clip.lowest(*part));
        fallen = T::or(fallen, T::and(upright, s.touched_ground(*part)));
    }
    fallen
}

/// Writes the observation of the body: the root's height, orientation and velocities, then joint angles and velocities.
#[inline(always)]
pub(super) fn observe_body<T: Real>(
    s: &Senses<T>,
    anatomy: &Anatomy,
    turned: &impl Fn([T; 3]) -> [T; 3],
    out: &mut Obs<T>,
) {
    let (root, r) = (anatomy.root, s.readings());
    let [x, y, z] = s.position(root);
    out.group("height");
    out.scalar(z - s.ground_height(x, y));
    out.group("orientation");
    out.vector(turned(s.forward(root)));
    out.vector(turned(s.up(root)));
    out.group("velocity");
    out.vector(turned(s.linear_velocity(root)));
    out.group("angular_velocity");
    out.vector(turned(s.angular_velocity(root)));
    out.group("joint_positions");
    for i in 0..anatomy.weights.len() {
        out.scalar(r.qpos(anatomy.qpos + i));
    }
    out.group("joint_velocities");
    for i in 0..anatomy.weights.len() {
        out.scalar(r.qvel(anatomy.qvel + i));
    }
}

/// Returns a map of vectors into axes with x along a ground direction (cosine and sine of its angle) and z up.
#[inline(always)]
pub(super) fn turned_to<T: Real>([cos, sin]: [T; 2]) -> impl Fn([T; 3]) -> [T; 3] {
    move |[x, y, z]| [sin.mul_add(y, cos * x), sin.neg_mul_add(x, cos * y), z]
}

#[inline(always)]
pub(super) fn sub<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Squared length of a vector.
#[inline(always)]
pub(super) fn norm2<T: Real>([x, y, z]: [T; 3]) -> T {
    x.mul_add(x, y.mul_add(y, z * z))
}
