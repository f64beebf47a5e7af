//! Marathon Man: a character of 82 kg with 21 motors that imitates a motion clip.
//!
//! | observation | content |
//! |---|---|
//! | 0..4 | phase of the clip: sine and cosine of its angle, and of twice that |
//! | 4 | height of the butt, m |
//! | 5..11 | forward and up axis of the butt |
//! | 11..17 | velocity of the butt, m/s, and its angular velocity, rad/s |
//! | 17..38, 38..59 | angles of the 21 joints, rad, and their velocities, rad/s |
//! | 59..65 | ground contact of toe, toe and heel of the right and of the left foot, 0 or 1 |
//! | 65..68 | from the character's butt to the clip's, m |
//! | 68..89 | the clip's next joint angles minus the character's, rad |
//! | 30 each | later frames: the clip's butt relative to the character's, m, its forward and up axis, joint angles minus the character's |
//!
//! Vectors are expressed in the clip's [direction of travel](crate::Frame::facing).
//!
//! # Mechanism
//!
//! An episode starts at a frame of the clip, with the clip's pose and velocities (reference state initialization). From
//! then on the clip advances by one decision at a time. With the default [`Control::Pd`], an action offsets servo
//! targets from the clip's next pose. The [`reward`] compares the character with the clip.
//!
//! An episode is terminated when the trunk touches the ground, unless the clip's trunk does, and when the character is
//! too far from the clip. It is truncated at the end of a clip that does not loop.

mod body;
pub mod clips;
mod controller;
mod courses;
pub mod gait;
pub mod reward;
mod skills;
mod sparse;
pub mod steer;

use std::sync::Arc;

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use crate::agent::{
    Agent, Clips, Ctrl, Facts, Obs, OptionInfo, OptionSet, Options, ResetNoise, Scale, Seconds, Senses, Start, Terms,
    names,
};
use crate::any_agent::AnyAgent;

pub use super::imitation::StartAt;
use super::imitation::{self, sub, turned_to};
pub use body::Control;
use body::{
    ACTIONS, ANATOMY, BUTT, DAMPING_TIME, FIRST_QPOS, FIRST_QVEL, JOINTS, PARTS, TOUCH, TRUNK, model, set_targets,
};
pub use courses::TerrainMarathonMan;
pub use reward::Reward;

/// Physics steps per decision: 200 Hz physics, 40 Hz control.
const FRAME_SKIP: usize = 5;
/// Seconds between decisions.
const DECISION: f64 = 1.0 / 40.0;
/// Longest episode, s, unless an option overrides it.
const SECONDS: f64 = 20.0;
/// Later frames of the clip in the observation: how far ahead, decisions, and the name of the group.
const FUTURE: [(usize, &str); 3] = [(4, "in_4"), (8, "in_8"), (16, "in_16")];
/// Size of one such frame.
const FUTURE_FRAME: usize = 9 + JOINTS.len();
crate::options! {
    /// Arguments of Marathon Man.
    pub struct Arguments {
        /// Motion to imitate: the name of a clip, several names separated by commas, or `all` that ship with the crate.
        /// Each episode uses one of them.
        clip: Clips = Clips::named("walk"),
        /// Reward: `deepmimic` (Peng et al., 2018), `paper` (Booth and Booth, 2019), or `sparse` (distance covered by
        /// the feet, at the end of the episode).
        reward: Reward = Reward::DeepMimic,
        /// Meaning of an action: `pd` offsets a servo's target from the clip's next pose; `pd_range` sets the target
        /// within the joint's range; `torque` is a fraction of the motor's strength; `servo` sets the target velocity
        /// of the original's drive.
        control: Control = Control::Pd,
        /// Start of an episode: `random` decisions of the clip, its `first`, or `adaptive` (more often where episodes
        /// fail).
        start: StartAt = StartAt::Random,
        /// Mean distance of the parts from the clip that ends an episode, m. With the reward `paper`, a sum of its
        /// first five terms below 0.334 ends it instead. With `sparse`, only a fall does.
        distance: Scale = Scale(0.5),
        /// Factor of the scales of the `deepmimic` terms `pose` and `end_effectors`. A higher value demands a closer
        /// pose.
        sharpness: Scale = Scale(1.0),
        /// Largest offset of a servo's target by an action of `pd`, rad.
        action_scale: Scale = Scale(1.0),
        /// Largest angle of a servo's target by `pd`, rad. With 1, it cannot bend a hip or a knee by more than about 60 degrees.
        max_target: Scale = Scale(3.0),
        /// Number of later clip frames in the observation, 0 to 3: 4, 8 and 16 decisions ahead.
        future: usize = 0,
        /// Longest episode, s. With several clips, shorter episodes give mastered clips a smaller part of the training.
        seconds: Seconds = Seconds(SECONDS),
    }
}

/// Marathon Man with a clip.
#[derive(Clone, Debug)]
pub struct MarathonMan {
    id: &'static str,
    summary: &'static str,
    /// Whether the task has the option `clip`.
    any_clip: bool,
    arguments: Arguments,
}

/// Tasks with a fixed clip: id, clip and summary.
const TASKS: [(&str, &str, &str); 16] = [
    ("MarathonManWalk-v0", "walk", "a figure of 21 motors: walk as a person does"),
    ("MarathonManWalkLeft-v0", "walk_left", "a figure of 21 motors: walk on a circle to the left"),
    ("MarathonManWalkRight-v0", "walk_right", "a figure of 21 motors: walk on a circle to the right"),
    ("MarathonManRun-v0", "run", "a figure of 21 motors: run as a person does"),
    ("MarathonManBackflip-v0", "backflip", "a figure of 21 motors: one backflip after another"),
    ("MarathonManSpinKick-v0", "spinkick", "a figure of 21 motors: kick out of a turn in the air"),
    ("MarathonManSpin-v0", "spin", "a figure of 21 motors: turn in the air"),
    ("MarathonManCartwheel-v0", "cartwheel", "a figure of 21 motors: one cartwheel after another"),
    ("MarathonManRoll-v0", "roll", "a figure of 21 motors: roll forward and get up"),
    ("MarathonManJump-v0", "jump", "a figure of 21 motors: jump forward"),
    ("MarathonManKick-v0", "kick", "a figure of 21 motors: kick"),
    ("MarathonManPunch-v0", "punch", "a figure of 21 motors: punch"),
    ("MarathonManDance-v0", "dance", "a figure of 21 motors: dance"),
    ("MarathonManCrawl-v0", "crawl", "a figure of 21 motors: crawl on hands and knees"),
    ("MarathonManGetUpFaceDown-v0", "getup_facedown", "a figure of 21 motors: get up, lying on the belly"),
    ("MarathonManGetUpFaceUp-v0", "getup_faceup", "a figure of 21 motors: get up, lying on the back"),
];

/// The task for any clip, those with a fixed clip, the sparse task, and the two that take commands.
pub fn all() -> Vec<Arc<dyn AnyAgent>> {
    let any = ("MarathonMan-v0", "walk", "a figure of 21 motors: move as a motion clip does");
    let sparse = ("MarathonManSparse-v0", "walk", "a figure of 21 motors: walk for one reward at the end");
    let tasks = [any].into_iter().chain(TASKS).chain([sparse]).enumerate();
    let agent = |(i, (id, clip, summary)): (usize, (&'static str, &str, &'static str))| {
        let reward = if id == sparse.0 { Reward::Sparse } else { Reward::DeepMimic };
        let arguments = Arguments { clip: Clips::named(clip), reward, ..Arguments::default() };
        Arc::new(MarathonMan { id, summary, any_clip: i == 0, arguments }) as Arc<dyn AnyAgent>
    };
    let told: [Arc<dyn AnyAgent>; 2] = [Arc::new(steer::Steer::default()), Arc::new(controller::Controller::default())];
    tasks.map(agent).chain(told).collect()
}

/// Imitation of any clip, and the controller.
pub fn core() -> Vec<Arc<dyn AnyAgent>> {
    let summary = "a figure of 21 motors: move as a motion clip does";
    let any = MarathonMan { id: "MarathonMan-v0", summary, any_clip: true, arguments: Arguments::default() };
    vec![Arc::new(any), Arc::new(controller::Controller::default())]
}

/// Checks that a model has the character's joints.
fn has_joints(model: &Model) -> Result<(), String> {
    let expected = JOINTS.each_ref().map(|joint| joint.name);
    let found: Vec<&str> = model.joints.iter().skip(1).map(|joint| joint.name.as_str()).collect();
    match found == expected {
        true => Ok(()),
        false => Err(format!("its model has the joints {found:?}, expected {expected:?}")),
    }
}

/// Number of decisions in a time, at least one.
fn decisions(seconds: Seconds) -> usize {
    (seconds.0 / DECISION).round().max(1.0) as usize
}

impl MarathonMan {
    /// Number of decisions after which an episode is truncated.
    fn max_episode_steps(&self) -> usize {
        decisions(self.arguments.seconds)
    }
}

impl Agent for MarathonMan {
    fn facts(&self) -> Facts {
        let Arguments { clip, reward, control, future, .. } = &self.arguments;
        Facts {
            id: self.id.into(),
            summary: self.summary.into(),
            model: model(*control),
            frame_skip: FRAME_SKIP,
            max_episode_steps: self.max_episode_steps(),
            observation: Some(89 + FUTURE_FRAME * future),
            actions: names(ACTIONS.map(|i| JOINTS[i].name)),
            reward_terms: names(reward.terms()),
            info: names(["joint_error", "position_error", "phase"]),
            metrics: names(["forward", "joint_error", "position_error"]),
            parts: names(PARTS),
            touch_sites: names(TOUCH),
            clips: clips::find(clip),
            follows_clips: *reward != Reward::Sparse,
            memory: if *reward == Reward::Sparse { sparse::MEMORY } else { imitation::MEMORY },
            termination_reward: None,
            ..Facts::default()
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        let all = self.arguments.infos().into_iter();
        all.filter(|info| self.any_clip || info.name != "clip").collect()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(MarathonMan { arguments: self.arguments.with(options), ..*self })
    }

    fn fits(&self, model: &Model) -> Result<(), String> {
        clips::check("clip", &self.arguments.clip, &clips::names(), true)?;
        let most = FUTURE.len();
        if self.arguments.future > most {
            return Err(format!("option future is {}, expected 0 to {most}", self.arguments.future));
        }
        has_joints(model)
    }

    fn reset(&self, start: &mut Start) {
        self.arguments.start.begin(start, DECISION, self.max_episode_steps());
        start.add_noise(ResetNoise::MARATHON);
    }

    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        match self.arguments.control {
            Control::PdRange | Control::Torque | Control::Servo => c.ctrl.copy_from_slice(c.action),
            Control::Pd => {
                let Arguments { action_scale, max_target, .. } = self.arguments;
                let clip = c.reference(1);
                // compensate the servo's damping, which would slow the clip's motion
                let poses = std::array::from_fn(|joint| {
                    clip.qvel(FIRST_QVEL + joint).mul_add(T::lit(DAMPING_TIME), clip.qpos(FIRST_QPOS + joint))
                });
                set_targets(c.ctrl, c.action, action_scale, T::lit(max_target.0), poses);
            }
        }
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        if self.arguments.reward == Reward::Sparse {
            sparse::begin(s, memory);
        }
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        imitation::remember(s, memory);
        if self.arguments.reward == Reward::Sparse {
            sparse::remember(s, memory);
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let (now, next) = (s.reference(0), s.reference(1));
        let turned = turned_to(now.facing());
        let r = s.readings();
        out.group("phase");
        for x in now.phase_angles() {
            out.scalar(x);
        }
        imitation::observe_body(s, &ANATOMY, &turned, out);
        observe_soles(s, out);
        out.group("place_in_clip");
        out.vector(turned(sub(now.position(BUTT), s.position(BUTT))));
        out.group("next_pose");
        for i in 0..JOINTS.len() {
            out.scalar(next.qpos(FIRST_QPOS + i) - r.qpos(FIRST_QPOS + i));
        }
        for (ahead, name) in FUTURE.into_iter().take(self.arguments.future) {
            let later = s.reference(ahead);
            let [forward, _, up] = later.axes(BUTT);
            out.group(name);
            out.vector(turned(sub(later.position(BUTT), s.position(BUTT))));
            out.vector(turned(forward));
            out.vector(turned(up));
            for i in 0..JOINTS.len() {
                out.scalar(later.qpos(FIRST_QPOS + i) - r.qpos(FIRST_QPOS + i));
            }
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        self.arguments.reward.add(s, self.arguments.sharpness.0, terms);
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let far = match self.arguments.reward {
            Reward::Sparse => T::none(),
            Reward::DeepMimic => T::lit(self.arguments.distance.0).lt(imitation::distance(s, &ANATOMY, false)),
            Reward::Paper => reward::too_far(s),
        };
        T::or(far, imitation::fallen(s, &TRUNK))
    }

    #[inline(always)]
    fn truncated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.clip_over()
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(imitation::joint_error(s, &ANATOMY));
        out.scalar(imitation::distance(s, &ANATOMY, true));
        out.scalar(s.reference(0).phase());
    }
}

/// Writes which toes and heels touch the ground.
#[inline(always)]
fn observe_soles<T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
    out.group("touch");
    for i in 0..TOUCH.len() {
        out.scalar(T::masked(T::zero().lt(s.touch_force(i)), T::lit(1.0)));
    }
}
