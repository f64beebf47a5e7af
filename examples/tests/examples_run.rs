//! Every example runs and says what its essay says.

use std::path::Path;
use std::process::Command;

/// Runs an example in a folder and returns what it printed.
fn run(program: &str, folder: &Path, args: &[&str]) -> String {
    let output = Command::new(program).current_dir(folder).args(args).output().expect("the example starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{program} {args:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

#[test]
fn a_batch_repeats_itself_from_a_snapshot() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = run(env!("CARGO_BIN_EXE_step_a_batch"), folder.path(), &[]);
    assert!(out.contains("hopper: nq 7, nv 7, nu 4"), "{out}");
    assert!(out.contains("the same bits") && out.contains("0 states stopped being finite"), "{out}");
}

#[test]
fn a_backpack_pulls_backward() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = run(env!("CARGO_BIN_EXE_attach_a_backpack"), folder.path(), &[]);
    let bare = "without a backpack: 40.8 kg, nq 28, nu 21, 28 numbers in the start pose";
    assert_eq!(out.matches(bare).count(), 2, "{out}");
    assert!(out.contains("with a backpack: 50.8 kg, nq 29, nu 22, 29 numbers in the start pose"), "{out}");
    assert!(out.contains("there is no body 'tors'; did you mean 'torso'?"), "{out}");
    assert!(out.contains("with <motor name=\"strap\"> <accelerometer name=\"backpack\">"), "{out}");
    let x = |words| {
        let rest = out.split(words).nth(1).and_then(|rest| rest.split(',').next()).expect("a position");
        rest.parse::<f64>().expect("a number")
    };
    let (without, with) = (x("second without: torso at ["), x("second with: torso at ["));
    assert!(with < without - 0.1, "{out}");
}

#[test]
fn a_custom_agent_creeps_forward() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = run(env!("CARGO_BIN_EXE_custom_agent"), folder.path(), &[]);
    assert!(out.contains("Inchworm-v0: 19 observations, 2 actions, 50 decisions/s"), "{out}");
    let meters = out.split("s: ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a distance");
    assert!(meters.parse::<f64>().expect("a number") > 0.2, "{out}");
    assert!(out.contains(", 0 on their backs"), "{out}");
}

/// The number after some words.
fn number(text: &str, words: &str) -> f64 {
    let rest = text.split(words).nth(1).unwrap_or_else(|| panic!("no '{words}' in {text}"));
    rest.split(' ').next().unwrap_or_default().parse().expect("a number")
}

#[test]
fn a_rover_follows_its_schedule_and_its_caller() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = run(env!("CARGO_BIN_EXE_steer_an_agent"), folder.path(), &[]);
    assert!(out.contains("command: velocity from -2 to 2 m/s"), "{out}");
    // a command that changes every two seconds by more than 1 m/s on average
    assert!((0.02..0.4).contains(&number(&out, "for 9 s: ")), "{out}");
    assert!((number(&out, "told 1.5 m/s: ") - 1.5).abs() < 0.15, "{out}");
    assert!((number(&out, "told -1.5 m/s: ") + 1.5).abs() < 0.15, "{out}");
    assert!((0.02..0.4).contains(&number(&out, "again: ")), "{out}");
}

#[test]
fn a_policy_is_trained_saved_and_drawn() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = run(env!("CARGO_BIN_EXE_train_a_policy"), folder.path(), &["100000", "walker.safetensors"]);
    assert!(out.contains("32 episodes: ") && out.contains("wrote walker.safetensors"), "{out}");
    let out = run(env!("CARGO_BIN_EXE_render_a_policy"), folder.path(), &["walker.safetensors", "strip.png"]);
    assert!(out.contains("wrote strip.png: 6 frames"), "{out}");
    let png = std::fs::read(folder.path().join("strip.png")).expect("the picture");
    // width and height stand in the header
    assert_eq!(png[..8], *b"\x89PNG\r\n\x1a\n");
    let side = |at: usize| u32::from_be_bytes([png[at], png[at + 1], png[at + 2], png[at + 3]]);
    assert!(side(16) >= 6 * 240 && side(20) >= 320, "{} x {}", side(16), side(20));
}
