//! Side channels: messages between trainer and player besides observations and actions.
//!
//! The bytes are `{16 bytes of channel, i32 length, payload}` one after another, all little-endian. A text is an `i32`
//! length and its characters, a list an `i32` count and its numbers. Unknown channels are skipped, because Python users
//! may open channels of their own.

use thiserror::Error;

/// A channel's identifier. Its first three fields are little-endian as on the wire.
pub type ChannelId = [u8; 16];

/// Engine configuration, to the player: e951342c-4f7e-11ea-b238-784f4387d1f7.
pub const ENGINE: ChannelId = id(0xe951342c, 0x4f7e, 0x11ea, 0xb238_784f4387d1f7);
/// Environment parameters, to the player: 534c891e-810f-11ea-a9d0-822485860400.
pub const PARAMETERS: ChannelId = id(0x534c891e, 0x810f, 0x11ea, 0xa9d0_822485860400);
/// Statistics, to the trainer: a1d8f7b7-cec8-50f9-b78b-d3e165a78520.
pub const STATS: ChannelId = id(0xa1d8f7b7, 0xcec8, 0x50f9, 0xb78b_d3e165a78520);
/// Facts about the training, to the player: b664a4a9-d86f-5a5f-95cb-e8353a7e8356.
pub const ANALYTICS: ChannelId = id(0xb664a4a9, 0xd86f, 0x5a5f, 0x95cb_e8353a7e8356);

const fn id(a: u32, b: u16, c: u16, d: u64) -> ChannelId {
    let (a, b, c, d) = (a.to_le_bytes(), b.to_le_bytes(), c.to_le_bytes(), d.to_be_bytes());
    [a[0], a[1], a[2], a[3], b[0], b[1], c[0], c[1], d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7]]
}

/// Limit on the intervals of a sampler. Every draw searches all of them.
const INTERVALS: usize = 1024;

/// A message of the trainer besides its actions.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// Engine settings.
    Engine(Engine),
    /// An environment parameter. It is kept until it is replaced.
    Parameter(String, Sampler),
    /// Facts about the training, which a player may ignore.
    Analytics,
    /// A channel that this player does not know.
    Unknown(ChannelId),
}

/// Engine settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Engine {
    /// Width and height of the window, pixels.
    Resolution(i32, i32),
    /// Level of quality of the picture, from 0.
    Quality(i32),
    /// Seconds simulated per second.
    TimeScale(f32),
    /// Frames per second shown; -1 for as many as possible.
    TargetFrameRate(i32),
    /// Frames per simulated second.
    CaptureFrameRate(i32),
}

/// Distribution of an environment parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Sampler {
    /// Always the same value.
    Constant(f32),
    /// Uniformly between two numbers.
    Uniform {
        /// Seed of the draws.
        seed: i32,
        /// Lowest value.
        min: f32,
        /// Highest value.
        max: f32,
    },
    /// From a normal distribution.
    Gaussian {
        /// Seed of the draws.
        seed: i32,
        /// Mean.
        mean: f32,
        /// Standard deviation.
        std: f32,
    },
    /// Uniformly from several intervals.
    MultiRange {
        /// Seed of the draws.
        seed: i32,
        /// Ends of the intervals.
        ranges: Vec<[f32; 2]>,
    },
}

/// An invalid side channel message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("side channels, byte {at}: {problem}")]
pub struct ChannelError {
    /// Position in all bytes.
    pub at: usize,
    /// The found and the expected value.
    pub problem: &'static str,
}

/// Reads all messages.
///
/// # Errors
/// At the first message that is cut short or invalid. `each` has received the messages before it.
pub fn read(bytes: &[u8], mut each: impl FnMut(Message)) -> Result<(), ChannelError> {
    let mut all = Reader { bytes, at: 0 };
    while all.at < bytes.len() {
        let channel: ChannelId = all.array()?;
        let payload = all.counted(1)?;
        let mut inner = Reader { bytes: &bytes[..all.at], at: all.at - payload.len() };
        each(match channel {
            ENGINE => Message::Engine(inner.engine()?),
            PARAMETERS => {
                let name = inner.text()?;
                Message::Parameter(name, inner.sampler()?)
            }
            ANALYTICS => Message::Analytics,
            other => Message::Unknown(other),
        });
    }
    Ok(())
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn fail<T>(&self, problem: &'static str) -> Result<T, ChannelError> {
        Err(ChannelError { at: self.at, problem })
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], ChannelError> {
        match self.bytes[self.at..].first_chunk() {
            Some(chunk) => {
                self.at += N;
                Ok(*chunk)
            }
            None => self.fail("they end in the middle of a message"),
        }
    }

    fn int(&mut self) -> Result<i32, ChannelError> {
        self.array().map(i32::from_le_bytes)
    }

    fn float(&mut self) -> Result<f32, ChannelError> {
        let at = self.at;
        let x = self.array().map(f32::from_le_bytes)?;
        if x.is_finite() { Ok(x) } else { Err(ChannelError { at, problem: "a number is not finite" }) }
    }

    /// Takes a number if it is NaN.
    fn nan(&mut self) -> bool {
        let at = self.at;
        let nan = self.array().map(f32::from_le_bytes).is_ok_and(f32::is_nan);
        self.at = if nan { self.at } else { at };
        nan
    }

    /// Takes a count and as many items of `size` bytes.
    fn counted(&mut self, size: usize) -> Result<&'a [u8], ChannelError> {
        let count = self.int()?;
        let length = usize::try_from(count).ok().and_then(|n| n.checked_mul(size));
        match length.and_then(|n| self.bytes[self.at..].get(..n)) {
            Some(items) => {
                self.at += items.len();
                Ok(items)
            }
            None => self.fail("a length is negative or beyond the end"),
        }
    }

    fn text(&mut self) -> Result<String, ChannelError> {
        let bytes = self.counted(1)?;
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }

    fn engine(&mut self) -> Result<Engine, ChannelError> {
        Ok(match self.int()? {
            0 => Engine::Resolution(self.int()?, self.int()?),
            1 => Engine::Quality(self.int()?),
            2 => Engine::TimeScale(self.float()?),
            3 => Engine::TargetFrameRate(self.int()?),
            4 => Engine::CaptureFrameRate(self.int()?),
            _ => return self.fail("an engine configuration is none of 0 to 4"),
        })
    }

    fn sampler(&mut self) -> Result<Sampler, ChannelError> {
        match self.int()? {
            0 if self.nan() => return Ok(Sampler::Constant(f32::NAN)),
            0 => return Ok(Sampler::Constant(self.float()?)),
            1 => {}
            _ => return self.fail("a parameter is neither a number (0) nor a sampler (1)"),
        }
        let seed = self.int()?;
        Ok(match self.int()? {
            0 => Sampler::Uniform { seed, min: self.float()?, max: self.float()? },
            1 => Sampler::Gaussian { seed, mean: self.float()?, std: self.float()? },
            2 => {
                let count = self.counted(4)?.len() / 4;
                self.at -= 4 * count;
                let numbers = (0..count).map(|_| self.float()).collect::<Result<Vec<_>, _>>()?;
                let (ranges, rest) = numbers.as_chunks::<2>();
                if ranges.len() > INTERVALS {
                    return self.fail("a sampler has more than 1024 intervals");
                }
                if ranges.is_empty() || !rest.is_empty() {
                    return self.fail("a sampler of intervals does not have two numbers for each");
                }
                Sampler::MultiRange { seed, ranges: ranges.to_vec() }
            }
            _ => return self.fail("a sampler is none of uniform (0), gaussian (1), multirange (2)"),
        })
    }
}

/// How the trainer aggregates the values of a statistic between two summaries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aggregation {
    /// Their mean.
    Average = 0,
    /// The last.
    MostRecent = 1,
    /// Their sum.
    Sum = 2,
    /// All of them, as a histogram.
    Histogram = 3,
}

/// Appends a statistic, which the trainer shows in TensorBoard under its name. Names are ASCII.
pub fn write_stat(bytes: &mut Vec<u8>, name: &str, value: f32, aggregation: Aggregation) {
    bytes.extend(STATS);
    bytes.extend((name.len() as i32 + 12).to_le_bytes());
    bytes.extend((name.len() as i32).to_le_bytes());
    bytes.extend(name.as_bytes());
    bytes.extend(value.to_le_bytes());
    bytes.extend((aggregation as i32).to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn message(channel: ChannelId, payload: &[&[u8]]) -> Vec<u8> {
        let payload = payload.concat();
        [&channel[..], &(payload.len() as i32).to_le_bytes(), &payload].concat()
    }

    fn all(bytes: &[u8]) -> Result<Vec<Message>, ChannelError> {
        let mut list = Vec::new();
        read(bytes, |message| list.push(message)).map(|()| list)
    }

    #[test]
    fn every_message_of_a_trainer_is_understood() {
        let int = i32::to_le_bytes;
        let float = f32::to_le_bytes;
        let name = [&int(4)[..], b"mass"].concat();
        let bytes = [
            message(ENGINE, &[&int(0), &int(84), &int(60)]),
            message(ENGINE, &[&int(2), &float(20.0)]),
            message(ENGINE, &[&int(3), &int(-1)]),
            message(PARAMETERS, &[&name, &int(0), &float(1.5)]),
            message(PARAMETERS, &[&name, &int(1), &int(7), &int(0), &float(0.5), &float(2.0)]),
            message(PARAMETERS, &[&name, &int(1), &int(7), &int(1), &float(1.0), &float(0.1)]),
            message(PARAMETERS, &[&name, &int(1), &int(7), &int(2), &int(2), &float(1.0), &float(3.0)]),
            message(ANALYTICS, &[b"anything"]),
            message([9; 16], &[b"anything"]),
        ]
        .concat();
        let mass = |sampler| Message::Parameter("mass".into(), sampler);
        assert_eq!(
            all(&bytes).unwrap(),
            [
                Message::Engine(Engine::Resolution(84, 60)),
                Message::Engine(Engine::TimeScale(20.0)),
                Message::Engine(Engine::TargetFrameRate(-1)),
                mass(Sampler::Constant(1.5)),
                mass(Sampler::Uniform { seed: 7, min: 0.5, max: 2.0 }),
                mass(Sampler::Gaussian { seed: 7, mean: 1.0, std: 0.1 }),
                mass(Sampler::MultiRange { seed: 7, ranges: vec![[1.0, 3.0]] }),
                Message::Analytics,
                Message::Unknown([9; 16]),
            ]
        );
        for end in 1..bytes.len() {
            let whole = all(&bytes[..end]).is_ok_and(|list| list.len() < 9);
            assert!(whole || all(&bytes[..end]).is_err(), "{end} bytes");
        }
        assert_eq!(
            all(&bytes[..10]).unwrap_err().to_string(),
            "side channels, byte 0: they end in the middle of a message"
        );
    }

    #[test]
    fn a_sampler_has_a_bounded_number_of_intervals() {
        let int = i32::to_le_bytes;
        let of = |n: usize| {
            let numbers = vec![0; 8 * n];
            let head = [int(4), *b"mass", int(1), int(7), int(2), int(2 * n as i32)].concat();
            all(&message(PARAMETERS, &[&head, &numbers]))
        };
        assert!(of(INTERVALS).is_ok());
        assert!(of(INTERVALS + 1).unwrap_err().to_string().contains("more than 1024 intervals"));
    }

    #[test]
    fn a_payload_does_not_reach_into_the_next_message() {
        let bytes = [message(ENGINE, &[&[0; 4]]), message(ENGINE, &[&[0; 12]])].concat();
        assert_eq!(all(&bytes).unwrap_err().at, 24);
    }

    proptest! {
        #[test]
        fn bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200), channel in 0usize..4) {
            let _ = all(&bytes);
            let _ = all(&message([ENGINE, PARAMETERS, STATS, ANALYTICS][channel], &[&bytes]));
        }
    }
}
