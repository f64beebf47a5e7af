//! The controls of a command, as the screen names them.

use crate::app::input::actions::Steer;
use crate::app::input::bindings::Bindings;
use crate::app::input::key_names::{button_name, key_name};
use crate::app::input::steering::buttons;
use marathon_envs::CommandRange;

/// Describes a control that steers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Control {
    /// The keys.
    pub keys: String,
    /// The gamepad's controls.
    pub pad: String,
    /// The name of the command value that the control sets.
    pub does: String,
}

/// The controls for a command with these ranges, in the order in which steering reads them.
pub fn controls(ranges: &[CommandRange], by_camera: bool, bindings: &Bindings) -> Vec<Control> {
    let control = |steers: &[Steer], pad: &str, does: String| {
        let keys = steers.iter().map(|steer| key_name(bindings.steering_key(*steer)));
        Control { keys: keys.collect::<Vec<_>>().join(" "), pad: pad.into(), does }
    };
    if by_camera {
        let letters = [Steer::MoveAhead, Steer::MoveLeft, Steer::MoveBack, Steer::MoveRight];
        let move_it = control(&letters, "left stick", "move".into());
        let run = control(&[Steer::Run], "left stick", "run".into());
        return [move_it, run].into_iter().chain(command_controls(ranges, bindings)).collect();
    }
    let [ahead, aside] = [[Steer::SteerAhead, Steer::SteerBack], [Steer::SteerLeft, Steer::SteerRight]];
    let number = |steers: &[Steer], pad, i: usize| control(steers, pad, ranges[i].name.replace('_', " "));
    let number_of = |is: fn(&CommandRange) -> bool| ranges.iter().position(is);
    let kinds = [CommandRange::is_speed, CommandRange::is_turn, CommandRange::is_button].map(number_of);
    match kinds {
        [Some(speed), None, Some(button)] => {
            vec![number(&aside, "left stick", speed), number(&ahead[..1], "left stick up", button)]
        }
        [Some(speed), None, None] => vec![number(&[ahead, aside].concat(), "left stick", speed)],
        [Some(speed), Some(turn), _] => {
            let mut all = vec![number(&ahead, "left stick", speed), number(&aside, "left stick", turn)];
            if ranges.iter().skip(speed + 1).any(CommandRange::is_speed) {
                all.push(control(&[Steer::MoveLeft, Steer::MoveRight], "triggers", "step aside".into()));
            }
            all.extend(command_controls(ranges, bindings));
            all
        }
        _ => [ahead, aside]
            .iter()
            .take(ranges.len())
            .enumerate()
            .map(|(i, keys)| number(keys, "left stick", i))
            .collect(),
    }
}

/// The controls of the buttons of a command.
fn command_controls(ranges: &[CommandRange], bindings: &Bindings) -> impl Iterator<Item = Control> {
    buttons(ranges).zip([Steer::Jump, Steer::Flip]).map(|(i, steer)| Control {
        keys: key_name(bindings.steering_key(steer)).into(),
        pad: bindings.steering_button(steer).map_or("", button_name).into(),
        does: ranges[i].name.replace('_', " "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controls_have_the_names_of_what_they_set() {
        let range = |name, unit| CommandRange::new(name, 0.0..=1.0, unit);
        let names = |ranges: &[CommandRange]| {
            controls(ranges, false, &Bindings::default())
                .into_iter()
                .map(|c| format!("{}/{}: {}", c.keys, c.pad, c.does))
                .collect::<Vec<_>>()
        };
        let all = [range("speed", "m/s"), range("left", "m/s"), range("turn", "rad/s"), range("jump", "")];
        let with_all = [
            "Up Down/left stick: speed",
            "Left Right/left stick: turn",
            "A D/triggers: step aside",
            "Space/A: jump",
            "V/B: back flip",
        ];
        assert_eq!(names(&[&all[..], &[range("back_flip", "")]].concat()), with_all);
        let planar = ["Left Right/left stick: speed", "Up/left stick up: jump"];
        assert_eq!(names(&[all[0].clone(), all[3].clone()]), planar);
        assert_eq!(names(&all[..1]), ["Up Down Left Right/left stick: speed"]);
        assert_eq!(names(&all[3..]), ["Up Down/left stick: jump"]);
        assert!(names(&[]).is_empty());
        let by_camera = controls(&all, true, &Bindings::default())
            .into_iter()
            .map(|c| format!("{}: {}", c.keys, c.does))
            .collect::<Vec<_>>();
        assert_eq!(by_camera, ["W A S D: move", "Shift: run", "Space: jump"]);
    }
}
