// one file: one protocol (HTTP/2 with one call at a time), whose frames, headers and flow control belong together
//! gRPC's unary call over one blocking HTTP/2 connection, limited to the needs of one method.
//!
//! A player makes one call at a time to one server that has just started on the same machine. Frames follow [RFC
//! 9113](https://www.rfc-editor.org/rfc/rfc9113), messages [gRPC over
//! HTTP/2](https://github.com/grpc/grpc/blob/master/doc/PROTOCOL-HTTP2.md). The request header only uses indices of
//! HPACK's static table, and reply headers are skipped. No dynamic table is therefore needed.

use marathon_physics::budget::{self, OverBudget};
use std::io::{self, Read, Write};
use std::time::{Duration, Instant};
use thiserror::Error;

/// The only method of ML-Agents' service.
const PATH: &[u8] = b"/communicator_objects.UnityToExternalProto/Exchange";
/// Start of every connection.
const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
/// Length of a frame's header.
const FRAME_HEAD: usize = 9;
/// Maximum frame length of a peer without an agreement on longer ones.
const MAX_FRAME: usize = 16384;
/// Receive window, as large as possible, because replies are awaited and read at once.
const WINDOW: u32 = 0x7fff_ffff;
/// Initial window of both sides.
const FIRST_WINDOW: u32 = 65535;
/// Bytes after which the connection's window is refilled.
const REFILL: u32 = 1 << 30;
/// Memory per byte of a decoded reply. A list of empty messages uses two bytes for each message.
const MEMORY_PER_BYTE: f64 = 128.0;
/// Minimum time between two pings during one wait. A gRPC server closes the connection of a client that pings more
/// often.
const PING_PAUSE: Duration = Duration::from_secs(300);
/// Length of a message's header: a byte for compression, and the message's length.
const MESSAGE_HEAD: usize = 5;

/// Types of frames.
mod frame {
    pub const DATA: u8 = 0;
    pub const HEADERS: u8 = 1;
    pub const RST_STREAM: u8 = 3;
    pub const SETTINGS: u8 = 4;
    pub const PUSH_PROMISE: u8 = 5;
    pub const PING: u8 = 6;
    pub const GOAWAY: u8 = 7;
    pub const WINDOW_UPDATE: u8 = 8;
}

/// Flags of frames.
mod flag {
    /// Of DATA and HEADERS.
    pub const END_STREAM: u8 = 1;
    /// Of SETTINGS and PING.
    pub const ACK: u8 = 1;
    /// Of HEADERS.
    pub const END_HEADERS: u8 = 4;
    /// Of DATA.
    pub const PADDED: u8 = 8;
}

/// Error codes for ended connections.
mod code {
    pub const NO_ERROR: u32 = 0;
    pub const INTERNAL_ERROR: u32 = 2;
}

/// Identifiers of settings.
mod setting {
    pub const ENABLE_PUSH: u16 = 2;
    pub const INITIAL_WINDOW_SIZE: u16 = 4;
    pub const MAX_FRAME_SIZE: u16 = 5;
}

/// Reason for a call without a reply.
#[derive(Debug, Error)]
pub enum RpcError {
    /// The connection broke.
    #[error("the connection broke: {0}")]
    Io(#[from] io::Error),
    /// The peer ended the connection.
    #[error("the trainer ended the connection (code {0})")]
    GoAway(u32),
    /// The peer ended the call.
    #[error("the trainer broke off the exchange of a message of {bytes} bytes (code {code})")]
    Reset {
        /// Length of the sent message.
        bytes: usize,
        /// HTTP/2's error code.
        code: u32,
    },
    /// The peer answered without a message.
    #[error("the trainer refused a message of {0} bytes; it takes at most 4 MiB (4194304)")]
    Refused(usize),
    /// The peer did not answer in time.
    #[error("the trainer has not answered in time")]
    Late,
    /// The connection is open, but the peer no longer responds.
    #[error(
        "the trainer has sent nothing for {} s and does not answer a ping: it has stopped or hangs (--answer-timeout)",
        .0.as_secs()
    )]
    Silent(Duration),
    /// The peer's message needs too much memory.
    #[error("the trainer's message {0}")]
    Budget(#[from] OverBudget),
    /// The peer's data is not HTTP/2, or not a gRPC reply.
    #[error("the peer does not use ML-Agents' protocol: {0}")]
    Protocol(&'static str),
}

impl RpcError {
    /// Whether the peer has closed. gRPC's server sends NO_ERROR when it ends normally, and INTERNAL_ERROR when it
    /// stops during a call.
    pub fn is_farewell(&self) -> bool {
        matches!(self, RpcError::GoAway(code::NO_ERROR | code::INTERNAL_ERROR))
    }
}

/// A connection to a server.
pub struct Channel<S> {
    stream: S,
    /// The header of every request in HPACK's encoding.
    request: Vec<u8>,
    /// Stream number of the current call: 1, 3, 5 ...
    call: u32,
    /// Remaining send window of the connection, bytes.
    window: i64,
    /// Remaining send window of the current call's stream, bytes.
    call_window: i64,
    /// Initial send window of a stream, bytes.
    initial_window: i64,
    /// Maximum frame length that the peer accepts.
    max_frame: usize,
    /// The peer has announced the end of the connection.
    leaving: bool,
    /// Bytes received since the last refill of the connection's window.
    taken: u32,
    /// Buffer for received bytes. Those in `at..end` are unread.
    received: Vec<u8>,
    at: usize,
    end: usize,
    /// Bytes to send.
    sending: Vec<u8>,
    wait: Wait,
}

/// Limits on the wait for a peer. They need a stream with timeouts for reads and writes.
#[derive(Default)]
struct Wait {
    /// Deadline of the current reply.
    deadline: Option<Instant>,
    /// Maximum silence.
    silence: Option<Duration>,
    /// Start of the current silence; `None` if data has arrived or been sent since the last timeout.
    since: Option<Instant>,
    /// Time of a ping without an answer so far.
    pinged: Option<Instant>,
    last_ping: Option<Instant>,
}

impl Wait {
    /// Handles a timeout of a read or write. Returns whether to ping the peer.
    fn go_on(&mut self) -> Result<bool, RpcError> {
        let now = Instant::now();
        if self.deadline.is_some_and(|deadline| now >= deadline) {
            return Err(RpcError::Late);
        }
        let Some(most) = self.silence else { return Ok(false) };
        let silent = now - *self.since.get_or_insert(now);
        if let Some(pinged) = self.pinged {
            return if silent >= most && now - pinged >= most / 2 { Err(RpcError::Silent(silent)) } else { Ok(false) };
        }
        Ok(silent >= most / 2 && self.last_ping.is_none_or(|last| now - last >= PING_PAUSE))
    }

    /// Handles a timeout within a write, when a ping cannot be sent.
    fn go_on_writing(&mut self) -> Result<(), RpcError> {
        self.go_on()?;
        let silent = self.since.map_or(Duration::ZERO, |since| since.elapsed());
        if self.silence.is_some_and(|most| silent >= most) { Err(RpcError::Silent(silent)) } else { Ok(()) }
    }

    fn heard(&mut self) {
        (self.since, self.pinged) = (None, None);
    }
}

impl<S: Read + Write> Channel<S> {
    /// Opens a connection to a server. `authority` is its name, such as `localhost:5005`.
    ///
    /// # Errors
    /// If the stream cannot be written to.
    pub fn open(stream: S, authority: &str) -> Result<Self, RpcError> {
        let mut hello = PREFACE.to_vec();
        let mut settings = Vec::new();
        for (id, value) in [(setting::ENABLE_PUSH, 0), (setting::INITIAL_WINDOW_SIZE, WINDOW)] {
            settings.extend(id.to_be_bytes());
            settings.extend(value.to_be_bytes());
        }
        put_frame(&mut hello, frame::SETTINGS, 0, 0, &settings);
        put_frame(&mut hello, frame::WINDOW_UPDATE, 0, 0, &(WINDOW - FIRST_WINDOW).to_be_bytes());
        let mut channel = Channel {
            stream,
            request: request_header(authority),
            call: 0,
            window: FIRST_WINDOW.into(),
            call_window: 0,
            initial_window: FIRST_WINDOW.into(),
            max_frame: MAX_FRAME,
            leaving: false,
            taken: 0,
            received: vec![0; 4 * MAX_FRAME],
            at: 0,
            end: 0,
            sending: Vec::new(),
            wait: Wait::default(),
        };
        channel.send(&hello)?;
        Ok(channel)
    }

    /// Sets the time limit for each reply, starting now. The stream's reads and writes need timeouts.
    pub fn set_deadline(&mut self, deadline: Option<Instant>) {
        self.wait.deadline = deadline;
    }

    /// Sets the maximum silence of the peer. A reply may take any time as long as the peer answers pings, which gRPC
    /// servers do even while their program is busy. The stream's reads and writes need timeouts.
    pub fn set_longest_silence(&mut self, silence: Option<Duration>) {
        self.wait.silence = silence;
    }

    /// Sends bytes, however long the peer takes to receive them.
    fn send(&mut self, mut bytes: &[u8]) -> Result<(), RpcError> {
        while !bytes.is_empty() {
            match self.stream.write(bytes) {
                Ok(0) => return Err(RpcError::Io(io::ErrorKind::WriteZero.into())),
                Ok(n) => {
                    bytes = &bytes[n..];
                    self.wait.since = None;
                }
                Err(e) if timed_out(&e) => self.wait.go_on_writing()?,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e.into()),
            }
        }
        Ok(())
    }

    /// Sends a ping.
    fn ping(&mut self) -> Result<(), RpcError> {
        let mut ping = Vec::new();
        put_frame(&mut ping, frame::PING, 0, 0, b"marathon");
        let since = self.wait.since;
        self.send(&ping)?;
        let now = Instant::now();
        (self.wait.since, self.wait.pinged, self.wait.last_ping) = (since, Some(now), Some(now));
        Ok(())
    }

    /// Sends a message and waits for the reply, which replaces the contents of `reply`.
    ///
    /// # Errors
    /// If there is no reply.
    pub fn call(&mut self, message: &[u8], reply: &mut Vec<u8>) -> Result<(), RpcError> {
        reply.clear();
        self.call = if self.call == 0 { 1 } else { self.call + 2 };
        if self.call > WINDOW {
            return Err(RpcError::Protocol("a connection carries no more than 2^30 calls"));
        }
        self.call_window = self.initial_window;
        self.wait.heard();
        let mut sending = std::mem::take(&mut self.sending);
        sending.clear();
        put_frame(&mut sending, frame::HEADERS, flag::END_HEADERS, self.call, &self.request);
        let head = message_head(message);
        let total = MESSAGE_HEAD + message.len();
        let mut sent = 0;
        while sent < total {
            let room = self.window.min(self.call_window).min(self.max_frame as i64);
            if room <= 0 {
                // the peer must open its window first
                self.send(&sending)?;
                sending.clear();
                if self.pump(reply, message.len())? {
                    return Err(RpcError::Refused(message.len()));
                }
                continue;
            }
            let n = (total - sent).min(room as usize);
            let last = if sent + n == total { flag::END_STREAM } else { 0 };
            put_frame_head(&mut sending, n, frame::DATA, last, self.call);
            let (from_head, from_message) = (sent.min(MESSAGE_HEAD), sent.saturating_sub(MESSAGE_HEAD));
            sending.extend(&head[from_head..(sent + n).min(MESSAGE_HEAD)]);
            sending.extend(&message[from_message..(sent + n).saturating_sub(MESSAGE_HEAD)]);
            sent += n;
            self.window -= n as i64;
            self.call_window -= n as i64;
        }
        self.send(&sending)?;
        self.sending = sending;
        while !self.pump(reply, message.len())? {}
        unpack(reply, message.len())
    }

    /// Handles one frame. Returns whether it was the last one of the current call.
    fn pump(&mut self, reply: &mut Vec<u8>, sent: usize) -> Result<bool, RpcError> {
        self.need(FRAME_HEAD)?;
        let head = &self.received[self.at..self.at + FRAME_HEAD];
        let length = u32::from_be_bytes([0, head[0], head[1], head[2]]) as usize;
        let (kind, flags) = (head[3], head[4]);
        let stream = u32::from_be_bytes([head[5], head[6], head[7], head[8]]) & WINDOW;
        if length > MAX_FRAME {
            return Err(RpcError::Protocol("a frame is longer than was agreed"));
        }
        self.need(FRAME_HEAD + length)?;
        let payload = self.at + FRAME_HEAD..self.at + FRAME_HEAD + length;
        self.at = payload.end;
        let payload = &self.received[payload];
        let ours = stream == self.call;
        let mut answer = Vec::new();
        let mut ended = false;
        match kind {
            frame::DATA => {
                self.taken += length as u32;
                if ours {
                    let data = if flags & flag::PADDED == 0 { payload } else { unpadded(payload)? };
                    reply.extend(data);
                    budget::MEMORY.check(MEMORY_PER_BYTE * declared(reply).max(reply.len()) as f64)?;
                    ended = flags & flag::END_STREAM != 0;
                }
                if self.taken > REFILL {
                    put_frame(&mut answer, frame::WINDOW_UPDATE, 0, 0, &self.taken.to_be_bytes());
                    self.taken = 0;
                }
            }
            frame::HEADERS => ended = ours && flags & flag::END_STREAM != 0,
            frame::RST_STREAM if ours => return Err(RpcError::Reset { bytes: sent, code: number(payload)? }),
            frame::SETTINGS if flags & flag::ACK == 0 => {
                for entry in payload.chunks(6) {
                    let [a, b, value @ ..] = entry else { return Err(RpcError::Protocol("a setting is cut short")) };
                    let value = number(value)?;
                    match u16::from_be_bytes([*a, *b]) {
                        setting::INITIAL_WINDOW_SIZE => {
                            self.call_window += i64::from(value) - self.initial_window;
                            self.initial_window = value.into();
                        }
                        setting::MAX_FRAME_SIZE => self.max_frame = (value as usize).clamp(1, 1 << 24),
                        _ => {}
                    }
                }
                put_frame(&mut answer, frame::SETTINGS, flag::ACK, 0, &[]);
            }
            frame::PING if flags & flag::ACK == 0 => put_frame(&mut answer, frame::PING, flag::ACK, 0, payload),
            frame::GOAWAY => {
                let (last, code) = (number(payload)? & WINDOW, number(payload.get(4..).unwrap_or_default())?);
                if code != code::NO_ERROR || last < self.call {
                    return Err(RpcError::GoAway(code));
                }
                // a peer that leaves normally answers this call first
                self.leaving = true;
            }
            frame::WINDOW_UPDATE => {
                let more = i64::from(number(payload)? & WINDOW);
                if stream == 0 {
                    self.window += more;
                } else if ours {
                    self.call_window += more;
                }
            }
            frame::PUSH_PROMISE => return Err(RpcError::Protocol("it pushes what nobody asked for")),
            _ => {}
        }
        if !answer.is_empty() {
            self.send(&answer)?;
        }
        Ok(ended)
    }

    /// Reads until `n` bytes from `at` on are available. No frame is longer than the buffer.
    fn need(&mut self, n: usize) -> Result<(), RpcError> {
        while self.end - self.at < n {
            self.received.copy_within(self.at..self.end, 0);
            (self.at, self.end) = (0, self.end - self.at);
            match self.stream.read(&mut self.received[self.end..]) {
                Ok(0) if self.leaving => return Err(RpcError::GoAway(0)),
                Ok(0) => return Err(RpcError::Io(io::ErrorKind::UnexpectedEof.into())),
                Ok(read) => {
                    self.end += read;
                    self.wait.heard();
                    // a peer that sends single bytes slowly never causes a read timeout
                    if self.wait.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
                        return Err(RpcError::Late);
                    }
                }
                Err(e) if timed_out(&e) => {
                    if self.wait.go_on()? {
                        self.ping()?;
                    }
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e.into()),
            }
        }
        Ok(())
    }
}

/// Whether a read or write has timed out.
fn timed_out(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}

/// Length of a reply, from its header. 0 until the header has arrived.
fn declared(reply: &[u8]) -> usize {
    match reply {
        [_, a, b, c, d, ..] => MESSAGE_HEAD + u32::from_be_bytes([*a, *b, *c, *d]) as usize,
        _ => 0,
    }
}

/// The header of a request. A first byte is an index of the static table: as a whole field (with bit 7), or as the name
/// of a field whose value follows.
fn request_header(authority: &str) -> Vec<u8> {
    let mut header = vec![
        0x83, // :method POST
        0x86, // :scheme http
    ];
    let mut field = |name: &[u8], value: &[u8]| {
        header.extend(name);
        // lengths of 127 or more would need further bytes; these are shorter
        header.push(value.len().min(126) as u8);
        header.extend(&value[..value.len().min(126)]);
    };
    field(&[4], PATH); // :path
    field(&[1], authority.as_bytes()); // :authority
    field(&[0x0f, 0x10], b"application/grpc"); // content-type
    field(b"\0\x02te", b"trailers");
    header
}

fn put_frame_head(out: &mut Vec<u8>, length: usize, kind: u8, flags: u8, stream: u32) {
    out.extend(&(length as u32).to_be_bytes()[1..]);
    out.extend([kind, flags]);
    out.extend(stream.to_be_bytes());
}

fn put_frame(out: &mut Vec<u8>, kind: u8, flags: u8, stream: u32, payload: &[u8]) {
    put_frame_head(out, payload.len(), kind, flags, stream);
    out.extend(payload);
}

/// Header of an uncompressed message.
fn message_head(message: &[u8]) -> [u8; MESSAGE_HEAD] {
    let [a, b, c, d] = (message.len() as u32).to_be_bytes();
    [0, a, b, c, d]
}

/// Removes the header from a reply.
fn unpack(reply: &mut Vec<u8>, sent: usize) -> Result<(), RpcError> {
    let Some(([compressed, length @ ..], rest)) = reply.split_first_chunk::<MESSAGE_HEAD>() else {
        // errors come in headers only
        return Err(RpcError::Refused(sent));
    };
    if *compressed != 0 {
        return Err(RpcError::Protocol("a reply is compressed"));
    }
    if u32::from_be_bytes(*length) as usize != rest.len() {
        return Err(RpcError::Protocol("a reply has another length than it says"));
    }
    reply.drain(..MESSAGE_HEAD);
    Ok(())
}

/// Contents of a padded DATA frame.
fn unpadded(payload: &[u8]) -> Result<&[u8], RpcError> {
    let (padding, rest) = payload.split_first().ok_or(RpcError::Protocol("a padded frame is empty"))?;
    let end = rest.len().checked_sub(usize::from(*padding));
    end.map(|end| &rest[..end]).ok_or(RpcError::Protocol("a frame is all padding"))
}

fn number(bytes: &[u8]) -> Result<u32, RpcError> {
    let first = bytes.first_chunk().ok_or(RpcError::Protocol("a frame is cut short"))?;
    Ok(u32::from_be_bytes(*first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::UnityMessage;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use prost::Message;
    use std::collections::VecDeque;

    /// A peer with prepared output that stores its input.
    #[derive(Default)]
    struct Script {
        said: VecDeque<u8>,
        heard: Vec<u8>,
    }

    impl Read for Script {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            // in small pieces, as on a network
            let n = out.len().min(7);
            self.said.read(&mut out[..n])
        }
    }
    impl Write for Script {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.heard.extend(bytes);
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Type, flags, stream and payload of a frame.
    type Frame<'a> = (u8, u8, u32, &'a [u8]);

    fn answering(frames: &[Frame]) -> Channel<Script> {
        let mut said = Vec::new();
        for (kind, flags, stream, payload) in frames {
            put_frame(&mut said, *kind, *flags, *stream, payload);
        }
        Channel::open(Script { said: said.into(), heard: Vec::new() }, "localhost:1").unwrap()
    }

    /// Frames after the preface: `(kind, flags, stream, payload)`.
    fn frames(mut bytes: &[u8]) -> Vec<(u8, u8, u32, Vec<u8>)> {
        bytes = bytes.strip_prefix(PREFACE).unwrap();
        let mut all = Vec::new();
        while let Some((head, rest)) = bytes.split_first_chunk::<FRAME_HEAD>() {
            let n = u32::from_be_bytes([0, head[0], head[1], head[2]]) as usize;
            let stream = u32::from_be_bytes([head[5], head[6], head[7], head[8]]);
            all.push((head[3], head[4], stream, rest[..n].to_vec()));
            bytes = &rest[n..];
        }
        all
    }

    #[test]
    fn a_reply_is_put_together_whatever_comes_between() {
        let window = 100_000u32.to_be_bytes();
        let mut channel = answering(&[
            (frame::SETTINGS, 0, 0, &[0, 4, 0, 1, 0, 0, 0, 5, 0, 0, 128, 0]),
            (frame::PING, 0, 0, b"12345678"),
            (frame::GOAWAY, 0, 0, &[127, 255, 255, 255, 0, 0, 0, 0]),
            (frame::HEADERS, flag::END_HEADERS, 1, b"whatever"),
            (frame::WINDOW_UPDATE, 0, 0, &window),
            (frame::WINDOW_UPDATE, 0, 1, &window),
            (frame::DATA, 0, 1, &[0, 0, 0, 0, 5, b'h', b'e']),
            (frame::DATA, flag::PADDED, 1, &[2, b'l', 0, 0]),
            (9, 0, 1, b"a continuation, say"),
            (frame::DATA, 0, 1, b"lo"),
            (frame::HEADERS, flag::END_HEADERS | flag::END_STREAM, 1, b"trailers"),
        ]);
        let mut reply = b"old".to_vec();
        channel.call(&vec![7; 70_000], &mut reply).unwrap();
        assert_eq!(reply, b"hello");
        let heard = frames(&channel.stream.heard);
        assert!(heard.contains(&(frame::SETTINGS, flag::ACK, 0, vec![])));
        assert!(heard.contains(&(frame::PING, flag::ACK, 0, b"12345678".to_vec())));
        let data: Vec<_> = heard.iter().filter(|f| f.0 == frame::DATA).collect();
        assert!(data.iter().all(|f| f.2 == 1 && f.3.len() <= 32768) && data.last().unwrap().1 == flag::END_STREAM);
        let sent = data.iter().flat_map(|f| &f.3).copied().collect::<Vec<u8>>();
        assert_eq!(sent, [&[0, 0, 1, 17, 112], &[7; 70_000][..]].concat());
    }

    #[test]
    fn what_is_no_reply_is_an_error() {
        let refused = (frame::HEADERS, flag::END_STREAM, 1, &b"grpc-status 8"[..]);
        let cases: [(&[Frame], &str); 9] = [
            (&[refused], "refused a message of 3 bytes"),
            (&[], "the connection broke"),
            (&[(frame::GOAWAY, 0, 0, &[0, 0, 0, 1, 0, 0, 0, 2])], "ended the connection (code 2)"),
            (&[(frame::GOAWAY, 0, 0, &[127, 255, 255, 255, 0, 0, 0, 0])], "ended the connection (code 0)"),
            (&[(frame::RST_STREAM, 0, 1, &[0, 0, 0, 8])], "broke off the exchange of a message of 3 bytes (code 8)"),
            (&[(frame::DATA, flag::END_STREAM, 1, &[1, 0, 0, 0, 0])], "compressed"),
            (&[(frame::DATA, flag::END_STREAM, 1, &[0, 0, 0, 0, 9, 1])], "another length"),
            (&[(frame::WINDOW_UPDATE, 0, 0, &[1])], "cut short"),
            (
                &[(frame::DATA, 0, 1, &[0, 64, 0, 0, 0])],
                "the trainer's message asks for 137.4 GB; the limit 'memory' is 2 GB",
            ),
        ];
        for (frames, expected) in cases {
            let error = answering(frames).call(b"abc", &mut Vec::new()).unwrap_err().to_string();
            assert!(error.contains(expected), "{error} / {expected}");
        }
    }

    #[test]
    fn a_peer_that_closes_amid_a_call_is_no_failure() {
        for (code, expected) in [(0, true), (2, true), (11, false)] {
            let left = [(frame::GOAWAY, 0, 0, &[0, 0, 0, 0, 0, 0, 0, code][..])];
            let error = answering(&left).call(b"abc", &mut Vec::new()).unwrap_err();
            assert_eq!(error.is_farewell(), expected, "{error}");
        }
    }

    proptest! {
        /// Whole frames with random contents, and invalid bytes: a call ends with a reply or an error.
        #[test]
        fn bytes_never_panic(
            whole in vec((0u8..10, any::<u8>(), 0u32..4, vec(any::<u8>(), 0..40)), 0..8),
            rest in vec(any::<u8>(), 0..100),
        ) {
            let frames: Vec<Frame> = whole.iter().map(|(kind, flags, stream, x)| (*kind, *flags, *stream, &x[..])).collect();
            let mut channel = answering(&frames);
            channel.stream.said.extend(rest);
            let mut reply = Vec::new();
            while channel.call(&[1; 20_000], &mut reply).is_ok() {
                let _ = UnityMessage::decode(&*reply);
            }
        }
    }
}
