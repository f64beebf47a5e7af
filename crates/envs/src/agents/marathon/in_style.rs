//! The paper's Humanoid and Walker, with their own motors, imitating a motion clip of a person.
//!
//! | observation | content |
//! |---|---|
//! | 0..4 | phase of the clip: sine and cosine of its angle, and of twice that |
//! | 4 | height of the root part, m: the humanoid's butt, the walker's torso |
//! | 5..11 | forward and up axis of the root part |
//! | 11..17 | velocity of the root part, m/s, and its angular velocity, rad/s |
//! | n, n | angles of the n joints, rad, and their velocities, rad/s |
//! | 4 or 2 | ground contact of the feet, 0 or 1, in the order of the agent's touch sensors |
//! | 3 | from the agent's root part to the clip's, m |
//! | n | the clip's next joint angles minus the agent's, rad |
//!
//! Vectors are expressed in the clip's [direction of travel](crate::Frame::facing). As in `Humanoid-v0` and
//! `Walker2d-v0`, an action is a fraction of each motor's torque. The reward is DeepMimic's, as for Marathon Man
//! (`imitation.rs`). An episode is terminated when the trunk touches the ground, or when the mean distance of the parts
//! from the clip exceeds 0.5 m.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use marathon_motion::Clip;
use marathon_physics::lanes::Real;

use super::humanoid::HumanoidV0;
use super::imitation::{self, Anatomy, StartAt, TERMS, sub, turned_to};
use super::walker2d::Walker2dV0;
use crate::agent::{Agent, Facts, Obs, OptionInfo, OptionSet, Options, Part, ResetNoise, Senses, Start, Terms, names};
use crate::any_agent::AnyAgent;

/// Length of an episode, s.
const SECONDS: f64 = 20.0;
/// Mean distance of the parts from the clip that ends an episode, m.
const FAR: f64 = 0.5;

/// A character of another task.
struct Figure {
    facts: fn() -> Facts,
    parts: &'static [&'static str],
    /// Parts that must not touch the ground.
    trunk: &'static [Part],
    anatomy: Anatomy,
    /// Seconds between decisions.
    decision: f64,
}

/// Parts of the humanoid.
const HUMANOID: [&str; 15] = [
    "butt",
    "lower_waist",
    "upper_waist",
    "torso",
    "head",
    "right_thigh",
    "right_shin",
    "right_right_foot",
    "left_thigh",
    "left_shin",
    "left_left_foot",
    "right_larm",
    "right_hand",
    "left_larm",
    "left_hand",
];
/// Parts of the walker.
const WALKER: [&str; 7] = ["torso", "right_thigh", "right_leg", "right_foot", "left_thigh", "left_leg", "left_foot"];

const HUMANOID_FIGURE: Figure = Figure {
    facts: || Agent::facts(&HumanoidV0),
    parts: &HUMANOID,
    trunk: &[
        Part::named(&HUMANOID, "torso"),
        Part::named(&HUMANOID, "head"),
        Part::named(&HUMANOID, "butt"),
        Part::named(&HUMANOID, "lower_waist"),
        Part::named(&HUMANOID, "upper_waist"),
    ],
    anatomy: Anatomy {
        root: Part::named(&HUMANOID, "butt"),
        parts: HUMANOID.len(),
        ends: &[
            Part::named(&HUMANOID, "right_right_foot"),
            Part::named(&HUMANOID, "left_left_foot"),
            Part::named(&HUMANOID, "right_hand"),
            Part::named(&HUMANOID, "left_hand"),
        ],
        // abdomen, hips, knee and ankles of both sides, shoulders and elbow of both sides
        weights: &[
            0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.3, 0.2, 0.2, 0.5, 0.5, 0.5, 0.3, 0.2, 0.2, 0.3, 0.3, 0.2, 0.3, 0.3, 0.2,
        ],
        total: 1.0 + 0.5 + 2.0 * (0.5 + 0.3 + 0.2 + 0.3 + 0.2),
        qpos: 7,
        qvel: 6,
    },
    decision: 1.0 / 40.0,
};

const WALKER_FIGURE: Figure = Figure {
    facts: || Agent::facts(&Walker2dV0),
    parts: &WALKER,
    trunk: &[Part::named(&WALKER, "torso")],
    anatomy: Anatomy {
        root: Part::named(&WALKER, "torso"),
        parts: WALKER.len(),
        ends: &[Part::named(&WALKER, "right_foot"), Part::named(&WALKER, "left_foot")],
        // hip, knee and ankle of both sides
        weights: &[0.5, 0.3, 0.2, 0.5, 0.3, 0.2],
        total: 1.0 + 2.0 * (0.5 + 0.3 + 0.2),
        qpos: 3,
        qvel: 3,
    },
    decision: 1.0 / 100.0,
};

crate::options! {
    /// Arguments of the tasks.
    pub struct Arguments {
        /// Start of an episode: `random` decisions of the clip, its `first`, or `adaptive` (more often where episodes
        /// fail).
        start: StartAt = StartAt::Random,
    }
}

/// One of the paper's characters with a clip.
#[derive(Clone)]
pub struct InStyle {
    id: &'static str,
    summary: &'static str,
    figure: &'static Figure,
    clip: &'static LazyLock<Arc<Clip>>,
    arguments: Arguments,
}

macro_rules! clip {
    ($name:ident, $file:literal) => {
        static $name: LazyLock<Arc<Clip>> = LazyLock::new(|| {
            let text = const { marathon_assets::text(concat!("motions/", $file)) };
            Arc::new(Clip::shipped(Path::new($file), text).unwrap_or_else(|error| panic!("{error}")))
        });
    };
}

clip!(HUMANOID_WALK, "humanoid/walk.motion");
clip!(HUMANOID_RUN, "humanoid/run.motion");
clip!(WALKER_WALK, "walker2d/walk.motion");
clip!(WALKER_RUN, "walker2d/run.motion");

/// All tasks of this module.
pub fn all() -> Vec<Arc<dyn AnyAgent>> {
    let tasks: [(_, _, _, &'static LazyLock<Arc<Clip>>); 4] = [
        ("HumanoidStyleWalk-v0", "the humanoid: walk as a person does", &HUMANOID_FIGURE, &HUMANOID_WALK),
        ("HumanoidStyleRun-v0", "the humanoid: run as a person does", &HUMANOID_FIGURE, &HUMANOID_RUN),
        ("Walker2dStyleWalk-v0", "two legs in a plane: walk as a person does", &WALKER_FIGURE, &WALKER_WALK),
        ("Walker2dStyleRun-v0", "two legs in a plane: run as a person does", &WALKER_FIGURE, &WALKER_RUN),
    ];
    let agent = |(id, summary, figure, clip)| {
        Arc::new(InStyle { id, summary, figure, clip, arguments: Arguments::default() }) as Arc<dyn AnyAgent>
    };
    tasks.into_iter().map(agent).collect()
}

impl InStyle {
    fn max_episode_steps(&self) -> usize {
        (SECONDS / self.figure.decision).round() as usize
    }
}

impl Agent for InStyle {
    fn facts(&self) -> Facts {
        let own = (self.figure.facts)();
        let (joints, touch) = (self.figure.anatomy.weights.len(), own.touch.len());
        Facts {
            id: self.id.into(),
            summary: self.summary.into(),
            max_episode_steps: self.max_episode_steps(),
            observation: Some(20 + touch + 3 * joints),
            reward_terms: names(TERMS.map(|(name, ..)| name)),
            info: names(["joint_error", "position_error", "phase"]),
            metrics: names(["forward", "joint_error", "position_error"]),
            parts: names(self.figure.parts),
            feet: Vec::new(),
            clips: vec![(**self.clip).clone()],
            memory: imitation::MEMORY,
            termination_reward: None,
            ..own
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(InStyle { arguments: self.arguments.with(options), ..*self })
    }

    fn reset(&self, start: &mut Start) {
        self.arguments.start.begin(start, self.figure.decision, self.max_episode_steps());
        start.add_noise(ResetNoise::MARATHON);
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        imitation::remember(s, memory);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let Anatomy { root, weights, qpos, .. } = self.figure.anatomy;
        let (now, next, r) = (s.reference(0), s.reference(1), s.readings());
        let turned = turned_to(now.facing());
        out.group("phase");
        for x in now.phase_angles() {
            out.scalar(x);
        }
        imitation::observe_body(s, &self.figure.anatomy, &turned, out);
        out.group("touch");
        out.touch_sensors(s);
        out.group("place_in_clip");
        out.vector(turned(sub(now.position(root), s.position(root))));
        out.group("next_pose");
        for i in qpos..qpos + weights.len() {
            out.scalar(next.qpos(i) - r.qpos(i));
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        imitation::add_terms(s, &self.figure.anatomy, 1.0, terms);
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let far = T::lit(FAR).lt(imitation::distance(s, &self.figure.anatomy, false));
        T::or(far, imitation::fallen(s, self.figure.trunk))
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(imitation::joint_error(s, &self.figure.anatomy));
        out.scalar(imitation::distance(s, &self.figure.anatomy, true));
        out.scalar(s.reference(0).phase());
    }
}
