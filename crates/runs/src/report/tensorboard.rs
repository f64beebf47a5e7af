//! Event files for TensorBoard, with scalars only.
//!
//! A file is a sequence of TFRecords (`u64` length, masked CRC-32C of the length, data, masked CRC-32C of the data; all
//! little-endian, `tensorflow/core/lib/io/record_writer.cc`), each an `Event` in protocol buffer encoding
//! (`tensorflow/core/util/event.proto`):
//!
//! ```text
//! Event   { double wall_time = 1; int64 step = 2; string file_version = 3; Summary summary = 5; SessionLog session_log = 7 }
//! Summary { repeated Value value = 1 }   Value { string tag = 1; float simple_value = 2 }
//! SessionLog { SessionStatus status = 1 }   START = 1
//! ```

use crate::error::RunError;
use crate::folder::{EVENTS, RunFolder};
use crc::{CRC_32_ISCSI, Crc, Table};
use marathon_learn::{IterationStats, Learned, write_atomic};
use marathon_physics::budget;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

const CASTAGNOLI: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISCSI);
/// Bytes of a record around its data: length, its checksum, and the data's checksum.
const FRAME: (usize, usize) = (12, 4);

/// Appends events to its own file.
pub struct EventLog {
    path: PathBuf,
    file: File,
}

/// Tags and values of an iteration, with ML-Agents' names where they exist. `terms` are the reward terms of all roles.
/// Tags of roles other than the first begin with the role's name.
pub fn scalars(stats: &IterationStats, steps_per_second: f64, terms: &[String]) -> Vec<(String, f64)> {
    let IterationStats { learned, others, .. } = stats;
    let of_run = [
        ("Environment/Episode Length", stats.length_mean),
        ("Environment/Speed", stats.speed_mean),
        ("Environment/Falls", stats.fall_fraction),
        ("Environment/Diverged", Some(stats.diverged as f64)),
        ("Performance/Steps Per Second", Some(steps_per_second)),
        ("Performance/Wall Seconds", Some(stats.wall_seconds)),
        ("Performance/CPU Seconds", Some(stats.cpu_seconds)),
    ];
    let of_run = of_run.into_iter().filter_map(|(tag, x)| Some((tag.to_string(), x?)));
    let of_others = others
        .iter()
        .flat_map(|(role, learned)| of_learning(learned).into_iter().map(move |(tag, x)| (format!("{role}/{tag}"), x)));
    let all = [learned].into_iter().chain(others.iter().map(|(_, learned)| learned));
    let all = all.flat_map(|learned| &learned.reward_terms);
    let terms = terms.iter().zip(all).map(|(term, x)| (format!("Reward/{term}"), *x));
    let metrics = stats.metrics.iter().map(|(metric, x)| (format!("Metric/{metric}"), *x));
    of_learning(learned).into_iter().chain(of_run).chain(of_others).chain(terms).chain(metrics).collect()
}

/// Values of a role's rewards and learning.
fn of_learning(learned: &Learned) -> Vec<(String, f64)> {
    let fixed = [
        ("Environment/Cumulative Reward", learned.return_mean),
        ("Losses/Policy Loss", Some(learned.policy_loss)),
        ("Losses/Value Loss", Some(learned.value_loss)),
        ("Policy/Entropy", Some(learned.entropy)),
        ("Policy/Learning Rate", Some(learned.lr)),
        ("Policy/KL Divergence", Some(learned.kl)),
        ("Policy/Clip Fraction", Some(learned.clip_fraction)),
        ("Policy/Standard Deviation", Some(learned.std_mean)),
        ("Policy/Explained Variance", Some(learned.explained_variance)),
    ];
    let name = |reward: &str| {
        let (first, rest) = reward.split_at(1);
        format!("Policy/{}{rest} Reward", first.to_uppercase())
    };
    let signals = learned.signal_rewards.iter().map(|(reward, x)| (name(reward), *x));
    fixed.into_iter().filter_map(|(tag, x)| Some((tag.to_string(), x?))).chain(signals).collect()
}

impl EventLog {
    /// Starts a file for a run that has done `steps` steps. Later events are removed from the run's older files. The
    /// new file tells a running TensorBoard to discard them.
    ///
    /// # Errors
    /// If a file cannot be read or written.
    pub fn open(folder: &RunFolder, steps: u64) -> Result<Self, RunError> {
        let older = folder.events()?;
        for path in &older {
            cut(path, steps)?;
        }
        // TensorBoard reads files in the order of their names
        let seconds = now() as u64;
        let path = |n: usize| folder.path().join(format!("{EVENTS}.{seconds:010}.marathon.{n:04}"));
        let path = (older.len()..).map(path).find(|path| !older.contains(path)).unwrap_or_default();
        // never write through an existing link
        let file = OpenOptions::new().create_new(true).append(true).open(&path);
        let file = file.map_err(RunError::io(&path, "create"))?;
        let mut log = Self { path, file };
        let version = message(0, |event| event.text(3, "brain.Event:2"));
        let mut start = record(&version);
        if steps > 0 {
            start.extend(record(&message(steps + 1, |event| event.bytes(7, &[1 << 3, 1]))));
        }
        log.write(&start)?;
        Ok(log)
    }

    /// Appends one event with all scalars of a step.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn push(&mut self, step: u64, scalars: &[(String, f64)]) -> Result<(), RunError> {
        let mut summary = Message::default();
        for (tag, x) in scalars {
            let mut value = Message::default();
            value.text(1, tag);
            value.float(2, *x as f32);
            summary.bytes(1, &value.0);
        }
        self.write(&record(&message(step, |event| event.bytes(5, &summary.0))))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), RunError> {
        self.file.write_all(bytes).map_err(RunError::io(&self.path, "write"))
    }
}

/// Removes records after a step, and an incomplete last record of a killed process.
fn cut(path: &Path, steps: u64) -> Result<(), RunError> {
    let bytes = budget::read(path, &budget::TABLE_FILE).map_err(RunError::io(path, "read"))?;
    let mut kept = Vec::with_capacity(bytes.len());
    for (whole, data) in records(&bytes) {
        if step_of(data) <= steps {
            kept.extend_from_slice(whole);
        }
    }
    if kept.len() < bytes.len() {
        write_atomic(path, &kept)?
    }
    Ok(())
}

/// Complete records of a file, with the data in each.
fn records(mut bytes: &[u8]) -> impl Iterator<Item = (&[u8], &[u8])> {
    std::iter::from_fn(move || {
        let length = u64::from_le_bytes(*bytes.first_chunk()?);
        let end = usize::try_from(length).ok()?.checked_add(FRAME.0 + FRAME.1)?;
        let (whole, rest) = bytes.split_at_checked(end)?;
        let data = &whole[FRAME.0..end - FRAME.1];
        bytes = rest;
        (whole[end - FRAME.1..] == masked_crc(data).to_le_bytes()).then_some((whole, data))
    })
}

/// The step of an event. Marathon's events have it right after the time.
fn step_of(event: &[u8]) -> u64 {
    let Some((&key, mut rest)) = event.get(9..).and_then(|e| e.split_first()) else { return 0 };
    let (mut step, mut shift) = (0, 0);
    while let Some((byte, after)) = rest.split_first().filter(|_| key == 2 << 3 && shift < 64) {
        step |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            break;
        }
        (rest, shift) = (after, shift + 7);
    }
    step
}

fn record(data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    let parts = [&length[..], &masked_crc(&length).to_le_bytes(), data, &masked_crc(data).to_le_bytes()];
    parts.concat()
}

/// TFRecord's checksum: rotated and shifted, so that data that contain checksums do not match their own checksum.
fn masked_crc(data: &[u8]) -> u32 {
    CASTAGNOLI.checksum(data).rotate_right(15).wrapping_add(0xa282_ead8)
}

fn now() -> f64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0.0, |t| t.as_secs_f64())
}

/// An event at the current time.
fn message(step: u64, fill: impl FnOnce(&mut Message)) -> Vec<u8> {
    let mut event = Message::default();
    event.double(1, now());
    event.varint(2 << 3);
    event.varint(step);
    fill(&mut event);
    event.0
}

/// A protocol buffer message under construction.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn varint(&mut self, mut x: u64) {
        while x >= 0x80 {
            self.0.push(x as u8 | 0x80);
            x >>= 7;
        }
        self.0.push(x as u8);
    }
    fn double(&mut self, field: u64, x: f64) {
        self.varint(field << 3 | 1);
        self.0.extend(x.to_le_bytes());
    }
    fn float(&mut self, field: u64, x: f32) {
        self.varint(field << 3 | 5);
        self.0.extend(x.to_le_bytes());
    }
    fn bytes(&mut self, field: u64, x: &[u8]) {
        self.varint(field << 3 | 2);
        self.varint(x.len() as u64);
        self.0.extend(x);
    }
    fn text(&mut self, field: u64, x: &str) {
        self.bytes(field, x.as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_castagnoli() {
        // RFC 3720, B.4: 32 bytes of zeros
        assert_eq!(CASTAGNOLI.checksum(&[0; 32]), 0x8a91_36aa);
    }

    #[test]
    fn events_after_a_step_are_cut() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events");
        let events: Vec<u8> = [100, 200, 70_000].iter().flat_map(|step| record(&message(*step, |_| {}))).collect();
        std::fs::write(&path, &events[..events.len() - 3]).unwrap();
        cut(&path, 1_000_000).unwrap();
        let steps = |path: &Path| records(&std::fs::read(path).unwrap()).map(|(_, e)| step_of(e)).collect::<Vec<_>>();
        assert_eq!(steps(&path), [100, 200], "half a record goes");
        std::fs::write(&path, &events).unwrap();
        cut(&path, 69_999).unwrap();
        assert_eq!(steps(&path), [100, 200]);
        std::fs::write(&path, &events).unwrap();
        cut(&path, 70_000).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), events);
    }
}
