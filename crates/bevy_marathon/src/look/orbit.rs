//! How a follow camera moves: what it sees of its target, and what it remembers.
//!
//! A half-life is the time in which half of a difference is left.

use crate::axes::{to_game, yaw_of};
use crate::look::obstacle::Obstacles;
use crate::ragdoll::{Anatomy, Episode};
use bevy::prelude::*;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, LN_2};

/// Half-lives of the point that it looks at, level and upward, s. The upward one is longer: a gait's bounce must not shake it.
const PIVOT: [f32; 2] = [0.06, 0.25];
/// Half-life of turns, s.
const TURN: f32 = 0.04;
/// Half-lives of the target's velocity, and of what depends on its speed, s.
const VELOCITY: f32 = 0.3;
const SPEED: f32 = 0.5;
/// Speed of a full run, m/s, and what the distance is multiplied by then.
const FULL_RUN: f32 = 4.0;
const FARTHER: f32 = 1.21;
/// Height of the point that it looks at above the target's root, as a share of the root's height at rest, and its limits, m: 0.35 m
/// above a person's pelvis.
const ABOVE: f32 = 0.37;
const ABOVE_LIMITS: [f32; 2] = [0.05, 0.5];
/// Share of a jump by which the picture does not rise.
const JUMP_SHARE: f32 = 0.5;
/// Largest rate at which it gets behind its target, rad/s: 45 degrees. It is that at a right angle.
const DRIFT: f32 = FRAC_PI_4;
/// Speeds between which the drift grows from nothing, m/s.
const DRIFT_FROM: [f32; 2] = [1.0, 1.4];
/// Seconds without a turn by the player until it drifts.
const DRIFT_PAUSE: f32 = 1.5;
/// A way in one frame beyond which it jumps, m; or a shorter one at a speed that no body has, m/s.
const CUT: f32 = 12.0;
const CUT_SPEED: [f32; 2] = [1.0, 25.0];
/// Radius of the sphere that must be free around the camera, m.
const RADIUS: f32 = 0.2;
/// Height over the ground around it at which it rises instead of coming closer, m, and how far around, m.
const RISE: [f32; 2] = [0.3, 0.3];
/// Rate at which it goes out again, 1/s: 1 % is left after 0.5 s.
const OUT: f32 = 9.2;
/// Cosine of the tilt up to which a target counts as upright.
const UPRIGHT: f32 = 0.7;

/// The target of a camera in a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    /// Seconds of the picture's own time: a player looks about while the game's stands still.
    pub dt: f32,
    /// Seconds of the game's time.
    pub game_dt: f32,
    /// Angle about the vertical that an upright target faces, rad.
    pub heading: Option<f32>,
    seen: Option<Seen>,
}

#[derive(Clone, Copy, Debug)]
struct Seen {
    target: Entity,
    /// Center of the root body.
    root: Vec3,
    /// Height of the point to look at above it, m.
    above: f32,
    /// No foot is on the ground.
    airborne: bool,
    lead: Vec3,
}

impl Sight {
    /// Nothing to follow.
    pub fn nothing(dt: f32) -> Self {
        Sight { dt, game_dt: dt, heading: None, seen: None }
    }

    /// A character. `ragdoll` is its transform, `part` that of one of its bodies.
    pub fn target(
        &mut self,
        target: Entity,
        anatomy: &Anatomy,
        ragdoll: &Transform,
        episode: Option<&Episode>,
        part: impl Fn(Entity) -> Option<Transform>,
    ) {
        let model = &anatomy.model;
        let body = model.joints.first().map_or(1, |joint| joint.body);
        let Some(root) = anatomy.parts.get(body).and_then(|entity| part(*entity)) else { return };
        // a planar root may begin at any height
        let rest = to_game(model.bodies[body].pos).y.abs();
        let facing = ragdoll.rotation * root.rotation;
        // in a flip, or on the ground, a character faces nowhere
        if (facing * Vec3::Y).y > UPRIGHT {
            let forward = facing * Vec3::X;
            self.heading = Some(yaw_of(forward));
        }
        self.seen = Some(Seen {
            target,
            root: ragdoll.transform_point(root.translation),
            above: (ABOVE * rest).clamp(ABOVE_LIMITS[0], ABOVE_LIMITS[1]),
            airborne: !anatomy.feet.is_empty() && episode.is_some_and(|episode| episode.feet == 0 && !episode.down),
            lead: Vec3::ZERO,
        });
    }

    /// Looks at a point away from the target.
    pub fn lead(&mut self, lead: Vec3) {
        if let Some(seen) = &mut self.seen {
            seen.lead = lead;
        }
    }
}

/// The state of a camera between frames.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Motion {
    /// Whom it followed in the last frame, and where that was. None: the next frame jumps.
    last: Option<(Entity, Vec3)>,
    /// Level velocity of the target, m/s.
    velocity: Vec3,
    /// Speed of the target, as a share of a full run.
    speed: f32,
    /// Height of the target's root above the ground when it last stood, m.
    stands: f32,
    /// Seconds until it turns by itself again.
    pause: f32,
    /// Distance that is free, m.
    free: f32,
    /// Height by which it has risen over the ground, m.
    risen: f32,
}

impl Motion {
    /// The next frame jumps.
    pub fn cut(&mut self) {
        *self = Motion { pause: self.pause, ..default() };
    }

    /// The player has turned it.
    pub fn wait(&mut self) {
        self.pause = DRIFT_PAUSE;
    }

    /// It may turn by itself at once.
    pub fn go_on(&mut self) {
        self.pause = 0.0;
    }

    /// Speed of the target, as a share of a full run.
    pub fn speed(&self) -> f32 {
        self.speed
    }

    /// Factor of the distance at the target's speed.
    pub fn farther(&self) -> f32 {
        1.0 + (FARTHER - 1.0) * self.speed
    }

    /// Angles on the way to others.
    pub fn eased<const N: usize>(&self, mut from: [f32; N], to: [f32; N], dt: f32) -> [f32; N] {
        for (from, to) in from.iter_mut().zip(to) {
            *from += (to - *from) * done(TURN, dt);
        }
        from
    }

    /// Follows the target. Returns the point to look at, which was `focus`; None without a target.
    pub fn track(&mut self, sight: &Sight, focus: Vec3, obstacles: &Obstacles) -> Option<Vec3> {
        let seen = sight.seen?;
        let dt = sight.game_dt;
        let before = self.last.filter(|(target, place)| {
            let step = seen.root.distance(*place);
            *target == seen.target && step < CUT && !(step > CUT_SPEED[0] && step > CUT_SPEED[1] * dt)
        });
        let ground = obstacles.ground(seen.root, RADIUS);
        let height = ground.map_or(0.0, |ground| seen.root.y - ground);
        if before.is_none() {
            self.cut();
        }
        if before.is_none() || !seen.airborne {
            self.stands = height;
        }
        // the ground under a jump, and half of the jump
        let jump = if seen.airborne && ground.is_some() { (height - self.stands).max(0.0) } else { 0.0 };
        let mut to = seen.root + seen.lead + Vec3::Y * (seen.above - JUMP_SHARE * jump);
        if let Some((_, place)) = before {
            if dt > 0.0 {
                let velocity = ((seen.root - place) / dt).with_y(0.0);
                self.velocity += (velocity - self.velocity) * done(VELOCITY, dt);
                let speed = (self.velocity.length() / FULL_RUN).min(1.0);
                self.speed += (speed - self.speed) * done(SPEED, dt);
            }
            let [level, up] = PIVOT.map(|half_life| done(half_life, dt));
            to = focus + (to - focus) * Vec3::new(level, up, level);
        }
        self.last = Some((seen.target, seen.root));
        // from the target, which is in the open, to the point to look at
        let from = Self::above_ground(seen.root, obstacles);
        let way = (to - from).normalize_or_zero();
        let open = from + way * obstacles.cast(from, to, RADIUS);
        Some(Self::above_ground(open, obstacles))
    }

    /// Turn towards behind the target's velocity in a frame, rad, for a camera on the way to an angle `yaw`. One that comes towards
    /// the camera is seen from the front.
    pub fn drift(&mut self, yaw: f32, dt: f32) -> f32 {
        self.pause = (self.pause - dt).max(0.0);
        if self.pause > 0.0 {
            return 0.0;
        }
        let behind = yaw_of(self.velocity) - FRAC_PI_2;
        let [from, to] = DRIFT_FROM;
        let moves = ((self.velocity.length() - from) / (to - from)).clamp(0.0, 1.0);
        DRIFT * moves * (behind - yaw).sin() * dt
    }

    /// The camera's place in a direction from what it looks at, and its distance, m. It rises over ground, and comes closer at
    /// walls: in at once, out slowly.
    pub fn place(&mut self, focus: Vec3, away: Vec3, wanted: f32, obstacles: &Obstacles, dt: f32) -> (Vec3, f32) {
        let out = 1.0 - (-OUT * dt).exp();
        let wish = focus + away * wanted;
        let [height, around] = RISE;
        let rise = obstacles.ground(wish, around).map_or(0.0, |ground| (ground + height - wish.y).max(0.0));
        self.risen = if rise > self.risen { rise } else { self.risen + (rise - self.risen) * out };
        let wish = wish + Vec3::Y * self.risen;
        let free = obstacles.cast(focus, wish, RADIUS);
        // a new camera begins where there is room
        let before = if self.free > 0.0 { self.free } else { free };
        self.free = if free < before { free } else { before + (free - before) * out };
        let way = (wish - focus).normalize_or(away);
        let mut distance = self.free;
        // on the way out it passes posts, but does not stay in one
        let room = 0.5 * RADIUS.min(obstacles.clearance(focus, RADIUS));
        while distance > 0.0 && obstacles.clearance(focus + way * distance, RADIUS) < room {
            distance = (distance - 0.5 * RADIUS).max(0.0);
        }
        (focus + way * distance, distance)
    }

    /// A place, or one above it that the ground does not reach.
    pub fn above_ground(at: Vec3, obstacles: &Obstacles) -> Vec3 {
        let ground = obstacles.ground(at, RADIUS);
        at.with_y(ground.map_or(at.y, |ground| at.y.max(ground + RADIUS + 0.02)))
    }
}

/// Share of a way that is done after some time.
fn done(half_life: f32, dt: f32) -> f32 {
    1.0 - (-LN_2 * dt / half_life).exp()
}
