//! Sticks, triggers and keys command the character in focus, if its agent takes commands. The deflections of a device pass its
//! [mapping](Mapping). A [frame](SteeringFrame) says which way a stick points.

use crate::app::input::actions::{Action, ActionPressed, KeysFor, Steer, Steering};
use crate::app::input::bindings::Bindings;
use crate::app::input::read::ReadSet;
use crate::app::input::response::{Mapping, Mappings};
use crate::app::mode::Mode;
use crate::app::stage::actors::{Actor, Focus};
use crate::app::stage::course::PlayerRole;
use crate::app::stage::loaded::LoadedPolicy;
use crate::app::stage::scenario::Scenario;
use bevy::input::InputSystems;
use bevy::input::gamepad::{Gamepad, GamepadAxis};
use bevy::prelude::*;
use bevy_egui::input::EguiWantsInput;
use bevy_marathon::look::{CameraMode, FollowCamera};
use bevy_marathon::{AgentCommand, Anatomy, Ground, MoveDirection, RagdollState, Restart};
use clap::ValueEnum;
use marathon_envs::CommandRange;

/// The frame of a stick, for characters that turn.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SteeringFrame {
    /// Up is away from the camera: the character goes where the stick points in the picture. On courses, and for characters that
    /// do not turn, as with `character`.
    #[default]
    Camera,
    /// Up is the character's speed, left its turn.
    Character,
}

/// Pace of the keys without [`Steer::Run`].
const WALK: f32 = 0.5;

/// Deflection ahead, to the left, and aside to the left, in [-1, 1], and two buttons, 0 or 1.
type Deflection = [f32; 5];
/// The number of entries for sticks and triggers.
const STICKS: usize = 3;
/// No deflection.
const REST: Deflection = [0.0; 5];

/// The present deflections of the gamepads, in the order in which they were connected, and of the keyboard.
#[derive(Default)]
pub struct Deflections {
    pads: Vec<(Entity, Deflection)>,
    keys: Deflection,
}

impl Deflections {
    /// Takes in the present state of the devices.
    fn update(
        &mut self,
        pads: &Query<(Entity, &Gamepad)>,
        of_pad: impl Fn(&Gamepad) -> Deflection,
        keys: Deflection,
        mappings: &Mappings,
        dt: f32,
    ) {
        let update = |last: &mut Deflection, now: Deflection, mapping: &Mapping| {
            *last = [0, 1, 2, 3, 4].map(|i| if i < STICKS { mapping.smooth(last[i], now[i], dt) } else { now[i] });
        };
        self.pads.retain(|(pad, _)| pads.contains(*pad));
        for (entity, pad) in pads {
            let at = self.pads.iter().position(|(known, _)| *known == entity).unwrap_or_else(|| {
                self.pads.push((entity, REST));
                self.pads.len() - 1
            });
            update(&mut self.pads[at].1, of_pad(pad), &mappings.pad);
        }
        update(&mut self.keys, keys, &mappings.keys);
    }

    /// Number of players.
    fn players(&self) -> usize {
        self.pads.len().max(1)
    }

    /// The deflection of a player. The first player has the keyboard and a gamepad, whichever is pushed farther; each other
    /// player has a gamepad.
    fn of(&self, player: usize) -> Deflection {
        let pad = self.pads.get(player).map_or(REST, |(_, deflection)| *deflection);
        if player > 0 { pad } else { [0, 1, 2, 3, 4].map(|i| farthest(pad[i], self.keys[i])) }
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Mappings>()
        .init_resource::<SteeringFrame>()
        .add_systems(PreUpdate, steer.after(InputSystems).before(ReadSet));
}

/// Sends the command of the first gamepad and the keys to the character in focus, and those of other gamepads to the
/// characters behind it. A character keeps its command until [`Action::Release`], or until no player controls it. While a
/// character is steered, the task's time limit does not apply. On a course, runs end by the course's rules.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
#[allow(clippy::type_complexity, reason = "a query names what it reads")]
fn steer(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    pads: Query<(Entity, &Gamepad)>,
    wants: Option<Res<EguiWantsInput>>,
    (bindings, keys_for): (Res<Bindings>, Res<KeysFor>),
    mut actions: MessageReader<ActionPressed>,
    (scenario, loaded, focus): (Res<Scenario>, Res<LoadedPolicy>, Res<Focus>),
    mut steering: ResMut<Steering>,
    (mappings, frame): (Res<Mappings>, Res<SteeringFrame>),
    time: Res<Time<Real>>,
    mut deflections: Local<Deflections>,
    cameras: Query<(&Transform, &FollowCamera)>,
    mut actors: Query<
        (Entity, &Actor, &Anatomy, Option<&mut AgentCommand>, &mut Restart, Option<&mut MoveDirection>),
        With<RagdollState>,
    >,
) {
    let on_course = scenario.mode == Mode::Course;
    // on a course the runner stays under player control until the run ends
    let released = actions.read().filter(|action| action.0 == Action::Release).count() > 0 && !on_course;
    let spectator = on_course && scenario.course.role != PlayerRole::Run;
    let in_menu = *keys_for != KeysFor::Game;
    let typing = in_menu || wants.is_some_and(|w| w.wants_keyboard_input());
    let flying = !in_menu && cameras.iter().any(|(_, camera)| camera.mode == CameraMode::Free);
    let held = of_keys((!typing && !flying).then_some(&*keys), &bindings, steering.by_camera);
    let of_pad = |pad: &Gamepad| if in_menu { REST } else { of_pad(pad, &bindings, &mappings.pad) };
    deflections.update(&pads, of_pad, held, &mappings, time.delta_secs());
    let (mut own, count) = (Steering { flying, ..default() }, actors.iter().count());
    for (entity, actor, anatomy, command, mut restart, movement) in &mut actors {
        let ranges = anatomy.spec.as_ref().map_or(&[][..], |spec| &spec.command);
        let player = (actor.0 + count).saturating_sub(focus.0) % count;
        let led = (player < deflections.players() || on_course) && !ranges.is_empty() && !spectator;
        let deflection = deflections.of(player);
        let by_camera = *frame == SteeringFrame::Camera && MoveDirection::moves(ranges) && !on_course;
        if led && player == 0 {
            own = Steering { on: true, buttons: buttons(ranges).next().is_some(), by_camera, flying };
        }
        let values = command.as_ref().and_then(|command| command.values());
        let steered = led && !released && (values.is_some() || deflection != REST);
        let timed = Restart { on_time_up: !steered && loaded.ground != Ground::Track, ..*restart };
        if !on_course && *restart != timed {
            *restart = timed;
        }
        let direction =
            cameras.iter().next().filter(|_| steered && by_camera).map(|(camera, _)| seen(camera, deflection));
        match (direction, movement) {
            (Some(direction), Some(mut movement)) if movement.direction != direction => movement.direction = direction,
            (Some(direction), None) => drop(commands.entity(entity).insert(MoveDirection::new(direction))),
            (None, Some(_)) => drop(commands.entity(entity).remove::<MoveDirection>()),
            _ => {}
        }
        let wanted = steered.then(|| match direction {
            None => command_of(ranges, deflection),
            // the plugin moves the character
            Some(_) => {
                let [.., first, second] = deflection;
                let mut wanted = command_of(ranges, [0.0, 0.0, 0.0, first, second]);
                let moves = |range: &CommandRange| range.is_speed() || range.is_turn();
                for (i, range) in ranges.iter().enumerate().filter(|(_, range)| moves(range)) {
                    wanted[i] = values.map_or(range.rest(), |values| values[i]);
                }
                wanted
            }
        });
        if values != wanted.as_deref()
            && let Some(mut command) = command
        {
            command.release();
            for (range, x) in ranges.iter().zip(wanted.into_iter().flatten()) {
                // a deflection is in the range
                let _ = command.set(&range.name, x);
            }
        }
    }
    steering.set_if_neq(own);
}

/// The number that is farther from 0.
fn farthest(a: f32, b: f32) -> f32 {
    if b.abs() > a.abs() { b } else { a }
}

/// The deflection of a gamepad.
fn of_pad(pad: &Gamepad, bindings: &Bindings, mapping: &Mapping) -> Deflection {
    let axis = |axis| mapping.map(pad.get(axis).unwrap_or(0.0));
    let trigger = |button| mapping.map(pad.get(button).unwrap_or(0.0));
    let [left, right] = [GamepadButton::LeftTrigger2, GamepadButton::RightTrigger2].map(trigger);
    let pressed = |steer| f32::from(bindings.steering_button(steer).is_some_and(|button| pad.pressed(button)));
    let [first, second] = [Steer::Jump, Steer::Flip].map(pressed);
    [axis(GamepadAxis::LeftStickY), -axis(GamepadAxis::LeftStickX), left - right, first, second]
}

/// The deflection of the keyboard.
fn of_keys(keys: Option<&ButtonInput<KeyCode>>, bindings: &Bindings, by_camera: bool) -> Deflection {
    let pressed = |steer| {
        // both shift keys are one
        let twin = |key| if key == KeyCode::ShiftLeft { KeyCode::ShiftRight } else { key };
        let key = bindings.steering_key(steer);
        f32::from(keys.is_some_and(|keys| keys.any_pressed([key, twin(key)])))
    };
    let [up, down, left, right] =
        [Steer::SteerAhead, Steer::SteerBack, Steer::SteerLeft, Steer::SteerRight].map(pressed);
    let letters = [Steer::MoveAhead, Steer::MoveBack, Steer::MoveLeft, Steer::MoveRight].map(pressed);
    let [first, second] = [Steer::Jump, Steer::Flip].map(pressed);
    if !by_camera {
        return [up - down, left - right, letters[2] - letters[3], first, second];
    }
    let [up, down, left, right] =
        [up.max(letters[0]), down.max(letters[1]), left.max(letters[2]), right.max(letters[3])];
    let pace = if pressed(Steer::Run) > 0.0 { 1.0 } else { WALK };
    let way = Vec2::new(up - down, left - right).normalize_or_zero() * pace;
    [way.x, way.y, 0.0, first, second]
}

/// The direction of the world to which a stick points in the picture of a camera.
fn seen(camera: &Transform, [ahead, left, ..]: Deflection) -> Vec3 {
    // from straight above, up in the picture is ahead
    let forward = camera.forward().with_y(0.0).try_normalize().unwrap_or(*camera.up());
    let right = forward.cross(Vec3::Y);
    (ahead * forward - left * right).clamp_length_max(1.0)
}

/// The entries of a command that buttons set, for characters that turn.
pub fn buttons(ranges: &[CommandRange]) -> impl Iterator<Item = usize> {
    let turns = ranges.iter().any(CommandRange::is_turn);
    ranges.iter().enumerate().filter(move |(_, range)| turns && range.is_button()).map(|(i, _)| i)
}

/// The command of a deflection. A released stick means rest, and the ends of a stick are those of the range.
///
/// * For characters that turn, up and down are the speed, left and right the turn.
/// * For characters that do not turn, such as a figure in a plane, right and left are the speed. Up is the button, if the command
///   has one: a number from 0 to 1 without a unit. Otherwise up and down are the speed, too.
/// * If no number is in m/s, up and down are the first number, left and right the second.
/// * The second number in m/s of a character that turns is a step aside: the triggers, or A and D. The first two buttons of such
///   a character, for example a jump, are A and B of a gamepad, or W and V.
fn command_of(ranges: &[CommandRange], deflection: Deflection) -> Vec<f64> {
    let [ahead, left, aside, pressed @ ..] = deflection.map(f64::from);
    let number_of = |is: fn(&CommandRange) -> bool| ranges.iter().position(is);
    let kinds = [CommandRange::is_speed, CommandRange::is_turn, CommandRange::is_button].map(number_of);
    let mut pushed = vec![0.0; ranges.len()];
    match kinds {
        [Some(speed), None, Some(button)] => {
            pushed[speed] = -left;
            pushed[button] = f64::from(u8::from(ahead > 0.5));
        }
        [Some(speed), None, None] => pushed[speed] = if left.abs() > ahead.abs() { -left } else { ahead },
        [Some(speed), Some(turn), _] => {
            (pushed[speed], pushed[turn]) = (ahead, left);
            if let Some(second) = ranges.iter().skip(speed + 1).position(CommandRange::is_speed) {
                pushed[speed + 1 + second] = aside;
            }
            buttons(ranges).zip(pressed).for_each(|(i, x)| pushed[i] = x);
        }
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
            ([0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.5]),
            ([1.0, -1.0, 0.0, 0.0, 0.0], [3.0, -2.0, 0.5]),
            ([-1.0, 1.0, 0.0, 0.0, 0.0], [-1.0, 2.0, 0.5]),
            ([0.5, 0.25, 1.0, 0.0, 0.0], [1.5, 0.5, 0.5]),
            ([-0.5, 0.0, 0.0, 0.0, 0.0], [-0.5, 0.0, 0.5]),
        ] {
            assert_eq!(command_of(&ranges, deflection), expected);
        }
        // a range without zero rests at its nearer end
        assert_eq!(command_of(&ranges[2..], [-1.0, 0.0, 0.0, 0.0, 0.0]), [0.5]);
        assert_eq!(command_of(&ranges[2..], [1.0, 0.0, 0.0, 0.0, 0.0]), [1.0]);
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
            let [ahead, left] = deflection;
            let deflection = [ahead, left, 0.0, 0.0, 0.0];
            assert_eq!(command_of(&[velocity.clone(), jump.clone()], deflection), expected, "{deflection:?}");
        }
        for (deflection, expected) in [([1.0, 0.0], 4.0), ([0.0, -1.0], 4.0), ([-0.5, 0.25], -2.0), ([0.25, 0.5], -2.0)]
        {
            let [ahead, left] = deflection;
            let deflection = [ahead, left, 0.0, 0.0, 0.0];
            assert_eq!(command_of(std::slice::from_ref(&velocity), deflection), [expected], "{deflection:?}");
        }
    }

    #[test]
    fn a_character_that_turns_may_step_aside() {
        let ranges = [
            CommandRange::new("speed", -3.0..=3.0, "m/s"),
            CommandRange::new("left", -2.0..=2.0, "m/s"),
            CommandRange::new("turn", -1.5..=1.5, "rad/s"),
        ];
        for (deflection, expected) in [
            ([0.5, -1.0, 0.0, 0.0, 0.0], [1.5, 0.0, -1.5]),
            ([0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
            ([0.0, 0.0, -0.5, 0.0, 0.0], [0.0, -1.0, 0.0]),
        ] {
            assert_eq!(command_of(&ranges, deflection), expected, "{deflection:?}");
        }
    }

    #[test]
    fn a_character_that_turns_may_jump() {
        let button = |name| CommandRange::new(name, 0.0..=1.0, "");
        let mut ranges =
            vec![CommandRange::new("speed", 0.0..=3.0, "m/s"), CommandRange::new("turn", -1.5..=1.5, "rad/s")];
        ranges.extend(["jump", "backflip", "sing"].map(button));
        assert_eq!(command_of(&ranges, [1.0, 0.0, 0.0, 1.0, 0.0]), [3.0, 0.0, 1.0, 0.0, 0.0]);
        assert_eq!(command_of(&ranges, [0.0, 0.0, 0.0, 0.0, 1.0]), [0.0, 0.0, 0.0, 1.0, 0.0]);
        assert_eq!((buttons(&ranges).count(), buttons(&ranges[..2]).count(), buttons(&ranges[2..]).count()), (3, 0, 0));
    }

    #[test]
    fn a_stick_points_to_a_direction_of_the_picture() {
        let camera = Transform::from_xyz(0.0, 2.0, 5.0).looking_at(Vec3::ZERO, Vec3::Y);
        for (stick, expected) in [
            ([1.0, 0.0], Vec3::NEG_Z),
            ([0.0, 1.0], Vec3::NEG_X),
            ([-0.5, 0.0], 0.5 * Vec3::Z),
            ([0.0, 0.0], Vec3::ZERO),
        ] {
            let direction = seen(&camera, [stick[0], stick[1], 0.0, 0.0, 0.0]);
            assert!(direction.distance(expected) < 1e-6, "{stick:?}: {direction}");
        }
        // a corner of the stick is no faster
        assert!((seen(&camera, [1.0, 1.0, 0.0, 0.0, 0.0]).length() - 1.0).abs() < 1e-6);
        let above = Transform::from_xyz(0.0, 5.0, 0.0).looking_at(Vec3::ZERO, Vec3::X);
        assert!(seen(&above, [1.0, 0.0, 0.0, 0.0, 0.0]).distance(Vec3::X) < 1e-6);
    }

    #[test]
    fn letters_move_by_the_camera_and_step_aside_without() {
        let (bindings, mut keys) = (Bindings::default(), ButtonInput::<KeyCode>::default());
        keys.press(KeyCode::KeyA);
        assert_eq!(of_keys(Some(&keys), &bindings, false), [0.0, 0.0, 1.0, 0.0, 0.0]);
        assert_eq!(of_keys(Some(&keys), &bindings, true), [0.0, WALK, 0.0, 0.0, 0.0]);
        keys.press(KeyCode::ShiftLeft);
        keys.press(KeyCode::KeyW);
        let [ahead, left, ..] = of_keys(Some(&keys), &bindings, true);
        assert!((ahead.hypot(left) - 1.0).abs() < 1e-6 && ahead == left);
        assert_eq!(of_keys(None, &bindings, true), REST);
    }
}
