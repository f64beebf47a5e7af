//! A trainer on a loopback port that sends what a test requires: the server's side of the protocol.

#![allow(dead_code, reason = "each test file and the bench use a part of it")]

use marathon_mlagents::wire::{
    AgentAction, AgentActionList, Header, RlInitializationInput, RlInput, UnityInput, UnityMessage, command,
};
use prost::Message;
use std::io::{BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

const DATA: u8 = 0;
const HEADERS: u8 = 1;
const SETTINGS: u8 = 4;
const PING: u8 = 6;
const WINDOW_UPDATE: u8 = 8;
const ACK: u8 = 1;
const END_STREAM: u8 = 1;
const END_HEADERS: u8 = 4;
const WINDOW: u32 = 0x7fff_ffff;

pub struct FakeTrainer {
    reader: BufReader<TcpStream>,
    stream: u32,
}

/// A port on which a trainer waits, and the trainer once a player connects.
pub fn listen() -> (u16, impl FnOnce() -> FakeTrainer) {
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a free port");
    let port = listener.local_addr().expect("an address").port();
    (port, move || FakeTrainer::accept(&listener))
}

impl FakeTrainer {
    fn accept(listener: &TcpListener) -> Self {
        let (socket, _) = listener.accept().expect("a player");
        socket.set_nodelay(true).expect("a socket");
        let mut trainer = FakeTrainer { reader: BufReader::new(socket), stream: 0 };
        let mut preface = [0; 24];
        trainer.reader.read_exact(&mut preface).expect("a greeting");
        assert_eq!(&preface, b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n");
        let window = [&[0, 4][..], &WINDOW.to_be_bytes()].concat();
        trainer.frame(SETTINGS, 0, 0, &window);
        trainer.frame(WINDOW_UPDATE, 0, 0, &(WINDOW - 65535).to_be_bytes());
        trainer
    }

    fn frame(&mut self, kind: u8, flags: u8, stream: u32, payload: &[u8]) {
        let mut bytes = Vec::new();
        put(&mut bytes, kind, flags, stream, payload);
        self.reader.get_mut().write_all(&bytes).expect("a player that listens");
    }

    /// The next message. `None` after the player has gone.
    pub fn receive(&mut self) -> Option<UnityMessage> {
        let mut data = Vec::new();
        loop {
            let mut head = [0; 9];
            self.reader.read_exact(&mut head).ok()?;
            let mut payload = vec![0; u32::from_be_bytes([0, head[0], head[1], head[2]]) as usize];
            self.reader.read_exact(&mut payload).ok()?;
            let (kind, flags) = (head[3], head[4]);
            match kind {
                SETTINGS if flags & 1 == 0 => self.frame(SETTINGS, 1, 0, &[]),
                HEADERS => self.stream = u32::from_be_bytes([head[5], head[6], head[7], head[8]]),
                DATA => {
                    data.extend(payload);
                    if flags & END_STREAM != 0 {
                        return Some(UnityMessage::decode(&data[5..]).expect("a message"));
                    }
                }
                _ => {}
            }
        }
    }

    /// Answers the last message.
    pub fn answer(&mut self, message: &UnityMessage) {
        let bytes = message.encode_to_vec();
        let mut data = vec![0];
        data.extend((bytes.len() as u32).to_be_bytes());
        data.extend(bytes);
        let stream = self.stream;
        // in one piece, as gRPC sends available data
        let mut bytes = Vec::new();
        put(&mut bytes, HEADERS, END_HEADERS, stream, &[]);
        for chunk in data.chunks(16384) {
            put(&mut bytes, DATA, 0, stream, chunk);
        }
        put(&mut bytes, HEADERS, END_HEADERS | END_STREAM, stream, &[]);
        self.reader.get_mut().write_all(&bytes).expect("a player that listens");
    }

    /// Receives the initial message and the first request. Answers the first with a seed.
    pub fn greet(&mut self, seed: i32, areas: i32) -> UnityMessage {
        let hello = self.receive().expect("a greeting");
        self.answer_greeting(seed, areas);
        assert_eq!(self.receive().expect("a question").output, None);
        hello
    }

    /// Answers the initial message.
    pub fn answer_greeting(&mut self, seed: i32, areas: i32) {
        let initialization = RlInitializationInput {
            seed,
            communication_version: "1.5.0".into(),
            package_version: "1.1.0".into(),
            num_areas: areas,
        };
        self.answer(&input(UnityInput { rl: None, initialization: Some(initialization) }));
    }

    /// Reads without answering until the player closes the connection.
    pub fn ignore_until_closed(&mut self) {
        let _ = self.reader.read_to_end(&mut Vec::new());
    }

    /// Answers only pings for a while. Returns the number of pings.
    pub fn answer_pings_for(&mut self, time: Duration) -> usize {
        let (begun, mut pings) = (Instant::now(), 0);
        self.reader.get_ref().set_read_timeout(Some(Duration::from_millis(20))).expect("a socket");
        while begun.elapsed() < time {
            let mut bytes = [0; 17];
            match self.reader.read(&mut bytes) {
                Ok(17) if bytes[3] == PING => {
                    pings += 1;
                    self.frame(PING, ACK, 0, &bytes[9..]);
                }
                Ok(n) => panic!("{n} bytes that are no ping: {bytes:?}"),
                Err(_) => {}
            }
        }
        self.reader.get_ref().set_read_timeout(None).expect("a socket");
        pings
    }
}

/// Appends a frame.
fn put(bytes: &mut Vec<u8>, kind: u8, flags: u8, stream: u32, payload: &[u8]) {
    bytes.extend(&(payload.len() as u32).to_be_bytes()[1..]);
    bytes.extend([kind, flags]);
    bytes.extend(stream.to_be_bytes());
    bytes.extend(payload);
}

fn input(input: UnityInput) -> UnityMessage {
    UnityMessage { header: Some(Header { status: Header::OK }), output: None, input: Some(input) }
}

/// Sends a reset.
pub fn reset(side_channel: Vec<u8>) -> UnityMessage {
    let rl = RlInput { command: command::RESET, side_channel, ..Default::default() };
    input(UnityInput { rl: Some(rl), initialization: None })
}

/// Sends the actions of one behavior's agents.
pub fn step(behavior: &str, agents: usize, action: &[f32]) -> UnityMessage {
    let one = AgentAction { continuous_actions: action.to_vec() };
    let list = AgentActionList { value: vec![one; agents] };
    let agent_actions = [(behavior.to_string(), list)].into();
    input(UnityInput { rl: Some(RlInput { agent_actions, ..Default::default() }), initialization: None })
}

/// Sends the actions of each behavior's agents, and side channel messages.
pub fn act(chosen: &[(&str, Vec<Vec<f32>>)], side_channel: Vec<u8>) -> UnityMessage {
    let list = |rows: &Vec<Vec<f32>>| AgentActionList {
        value: rows.iter().map(|row| AgentAction { continuous_actions: row.clone() }).collect(),
    };
    let agent_actions = chosen.iter().map(|(name, rows)| (name.to_string(), list(rows))).collect();
    let rl = RlInput { agent_actions, side_channel, ..Default::default() };
    input(UnityInput { rl: Some(rl), initialization: None })
}

/// Sends the end of the conversation.
pub fn close() -> UnityMessage {
    UnityMessage { header: Some(Header { status: 400 }), output: None, input: None }
}
