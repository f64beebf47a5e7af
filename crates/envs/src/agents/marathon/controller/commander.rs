//! The adversary of a controlled figure: a second role that chooses the commands and earns the velocity error.
//!
//! This is the original's experiment 003. The adversary acts every 100 decisions (400 physics steps), and its command
//! is observed one decision later. It earns abs(T - C) / (4 m/s) at every decision, and 10 for a fall, where T is the
//! commanded and C the mean velocity. The original's adversary observed T and C only. A command is harder to follow in
//! the middle of a movement, so this one also observes the torso and the feet.

use marathon_physics::lanes::Real;

use super::{Controller, Figure, Input, MAX_SPEED};
use crate::agent::{Obs, RoleFacts, Senses, Terms, names};

/// Names of the roles.
const RUNNER: &str = "runner";
const COMMANDER: &str = "commander";
/// Actuators of the commander.
const ACTIONS: [&str; 2] = ["told_velocity", "told_jump"];
/// The commander's group of the observation.
const SEEN: &str = "obedience";
/// The commander's terms of the reward.
pub(super) const TERMS: [&str; 2] = ["disobedience", "felled"];
/// Duration of a command, decisions.
const HOLDS: usize = 100;
/// Action above which a button counts as pressed.
const PRESSED: f64 = 0.2;
/// Reward for a fall.
const FELLED: f64 = 10.0;

/// Slots of the memory after the controller's: the command that the figure has observed.
pub(super) const PRESENT: usize = super::MEMORY;
/// Slots of the command that the figure observes next.
pub(super) const NEXT: usize = PRESENT + 2;
/// Slot of the decisions until the commander acts again.
const LEFT: usize = NEXT + 2;
pub(super) const MEMORY: usize = LEFT + 1;

/// Actuators of the commander.
pub(super) fn actions(input: Input) -> &'static [&'static str] {
    match input {
        Input::Discrete => &ACTIONS,
        Input::Continuous => &ACTIONS[..1],
    }
}

/// The two roles. The figure keeps its actions, observations and terms.
pub(super) fn roles(input: Input, own: Vec<String>, observations: &[&str], terms: &[&str]) -> Vec<RoleFacts> {
    let runner = RoleFacts {
        name: RUNNER.into(),
        observations: names(observations),
        actions: own,
        reward_terms: names(terms),
        intermittent: false,
    };
    let commander = RoleFacts {
        name: COMMANDER.into(),
        observations: names([SEEN]),
        actions: names(actions(input)),
        reward_terms: names(TERMS),
        intermittent: true,
    };
    vec![runner, commander]
}

/// Updates the memory after a decision: the next command becomes the present one, and the commander's action becomes
/// the next one.
#[inline(always)]
pub(super) fn remember<F: Figure, T: Real>(controller: &Controller<F>, s: &Senses<T>, memory: &mut [T]) {
    let (zero, one) = (T::zero(), T::lit(1.0));
    memory.copy_within(NEXT..NEXT + 2, PRESENT);
    let action = s.action(F::MOTORS);
    memory[NEXT] = match controller.arguments.input {
        Input::Discrete => {
            let right = T::masked(T::lit(PRESSED).lt(action), one);
            (right - T::masked(action.lt(T::lit(-PRESSED)), one)) * T::lit(MAX_SPEED)
        }
        Input::Continuous => action * T::lit(MAX_SPEED),
    };
    memory[NEXT + 1] = match controller.arguments.input {
        Input::Discrete => T::masked(T::lit(PRESSED).lt(s.action(F::MOTORS + 1)), one),
        Input::Continuous => zero,
    };
    let due = memory[LEFT].lt(T::lit(1.5));
    memory[LEFT] = T::select(due, T::lit(HOLDS as f64), memory[LEFT] - one);
}

/// Initializes the memory at the start of an episode: there is no command yet, and the commander acts at once.
#[inline(always)]
pub(super) fn begin<T: Real>(memory: &mut [T]) {
    memory[LEFT] = T::lit(HOLDS as f64);
}

/// Lanes in which the commander acts now.
#[inline(always)]
pub(super) fn decides<T: Real>(s: &Senses<T>) -> T::Mask {
    T::lit(HOLDS as f64 - 0.5).lt(s.memory(LEFT))
}

/// Writes the commander's observation: command; mean velocity, m/s; height of the torso, m; its velocity along z, m/s;
/// its forward axis; ground contact of each foot.
#[inline(always)]
pub(super) fn observe<F: Figure, T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
    let ([fx, _, fz], [_, _, vz]) = (s.forward(F::TORSO), s.linear_velocity(F::TORSO));
    out.group(SEEN);
    [s.memory(NEXT), s.memory(NEXT + 1), super::mean_velocity(s), s.height(F::TORSO), vz, fx, fz]
        .into_iter()
        .for_each(|x| out.scalar(x));
    out.touch_sensors(s);
}

/// Adds the commander's reward for the velocity error `off`, m/s, and for a fall.
#[inline(always)]
pub(super) fn add_terms<T: Real>(off: T, fallen: T::Mask, terms: &mut Terms<T>) {
    terms.add(TERMS[0], 1.0 / MAX_SPEED, off);
    terms.add(TERMS[1], FELLED, T::masked(fallen, T::lit(1.0)));
}
