//! Sticks and arrow keys tell the character in focus what to do, if its agent takes commands.

use crate::app::keys::{Deed, Do};
use crate::app::show::{Actor, Focus};
use crate::ragdoll::{AgentCommand, Anatomy};
use crate::simulate::RagdollState;
use bevy::input::gamepad::{Gamepad, GamepadAxis};
use bevy::prelude::*;
use bevy_egui::input::EguiWantsInput;
use marathon_envs::CommandRange;

/// Deflection of a stick up to which it counts as released.
const DEAD: f32 = 0.12;

/// Keys that steer; they do nothing else meanwhile.
pub(super) const ARROWS: [KeyCode; 4] = [KeyCode::ArrowUp, KeyCode::ArrowDown, KeyCode::ArrowLeft, KeyCode::ArrowRight];

/// Whether the character in focus takes commands: the left stick and the arrow keys are its own then.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steering(pub bool);

/// Tells the character in focus what left stick and arrow keys say. Once it has been told something, it stays under command
/// until [`Deed::Release`], or until another is in focus.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
pub fn steer(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    pads: Query<&Gamepad>,
    wants: Option<Res<EguiWantsInput>>,
    mut deeds: MessageReader<Do>,
    focus: Res<Focus>,
    mut steering: ResMut<Steering>,
    actors: Query<(Entity, &Actor, &Anatomy, Option<&AgentCommand>), With<RagdollState>>,
) {
    let released = deeds.read().filter(|deed| deed.0 == Deed::Release).count() > 0;
    let typing = wants.is_some_and(|w| w.wants_keyboard_input());
    let deflection = deflection(&pads, (!typing).then_some(&*keys));
    let mut on = false;
    for (entity, actor, anatomy, command) in &actors {
        let ranges = anatomy.spec.as_ref().map_or(&[][..], |spec| &spec.command);
        let mine = actor.0 == focus.0 && !ranges.is_empty();
        on |= mine;
        if !mine || released {
            if command.is_some() {
                commands.entity(entity).remove::<AgentCommand>();
            }
        } else if command.is_some() || deflection != [0.0; 2] {
            let wanted = AgentCommand(Some(told(ranges, deflection)));
            if command != Some(&wanted) {
                commands.entity(entity).insert(wanted);
            }
        }
    }
    steering.set_if_neq(Steering(on));
}

/// How far ahead and to the left sticks and arrow keys are pushed, in [-1, 1]: the farthest of all.
fn deflection(pads: &Query<&Gamepad>, keys: Option<&ButtonInput<KeyCode>>) -> [f32; 2] {
    let key = |[plus, minus]: [KeyCode; 2]| {
        let pressed = |key| f32::from(keys.is_some_and(|keys| keys.pressed(key)));
        pressed(plus) - pressed(minus)
    };
    let [up, down, left, right] = ARROWS;
    let mut most = [key([up, down]), key([left, right])];
    for pad in pads {
        let axes = [(GamepadAxis::LeftStickY, 1.0), (GamepadAxis::LeftStickX, -1.0)];
        for (most, (axis, sign)) in most.iter_mut().zip(axes) {
            let x = sign * alive(pad.get(axis).unwrap_or(0.0));
            if x.abs() > most.abs() {
                *most = x;
            }
        }
    }
    most
}

/// A stick's deflection without its dead zone, beyond which it begins at 0.
fn alive(x: f32) -> f32 {
    ((x.abs() - DEAD) / (1.0 - DEAD)).clamp(0.0, 1.0) * x.signum()
}

/// The command of a deflection, ahead and to the left. A released stick means rest, the ends of a stick those of the range.
///
/// * Up and down are the speed of whoever turns; left and right are the turn.
/// * For whoever does not turn, such as a figure in a plane, right and left are the speed. Up is the button, if the command has
///   one: a number from 0 to 1 without a unit. Otherwise up and down are the speed, too.
/// * Where no number is in m/s, up and down are the first number, left and right the second.
fn told(ranges: &[CommandRange], deflection: [f32; 2]) -> Vec<f64> {
    let [ahead, left] = deflection.map(f64::from);
    let number_of = |is: fn(&CommandRange) -> bool| ranges.iter().position(is);
    let kinds = [CommandRange::is_speed, CommandRange::is_turn, CommandRange::is_button].map(number_of);
    let mut pushed = vec![0.0; ranges.len()];
    match kinds {
        [Some(speed), None, Some(button)] => {
            pushed[speed] = -left;
            pushed[button] = f64::from(u8::from(ahead > 0.5));
        }
        [Some(speed), None, None] => pushed[speed] = if left.abs() > ahead.abs() { -left } else { ahead },
        [Some(speed), Some(turn), _] => (pushed[speed], pushed[turn]) = (ahead, left),
        _ => pushed.iter_mut().zip([ahead, left]).for_each(|(number, x)| *number = x),
    }
    let number = |(range, x): (&CommandRange, f64)| {
        let end = if x > 0.0 { range.high } else { range.low };
        (range.rest() + (end - range.rest()) * x.abs()).clamp(range.low, range.high)
    };
    ranges.iter().zip(pushed).map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stick_reaches_the_whole_range_and_rests_at_its_rest() {
        let ranges = [
            CommandRange::new("speed", -1.0..=3.0, "m/s"),
            CommandRange::new("turn", -2.0..=2.0, "rad/s"),
            CommandRange::new("height", 0.5..=1.0, "m"),
        ];
        for (deflection, expected) in [
            ([0.0, 0.0], [0.0, 0.0, 0.5]),
            ([1.0, -1.0], [3.0, -2.0, 0.5]),
            ([-1.0, 1.0], [-1.0, 2.0, 0.5]),
            ([0.5, 0.25], [1.5, 0.5, 0.5]),
            ([-0.5, 0.0], [-0.5, 0.0, 0.5]),
        ] {
            assert_eq!(told(&ranges, deflection), expected);
        }
        // a range without zero rests at its nearer end
        assert_eq!(told(&ranges[2..], [-1.0, 0.0]), [0.5]);
        assert_eq!(told(&ranges[2..], [1.0, 0.0]), [1.0]);
    }

    #[test]
    fn a_figure_in_a_plane_goes_where_the_stick_points_and_jumps_when_it_is_up() {
        let velocity = CommandRange::new("velocity", -4.0..=4.0, "m/s");
        let jump = CommandRange::new("jump", 0.0..=1.0, "");
        for (deflection, expected) in [
            ([0.0, 0.0], [0.0, 0.0]),
            // to the right is forward
            ([0.0, -1.0], [4.0, 0.0]),
            ([0.4, 0.5], [-2.0, 0.0]),
            ([1.0, -0.5], [2.0, 1.0]),
            ([-1.0, 0.0], [0.0, 0.0]),
        ] {
            assert_eq!(told(&[velocity.clone(), jump.clone()], deflection), expected, "{deflection:?}");
        }
        for (deflection, expected) in [([1.0, 0.0], 4.0), ([0.0, -1.0], 4.0), ([-0.5, 0.25], -2.0), ([0.25, 0.5], -2.0)]
        {
            assert_eq!(told(std::slice::from_ref(&velocity), deflection), [expected], "{deflection:?}");
        }
    }

    #[test]
    fn what_a_released_stick_still_says_is_not_heard() {
        assert_eq!([0.0, 0.1, -0.12].map(alive).map(f32::abs), [0.0; 3]);
        assert!([1.0, -1.0] == [1.0, -1.0].map(alive) && alive(0.13) > 0.0 && alive(0.13) < 0.02);
    }
}
