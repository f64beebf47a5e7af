//! Skills of Marathon Man besides locomotion: jump and backflip on a button, and getting up after a fall.
//!
//! # Mechanism
//!
//! A skill follows a section of a motion clip. When the skill begins, the clip is placed at the character's position
//! and turned to its heading. The clip's position then follows the character.
//!
//! The memory holds the number of the active skill and a counter of decisions. `Skills::remember` ends and begins
//! skills after each decision:
//!
//! - *Jump* begins on its button while the character stands. Faster than [`RUNNING`], the button starts a *leap*
//!   instead. The jump clip crouches before and after the jump, so a leap follows no clip: the gait continues.
//! - *Backflip* begins on its button once the character is slow enough.
//! - *Getting up* begins when the trunk touches the ground in a skill, or any part but the feet outside one. The
//!   direction in which the butt faces selects the clip.
//!
//! A backflip and getting up first wait at the start of their clip until the body is close to the clip's pose. The wait
//! is at most 2 s for a backflip ([`SETTLING`]) and 0.5 s for getting up ([`LYING`]).

use marathon_physics::lanes::Real;

use super::super::imitation;
use super::body::{ANATOMY, BUTT, TRUNK};
use super::steer::{CLIPS, Steer, on_the_ground};
use crate::agent::{Following, Frame, Senses};

/// A section of a clip.
pub struct Skill {
    /// Name of the clip.
    pub clip: &'static str,
    /// Decisions of the clip at which the skill begins and ends. It also ends at the end of the clip.
    pub rows: [usize; 2],
    /// Weight of the `skill` term of the reward.
    pub worth: f64,
}

/// All skills.
///
/// The jump leaves the ground 10 decisions (0.25 s) after its start and lands after 28. The backflip leaves it after 28
/// and lands after 46, plus the wait. Getting up has a lower weight, so lying earns less than standing. In both of its
/// clips, the person lies still at first and stands still at the end; the sections leave this out.
pub const SKILLS: [Skill; 4] = [
    Skill { clip: "jump", rows: [21, 60], worth: 1.0 },
    Skill { clip: "backflip", rows: [0, 66], worth: 1.0 },
    Skill { clip: "getup_facedown", rows: [8, 100], worth: 0.5 },
    Skill { clip: "getup_faceup", rows: [48, 142], worth: 0.5 },
];
/// How many skills, at the front of the list, start from standing.
pub const FROM_A_STAND: usize = 2;
/// Index of the jump.
pub const JUMP: usize = 0;
/// Index of the backflip.
pub const BACKFLIP: usize = 1;
const FACE_DOWN: usize = FROM_A_STAND;
const FACE_UP: usize = 3;

/// Memory slots of the skills. The first holds the number of the active skill, counted from 1, or 0. The second counts
/// the decisions since the skill began, or since the last one ended.
pub const SLOTS: usize = 2;
/// Shortest and longest wait at the start of a backflip's clip, decisions. The longest wait covers coming to a stop.
const SETTLING: [f64; 2] = [12.0, 80.0];
/// Longest wait at the start of a getting-up clip, decisions.
const LYING: f64 = 20.0;
/// Cosine between the forward axes of the butt and the clip's below which the character lies on another side. Getting
/// up then begins again.
const ON_THAT_SIDE: f64 = 0.2;
/// The side is checked in this many decisions at the start of a clip.
const BEGINNING: f64 = 40.0;
/// Mean distance of the parts from the clip at which an attempt to get up fails and begins again, m.
const LOST: f64 = 0.5;
/// Speed above which the jump button starts a leap, m/s.
const RUNNING: f64 = 1.0;
/// Duration of a leap, decisions.
const LEAPING: f64 = 20.0;
/// Value of the first slot in a leap: the number after those of the skills.
const LEAP: f64 = 1.0 + SKILLS.len() as f64;
/// Shortest pause between two skills, decisions.
const PAUSE: f64 = 10.0;
/// Highest speed at which a backflip begins, m/s.
const SLOW: f64 = 0.4;
/// Lowest height of the butt of a standing character, m.
const UPRIGHT: f64 = 0.55;
/// Height of the butt above which the character counts as up, even before the clip ends, m.
pub const RISEN: f64 = 0.75;
/// Cosine between the butt's up axis and the vertical that this needs.
const ERECT: f64 = 0.8;
/// An attempt to get up fails if the butt is lower than this when the clip is over, m. Otherwise it continues.
const LOW: f64 = 0.4;
/// Conditions for being close to the clip's pose: cosine between the forward axes of the butt, and height difference of
/// the butt, m.
const AS_THE_CLIP: [f64; 2] = [0.8, 0.12];
/// Longest attempt to get up, decisions. After it, the character is stuck and has failed.
const STUCK: f64 = 320.0;

/// Access to the skills' memory slots of an agent.
#[derive(Clone, Copy, Debug)]
pub struct Skills {
    /// The first slot.
    pub slot: usize,
}

impl Skills {
    /// Lanes with an active skill that follows a clip (all but the leap).
    #[inline(always)]
    pub fn on<T: Real>(&self, memory: &[T]) -> T::Mask {
        T::and(T::lit(0.5).lt(memory[self.slot]), T::not(self.leaps(memory)))
    }

    /// Lanes in which the character leaps.
    #[inline(always)]
    pub fn leaps<T: Real>(&self, memory: &[T]) -> T::Mask {
        T::lit(LEAP - 0.5).lt(memory[self.slot])
    }

    /// Lanes in which the character jumps or leaps.
    #[inline(always)]
    pub fn jumps<T: Real>(&self, memory: &[T]) -> T::Mask {
        T::or(self.is(memory, JUMP), self.leaps(memory))
    }

    /// Number of the active skill, counted from 1, or 0. A leap counts as a jump.
    #[inline(always)]
    pub fn number<T: Real>(&self, memory: &[T]) -> T {
        T::select(self.leaps(memory), T::lit(1.0 + JUMP as f64), memory[self.slot])
    }

    /// Lanes in which skill `i` is active.
    #[inline(always)]
    pub fn is<T: Real>(&self, memory: &[T], i: usize) -> T::Mask {
        let (low, high) = (T::lit(i as f64 + 0.5), T::lit(i as f64 + 1.5));
        T::and(low.lt(memory[self.slot]), memory[self.slot].lt(high))
    }

    /// Lanes in which the character is getting up.
    #[inline(always)]
    pub fn rises<T: Real>(&self, memory: &[T]) -> T::Mask {
        T::and(T::lit(FACE_DOWN as f64 + 0.5).lt(memory[self.slot]), T::not(self.leaps(memory)))
    }

    /// Lanes in which getting up has taken too long.
    #[inline(always)]
    pub fn stuck<T: Real>(&self, memory: &[T]) -> T::Mask {
        T::and(self.rises(memory), T::lit(STUCK).lt(memory[self.slot + 1]))
    }

    /// Weight of the active skill in the reward.
    #[inline(always)]
    pub fn worth<T: Real>(&self, memory: &[T]) -> T {
        let mut worth = T::zero();
        for (i, skill) in SKILLS.iter().enumerate() {
            worth += T::masked(self.is(memory, i), T::lit(skill.worth));
        }
        worth
    }

    /// Updates the skills after a decision, given the buttons of the command, 0 or 1. Returns the lanes in which a
    /// skill was active.
    #[inline(always)]
    pub fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T], [jump, backflip]: [T; 2]) -> T::Mask {
        let (slot, half) = (self.slot, T::lit(0.5));
        let (on, rises) = (self.on(memory), self.rises(memory));
        let before: [T; Following::SLOTS] = std::array::from_fn(|i| memory[i]);
        memory[slot + 1] += T::lit(1.0);
        let lasted = memory[slot + 1];

        // advance the clip, 1.5 times as fast for getting up; hold it at its start while waiting
        s.follow(memory);
        let once: [T; Following::SLOTS] = std::array::from_fn(|i| memory[i]);
        s.follow(memory);
        let half_of_lasted = lasted * half;
        let hurries = T::and(rises, T::lit(0.25).lt(half_of_lasted - half_of_lasted.floor()));
        for (i, kept) in once.into_iter().enumerate() {
            memory[i] = T::select(hurries, memory[i], kept);
        }
        let down = self.is(memory, FACE_DOWN);
        let first = |i: usize| T::lit((s.clip_rows(CLIPS.len() + i).start + SKILLS[i].rows[0]) as f64);
        let flips = self.is(memory, BACKFLIP);
        let beginning = T::select(flips, first(BACKFLIP), T::select(down, first(FACE_DOWN), first(FACE_UP)));
        let begins = T::and(T::or(rises, flips), T::not(beginning.lt(before[Following::ROW])));
        let (least, most) = (T::lit(SETTLING[0]), T::select(rises, T::lit(LYING), T::lit(SETTLING[1])));
        let ready = T::or(T::and(self.is_as(s, &before), T::not(lasted.lt(least))), T::not(lasted.lt(most)));
        let waits = T::and(begins, T::not(ready));
        for (i, kept) in before.into_iter().enumerate() {
            memory[i] = T::select(T::or(waits, T::not(on)), kept, memory[i]);
        }

        // skills that end
        let (mut over, mut past) = (T::none(), T::none());
        for (i, skill) in SKILLS.iter().enumerate() {
            let rows = s.clip_rows(CLIPS.len() + i);
            let end = (rows.start + skill.rows[1]).min(rows.end - 1);
            let reached =
                |row: usize| T::and(self.is(memory, i), T::not(memory[Following::ROW].lt(T::lit(row as f64))));
            (over, past) = (T::or(over, reached(end)), T::or(past, reached(rows.end - 1)));
        }
        // in a skill, hands may touch the ground
        let lies = TRUNK.into_iter().fold(T::none(), |lies, part| T::or(lies, s.touched_ground(part)));
        let grounded = T::or(lies, T::and(T::not(on), on_the_ground(s)));
        let height = s.height(BUTT);
        let stands = T::and(T::lit(UPRIGHT).lt(height), T::not(grounded));
        let upright = T::or(stands, T::and(T::not(rises), T::not(grounded)));
        let erect = T::and(T::lit(RISEN).lt(height), T::lit(ERECT).lt(s.up(BUTT)[2]));
        let risen = T::and(rises, T::and(stands, erect));
        let leaps = self.leaps(memory);
        let landed = T::and(leaps, T::not(lasted.lt(T::lit(LEAPING))));
        let ended = T::or(landed, T::and(on, T::or(risen, T::and(over, upright))));

        // skills that begin
        let clip = s.reference_of(memory, 0);
        let lost = T::lit(LOST).lt(imitation::distance_from(s, &clip, &ANATOMY, true));
        let failed = T::or(T::and(past, height.lt(T::lit(LOW))), T::and(lost, T::not(waits)));
        let early = memory[Following::ROW].lt(beginning + T::lit(BEGINNING));
        let rolled = T::and(early, facing_alike(s, &clip).lt(T::lit(ON_THAT_SIDE)));
        let fails = T::and(rises, T::and(T::or(failed, rolled), T::not(risen)));
        let fallen = T::or(T::and(grounded, T::not(rises)), fails);
        let free = T::and(T::and(T::not(T::or(on, leaps)), T::lit(PAUSE).lt(lasted)), stands);
        let wants_flip = T::and(half.lt(backflip), Steer::speed(s).lt(T::lit(SLOW)));
        let turns = T::and(free, wants_flip);
        let jumps = T::and(free, T::and(half.lt(jump), T::not(half.lt(backflip))));
        let on_the_back = T::zero().lt(s.forward(BUTT)[2]);
        let jump = T::select(T::lit(RUNNING).lt(Steer::speed(s)), T::lit(LEAP), T::lit(1.0 + JUMP as f64));
        let wanted = T::select(jumps, jump, T::lit(1.0 + BACKFLIP as f64));
        let rising = T::select(on_the_back, T::lit(1.0 + FACE_UP as f64), T::lit(1.0 + FACE_DOWN as f64));
        let (next, enters) = (T::select(fallen, rising, wanted), T::or(fallen, T::or(jumps, turns)));
        // a repeated attempt to get up keeps its counter
        let again = T::and(rises, fallen);
        memory[slot] = T::select(enters, next, T::select(ended, T::zero(), memory[slot]));
        memory[slot + 1] = T::select(T::or(T::and(enters, T::not(again)), ended), T::zero(), memory[slot + 1]);
        let mut row = T::zero();
        for i in 0..SKILLS.len() {
            row += T::masked(self.is(memory, i), first(i));
        }
        self.enter(s, memory, row, enters);
        self.stay(s, memory);
        on
    }

    /// Places the clip at the character's position and heading. For getting up, the heading is the direction of the
    /// head.
    #[inline(always)]
    fn enter<T: Real>(&self, s: &Senses<T>, memory: &mut [T], row: T, enters: T::Mask) {
        let there = [row, T::zero(), T::zero(), T::zero()];
        let clip = s.reference_of(&there, 0);
        let lies = self.rises(memory);
        let [forward, _, up] = clip.axes(BUTT);
        let along =
            |forward: [T; 3], up: [T; 3]| [T::select(lies, up[0], forward[0]), T::select(lies, up[1], forward[1])];
        let ([a, b], [c, d]) = (along(s.forward(BUTT), s.up(BUTT)), along(forward, up));
        let yaw = (c.mul_add(b, -(d * a))).atan2(c.mul_add(a, d * b));
        for (i, x) in [row, T::zero(), T::zero(), yaw].into_iter().enumerate() {
            memory[i] = T::select(enters, x, memory[i]);
        }
    }

    /// Moves the clip's position to the character's.
    #[inline(always)]
    fn stay<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let on = self.on(memory);
        let ([x, y, _], [u, v, _]) = (s.position(BUTT), s.reference_of(memory, 0).position(BUTT));
        memory[Following::X] += T::masked(on, x - u);
        memory[Following::Y] += T::masked(on, y - v);
    }

    /// Whether the butt's orientation and height are close to the clip's.
    #[inline(always)]
    fn is_as<T: Real>(&self, s: &Senses<T>, following: &[T]) -> T::Mask {
        let clip = s.reference_of(following, 0);
        let apart = (s.position(BUTT)[2] - clip.position(BUTT)[2]).abs();
        T::and(T::lit(AS_THE_CLIP[0]).lt(facing_alike(s, &clip)), apart.lt(T::lit(AS_THE_CLIP[1])))
    }

    /// Ground direction in which vectors are expressed (cosine and sine): the clip's heading in a skill, otherwise the
    /// character's.
    #[inline(always)]
    pub fn facing<T: Real>(&self, s: &Senses<T>, memory: &[T]) -> [T; 2] {
        let (sin, cos) = memory[Following::YAW].sin_cos();
        let (on, [c, d]) = (self.on(memory), s.heading(BUTT));
        [T::select(on, cos, c), T::select(on, sin, d)]
    }
}

/// Cosine between the forward axes of the butt and the clip's butt.
#[inline(always)]
fn facing_alike<T: Real>(s: &Senses<T>, clip: &Frame<'_, T>) -> T {
    let (own, [forward, ..]) = (s.forward(BUTT), clip.axes(BUTT));
    own[0].mul_add(forward[0], own[1].mul_add(forward[1], own[2] * forward[2]))
}

/// Forward axis, up axis and height of a clip's butt.
#[inline(always)]
pub fn carriage<T: Real>(clip: &Frame<'_, T>) -> ([T; 3], [T; 3], T) {
    let [forward, _, up] = clip.axes(BUTT);
    (forward, up, clip.position(BUTT)[2])
}
