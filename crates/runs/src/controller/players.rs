//! Players whose commands are hard to follow: held and alternating side steps, a keyboard, a trembling stick, commands right after a
//! landing, and commands to a character that gets up.

use super::trial::Trial;
use super::{Commands, GOLDEN, MINUTE, OVER, PUSH, falls};
use crate::error::RunError;
use marathon_envs::CommandRange;
use marathon_learn::lanes::noise::SplitMix;
use serde::Serialize;

/// Time of play, s.
const PLAYED: f64 = 30.0;
/// Mean time for which a key is held or not, s.
const KEY: f64 = 0.85;
/// Probability that a key is pressed, per button.
const BUTTON: f64 = 0.2;
/// Time between changes of side, s.
const SIDES: f64 = 1.5;
/// Half a period of a trembling stick, s: 5 Hz.
const TREMBLE: f64 = 0.1;
/// A short jump, s: time of standing before, of the button, of standing after it, and of the command to go.
const JUMP: [f64; 4] = [2.0, 0.4, 0.2, 3.0];
/// Time of standing before a push, s.
const UPRIGHT: f64 = 2.0;
/// Commands to a character that gets up: their number, and the time of each, s.
const TURNS: usize = 16;
const TURN: f64 = 0.5;

/// How a policy stood up to a player.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Player {
    /// Behavior of the player.
    pub name: String,
    /// Agents of the trial.
    pub agents: u64,
    /// Agents that fell.
    pub falls: u64,
    /// Falls per minute of simulated time.
    pub falls_per_minute: f64,
}

/// A player's numbers, one stream per agent.
struct Dice(SplitMix);

impl Dice {
    fn uniform(&mut self) -> f64 {
        (self.0.word() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The keys of an agent, and when each of them changes, s.
struct Keyboard {
    dice: Dice,
    keys: Vec<(f64, f64)>,
}

impl Keyboard {
    /// Keys at rest that change at once.
    fn new(agent: usize, ranges: &[CommandRange]) -> Self {
        let keys = ranges.iter().map(|range| (range.rest(), 0.0)).collect();
        Keyboard { dice: Dice(SplitMix::new(agent as u64, 0)), keys }
    }

    /// The command at a time.
    fn at(&mut self, time: f64, ranges: &[CommandRange]) -> Vec<f64> {
        for ((value, until), range) in self.keys.iter_mut().zip(ranges) {
            if time + 1e-9 < *until {
                continue;
            }
            let luck = self.dice.uniform();
            *value = match range.is_button() {
                true if luck < BUTTON => 1.0,
                true => 0.0,
                false => [range.low, range.rest(), range.high][(luck * 3.0) as usize],
            };
            *until = time - KEY * libm::log(1.0 - self.dice.uniform());
        }
        self.keys.iter().map(|(value, _)| *value).collect()
    }
}

/// Plays every player that the task's command allows.
pub(super) fn all<'a>(
    commands: &Commands,
    trial: impl Fn() -> Result<Trial<'a>, RunError>,
) -> Result<Vec<Player>, RunError> {
    let (ranges, mut out) = (&commands.ranges, Vec::new());
    let side = |agent: usize| if agent.is_multiple_of(2) { 1.0 } else { -1.0 };
    let [low, high] = commands.range;
    if let Some(left) = ranges.iter().position(|range| range.name == "left") {
        let far = ranges[left].high;
        for speed in [commands.rest[commands.speed], high] {
            let sideways = |left_now: f64, turn: f64| {
                let mut command = commands.at(speed, turn);
                command[left] = left_now;
                command
            };
            let sharpest = commands.turn.map_or(0.0, |(_, sharpest)| sharpest);
            let name = |what: &str| format!("{what} at {speed} m/s");
            out.push(play(trial()?, &name("sideways"), |agent, _| sideways(far * side(agent), 0.0))?);
            out.push(play(trial()?, &name("sideways with a turn against it"), |agent, _| {
                sideways(far * side(agent), -sharpest * side(agent))
            })?);
            out.push(play(trial()?, &name("from side to side"), |agent, time| {
                sideways(far * side(agent + (time / SIDES) as usize), 0.0)
            })?);
        }
    }
    let typing = trial()?;
    let mut keyboards: Vec<Keyboard> = (0..typing.agents()).map(|agent| Keyboard::new(agent, ranges)).collect();
    out.push(play(typing, "keyboard", |agent, time| keyboards[agent].at(time, ranges))?);
    let tremble = |agent: usize, time: f64| side(agent + (time / TREMBLE + 1e-6) as usize);
    out.push(play(trial()?, "speed at 5 Hz", |agent, time| {
        commands.at(if tremble(agent, time) > 0.0 { high } else { low }, 0.0)
    })?);
    if let Some(button) = commands.button {
        out.push(after_a_jump(trial()?, commands, button)?);
    }
    let lying = trial()?;
    if lying.can_rise() {
        out.push(while_rising(lying, commands)?);
    }
    Ok(out)
}

/// Plays a player whose command depends on the agent and the time, s.
fn play(mut trial: Trial<'_>, name: &str, mut command: impl FnMut(usize, f64) -> Vec<f64>) -> Result<Player, RunError> {
    let (agents, dt) = (trial.agents(), trial.dt());
    let (mut fallen, mut played) = (0, 0);
    for decision in 0..(PLAYED / dt).round() as usize {
        let told: Vec<Vec<f64>> = (0..agents).map(|agent| command(agent, decision as f64 * dt)).collect();
        trial.command(|agent| told[agent].clone())?;
        let tracks = trial.play(dt)?;
        fallen += falls(&tracks);
        played += tracks.len();
    }
    Ok(Player::new(name, agents, fallen, played as f64 * dt))
}

/// Plays a short jump from a stand and a command to go at full speed soon after it.
fn after_a_jump(mut trial: Trial<'_>, commands: &Commands, button: usize) -> Result<Player, RunError> {
    let [standing, jumping, landing, going] = JUMP;
    trial.command(|_| commands.rest.clone())?;
    let start = trial.play(standing)?.iter().filter(|track| !track.fallen).count();
    let mut pressed = commands.rest.clone();
    pressed[button] = 1.0;
    trial.command(|_| pressed.clone())?;
    let mut fallen = falls(&trial.play(jumping)?);
    trial.command(|_| commands.rest.clone())?;
    fallen += falls(&trial.play(landing)?);
    let [low, high] = commands.range;
    trial.command(|agent| commands.at(if agent.is_multiple_of(2) { high } else { low }, 0.0))?;
    fallen += falls(&trial.play(going)?);
    let played = start as f64 * (jumping + landing + going);
    Ok(Player::new("full speed 0.2 s after a jump of 0.4 s", start, fallen, played))
}

/// Pushes the character over, and commands full speed and rest in turns while it gets up and afterward. An agent that is not up at the
/// end counts as fallen.
fn while_rising(mut trial: Trial<'_>, commands: &Commands) -> Result<Player, RunError> {
    let agents = trial.agents();
    trial.command(|_| commands.rest.clone())?;
    trial.play(UPRIGHT)?;
    trial.pushed(PUSH, OVER, |agent| agent as f64 * GOLDEN)?;
    let full = commands.at(commands.range[1], 0.0);
    let told = |turn: usize| if turn.is_multiple_of(2) { full.clone() } else { commands.rest.clone() };
    let up = trial.up(TURNS, TURN, told)?;
    let seconds = agents as f64 * TURNS as f64 * TURN;
    Ok(Player::new("full speed and rest in turns while getting up", agents, (agents - up) as u64, seconds))
}

impl Player {
    fn new(name: &str, agents: usize, falls: u64, seconds: f64) -> Self {
        let falls_per_minute = falls as f64 / (seconds / MINUTE).max(f64::MIN_POSITIVE);
        Player { name: name.into(), agents: agents as u64, falls, falls_per_minute }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_held_for_0_85_s_in_the_mean_and_know_extremes_only() {
        let ranges = [CommandRange::new("speed", -1.0..=3.0, "m/s"), CommandRange::new("jump", 0.0..=1.0, "")];
        let mut keyboard = Keyboard::new(3, &ranges);
        let (mut changes, mut counts) = (0, [0; 3]);
        const MANY: usize = 100_000;
        for i in 0..MANY {
            let before = keyboard.keys[0].1;
            let now = keyboard.at(0.01 * i as f64, &ranges);
            changes += usize::from(keyboard.keys[0].1 != before);
            counts[[-1.0, 0.0, 3.0].iter().position(|x| *x == now[0]).expect("an extreme")] += 1;
            assert!([0.0, 1.0].contains(&now[1]));
        }
        let held = 0.01 * MANY as f64 / changes as f64;
        assert!((held - KEY).abs() < 0.05, "{held}");
        assert!(counts.iter().all(|count| (MANY / 4..MANY / 2).contains(count)), "{counts:?}");
        // another agent has other keys
        assert_ne!(Keyboard::new(4, &ranges).at(0.0, &ranges), Keyboard::new(3, &ranges).at(0.0, &ranges));
    }
}
