//! A player for Python: [`Player::connect`], then [`Player::advance`] until the trainer closes.

use crate::behavior::{Behavior, BehaviorOptions, Sizes};
use crate::channels::{self, Engine};
use crate::error::PlayerError;
use crate::face::TEAM;
use crate::log::{Log, shown};
use crate::parameters::Parameters;
use crate::trainer::{MESSAGE_LIMIT, Setup, Trainer, message};
use crate::wire::{RlInitializationOutput, RlInput, RlOutput, UnityMessage, UnityOutput, command};
use marathon_physics::hint::among;
use prost::Message;
use std::collections::BTreeSet;
use std::time::Duration;

/// Bytes of a message that are neither infos nor statistics: headers, names, behaviors.
const ALLOWANCE: usize = 4096;

/// Limit on the number of different warnings, each of which is logged once. A trainer may name any number of unknown
/// things.
const REMARKS: usize = 1000;

/// Options of a player.
#[derive(Clone, Debug)]
pub struct PlayerOptions {
    /// Port on which the trainer listens.
    pub port: u16,
    /// Time to wait for a trainer to start and to send its first answer.
    pub patience: Duration,
    /// Silence after which a trainer counts as gone, if it does not answer a ping either; `None` disables the check.
    pub silence: Option<Duration>,
    /// Behaviors.
    pub behaviors: Vec<BehaviorOptions>,
    /// Number of simulation threads; 0 for one per processor.
    pub threads: usize,
    /// Whether an agent gets a new number with every episode. Unity's do not, but without this `UnityParallelEnv` 1.1.0
    /// misses the ends of episodes.
    pub fresh_ids: bool,
}

impl Default for PlayerOptions {
    /// A player for an `mlagents-learn` that waits for an editor.
    fn default() -> Self {
        PlayerOptions {
            port: 5004,
            patience: Duration::from_secs(60),
            silence: Some(Duration::from_secs(300)),
            behaviors: vec![BehaviorOptions::default()],
            threads: 1,
            fresh_ids: false,
        }
    }
}

/// Result of [`Player::advance`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// All episodes restarted.
    Reset,
    /// All agents made a decision.
    Step,
    /// The trainer has closed, so nothing was done.
    Closed,
}

/// The engine settings that the trainer has sent so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EngineSettings {
    /// Width and height of the window, pixels.
    pub resolution: Option<(i32, i32)>,
    /// Level of quality of the picture, from 0.
    pub quality: Option<i32>,
    /// Seconds simulated per second.
    pub time_scale: Option<f32>,
    /// Frames per second shown; -1 for as many as possible.
    pub target_frame_rate: Option<i32>,
    /// Frames per simulated second.
    pub capture_frame_rate: Option<i32>,
}

/// A player connected to a trainer.
pub struct Player {
    trainer: Trainer,
    setup: Setup,
    behaviors: Vec<Behavior>,
    parameters: Parameters,
    engine: EngineSettings,
    fresh_ids: bool,
    next_id: i32,
    /// The next command.
    order: Option<RlInput>,
    /// The last message. Its memory is reused.
    message: UnityMessage,
    begun: bool,
    told: BTreeSet<String>,
    log: Log,
}

impl Player {
    /// Connects to the trainer, creates the requested agents and waits for the first reset.
    ///
    /// # Errors
    /// If there is no trainer, an agent does not exist, or the agents do not fit into a message.
    pub fn connect(options: &PlayerOptions, log: Log) -> Result<Self, PlayerError> {
        // report what cannot work even with one area before waiting
        check(options, 1)?;
        let one_area = make(options, 1)?;
        log.line(format_args!("connecting to a trainer on port {}", options.port));
        let (mut trainer, setup) = Trainer::connect(options.port, options.patience, options.silence)?;
        check(options, setup.areas)?;
        let (behaviors, next_id) = if setup.areas == 1 { one_area } else { make(options, setup.areas)? };
        let Setup { seed, areas, package_version } = &setup;
        log.line(format_args!("mlagents-envs {package_version}; seed {seed}; areas: {areas}"));
        for behavior in &behaviors {
            let n = behavior.env().agents();
            for (name, role) in behavior.names().zip(behavior.spec().deciders()) {
                let (obs, act) = (role.obs.len(), role.act.len());
                log.line(format_args!("{name}: agents: {n}; observations: {obs}; actions: {act}"));
            }
        }
        let order = trainer.first()?;
        Ok(Player {
            trainer,
            setup,
            behaviors,
            parameters: Parameters::default(),
            engine: EngineSettings::default(),
            fresh_ids: options.fresh_ids,
            next_id,
            order,
            message: message(None),
            begun: false,
            told: BTreeSet::new(),
            log,
        })
    }

    /// The trainer's initial request.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The behaviors. You can read their agents between two turns, and after [`Player::act`] within one.
    pub fn behaviors(&self) -> &[Behavior] {
        &self.behaviors
    }

    /// The engine settings of the trainer.
    pub fn engine(&self) -> EngineSettings {
        self.engine
    }

    /// Executes the trainer's command, sends the results, and waits for the next command: [`Player::act`] and
    /// [`Player::answer`].
    ///
    /// # Errors
    /// If the trainer is gone or its command is invalid.
    pub fn advance(&mut self) -> Result<Turn, PlayerError> {
        let turn = self.act()?;
        if turn != Turn::Closed {
            self.answer()?;
        }
        Ok(turn)
    }

    /// Executes the trainer's command without answering yet. You can then read the agents.
    ///
    /// # Errors
    /// If the command is invalid.
    pub fn act(&mut self) -> Result<Turn, PlayerError> {
        let Some(order) = self.order.take() else { return Ok(Turn::Closed) };
        let changed = self.listen(&order.side_channel);
        let turn = match order.command {
            command::STEP if self.begun => Turn::Step,
            command::QUIT => return Ok(Turn::Closed),
            // a trainer that steps first means the first episodes
            command::STEP | command::RESET => Turn::Reset,
            _ => return Err(PlayerError::Message("has a command that is none of STEP (0), RESET (1), QUIT (2)")),
        };
        let seed = if self.begun { None } else { Some(u64::from(self.setup.seed as u32)) };
        for behavior in &mut self.behaviors {
            let done = match turn {
                Turn::Step => {
                    let changed = if changed { behavior.change(&self.parameters) } else { Ok(()) };
                    behavior.step(&order.agent_actions, &self.parameters).and(changed)
                }
                _ => behavior.reset(seed, &self.parameters),
            };
            match done {
                // a parameter out of range does not end training, but is reported
                Err(e @ (PlayerError::Env(_) | PlayerError::Sizes { .. } | PlayerError::Roles { .. })) => {
                    let text = e.to_string();
                    if first(&mut self.told, &text) {
                        self.log.line(format_args!("warning: {}: {text}", behavior.name()));
                    }
                }
                other => other?,
            }
        }
        Ok(turn)
    }

    /// Sends the results of [`Player::act`] to the trainer, and waits for its next command.
    ///
    /// # Errors
    /// If the trainer is gone.
    pub fn answer(&mut self) -> Result<(), PlayerError> {
        self.report();
        self.order = self.trainer.exchange(&self.message)?;
        self.begun = true;
        Ok(())
    }

    /// Runs until the trainer closes.
    ///
    /// # Errors
    /// As [`Player::advance`].
    pub fn run(&mut self) -> Result<(), PlayerError> {
        while self.advance()? != Turn::Closed {}
        Ok(())
    }

    /// Writes the infos of all behaviors into the message.
    fn report(&mut self) {
        let output = self.message.output.get_or_insert_default();
        // the first infos of a behavior come with its description
        output.initialization = (!self.begun).then(|| RlInitializationOutput {
            brain_parameters: self.behaviors.iter().flat_map(Behavior::parameters).collect(),
            ..Default::default()
        });
        let RlOutput { agent_infos, side_channel } = output.rl.get_or_insert_default();
        side_channel.clear();
        for behavior in &mut self.behaviors {
            behavior.report(agent_infos, side_channel, self.fresh_ids.then_some(&mut self.next_id));
        }
        let statistics = side_channel.len();
        if statistics > 0 && self.message.encoded_len() > MESSAGE_LIMIT {
            // infos always fit; statistics are optional
            if let Some(UnityOutput { rl: Some(rl), .. }) = &mut self.message.output {
                rl.side_channel.clear();
            }
            if first(&mut self.told, "statistics") {
                self.log
                    .line(format_args!("{statistics} bytes of statistics left out: the message would be over 4 MiB"));
            }
        }
    }

    /// Reads the side channels. Returns whether a parameter was set.
    fn listen(&mut self, bytes: &[u8]) -> bool {
        if bytes.is_empty() {
            return false;
        }
        let mut messages = Vec::new();
        let read = channels::read(bytes, |message| messages.push(message));
        let mut changed = false;
        for message in messages {
            match message {
                channels::Message::Engine(engine) => self.set_engine(engine),
                // parameters that no behavior has are ignored and not stored
                channels::Message::Parameter(name, _) if !self.is_known(&name) => self.warn_of_unknown(&name),
                channels::Message::Parameter(name, sampler) => {
                    self.log.line(format_args!("environment parameter {name}: {sampler:?}"));
                    self.parameters.set(name, sampler);
                    changed = true;
                }
                channels::Message::Analytics => {}
                channels::Message::Unknown(id) => {
                    if first(&mut self.told, &format!("{id:?}")) {
                        self.log
                            .line(format_args!("a side channel that this player does not know is ignored: {id:02x?}"));
                    }
                }
            }
        }
        if let Err(e) = read {
            self.log.line(format_args!("warning: {e}"));
        }
        changed
    }

    fn set_engine(&mut self, engine: Engine) {
        let before = self.engine;
        let settings = &mut self.engine;
        match engine {
            Engine::Resolution(width, height) => settings.resolution = Some((width, height)),
            Engine::Quality(level) => settings.quality = Some(level),
            Engine::TimeScale(scale) => settings.time_scale = Some(scale),
            Engine::TargetFrameRate(rate) => settings.target_frame_rate = Some(rate),
            Engine::CaptureFrameRate(rate) => settings.capture_frame_rate = Some(rate),
        }
        if self.engine != before {
            self.log.line(format_args!("engine: {engine:?}"));
        }
    }

    /// Whether any behavior has the parameter.
    fn is_known(&self, name: &str) -> bool {
        self.behaviors.iter().any(|b| b.parameter_names().contains(name))
    }

    /// Logs a warning about a parameter that has no effect.
    fn warn_of_unknown(&mut self, name: &str) {
        let name = shown(name);
        if first(&mut self.told, &format!("parameter {name}")) {
            let known: BTreeSet<&str> = self.behaviors.iter().flat_map(|b| b.parameter_names().iter()).collect();
            let known = among(&name, &Vec::from_iter(known));
            self.log.line(format_args!("warning: environment parameter '{name}' has no effect{known}"));
        }
    }
}

/// Whether a warning is new and the limit on warnings is not reached.
fn first(told: &mut BTreeSet<String>, remark: &str) -> bool {
    told.len() < REMARKS && told.insert(remark.to_owned())
}

/// Creates all behaviors. Also returns the first unused agent number.
fn make(options: &PlayerOptions, areas: usize) -> Result<(Vec<Behavior>, i32), PlayerError> {
    let mut behaviors: Vec<Behavior> = Vec::new();
    let mut next_id = 0;
    for one in &options.behaviors {
        let behavior = Behavior::new(one, areas, options.threads, next_id)?;
        if let Some(name) =
            behavior.names().find(|name| behaviors.iter().any(|other| other.names().any(|n| n == *name)))
        {
            let name = name.trim_end_matches(TEAM);
            return Err(PlayerError::Usage(format!(
                "two behaviors are called '{name}'; give one another name with --behavior-name"
            )));
        }
        next_id += behavior.ids() as i32;
        behaviors.push(behavior);
    }
    Ok((behaviors, next_id))
}

/// Refuses agents that do not fit into a message, before any agent is created.
fn check(options: &PlayerOptions, areas: usize) -> Result<(), PlayerError> {
    let sizes = options.behaviors.iter().map(Sizes::of).collect::<Result<Vec<_>, _>>()?;
    let agents = |i: usize| options.behaviors[i].agents.saturating_mul(areas);
    let largest = |i: &usize| sizes[*i].largest(agents(*i));
    let all = 0..sizes.len();
    let bytes = all.clone().fold(ALLOWANCE, |sum, i| sum.saturating_add(largest(&i)));
    match all.max_by_key(largest) {
        Some(i) if bytes > MESSAGE_LIMIT => Err(PlayerError::TooManyAgents {
            agents: agents(i),
            name: sizes[i].name.clone(),
            bytes,
            limit: MESSAGE_LIMIT,
            most: sizes[i].most_agents(MESSAGE_LIMIT.saturating_sub(bytes - largest(&i))),
        }),
        _ => Ok(()),
    }
}
