//! The conversation with a trainer.
//!
//! The player is the client. Its first call describes it, and the answer has a seed. Its second call is empty, and is
//! answered when the trainer resets its environments. From then on every call sends the results of a decision, and the
//! answer has the next command.

use crate::error::PlayerError;
use crate::log::shown;
use crate::rpc::{Channel, RpcError};
use crate::wire::{Capabilities, Header, RlInitializationOutput, RlInput, UnityMessage, UnityOutput};
use prost::Message;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, TcpStream};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Version of the protocol. Python compares the first number.
pub const COMMUNICATION_VERSION: &str = "1.5.0";
/// The release of Unity's package that matches this protocol.
const PACKAGE_VERSION: &str = "3.0.0";
/// Longest message that a trainer accepts: gRPC's default, which Python does not change.
pub const MESSAGE_LIMIT: usize = 4 << 20;
/// Interval between attempts to connect, and between checks of the time during a wait.
const PAUSE: Duration = Duration::from_millis(100);
/// Minimum waiting time for a trainer's first answer.
const FIRST_ANSWER: Duration = Duration::from_secs(2);

/// The trainer's initial request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setup {
    /// Seed of everything random.
    pub seed: i32,
    /// Copies of the scene, at least 1.
    pub areas: usize,
    /// Version of the Python package.
    pub package_version: String,
}

/// A connected trainer.
pub struct Trainer {
    channel: Channel<TcpStream>,
    sending: Vec<u8>,
    reply: Vec<u8>,
}

impl Trainer {
    /// Connects to the trainer on a port of this computer. Waits until it has started, and exchanges the initial
    /// messages. After its first answer, the trainer counts as gone if it sends nothing for `silence` and does not
    /// answer a ping; `None` disables this check. Pings are at least 5 minutes apart.
    ///
    /// # Errors
    /// If no trainer answers within `patience`, or another program listens on the port.
    pub fn connect(port: u16, patience: Duration, silence: Option<Duration>) -> Result<(Self, Setup), PlayerError> {
        let begun = Instant::now();
        let stream = reach(port, patience).map_err(|source| PlayerError::Connect { port, source })?;
        let mut channel = Channel::open(stream, &format!("localhost:{port}"))?;
        let deadline = (begun + patience).max(Instant::now() + FIRST_ANSWER);
        channel.set_deadline(Some(deadline));
        let mut trainer = Trainer { channel, sending: Vec::new(), reply: Vec::new() };
        let everything = Capabilities {
            base_rl: true,
            concatenated_png: true,
            compressed_channel_mapping: true,
            hybrid_actions: true,
            training_analytics: true,
            variable_length_observation: true,
            multi_agent_groups: true,
        };
        let hello = RlInitializationOutput {
            name: "AcademySingleton".into(),
            communication_version: COMMUNICATION_VERSION.into(),
            brain_parameters: Vec::new(),
            package_version: PACKAGE_VERSION.into(),
            capabilities: Some(everything),
        };
        let output = UnityOutput { rl: None, initialization: Some(hello) };
        let answer = trainer.call(&message(Some(output))).map_err(|error| match error {
            PlayerError::Rpc(RpcError::Late) => PlayerError::NoAnswer { port, seconds: begun.elapsed().as_secs() },
            PlayerError::Rpc(source @ (RpcError::Io(_) | RpcError::GoAway(_))) => PlayerError::Closed { port, source },
            other => other,
        })?;
        trainer.channel.set_deadline(None);
        trainer.channel.set_longest_silence(silence);
        let Some(asked) = answer.input.and_then(|input| input.initialization) else {
            return Err(PlayerError::Message("does not begin with an initialization"));
        };
        let major = |version: &str| version.split('.').next().map(str::to_owned);
        if major(&asked.communication_version) != major(COMMUNICATION_VERSION) {
            let found = shown(&asked.communication_version);
            return Err(PlayerError::Version { found, expected: COMMUNICATION_VERSION });
        }
        let setup = Setup {
            seed: asked.seed,
            areas: usize::try_from(asked.num_areas).unwrap_or(1).max(1),
            package_version: shown(&asked.package_version),
        };
        Ok((trainer, setup))
    }

    /// Waits for the first command, as long as the trainer responds. `None` if the trainer has closed the connection.
    ///
    /// # Errors
    /// If the trainer is gone.
    pub fn first(&mut self) -> Result<Option<RlInput>, PlayerError> {
        self.exchange(&message(None))
    }

    /// Sends the results of a decision and returns the next command. `None` if the trainer has closed.
    ///
    /// # Errors
    /// If the trainer is gone, or refuses the message.
    pub fn exchange(&mut self, output: &UnityMessage) -> Result<Option<RlInput>, PlayerError> {
        let answer = match self.call(output) {
            // the trainer has left without waiting for this call
            Err(PlayerError::Rpc(e)) if e.is_farewell() => return Ok(None),
            answer => answer?,
        };
        if answer.header.is_none_or(|header| header.status != Header::OK) {
            return Ok(None);
        }
        Ok(Some(answer.input.and_then(|input| input.rl).unwrap_or_default()))
    }

    fn call(&mut self, message: &UnityMessage) -> Result<UnityMessage, PlayerError> {
        self.sending.clear();
        message.encode_raw(&mut self.sending);
        self.channel.call(&self.sending, &mut self.reply)?;
        Ok(UnityMessage::decode(&*self.reply)?)
    }
}

/// A message of the player.
pub(crate) fn message(output: Option<UnityOutput>) -> UnityMessage {
    UnityMessage { header: Some(Header { status: Header::OK }), output, input: None }
}

/// Connects to a port of this computer.
fn reach(port: u16, patience: Duration) -> std::io::Result<TcpStream> {
    let addresses = [SocketAddr::from((Ipv4Addr::LOCALHOST, port)), SocketAddr::from((Ipv6Addr::LOCALHOST, port))];
    let begun = Instant::now();
    loop {
        let mut failure = std::io::ErrorKind::NotFound.into();
        for address in &addresses {
            // a listener with a full queue delays the connection
            let left = patience.saturating_sub(begun.elapsed()).max(FIRST_ANSWER);
            match TcpStream::connect_timeout(address, left) {
                Ok(stream) => {
                    stream.set_nodelay(true)?;
                    stream.set_read_timeout(Some(PAUSE))?;
                    stream.set_write_timeout(Some(PAUSE))?;
                    return Ok(stream);
                }
                Err(e) => failure = e,
            }
        }
        if begun.elapsed() >= patience {
            return Err(failure);
        }
        sleep(PAUSE);
    }
}
