//! `marathon bench` measures what it documents, with output for people and for programs.

use crate::common::python;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn bench(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_marathon")).arg("bench").args(args).output().expect("the program starts")
}

fn json(args: &[&str]) -> Value {
    let out = bench(&[args, &["--json", "--seconds", "0.05"]].concat());
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).expect("one JSON object")
}

/// Checks the common fields of every row. Returns the rows.
fn check(document: &Value, bench: &str, threads: u64) -> Vec<Value> {
    assert_eq!(document["bench"], bench);
    assert!(document["machine"]["cores"].as_u64().unwrap() >= 1);
    assert!(document["machine"]["isas"].as_array().unwrap().contains(&document["machine"]["best_isa"]));
    let rows = document["rows"].as_array().unwrap();
    assert!(!rows.is_empty());
    for row in rows {
        assert_eq!(row["threads"], threads);
        for key in ["lanes", "agents", "repetitions", "steps"] {
            assert!(row[key].as_u64().unwrap() >= 1, "{key}: {row}");
        }
        let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key}: {row}"));
        assert!(number("steps_per_wall_second") > 0.0 && number("spread") >= 0.0, "{row}");
        let product = number("ns_per_agent_step") * number("steps_per_cpu_second");
        assert!((product / 1e9 - 1.0).abs() < 1e-9, "{row}");
    }
    rows.clone()
}

#[test]
fn physics_has_a_row_per_agent_and_instruction_set() {
    let document = json(&["physics", "--agent", "hopper", "--agent", "ant"]);
    let rows = check(&document, "physics", 1);
    let isas = document["machine"]["isas"].as_array().unwrap();
    let got: Vec<_> = rows.iter().map(|row| (row["agent"].as_str().unwrap(), &row["isa"])).collect();
    let want: Vec<_> = ["Hopper-v0", "Ant-v0"].iter().flat_map(|a| isas.iter().map(move |isa| (*a, isa))).collect();
    assert_eq!(got, want);
    assert!(rows.iter().all(|row| row["non_finite"] == 0 && row["contacts"].as_f64().unwrap() > 0.0), "{rows:?}");
}

#[test]
fn physics_takes_model_files_and_threads() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/agents/walker2d.xml");
    let document = json(&["physics", "--model", file, "--isa", "f32", "--threads", "2"]);
    let rows = check(&document, "physics", 2);
    assert_eq!((rows.len(), &rows[0]["agent"], &rows[0]["agents"]), (1, &"walker2d".into(), &128.into()));
}

#[test]
fn env_counts_decisions() {
    let rows = check(&json(&["env", "--agent", "hopper", "--isa", "f32"]), "env", 1);
    assert_eq!((&rows[0]["lanes"], &rows[0]["frame_skip"]), (&1.into(), &4.into()));
    // random actions fell a hopper within a second, so resets are measured too
    assert!((2.0..100.0).contains(&rows[0]["episode_length"].as_f64().unwrap()), "{rows:?}");
}

#[test]
fn train_includes_everything() {
    let rows = check(&json(&["train", "--agent", "hopper"]), "train", 1);
    let share = |key: &str| rows[0][key].as_f64().unwrap();
    assert!(share("env_share") > 0.05 && share("update_share") > 0.05, "{rows:?}");
    assert!(share("env_share") + share("update_share") < 1.0, "{rows:?}");
    assert!((share("physics_steps_per_wall_second") / share("steps_per_wall_second") - 4.0).abs() < 1e-9);
    assert_eq!(rows[0]["repetitions"], 3);
}

fn against_mujoco(python: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_marathon"));
    command.args(["bench", "physics", "--against", "mujoco", "--seconds", "0.05"]).args(args);
    command.env("MARATHON_PYTHON", python).output().expect("the program starts")
}

#[test]
fn both_engines_run_the_same_workload() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/agents/ant.xml");
    let args = ["--agent", "hopper", "--model", file, "--isa", "f64", "--isa", "f32", "--threads", "2", "--json"];
    let out = against_mujoco(&python(), &args);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let document: Value = serde_json::from_slice(&out.stdout).expect("one JSON object");
    assert_eq!((&document["bench"], &document["against"]), (&"physics".into(), &"mujoco".into()));
    assert!(document["mujoco_version"].as_str().unwrap().starts_with(|c: char| c.is_ascii_digit()), "{document}");
    let rows = document["rows"].as_array().unwrap();
    let got: Vec<_> = rows.iter().map(|row| (row["agent"].as_str().unwrap(), row["isa"].as_str().unwrap())).collect();
    assert_eq!(got, [("Hopper-v0", "f64"), ("Hopper-v0", "f32"), ("ant", "f64"), ("ant", "f32")]);
    for row in rows {
        let side = |side: &str, key: &str| row[side][key].as_f64().unwrap_or_else(|| panic!("{side} {key}: {row}"));
        for (ratio, key) in [("ratio", "ns_per_agent_step"), ("wall_ratio", "wall_ns_per_agent_step")] {
            let got = row[ratio].as_f64().unwrap();
            assert!(got.is_finite() && got > 0.0, "{row}");
            assert!((got * side("marathon", key) / side("mujoco", key) - 1.0).abs() < 1e-9, "{row}");
        }
        // the same physics under the same kind of torques: as often on the ground
        let [theirs, ours] = ["mujoco", "marathon"].map(|engine| side(engine, "contacts"));
        assert!(ours > 0.5 && (ours / theirs - 1.0).abs() < 0.2, "contacts: {ours} and MuJoCo's {theirs}");
        assert_eq!((&row["mujoco"]["broken"], &row["marathon"]["broken"]), (&0.into(), &0.into()));
    }
}

/// The same states and controls on both sides: half a second later, the number of contacts still agrees.
#[test]
fn both_engines_do_what_a_policy_did() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/policies/humanoid.safetensors");
    let args = ["--policy", file, "--isa", "f64", "--isa", "f32", "--agents", "16", "--threads", "2", "--json"];
    let out = against_mujoco(&python(), &args);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let document: Value = serde_json::from_slice(&out.stdout).expect("one JSON object");
    let rows = document["rows"].as_array().unwrap();
    assert_eq!(rows.iter().map(|row| &row["agent"]).collect::<Vec<_>>(), ["Humanoid-v0"; 2]);
    for row in rows {
        let contacts = ["mujoco", "marathon"].map(|engine| row[engine]["contacts"].as_f64().unwrap());
        assert!(contacts[1] > 0.3 && (contacts[1] / contacts[0] - 1.0).abs() < 0.1, "{contacts:?}");
        // six scenes of 20 decisions in each of five turns, on two threads
        let turn = 6 * 20 * 5 * 16 * 2;
        for engine in ["mujoco", "marathon"] {
            let steps = row[engine]["steps"].as_u64().unwrap();
            assert!(steps >= 5 * turn && steps % turn == 0, "{engine}: {steps} steps");
        }
        assert_eq!((&row["mujoco"]["broken"], &row["marathon"]["broken"]), (&0.into(), &0.into()));
    }
    let out = against_mujoco(&python(), &["--policy", file, "--limp"]);
    assert_eq!(out.status.code(), Some(2), "a policy's agents are not limp");
}

#[test]
fn one_agent_of_a_crowd_is_timed_from_its_first_step() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("crates.xml");
    // a stack of crates; motors would throw them around
    let body = |k: usize| {
        let z = 0.1 + 0.2 * k as f64;
        format!(r#"<body pos="0 0 {z}"><joint name="x{k}" type="free"/><geom type="box" size=".2 .2 .1"/></body>"#)
    };
    let stack: String = (0..6).map(body).collect();
    let motor = |k: usize| format!(r#"<motor joint="x{k}" gear="9000 0 9000 0 0 0" ctrlrange="-1 1"/>"#);
    let motors: String = (0..6).map(motor).collect();
    let model = format!(
        r#"<mujoco><worldbody><geom type="plane" size="9 9 1"/>{stack}</worldbody>
           <actuator>{motors}</actuator></mujoco>"#
    );
    std::fs::write(&file, model).unwrap();
    let args = ["--model", file.to_str().unwrap(), "--isa", "f32", "--json", "--contacts", "all", "--limp"];
    let args = [&args[..], &["--agents", "1", "--warmup", "0"]].concat();
    let out = against_mujoco(&python(), &args);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let document: Value = serde_json::from_slice(&out.stdout).expect("one JSON object");
    assert_eq!((&document["agents"], &document["warmup"], &document["limp"]), (&1.into(), &0.into(), &true.into()));
    for engine in ["mujoco", "marathon"] {
        let side = &document["rows"][0][engine];
        // five turns of 64 agents take as many steps at the least; all crates stay on each other
        assert!(side["steps"].as_u64().unwrap() < 5 * 64 * 400, "{engine}: {side}");
        assert!((20.0..=32.0).contains(&side["contacts"].as_f64().unwrap()), "{engine}: {side}");
    }
}

#[test]
fn contacts_between_bodies_count_on_both_sides() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("pair.xml");
    // two balls that touch each other, without ground
    let model = r#"<mujoco><option gravity="0 0 0"/><worldbody><body><freejoint/><geom size="0.1"/></body>
        <body pos="0.15 0 0"><joint type="hinge" axis="0 0 1" pos="0.3 0 0" stiffness="200" damping="5"/><geom size="0.1"/>
        </body><body pos="-0.15 0 0"><joint type="hinge" axis="0 0 1" pos="-0.3 0 0" stiffness="200" damping="5"/>
        <geom size="0.1"/></body></worldbody></mujoco>"#;
    std::fs::write(&file, model).unwrap();
    for (which, low, high) in [("ground", 0.0, 0.0), ("all", 0.1, 3.0)] {
        let args = ["--model", file.to_str().unwrap(), "--isa", "f64", "--json", "--contacts", which];
        let out = against_mujoco(&python(), &args);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let document: Value = serde_json::from_slice(&out.stdout).expect("one JSON object");
        let side = |engine: &str| document["rows"][0][engine]["contacts"].as_f64().unwrap();
        let (theirs, ours) = (side("mujoco"), side("marathon"));
        assert!((low..=high).contains(&ours) && (low..=high).contains(&theirs), "{which}: {ours}, MuJoCo's {theirs}");
        assert!((ours - theirs).abs() <= 0.2 * theirs, "{which}: {ours}, MuJoCo's {theirs}");
    }
}

#[test]
fn people_get_the_ratio() {
    let out = against_mujoco(&python(), &["--agent", "hopper", "--isa", "f32"]);
    let text = String::from_utf8(out.stdout).unwrap();
    let row = text.lines().find(|line| line.starts_with("Hopper-v0")).unwrap_or_else(|| panic!("{text}"));
    let header = text.lines().find(|line| line.starts_with("agent")).unwrap();
    assert_eq!((header.len(), row.matches("x ").count()), (row.len(), 2), "{text}");
    for part in ["MuJoCo 4", "contacts with the ground only", "processor time", "time passed", "contacts per agent"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[cfg(unix)]
#[test]
fn a_python_without_mujoco_is_told_what_to_install() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let script = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        path
    };
    // a Python without packages, a program other than Python, a missing program
    let bare = script("bare", &format!("exec '{}' -S -I \"$@\"", python().display()));
    let broken = script("broken", "echo out of order >&2; exit 3");
    let missing = folder.path().join("missing");
    for (python, messages) in [
        (&bare, &["No module named 'mujoco'", "bare -m pip install mujoco", "MARATHON_PYTHON"][..]),
        (&broken, &["ended early (exit status: 3)", "out of order", "MARATHON_PYTHON"]),
        (&missing, &["cannot be started", "python3 -m pip install mujoco", "MARATHON_PYTHON"]),
    ] {
        let out = against_mujoco(python, &["--agent", "hopper"]);
        let text = String::from_utf8_lossy(&out.stderr);
        assert_eq!((out.status.code(), &out.stdout[..]), (Some(1), &b""[..]), "{text}");
        for message in messages {
            assert!(text.contains(message), "{message}: {text}");
        }
    }
}

#[cfg(unix)]
#[test]
fn what_mujoco_refuses_is_passed_on() {
    // a model that is different when it is read again
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("model.xml");
    let ball = r#"<mujoco><worldbody><body><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"#;
    std::fs::write(&file, ball).unwrap();
    let late = folder.path().join("python");
    let text = format!("#!/bin/sh\necho '<mujoco' > '{}'\nexec '{}' \"$@\"\n", file.display(), python().display());
    std::fs::write(&late, text).unwrap();
    std::fs::set_permissions(&late, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    let out = against_mujoco(&late, &["--model", file.to_str().unwrap(), "--isa", "f32"]);
    let text = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{text}");
    assert!(text.contains("model 'model'") && text.contains("XML"), "{text}");
}

#[test]
fn gait_trains_until_the_bar_is_met() {
    let config = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/configs/hopper-fast.yaml");
    let bar = ["--every", "100000", "--speed=-9", "--falls", "100"];
    let seed = ["--seeds", "1", "--first-seed", "7", "--config", config, "--json"];
    let out = bench(&[&["gait", "--agent", "hopper"][..], &bar, &seed].concat());
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let document: Value = serde_json::from_slice(&out.stdout).expect("one JSON object");
    assert_eq!((&document["bench"], &document["threads"]), (&"gait".into(), &1.into()));
    let runs = document["runs"].as_array().unwrap();
    assert_eq!((runs.len(), &runs[0]["agent"], &runs[0]["seed"]), (1, &"Hopper-v0".into(), &7.into()));
    assert_eq!((&runs[0]["reached"], &runs[0]["diverged"]), (&true.into(), &0.into()), "{runs:?}");
    assert!((100_000..200_000).contains(&runs[0]["steps"].as_u64().unwrap()), "{runs:?}");
}

#[test]
fn people_get_a_table() {
    let out = bench(&["physics", "--agent", "hopper", "--isa", "f32", "--seconds", "0.05"]);
    let text = String::from_utf8(out.stdout).unwrap();
    let rows: Vec<_> = text.lines().filter(|line| line.starts_with("Hopper-v0")).collect();
    assert_eq!(rows.len(), 1, "{text}");
    for part in ["cores", "instruction sets", "processor time", "ns/step", "steps/cpu s"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let header = text.lines().find(|line| line.starts_with("agent")).unwrap();
    assert_eq!(header.len(), rows[0].len(), "{text}");
}

/// A policy that ignores commands.
const HOPPER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/policies/hopper.safetensors");

#[test]
fn controller_tells_how_a_policy_obeys() {
    let policy = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/policies/MarathonManSteer.safetensors");
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("responses.png");
    let args = ["controller", policy, "--episodes", "6", "--threads", "1"];
    let out = bench(&[&args[..], &["--json", "--out", picture.to_str().unwrap()]].concat());
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let document: Value = serde_json::from_slice(&out.stdout).expect("one JSON object");
    assert_eq!((&document["bench"], &document["task"]), (&"controller".into(), &"MarathonManSteer-v0".into()));
    let lengths = ["responses", "turns", "pushes"].map(|key| document[key].as_array().unwrap().len());
    assert_eq!(lengths, [6, 3, 3]);
    for response in document["responses"].as_array().unwrap() {
        // four seconds of 40 decisions; agents that have fallen before are not counted
        assert!(response["agents"].as_u64().unwrap() <= 6 && response["speeds"].as_array().unwrap().len() == 160);
    }
    assert_eq!(&std::fs::read(&picture).unwrap()[..8], b"\x89PNG\r\n\x1a\n");
    let text = String::from_utf8(bench(&args).stdout).unwrap();
    let minutes = document["minutes"]["without_fall"].as_u64().unwrap();
    assert!(text.contains(&format!("a minute of random commands: {minutes} of 6 without a fall")), "{text}");
}

#[test]
fn mistakes_are_named() {
    for (args, code, message) in [
        (&["physics", "--agent", "hoper"][..], 1, "did you mean 'Hopper-v0'?"),
        (&["env", "--model", "x.xml"], 2, "unexpected argument '--model'"),
        (&["physics", "--model", "no-such.xml"], 1, "no-such.xml"),
        (&["gait", "--config", "no-such.yaml"], 1, "no-such.yaml"),
        (&["gait", "--speed", "nan"], 2, "expected a finite number of meters per second"),
        (&["gait", "--speed", "inf"], 2, "expected a finite number of meters per second"),
        (&["gait", "--falls", "101"], 2, "0 to 100"),
        (&["controller", "no-such-run"], 1, "no-such-run"),
        (
            &["controller", HOPPER],
            1,
            "Hopper-v0 has no speed command; expected a policy for one of HopperController-v0,",
        ),
        (&["controller", HOPPER, "--episodes", "0"], 2, "1 to 100000"),
        (&["train", "--isa", "f64"], 2, "single precision"),
        (&["physics", "--isa", "mmx"], 2, "unknown instruction set 'mmx'"),
        (&["physics", "--seconds", "0"], 2, "expected a positive number of seconds"),
        (&["phisics"], 2, "physics"),
        (&[], 2, "physics"),
        (&["physics", "--against", "bullet"], 2, "mujoco"),
        (&["physics", "--contacts", "none"], 2, "ground, all"),
    ] {
        let out = bench(args);
        let text = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{args:?}: {text}");
        assert!(text.contains(message), "{args:?}: {text}");
    }
}
