//! A picture or video that cannot be written completely is an error, and the older file of that name stays. The test
//! imitates a full disk: the system limits the size of every file that the process writes.

#![cfg(target_os = "linux")]

use crate::common::*;
use std::process::Command;

#[test]
fn a_video_that_finds_no_room_is_an_error() {
    let temp = tempfile::tempdir().unwrap();
    let policy = shipped("hopper");
    let encoder = Command::new("ffmpeg").arg("-version").output().is_ok();
    for (name, words) in [
        ("x.png", "--frames 2"),
        ("x.gif", "--seconds 0.2"),
        ("x.gif", "--seconds 2"),
        // the first frame fits into the encoder's buffers and fails at the end
        ("x.mp4", "--seconds 0.1"),
        ("x.mp4", "--seconds 2"),
    ] {
        if name == "x.mp4" && !encoder {
            println!("skipped: {name}: there is no ffmpeg");
            continue;
        }
        std::fs::write(temp.path().join(name), "older").unwrap();
        // unit: blocks of 512 bytes
        let script = format!(
            "trap '' XFSZ; ulimit -f 4; exec \"$0\" render '{policy}' --out {name} --width 320 --height 180 {words}"
        );
        let output = Command::new("sh").args(["-c", &script, program()]).current_dir(temp.path()).output().unwrap();
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{name} {words}: {text}");
        assert!(output.stdout.is_empty(), "{name} {words}: {}", String::from_utf8_lossy(&output.stdout));
        assert!(text.contains(name) && text.contains("File too large"), "{name} {words}: {text}");
        assert_eq!(std::fs::read(temp.path().join(name)).unwrap(), b"older", "{name} {words}");
        assert_no_leftovers(temp.path());
        // without the limit, the file is replaced
        succeed(
            temp.path(),
            &[&["render", &policy, "--out", name, "--width", "64"], &words.split(' ').collect::<Vec<_>>()[..]].concat(),
        );
        assert!(std::fs::read(temp.path().join(name)).unwrap().len() > 100);
    }
}

#[test]
fn a_strip_that_is_too_large_is_refused_before_it_is_played() {
    let temp = tempfile::tempdir().unwrap();
    let words = ["--width", "200", "--height", "200", "--frames", "1000", "--out", "x.png"];
    let text = fail(temp.path(), 1, &[&["render", &shipped("hopper")], &words[..]].concat());
    assert!(text.contains("is out of range: each side must be 1 to 16384"), "{text}");
    assert_eq!(files(temp.path()), [""; 0].map(std::path::PathBuf::from));
}
