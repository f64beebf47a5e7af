//! Sticks, triggers and keys tell the character in focus what to do, if its agent takes commands.
//!
//! What a device says goes through its [mapping](Mapping): dead zone, curve, smoothing.

use crate::app::args::Mode;
use crate::app::course::Part;
use crate::app::keys::{Deed, Do, button_name, key_name};
use crate::app::show::{Actor, Focus, Script, Show};
use crate::ground::Ground;
use crate::ragdoll::{AgentCommand, Anatomy, Restart};
use crate::simulate::RagdollState;
use bevy::input::gamepad::{Gamepad, GamepadAxis};
use bevy::prelude::*;
use bevy_egui::input::EguiWantsInput;
use marathon_envs::CommandRange;

/// Keys that steer, forward and back, to the left and to the right, and a step aside to the left and to the right; they do
/// nothing else meanwhile.
pub(super) const KEYS: [KeyCode; 6] =
    [KeyCode::ArrowUp, KeyCode::ArrowDown, KeyCode::ArrowLeft, KeyCode::ArrowRight, KeyCode::KeyA, KeyCode::KeyD];

/// Keys and buttons of whoever turns and can do more than go, such as jump: for the first such number of the command, and for
/// the second; they do nothing else meanwhile.
pub(super) const BUTTON_KEYS: [KeyCode; 2] = [KeyCode::KeyW, KeyCode::KeyV];
pub(super) const BUTTONS: [GamepadButton; 2] = [GamepadButton::South, GamepadButton::East];

/// How far ahead, to the left, and aside to the left somebody pushes, in [-1, 1], and two buttons, 0 or 1.
type Deflection = [f32; 5];
/// Numbers of a deflection that are those of sticks and triggers.
const STICKS: usize = 3;
/// Nobody touches anything.
const REST: Deflection = [0.0; 5];

/// What becomes of a device's deflections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mapping {
    /// Deflection up to which a stick or trigger counts as released, 0 to 1. Beyond it a deflection begins at 0.
    pub dead_zone: f32,
    /// Power that the rest is raised to: above 1, a small deflection says less.
    pub curve: f32,
    /// Time in which a change arrives but for 1/e of it, s; 0: at once.
    pub smoothing: f32,
}

/// The mappings of gamepads and of the keyboard, whose keys have neither a dead zone nor a curve.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub struct Mappings {
    /// Of gamepads.
    pub pad: Mapping,
    /// Of the keyboard.
    pub keys: Mapping,
}

impl Steering {
    /// Whether a key steers and has no other action.
    pub fn takes_key(&self, key: KeyCode) -> bool {
        self.on && KEYS.contains(&key) || self.buttons && BUTTON_KEYS.contains(&key)
    }

    /// Whether a gamepad button steers and has no other action.
    pub fn takes_button(&self, button: GamepadButton) -> bool {
        self.buttons && BUTTONS.contains(&button)
    }
}

impl Default for Mappings {
    fn default() -> Self {
        let at_once = Mapping { dead_zone: 0.0, curve: 1.0, smoothing: 0.0 };
        Mappings { pad: Mapping { dead_zone: 0.12, ..at_once }, keys: at_once }
    }
}

impl Mapping {
    /// What a deflection says.
    fn map(&self, x: f32) -> f32 {
        let beyond = ((x.abs() - self.dead_zone) / (1.0 - self.dead_zone)).clamp(0.0, 1.0);
        beyond.powf(self.curve) * x.signum()
    }

    /// What is said `dt` seconds after `before` was.
    fn smooth(&self, before: f32, now: f32, dt: f32) -> f32 {
        // below what anybody sees, so that a released stick comes to rest
        if self.smoothing <= 0.0 || (now - before).abs() < 1e-3 {
            return now;
        }
        now + (before - now) * (-dt / self.smoothing).exp()
    }
}

/// What gamepads, in the order in which they were connected, and keyboard have said last.
#[derive(Default)]
pub struct Said {
    pads: Vec<(Entity, Deflection)>,
    keys: Deflection,
}

impl Said {
    /// Takes in what is said now.
    fn hear(&mut self, pads: &Query<(Entity, &Gamepad)>, keys: Deflection, mappings: &Mappings, dt: f32) {
        let hear = |said: &mut Deflection, now: Deflection, mapping: &Mapping| {
            *said = [0, 1, 2, 3, 4].map(|i| if i < STICKS { mapping.smooth(said[i], now[i], dt) } else { now[i] });
        };
        self.pads.retain(|(pad, _)| pads.contains(*pad));
        for (entity, pad) in pads {
            let at = self.pads.iter().position(|(known, _)| *known == entity).unwrap_or_else(|| {
                self.pads.push((entity, REST));
                self.pads.len() - 1
            });
            hear(&mut self.pads[at].1, of_pad(pad, &mappings.pad), &mappings.pad);
        }
        hear(&mut self.keys, keys, &mappings.keys);
    }

    /// How many play.
    fn players(&self) -> usize {
        self.pads.len().max(1)
    }

    /// What a player says: the first one by keyboard and gamepad, whichever is pushed farther, each other by a gamepad.
    fn of(&self, player: usize) -> Deflection {
        let pad = self.pads.get(player).map_or(REST, |(_, said)| *said);
        if player > 0 { pad } else { [0, 1, 2, 3, 4].map(|i| farthest(pad[i], self.keys[i])) }
    }
}

/// What of the devices is the character's in focus.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steering {
    /// It takes commands: the left stick and the arrow keys.
    pub on: bool,
    /// It takes such as jump: the keys and buttons for that.
    pub buttons: bool,
}

/// Describes a control that steers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Control {
    /// The keys.
    pub keys: &'static str,
    /// The gamepad's controls.
    pub pad: &'static str,
    /// The name of the command value that the control sets.
    pub does: String,
}

/// The controls for a command with these ranges, in the order that [`told`] reads them.
pub fn controls(ranges: &[CommandRange]) -> Vec<Control> {
    let control = |keys, pad, i: usize| Control { keys, pad, does: ranges[i].name.replace('_', " ") };
    let number_of = |is: fn(&CommandRange) -> bool| ranges.iter().position(is);
    let kinds = [CommandRange::is_speed, CommandRange::is_turn, CommandRange::is_button].map(number_of);
    match kinds {
        [Some(speed), None, Some(button)] => {
            vec![control("Left Right", "left stick", speed), control("Up", "left stick up", button)]
        }
        [Some(speed), None, None] => vec![control("arrows", "left stick", speed)],
        [Some(speed), Some(turn), _] => {
            let mut all = vec![control("Up Down", "left stick", speed), control("Left Right", "left stick", turn)];
            if let Some(second) = ranges.iter().skip(speed + 1).position(CommandRange::is_speed) {
                all.push(Control { does: "step aside".into(), ..control("A D", "triggers", speed + 1 + second) });
            }
            let names = BUTTON_KEYS.map(key_name).into_iter().zip(BUTTONS.map(button_name));
            all.extend(buttons(ranges).zip(names).map(|(i, (key, pad))| control(key, pad, i)));
            all
        }
        _ => {
            let keys = [("Up Down", "left stick"), ("Left Right", "left stick")];
            keys.into_iter().take(ranges.len()).enumerate().map(|(i, (keys, pad))| control(keys, pad, i)).collect()
        }
    }
}

/// Sends the command of the first gamepad and the keys to the character in focus, and those of other gamepads to the
/// characters behind it. A character keeps its command until [`Deed::Release`], or until no player controls it. While a
/// character is steered, the task's time limit does not apply. On a course, runs end by the course's rules.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
#[allow(clippy::type_complexity, reason = "a query names what it reads")]
pub fn steer(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    pads: Query<(Entity, &Gamepad)>,
    wants: Option<Res<EguiWantsInput>>,
    mut deeds: MessageReader<Do>,
    (show, script, focus): (Res<Show>, Res<Script>, Res<Focus>),
    mut steering: ResMut<Steering>,
    mappings: Res<Mappings>,
    time: Res<Time<Real>>,
    mut said: Local<Said>,
    mut actors: Query<(Entity, &Actor, &Anatomy, Option<&AgentCommand>, &mut Restart), With<RagdollState>>,
) {
    let on_course = show.mode == Mode::Course;
    // on a course, who runs is one and the same to the end
    let released = deeds.read().filter(|deed| deed.0 == Deed::Release).count() > 0 && !on_course;
    let spectator = on_course && show.course.part != Part::Run;
    let typing = wants.is_some_and(|w| w.wants_keyboard_input());
    said.hear(&pads, of_keys((!typing).then_some(&*keys)), &mappings, time.delta_secs());
    let (mut own, count) = (Steering::default(), actors.iter().count());
    for (entity, actor, anatomy, command, mut restart) in &mut actors {
        let ranges = anatomy.spec.as_ref().map_or(&[][..], |spec| &spec.command);
        let player = (actor.0 + count).saturating_sub(focus.0) % count;
        let led = (player < said.players() || on_course) && !ranges.is_empty() && !spectator;
        let deflection = said.of(player);
        if led && player == 0 {
            own = Steering { on: true, buttons: buttons(ranges).next().is_some() };
        }
        let steered = led && !released && (command.is_some() || deflection != REST);
        let timed = Restart { on_time_up: !steered && script.ground != Ground::Track, ..*restart };
        if !on_course && *restart != timed {
            *restart = timed;
        }
        if !led || released {
            if command.is_some() {
                commands.entity(entity).remove::<AgentCommand>();
            }
        } else if steered {
            let wanted = AgentCommand(Some(told(ranges, deflection)));
            if command != Some(&wanted) {
                commands.entity(entity).insert(wanted);
            }
        }
    }
    steering.set_if_neq(own);
}

/// What is farther from 0.
fn farthest(a: f32, b: f32) -> f32 {
    if b.abs() > a.abs() { b } else { a }
}

/// How far a gamepad is pushed.
fn of_pad(pad: &Gamepad, mapping: &Mapping) -> Deflection {
    let axis = |axis| mapping.map(pad.get(axis).unwrap_or(0.0));
    let trigger = |button| mapping.map(pad.get(button).unwrap_or(0.0));
    let [left, right] = [GamepadButton::LeftTrigger2, GamepadButton::RightTrigger2].map(trigger);
    let [first, second] = BUTTONS.map(|button| f32::from(pad.pressed(button)));
    [axis(GamepadAxis::LeftStickY), -axis(GamepadAxis::LeftStickX), left - right, first, second]
}

/// How far the keyboard is.
fn of_keys(keys: Option<&ButtonInput<KeyCode>>) -> Deflection {
    let pressed = |key| f32::from(keys.is_some_and(|keys| keys.pressed(key)));
    let [up, down, left, right, aside_left, aside_right] = KEYS.map(pressed);
    let [first, second] = BUTTON_KEYS.map(pressed);
    [up - down, left - right, aside_left - aside_right, first, second]
}

/// Where a command has what a button says, of whoever turns.
fn buttons(ranges: &[CommandRange]) -> impl Iterator<Item = usize> {
    let turns = ranges.iter().any(CommandRange::is_turn);
    ranges.iter().enumerate().filter(move |(_, range)| turns && range.is_button()).map(|(i, _)| i)
}

/// The command of a deflection, ahead, to the left, and aside. A released stick means rest, the ends of a stick those of the range.
///
/// * Up and down are the speed of whoever turns; left and right are the turn.
/// * For whoever does not turn, such as a figure in a plane, right and left are the speed. Up is the button, if the command has
///   one: a number from 0 to 1 without a unit. Otherwise up and down are the speed, too.
/// * Where no number is in m/s, up and down are the first number, left and right the second.
/// * The second number in m/s of whoever turns is a step aside: the triggers, or A and D. Its first two buttons, such as a jump,
///   are A and B of a gamepad, or W and V.
fn told(ranges: &[CommandRange], deflection: Deflection) -> Vec<f64> {
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
            assert_eq!(told(&ranges, deflection), expected);
        }
        // a range without zero rests at its nearer end
        assert_eq!(told(&ranges[2..], [-1.0, 0.0, 0.0, 0.0, 0.0]), [0.5]);
        assert_eq!(told(&ranges[2..], [1.0, 0.0, 0.0, 0.0, 0.0]), [1.0]);
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
            assert_eq!(told(&[velocity.clone(), jump.clone()], deflection), expected, "{deflection:?}");
        }
        for (deflection, expected) in [([1.0, 0.0], 4.0), ([0.0, -1.0], 4.0), ([-0.5, 0.25], -2.0), ([0.25, 0.5], -2.0)]
        {
            let [ahead, left] = deflection;
            let deflection = [ahead, left, 0.0, 0.0, 0.0];
            assert_eq!(told(std::slice::from_ref(&velocity), deflection), [expected], "{deflection:?}");
        }
    }

    #[test]
    fn who_turns_may_step_aside() {
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
            assert_eq!(told(&ranges, deflection), expected, "{deflection:?}");
        }
    }

    #[test]
    fn who_turns_may_jump() {
        let button = |name| CommandRange::new(name, 0.0..=1.0, "");
        let mut ranges =
            vec![CommandRange::new("speed", 0.0..=3.0, "m/s"), CommandRange::new("turn", -1.5..=1.5, "rad/s")];
        ranges.extend(["jump", "backflip", "sing"].map(button));
        assert_eq!(told(&ranges, [1.0, 0.0, 0.0, 1.0, 0.0]), [3.0, 0.0, 1.0, 0.0, 0.0]);
        assert_eq!(told(&ranges, [0.0, 0.0, 0.0, 0.0, 1.0]), [0.0, 0.0, 0.0, 1.0, 0.0]);
        assert_eq!((buttons(&ranges).count(), buttons(&ranges[..2]).count(), buttons(&ranges[2..]).count()), (3, 0, 0));
    }

    #[test]
    fn controls_have_the_names_of_what_they_set() {
        let range = |name, unit| CommandRange::new(name, 0.0..=1.0, unit);
        let told = |ranges: &[CommandRange]| {
            controls(ranges).into_iter().map(|c| format!("{}/{}: {}", c.keys, c.pad, c.does)).collect::<Vec<_>>()
        };
        let all = [range("speed", "m/s"), range("left", "m/s"), range("turn", "rad/s"), range("jump", "")];
        let with_all = [
            "Up Down/left stick: speed",
            "Left Right/left stick: turn",
            "A D/triggers: step aside",
            "W/A: jump",
            "V/B: back flip",
        ];
        assert_eq!(told(&[&all[..], &[range("back_flip", "")]].concat()), with_all);
        let planar = ["Left Right/left stick: speed", "Up/left stick up: jump"];
        assert_eq!(told(&[all[0].clone(), all[3].clone()]), planar);
        assert_eq!(told(&all[..1]), ["arrows/left stick: speed"]);
        assert_eq!(told(&all[3..]), ["Up Down/left stick: jump"]);
        assert!(told(&[]).is_empty());
    }

    #[test]
    fn what_a_released_stick_still_says_is_not_heard() {
        let pad = Mappings::default().pad;
        assert_eq!([0.0, 0.1, -0.12].map(|x| pad.map(x).abs()), [0.0; 3]);
        assert!([1.0, -1.0] == [1.0, -1.0].map(|x| pad.map(x)) && pad.map(0.13) > 0.0 && pad.map(0.13) < 0.02);
    }

    #[test]
    fn a_curve_leaves_the_ends_and_a_smoothed_stick_arrives() {
        let mapping = Mapping { dead_zone: 0.0, curve: 2.0, smoothing: 0.1 };
        assert_eq!([-1.0, -0.5, 0.0, 0.5, 1.0].map(|x| mapping.map(x)), [-1.0, -0.25, 0.0, 0.25, 1.0]);
        // 63 % after the time of the smoothing, whatever the frames; all of it in the end
        for frames in [6u8, 25] {
            let mut said = 0.0;
            for _ in 0..frames {
                said = mapping.smooth(said, 1.0, 0.1 / f32::from(frames));
            }
            assert!((said - (1.0 - (-1.0f32).exp())).abs() < 1e-3, "{said}");
        }
        let arrived = (0..100).fold(0.0, |said, _| mapping.smooth(said, 1.0, 1.0 / 60.0));
        assert_eq!(arrived, 1.0);
        assert_eq!(Mappings::default().keys.smooth(0.0, 1.0, 1.0 / 60.0), 1.0);
    }
}
