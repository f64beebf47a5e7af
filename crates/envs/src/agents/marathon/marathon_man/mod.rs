//! Marathon Man: a figure of 82 kg and 21 motors that moves like the person in a motion clip.
//!
//! | observation | content |
//! |---|---|
//! | 0..4 | phase of the clip: sine and cosine of its angle, and of twice that |
//! | 4 | height of the butt, m |
//! | 5..11 | forward and up axis of the butt |
//! | 11..17 | velocity of the butt, m/s, and its angular velocity, rad/s |
//! | 17..38, 38..59 | angles of the 21 joints, rad, and their velocities, rad/s |
//! | 59..65 | toe, toe and heel of the right and of the left foot on the ground, 0 or 1 |
//! | 65..68 | how far the clip's butt is from the agent's own, m |
//! | 68..89 | how far the clip's next angles are from the agent's own, rad |
//! | 30 each | later frames: the clip's butt as seen from the agent's, m, its forward and up axis, angles less the agent's own |
//!
//! Vectors are in the clip's [direction of travel](crate::Frame::facing). Rewards: [`reward`]; what an action does:
//! [`Control`]. The agent fails when its trunk touches the ground, unless the clip has it there, and when it is too far
//! from the clip. The end of a clip that does not loop truncates the episode.

mod body;
pub mod clips;
pub mod reward;
pub mod steer;

use std::sync::Arc;

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use crate::agent::options::OptionValue;
use crate::agent::{
    Agent, Ctrl, Facts, Following, Obs, OptionInfo, OptionSet, Options, ResetNoise, Scale, Senses, Start, Terms, Value,
    names,
};
use crate::any_agent::AnyAgent;

pub use body::Control;
use body::{ACTIONS, BUTT, DAMPING_TIME, FIRST_QPOS, FIRST_QVEL, JOINTS, PARTS, TOUCH, TRUNK, model, parts};
use clips::ClipNames;
pub use reward::Reward;

/// Physics steps per decision: 200 Hz physics, 40 Hz control.
const FRAME_SKIP: usize = 5;
/// 20 seconds.
const MAX_EPISODE_STEPS: usize = 800;
/// How far the center of a part of the trunk may be above the ground in a clip that has it there, m.
const LYING: f64 = 0.16;
/// How far ahead later frames of the clip are, decisions, and what their observations are called.
const FUTURE: [(usize, &str); 3] = [(4, "in_4"), (8, "in_8"), (16, "in_16")];
/// Numbers of such a frame.
const FUTURE_FRAME: usize = 9 + JOINTS.len();
/// Slot of the memory that counts the episode's decisions.
const MADE: usize = Following::SLOTS;
/// Slot of the memory that holds the row where the episode started.
const BEGUN: usize = MADE + 1;
/// Decisions of a second.
const SECOND: usize = 40;
/// An episode that fails in fewer decisions has failed because of where it started.
const EARLY: usize = 2 * SECOND;

/// Where an episode starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartAt {
    /// At any decision of the clip.
    Random,
    /// At its beginning.
    First,
    /// Where it fails most: half of the episodes that follow a failure start where that episode did, if it failed early, or
    /// in the second before it failed; the others start at random.
    Adaptive,
}

const STARTS: [(StartAt, &str); 3] =
    [(StartAt::Random, "random"), (StartAt::First, "first"), (StartAt::Adaptive, "adaptive")];

impl OptionValue for StartAt {
    const EXPECTED: &'static str = "random, first or adaptive";
    fn value(&self) -> Value {
        let known = STARTS.into_iter().find(|(start, _)| start == self);
        known.map_or("random", |(_, name)| name).into()
    }
    fn read(value: &Value) -> Option<Self> {
        STARTS.into_iter().find(|(_, name)| Value::from(*name) == *value).map(|(start, _)| start)
    }
}

crate::options! {
    /// Arguments of Marathon Man.
    pub struct Arguments {
        /// Motion to follow: a clip's name; several, with commas between them, or `all` that are shipped: an episode has one.
        clip: ClipNames = ClipNames("walk".into()),
        /// Reward: `deepmimic` (Peng et al., 2018), or `paper` (Booth and Booth, 2019).
        reward: Reward = Reward::DeepMimic,
        /// What an action does: `pd` moves the target of a servo away from the clip's next pose, `pd_range` is the target
        /// within the joint's range, `torque` a share of the motor's strength, `servo` the target velocity of the original's
        /// drive.
        control: Control = Control::Pd,
        /// Where an episode starts: at `random` decisions of the clip, at its `first`, or more often where it fails: `adaptive`.
        start: StartAt = StartAt::Random,
        /// Mean distance of the parts from where the clip has them that ends an episode, m. With the reward `paper`, a sum of
        /// its first five terms below 0.334 ends it instead.
        distance: Scale = Scale(0.5),
        /// Most that an action of `pd` moves a target, rad.
        reach: Scale = Scale(1.0),
        /// How many later frames of the clip are observed: up to three, 4, 8 and 16 decisions ahead.
        future: usize = 0,
    }
}

/// Marathon Man with a clip.
#[derive(Clone, Debug)]
pub struct MarathonMan {
    id: &'static str,
    summary: &'static str,
    /// Whether the clip is an argument.
    any_clip: bool,
    arguments: Arguments,
}

/// Tasks with a clip of their own: id, clip, and what the figure is to do.
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

/// Where to start in half of the episodes that follow a failure.
fn try_again(start: &mut Start) -> Option<usize> {
    let [row, made, begun] = [Following::ROW, MADE, BEGUN].map(|slot| start.previous[slot] as usize);
    let at_its_end = start.clips().any(|rows| row + 1 == rows.end);
    let failed = made > 0 && made < MAX_EPISODE_STEPS && !at_its_end;
    if !failed || start.random.whole(0, 1) == 0 {
        return None;
    }
    // the lap of a run is shorter than a second: what is before a failure need not be what led to it
    match made < EARLY {
        true => Some(begun),
        false => {
            let before = start.random.whole(0, SECOND);
            Some(start.row_before(row, before))
        }
    }
}

/// Marathon Man with any clip, and with each that comes with the crate.
pub fn all() -> Vec<Arc<dyn AnyAgent>> {
    let any = ("MarathonMan-v0", "walk", "a figure of 21 motors: move as a motion clip does");
    let tasks = [any].into_iter().chain(TASKS).enumerate();
    let agent = |(i, (id, clip, summary)): (usize, (&'static str, &str, &'static str))| {
        let arguments = Arguments { clip: ClipNames(clip.into()), ..Arguments::default() };
        Arc::new(MarathonMan { id, summary, any_clip: i == 0, arguments }) as Arc<dyn AnyAgent>
    };
    tasks.map(agent).chain([Arc::new(steer::Steer::default()) as Arc<dyn AnyAgent>]).collect()
}

/// Whether a model has the figure's joints.
fn has_joints(model: &Model) -> Result<(), String> {
    let expected = JOINTS.each_ref().map(|joint| joint.name);
    let found: Vec<&str> = model.joints.iter().skip(1).map(|joint| joint.name.as_str()).collect();
    match found == expected {
        true => Ok(()),
        false => Err(format!("its model has the joints {found:?}, expected {expected:?}")),
    }
}

impl MarathonMan {
    /// Mean distance of the parts from where the clip has them, m; from the butt's own place, or in the world.
    #[inline(always)]
    fn distance<T: Real>(s: &Senses<T>, from_butt: bool) -> T {
        let clip = s.reference(0);
        let mut gap = [T::zero(); 3];
        if from_butt {
            gap = sub(s.position(BUTT), clip.position(BUTT));
        }
        let mut sum = T::zero();
        for part in parts() {
            sum += norm2(sub(sub(s.position(part), clip.position(part)), gap)).sqrt();
        }
        sum * T::lit(1.0 / PARTS.len() as f64)
    }

    /// Lanes in which a part of the trunk touched the ground although the clip does not have it there.
    #[inline(always)]
    fn fallen<T: Real>(s: &Senses<T>) -> T::Mask {
        let (mut fallen, clip) = (T::none(), s.reference(0));
        for part in TRUNK {
            let upright = T::lit(LYING).lt(clip.lowest(part));
            fallen = T::or(fallen, T::and(upright, s.touched_ground(part)));
        }
        fallen
    }
}

impl Agent for MarathonMan {
    fn facts(&self) -> Facts {
        let Arguments { clip, reward, control, future, .. } = &self.arguments;
        Facts {
            id: self.id.into(),
            summary: self.summary.into(),
            model: model(*control).into(),
            frame_skip: FRAME_SKIP,
            max_episode_steps: MAX_EPISODE_STEPS,
            observation: Some(89 + FUTURE_FRAME * future),
            actions: names(ACTIONS.map(|i| JOINTS[i].name)),
            reward_terms: names(reward.terms()),
            info: names(["joint_error", "position_error", "phase"]),
            metrics: names(["forward", "joint_error", "position_error"]),
            parts: names(PARTS),
            touch_sites: names(TOUCH),
            clips: clip.find(),
            memory: Following::SLOTS + 2,
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
        self.arguments.clip.check()?;
        let most = FUTURE.len();
        if self.arguments.future > most {
            return Err(format!("option future is {}, expected 0 to {most}", self.arguments.future));
        }
        has_joints(model)
    }

    fn reset(&self, start: &mut Start) {
        let again = (self.arguments.start == StartAt::Adaptive).then(|| try_again(start)).flatten();
        let row = again.unwrap_or_else(|| {
            let clips: Vec<_> = start.clips().collect();
            let clip = if clips.len() == 1 { 0 } else { start.random.whole(0, clips.len() - 1) };
            let rows = clips[clip].clone();
            match self.arguments.start {
                StartAt::First => rows.start,
                _ => start.random.whole(rows.start, rows.end - 1),
            }
        });
        start.start_in_clip(row);
        start.memory[BEGUN] = row as f64;
        start.add_noise(ResetNoise::MARATHON);
    }

    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        match self.arguments.control {
            Control::PdRange | Control::Torque | Control::Servo => c.ctrl.copy_from_slice(c.action),
            Control::Pd => {
                let reach = T::lit(self.arguments.reach.0);
                for (i, joint) in ACTIONS.into_iter().enumerate() {
                    let clip = c.reference(1);
                    // the servo's damping, which slows every motion, is not to slow the clip's own
                    let target =
                        clip.qvel(FIRST_QVEL + joint).mul_add(T::lit(DAMPING_TIME), clip.qpos(FIRST_QPOS + joint));
                    c.ctrl[i] = c.action[i].mul_add(reach, target);
                }
            }
        }
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        s.follow(memory);
        memory[MADE] += T::lit(1.0);
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
        observe_body(s, &turned, out);
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
        self.arguments.reward.add(s, terms);
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let far = match self.arguments.reward {
            Reward::DeepMimic => T::lit(self.arguments.distance.0).lt(Self::distance(s, false)),
            Reward::Paper => reward::too_far(s),
        };
        T::or(far, Self::fallen(s))
    }

    #[inline(always)]
    fn truncated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.clip_over()
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let (clip, r) = (s.reference(0), s.readings());
        let mut error = T::zero();
        for i in 0..JOINTS.len() {
            error += (r.qpos(FIRST_QPOS + i) - clip.qpos(FIRST_QPOS + i)).abs();
        }
        out.scalar(error * T::lit(1.0 / JOINTS.len() as f64));
        out.scalar(Self::distance(s, true));
        out.scalar(clip.phase());
    }
}

/// Puts vectors into axes of which x is a direction along the ground, cosine and sine of its angle, and z is up.
#[inline(always)]
fn turned_to<T: Real>([cos, sin]: [T; 2]) -> impl Fn([T; 3]) -> [T; 3] {
    move |[x, y, z]| [sin.mul_add(y, cos * x), sin.neg_mul_add(x, cos * y), z]
}

/// Where the butt is and how the joints are, with velocities: the parts of an observation that every task of his has.
#[inline(always)]
fn observe_body<T: Real>(s: &Senses<T>, turned: &impl Fn([T; 3]) -> [T; 3], out: &mut Obs<T>) {
    let r = s.readings();
    out.group("height");
    out.scalar(s.height(BUTT));
    out.group("orientation");
    out.vector(turned(s.forward(BUTT)));
    out.vector(turned(s.up(BUTT)));
    out.group("velocity");
    out.vector(turned(s.linear_velocity(BUTT)));
    out.group("angular_velocity");
    out.vector(turned(s.angular_velocity(BUTT)));
    out.group("joint_positions");
    for i in 0..JOINTS.len() {
        out.scalar(r.qpos(FIRST_QPOS + i));
    }
    out.group("joint_velocities");
    for i in 0..JOINTS.len() {
        out.scalar(r.qvel(FIRST_QVEL + i));
    }
}

/// Which toes and heels are on the ground.
#[inline(always)]
fn observe_soles<T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
    out.group("touch");
    for i in 0..TOUCH.len() {
        out.scalar(T::masked(T::zero().lt(s.touch_force(i)), T::lit(1.0)));
    }
}

#[inline(always)]
fn sub<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Square of a vector's length.
#[inline(always)]
fn norm2<T: Real>([x, y, z]: [T; 3]) -> T {
    x.mul_add(x, y.mul_add(y, z * z))
}
