//! The player never waits forever. If the other program does not answer, closes the connection or stops, the error
//! describes what happened. `marathon-player` then exits with a code other than 0. The player waits for a busy trainer.
//! Requests of a trainer are checked before anything is created.

use crate::common::{FakeTrainer, close, listen, reset};
use marathon_mlagents::{BehaviorOptions, Log, Player, PlayerError, PlayerOptions};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Output};
use std::thread;
use std::time::{Duration, Instant};

/// A PING frame, which requires an answer.
const PING: [u8; 17] = [0, 0, 8, 6, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8];

/// Runs the program against a listener that handles its connection with this function.
fn against(seconds: u64, listener: impl FnOnce(TcpStream) + Send + 'static) -> (Output, Duration) {
    let socket = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let port = socket.local_addr().unwrap().port();
    let peer = thread::spawn(move || listener(socket.accept().unwrap().0));
    let begun = Instant::now();
    let output = Command::new(env!("CARGO_BIN_EXE_marathon-player"))
        .args(["--mlagents-port", &port.to_string(), "--num-spawn-envs=1"])
        .args(["--connect-timeout", &seconds.to_string()])
        .output()
        .unwrap();
    let took = begun.elapsed();
    peer.join().unwrap();
    (output, took)
}

fn assert_fails(output: &Output, expected: &str) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains(expected), "{text}");
}

#[test]
fn a_listener_that_says_nothing_ends_the_player_in_time() {
    let (output, took) = against(3, |mut stream| {
        // reads until the player gives up
        let _ = stream.read_to_end(&mut Vec::new());
    });
    assert_fails(&output, "has not answered within 3 s (--connect-timeout); is it mlagents-learn?");
    assert!(took > Duration::from_millis(2900) && took < Duration::from_secs(30), "{took:?}");
}

#[test]
fn a_listener_that_says_little_ends_the_player_in_time() {
    let (output, took) = against(2, |mut stream| {
        while stream.write_all(&PING).is_ok() {
            thread::sleep(Duration::from_millis(10));
        }
    });
    assert_fails(&output, "has not answered within 2 s");
    assert!(took < Duration::from_secs(30), "{took:?}");
}

#[test]
fn a_listener_that_closes_ends_the_player_with_an_error() {
    let (output, _) = against(30, drop);
    assert_fails(&output, "closed the connection before it answered");
    let (output, _) = against(30, |mut stream| stream.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n").unwrap());
    assert_fails(&output, "error: ");
}

/// Connects a trainer to a player of one hopper, which treats the trainer as gone after this silence.
fn converse(silence: Duration, trainer: impl FnOnce(FakeTrainer) + Send + 'static) -> Result<(), PlayerError> {
    let (port, accept) = listen();
    let trainer = thread::spawn(move || trainer(accept()));
    let behaviors = vec![BehaviorOptions { agents: 1, ..Default::default() }];
    let options = PlayerOptions { port, behaviors, silence: Some(silence), ..Default::default() };
    let result = Player::connect(&options, Log::to_stderr()).and_then(|mut player| player.run());
    trainer.join().expect("the trainer is content");
    result
}

#[test]
fn a_trainer_that_stops_is_noticed_and_one_that_is_busy_is_waited_for() {
    let silence = Duration::from_millis(600);
    // the trainer does not answer a ping, first before the first command, then during training
    for orders in [0, 1] {
        let result = converse(silence, move |mut trainer| {
            trainer.greet(1, 1);
            for _ in 0..orders {
                trainer.answer(&reset(Vec::new()));
                trainer.receive().expect("observations");
            }
            trainer.ignore_until_closed();
        });
        let error = result.unwrap_err().to_string();
        assert!(error.contains("does not answer a ping") && error.contains("--answer-timeout"), "{error}");
    }
    let result = converse(silence, |mut trainer| {
        trainer.greet(1, 1);
        trainer.answer(&reset(Vec::new()));
        trainer.receive().expect("observations");
        // three times the allowed silence
        assert!(trainer.answer_pings_for(Duration::from_millis(1800)) > 0);
        trainer.answer(&close());
    });
    assert!(result.is_ok(), "{result:?}");
}

#[test]
fn areas_beyond_a_message_are_refused_before_anything_is_made() {
    for areas in [1_000_000, i32::MAX] {
        let begun = Instant::now();
        let result = converse(Duration::from_secs(60), move |mut trainer| {
            trainer.receive().expect("a greeting");
            trainer.answer_greeting(1, areas);
        });
        let error = result.unwrap_err().to_string();
        assert!(error.contains(&format!("{areas} agents of Hopper-v0?team=0 are too many")), "{error}");
        assert!(error.contains("ML-Agents accepts 4194304"), "{error}");
        assert!(begun.elapsed() < Duration::from_secs(20));
    }
}
