//! Any bytes from a trainer are a message or an error: neither the transport, nor the messages, nor the side channels
//! panic on them, and side channels that are read are finite. The same holds for demonstration files, whose numbers are
//! those of the task.

#![no_main]

use libfuzzer_sys::fuzz_target;
use marathon_envs::Spec;
use marathon_mlagents::channels::{self, Message, Sampler};
use marathon_mlagents::read_demonstrations;
use marathon_mlagents::rpc::Channel;
use marathon_mlagents::wire::UnityMessage;
use prost::Message as _;
use std::io::{Cursor, Read, Result, Write};
use std::path::Path;

fuzz_target!(|data: &[u8]| {
    // as the bytes of a connection: calls until it breaks
    let mut channel = Channel::open(Peer(Cursor::new(data)), "localhost:5005").expect("a peer that takes everything");
    let mut reply = Vec::new();
    while channel.call(&[0; 70_000], &mut reply).is_ok() {
        look(&reply);
    }
    // as a message, and as side channels
    look(data);
    listen(data);
    // as a demonstration file, and also after a valid header
    demonstrate(data);
    demonstrate(&[&HEAD[..], &[0; 30], data].concat());
});

/// Version 1 of the format.
const HEAD: [u8; 3] = [2, 8, 1];

fn demonstrate(bytes: &[u8]) {
    let spec = Spec { id: "Task-v0".into(), obs: 2, act: 1, ..Spec::default() };
    let Ok(read) = read_demonstrations(Path::new("x.demo"), bytes, &spec) else { return };
    assert!(!read.decisions.is_empty() && read.actions.len() == read.decisions.len());
    assert!(read.obs.iter().chain(&read.actions).all(|x| x.is_finite()));
    assert!(read.decisions.iter().flatten().all(|entry| (entry + 1) * 2 <= read.obs.len()));
}

/// Says what the fuzzer wants, and does not listen.
struct Peer<'a>(Cursor<&'a [u8]>);

impl Read for Peer<'_> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        self.0.read(out)
    }
}
impl Write for Peer<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        Ok(bytes.len())
    }
    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

fn look(bytes: &[u8]) {
    let Ok(message) = UnityMessage::decode(bytes) else { return };
    let again = UnityMessage::decode(&*message.encode_to_vec()).expect("what was written can be read");
    assert_eq!(again.encode_to_vec(), message.encode_to_vec());
    if let Some(rl) = message.input.and_then(|input| input.rl) {
        listen(&rl.side_channel);
    }
}

fn listen(bytes: &[u8]) {
    let _ = channels::read(bytes, |message| {
        if let Message::Parameter(_, Sampler::MultiRange { ranges, .. }) = message {
            assert!(!ranges.is_empty() && ranges.iter().flatten().all(|x| x.is_finite()));
        }
    });
}
