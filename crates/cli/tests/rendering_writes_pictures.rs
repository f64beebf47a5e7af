//! `marathon render` draws a policy as a strip or an animation and reports what it wrote.

use crate::common::{SMALL, assert_no_leftovers, json, succeed};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

fn trained() -> tempfile::TempDir {
    let temp = tempfile::tempdir().unwrap();
    succeed(temp.path(), &[&SMALL[..], &["1", "--steps", "8k", "--out", "a"]].concat());
    temp
}

fn png_size(path: &Path) -> (u32, u32) {
    let decoder = png::Decoder::new(BufReader::new(File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).expect("a whole picture");
    let info = reader.info();
    (info.width, info.height)
}

#[test]
fn a_strip_has_its_frames_side_by_side() {
    let temp = trained();
    let args =
        ["render", "a", "--out", "x.png", "--frames", "5", "--width", "60", "--height", "80", "--seconds", "0.5"];
    let text = succeed(temp.path(), &args);
    assert!(text.starts_with("wrote x.png (5 frames of 60x80"), "{text}");
    // thin lines between the frames
    assert_eq!(png_size(&temp.path().join("x.png")), (5 * 60 + 4, 80));
    // the same policy and seed give the same picture
    let first = std::fs::read(temp.path().join("x.png")).unwrap();
    succeed(temp.path(), &args);
    assert_eq!(std::fs::read(temp.path().join("x.png")).unwrap(), first);
    assert_no_leftovers(temp.path());
}

#[test]
fn an_animation_lasts_as_long_as_asked() {
    let temp = trained();
    let args =
        ["render", "a/policy.safetensors", "--out", "x.gif", "--width", "96", "--seconds", "0.4", "--agents", "2"];
    let report = json(&succeed(temp.path(), &[&args[..], &["--json"]].concat()));
    assert_eq!((report["frames"].as_u64(), report["agents"].as_u64()), (Some(10), Some(2)));
    assert_eq!((report["width"].as_u64(), report["height"].as_u64()), (Some(96), Some(54)));
    assert!(report["distance_mean"].as_f64().unwrap().is_finite());
    let gif = std::fs::read(temp.path().join("x.gif")).unwrap();
    assert!(gif.starts_with(b"GIF89a") && gif.ends_with(b";"));
    assert_eq!([gif[6], gif[7], gif[8], gif[9]], [96, 0, 54, 0]);
    assert_no_leftovers(temp.path());
}

#[test]
fn a_fall_is_shown_and_told() {
    let temp = trained();
    // after two iterations the character cannot stand for long
    let args = ["render", "a", "--out", "x.gif", "--width", "64", "--seconds", "20", "--json"];
    let report = json(&succeed(temp.path(), &args));
    assert_eq!(report["falls"], 1);
    assert!(report["seconds"].as_f64().unwrap() < 19.0, "the video ends after the fall");
}
