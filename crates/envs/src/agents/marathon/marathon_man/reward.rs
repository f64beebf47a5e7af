//! Rewards for following a clip.
//!
//! `deepmimic`: `0.5 pose + 0.05 velocity + 0.15 end_effectors + 0.2 root + 0.1 center_of_mass`, each `exp(-scale error)` with
//! the scales 2, 0.1, 10, 5 and 10 (DeepMimicCore/scenes/SceneImitate.cpp). Errors: sum of the joints' squared angles and of
//! their squared velocities by DeepMimic's weights; mean squared distance of feet and hands from the butt; squared distance of
//! the butt, a tenth of its squared angle, a hundredth of its squared velocity, a thousandth of its squared angular velocity; a
//! tenth of the squared velocity of the center of mass. A ball joint of DeepMimic's is two or three hinges here, whose squares
//! add up to that of its angle as long as it is small. The mean over the end effectors is DeepMimic's.
//!
//! `paper`: ActiveRagdollStyleTransfer 0.002.124, in which a distance `d` of at most `n` is worth `((n - d)/n)^n`. Its
//! velocities were 5 times too large, on both sides; these are true.

use std::f64::consts::FRAC_1_PI;

use marathon_physics::lanes::Real;

use super::body::{BUTT, END_EFFECTORS, FIRST_QPOS, FIRST_QVEL, JOINTS, PAPER_END_EFFECTORS, TOUCH, parts};
use super::{norm2, sub};
use crate::agent::options::OptionValue;
use crate::agent::senses::clamp;
use crate::agent::{Part, Senses, Terms, Value};

/// Which reward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reward {
    /// DeepMimic's (Peng et al., 2018).
    DeepMimic,
    /// The paper's.
    Paper,
}

impl OptionValue for Reward {
    const EXPECTED: &'static str = "deepmimic or paper";
    fn value(&self) -> Value {
        match self {
            Reward::DeepMimic => "deepmimic".into(),
            Reward::Paper => "paper".into(),
        }
    }
    fn read(value: &Value) -> Option<Self> {
        [Reward::DeepMimic, Reward::Paper].into_iter().find(|reward| reward.value() == *value)
    }
}

/// Terms of DeepMimic's reward: name, weight, scale.
const DEEPMIMIC: [(&str, f64, f64); 5] = [
    ("pose", 0.5, 2.0),
    ("velocity", 0.05, 0.1),
    ("end_effectors", 0.15, 10.0),
    ("root", 0.2, 5.0),
    ("center_of_mass", 0.1, 10.0),
];

/// What the weights of the joints add up to: root, waist, and twice hip, knee, ankle, shoulder and elbow.
const WEIGHTS: f64 = 1.0 + 0.5 + 2.0 * (0.5 + 0.3 + 0.2 + 0.3 + 0.2);

/// Terms of the paper's reward that a distance makes: name, weight, most of the distance.
const PAPER: [(&str, f64, i32); 4] = [
    ("rotation", 0.585, 17),
    ("center_of_mass_velocity", 0.09, 3),
    ("end_effectors", 0.135, 8),
    ("center_of_mass", 0.09, 5),
];
/// Weight of the touch sensors, and of the motors that are not at their limit.
const PAPER_REST: f64 = 0.09;
/// The paper's sum of terms below which an episode ends.
const PAPER_LEAST: f64 = 0.334;

impl Reward {
    /// Names of the terms.
    pub fn terms(self) -> Vec<&'static str> {
        match self {
            Reward::DeepMimic => DEEPMIMIC.map(|(name, ..)| name).to_vec(),
            Reward::Paper => PAPER.map(|(name, ..)| name).into_iter().chain(["touch", "joints_at_limit"]).collect(),
        }
    }

    /// Adds the terms.
    #[inline(always)]
    pub fn add<T: Real>(self, s: &Senses<T>, terms: &mut Terms<T>) {
        match self {
            Reward::DeepMimic => {
                for ((name, weight, scale), error) in DEEPMIMIC.into_iter().zip(deepmimic_errors(s)) {
                    terms.add(name, weight, (error * T::lit(-scale)).exp());
                }
            }
            Reward::Paper => {
                for ((name, weight, _), worth) in PAPER.into_iter().zip(paper_worths(s)) {
                    terms.add(name, weight, worth);
                }
                terms.add("touch", PAPER_REST, touch_alike(s));
                let mut driven = T::zero();
                for i in 0..s.action_count() {
                    driven += T::select(s.action(i).abs().lt(T::lit(1.0)), T::zero(), T::lit(1.0));
                }
                terms.add("joints_at_limit", PAPER_REST, driven.neg_mul_add(T::lit(1.0 / 21.0), T::lit(1.0)));
            }
        }
    }
}

/// The errors of DeepMimic's terms.
#[inline(always)]
fn deepmimic_errors<T: Real>(s: &Senses<T>) -> [T; 5] {
    let (clip, r) = (s.reference(0), s.readings());
    let gap = sub(s.position(BUTT), clip.position(BUTT));
    let spin = sub(s.angular_velocity(BUTT), clip.angular_velocity(BUTT));
    let turn2 = angle2(s, BUTT);
    let (mut pose, mut velocity) = (turn2, norm2(spin));
    for (i, joint) in JOINTS.iter().enumerate() {
        let q = r.qpos(FIRST_QPOS + i) - clip.qpos(FIRST_QPOS + i);
        let v = r.qvel(FIRST_QVEL + i) - clip.qvel(FIRST_QVEL + i);
        pose = (q * q).mul_add(T::lit(joint.weight), pose);
        velocity = (v * v).mul_add(T::lit(joint.weight), velocity);
    }
    let mut ends = T::zero();
    for part in END_EFFECTORS {
        // heights are above the ground
        let [x, y, z] = sub(sub(s.position(part), clip.position(part)), gap);
        ends += norm2([x, y, z + gap[2]]);
    }
    let slip = sub(s.linear_velocity(BUTT), clip.linear_velocity(BUTT));
    let root =
        norm2(spin).mul_add(T::lit(0.001), norm2(slip).mul_add(T::lit(0.01), turn2.mul_add(T::lit(0.1), norm2(gap))));
    let drift = norm2(sub(s.center_of_mass_velocity(), clip.center_of_mass_velocity()));
    let share = T::lit(1.0 / WEIGHTS);
    [pose * share, velocity * share, ends * T::lit(1.0 / END_EFFECTORS.len() as f64), root, drift * T::lit(0.1)]
}

/// Square of the angle between a part and where the clip has it, rad^2.
#[inline(always)]
fn angle2<T: Real>(s: &Senses<T>, part: Part) -> T {
    let (a, b) = (s.axes(part), s.reference(0).axes(part));
    // of the rotation from one to the other, twice the cosine plus 1, and the axis times twice the sine
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

/// What the paper's distances are worth.
#[inline(always)]
fn paper_worths<T: Real>(s: &Senses<T>) -> [T; 4] {
    let clip = s.reference(0);
    let mut rotation = T::zero();
    for part in parts() {
        // in half turns
        rotation = angle2(s, part).mul_add(T::lit(FRAC_1_PI * FRAC_1_PI), rotation);
    }
    let gap = sub(s.position(BUTT), clip.position(BUTT));
    let mut ends = T::zero();
    for part in PAPER_END_EFFECTORS {
        ends += norm2(sub(sub(s.position(part), clip.position(part)), gap));
    }
    let velocity = norm2(sub(s.center_of_mass_velocity(), clip.center_of_mass_velocity()));
    let position = norm2(sub(s.center_of_mass(), clip.center_of_mass()));
    let mut worths = [rotation, velocity, ends, position];
    for (d, (_, _, most)) in worths.iter_mut().zip(PAPER) {
        let near = clamp(d.neg_mul_add(T::lit(1.0 / f64::from(most)), T::lit(1.0)), 0.0, 1.0);
        *d = T::lit(1.0);
        for _ in 0..most {
            *d *= near;
        }
    }
    worths
}

/// Share of the touch sensors that feel what they would in the clip.
#[inline(always)]
fn touch_alike<T: Real>(s: &Senses<T>) -> T {
    let clip = s.reference(0);
    let mut alike = T::zero();
    for i in 0..TOUCH.len() {
        let differs = T::xor(T::zero().lt(s.touch_force(i)), clip.touch(i));
        alike += T::select(differs, T::zero(), T::lit(1.0 / TOUCH.len() as f64));
    }
    alike
}

/// Lanes whose agent the paper gives up.
#[inline(always)]
pub(super) fn too_far<T: Real>(s: &Senses<T>) -> T::Mask {
    let mut sum = touch_alike(s) * T::lit(PAPER_REST);
    for ((_, weight, _), worth) in PAPER.into_iter().zip(paper_worths(s)) {
        sum = worth.mul_add(T::lit(weight), sum);
    }
    sum.lt(T::lit(PAPER_LEAST))
}
