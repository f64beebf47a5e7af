//! Schedules of commands for figures in a plane: those of the original's experiments 001 to 004, and one of any
//! velocity for sticks and for training.
//!
//! A command holds for 40 to 239 decisions, uniformly distributed. With `toggle`, it holds for 100.

use super::{Input, MAX_SPEED};
use crate::agent::options::Choice;
use crate::episode_rng::EpisodeRng;

/// Shortest and longest duration of a command, decisions.
const HOLDS: [usize; 2] = [40, 239];
/// Duration of a `toggle` command, decisions: 400 physics steps.
const TOGGLE: usize = 100;
/// Fraction of commands with a jump.
const JUMPS: f64 = 0.25;
/// With `uniform`: fraction of commands to rest.
const RESTS: f64 = 0.3;
/// With `uniform`: fraction of the commands to rest that have a jump, which needs practice.
const RESTING_JUMPS: f64 = 0.5;

/// How commands are drawn if no caller sets them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Schedule {
    /// Experiment 004. While a movement is commanded, 40 % of the draws repeat the command. All other draws: right in
    /// 40 %, left in 40 %, stand in 20 %; a jump in 25 %.
    Repeats,
    /// The same without repeated commands.
    Anew,
    /// Experiment 002. From rest: each side in 45 %, rest in 10 %. From a side: the same side in 60 %, the other side
    /// in 20 %, rest in 20 %. No jumps.
    Thirds,
    /// Experiment 001. The side alternates every 100 decisions. No jumps.
    Toggle,
    /// Any velocity, uniformly distributed, with a jump in 25 %. Rest in 30 %, half of it with a jump.
    Uniform,
}

impl Choice for Schedule {
    const EXPECTED: &'static str = "repeats, anew, thirds, toggle or uniform";
    const NAMED: &'static [(Self, &'static str)] = &[
        (Schedule::Repeats, "repeats"),
        (Schedule::Anew, "anew"),
        (Schedule::Thirds, "thirds"),
        (Schedule::Toggle, "toggle"),
        (Schedule::Uniform, "uniform"),
    ];
}

impl Schedule {
    /// Draws a command that replaces the one in `out`, which is at rest at first. Returns its duration in decisions.
    pub(super) fn draw(self, input: Input, random: &mut EpisodeRng, step: usize, out: &mut [f64]) -> usize {
        let before = out[0];
        let luck = random.uniform(0.0, 1.0);
        let side = |luck: f64| if luck < 0.5 { MAX_SPEED } else { -MAX_SPEED };
        let moving = before != 0.0 || out.get(1).is_some_and(|jump| *jump > 0.0);
        out[0] = match self {
            Schedule::Repeats if moving && luck < 0.4 => return random.whole(HOLDS[0], HOLDS[1]),
            Schedule::Repeats | Schedule::Anew => match random.uniform(0.0, 1.0) {
                luck if luck < 0.4 => MAX_SPEED,
                luck if luck < 0.8 => -MAX_SPEED,
                _ => 0.0,
            },
            Schedule::Thirds if before == 0.0 => match luck {
                luck if luck < 0.45 => MAX_SPEED,
                luck if luck < 0.9 => -MAX_SPEED,
                _ => 0.0,
            },
            Schedule::Thirds => match luck {
                luck if luck < 0.6 => before,
                luck if luck < 0.8 => -before,
                _ => 0.0,
            },
            Schedule::Toggle if step == 0 => side(luck),
            Schedule::Toggle => -before,
            Schedule::Uniform if luck < RESTS => 0.0,
            Schedule::Uniform => random.around_zero(MAX_SPEED),
        };
        if input == Input::Discrete {
            let share = match self {
                Schedule::Uniform if out[0] == 0.0 => RESTING_JUMPS,
                Schedule::Repeats | Schedule::Anew | Schedule::Uniform => JUMPS,
                Schedule::Thirds | Schedule::Toggle => 0.0,
            };
            out[1] = f64::from(u8::from(share > 0.0 && random.uniform(0.0, 1.0) < share));
        }
        if self == Schedule::Toggle { TOGGLE } else { random.whole(HOLDS[0], HOLDS[1]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode_rng::EpisodeId;

    /// Fractions of commands: right, left, stand, jump, and repeats of a command that moved.
    fn shares(schedule: Schedule, input: Input) -> ([f64; 5], Vec<usize>) {
        let mut random = EpisodeRng::new(EpisodeId { seed: 1, agent: 2, episode: 3 });
        let mut out = vec![0.0; if input == Input::Discrete { 2 } else { 1 }];
        let (mut counts, mut moved, mut holds) = ([0.0; 5], 0.0f64, Vec::new());
        const MANY: usize = 20_000;
        for step in 0..MANY {
            let before = out.clone();
            holds.push(schedule.draw(input, &mut random, step * 100, &mut out));
            let jump = out.get(1).is_some_and(|jump| *jump == 1.0);
            for (count, is) in counts.iter_mut().zip([out[0] > 0.0, out[0] < 0.0, out[0] == 0.0, jump]) {
                *count += f64::from(u8::from(is)) / MANY as f64;
            }
            if before.iter().any(|x| *x != 0.0) {
                moved += 1.0;
                counts[4] += f64::from(u8::from(out == before));
            }
        }
        counts[4] /= moved.max(1.0);
        (counts, holds)
    }

    fn near(got: f64, expected: f64) -> bool {
        (got - expected).abs() < 0.02
    }

    #[test]
    fn commands_come_as_often_as_in_the_original() {
        let ([right, left, stand, jump, same], holds) = shares(Schedule::Repeats, Input::Discrete);
        // a quarter of the new draws have a jump; rest never repeats, so it is rarer
        assert!(near(right, left) && stand < 0.2 && jump > 0.25, "{right} {left} {stand} {jump}");
        // 40 %, plus the new draws that happen to be equal: 0.3 after a side, 0.1 with a jump, 0.05 after a jump alone
        let found = (2.0 * 0.3 * 0.3 + 2.0 * 0.1 * 0.1 + 0.05 * 0.05) / 0.85;
        assert!(near(same, 0.4 + 0.6 * found), "{same}");
        assert_eq!((holds.iter().min(), holds.iter().max()), (Some(&40), Some(&239)));
        let ([right, left, stand, jump, _], _) = shares(Schedule::Anew, Input::Discrete);
        assert!(near(right, 0.4) && near(left, 0.4) && near(stand, 0.2) && near(jump, 0.25));
        let ([right, left, stand, jump, same], _) = shares(Schedule::Thirds, Input::Continuous);
        // stationary distribution of the chain: stand = 0.2 moving + 0.1 stand
        assert!(near(right, left) && near(stand, 2.0 / 11.0) && jump == 0.0 && near(same, 0.6), "{stand} {same}");
        let ([right, left, stand, ..], holds) = shares(Schedule::Toggle, Input::Discrete);
        assert!(near(right, 0.5) && near(left, 0.5) && stand == 0.0 && holds.iter().all(|hold| *hold == TOGGLE));
        let ([right, left, stand, jump, _], _) = shares(Schedule::Uniform, Input::Discrete);
        assert!(near(right, 0.35) && near(left, 0.35) && near(stand, 0.3));
        assert!(near(jump, 0.5 * 0.3 + 0.25 * 0.7), "{jump}");
    }

    #[test]
    fn a_stick_has_no_jump() {
        for (schedule, _) in Schedule::NAMED {
            let ([.., jump, _], _) = shares(*schedule, Input::Continuous);
            assert_eq!(jump, 0.0);
        }
    }
}
