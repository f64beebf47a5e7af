//! `humanoid-stand-v0`, `humanoid-walk-v0`, `humanoid-run-v0`: two legs, a waist and two arms in space, 21 motors.
//!
//! Observation: joint angles (21), height of the head (1), left hand, left foot, right hand and right foot relative to
//! the torso (12), z of the torso's axes (3), velocity of the center of mass (3), qvel (27); or qpos (28) and qvel.
//!
//! Reward: 1 for a head above 1.4 m and an upright torso, times 0.8 to 1 for small actions, times a third factor. To
//! stand, the factor is 1 for a center of mass at rest. To walk or run, it is up to 1 for the horizontal speed in any
//! direction, and a sixth at rest.

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use super::Domain;
use crate::agent::{
    Agent, Body, Facts, Obs, OptionInfo, OptionSet, Options, Senses, Sigmoid, Start, Terms, Tolerance, names,
};

const DOMAIN: Domain = Domain {
    file: "humanoid.xml",
    text: marathon_assets::text("dm_control/humanoid.xml"),
    frame_skip: 5,
    info: &["head_height", "upright", "speed"],
};

const BODIES: [&str; 6] = ["torso", "head", "left_hand", "left_foot", "right_hand", "right_foot"];
const TORSO: Body = Body::named(&BODIES, "torso");
const HEAD: Body = Body::named(&BODIES, "head");
const EXTREMITIES: [Body; 4] = [
    Body::named(&BODIES, "left_hand"),
    Body::named(&BODIES, "left_foot"),
    Body::named(&BODIES, "right_hand"),
    Body::named(&BODIES, "right_foot"),
];

/// Height of the head that counts as standing, m.
const STAND_HEIGHT: f64 = 1.4;
/// Coordinates of the root.
const ROOT: usize = 7;

crate::options! {
    /// Arguments of the humanoid.
    pub struct Arguments {
        /// Model: `humanoid.xml`, or the path of an MJCF file.
        xml_file: String = "humanoid.xml".into(),
        /// Speed at which the reward is full, m/s. 0 rewards standing still.
        move_speed: f64 = 0.0,
        /// Whether the observation is qpos and qvel only.
        pure_state: bool = false,
    }
}

/// dm_control's humanoid.
#[derive(Clone, Debug)]
pub struct Humanoid {
    id: &'static str,
    summary: &'static str,
    arguments: Arguments,
}

impl Humanoid {
    /// The standing task.
    pub fn stand() -> Self {
        Self::new("humanoid-stand-v0", "dm_control's humanoid, to stand", 0.0)
    }

    /// The walking task, at 1 m/s.
    pub fn walk() -> Self {
        Self::new("humanoid-walk-v0", "dm_control's humanoid, to walk", 1.0)
    }

    /// The running task, at 10 m/s.
    pub fn run() -> Self {
        Self::new("humanoid-run-v0", "dm_control's humanoid, to run", 10.0)
    }

    fn new(id: &'static str, summary: &'static str, move_speed: f64) -> Self {
        Humanoid { id, summary, arguments: Arguments { move_speed, ..Arguments::default() } }
    }

    /// Height of the head, m.
    #[inline(always)]
    fn head_height<T: Real>(&self, s: &Senses<T>) -> T {
        s.readings().body_pos(s.body(HEAD))[2]
    }

    /// z of the torso's axes.
    #[inline(always)]
    fn vertical<T: Real>(&self, s: &Senses<T>) -> [T; 3] {
        let axes = s.readings().body_axes(s.body(TORSO));
        [axes[0][2], axes[1][2], axes[2][2]]
    }

    /// Velocity of the center of mass, m/s.
    #[inline(always)]
    fn velocity<T: Real>(&self, s: &Senses<T>) -> [T; 3] {
        s.readings().subtree_velocity(s.body(TORSO))
    }

    /// A body's position in the torso's frame, m.
    #[inline(always)]
    fn seen_from_torso<T: Real>(&self, s: &Senses<T>, body: Body) -> [T; 3] {
        let (r, torso) = (s.readings(), s.body(TORSO));
        let (from, to, axes) = (r.body_pos(torso), r.body_pos(s.body(body)), r.body_axes(torso));
        let d = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
        let mut out = [T::zero(); 3];
        for (x, axis) in out.iter_mut().zip(axes) {
            *x = axis[0].mul_add(d[0], axis[1].mul_add(d[1], axis[2] * d[2]));
        }
        out
    }
}

/// Length of (x, y).
#[inline(always)]
fn horizontal<T: Real>(v: &[T; 3]) -> T {
    v[0].mul_add(v[0], v[1] * v[1]).sqrt()
}

impl Agent for Humanoid {
    fn facts(&self) -> Facts {
        Facts { bodies: names(BODIES), ..DOMAIN.facts(self.id, self.summary, &self.arguments.xml_file) }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Humanoid { arguments: self.arguments.with(options), ..*self })
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        super::goal(self.arguments.move_speed)?;
        super::fits(model, ROOT)
    }

    fn reset(&self, start: &mut Start) {
        super::randomize_joints(start);
        start.free_of_contacts = true;
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        if self.arguments.pure_state {
            super::observe_positions(s, out, 0);
        } else {
            out.group("joint_angles");
            crate::agents::observe_positions(s, out, ROOT);
            out.group("head_height");
            out.scalar(self.head_height(s));
            out.group("extremities");
            for body in EXTREMITIES {
                out.vector(self.seen_from_torso(s, body));
            }
            out.group("torso_vertical");
            out.vector(self.vertical(s));
            out.group("com_velocity");
            out.vector(self.velocity(s));
        }
        super::observe_velocities(s, out);
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let (goal, velocity) = (self.arguments.move_speed, self.velocity(s));
        let standing = Tolerance::at_least(STAND_HEIGHT, STAND_HEIGHT / 4.0).of(self.head_height(s));
        let upright = Tolerance { sigmoid: Sigmoid::Linear, value_at_margin: 0.0, ..Tolerance::at_least(0.9, 1.9) };
        let upright = upright.of(self.vertical(s)[2]);
        let small_control = super::weighted(1.0, super::small_control(s), 4.0);
        let moving = if goal > 0.0 {
            super::weighted(5.0, super::fast(horizontal(&velocity), goal, goal, 0.0), 1.0)
        } else {
            let still = Tolerance::around_zero(2.0);
            (still.of(velocity[0]) + still.of(velocity[1])) * T::lit(0.5)
        };
        super::pay(terms, standing * upright * small_control * moving);
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(self.head_height(s));
        out.scalar(self.vertical(s)[2]);
        out.scalar(horizontal(&self.velocity(s)));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}
