//! Parsing of the command line.
//!
//! Python starts a player in the way of Unity's players. The engine's own flags have one dash and vary between
//! versions, so the parser skips unknown ones with their values. Flags with two dashes belong to this player. A
//! misspelled one is refused with the nearest valid flag.

use crate::behavior::BehaviorOptions;
use crate::error::PlayerError;
use crate::player::PlayerOptions;
use marathon_physics::hint::{did_you_mean, nearest};
use std::path::PathBuf;
use std::time::Duration;

/// Help text.
pub const HELP: &str = "\
Serves Marathon's environments to ML-Agents, as a player built with Unity.

  marathon-player --mlagents-port N [flags]

Python usually starts it:
  mlagents-learn CONFIG.yaml --env=marathon-player --env-args --spawn-env=Hopper-v0 --num-spawn-envs=16
Or connect it to an mlagents-learn that was started without --env and waits:
  marathon-player --mlagents-port 5004 --spawn-env=Hopper-v0 --num-spawn-envs=16

  --mlagents-port N        port on which the trainer listens, on this computer
  --spawn-env ID           agent [Hopper-v0]; repeat it for further behaviors, each followed by its flags
  --num-spawn-envs N       number of its agents in each area [64]
  --behavior-name NAME     name of the behavior, or of the first role's [the agent's]
  --option NAME=VALUE      option of the agent
  --max-episode-steps N    decisions after which an episode is truncated [the task's]
  --threads N              simulation threads; 0: one per processor [1]
  --fresh-agent-ids        new agent ids with every episode (for UnityParallelEnv and UnityAECEnv)
  --connect-timeout S      seconds to wait for a trainer and its first answer [60]
  --answer-timeout S       seconds without messages or answers to pings after which the trainer counts as gone;
                           0: never [300]
  -logFile FILE            write the log to this file instead of stderr
  --help, --version

Flags with one dash are Unity's and have no effect here.
";

/// Shortest silence after which a trainer may count as gone, s. A busy trainer may take seconds to answer a ping.
const SHORTEST_SILENCE: u64 = 10;

/// Flags of this player that take a value.
const VALUED: [&str; 9] = [
    "--mlagents-port",
    "--spawn-env",
    "--num-spawn-envs",
    "--behavior-name",
    "--option",
    "--max-episode-steps",
    "--threads",
    "--connect-timeout",
    "--answer-timeout",
];
/// Flags of this player without a value.
const BARE: [&str; 3] = ["--fresh-agent-ids", "--help", "--version"];

/// Result of parsing a command line.
#[derive(Clone, Debug)]
pub enum Request {
    /// Print a text on stdout: help, or the version.
    Print(String),
    /// Play.
    Play(Args),
}

/// Values of a command line.
#[derive(Clone, Debug)]
pub struct Args {
    /// Options of the player.
    pub player: PlayerOptions,
    /// File for the log; `None` for stderr.
    pub log: Option<PathBuf>,
    /// Flags that have no effect here.
    pub ignored: Vec<String>,
}

/// Parses a command line, without the program's own name.
///
/// # Errors
/// If a flag of this player is unknown or has an invalid value, or there is no port.
pub fn parse(words: impl IntoIterator<Item = String>) -> Result<Request, PlayerError> {
    let mut words = words.into_iter().peekable();
    let mut options = PlayerOptions { behaviors: Vec::new(), ..Default::default() };
    let (mut port, mut log, mut ignored) = (None, None, Vec::new());
    while let Some(word) = words.next() {
        let Some(_) = word.strip_prefix("--") else {
            match word.strip_prefix('-') {
                Some(name) if name.eq_ignore_ascii_case("logfile") => {
                    let path = words.next().ok_or_else(|| usage("-logFile needs the name of a file".into()))?;
                    log = Some(PathBuf::from(path));
                }
                Some(_) => {
                    ignored.push(word);
                    ignored.extend(words.next_if(|next| !next.starts_with('-')));
                }
                None => return Err(usage(format!("'{word}' does not follow a flag; see --help"))),
            }
            continue;
        };
        let (flag, attached) = match word.split_once('=') {
            Some((flag, value)) => (flag, Some(value.to_string())),
            None => (&word[..], None),
        };
        if flag.starts_with("--mlagents-") && flag != "--mlagents-port" {
            // ML-Agents' own flag, of a version that this player does not support
            ignored.push(word);
            continue;
        }
        match flag {
            "--help" => return Ok(Request::Print(HELP.into())),
            "--version" => return Ok(Request::Print(format!("marathon-player {}\n", env!("CARGO_PKG_VERSION")))),
            "--fresh-agent-ids" => {
                options.fresh_ids = true;
                continue;
            }
            _ if !VALUED.contains(&flag) => return Err(unknown(flag)),
            _ => {}
        }
        let value = match attached.or_else(|| words.next()) {
            Some(value) => value,
            None => return Err(usage(format!("{flag} needs a value"))),
        };
        match flag {
            "--mlagents-port" => port = Some(number(flag, &value, 1..=65535)? as u16),
            "--spawn-env" => options.behaviors.push(BehaviorOptions { env: value, ..Default::default() }),
            "--threads" => options.threads = number(flag, &value, 0..=4096)? as usize,
            "--connect-timeout" => options.patience = Duration::from_secs(number(flag, &value, 0..=86400)?),
            "--answer-timeout" => {
                let seconds = number(flag, &value, 0..=86400)?;
                if (1..SHORTEST_SILENCE).contains(&seconds) {
                    return Err(usage(format!(
                        "--answer-timeout is '{value}', expected 0 or from {SHORTEST_SILENCE} to 86400"
                    )));
                }
                options.silence = (seconds > 0).then(|| Duration::from_secs(seconds));
            }
            _ => {
                if options.behaviors.is_empty() {
                    options.behaviors.push(BehaviorOptions::default());
                }
                let behavior = options.behaviors.last_mut().ok_or_else(|| unknown(flag))?;
                set(behavior, flag, value)?;
            }
        }
    }
    options.port = port.ok_or_else(|| {
        usage(
            "--mlagents-port is missing. This player serves ML-Agents and shows nothing; to see a policy, use `marathon render`. \
             A waiting mlagents-learn listens on port 5004"
                .into(),
        )
    })?;
    if options.behaviors.is_empty() {
        options.behaviors.push(BehaviorOptions::default());
    }
    Ok(Request::Play(Args { player: options, log, ignored }))
}

/// Sets a flag of a behavior.
fn set(behavior: &mut BehaviorOptions, flag: &str, value: String) -> Result<(), PlayerError> {
    match flag {
        "--num-spawn-envs" => behavior.agents = number(flag, &value, 1..=1_000_000)? as usize,
        "--max-episode-steps" => behavior.max_episode_steps = Some(number(flag, &value, 1..=u32::MAX.into())? as usize),
        "--behavior-name" if value.is_empty() || value.contains('?') => {
            return Err(usage(format!("--behavior-name is '{value}', expected a name without '?'")));
        }
        "--behavior-name" => behavior.name = Some(value),
        _ => {
            let Some((name, value)) = value.split_once('=') else {
                return Err(usage(format!("--option is '{value}', expected NAME=VALUE")));
            };
            let value: marathon_envs::Value = match value.parse() {
                Ok(value) => value,
                Err(never) => match never {},
            };
            behavior.options.set(name, value);
        }
    }
    Ok(())
}

fn usage(text: String) -> PlayerError {
    PlayerError::Usage(text)
}

fn unknown(flag: &str) -> PlayerError {
    let near = did_you_mean(nearest(flag, VALUED.into_iter().chain(BARE)));
    usage(format!("there is no flag {flag}{near} See --help for all"))
}

fn number(flag: &str, value: &str, range: std::ops::RangeInclusive<u64>) -> Result<u64, PlayerError> {
    match value.parse() {
        Ok(n) if range.contains(&n) => Ok(n),
        _ => Err(usage(format!(
            "{flag} is '{value}', expected a whole number from {} to {}",
            range.start(),
            range.end()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(line: &str) -> Result<Args, String> {
        match parse(line.split_whitespace().map(str::to_owned)) {
            Ok(Request::Play(args)) => Ok(args),
            Ok(Request::Print(text)) => Err(text),
            Err(e) => Err(e.to_string()),
        }
    }

    #[test]
    fn a_launch_by_python_is_understood() {
        let args = read(
            "-nographics -batchmode --mlagents-port 5005 -logFile /tmp/Player-0.log -screen-width 84 --spawn-env=Ant-v0 \
             --num-spawn-envs=16 --spawn-env Hopper-v5 --option healthy_reward=0.5 --option exclude=(1,2) --mlagents-new=1",
        )
        .unwrap();
        assert_eq!((args.player.port, args.log), (5005, Some("/tmp/Player-0.log".into())));
        assert_eq!(args.ignored, ["-nographics", "-batchmode", "-screen-width", "84", "--mlagents-new=1"]);
        let [ant, hopper] = &args.player.behaviors[..] else { panic!("two behaviors") };
        assert_eq!((ant.env.as_str(), ant.agents), ("Ant-v0", 16));
        assert_eq!((hopper.env.as_str(), hopper.agents), ("Hopper-v5", 64));
        assert_eq!(hopper.options.get("healthy_reward"), Some(&0.5.into()));
        assert_eq!(hopper.options.get("exclude"), Some(&[1.0, 2.0].into()));
        assert_eq!(read("--mlagents-port=1").unwrap().player.behaviors, [BehaviorOptions::default()]);
    }

    #[test]
    fn mistakes_are_told() {
        for (line, expected) in [
            ("", "--mlagents-port is missing"),
            ("--mlagents-port", "needs a value"),
            ("--mlagents-port 70000", "is '70000', expected a whole number from 1 to 65535"),
            ("--mlagents-port 1 --spawn-envs=Hopper-v0", "no flag --spawn-envs; did you mean '--spawn-env'?"),
            ("--mlagents-port 1 --num-spawn-env 3", "did you mean '--num-spawn-envs'?"),
            ("--mlagents-port 1 --num-spawn-envs 0", "expected a whole number from 1 to 1000000"),
            ("--mlagents-port 1 --option mass", "expected NAME=VALUE"),
            ("--mlagents-port 1 --behavior-name a?team=1", "expected a name without '?'"),
            ("--mlagents-port 1 hopper", "'hopper' does not follow a flag"),
            ("--mlagents-port 1 --answer-timeout 3", "expected 0 or from 10 to 86400"),
            ("-logFile", "-logFile needs"),
        ] {
            let error = read(line).unwrap_err();
            assert!(error.contains(expected), "{line}: {error}");
        }
        assert!(read("--help").unwrap_err().contains("--spawn-env ID"));
    }

    #[test]
    fn the_help_names_every_flag() {
        for flag in VALUED.into_iter().chain(BARE) {
            assert!(HELP.contains(flag), "{flag}");
        }
    }

    proptest! {
        #[test]
        fn words_never_panic(words in proptest::collection::vec("-{0,2}[a-z=-]{0,12}|--mlagents-port=?[0-9]*|.*", 0..6)) {
            let _ = parse(words);
        }
    }
}
