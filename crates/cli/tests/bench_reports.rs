//! `marathon bench` measures what it says, for people and for programs.

use serde_json::Value;
use std::process::{Command, Output};

fn bench(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_marathon")).arg("bench").args(args).output().expect("the program starts")
}

fn json(args: &[&str]) -> Value {
    let out = bench(&[args, &["--json", "--seconds", "0.05"]].concat());
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).expect("one JSON object")
}

/// What every row has; returns the rows.
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
    let rows = check(&json(&["env", "--agent", "hopper", "--isa", "baseline"]), "env", 1);
    assert_eq!((&rows[0]["lanes"], &rows[0]["frame_skip"]), (&4.into(), &4.into()));
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

#[test]
fn mistakes_are_named() {
    for (args, code, message) in [
        (&["physics", "--agent", "hoper"][..], 1, "did you mean 'Hopper-v0'?"),
        (&["env", "--model", "x.xml"], 2, "--model goes with `bench physics`"),
        (&["physics", "--model", "no-such.xml"], 1, "no-such.xml"),
        (&["train", "--isa", "f64"], 2, "single precision"),
        (&["physics", "--isa", "mmx"], 2, "unknown instruction set 'mmx'"),
        (&["physics", "--seconds", "0"], 2, "expected a positive number of seconds"),
        (&["fly"], 2, "physics"),
    ] {
        let out = bench(args);
        let text = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{args:?}: {text}");
        assert!(text.contains(message), "{args:?}: {text}");
    }
}
