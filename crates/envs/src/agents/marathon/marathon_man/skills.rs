//! What Marathon Man does beside going: he jumps and turns over backward on a button, and gets up after a fall.
//!
//! A skill is a piece of a clip. It begins where he is and as he faces; its place follows him. To get up or to turn over, he first
//! becomes as the clip is at its beginning, for as long as he needs, up to [`SETTLING`]. A jump on the run is no piece of a clip,
//! whose person crouches first and lands in a crouch: it is a leap, in which his gait goes on.

use marathon_physics::lanes::Real;

use super::super::imitation;
use super::body::{ANATOMY, BUTT, TRUNK};
use super::steer::{CLIPS, Steer, on_the_ground};
use crate::agent::{Following, Frame, Senses};

/// A piece of a clip.
pub struct Skill {
    /// The clip.
    pub clip: &'static str,
    /// Decisions of the clip from its beginning, at which the skill begins and ends; it ends at the clip's end if that is first.
    pub rows: [usize; 2],
    /// Part of the reward.
    pub worth: f64,
}

/// All of them. The jump leaves the ground 10 decisions after its beginning, 0.25 s, and is back on it after 28; the backflip
/// after 28 and 46, and what he waits. Who lies earns less than who stands. The person of the clips first lies for a while, and
/// stands for another at the end.
pub const SKILLS: [Skill; 4] = [
    Skill { clip: "jump", rows: [21, 60], worth: 1.0 },
    Skill { clip: "backflip", rows: [0, 66], worth: 1.0 },
    Skill { clip: "getup_facedown", rows: [8, 100], worth: 0.5 },
    Skill { clip: "getup_faceup", rows: [48, 142], worth: 0.5 },
];
/// How many of them, the first, begin in a stand.
pub const FROM_A_STAND: usize = 2;
/// Number of the jump.
pub const JUMP: usize = 0;
/// Number of the backflip.
pub const BACKFLIP: usize = 1;
const FACE_DOWN: usize = FROM_A_STAND;
const FACE_UP: usize = 3;

/// Slots of the memory that the skills have: which one, counted from 1, or 0; and for how many decisions it has lasted, or
/// for how many there has been none.
pub const SLOTS: usize = 2;
/// Shortest and longest that he takes to be as the clip is at its beginning, decisions; he comes to a stop for longer than he lies.
const SETTLING: [f64; 2] = [12.0, 80.0];
const LYING: f64 = 20.0;
/// If his butt faces elsewhere than the clip's in the clip's first second, he lies on another side and begins again: cosine between
/// the forward axes, and decisions of the clip.
const ON_THAT_SIDE: f64 = 0.2;
const BEGINNING: f64 = 40.0;
/// Mean distance of the parts from the clip's at which an attempt to get up has failed and he begins again, m.
const LOST: f64 = 0.5;
/// Who is faster than this leaps when told to jump, m/s, and for how long, decisions.
const RUNNING: f64 = 1.0;
const LEAPING: f64 = 20.0;
/// What the first slot says of a leap: the number behind those of the skills.
const LEAP: f64 = 1.0 + SKILLS.len() as f64;
/// Decisions from one skill to the next.
const PAUSE: f64 = 10.0;
/// Fastest that he begins a backflip, m/s, and lowest that his butt is when he stands, m.
const SLOW: f64 = 0.4;
const UPRIGHT: f64 = 0.55;
/// He has got up before the clip has: height of his butt, m, and cosine between its up axis and the vertical.
pub const RISEN: f64 = 0.75;
const ERECT: f64 = 0.8;
/// Whoever is higher when the clip is over goes on getting up, m.
const LOW: f64 = 0.4;
/// How nearly he is as the clip is: cosine between the forward axes of the butt, and difference of its heights, m.
const AS_THE_CLIP: [f64; 2] = [0.8, 0.12];
/// Who takes so many decisions cannot get up.
const STUCK: f64 = 320.0;

/// The skills' variables of an agent, `slot` being the first of them.
#[derive(Clone, Copy, Debug)]
pub struct Skills {
    /// Its slot.
    pub slot: usize,
}

impl Skills {
    /// Lanes in which a skill is on that is a piece of a clip.
    #[inline(always)]
    pub fn on<T: Real>(&self, memory: &[T]) -> T::Mask {
        T::and(T::lit(0.5).lt(memory[self.slot]), T::not(self.leaps(memory)))
    }

    /// Lanes in which he jumps on the run.
    #[inline(always)]
    pub fn leaps<T: Real>(&self, memory: &[T]) -> T::Mask {
        T::lit(LEAP - 0.5).lt(memory[self.slot])
    }

    /// Lanes in which he jumps, standing or on the run.
    #[inline(always)]
    pub fn jumps<T: Real>(&self, memory: &[T]) -> T::Mask {
        T::or(self.is(memory, JUMP), self.leaps(memory))
    }

    /// Number of the skill, counted from 1, or 0.
    #[inline(always)]
    pub fn number<T: Real>(&self, memory: &[T]) -> T {
        T::select(self.leaps(memory), T::lit(1.0 + JUMP as f64), memory[self.slot])
    }

    /// Lanes in which skill number `i` is on.
    #[inline(always)]
    pub fn is<T: Real>(&self, memory: &[T], i: usize) -> T::Mask {
        let (low, high) = (T::lit(i as f64 + 0.5), T::lit(i as f64 + 1.5));
        T::and(low.lt(memory[self.slot]), memory[self.slot].lt(high))
    }

    /// Lanes in which he gets up.
    #[inline(always)]
    pub fn rises<T: Real>(&self, memory: &[T]) -> T::Mask {
        T::and(T::lit(FACE_DOWN as f64 + 0.5).lt(memory[self.slot]), T::not(self.leaps(memory)))
    }

    /// Lanes in which he cannot get up.
    #[inline(always)]
    pub fn stuck<T: Real>(&self, memory: &[T]) -> T::Mask {
        T::and(self.rises(memory), T::lit(STUCK).lt(memory[self.slot + 1]))
    }

    /// What the present skill's part of the reward is.
    #[inline(always)]
    pub fn worth<T: Real>(&self, memory: &[T]) -> T {
        let mut worth = T::zero();
        for (i, skill) in SKILLS.iter().enumerate() {
            worth += T::masked(self.is(memory, i), T::lit(skill.worth));
        }
        worth
    }

    /// A decision has been made, under a command with these buttons, 0 or 1. Returns the lanes in which a skill was on.
    #[inline(always)]
    pub fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T], [jump, backflip]: [T; 2]) -> T::Mask {
        let (slot, half) = (self.slot, T::lit(0.5));
        let (on, rises) = (self.on(memory), self.rises(memory));
        let before: [T; Following::SLOTS] = std::array::from_fn(|i| memory[i]);
        memory[slot + 1] += T::lit(1.0);
        let lasted = memory[slot + 1];

        // the clip goes on, half as fast again for who gets up, but not before he lies as it does
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

        // what ends
        let (mut over, mut past) = (T::none(), T::none());
        for (i, skill) in SKILLS.iter().enumerate() {
            let rows = s.clip_rows(CLIPS.len() + i);
            let end = (rows.start + skill.rows[1]).min(rows.end - 1);
            let reached =
                |row: usize| T::and(self.is(memory, i), T::not(memory[Following::ROW].lt(T::lit(row as f64))));
            (over, past) = (T::or(over, reached(end)), T::or(past, reached(rows.end - 1)));
        }
        // hands may touch the ground in a skill
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

        // what begins
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
        // an attempt after a failed one counts on
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

    /// Puts the clip where he is, facing as he does; who lies faces where his head is.
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

    /// Lets the clip's place follow him.
    #[inline(always)]
    fn stay<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let on = self.on(memory);
        let ([x, y, _], [u, v, _]) = (s.position(BUTT), s.reference_of(memory, 0).position(BUTT));
        memory[Following::X] += T::masked(on, x - u);
        memory[Following::Y] += T::masked(on, y - v);
    }

    /// Whether he is as a clip is.
    #[inline(always)]
    fn is_as<T: Real>(&self, s: &Senses<T>, following: &[T]) -> T::Mask {
        let clip = s.reference_of(following, 0);
        let apart = (s.position(BUTT)[2] - clip.position(BUTT)[2]).abs();
        T::and(T::lit(AS_THE_CLIP[0]).lt(facing_alike(s, &clip)), apart.lt(T::lit(AS_THE_CLIP[1])))
    }

    /// The direction along the ground that vectors of a skill are seen from: cosine and sine.
    #[inline(always)]
    pub fn facing<T: Real>(&self, s: &Senses<T>, memory: &[T]) -> [T; 2] {
        let (sin, cos) = memory[Following::YAW].sin_cos();
        let (on, [c, d]) = (self.on(memory), s.heading(BUTT));
        [T::select(on, cos, c), T::select(on, sin, d)]
    }
}

/// Cosine between the forward axis of his butt and a clip's.
#[inline(always)]
fn facing_alike<T: Real>(s: &Senses<T>, clip: &Frame<'_, T>) -> T {
    let (own, [forward, ..]) = (s.forward(BUTT), clip.axes(BUTT));
    own[0].mul_add(forward[0], own[1].mul_add(forward[1], own[2] * forward[2]))
}

/// How a clip holds the butt: its height, forward axis and up axis.
#[inline(always)]
pub fn carriage<T: Real>(clip: &Frame<'_, T>) -> ([T; 3], [T; 3], T) {
    let [forward, _, up] = clip.axes(BUTT);
    (forward, up, clip.position(BUTT)[2])
}
