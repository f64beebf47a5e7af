//! The adversary of a figure that obeys: a second role that chooses the commands, and earns what the figure does not do.
//!
//! It is the original's experiment 003. It decides every 100 decisions, 400 physics steps, and its command is observed a decision
//! later. It earns abs(T - C) / (4 m/s) at every decision, and 10 for a fall. The original's saw T and C alone; a command is hard to
//! obey for a figure that is in the midst of something, so this one sees the torso and the feet, too.

use marathon_physics::lanes::Real;

use super::{Controller, FASTEST, Figure, Input};
use crate::agent::{Obs, RoleFacts, Senses, Terms, names};

/// Names of the roles.
const RUNNER: &str = "runner";
const COMMANDER: &str = "commander";
/// Actuators of the commander, its part of the observation, and its terms of the reward.
const ACTIONS: [&str; 2] = ["told_velocity", "told_jump"];
const SEEN: &str = "obedience";
pub(super) const TERMS: [&str; 2] = ["disobedience", "felled"];
/// Decisions for which a command holds.
const HOLDS: usize = 100;
/// Action from which on a button is pressed.
const PRESSED: f64 = 0.2;
/// Worth of a fall.
const FELLED: f64 = 10.0;

/// Slots of the memory behind the velocities: the command that the figure has observed, the one that it observes next, and
/// decisions until the commander decides again.
pub(super) const PRESENT: usize = super::MEMORY;
pub(super) const NEXT: usize = PRESENT + 2;
const LEFT: usize = NEXT + 2;
pub(super) const MEMORY: usize = LEFT + 1;

/// Actuators of the commander.
pub(super) fn actions(input: Input) -> &'static [&'static str] {
    match input {
        Input::Discrete => &ACTIONS,
        Input::Continuous => &ACTIONS[..1],
    }
}

/// The two roles, with the actions, observations and terms of the figure.
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

/// A decision has been made: what was told becomes what is obeyed, and the commander's action what is told.
#[inline(always)]
pub(super) fn remember<F: Figure, T: Real>(controller: &Controller<F>, s: &Senses<T>, memory: &mut [T]) {
    let (zero, one) = (T::zero(), T::lit(1.0));
    memory.copy_within(NEXT..NEXT + 2, PRESENT);
    let action = s.action(F::MOTORS);
    memory[NEXT] = match controller.arguments.input {
        Input::Discrete => {
            let right = T::masked(T::lit(PRESSED).lt(action), one);
            (right - T::masked(action.lt(T::lit(-PRESSED)), one)) * T::lit(FASTEST)
        }
        Input::Continuous => action * T::lit(FASTEST),
    };
    memory[NEXT + 1] = match controller.arguments.input {
        Input::Discrete => T::masked(T::lit(PRESSED).lt(s.action(F::MOTORS + 1)), one),
        Input::Continuous => zero,
    };
    let due = memory[LEFT].lt(T::lit(1.5));
    memory[LEFT] = T::select(due, T::lit(HOLDS as f64), memory[LEFT] - one);
}

/// An episode begins: the figure is told nothing as yet, and the commander decides at once.
#[inline(always)]
pub(super) fn begin<T: Real>(memory: &mut [T]) {
    memory[LEFT] = T::lit(HOLDS as f64);
}

/// Lanes in which the commander decides now.
#[inline(always)]
pub(super) fn decides<T: Real>(s: &Senses<T>) -> T::Mask {
    T::lit(HOLDS as f64 - 0.5).lt(s.memory(LEFT))
}

/// What the commander sees: the command, the mean velocity, m/s; height of the torso, m, its velocity along z, m/s, its forward
/// axis; whether each foot touches the ground.
#[inline(always)]
pub(super) fn observe<F: Figure, T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
    let ([fx, _, fz], [_, _, vz]) = (s.forward(F::TORSO), s.linear_velocity(F::TORSO));
    out.group(SEEN);
    [s.memory(NEXT), s.memory(NEXT + 1), super::mean_velocity(s), s.height(F::TORSO), vz, fx, fz]
        .into_iter()
        .for_each(|x| out.scalar(x));
    out.touch_sensors(s);
}

/// What the commander earns: for how far the velocity is off, m/s, and for a fall.
#[inline(always)]
pub(super) fn add_terms<T: Real>(off: T, fallen: T::Mask, terms: &mut Terms<T>) {
    terms.add(TERMS[0], 1.0 / FASTEST, off);
    terms.add(TERMS[1], FELLED, T::masked(fallen, T::lit(1.0)));
}
