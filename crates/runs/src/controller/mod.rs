//! Measures how well a policy tracks commands: minutes of random commands, speed steps, turns, standing, jumps, pushes.
//!
//! Velocities are those of the center of mass between two decisions. Forward is the direction of the root's x axis
//! along the ground, or +x for planar characters. A command is observed at the end of the decision in which it is set,
//! so a response includes this decision.

mod players;
mod response;
mod results;
mod table;
mod trial;

use crate::error::RunError;
use crate::task_config::TaskConfig;
use marathon_envs::{CommandRange, registry};
use marathon_learn::{EvalOptions, Policy};
use marathon_motion::Tracking;
pub use players::Player;
pub use response::Response;
pub use results::{CommandTracking, Flip, Jump, Minutes, Push, Rise, Stand, Turn};
use std::f64::consts::TAU;
use trial::{Moment, Track, Trial};

/// Length of a sequence of random commands, s.
const MINUTE: f64 = 60.0;
/// Time after the start in which a fall counts as early, s.
const EARLY: f64 = 2.0;
/// Time after a change of command from which on errors count as settled, s.
const SETTLED: f64 = 1.5;
/// Time at the old command before a new one, s, and time at the new one.
const BEFORE: f64 = 4.0;
const AFTER: f64 = 4.0;
/// Time for stopping, and time of standing, s.
const STOPPING: f64 = 4.0;
const STANDING: f64 = 10.0;
/// Limits of standing still: path of the center of mass, m, and mean speed of the bodies, m/s.
const DRIFT: f64 = 0.1;
const STILL_SPEED: f64 = 0.05;
/// Name of the button for a backflip, how long it is held, and the time for a flip and one second afterward, s.
const BACKFLIP: &str = "backflip";
const HELD: f64 = 0.25;
const FLIP: f64 = 3.0;
/// Velocity of a push that makes the character fall, m/s, and the time limit for standing up promptly, s.
const OVER: f64 = 4.0;
const UP: f64 = 4.0;
/// Time for which a button is held, minimum time off the ground of a jump, and time limit of a prompt jump, s.
const PRESSED: f64 = 1.0;
const ALOFT: f64 = 0.1;
const PROMPT: f64 = 0.35;
/// Gravitational acceleration, m/s^2.
const GRAVITY: f64 = 9.81;
/// Pushes: the velocity that they would give to a rigid body of the character's mass, m/s, and their duration, s.
const PUSHES: [f64; 3] = [0.25, 0.5, 1.0];
const PUSH: f64 = 0.1;
/// Angle between the pushes of consecutive agents. The golden angle spreads them over all directions.
const GOLDEN: f64 = 0.381_966_011_250_105 * TAU;

/// Indices and ranges of speed and turn in a command.
struct Commands {
    /// Names, ranges and units.
    ranges: Vec<CommandRange>,
    rest: Vec<f64>,
    speed: usize,
    range: [f64; 2],
    turn: Option<(usize, f64)>,
    button: Option<usize>,
    backflip: Option<usize>,
}

impl Commands {
    fn of(policy: &Policy, task_config: &TaskConfig) -> Result<Self, RunError> {
        let spec = task_config.factory()?.spec().clone();
        let number_of = |is: fn(&CommandRange) -> bool| spec.command.iter().position(is);
        let Some(speed) = number_of(CommandRange::is_speed) else {
            return Err(RunError::NoSpeed { task: policy.meta().agent.clone(), others: obedient() });
        };
        Ok(Commands {
            rest: spec.command.iter().map(|range| range.rest()).collect(),
            speed,
            range: [spec.command[speed].low, spec.command[speed].high],
            turn: number_of(CommandRange::is_turn).map(|i| (i, spec.command[i].high)),
            button: number_of(CommandRange::is_button),
            backflip: spec.command.iter().position(|range| range.name == BACKFLIP),
            ranges: spec.command,
        })
    }

    /// Three speeds: the lowest, the highest and rest, or half the highest if the lowest is rest.
    fn levels(&self) -> [f64; 3] {
        let ([low, high], rest) = (self.range, self.rest[self.speed]);
        [low, if low < rest { rest } else { 0.5 * (low + high) }, high]
    }

    /// The command for a speed and a turn.
    fn at(&self, speed: f64, turn: f64) -> Vec<f64> {
        let mut command = self.rest.clone();
        command[self.speed] = speed;
        if let Some((i, _)) = self.turn {
            command[i] = turn;
        }
        command
    }
}

/// Tasks with a speed command.
fn obedient() -> Vec<String> {
    let told = |id: &String| registry::agent(id).is_ok_and(|a| a.facts().command.iter().any(CommandRange::is_speed));
    registry::ids().into_iter().filter(told).collect()
}

/// Runs all trials with a policy's best actions. Each has as many agents as `options` has episodes. All agents start as
/// in play, regardless of the starts in training.
///
/// # Errors
/// If the policy's task does not exist, or has no speed command.
pub fn measure(policy: &Policy, options: &EvalOptions) -> Result<CommandTracking, RunError> {
    let task_config = TaskConfig::with_training_options(policy.meta()).starting_first()?;
    let commands = Commands::of(policy, &task_config)?;
    let trial = || Trial::new(&task_config, policy, options, commands.speed);
    let (levels, half) = (commands.levels(), 0.5 * commands.range[1]);
    let mut responses = Vec::new();
    for from in levels {
        for to in levels.into_iter().filter(|to| *to != from) {
            let (dt, tracks) = step(trial()?, &commands, from, to)?;
            responses.push(Response::of(&tracks, dt, [from, to]));
        }
    }
    let mut turns = Vec::new();
    if let Some((_, sharpest)) = commands.turn {
        for speed in levels {
            turns.push(turn(trial()?, &commands, speed, sharpest)?);
        }
    }
    let mut jumps = Vec::new();
    if let Some(button) = commands.button {
        for speed in [commands.rest[commands.speed], half, commands.range[1]] {
            jumps.push(jump(trial()?, &commands, button, speed)?);
        }
    }
    let backflip = match commands.backflip {
        Some(button) => Some(flip(trial()?, &commands, button)?),
        None => None,
    };
    let lying = trial()?;
    let rise = if lying.can_rise() { Some(rise(lying, &commands)?) } else { None };
    let pushes = PUSHES.into_iter().map(|velocity| push(trial()?, &commands, half, velocity));
    Ok(CommandTracking {
        task: policy.meta().agent.clone(),
        agents: options.episodes as u64,
        dt: policy.meta().control_dt,
        minutes: minutes(trial()?)?,
        players: players::all(&commands, trial)?,
        responses,
        turns,
        stand: stand(trial()?, &commands)?,
        jumps,
        backflip,
        pushes: pushes.collect::<Result<_, RunError>>()?,
        rise,
    })
}

/// Plays a minute of each agent's own schedule.
fn minutes(mut trial: Trial<'_>) -> Result<Minutes, RunError> {
    let dt = trial.dt();
    let settled = (SETTLED / dt).ceil() as usize;
    let tracks = trial.play(MINUTE)?;
    let tracking = Tracking::new(trial.model());
    let (mut all, mut late, mut slides) = (Mean::default(), Mean::default(), Mean::default());
    for track in &tracks {
        let mut since = 0;
        for (i, moment) in track.moments.iter().enumerate() {
            since = if i > 0 && track.moments[i - 1].command != moment.command { 0 } else { since + 1 };
            all.add(moment.error);
            if since >= settled {
                late.add(moment.error);
            }
        }
        let frames: Vec<Vec<f64>> = track.moments.iter().map(|moment| moment.qpos.clone()).collect();
        tracking.slides(&frames, dt).into_iter().for_each(|slide| slides.add(slide));
    }
    let falls = falls(&tracks);
    let early = tracks.iter().filter(|track| track.fallen && (track.moments.len() as f64) * dt < EARLY).count();
    let played: usize = tracks.iter().map(|track| track.moments.len()).sum();
    Ok(Minutes {
        without_fall: tracks.len() as u64 - falls,
        early_falls: early as u64,
        falls_per_minute: falls as f64 / (played as f64 * dt / 60.0),
        velocity_error: all.get(),
        settled_error: late.get(),
        slide: slides.get(),
    })
}

/// Plays a speed step. Returns the tracks of agents that had not fallen before.
fn step(mut trial: Trial<'_>, commands: &Commands, from: f64, to: f64) -> Result<(f64, Vec<Track>), RunError> {
    trial.command(|_| commands.at(from, 0.0))?;
    trial.play(BEFORE)?;
    trial.command(|_| commands.at(to, 0.0))?;
    Ok((trial.dt(), trial.play(AFTER)?))
}

/// Plays the sharpest turn at a speed, alternating between left and right.
fn turn(mut trial: Trial<'_>, commands: &Commands, speed: f64, sharpest: f64) -> Result<Turn, RunError> {
    let side = |agent: usize| if agent.is_multiple_of(2) { 1.0 } else { -1.0 };
    let dt = trial.dt();
    trial.command(|_| commands.at(speed, 0.0))?;
    trial.play(BEFORE)?;
    trial.command(|agent| commands.at(speed, sharpest * side(agent)))?;
    let tracks = trial.play(SETTLED + AFTER)?;
    let (mut reached_speed, mut reached_turn) = (Mean::default(), Mean::default());
    for track in &tracks {
        let late = &track.moments[((SETTLED / dt) as usize).min(track.moments.len())..];
        late.iter().for_each(|moment| reached_speed.add(moment.speed));
        if let [first, .., last] = late {
            let turned = side(track.agent) * (last.heading - first.heading);
            reached_turn.add(turned / ((late.len() - 1) as f64 * dt));
        }
    }
    Ok(Turn {
        speed,
        turn: sharpest,
        reached_speed: reached_speed.get(),
        reached_turn: reached_turn.get(),
        agents: tracks.len() as u64,
        falls: falls(&tracks),
    })
}

/// Plays ten seconds at rest.
fn stand(mut trial: Trial<'_>, commands: &Commands) -> Result<Stand, RunError> {
    let all = trial.agents();
    trial.command(|_| commands.rest.clone())?;
    trial.play(STOPPING)?;
    let tracks = trial.play(STANDING)?;
    let stood: Vec<[f64; 2]> = tracks.iter().filter(|track| !track.fallen).map(|track| still(&track.moments)).collect();
    let median = |i: usize| response::median(stood.iter().map(|x| x[i]).collect());
    Ok(Stand {
        still: stood.iter().filter(|[drift, speed]| *drift < DRIFT && *speed < STILL_SPEED).count() as u64,
        falls: (all - stood.len()) as u64,
        drift: median(0),
        speed: median(1),
    })
}

/// Largest distance of the center of mass from its start, m, and mean speed of the bodies, m/s.
fn still(moments: &[Moment]) -> [f64; 2] {
    let Some(first) = moments.first() else { return [0.0; 2] };
    let way = |moment: &Moment| (moment.at[0] - first.at[0]).hypot(moment.at[1] - first.at[1]);
    let mut speed = Mean::default();
    moments.iter().for_each(|moment| speed.add(moment.parts));
    [moments.iter().map(way).fold(0.0, f64::max), speed.get()]
}

/// Plays a jump at a speed, which is also commanded before and afterward.
fn jump(mut trial: Trial<'_>, commands: &Commands, button: usize, speed: f64) -> Result<Jump, RunError> {
    let dt = trial.dt();
    let goes = commands.at(speed, 0.0);
    trial.command(|_| goes.clone())?;
    let before = trial.play(BEFORE)?;
    let mut pressed = goes.clone();
    pressed[button] = 1.0;
    trial.command(|_| pressed.clone())?;
    let mut tracks = trial.play(PRESSED)?;
    trial.command(|_| goes.clone())?;
    join(&mut tracks, trial.play(AFTER - PRESSED)?);
    let start = |agent| before.iter().find(|track| track.agent == agent).and_then(|track| track.moments.last());
    // stepping from foot to foot also leaves the ground briefly
    let window = (ALOFT / dt).round().max(2.0) as usize;
    let least = 0.5 * GRAVITY * (ALOFT - dt) * dt;
    let time = |track: &Track, rise: f64| {
        let aloft =
            |some: &[Moment]| some.iter().all(|moment| !moment.grounded) && rise < some[1].height - some[0].height;
        let off = track.moments.windows(window).position(aloft);
        off.map_or(f64::INFINITY, |i| (i + 1) as f64 * dt)
    };
    let prompt = |times: &[f64]| times.iter().filter(|time| **time <= PROMPT + 1e-9).count() as u64;
    let rise = |track: &Track| {
        let start = start(track.agent)?.height;
        Some(track.moments.iter().map(|moment| moment.height - start).fold(0.0, f64::max))
    };
    let [times, thrown] =
        [f64::NEG_INFINITY, least].map(|rise| tracks.iter().map(|t| time(t, rise)).collect::<Vec<f64>>());
    Ok(Jump {
        speed,
        agents: tracks.len() as u64,
        prompt: prompt(&times),
        thrown: prompt(&thrown),
        falls: falls(&tracks),
        latency: response::median_time(times),
        thrown_latency: response::median_time(thrown),
        height: response::median(tracks.iter().filter_map(rise).collect()),
    })
}

/// Plays a backflip from a stand.
fn flip(mut trial: Trial<'_>, commands: &Commands, button: usize) -> Result<Flip, RunError> {
    trial.command(|_| commands.rest.clone())?;
    trial.play(BEFORE)?;
    let mut pressed = commands.rest.clone();
    pressed[button] = 1.0;
    trial.command(|_| pressed.clone())?;
    let mut tracks = trial.play(HELD)?;
    trial.command(|_| commands.rest.clone())?;
    join(&mut tracks, trial.play(FLIP - HELD)?);
    let tracking = Tracking::new(trial.model());
    let flipped = |track: &&Track| {
        let frames: Vec<Vec<f64>> = track.moments.iter().map(|moment| moment.qpos.clone()).collect();
        !track.fallen && tracking.flips(&frames) > 0
    };
    Ok(Flip { agents: tracks.len() as u64, landed: tracks.iter().filter(flipped).count() as u64 })
}

/// Pushes the character over and lets it get up.
fn rise(mut trial: Trial<'_>, commands: &Commands) -> Result<Rise, RunError> {
    trial.command(|_| commands.rest.clone())?;
    trial.play(BEFORE)?;
    trial.pushed(PUSH, OVER, |agent| agent as f64 * GOLDEN)?;
    let times = trial.rise(2.0 * UP + 1.0)?;
    Ok(Rise {
        agents: times.len() as u64,
        prompt: times.iter().filter(|time| **time <= UP + 1e-9).count() as u64,
        time: response::median_time(times),
    })
}

/// Appends later moments to tracks.
fn join(tracks: &mut [Track], mut later: Vec<Track>) {
    for track in tracks {
        if let Some(more) = later.iter_mut().find(|more| more.agent == track.agent) {
            track.moments.append(&mut more.moments);
            track.fallen = more.fallen;
        }
    }
}

/// Plays a push at a speed.
fn push(mut trial: Trial<'_>, commands: &Commands, speed: f64, velocity: f64) -> Result<Push, RunError> {
    let dt = trial.dt();
    trial.command(|_| commands.at(speed, 0.0))?;
    let before = trial.play(BEFORE)?;
    let usual = |agent: usize| {
        let track = before.iter().find(|track| track.agent == agent)?;
        let last = &track.moments[track.moments.len().saturating_sub((1.0 / dt) as usize)..];
        Some(last.iter().map(|moment| moment.speed).sum::<f64>() / last.len() as f64)
    };
    let mut tracks = trial.pushed(PUSH, velocity, |agent| agent as f64 * GOLDEN)?;
    join(&mut tracks, trial.play(AFTER)?);
    let window = (0.25 / dt).round().max(1.0) as usize;
    let times = tracks.iter().map(|track| {
        let usual = usual(track.agent).filter(|_| !track.fallen)?;
        let mean = |w: &[Moment]| w.iter().map(|moment| moment.speed).sum::<f64>() / window as f64;
        // counts from the last moment that differs from before
        let speeds: Vec<f64> = track.moments.windows(window).map(mean).collect();
        let last = speeds.iter().rposition(|speed| (speed - usual).abs() > 0.3);
        let settled = last.map_or(0, |i| i + 1);
        (settled < speeds.len()).then_some(settled as f64 * dt)
    });
    let times: Vec<f64> = times.map(|time| time.unwrap_or(f64::INFINITY)).collect();
    Ok(Push { velocity, agents: tracks.len() as u64, falls: falls(&tracks), recovery: response::median_time(times) })
}

/// Number of agents that fell.
fn falls(tracks: &[Track]) -> u64 {
    tracks.iter().filter(|track| track.fallen).count() as u64
}

/// A running mean.
#[derive(Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, x: f64) {
        self.sum += x;
        self.count += 1;
    }

    fn get(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }
}
