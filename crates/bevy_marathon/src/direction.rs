//! Movement in a direction of the world, as players and navigation want it: the character turns there by itself.

use crate::axes::to_physics;
use crate::command::AgentCommand;
use crate::marathon::{Marathon, RagdollState};
use crate::pose::heading;
use crate::ragdoll::Anatomy;
use crate::track::Track;
use bevy::prelude::*;
use marathon_envs::CommandRange;
use marathon_motion::wrap_angle;
use marathon_physics::model::JointType;
use std::time::Duration;

/// Turn per angle to the direction, 1/s.
const TURN_GAIN: f64 = 3.0;
/// Part of the character's turn rate that is taken off, against overshoot.
const TURN_DAMPING: f64 = 0.2;
/// Rate at which the aim moves against the angle between direction and velocity, 1/s. Few characters walk exactly where
/// they face.
const DRIFT_GAIN: f64 = 2.0;
/// Largest shift of the aim, rad.
const DRIFT_MAX: f64 = 0.5;
/// Speed below which the direction of a velocity is noise, m/s.
const DRIFT_SPEED: f64 = 0.5;
/// Cosine of the angle to the direction at which a character stands still while it turns.
const STOP_COS: f64 = -0.5;
/// Share of the speed ahead that a character must reach sideways to go in any direction without turning.
const SIDEWAYS_SHARE: f64 = 0.5;

/// Moves a [`Ragdoll`](crate::Ragdoll) in a direction of the world. The plugin writes the speed and the turn of its
/// [`AgentCommand`]; the other numbers of the command, such as a jump, stay as they are.
///
/// A character that can only walk ahead turns to the direction, and slows down on the way. One that can walk backward and
/// sideways does not turn. The direction counts for characters whose commands are a speed (m/s) and a turn (rad/s).
///
/// ```no_run
/// # use bevy::prelude::*;
/// # use bevy_marathon::prelude::*;
/// fn walk(mut players: Query<&mut MoveDirection>, camera: Single<&Transform, With<Camera3d>>, stick: Vec2) {
///     for mut player in &mut players {
///         // up is away from the camera
///         player.direction = stick.y * camera.forward().with_y(0.0).normalize_or_zero()
///             + stick.x * camera.right().with_y(0.0).normalize_or_zero();
///     }
/// }
/// ```
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct MoveDirection {
    /// Direction in the world's axes; its height does not count. Its length, up to 1, is the share of the largest speed.
    pub direction: Vec3,
    #[reflect(ignore)]
    aim: Aim,
}

impl MoveDirection {
    /// Movement in a direction, see [`MoveDirection::direction`].
    pub fn new(direction: Vec3) -> Self {
        MoveDirection { direction, aim: Aim::default() }
    }

    /// Whether it moves a character whose command has these numbers: a speed and a turn are among them.
    pub fn moves(ranges: &[CommandRange]) -> bool {
        Steered::of(ranges).is_some()
    }
}

/// State of the character at a decision.
#[derive(Clone, Copy, Debug)]
struct Motion {
    /// Angle of its forward axis along the ground, rad.
    heading: f64,
    /// Change of the heading, rad/s.
    turn: f64,
    /// Velocity along the ground, m/s.
    velocity: [f64; 2],
}

/// Speed ahead, speed to the left and turn, in m/s and rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Course {
    ahead: f64,
    left: f64,
    turn: f64,
}

/// The numbers of a command that move a character.
struct Steered<'a> {
    ahead: &'a CommandRange,
    turn: &'a CommandRange,
    left: Option<&'a CommandRange>,
}

impl<'a> Steered<'a> {
    /// The first speed, the turn, and the second speed; `None` for characters that do not turn.
    fn of(ranges: &'a [CommandRange]) -> Option<Self> {
        let mut speeds = ranges.iter().filter(|range| range.is_speed());
        let (ahead, left) = (speeds.next()?, speeds.next());
        Some(Steered { ahead, turn: ranges.iter().find(|range| range.is_turn())?, left })
    }

    /// The range to the left of a character that goes in any direction without turning.
    fn sideways(&self) -> Option<&'a CommandRange> {
        let enough = SIDEWAYS_SHARE * self.ahead.high;
        self.left.filter(|left| self.ahead.low <= -enough && left.high >= enough && left.low <= -enough)
    }
}

/// Where a character aims.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Aim {
    /// Time of the last decision.
    seen: Duration,
    /// Shift against drift, rad.
    shift: f64,
    /// Heading at the last decision, rad; `None` at first.
    last: Option<f64>,
}

impl Aim {
    /// The course towards a direction: an angle along the ground, rad, and a share of the speed, 0 to 1.
    fn course(&mut self, steered: &Steered<'_>, angle: f64, pace: f64, motion: &Motion, dt: f64) -> Course {
        let [x, y] = motion.velocity;
        let error = wrap_angle(angle + self.shift - motion.heading);
        let straight = steered.sideways().is_some() || error.abs() < DRIFT_MAX;
        if straight && x.hypot(y) > DRIFT_SPEED {
            let drift = wrap_angle(angle - y.atan2(x));
            self.shift = (self.shift + DRIFT_GAIN * drift * dt).clamp(-DRIFT_MAX, DRIFT_MAX);
        }
        if let Some(left) = steered.sideways() {
            let (sin, cos) = error.sin_cos();
            let end = |range: &CommandRange, share: f64| if share > 0.0 { range.high } else { -range.low };
            return Course {
                ahead: pace * end(steered.ahead, cos) * cos,
                left: pace * end(left, sin) * sin,
                turn: 0.0,
            };
        }
        let slower = ((error.cos() - STOP_COS) / (1.0 - STOP_COS)).clamp(0.0, 1.0);
        let turn = TURN_GAIN * error - TURN_DAMPING * motion.turn;
        Course {
            ahead: pace * steered.ahead.high * slower,
            left: 0.0,
            turn: turn.clamp(steered.turn.low, steered.turn.high),
        }
    }
}

/// Writes the commands of characters that move in a direction, once per decision.
pub(crate) fn follow(
    marathon: Res<Marathon>,
    mut ragdolls: Query<(&mut MoveDirection, &mut AgentCommand, &RagdollState, &Anatomy, &Track)>,
) {
    for (mut movement, mut command, key, anatomy, track) in &mut ragdolls {
        let ranges = command.shared_ranges();
        let Some((steered, sample)) = Steered::of(&ranges).zip(marathon.history(key).and_then(|h| h.back())) else {
            continue;
        };
        let direction = movement.direction.with_y(0.0).clamp_length_max(1.0);
        let mut aim = movement.aim;
        let dt = sample.time.saturating_sub(aim.seen).as_secs_f64().min(2.0 * anatomy.dt);
        let heading = heading(&anatomy.model, &sample.qpos);
        let turn = match aim.last {
            Some(last) if dt > 0.0 && !sample.fresh => wrap_angle(heading - last) / dt,
            _ => 0.0,
        };
        if sample.fresh {
            aim.shift = 0.0;
        }
        let course = if direction.length() > 1e-3 {
            let [x, y, _] = to_physics(track.place().rotation.inverse() * direction);
            let free = anatomy.model.joints.iter().find(|joint| joint.kind == JointType::Free);
            let first = free.map_or(0, |joint| joint.dof_adr);
            let velocity = [first, first + 1].map(|i| sample.qvel.get(i).copied().unwrap_or(0.0));
            let motion = Motion { heading, turn, velocity };
            aim.course(&steered, y.atan2(x), f64::from(direction.length()), &motion, dt)
        } else {
            Course { ahead: 0.0, left: 0.0, turn: 0.0 }
        };
        if dt > 0.0 || aim.last.is_none() {
            (aim.seen, aim.last) = (sample.time, Some(heading));
        }
        movement.bypass_change_detection().aim = aim;
        let mut set = |range: &CommandRange, value: f64| {
            let value = value.clamp(range.low, range.high);
            if command.get(&range.name) != range.fit(value) {
                // a number in its range
                let _ = command.set(&range.name, value);
            }
        };
        set(steered.ahead, course.ahead);
        set(steered.turn, course.turn);
        if let Some(left) = steered.sideways() {
            set(left, course.left);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const STILL: Motion = Motion { heading: 0.0, turn: 0.0, velocity: [0.0; 2] };

    fn ranges() -> Vec<CommandRange> {
        let range = |name, low, high, unit| CommandRange::new(name, low..=high, unit);
        vec![range("speed", 0.0, 3.0, "m/s"), range("left", -0.8, 0.8, "m/s"), range("turn", -1.5, 1.5, "rad/s")]
    }

    #[test]
    fn a_walker_turns_first_and_walks_then() {
        let ranges = ranges();
        let steered = Steered::of(&ranges).expect("it turns");
        let course = |angle, pace| Aim::default().course(&steered, angle, pace, &STILL, 0.025);
        assert_eq!(course(0.0, 1.0), Course { ahead: 3.0, left: 0.0, turn: 0.0 });
        assert_eq!(course(0.0, 0.5).ahead, 1.5);
        // behind it: no step, and the short way around
        assert_eq!(course(3.0, 1.0), Course { ahead: 0.0, left: 0.0, turn: 1.5 });
        assert_eq!(course(-3.0, 1.0).turn, -1.5);
        let aside = course(0.3, 1.0);
        assert!(aside.ahead > 2.8 && (aside.turn - 0.9).abs() < 1e-12, "{aside:?}");
        assert!(Steered::of(&ranges[..2]).is_none());
    }

    #[test]
    fn the_aim_moves_against_drift() {
        let ranges = ranges();
        let steered = Steered::of(&ranges).expect("it turns");
        // it faces the direction and goes to the left of it
        let drifting = Motion { velocity: [1.0, 0.2], ..STILL };
        let mut aim = Aim::default();
        for _ in 0..200 {
            aim.course(&steered, 0.0, 1.0, &drifting, 0.025);
        }
        assert_eq!(aim.shift, -DRIFT_MAX);
        let slow = Motion { velocity: [0.1, 0.1], ..STILL };
        let before = aim;
        aim.course(&steered, 0.0, 1.0, &slow, 0.025);
        assert_eq!(aim, before, "at rest a velocity has no direction");
    }

    #[test]
    fn who_can_go_sideways_does_not_turn() {
        let range = |name, high: f64, unit| CommandRange::new(name, -high..=high, unit);
        let ranges = [range("speed", 3.0, "m/s"), range("left", 2.0, "m/s"), range("turn", 1.5, "rad/s")];
        let steered = Steered::of(&ranges).expect("it turns");
        let course = Aim::default().course(&steered, PI / 2.0, 1.0, &STILL, 0.01);
        assert!(course.ahead.abs() < 1e-9 && (course.left - 2.0).abs() < 1e-9 && course.turn == 0.0, "{course:?}");
        assert!((Aim::default().course(&steered, PI, 0.5, &STILL, 0.01).ahead + 1.5).abs() < 1e-9);
    }
}
